"""``swarmscope new``: a task or a planner of one's own to begin with, and a test for it; both work as they are."""

from __future__ import annotations

import keyword
from pathlib import Path
from string import Template

from swarmscope.errors import ConfigError, InputFileError

TASK = '''"""Task $name: robots on a line cross to the other side, round a pillar that the seed puts somewhere."""

from typing import Annotated

import numpy as np

from swarmscope.tasks import Bounds, Circle, Setup, WorldSpec

NAME = "$name"
SUMMARY = "from one line to another, a pillar between them"


def make(
    seed: int,
    robots: int = 5,
    radius: float = 0.15,
    *,
    length_m: Annotated[float, Bounds(2.0, 50.0, "m")] = 8.0,
    pillar_m: Annotated[float, Bounds(0.0, 1.0, "m")] = 0.5,
) -> Setup:
    """Return the same world for the same seed; what stands after the star are the task's options."""
    rng = np.random.default_rng(seed)
    y = 4.0 * radius * (np.arange(robots) - 0.5 * (robots - 1))  # two radii of room between neighbours
    starts = np.column_stack([np.zeros(robots), y, np.zeros(robots)])  # x, y [m], yaw [rad]
    goals = np.column_stack([np.full(robots, length_m), y])
    pillar = Circle(center=(0.5 * length_m, float(rng.uniform(-0.5, 0.5))), radius=pillar_m + 0.05)
    edge = float(np.abs(y).max()) + pillar_m + 2.0
    world = WorldSpec(obstacles=[pillar], bounds=(-2.0, -edge, length_m + 2.0, edge))
    return Setup(world, starts, goals)
'''

TASK_TEST = '''"""Tests of task $name: pytest test_$name.py"""

from pathlib import Path

import numpy as np
import pytest

from swarmscope.errors import ConfigError
from swarmscope.tasks import setup_of_task

FILE = str(Path(__file__).with_name("$name.py"))


@pytest.mark.parametrize("robots", [1, 5, 12])
def test_every_robot_can_start_and_arrive(robots):
    setup = setup_of_task(FILE, {}, seed=0, robots=robots, radius=0.15)
    assert len(setup.starts) == robots


def test_the_same_seed_gives_the_same_world():
    one, same, other = (setup_of_task(FILE, {}, seed, 5, 0.15) for seed in (0, 0, 1))
    assert one.world == same.world and np.array_equal(one.goals, same.goals)
    assert one.world != other.world


def test_an_option_out_of_bounds_is_refused():
    with pytest.raises(ConfigError, match="length_m: must be a number from 2 to 50 m"):
        setup_of_task(FILE, {"length_m": 1.0}, seed=0, robots=5, radius=0.15)
'''

PLANNER = '''"""Planner $name: straight to the goal while that is safe, else it waits."""

from typing import Annotated, NamedTuple

import numpy as np

from swarmscope.kit import (
    ADVANCE,
    ARRIVED,
    FIRST_OWN,
    R_ARRIVED,
    R_FREE,
    YIELD,
    Bounds,
    goal_is_free,
    halt,
    head_for,
    jit,
    last_speed,
)

NAME = "$label"
SUMMARY = "straight to the goal while that is safe, else it waits"
NEEDS = "own scan, goal bearing and distance"
MEMORY = np.dtype([("arrived", np.uint8)])
REASONS = ("waits: the way to the goal is blocked",)


class Params(NamedTuple):
    """What can be set."""

    arrive_m: Annotated[float, Bounds(0.0, 1.0, "m")] = 0.05
    """Distance to the goal at which a robot has arrived."""


@jit
def decide(see, memory, params):
    """Read the percept and the safe directions of one robot, write what it wants."""
    if memory["arrived"] or see.percept["goal_distance"] <= params.arrive_m:
        memory["arrived"] = 1
        halt(see)
        see.out["state"], see.out["reason"] = ARRIVED, R_ARRIVED
    elif goal_is_free(see, False):
        head_for(see, see.percept["goal_bearing"], last_speed(see, params.arrive_m))
        see.out["state"], see.out["reason"] = ADVANCE, R_FREE
    else:
        halt(see)
        see.out["state"], see.out["reason"] = YIELD, FIRST_OWN
'''

PLANNER_TEST = '''"""Tests of planner $label: pytest test_$name.py (the first run compiles it)"""

from pathlib import Path

from swarmscope import simulate

FILE = str(Path(__file__).with_name("$name.py"))


def run(*obstacles):
    """Let one robot drive 3 m."""
    world = {"obstacles": list(obstacles), "bounds": [-5, -5, 5, 5]}
    place = {"world": world, "starts": [[0, 0, 0]], "goals": [[3, 0]]}
    scenario = {"place": place, "limit_s": 15}
    return simulate(scenario, planner=FILE, robots=1, progress=False).metrics


def test_it_drives_to_its_goal_when_nothing_is_in_the_way():
    assert run()["arrival_rate"] == 1.0


def test_it_never_touches_what_is_in_the_way():
    assert run({"type": "circle", "center": [1.5, 0.0], "radius": 0.3})["collisions"] == 0
'''

TEXTS = {"task": (TASK, TASK_TEST), "planner": (PLANNER, PLANNER_TEST)}


def new_command(kind: str, name: str) -> None:
    """Write the file and its test into the folder that one is in, or neither."""
    if not (name.isidentifier() and name.isascii()) or keyword.iskeyword(name):
        raise ConfigError(f"new {kind}: {name!r}", "must be a Python name: letters, digits and '_', no digit first")
    files = [Path(f"{name}.py"), Path(f"test_{name}.py")]
    for file in files:
        if file.exists() or file.is_symlink():
            raise InputFileError(file, "is there already; choose another name")
    for file, text in zip(files, TEXTS[kind], strict=True):
        _write(file, Template(text).substitute(name=name, label=name.replace("_", "-")))
        print(file)
    print(f"Try it: swarmscope run --{kind} {files[0]}   python -m pytest {files[1]}  (pip install pytest)")


def _write(file: Path, text: str) -> None:
    try:
        with file.open("x", encoding="utf-8") as opened:
            opened.write(text)
    except OSError as error:
        raise InputFileError(file, error.strerror or "cannot be written") from None
