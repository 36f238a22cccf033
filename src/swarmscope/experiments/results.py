"""Results of an experiment as they come from the store, and the figures that tables are made of."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.judging import metrics
from swarmscope.judging.statistics import Interval, PairedDifference, bootstrap_ratio, paired_difference

Floats = NDArray[np.float64]

PATH_LENGTHS = ("average_path_length_m", "mover_path_m")
"""Means over robots that arrived; compared over those that arrived with both planners."""


@dataclass(frozen=True)
class Run:
    """One finished run."""

    place: str
    planner: str
    """Label of the planner in the experiment."""
    seed: int
    key: str
    config: dict[str, Any]
    """The complete scenario: ``parse_scenario(config)`` and ``play`` give the run again, to the bit."""
    figures: dict[str, float | None]
    """Every figure of ``metrics.json`` that is a number."""
    travelled_m: Floats
    """(N,) per robot."""
    shortest_m: Floats
    """(N,) A* reference, NaN without."""
    any_angle_m: Floats
    """(N,) the true shortest way, NaN without."""
    arrival_s: Floats
    """(N,) NaN when it did not arrive."""
    failures: list[dict[str, Any]]
    """Robots that did not arrive: {"robot": i, "why": words}."""
    cases: list[dict[str, Any]]
    """The choices of a side that neighbours turned round (see ``cases.py``)."""


def pooled_figures(runs: Iterable[Run]) -> dict[str, float]:
    """Return path redundancy (24), stretch and SPL with sums over the robots of all runs."""
    every = list(runs)
    travelled = np.concatenate([run.travelled_m for run in every])
    shortest, exact = (np.concatenate([getattr(run, name) for run in every]) for name in ("shortest_m", "any_angle_m"))
    arrival = np.concatenate([run.arrival_s for run in every])
    return {
        "path_redundancy": metrics.path_redundancy(travelled, shortest, arrival),
        "path_redundancy_all": metrics.path_redundancy_all(travelled, shortest, arrival),
        "path_stretch": metrics.path_stretch(travelled, shortest, arrival),
        "spl": metrics.spl(travelled, shortest, arrival),
        "path_redundancy_any_angle": metrics.path_redundancy(travelled, exact, arrival),
        "path_stretch_any_angle": metrics.path_stretch(travelled, exact, arrival),
        "spl_any_angle": metrics.spl(travelled, exact, arrival),
    }


def values_of(runs: Iterable[Run], metric: str) -> Floats:
    """Return one figure of every run, NaN where it has none."""
    values = (run.figures.get(metric) for run in runs)
    return np.array([np.nan if value is None else value for value in values], np.float64)


def grouped(runs: Iterable[Run]) -> dict[tuple[str, str], list[Run]]:
    """Return the runs of each (place, planner), ascending seeds."""
    groups: dict[tuple[str, str], list[Run]] = {}
    for run in sorted(runs, key=lambda r: r.seed):
        groups.setdefault((run.place, run.planner), []).append(run)
    return groups


def paired(ours: list[Run], others: list[Run], metric: str) -> PairedDifference:
    """Return the mean difference ours - other of one figure over the maps (seeds) that both have it on.

    Mean path lengths are of the robots that arrived with both and had to move.
    """
    mine = {run.seed: run.figures.get(metric) for run in ours}
    theirs = {run.seed: run.figures.get(metric) for run in others}
    if metric in PATH_LENGTHS:
        mine, theirs = {}, {}
        for run, other, both in in_common(ours, others):
            moved = both & (other.travelled_m > 0.0)
            if moved.any():
                mine[run.seed] = float(run.travelled_m[moved].mean())
                theirs[run.seed] = float(other.travelled_m[moved].mean())
    seeds = [s for s in sorted(mine.keys() & theirs.keys()) if mine[s] is not None and theirs[s] is not None]
    return paired_difference([mine[s] for s in seeds], [theirs[s] for s in seeds])  # type: ignore[arg-type]


def in_common(runs: Iterable[Run], others: Iterable[Run]) -> Iterator[tuple[Run, Run, NDArray[np.bool_]]]:
    """Yield the runs of maps that both have, and which robots (N,) arrived in both."""
    of_seed = {run.seed: run for run in others}
    for run in (run for run in runs if run.seed in of_seed):
        other = of_seed[run.seed]
        yield run, other, np.isfinite(run.arrival_s) & np.isfinite(other.arrival_s)


class PathGap(NamedTuple):
    """How much shorter a planner's ways are, robot by robot, with bootstrap intervals over the maps."""

    reduction: Interval
    """1 - sum(l) / sum(l_worst), over robots that arrived with both planners."""
    closed: Interval
    """sum(l_worst - l) / sum(l_worst - l_best), over robots that arrived with all."""
    robots: int
    """Robots that entered the reduction and moved."""


