"""The runs of an experiment, sorted and asked for figures; each figure is computed once."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from swarmscope.experiments.experiment import Experiment, merged
from swarmscope.experiments.results import PathGap, Run, grouped, paired, path_gap, pooled_figures, values_of
from swarmscope.experiments.weight import WeightResult
from swarmscope.judging.metrics import BETWEEN
from swarmscope.judging.statistics import (
    RESAMPLES,
    Interval,
    PairedDifference,
    bootstrap_mean,
    bootstrap_ratio,
    wilson,
)

Floats = NDArray[np.float64]

ALL = "all"
"""Stands for all places together."""
EXACT = "_any_angle"
"""End of the names of figures whose reference is the true shortest way."""
OVER_BOTH = ("path_redundancy", "path_stretch", "spl")
POOLED = ("path_redundancy_all", *OVER_BOTH, *(name + EXACT for name in OVER_BOTH))
OURS_COLOUR = "#0072b2"
COLOURS = ("#e69f00", "#009e73", "#cc79a7", "#7a6fb0", "#8c6d1f", "#d55e00", "#56b4e9", "#6c757d", "#a3475c", "#4f7a28")
"""Okabe and Ito's palette with additions: told apart by colour-blind readers."""


class Material:
    """An experiment with its runs."""

    def __init__(self, experiment: Experiment, runs: list[Run], weight: WeightResult | None = None) -> None:
        self.experiment, self.weight = experiment, weight
        self.runs = sorted(runs, key=lambda run: (run.place, run.planner, run.seed))
        self.groups = grouped(runs)
        self.places = list(experiment.places)
        self.planners = list(experiment.planners)
        self._figures: dict[tuple[str, str, str], Interval] = {}
        self._gaps: dict[tuple[str, str], PathGap] = {}

    def of(self, place: str, planner: str) -> list[Run]:
        """Return the runs of a planner in a place, or in all places."""
        places = self.places if place == ALL else [place]
        return [run for name in places for run in self.groups.get((name, planner), [])]

    def main_runs(self) -> list[Run]:
        """Return the runs of the experiment's planners, without those of sweeps."""
        return [run for place in self.places for planner in self.planners for run in self.of(place, planner)]

    def figure(self, place: str, planner: str, metric: str) -> Interval:
        """Return the figure that tables show: pooled over robots where defined, else the mean over the maps."""
        key = (place, planner, metric)
        if key not in self._figures:
            between = metric in [m.name for m in BETWEEN]
            self._figures[key] = self._between(*key) if between else figure_of(self.of(place, planner), metric)
        return self._figures[key]

    def _between(self, place: str, planner: str, metric: str) -> Interval:
        gap = self.gap(place, planner)
        if gap is None:
            return Interval(math.nan, math.nan, math.nan, 0)
        return gap.reduction if metric == "path_reduction" else gap.closed

    def per_map(self, place: str, planner: str, metric: str) -> Floats:
        """Return the figure of every single run that has it."""
        values = values_of(self.of(place, planner), metric)
        return values[np.isfinite(values)]

    def paired(self, place: str, first: str, second: str, metric: str) -> PairedDifference:
        """Return the mean difference first - second over the maps that both have a figure on."""
        return paired(self.of(place, first), self.of(place, second), metric)

    def gap(self, place: str, planner: str) -> PathGap | None:
        """Return where the planner's path lengths lie between the experiment's two; None where these were not run."""
        asked = self.experiment.gap
        if asked is None:
            return None
        best = None if asked.best is None else self.of(place, asked.best)
        ours, worst = self.of(place, planner), self.of(place, asked.worst)
        if not (ours and worst) or best == []:
            return None
        if (place, planner) not in self._gaps:
            self._gaps[place, planner] = path_gap(ours, worst, best)
        return self._gaps[place, planner]

    def published(self, metric: str, place: str, planner: str) -> float | None:
        """Return the published value, if there is one."""
        for table in self.experiment.published:
            if table.metric == metric and planner in table.values.get(place, {}):
                return table.values[place][planner]
        return None

    def published_places(self, metric: str) -> list[str]:
        """Return the places that anything is published of."""
        return [place for table in self.experiment.published if table.metric == metric for place in table.values]

    def sources(self, metric: str) -> list[str]:
        """Return where a figure was published."""
        return [table.source for table in self.experiment.published if table.metric == metric]

    def shown_planners(self, metric: str) -> list[str]:
        """Return the experiment's planners, those that were published only last."""
        tables = [table for table in self.experiment.published if table.metric == metric]
        others = [name for table in tables for row in table.values.values() for name in row]
        return list(dict.fromkeys([*self.planners, *others]))

    def colour(self, planner: str) -> str:
        """Return the planner's colour, the same in every figure; empty for one that is not run here."""
        if planner == self.experiment.ours:
            return OURS_COLOUR
        others = [name for name in self.planners if name != self.experiment.ours]
        return COLOURS[others.index(planner) % len(COLOURS)] if planner in others else ""

    def leading(self) -> str:
        """Return 'ours', or the last planner of an experiment without."""
        return self.experiment.ours or self.planners[-1]

    def planner_keys(self, planner: str) -> dict[str, Any]:
        """Return the planner's part of its scenario: name and parameters, complete if it was run."""
        runs = self.of(ALL, planner)
        if runs:
            return dict(runs[0].config.get("planner", {}))
        keys = merged(self.experiment.scenario, self.experiment.planners.get(planner, {}))
        return dict(keys.get("planner", {}))


