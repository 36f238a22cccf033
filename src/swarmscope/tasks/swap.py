"""Task swap: T3 without trees, the robots of a ring change places with those opposite."""

from __future__ import annotations

from dataclasses import dataclass

from swarmscope.tasks._contract import Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._forest import open_field, rings

NAME = "swap"
SUMMARY = "go to the antipodal point of a ring, without any obstacle"


@dataclass(frozen=True)
class SwapOptions:
    """Size of the open field."""

    size_m: Length = 20.0  # side of a square of the same area as the disc inside the ring


OPTIONS = SwapOptions


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a ring of robots; ``seed`` changes nothing, nothing is random here."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    return open_field(rings(robots, radius, chosen.size_m), radius)
