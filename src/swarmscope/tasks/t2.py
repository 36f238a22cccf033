"""Task T2 (Nav-SCOPE): through a forest from one side to the other, goals permuted at random."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from swarmscope.tasks._contract import Option, Setup, check_robots, read_options
from swarmscope.tasks._forest import GOALS, ForestOptions, lines, plant, yaw_toward

NAME = "T2"
SUMMARY = "cross a square forest from left to right, goals permuted at random"
OPTIONS = ForestOptions


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a solvable forest and two lines; options are the fields of `ForestOptions`."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    places = lines(robots, radius, chosen.size_m)
    goals = places.goals[np.random.default_rng([seed, GOALS]).permutation(robots)]
    x, y = places.starts[:, 0], places.starts[:, 1]
    starts = np.stack([x, y, yaw_toward(x, y, goals[:, 0], goals[:, 1])], axis=1)
    return plant(seed, replace(places, starts=starts, goals=goals), radius, chosen)
