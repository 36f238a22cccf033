"""Task intersection: four groups cross where two corridors meet at a right angle."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swarmscope.sim.world import Obstacle
from swarmscope.tasks._contract import Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._rooms import (
    ASIDE_M,
    BETWEEN_M,
    EDGE_M,
    WALL_M,
    Floats,
    box,
    closed_room,
    goal_ranks,
    jitter,
    ranks,
    setup_of,
    spacing,
)

NAME = "intersection"
SUMMARY = "four groups cross where two corridors meet at a right angle"
ARMS = ((-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0))  # west, south, east, north
PASSING_M = 0.3  # beside each of two robots abreast and between them, at least
WIDTHS, GAPS = (1.0, 1.2), (0.8, 1.2)  # the seed's share of the options


@dataclass(frozen=True)
class IntersectionOptions:
    """Sizes [m]."""

    width_m: Length = 2.0  # of the corridors; wider for robots of which two could not pass
    gap_m: Length = 2.5  # from the crossing to the first robots of an arm


OPTIONS = IntersectionOptions


def make(seed: int, robots: int = 8, radius: float = 0.15, **options: Option) -> Setup:
    """Return two corridors with closed ends; robot i starts in arm i mod 4 and goes to the opposite arm.

    The seed changes the widths and the ways to the crossing, and moves the starts a little. Goals lie behind
    the starts of the opposite group.
    """
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    rng = np.random.default_rng(seed)
    least = max(chosen.width_m, 4.0 * radius + 3.0 * PASSING_M)
    across = least * rng.uniform(*WIDTHS, 2)  # width of the corridor along x, and of that along y
    gaps = chosen.gap_m * rng.uniform(*GAPS, 4)
    groups = [
        ranks(len(range(arm, robots, 4)), across[arm % 2] - 2.0 * (ASIDE_M + radius), radius)
        for arm in range(4)
    ]
    starts, goals, ends = np.zeros((robots, 2)), np.zeros((robots, 2)), np.zeros(4)
    for arm, (ux, uy) in enumerate(ARMS):
        own, other = groups[arm], groups[(arm + 2) % 4]
        outward = np.array([[ux, uy], [-uy, ux]])  # from (along the arm, across it) to x, y
        first = 0.5 * across[1 - arm % 2] + gaps[arm]
        beyond = first + own.depth + BETWEEN_M + spacing(radius)
        ends[arm] = beyond + other.depth + radius + ASIDE_M
        starts[arm::4] = jitter(rng, own.places + np.array([first, 0.0])) @ outward
        # seen from the other end of the corridor, left and right are swapped
        goals[(arm + 2) % 4 :: 4] = (goal_ranks(other).places * [1.0, -1.0] + np.array([beyond, 0.0])) @ outward
    walls = _walls(0.5 * across[1], 0.5 * across[0], ends)
    edge = WALL_M + EDGE_M
    west, south, east, north = (ends + edge).tolist()
    return setup_of(walls, starts, goals, (-west, -south, east, north), radius)


def _walls(half_x: float, half_y: float, ends: Floats) -> list[Obstacle]:
    """Return a closed room and the four blocks that leave the corridors free."""
    west, south, east, north = (float(end) for end in ends)
    return [
        *closed_room(-west, -south, east, north),
        box(-west, half_y, -half_x, north),
        box(half_x, half_y, east, north),
        box(-west, -south, -half_x, -half_y),
        box(half_x, -south, east, -half_y),
    ]
