"""Task rubble: L, U and blocks thrown over each other until much of the floor is covered; from side to side."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarmscope.bounds import Share
from swarmscope.errors import UnsolvableWorldError
from swarmscope.sim.world import Obstacle, Polygon, WorldSpec, compile_world
from swarmscope.tasks._check import Reach, check_places, unreachable
from swarmscope.tasks._contract import Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._occupancy import rasterise
from swarmscope.tasks._rooms import polygon
from swarmscope.tasks._trips import Floor, TripOptions, hall_width, make_trips, setup_on

NAME = "rubble"
SUMMARY = "L, U and blocks thrown over each other until two fifths of the floor are covered"
SIDE_M, ARM_M = (0.8, 3.5), (0.3, 0.8)
"""Sides of an L, a U or a block, and widths of their arms."""
INTO_WALLS_M = 0.4
"""How far things may stick into the walls beside the way, so that no lane is left along them."""
COUNTED_M = 0.1
"""Cells in which what is covered is counted."""
AT_A_TIME = 5
DRAWS = 60
"""So many floors are drawn before a seed is given up."""
FLOOR_EACH_M2 = 10.0
"""Floor for a robot, at least."""
HALL_M = 2.0

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RubbleOptions(TripOptions):
    """Sizes [m] and shares."""

    size_m: Length = 24.0  # side of the square, more for many robots
    covered: Share = 0.4  # of the square


OPTIONS = RubbleOptions


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a field of rubble that all robots can cross; options are the fields of `RubbleOptions`."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    size = max(chosen.size_m, math.sqrt(FLOOR_EACH_M2 * robots))
    hall = hall_width(robots, radius, size, HALL_M)
    for draw in range(DRAWS):
        rng = np.random.default_rng([seed, draw])
        things = _rubble(rng, size, chosen.covered)
        left, right = (-hall, 0.0, 0.0, size), (size, 0.0, size + hall, size)
        floor = Floor(things, left, right, [left, right])
        setup = setup_on(floor, *make_trips(rng, floor, robots, radius, chosen))
        if unreachable(setup, Reach(radius)).size == 0:
            check_places(setup, radius)
            return setup
    why = f"no way through in {DRAWS} draws of seed {seed}"
    raise UnsolvableWorldError(f"{NAME}: {why}; lower 'covered' or the robots' radius")


def _rubble(rng: np.random.Generator, size: float, covered: float) -> list[Obstacle]:
    """Return things within the square until they cover this share of it."""
    things: list[Obstacle] = []
    square, under = (0.0, 0.0, size, size), np.zeros(1, bool)
    while under.mean() < covered:
        more: list[Obstacle] = [_thing(rng, size) for _ in range(AT_A_TIME)]
        world = compile_world(WorldSpec(obstacles=more, bounds=square))
        under = under | rasterise(world, 0.0, square, COUNTED_M).blocked
        things += more
    return things


def _thing(rng: np.random.Generator, size: float) -> Polygon:
    """Return an L, a U or a block somewhere in the square, turned at random."""
    a, b = rng.uniform(*SIDE_M, 2)
    t = min(float(rng.uniform(*ARM_M)), 0.4 * min(a, b))
    shapes = (
        [(0, 0), (a, 0), (a, t), (t, t), (t, b), (0, b)],
        [(0, 0), (a, 0), (a, b), (a - t, b), (a - t, t), (t, t), (t, b), (0, b)],
        [(0, 0), (a, 0), (a, b), (0, b)],
    )
    corners = np.array(shapes[rng.integers(3)], float) - [0.5 * a, 0.5 * b]
    yaw = rng.uniform(0.0, 2.0 * math.pi)
    c, s = math.cos(yaw), math.sin(yaw)
    turned = corners @ np.array([[c, s], [-s, c]])
    reach = np.abs(turned).max(axis=0)
    aside = reach - [0.0, INTO_WALLS_M]
    middle = rng.uniform(aside, np.maximum(size - aside, aside))
    return polygon(turned + middle)
