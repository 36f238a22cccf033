"""``swarmscope memory``, and the maps in ``swarmscope replay --memory``."""

from __future__ import annotations

import sys
from pathlib import Path

from swarmscope.cli._code import allow_code
from swarmscope.errors import ConfigError
from swarmscope.experiments.warm_up import COMPILING, kernels_are_cold
from swarmscope.viewing.bag.make import scenario_of
from swarmscope.viewing.memories.again import Memories, play_for_memories
from swarmscope.viewing.memories.picture import turn_png, turns_of
from swarmscope.viewing.progress import QUIET_S, progress_bar
from swarmscope.viewing.run_data import RunData, load_run, replace_file

PICTURE = "memory.png"


def remembered(found: RunData, code: bool) -> Memories:
    """Play a run again; return what its robots remembered."""
    scenario = scenario_of(found.folder)
    allow_code([scenario], code)
    if kernels_are_cold(scenario.planner.name):
        print(COMPILING, file=sys.stderr)
    with progress_bar(scenario, QUIET_S) as progress:
        return play_for_memories(found, scenario, progress)


def memory_command(run_dir: Path, robot: int | None, rank: int, out: Path | None, code: bool) -> None:
    """Draw what a robot knew before and after a search."""
    found = load_run(run_dir)
    ids = [one.id for one in found.world.robots]
    if robot is not None and robot not in ids:
        raise ConfigError("--robot", f"{robot}: this run has robots {ids[0]} to {ids[-1]}")
    picture = out or found.folder / PICTURE
    if picture.suffix.lower() != ".png" or not picture.parent.is_dir():
        raise ConfigError("--out", f"{picture}: must be a .png in a folder that exists")
    memories = remembered(found, code)
    turns = turns_of(memories, None if robot is None else ids.index(robot))
    if not turns:
        raise ConfigError(str(run_dir), "nobody searched a second time in this run")
    if not 1 <= rank <= len(turns):
        raise ConfigError("--number", f"{rank}: there are {len(turns)} searches to draw")
    turn = turns[rank - 1]
    when = found.trajectory.t_s[turn.after.tick]
    print(f"robot {ids[turn.after.robot]} at {when:.1f} s: the new way is {turn.apart_m:.1f} m off the old one")
    print(replace_file(picture, turn_png(found, memories, turn)))
