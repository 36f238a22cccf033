"""GIWT's laboratory (5.4): five robots cross a floor of 8 x 10 m from one short side to the other.

Published are the floor, the number of robots and that maps are random. Ours: walls round the floor, obstacles of both
kinds of 5.1.1 at two fifths of their size, as the floor is to the map, 6 to 12 of them, centres uniform over the floor,
robots evenly along the short side at y = 0 in the order of their goals. Obstacles keep ``FREE_M`` off starts and goals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from swarmscope.sim.world import WorldSpec
from swarmscope.tasks._check import Reach, check_places, unreachable
from swarmscope.tasks._contract import Amount, Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._forest import smallest_spacing
from swarmscope.tasks._giwt_maps import Kind, Sizes, check_counts, draw_obstacles, draws_of, unsolvable
from swarmscope.tasks._rooms import WALL_M, closed_room

NAME = "GIWT_lab"
SUMMARY = "GIWT's laboratory: five robots cross a cluttered floor of 8 x 10 m, all in the same order"

SIDE_M = (0.2, 1.2)
RADIUS_M = (0.2, 0.8)
EDGE_M = 0.5  # from the walls to the surface of robots that start or arrive
FREE_M = 0.35  # from them to an obstacle, beyond the robot's radius


@dataclass(frozen=True)
class LabOptions:
    """The floor and what stands on it."""

    obstacles: Kind = "C"  # A rectangles, B cylinders, C both
    width_m: Length = 8.0  # wider for more robots than fit side by side
    length_m: Length = 10.0  # the way is 2 (EDGE_M + radius) shorter
    fewest: Amount = 6.0  # obstacles on it, at least
    most: Amount = 12.0  # and at most


OPTIONS = LabOptions


def make(seed: int, robots: int = 5, radius: float = 0.15, **options: Option) -> Setup:
    """Return a solvable floor; draw d of a seed uses the random stream (seed, d)."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    check_counts(chosen.fewest, chosen.most, NAME)
    width, length = max(chosen.width_m, robots * smallest_spacing(radius)), chosen.length_m
    x, aside = (np.arange(robots) + 0.5) * width / robots, EDGE_M + radius
    starts = np.column_stack([x, np.full(robots, aside), np.full(robots, 0.5 * math.pi)])
    goals = np.column_stack([x, np.full(robots, length - aside)])
    keep_free, walls = np.vstack([starts[:, :2], goals]), closed_room(0.0, 0.0, width, length)
    counts, sizes = (chosen.fewest, chosen.most), Sizes((width, length), SIDE_M, RADIUS_M)
    bounds = (-WALL_M, -WALL_M, width + WALL_M, length + WALL_M)
    draws = draws_of(chosen.most)
    for draw in range(draws):
        rng = np.random.default_rng([seed, draw])
        things = draw_obstacles(rng, chosen.obstacles, counts, sizes, keep_free, radius + FREE_M)
        setup = Setup(WorldSpec(obstacles=[*walls, *things], bounds=bounds), starts, goals)
        if unreachable(setup, Reach(radius)).size == 0:
            check_places(setup, radius)
            return setup
    raise unsolvable(NAME, seed, draws, "somebody cannot reach its goal")
