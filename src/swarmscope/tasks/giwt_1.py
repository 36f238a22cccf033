"""Task I of GIWT: starts and goals anywhere in the free space of a random map; with ``one_moves`` only robot 0 moves.

The robots that stand are already at their goals: they see and answer, and are in the way, as in the document's test.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from swarmscope.sim.world import WorldSpec, compile_world
from swarmscope.tasks._check import CLEARANCE_M, RESOLUTION_M, check_places
from swarmscope.tasks._contract import Option, Setup, check_robots, read_options
from swarmscope.tasks._forest import smallest_spacing, yaw_toward
from swarmscope.tasks._giwt_maps import MapOptions, check_counts, draw_map, draws_of, unsolvable
from swarmscope.tasks._occupancy import centres_of, components, labels_at, rasterise

NAME = "GIWT_1"
SUMMARY = "GIWT's task I: random starts and goals on a random map; by default robot 0 moves, the others stand"

FREE_M = 0.25  # from a start or goal to an obstacle, beyond the robot's radius
APART_M = 1.0  # between two robots; wider ones keep as far apart as in a line
CROWD = 40
"""With more robots the map grows."""
TRIES = 4000

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Options(MapOptions):
    """Sizes of the map, and who moves."""

    moves: Literal["one", "all"] = "one"  # one: robot 0, the others stand; all: everybody


OPTIONS = Options


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a solvable map with robots in its free space; options are the fields of `Options`."""
    check_robots(robots, radius)
    chosen = grown(read_options(OPTIONS, options, NAME), robots)
    check_counts(chosen.fewest, chosen.most, NAME)
    draws = draws_of(chosen.most)
    for draw in range(draws):
        rng = np.random.default_rng([seed, draw])
        world = draw_map(rng, chosen, np.zeros((0, 2)), 0.0)
        starts = scatter(rng, world, robots, radius, chosen)
        if starts is None:
            continue
        points, goals = starts
        if chosen.moves == "one":
            goals = np.vstack([goals[:1], points[1:]])
        yaw = yaw_toward(points[:, 0], points[:, 1], goals[:, 0], goals[:, 1])
        setup = Setup(world, np.column_stack([points, yaw]), goals)
        check_places(setup, radius)
        return setup
    raise unsolvable(NAME, seed, draws, f"{robots} robots do not fit")


def grown(options: Options, robots: int) -> Options:
    """Return the options with a map that has room for ``robots`` robots, obstacles as dense as before."""
    times = max(1.0, robots / CROWD)
    size, few, many = options.size_m * math.sqrt(times), options.fewest * times, options.most * times
    return replace(options, size_m=size, fewest=few, most=many)


def scatter(
    rng: np.random.Generator, world: WorldSpec, robots: int, radius: float, options: MapOptions
) -> tuple[Floats, Floats] | None:
    """Return starts and goals (N, 2) [m] in one connected part of the free space, or None where they do not fit.

    All starts and goals keep APART_M or more off each other, and each goal lies at least ``apart_m`` from its start.
    """
    size, apart = options.size_m, max(APART_M, smallest_spacing(radius))
    reach = rasterise(compile_world(world), radius + CLEARANCE_M, (0.0, 0.0, size, size), RESOLUTION_M)
    room = rasterise(compile_world(world), radius + FREE_M, (0.0, 0.0, size, size), RESOLUTION_M)
    cells = np.argwhere(room.blocked == 0)
    if len(cells) == 0:
        return None
    picked = cells[rng.integers(0, len(cells), TRIES)]
    labels = labels_at(components(reach), picked)
    part = np.bincount(labels[labels >= 0]).argmax()  # the part with most room
    points = centres_of(reach, picked[labels == part])
    starts = _apart(points, robots, apart)
    if len(starts) < robots:
        return None
    taken, goals = starts, np.zeros((0, 2))
    for start in starts:
        fits = apart_from(points, taken, apart) & (np.hypot(*(points - start).T) >= options.apart_m)
        if not fits.any():
            return None
        goal = points[rng.choice(np.flatnonzero(fits))]
        taken, goals = np.vstack([taken, goal]), np.vstack([goals, goal])
    return starts, goals


def _apart(points: Floats, count: int, apart: float) -> Floats:
    """Return the first ``count`` points that keep ``apart`` [m] off each other, fewer if there are not so many."""
    taken = np.zeros((0, 2))
    for point in points:
        if len(taken) == count:
            break
        if apart_from(point[None], taken, apart)[0]:
            taken = np.vstack([taken, point])
    return taken


def apart_from(points: Floats, taken: Floats, apart: float = APART_M) -> NDArray[np.bool_]:
    """Tell which points (N, 2) keep ``apart`` [m] off all points of ``taken (K, 2)``."""
    between = points[:, None, :] - taken[None, :, :]
    return np.asarray((np.hypot(between[..., 0], between[..., 1]) >= apart).all(axis=1))

