"""Task T1 (Nav-SCOPE): through a forest from one side to the other, goals in the order of the starts."""

from __future__ import annotations

from swarmscope.tasks._contract import Option, Setup, check_robots, read_options
from swarmscope.tasks._forest import ForestOptions, lines, plant

NAME = "T1"
SUMMARY = "cross a square forest from left to right, goals in the order of the starts"
OPTIONS = ForestOptions


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a solvable forest and two lines; options are the fields of `ForestOptions`."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    return plant(seed, lines(robots, radius, chosen.size_m), radius, chosen)
