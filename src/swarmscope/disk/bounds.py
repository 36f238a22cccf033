"""What no controller can beat: every robot alone on its shortest way round the obstacles at full speed."""

from __future__ import annotations

import numpy as np

from swarmscope.disk import geodesic
from swarmscope.disk.rules import Floats, Ints, Rules
from swarmscope.disk.runs import Problem

HAIR = 1e-9
"""Rounding that may not cost a step."""


def fields(of: Problem) -> tuple[Ints, Floats, Ints]:
    """Return every different goal of a problem: its map (k,) and place (k, 2), and which one each robot has."""
    runs, n = of.goal.shape[:2]
    keys = np.column_stack([np.repeat(of.map_of, n), of.permutation.ravel()])
    unique, which = np.unique(keys, axis=0, return_inverse=True)
    flat = of.goal.reshape(-1, 2)
    _, example = np.unique(which, return_index=True)
    return unique[:, 0].copy(), flat[example], np.ascontiguousarray(which.reshape(runs, n), dtype=np.int64)


def ways_of(of: Problem, margin: float = 0.0) -> tuple[geodesic.Ways, Ints]:
    """Return the ways on all maps of a problem round discs grown by r + margin, and the field of each robot."""
    field_map, field_goal, which = fields(of)
    ways = geodesic.build([one.obstacles for one in of.maps], of.rules.r + margin)
    return geodesic.add_goals(ways, field_map, field_goal), which


def shortest_lengths(of: Problem) -> Floats:
    """Return the length of each robot's shortest way (runs, n), other robots left aside."""
    ways, which = ways_of(of)
    return geodesic.lengths(ways, which, of.start.reshape(-1, 2)).reshape(which.shape)


def steps_needed(length: Floats, rules: Rules) -> Ints:
    """Return the least number of steps in which a way of that length is done, up to the tolerance at its end."""
    return np.ceil(np.maximum(length - rules.tol, 0.0) / rules.step - HAIR).astype(np.int64)


def bound(of: Problem) -> Ints:
    """Return the least number of steps of each run (runs,): that of the robot with the longest way."""
    lengths = shortest_lengths(of)
    result: Ints = steps_needed(lengths, of.rules).max(axis=1)
    return result
