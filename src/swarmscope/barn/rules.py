"""The rules of the benchmark: a world's scenario, when the robot has arrived, and the score."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from swarmscope.barn.worlds import BarnWorld
from swarmscope.errors import ConfigError
from swarmscope.scenarios.overrides import set_key
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import Scenario

LIMIT_S = 100.0
ARRIVE_M = 1.0
"""This near the goal the robot has arrived."""
BEST_MPS = 2.0
"""Speed of the time that scores compare with."""
FULL, LEAST = 2.0, 8.0
"""Times as long as that one: up to the first the score does not rise any more, from the second on it does not fall."""
RADIUS_M = 0.215
"""Half of the robot's width (Clearpath's Jackal), taken for a disc."""
THINNEST_M = 0.1
"""The guard need not see thinner things: the discs are 0.15 m wide, a third may be hidden by others."""
LOOK_AHEAD_M = 1.0
"""A direction must be free as far as the robot needs to stop from 2 m/s at 2 m/s²; the default, 2 m, was found with
lone trees and shuts gaps behind which the next disc stands."""
MARGIN_M = 1.0
"""Shown around what stands in a world."""

THEIRS = {
    "task": "the world",
    "map": "the world",
    "place": "the world",
    "robots": "one",
    "robot.v_max_mps": "given by --speed",
    "planner.name": "given by --planner",
}
"""Keys of a scenario that the benchmark sets itself."""


def scenario_of(world: BarnWorld, planner: str, speed_mps: float, changes: Sequence[str] = ()) -> Scenario:
    """Return the scenario of one robot of a highest speed [m/s] in a world; ``changes`` are ``key.path=value``.

    Nobody else is there, and nothing is thinner than the discs: the guard is told both. Planners look less far ahead
    than by default. Errors: ConfigError.
    """
    where = f"world {world.number}"
    values = scenario_values(world, planner, speed_mps)
    for change in changes:
        _check_free(change)
        set_key(values, change)
    return parse_scenario(values, where)


def scenario_values(world: BarnWorld, planner: str, speed_mps: float) -> dict[str, Any]:
    """Return the keys of that scenario that have other values than by default."""
    circles = [{"type": "circle", "center": [x, y], "radius": r} for x, y, r in world.discs.tolist()]
    thinnest = min(THINNEST_M, 2.0 * float(world.discs[:, 2].min()))
    return {
        "place": {
            "world": {"bounds": _bounds(world), "obstacles": circles},
            "starts": [list(world.start)],
            "goals": [list(world.goal)],
        },
        "planner": {"name": planner},
        "robots": 1,
        "robot": {
            "radius_m": RADIUS_M,
            "half_width_m": RADIUS_M,
            "v_max_mps": speed_mps,
            "a_max_mps2": 2.0,
            "sensor_delay_s": 0.05,
        },
        "lidar": {"beams": 360, "range_m": 5.0, "rate_hz": 20.0},
        "guard": {"others_mps": 0.0, "thinnest_m": thinnest},
        "safety": {"look_ahead_m": LOOK_AHEAD_M},
        "limit_s": LIMIT_S,
    }


def score(time_s: float, path_m: float) -> float:
    """Return the score of a robot that arrived after ``time_s``; ``path_m`` is the length of the world's own way.

    OT / clip(AT, 2 OT, 8 OT), with OT the time of that way at 2 m/s: 1/2 at best, 1/8 at worst; without an arrival
    (NaN) 0.
    """
    best_s = path_m / BEST_MPS
    return best_s / min(max(time_s, FULL * best_s), LEAST * best_s) if np.isfinite(time_s) else 0.0


def _check_free(change: str) -> None:
    """Raise a ConfigError when a change is of what the benchmark sets itself."""
    key = change.partition("=")[0]
    for name, what in THEIRS.items():
        if key == name or key.startswith(f"{name}."):
            raise ConfigError(f"--set {change}", f"'{name}' is {what} in this benchmark")


def _bounds(world: BarnWorld) -> list[float]:
    """Return the corners of what is shown: everything that stands there, start and goal."""
    points = np.vstack([world.discs[:, :2], world.start[:2], world.goal])
    return [*(points.min(axis=0) - MARGIN_M).tolist(), *(points.max(axis=0) + MARGIN_M).tolist()]