def path_gap(runs: list[Run], worst: list[Run], best: list[Run] | None) -> PathGap:
    """Return where the path lengths of ``runs`` lie between those of ``worst`` and ``best`` in the same worlds.

    ``best`` None: the true shortest ways.
    """
    near = {run.seed: _bound_of(run, best is None) for run in (runs if best is None else best)}
    shorter, longest, gained, whole, robots = [], [], [], [], 0
    for run, other, both in in_common(runs, worst):
        saved = other.travelled_m - run.travelled_m
        robots += int(np.count_nonzero(other.travelled_m[both]))
        if other.travelled_m[both].any():
            shorter.append(saved[both].sum())
            longest.append(other.travelled_m[both].sum())
        if run.seed in near:
            every = both & np.isfinite(near[run.seed])
            if other.travelled_m[every].any():
                gained.append(saved[every].sum())
                whole.append((other.travelled_m - near[run.seed])[every].sum())
    return PathGap(bootstrap_ratio(shorter, longest), bootstrap_ratio(gained, whole), robots)


def _bound_of(run: Run, shortest: bool) -> Floats:
    """Return the ways (N,) that bound a gap [m], NaN where there is none."""
    return run.any_angle_m if shortest else np.where(np.isfinite(run.arrival_s), run.travelled_m, np.nan)


def flow_time_increases(runs: Iterable[Run], others: Iterable[Run]) -> tuple[Floats, Floats]:
    """Return FT = (l - l*) / l* (GIWT 5.3) of every robot that arrived in both runs of a map and had a way to go.

    ``l*`` is the way by A*.
    """
    mine, theirs = [np.zeros(0)], [np.zeros(0)]
    for run, other, both in in_common(runs, others):
        chosen = both & (run.shortest_m > 0.0)
        mine.append(run.travelled_m[chosen] / run.shortest_m[chosen] - 1.0)
        theirs.append(other.travelled_m[chosen] / run.shortest_m[chosen] - 1.0)
    return np.concatenate(mine), np.concatenate(theirs)


class TimeBudget(NamedTuple):
    """Where the seconds of a task go: the first five add up to the mean time of the last arrival."""

    shortest_s: float
    """Shortest way (A*) at top speed, mean over robots that arrived."""
    detour_s: float
    """What the way is longer, at top speed."""
    waiting_s: float
    """Standing still."""
    slow_s: float
    """The rest of a robot's time: turning on the spot, accelerating, driving below top speed."""
    last_s: float
    """From the mean arrival to the last one."""
    duration_s: float


def _top_speeds(robot: Any, robots: int) -> np.ndarray:
    """Return the top speed of each robot [m/s]: all are alike, or each has a data sheet."""
    sheets = robot if isinstance(robot, list) else [robot] * robots
    return np.array([sheet["v_max_mps"] for sheet in sheets], float)


def time_budget(runs: list[Run]) -> TimeBudget:
    """Return where the time goes, means over the maps in which somebody arrived; NaN without any."""
    rows = []
    for run in runs:
        there = np.isfinite(run.arrival_s) & np.isfinite(run.shortest_m)
        duration, waiting = run.figures.get("duration_s"), run.figures.get("waiting_s")
        if not there.any() or duration is None or waiting is None:
            continue
        v_max = _top_speeds(run.config["robot"], len(there))[there]
        shortest, travelled = (run.shortest_m[there] / v_max).mean(), (run.travelled_m[there] / v_max).mean()
        mean = run.arrival_s[there].mean()
        parts = (shortest, travelled - shortest, waiting, mean - travelled - waiting, duration - mean, duration)
        rows.append(parts)
    return TimeBudget(*(np.mean(rows, axis=0).tolist() if rows else [np.nan] * 6))
