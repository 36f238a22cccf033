"""Task long_wall: a long wall across the straight way; one way round it is shorter."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.tasks._contract import Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._rooms import EDGE_M, bar, jitter, ranks, setup_of, spacing

NAME = "long_wall"
SUMMARY = "a long wall across the straight way, one way round it is shorter"
ABREAST_M = 7.2  # width of a rank, at most
LENGTHS, SHORT_SIDES = (0.85, 1.15), (0.25, 0.4)  # the seed's share of the options, and of the overhang
TILT_RAD = 0.25  # how far the wall is turned, at most


@dataclass(frozen=True)
class LongWallOptions:
    """Sizes [m]."""

    length_m: Length = 10.0  # of the wall; for wide ranks, as much longer as these are wider than 2.7 m
    distance_m: Length = 3.0  # from the wall to the first robots, and to the first goals


OPTIONS = LongWallOptions


USUAL_M = 2.7  # width of four robots of 0.15 m


def make(seed: int, robots: int = 4, radius: float = 0.15, **options: Option) -> Setup:
    """Return ranks of robots left of a wall and goals right of it, in the same order.

    The seed changes the wall's length, turns it, and decides which end is nearer and by how much.
    """
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    rng = np.random.default_rng(seed)
    group = ranks(robots, ABREAST_M, radius)
    wide = 2.0 * float(np.abs(group.places[:, 1]).max())
    length = (chosen.length_m + max(0.0, wide - USUAL_M)) * float(rng.uniform(*LENGTHS))
    if length < wide + 2.0 * spacing(radius):
        raise ConfigError(f"task {NAME}: length_m", f"a wall of {length:.2f} m does not reach across the robots")
    short = wide / 2.0 + (length - wide) * float(rng.uniform(*SHORT_SIDES))
    up = float(rng.choice([-1.0, 1.0]))
    tilt = float(rng.uniform(-TILT_RAD, TILT_RAD))
    along = up * np.array([-np.sin(tilt), np.cos(tilt)])
    near, far = short * along, (short - length) * along
    away = chosen.distance_m + 0.5 * wide * abs(float(np.tan(tilt)))
    starts = jitter(rng, group.places * [-1.0, 1.0] - [away, 0.0])
    goals = (group.places - [group.depth, 0.0]) * [-1.0, 1.0] + [away, 0.0]
    wall = bar(float(far[0]), float(far[1]), float(near[0]), float(near[1]))
    ends = np.vstack([starts, goals, near, far])
    low, high = ends.min(axis=0) - radius - EDGE_M - 1.0, ends.max(axis=0) + radius + EDGE_M + 1.0
    bounds = (float(low[0]), float(low[1]), float(high[0]), float(high[1]))
    return setup_of([wall], starts, goals, bounds, radius)
