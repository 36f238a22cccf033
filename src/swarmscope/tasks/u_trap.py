"""Task u_trap: the straight way leads into a U of walls that is open to the robots."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swarmscope.tasks._contract import Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._rooms import ASIDE_M, EDGE_M, WALL_M, box, jitter, ranks, setup_of

NAME = "u_trap"
SUMMARY = "the straight way leads into a U of walls that is open to the robots"
ABREAST_M = 7.2  # width of a rank, at most
SIZES = (0.8, 1.2)  # the seed's share of the options


@dataclass(frozen=True)
class UTrapOptions:
    """Sizes [m]."""

    depth_m: Length = 3.0  # from the mouth to the back
    width_m: Length = 4.5  # between the arms; wide enough for the first rank
    before_m: Length = 2.5  # from the first robots to the mouth
    behind_m: Length = 2.0  # from the back to the first goals


OPTIONS = UTrapOptions


def make(seed: int, robots: int = 4, radius: float = 0.15, **options: Option) -> Setup:
    """Return ranks of robots before a U and goals behind it, in the same order.

    The seed changes the lengths of the arms, each by itself, the width, and how far the U is off the middle.
    """
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    rng = np.random.default_rng(seed)
    group = ranks(robots, ABREAST_M, radius)
    least = 2.0 * (float(np.abs(group.places[:, 1]).max()) + radius + ASIDE_M)
    width = max(chosen.width_m * float(rng.uniform(*SIZES)), least)
    lower, upper = (chosen.depth_m * rng.uniform(*SIZES, 2)).tolist()
    y = 0.5 * (width - least) * float(rng.uniform(-1.0, 1.0))
    low, high, back, t = y - 0.5 * width, y + 0.5 * width, max(lower, upper), WALL_M
    starts = jitter(rng, group.places * [-1.0, 1.0] - [chosen.before_m, 0.0])
    goals = (group.places - [group.depth, 0.0]) * [-1.0, 1.0] + [back + t + chosen.behind_m, 0.0]
    walls = [
        box(back, low - t, back + t, high + t),
        box(back - lower, low - t, back, low),
        box(back - upper, high, back, high + t),
    ]
    ends = np.vstack([starts, goals, [[back, low - t], [back, high + t]]])
    edge = radius + EDGE_M + 1.0
    (x0, y0), (x1, y1) = (ends.min(axis=0) - edge).tolist(), (ends.max(axis=0) + edge).tolist()
    return setup_of([*walls], starts, goals, (x0, y0, x1, y1), radius)
