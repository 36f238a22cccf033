"""Task doorway: two groups change rooms through one door."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from swarmscope.tasks._contract import Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._rooms import WALL_M, Passage, two_rooms

NAME = "doorway"
SUMMARY = "two groups change rooms through one door"
ASIDE_SHARE = 0.25  # of the room's width: how far the door is off the middle, at most


@dataclass(frozen=True)
class DoorwayOptions:
    """Sizes [m]."""

    door_m: Length = 1.0  # width of the door
    room_m: Length = 6.0  # width of the rooms
    gap_m: Length = 2.0  # from the door to the first robots


OPTIONS = DoorwayOptions


def make(seed: int, robots: int = 6, radius: float = 0.15, **options: Option) -> Setup:
    """Return two rooms with a door; the seed moves the door, the starts a little, and permutes goals."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    rng = np.random.default_rng(seed)
    y = ASIDE_SHARE * chosen.room_m * float(rng.uniform(-1.0, 1.0))
    passage = Passage(WALL_M, chosen.door_m, y, chosen.room_m, chosen.gap_m)
    return two_rooms(rng, robots, radius, passage)
