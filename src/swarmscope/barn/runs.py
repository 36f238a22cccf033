"""The benchmark's runs: one job for each world, in as many processes as one likes, with the same results."""

from __future__ import annotations

import json
import math
import os
import traceback
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from swarmscope.barn.rules import ARRIVE_M, scenario_of, score
from swarmscope.barn.worlds import Worlds
from swarmscope.errors import SwarmscopeError, UnsolvableWorldError
from swarmscope.experiments.engines.local import Local
from swarmscope.judging.references import References
from swarmscope.judging.run import Outcome, failures, play
from swarmscope.judging.shortest_path import any_angle_paths, lengths_m
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import complete

NOT_ASKED = References(np.array([math.nan]), np.array([math.nan]), 0.0)
"""Shortest ways are no part of the score where the world has its own."""


class Choice(NamedTuple):
    """Who drives, and how fast at most."""

    planner: str
    """Name or FILE.py."""
    speed_mps: float


class Played(NamedTuple):
    """How one run ended."""

    world: int
    planner: str
    speed_mps: float
    arrived: bool
    collided: bool
    time_s: float
    """Until the robot was 1 m from the goal; NaN when it did not arrive."""
    path_m: float
    """Length of the world's own way [m]."""
    own_path: bool
    """Whether the challenge says that length; else it is the shortest way of a disc like the robot."""
    score: float
    clearance_m: float
    """Smallest distance to anything; NaN for a world that was refused."""
    why: str
    """Why it did not arrive, empty when it did."""


def play_all(
    worlds: Worlds,
    numbers: Sequence[int],
    choices: Sequence[Choice],
    changes: Sequence[str] = (),
    workers: int | None = None,
    progress: Callable[[int], None] | None = None,
) -> list[Played]:
    """Play every choice in every world, in ``workers`` processes (one for each core if None); worlds come in order.

    ``progress`` is called with the number of runs done. Errors: those of worlds and of scenarios, SwarmscopeError.
    """
    processes = min(workers or len(os.sched_getaffinity(0)), len(numbers))
    jobs = (make_job(worlds, number, choices, changes) for number in numbers)
    answers = map(play_world, jobs) if processes == 1 else Local(processes, play_world).answers(jobs)
    found: dict[int, list[Played]] = {}
    for number, played in _read(answers, choices):
        found[number] = played
        if progress is not None:
            progress(len(found) * len(choices))
    return [one for number in numbers for one in found[number]]


def make_job(worlds: Worlds, number: int, choices: Sequence[Choice], changes: Sequence[str]) -> str:
    """Return a world's runs as text."""
    world = worlds.read(number)
    configs = [complete(scenario_of(world, *choice, changes)) for choice in choices]
    path_m = world.path_m if math.isfinite(world.path_m) else None
    return json.dumps({"key": str(number), "world": str(number), "path_m": path_m, "configs": configs})


def play_world(job: str) -> str:
    """Play a world's runs; whatever goes wrong in them becomes the answer's error."""
    asked = json.loads(job)
    where = f"world {asked['world']}"
    try:
        answer: dict[str, Any] = {"runs": [_play(parse_scenario(config, where)) for config in asked["configs"]]}
        answer["path_m"] = asked["path_m"] or _shortest_m(parse_scenario(asked["configs"][0], where))
        answer["own_path"] = asked["path_m"] is not None
    except SwarmscopeError as error:
        answer = {"error": f"{where}: {str(error).removeprefix(f'{where}: ')}"}
    except Exception as error:  # a bug in one run, told with its place
        last = traceback.extract_tb(error.__traceback__)[-1]
        answer = {"error": f"{where}: {type(error).__name__}: {error} ({last.name}, line {last.lineno})"}
    return json.dumps({"key": asked["key"]} | answer)


def _read(answers: Iterator[str], choices: Sequence[Choice]) -> Iterator[tuple[int, list[Played]]]:
    """Yield each world's runs; the first error ends it."""
    for answer in map(json.loads, answers):
        if "error" in answer:
            raise SwarmscopeError(answer["error"])
        number, path_m, own = int(answer["key"]), float(answer["path_m"]), bool(answer["own_path"])
        runs = zip(choices, answer["runs"], strict=True)
        yield (
            number,
            [
                Played(number, *choice, path_m=path_m, own_path=own, score=score(run["time_s"], path_m), **run)
                for choice, run in runs
            ],
        )


def _play(scenario: Scenario) -> dict[str, Any]:
    """Play one run. A world that such a robot cannot cross is one in which it does not arrive."""
    try:
        outcome = play(scenario, references=NOT_ASKED)
    except UnsolvableWorldError as error:
        nothing = {"arrived": False, "collided": False, "time_s": math.nan, "clearance_m": math.nan}
        return nothing | {"why": str(error)}
    robot = outcome.trace.robots[0]
    collided, time_s = bool(robot["crashed"]), _reached_s(outcome)
    arrived = math.isfinite(time_s) and not collided
    return {
        "arrived": arrived,
        "collided": collided,
        "time_s": time_s if arrived else math.nan,
        "clearance_m": float(robot["min_clearance"]),
        "why": "" if arrived else _why(outcome),
    }


def _reached_s(outcome: Outcome) -> float:
    """Return when the robot was near enough to its goal for the first time [s], NaN if never."""
    trace, robot = outcome.trace, outcome.trace.robots[0]
    x, y = np.append(trace.records.x[:, 0], robot["x"]), np.append(trace.records.y[:, 0], robot["y"])
    goal = outcome.setup.goals[0]
    near = np.flatnonzero(np.hypot(x - goal[0], y - goal[1]) <= ARRIVE_M)
    return float(near[0] * outcome.setting.dt) if near.size else math.nan


def _why(outcome: Outcome) -> str:
    """Say how a robot ended that did not arrive."""
    robot, goal = outcome.trace.robots[0], outcome.setup.goals[0]
    to_go = math.hypot(robot["x"] - goal[0], robot["y"] - goal[1])
    return f"collided, {to_go:.1f} m from its goal" if robot["crashed"] else str(failures(outcome)[0]["why"])


def _shortest_m(scenario: Scenario) -> float:
    """Return the length [m] of the robot's shortest way, for a world that says none; NaN where it has none."""
    try:
        setup = make_setup(scenario)
    except UnsolvableWorldError:
        return math.nan
    return float(lengths_m(any_angle_paths(setup.world, setup.starts, setup.goals, scenario.widest.radius_m))[0])
