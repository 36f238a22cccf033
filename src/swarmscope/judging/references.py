"""The shortest ways that runs are compared with; they depend on the world alone."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from swarmscope.judging.shortest_path import any_angle_paths, grid_paths, lengths_m
from swarmscope.tasks import Setup

ANY_ANGLE_ROBOTS = 50
"""With more robots the any-angle reference, which takes longer than the run, is left out."""
SEARCHED_M2 = 1e6
"""Sum of (start to goal)^2 over the robots that get an A* reference: some 5 s of search. Who has far more gets none."""


class References(NamedTuple):
    """The shortest ways of a world's robots, which do not depend on who plans."""

    shortest_m: np.ndarray
    """(N,) A* lengths, NaN without."""
    any_angle_m: np.ndarray
    """(N,) true shortest lengths, NaN without."""
    wall_s: float
    """How long they took to find (measured)."""


def reference_ways(setup: Setup, radius: float | Sequence[float], any_angle: bool = True) -> References:
    """Find the shortest ways of robots of ``radius`` [m], of all or of each."""
    radii = np.broadcast_to(np.asarray(radius, float), len(setup.starts))
    if radii.max() > radii.min():
        return _of_each_size(setup, radii, any_angle)
    radius = float(radii[0])
    robots = len(setup.starts)
    begun = time.perf_counter()
    chosen = _with_reference(setup)
    ways = grid_paths(setup.world, setup.starts[chosen], setup.goals[chosen], radius) if chosen.size else []
    wall_s = time.perf_counter() - begun
    shortest, best = np.full((2, robots), np.nan)
    shortest[chosen] = lengths_m(ways)
    if any_angle and len(chosen) == robots <= ANY_ANGLE_ROBOTS:
        best = lengths_m(any_angle_paths(setup.world, setup.starts, setup.goals, radius, ways))
    return References(shortest, best, wall_s)


def _of_each_size(setup: Setup, radii: np.ndarray, any_angle: bool) -> References:
    """Find the shortest ways of robots of several ``radii`` (N,) [m]."""
    shortest, best, wall_s = *np.full((2, len(radii)), np.nan), 0.0
    for radius in np.unique(radii).tolist():
        alike = np.flatnonzero(radii == radius)
        found = reference_ways(Setup(setup.world, setup.starts[alike], setup.goals[alike]), radius, any_angle)
        shortest[alike], best[alike] = found.shortest_m, found.any_angle_m
        wall_s += found.wall_s
    return References(shortest, best, wall_s)


def _with_reference(setup: Setup) -> np.ndarray:
    """Return the robots that get a reference way: all, or of a large swarm evenly chosen ones."""
    robots = len(setup.starts)
    apart = setup.goals - setup.starts[:, :2]
    share = min(1.0, SEARCHED_M2 / max(1.0, float((apart * apart).sum())))
    chosen: np.ndarray = np.unique(np.linspace(0, robots - 1, max(1, int(share * robots))).astype(int))
    near: np.ndarray = (apart[chosen] ** 2).sum(axis=1) <= 4.0 * SEARCHED_M2
    return np.asarray(chosen[near])
