"""Task corridor: two groups meet head-on in a corridor in which two robots can pass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swarmscope.tasks._contract import Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._rooms import Passage, two_rooms

NAME = "corridor"
SUMMARY = "two groups meet head-on in a corridor in which two robots can pass"
PASSING_M = 0.3  # beside each of two robots abreast and between them, at least
LENGTHS, WIDTHS = (0.8, 1.2), (1.0, 1.15)  # the seed's share of the options


@dataclass(frozen=True)
class CorridorOptions:
    """Sizes [m]."""

    width_m: Length = 1.5  # of the corridor; wider for robots that could not pass in it
    length_m: Length = 8.0  # of the corridor
    room_m: Length = 4.0  # width of the rooms at both ends
    gap_m: Length = 1.2  # from the corridor to the first robots


OPTIONS = CorridorOptions


def make(seed: int, robots: int = 6, radius: float = 0.15, **options: Option) -> Setup:
    """Return two rooms and a corridor between them; the seed changes its length, width and place, moves the
    starts a little, and permutes goals."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    rng = np.random.default_rng(seed)
    length = chosen.length_m * float(rng.uniform(*LENGTHS))
    width = max(chosen.width_m, 4.0 * radius + 3.0 * PASSING_M) * float(rng.uniform(*WIDTHS))
    room = max(chosen.room_m, width + 1.0)
    y = 0.5 * (room - width) * 0.6 * float(rng.uniform(-1.0, 1.0))
    return two_rooms(rng, robots, radius, Passage(length, width, y, room, chosen.gap_m))
