"""Task II of GIWT: robots in a column on one side of a random map, all moving to the other side."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from swarmscope.tasks._check import Reach, check_places, unreachable
from swarmscope.tasks._contract import Option, Setup, check_robots, read_options
from swarmscope.tasks._giwt_maps import MapOptions, check_counts, draw_map, draws_of, unsolvable

NAME = "GIWT_2"
SUMMARY = "GIWT's task II: a column of robots crosses a random map from left to right, all in the same order"
OPTIONS = MapOptions

EDGE_M = 0.5  # from the walls to the starts and the goals
FREE_M = 0.35  # from them to an obstacle, beyond the robot's radius

Floats = NDArray[np.float64]


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a solvable map and two columns; options are the fields of `MapOptions`."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    check_counts(chosen.fewest, chosen.most, NAME)
    starts, goals = columns(robots, radius, chosen.size_m)
    draws = draws_of(chosen.most)
    for draw in range(draws):
        rng = np.random.default_rng([seed, draw])
        world = draw_map(rng, chosen, np.vstack([starts[:, :2], goals]), radius + FREE_M)
        setup = Setup(world, starts, goals)
        if unreachable(setup, Reach(radius)).size == 0:
            check_places(setup, radius)
            return setup
    raise unsolvable(NAME, seed, draws, "somebody cannot reach its goal")


def columns(robots: int, radius: float, size: float) -> tuple[Floats, Floats]:
    """Return starts (N, 3) on the left side and goals (N, 2) opposite them; several columns if one is too short."""
    step = 2.0 * radius + 0.4
    per_column = max(1, int((size - 2.0 * EDGE_M) / step))
    column, place = np.divmod(np.arange(robots), per_column)
    in_column = np.where(column < column[-1], per_column, robots - column[-1] * per_column)
    y = EDGE_M + (place + 0.5) * (size - 2.0 * EDGE_M) / in_column
    x = EDGE_M + radius + column * step
    goals = np.column_stack([size - EDGE_M - radius - (column[-1] - column) * step, y])
    return np.column_stack([x, y, np.zeros(robots)]), goals
