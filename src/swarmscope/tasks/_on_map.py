"""Robots at random places of a given map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import UnsolvableWorldError
from swarmscope.sim.world import WorldSpec, compile_world
from swarmscope.tasks._check import CLEARANCE_M, RESOLUTION_M, check_places
from swarmscope.tasks._contract import Setup, check_robots
from swarmscope.tasks._occupancy import Raster, cells_of, centres_of, components, largest_label, rasterise
from swarmscope.tasks._search import Searcher

STARTS, GOALS = 1, 2  # purposes: each has its own random stream
TRIES_PER_ROBOT = 1000
SEARCHES_PER_ROBOT = 50

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def place_on_map(spec: WorldSpec, seed: int, robots: int, radius: float, min_distance: float) -> Setup:
    """Return random starts and goals in the largest connected free part of the map, inside its bounds.

    Starts are at least 4 ``radius`` apart from one another, more for the smallest robots, and so are goals; every
    goal is at least ``min_distance`` [m] from its start along the shortest 8-connected path. Each robot starts
    with its heading toward its goal.
    """
    check_robots(robots, radius)
    raster = rasterise(compile_world(spec), radius + CLEARANCE_M, spec.bounds, RESOLUTION_M)
    free = _largest_part(raster)
    apart = max(4.0 * radius, 2.0 * (radius + CLEARANCE_M))
    starts = _Scatter(raster, free, apart, np.random.default_rng([seed, STARTS]))
    goals = _Scatter(raster, free, apart, np.random.default_rng([seed, GOALS]))
    searcher = Searcher(raster)
    for robot in range(robots):
        start = starts.draw()
        if start is None:
            raise UnsolvableWorldError(f"robot {robot}: no room for its start, {apart:g} m from the other starts")
        starts.take(start)
        goals.take(_goal_for(robot, start, goals, searcher, min_distance))
    start_points, goal_points = np.array(starts.taken), np.array(goals.taken)
    ahead = goal_points - start_points
    yaw = np.arctan2(ahead[:, 1], ahead[:, 0])
    setup = Setup(spec, np.column_stack([start_points, yaw]), goal_points)
    check_places(setup, radius)
    return setup


def _largest_part(raster: Raster) -> Ints:
    """Return the cells (K, 2) of the largest connected free part."""
    found = components(raster)
    label = largest_label(found)
    if label < 0:
        raise UnsolvableWorldError("the map has no free cell for a robot of this radius")
    rows = np.repeat(np.arange(raster.blocked.shape[0]), np.diff(found.row_first))
    ours = found.label == label
    first, length = found.run_start[ours], (found.run_end - found.run_start)[ours]
    within = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
    return np.column_stack([np.repeat(rows[ours], length), np.repeat(first, length) + within])


def _goal_for(robot: int, start: Floats, goals: _Scatter, searcher: Searcher, min_distance: float) -> Floats:
    for _ in range(SEARCHES_PER_ROBOT):
        goal = goals.draw()
        if goal is None:
            break
        if float(np.hypot(*(goal - start))) >= min_distance:
            return goal
        ends = cells_of(searcher.raster, np.stack([start, goal]))
        if searcher.length_m(ends[0], ends[1]) >= min_distance:
            return goal
    raise UnsolvableWorldError(
        f"robot {robot}: found no free goal at least {min_distance:g} m from its start"
    )


class _Scatter:
    """Random cell centres, each at least ``apart`` from those taken before."""

    def __init__(self, raster: Raster, free: Ints, apart: float, rng: np.random.Generator) -> None:
        self.raster, self.free, self.apart, self.rng = raster, free, apart, rng
        self.taken: list[Floats] = []

    def take(self, point: Floats) -> None:
        """Keep later points off this one."""
        self.taken.append(point)

    def draw(self) -> Floats | None:
        """Return a point that keeps its distance, None when none was found."""
        others = np.array(self.taken).reshape(-1, 2)
        for _ in range(TRIES_PER_ROBOT):
            point: Floats = centres_of(self.raster, self.free[self.rng.integers(len(self.free))][None, :])[0]
            gap = others - point
            if np.all(np.hypot(gap[:, 0], gap[:, 1]) >= self.apart):
                return point
        return None