def figure_of(runs: list[Run], metric: str) -> Interval:
    """Return the figure over ``runs`` with its 95 % interval."""
    if not runs:
        return Interval(math.nan, math.nan, math.nan, 0)
    if metric == "arrival_rate":
        robots = sum(len(run.arrival_s) for run in runs)
        return wilson(sum(int(np.isfinite(run.arrival_s).sum()) for run in runs), robots)
    if metric == "mover_arrival_rate":
        movers, rates = values_of(runs, "movers"), values_of(runs, metric)
        there = np.isfinite(movers * rates)
        return _arrival_share((movers * rates)[there], movers[there])
    if metric == "side_accuracy":
        judged = values_of(runs, "sides_judged")
        return bootstrap_ratio(values_of(runs, metric) * judged, judged)
    if metric in POOLED:
        return pooled_interval(runs, metric)
    return bootstrap_mean(values_of(runs, metric))


def _arrival_share(arrived: Floats, movers: Floats) -> Interval:
    """Return the share of robots that arrived; robots of one map share a fate, so the interval goes by map.

    With one robot a map it is Wilson's, and so it is, with as many trials as maps, where nobody or everybody arrived.
    """
    robots, everybody = int(movers.sum()), int(arrived.sum()) == int(movers.sum())
    if not (movers > 1).any():
        return wilson(round(float(arrived.sum())), robots)
    if arrived.any() and not everybody:
        return bootstrap_ratio(arrived, movers)._replace(used=robots)
    return wilson(len(movers) if everybody else 0, len(movers))._replace(used=robots)


def pooled_interval(runs: list[Run], metric: str, seed: int = 0) -> Interval:
    """Return a figure pooled over robots with its percentile bootstrap interval over the maps."""
    estimate = pooled_figures(runs)[metric]
    used = sum(int(np.isfinite(run.shortest_m).any()) for run in runs)
    if len(runs) < 2 or not math.isfinite(estimate):
        return Interval(estimate, math.nan, math.nan, used)
    sums = np.stack([_sums(run, metric) for run in runs])
    drawn = np.random.default_rng(seed).integers(0, len(runs), size=(RESAMPLES, len(runs)))
    share, above, below = (sums[:, k][drawn].sum(axis=1) for k in range(3))
    robots = sums[:, 3][drawn].sum(axis=1)
    with np.errstate(invalid="ignore", divide="ignore"):
        ratios = share / robots * above / below
    values = 1.0 - ratios if metric.startswith("path_redundancy") else ratios
    values = values[np.isfinite(values)]
    if not len(values):
        return Interval(estimate, math.nan, math.nan, used)
    low, high = np.quantile(values, [0.025, 0.975])
    return Interval(estimate, float(low), float(high), used)


def _sums(run: Run, metric: str) -> Floats:
    """Return of one map what enters (first / fourth) (second / third): gamma (24), stretch and SPL in one form."""
    reference = run.any_angle_m if metric.endswith(EXACT) else run.shortest_m
    arrived, known = np.isfinite(run.arrival_s), np.isfinite(reference)
    if metric.startswith("spl"):
        best, longest = reference[known], np.maximum(run.travelled_m[known], reference[known])
        shares = np.divide(best, longest, out=np.ones_like(best), where=longest > 0.0)
        return np.array([1.0, float((shares * arrived[known]).sum()), float(known.sum()), 1.0])
    entered = known if metric == "path_redundancy_all" else known & arrived
    shortest, travelled = float(reference[entered].sum()), float(run.travelled_m[entered].sum())
    if metric.startswith("path_stretch"):
        return np.array([1.0, travelled, shortest, 1.0])
    return np.array([float(arrived.sum()), shortest, travelled, float(len(arrived))])
