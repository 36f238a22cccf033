"""What many runs of the benchmark say: shares, means and times with their intervals, and pairs of planners."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np

from swarmscope.barn.runs import Choice, Played
from swarmscope.judging.statistics import Interval, PairedDifference, bootstrap_mean, paired_difference, wilson


class Row(NamedTuple):
    """One planner at one speed."""

    planner: str
    speed_mps: float
    worlds: int
    arrived: int
    share: Interval
    """Of the worlds in which it arrived, Wilson."""
    collisions: int
    score: Interval
    """Mean over all worlds, bootstrap."""
    quartiles_s: tuple[float, float, float]
    """Of the times of those that arrived; NaN without any."""
    clearance_m: float
    """Smallest distance to anything in any world."""


class Pair(NamedTuple):
    """Two planners in the same worlds at the same speed."""

    first: str
    second: str
    speed_mps: float
    score: PairedDifference
    """Of the first less the second."""
    only_first: int
    """Worlds in which only the first arrived."""
    only_second: int


def rows_of(runs: Sequence[Played], choices: Sequence[Choice]) -> list[Row]:
    """Return a row for each choice."""
    return [_row([one for one in runs if _choice(one) == choice], choice) for choice in choices]


def pairs_of(runs: Sequence[Played], choices: Sequence[Choice]) -> list[Pair]:
    """Return every planner but the first beside the first, speed by speed."""
    by_speed = sorted(choices, key=lambda choice: choice.speed_mps)
    found = []
    for _, group in groupby(by_speed, key=lambda choice: choice.speed_mps):
        first, *others = group
        found += [_pair(runs, first, other) for other in others]
    return found


def as_dict(row: Row) -> dict[str, Any]:
    """Return a row for a file: intervals as [estimate, low, high]."""
    return row._asdict() | {"share": [*row.share[:3]], "score": [*row.score[:3]]}


def _row(runs: Sequence[Played], choice: Choice) -> Row:
    arrived = [one.time_s for one in runs if one.arrived]
    low, middle, high = np.quantile(arrived, [0.25, 0.5, 0.75]).tolist() if arrived else [math.nan] * 3
    clearances = [one.clearance_m for one in runs if math.isfinite(one.clearance_m)]
    return Row(
        planner=choice.planner,
        speed_mps=choice.speed_mps,
        worlds=len(runs),
        arrived=len(arrived),
        share=wilson(len(arrived), len(runs)),
        collisions=sum(one.collided for one in runs),
        score=bootstrap_mean([one.score for one in runs]),
        quartiles_s=(low, middle, high),
        clearance_m=min(clearances, default=math.nan),
    )


def _pair(runs: Sequence[Played], first: Choice, second: Choice) -> Pair:
    a, b = ([one for one in runs if _choice(one) == choice] for choice in (first, second))
    return Pair(
        first.planner,
        second.planner,
        first.speed_mps,
        paired_difference([one.score for one in a], [one.score for one in b]),
        sum(x.arrived and not y.arrived for x, y in zip(a, b, strict=True)),
        sum(y.arrived and not x.arrived for x, y in zip(a, b, strict=True)),
    )


def _choice(one: Played) -> Choice:
    return Choice(one.planner, one.speed_mps)
