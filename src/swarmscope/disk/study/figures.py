"""What runs of the unit disk come to: rows like Table 1 of the report, comparisons in pairs, and all runs as CSV."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from swarmscope.disk.bounds import bound
from swarmscope.disk.rules import Floats, Ints
from swarmscope.disk.runs import (
    ARRIVED,
    COLLISIONS,
    HIT_OBSTACLE,
    HIT_ROBOT,
    INVALID,
    LEFT_DISK,
    STATUS_WORDS,
    Outcome,
    Problem,
)
from swarmscope.errors import SwarmscopeError
from swarmscope.judging.statistics import Interval, PairedDifference, bootstrap_mean, paired_difference, wilson


class ImpossibleResultError(SwarmscopeError):
    """A result that is better than the bound which nothing can beat."""


class Published(NamedTuple):
    """A row of Table 1 of the unit-disk report."""

    arrived: int
    mean: float
    sd: float
    most: int
    least: int


PUBLISHED = {
    "c0": Published(120, 9794.98, 5047, 26635, 6449),
    "u": Published(120, 11672.46, 4557, 24677, 6449),
    "crevice": Published(120, 10234.85, 2353, 15860, 6449),
    "one-disc": Published(120, 8450.42, 2114, 14906, 6449),
    "minima": Published(113, 13355.84, 5806, 30000, 6775),
}
"""Unit-disk report, Table 1, by our names of its maps."""

DIFFERENCE = (
    "The report's controller in our hands arrives in 593 of 600 runs as printed, and on one-disc every figure is the "
    "printed one, but for the standard deviation. The means of the other maps differ from the printed ones by 0.3 to "
    "2.3 %, and the longest runs by more, so those runs were made with slightly different code or obstacles. The "
    "printed standard deviations are 1.1 to 1.95 times ours; on one-disc, where all runs are the same, 2114 is "
    "printed and 1086 is the deviation of the 120 runs."
)


class Played(NamedTuple):
    """Runs of a problem by one controller."""

    label: str
    problem: Problem
    outcome: Outcome
    bound: Ints

    @property
    def steps(self) -> Floats:
        """Steps of each run; a run that did not arrive counts with all the steps that it had."""
        arrived = self.outcome.status == ARRIVED
        steps: Floats = np.where(arrived, self.outcome.steps, self.problem.rules.max_steps).astype(np.float64)
        return steps


class Row(NamedTuple):
    """Figures of some runs."""

    controller: str
    place: str
    runs: int
    arrived: int
    share: Interval
    mean: float
    sd: float
    most: int
    least: int
    bound: float
    """Mean of the least steps that any controller needs."""
    ratio: float
    """Mean steps over mean bound."""
    ratios: Interval
    """Mean over the runs of steps over bound."""
    hit_robot: int
    hit_obstacle: int
    left_disk: int
    robot_gap: float
    obstacle_gap: float

    @property
    def collisions(self) -> int:
        """Runs that ended by contact."""
        return self.hit_robot + self.hit_obstacle + self.left_disk


def played(label: str, problem: Problem, outcome: Outcome, least: Ints | None = None) -> Played:
    """Return runs with their bounds (computed if not given). Errors: ImpossibleResultError."""
    found = Played(label, problem, outcome, bound(problem) if least is None else least)
    below = np.flatnonzero((outcome.status == ARRIVED) & (outcome.steps < found.bound))
    if below.size:
        b = int(below[0])
        name = problem.maps[problem.map_of[b]].name
        raise ImpossibleResultError(
            f"{label}: impossible: on map {name}, permutation {_permutation(problem, b)}, all arrived after "
            f"{outcome.steps[b]} steps, and nobody can need fewer than {found.bound[b]}: the judge was tampered with, "
            "or is wrong; please report it"
        )
    return found


def collided(of: Played) -> bool:
    """Tell whether some run ended by contact, or without a valid velocity."""
    return bool(np.isin(of.outcome.status, (*COLLISIONS, INVALID)).any())


def row(of: Played, place: str, runs: Sequence[int] | Ints | None = None) -> Row:
    """Return the figures of some runs (all if None)."""
    chosen = np.arange(len(of.bound)) if runs is None else np.asarray(runs)
    status, steps, least = of.outcome.status[chosen], of.steps[chosen], of.bound[chosen]
    arrived = int((status == ARRIVED).sum())
    return Row(
        controller=of.label,
        place=place,
        runs=len(chosen),
        arrived=arrived,
        share=wilson(arrived, len(chosen)),
        mean=float(steps.mean()),
        sd=float(steps.std()),
        most=int(steps.max()),
        least=int(steps.min()),
        bound=float(least.mean()),
        ratio=float(steps.mean() / least.mean()),
        ratios=bootstrap_mean(steps / least),
        hit_robot=int((status == HIT_ROBOT).sum()),
        hit_obstacle=int((status == HIT_OBSTACLE).sum()),
        left_disk=int((status == LEFT_DISK).sum()),
        robot_gap=float(of.outcome.robot_gap[chosen].min()),
        obstacle_gap=float(of.outcome.obstacle_gap[chosen].min()),
    )


def rows_by_map(of: Played) -> list[Row]:
    """Return the figures of each map, and of all runs as 'all' if there are several maps."""
    names = [one.name for one in of.problem.maps]
    rows = [row(of, name, np.flatnonzero(of.problem.map_of == k)) for k, name in enumerate(names)]
    return [*rows, row(of, "all")] if len(names) > 1 else rows


def compare(first: Played, second: Played) -> PairedDifference:
    """Return steps of ``first`` minus steps of ``second``, run by run."""
    return paired_difference(first.steps, second.steps)


def failures(of: Played) -> list[tuple[str, str, str]]:
    """Return map, permutation and what happened of every run that did not arrive."""
    return [
        (of.problem.maps[of.problem.map_of[b]].name, _permutation(of.problem, int(b)), ended_words(of, int(b)))
        for b in np.flatnonzero(of.outcome.status != ARRIVED)
    ]


def ended_words(of: Played, b: int) -> str:
    """Return how a run ended, in a sentence."""
    outcome = of.outcome
    if outcome.status[b] == ARRIVED:
        return (
            f"all arrived after {outcome.steps[b]} steps; nobody can need fewer than {of.bound[b]} "
            f"(ratio {outcome.steps[b] / of.bound[b]:.4f})"
        )
    one, two = (int(k) for k in outcome.involved[b])
    if outcome.status[b] == HIT_ROBOT:
        return f"robots {one} and {two} collided in step {outcome.steps[b]}"
    if outcome.status[b] == HIT_OBSTACLE:
        return f"robot {one} hit obstacle {two} in step {outcome.steps[b]}"
    if outcome.status[b] == LEFT_DISK:
        return f"robot {one} left the disk in step {outcome.steps[b]}"
    away = np.flatnonzero(outcome.arrival[b] < 0).tolist()
    return f"{STATUS_WORDS[outcome.status[b]]}; not at their goals: {', '.join(map(str, away))}"


def _permutation(problem: Problem, b: int) -> str:
    return ",".join(str(k) for k in problem.permutation[b])


CSV_COLUMNS = (
    "controller",
    "map",
    "permutation",
    "robots",
    "radius",
    "ended",
    "steps",
    "bound",
    "robot_gap",
    "obstacle_gap",
    "longest_way",
)


def csv_text(all_played: Sequence[Played]) -> str:
    """Return every run as a line of CSV."""
    file = io.StringIO()
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    for of in all_played:
        rules, outcome = of.problem.rules, of.outcome
        for b, which in enumerate(of.problem.map_of):
            writer.writerow(
                [
                    of.label,
                    of.problem.maps[which].name,
                    _permutation(of.problem, b),
                    rules.n,
                    repr(rules.r),
                    STATUS_WORDS[outcome.status[b]],
                    int(outcome.steps[b]),
                    int(of.bound[b]),
                    repr(float(outcome.robot_gap[b])),
                    repr(float(outcome.obstacle_gap[b])),
                    repr(float(outcome.length[b].max())),
                ]
            )
    return file.getvalue()
