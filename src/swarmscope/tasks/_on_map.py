"""Robots at random places of a given map."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.world import WorldSpec, compile_world
from swarmscope.tasks._check import CLEARANCE_M, RESOLUTION_M, check_places, check_setup
from swarmscope.tasks._contract import Setup, check_robots
from swarmscope.tasks._occupancy import Raster, cells_of, centres_of, components, largest_label, rasterise
from swarmscope.tasks._search import Searcher

STARTS, GOALS = 1, 2  # purposes: each has its own random stream
TRIES_PER_ROBOT = 1000
SEARCHES_PER_ROBOT = 50
LARGEST_GRID_CELLS = 40_000_000  # of a grid that is searched; larger maps are searched on a coarser one
SEARCHED_CELLS = 500_000_000  # fewer searches for a robot on large grids
USUAL_M = 8.0
"""How far starts are from goals if nobody says so, ..."""
SHARE = 0.4
"""... at most this share of the longer side of the free space."""

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Wanted(NamedTuple):
    """Which robots are to be put on a map."""

    seed: int
    robots: int
    radius: float
    """Of each [m]."""
    min_distance: float | None
    """From a start to its goal, where one of them is drawn [m]; None: `USUAL_M`, less in short maps."""
    starts: Sequence[Sequence[float] | None] = ()
    """Those that are given, in the order of the robots: x, y or x, y, yaw [m, m, rad]; None is drawn."""
    goals: Sequence[Sequence[float] | None] = ()
    """In the same way; yaw is a heading to turn to."""
    radii: Sequence[float] = ()
    """Of each robot [m], where they differ; ``radius`` is the largest."""


def place_on_map(spec: WorldSpec, seed: int, robots: int, radius: float, min_distance: float) -> Setup:
    """Return random starts and goals in the largest connected free part of the map, inside its bounds.

    Starts are at least 4 ``radius`` apart from one another, more for the smallest robots, and so are goals; every
    goal is at least ``min_distance`` [m] from its start along the shortest 8-connected path. Each robot starts
    with its heading toward its goal.
    """
    return place_wanted(spec, Wanted(seed, robots, radius, min_distance))


def place_wanted(spec: WorldSpec, wanted: Wanted) -> Setup:
    """Return starts and goals as given, and the others as `place_on_map` draws them."""
    robots, radius = wanted.robots, wanted.radius
    check_robots(robots, radius)
    starts, goals = _filled(wanted.starts, robots), _filled(wanted.goals, robots)
    _check_given(spec, wanted)
    if None in starts or None in goals:
        _draw_missing(spec, wanted, starts, goals)
    points = np.array([start[:2] for start in starts if start is not None])
    goal_points = np.array([goal[:2] for goal in goals if goal is not None])
    turns = np.array([goal[2] if goal is not None and len(goal) > 2 else np.nan for goal in goals])
    ahead = goal_points - points
    yaw = np.arctan2(ahead[:, 1], ahead[:, 0])
    for robot, start in enumerate(starts):
        if start is not None and len(start) > 2:
            yaw[robot] = start[2]
    goal_yaws = turns if np.isfinite(turns).any() else None
    setup = Setup(spec, np.column_stack([points, yaw]), goal_points, goal_yaws)
    if wanted.starts or wanted.goals:
        check_setup(setup, wanted.radii or radius)
    else:
        check_places(setup, radius)
    return setup


def _filled(given: Sequence[Sequence[float] | None], robots: int) -> list[Sequence[float] | None]:
    return [*given, *[None] * (robots - len(given))]


def _check_given(spec: WorldSpec, wanted: Wanted) -> None:
    """Raise a ConfigError with the key of a start or goal that is given where no robot can be."""
    world = compile_world(spec)
    x0, y0, x1, y1 = spec.bounds
    for key, given in (("starts", wanted.starts), ("goals", wanted.goals)):
        for robot, place in enumerate(given):
            if place is None:
                continue
            x, y, where = place[0], place[1], f"map.{key}[{robot}]"
            radius = wanted.radii[robot] if wanted.radii else wanted.radius
            if not (x0 <= x <= x1 and y0 <= y <= y1):
                box = f"[{x0:g}, {x1:g}] x [{y0:g}, {y1:g}] m"
                raise ConfigError(where, f"({x:g}, {y:g}) is off the map, which covers {box}")
            free = static_clearance(world, x, y, x, y, 2.0 * radius)
            if free <= radius:
                why = f"({x:g}, {y:g}) is {free:.3f} m from something solid; a robot of radius {radius:g} m"
                raise ConfigError(where, f"{why} needs more: move it, or make the robot smaller")


def _draw_missing(
    spec: WorldSpec, wanted: Wanted, starts: list[Sequence[float] | None], goals: list[Sequence[float] | None]
) -> None:
    """Draw what is None among ``starts`` and ``goals``."""
    radius = wanted.radius
    raster = _raster_of(spec, radius)
    free = _largest_part(raster)
    apart = max(4.0 * radius, 2.0 * (radius + CLEARANCE_M))
    some_starts = _Scatter(raster, free, apart, np.random.default_rng([wanted.seed, STARTS]))
    some_goals = _Scatter(raster, free, apart, np.random.default_rng([wanted.seed, GOALS]))
    for scatter, given in ((some_starts, starts), (some_goals, goals)):
        scatter.taken += [np.array(place[:2]) for place in given if place is not None]
    least = wanted.min_distance if wanted.min_distance is not None else _usual_distance(raster, free)
    searcher = Searcher(raster)
    for robot in range(wanted.robots):
        goal, start = goals[robot], starts[robot]
        if start is None and goal is not None:
            starts[robot] = some_starts.take(_place_for(robot, "start", np.array(goal), some_starts, searcher, least))
            continue
        if start is None:
            drawn = some_starts.draw()
            if drawn is None:
                raise UnsolvableWorldError(
                    f"robot {robot}: no room for its start, {apart:g} m from the other starts: "
                    "put fewer or smaller robots there"
                )
            start = starts[robot] = some_starts.take(drawn)
        if goal is None:
            here = np.array(start[:2])
            goals[robot] = some_goals.take(_place_for(robot, "goal", here, some_goals, searcher, least))


def _raster_of(spec: WorldSpec, radius: float) -> Raster:
    x0, y0, x1, y1 = spec.bounds
    resolution = max(RESOLUTION_M, math.sqrt((x1 - x0) * (y1 - y0) / LARGEST_GRID_CELLS))
    return rasterise(compile_world(spec), radius + CLEARANCE_M, spec.bounds, resolution)


def _usual_distance(raster: Raster, free: Ints) -> float:
    """Return how far starts are from goals in this map, if nobody says so [m]."""
    return min(USUAL_M, SHARE * raster.resolution * float(np.ptp(free, axis=0).max()))


def _largest_part(raster: Raster) -> Ints:
    """Return the cells (K, 2) of the largest connected free part."""
    found = components(raster)
    label = largest_label(found)
    if label < 0:
        raise UnsolvableWorldError(
            "the map has no room for such a robot: what is dark, transparent or unknown is not free (docs/maps.md)"
        )
    rows = np.repeat(np.arange(raster.blocked.shape[0]), np.diff(found.row_first))
    ours = found.label == label
    first, length = found.run_start[ours], (found.run_end - found.run_start)[ours]
    within = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
    return np.column_stack([np.repeat(rows[ours], length), np.repeat(first, length) + within])


def _place_for(robot: int, what: str, other: Floats, places: _Scatter, searcher: Searcher, least: float) -> Floats:
    """Return a start or goal at least so far [m] from the robot's other end."""
    searches = max(2, SEARCHED_CELLS // searcher.raster.blocked.size)
    for _ in range(SEARCHES_PER_ROBOT):
        place = places.draw()
        if place is None:
            break
        if float(np.hypot(*(place - other))) >= least:
            return place
        searches -= 1
        if searches < 0:
            break
        ends = cells_of(searcher.raster, np.stack([other, place]))
        if searcher.length_m(ends[0], ends[1]) >= least:
            return place
    raise UnsolvableWorldError(
        f"robot {robot}: found no free {what} at least {least:g} m from its {'start' if what == 'goal' else 'goal'}: "
        "lower map.min_distance_m, or put fewer robots there"
    )


class _Scatter:
    """Random cell centres, each at least ``apart`` from those taken before."""

    def __init__(self, raster: Raster, free: Ints, apart: float, rng: np.random.Generator) -> None:
        self.raster, self.free, self.apart, self.rng = raster, free, apart, rng
        self.taken: list[Floats] = []

    def take(self, point: Floats) -> list[float]:
        """Keep later points off this one; return it as plain numbers."""
        self.taken.append(point)
        return [float(value) for value in point]

    def draw(self) -> Floats | None:
        """Return a point that keeps its distance, None when none was found."""
        others = np.array(self.taken).reshape(-1, 2)
        for _ in range(TRIES_PER_ROBOT):
            point: Floats = centres_of(self.raster, self.free[self.rng.integers(len(self.free))][None, :])[0]
            gap = others - point
            if np.all(np.hypot(gap[:, 0], gap[:, 1]) >= self.apart):
                return point
        return None
