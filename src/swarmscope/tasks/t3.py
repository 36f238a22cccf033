"""Task T3 (Nav-SCOPE): from a ring round a forest to the antipodal points, all through the middle."""

from __future__ import annotations

from swarmscope.tasks._contract import Option, Setup, check_robots, read_options
from swarmscope.tasks._forest import ForestOptions, plant, rings

NAME = "T3"
SUMMARY = "cross a round forest to the antipodal point of a ring"
OPTIONS = ForestOptions


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a solvable forest and a ring; options are the fields of `ForestOptions`."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    return plant(seed, rings(robots, radius, chosen.size_m), radius, chosen)
