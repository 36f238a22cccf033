"""What a run is judged by: pure functions over plain arrays, one robot each entry or column.

Shapes: T ticks, N robots. ``arrival_s`` (N,) is NaN for a robot that did not arrive. ``travelled_m`` (N,)
are lengths travelled until the arrival (or the end of the run), ``shortest_m`` (N,) the reference lengths
l*. A figure that has nothing to be computed from (nobody arrived, nobody moved) is NaN, never a division
error or a made-up number. A robot without a reference length (NaN) does not enter ratios with l*.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

STANDING_MPS = 0.02  # a robot slower than this waits


class Metric(NamedTuple):
    """How one figure is to be read."""

    name: str
    unit: str  # "" for shares and ratios
    better: Literal["higher", "lower", "neither"]
    summary: str


METRICS: list[Metric] = [
    Metric("arrival_rate", "", "higher", "share of robots that arrived (AR, SR)"),
    Metric("collision_rate", "", "lower", "share of robots that touched something"),
    Metric("path_redundancy", "", "lower", "gamma = 1 - AR sum(l*) / sum(l), sums over robots that arrived"),
    Metric("path_redundancy_all", "", "lower", "gamma with sums over all robots"),
    Metric("path_stretch", "", "lower", "sum(l) / sum(l*) over robots that arrived"),
    Metric("spl", "", "higher", "success weighted by path length, mean of success l* / max(l, l*)"),
    Metric("average_path_length_m", "m", "lower", "mean length travelled by robots that arrived (APL)"),
    Metric("duration_s", "s", "lower", "time of the last arrival (t)"),
    Metric("mean_arrival_s", "s", "lower", "mean time of arrival"),
    Metric("waiting_s", "s", "lower", "mean time per robot slower than 0.02 m/s before it arrived"),
    Metric("mean_speed_mps", "m/s", "higher", "length travelled per time under way, over all robots"),
    Metric("bytes_per_robot_s", "B/s", "lower", "bytes sent per robot and second under way"),
]
COUNTED: list[Metric] = [
    Metric("path_stretch_any_angle", "", "lower", "sum(l) / sum of the true shortest ways, robots that arrived"),
    Metric("path_redundancy_any_angle", "", "lower", "gamma with the true shortest ways for l*"),
    Metric("spl_any_angle", "", "higher", "SPL with the true shortest ways for l*"),
    Metric("mover_path_m", "m", "lower", "mean length travelled by robots that had to move and arrived (APL)"),
    Metric("mover_arrival_rate", "", "higher", "share of robots that had to move that arrived (SR)"),
    Metric("movers", "", "neither", "robots that start away from their goals"),
    Metric("side_accuracy", "", "higher", "share of judged choices that took the side of the shortest way (Acc)"),
    Metric("sides_judged", "", "neither", "choices of a side where the shortest way has one, all robots"),
    Metric("planning_failures", "", "lower", "robots that did not arrive in time (N_a)"),
    Metric("collisions", "", "lower", "robots that touched something"),
    Metric("walked_into", "", "lower", "times that a disc on its way walked into a robot that stood"),
    Metric("min_clearance_m", "m", "higher", "smallest distance of any robot to anything"),
    Metric("fusions", "", "neither", "choices of a side, all robots (N_u)"),
    Metric("messages", "", "lower", "packets sent, all robots"),
    Metric("bytes_sent", "B", "lower", "payload sent, all robots"),
    Metric("bytes_on_air", "B", "lower", "payload and the link's own overhead, all robots"),
    Metric("air_bps", "bit/s", "lower", "payload and the link's own overhead per robot and second of the run"),
    Metric("bandwidth_kbps", "kbps", "lower", "payload sent by all robots per second of the run"),
    Metric("mean_package_bytes", "B", "lower", "mean size of a packet of features"),
    Metric("planner_memory_bytes", "B", "lower", "planner memory of one robot"),
    Metric("plan_us_p50", "us", "lower", "time of one planning step, median (measured)"),
    Metric("plan_us_p99", "us", "lower", "time of one planning step, 99th percentile (measured)"),
]
"""What a run counts by itself; found in ``metrics.json`` beside `METRICS`."""


BETWEEN: list[Metric] = [
    Metric("path_reduction", "", "higher", "how much shorter ways are than with the gap's worst planner"),
    Metric("gap_closed", "", "higher", "share of the gap between the worst and the best planner's ways that is closed"),
]
"""Figures of a planner beside the two that an experiment names as its gap."""


def metric_named(name: str) -> Metric:
    """Return how the figure ``name`` is to be read; raises KeyError."""
    return {metric.name: metric for metric in (*METRICS, *COUNTED, *BETWEEN)}[name]


def path_lengths(x_m: Floats, y_m: Floats, t_s: Floats, arrival_s: Floats) -> Floats:
    """Return the length (N,) [m] each robot travelled until it arrived, or until the end of the run.

    ``x_m``, ``y_m`` are (T, N) and ``t_s`` (T,). A step in which a robot arrives counts whole; steps to or
    from a position that is not finite count 0.
    """
    steps = np.hypot(np.diff(x_m, axis=0), np.diff(y_m, axis=0))
    under_way = _under_way(t_s[:-1], arrival_s)
    lengths: Floats = np.sum(np.where(under_way & np.isfinite(steps), steps, 0.0), axis=0)
    return lengths


def arrived(arrival_s: Floats) -> Bools:
    """Say of each robot (N,) whether it arrived."""
    return np.isfinite(arrival_s)


def arrival_rate(arrival_s: Floats) -> float:
    """Return the share of robots that arrived: AR of Nav-SCOPE, SR of SFM-MAS and GIWT."""
    return _mean(arrived(arrival_s))


def collision_rate(collided: NDArray[np.uint8] | Bools) -> float:
    """Return the share of robots that touched an obstacle or another robot."""
    return _mean(np.asarray(collided) != 0)


def path_redundancy(travelled_m: Floats, shortest_m: Floats, arrival_s: Floats) -> float:
    """Return gamma = 1 - AR sum(l*) / sum(l), the sums over robots that arrived (Nav-SCOPE (24)).

    0 when all arrive along shortest ways, near 1 when few arrive or ways are long; NaN when nobody arrived.
    It is negative when robots beat the reference, which 8-connected A* (up to 8 % long) allows.
    """
    entered = arrived(arrival_s) & np.isfinite(shortest_m)
    return 1.0 - arrival_rate(arrival_s) * _ratio(shortest_m[entered].sum(), travelled_m[entered].sum())


def path_redundancy_all(travelled_m: Floats, shortest_m: Floats, arrival_s: Floats) -> float:
    """Return gamma with the sums over all robots, also those that were lost on the way (Nav-SCOPE (24)).

    Robots that are lost early have short ways, which makes this figure smaller (better): read it beside AR.
    """
    entered = np.isfinite(shortest_m)
    return 1.0 - arrival_rate(arrival_s) * _ratio(shortest_m[entered].sum(), travelled_m[entered].sum())


def path_stretch(travelled_m: Floats, shortest_m: Floats, arrival_s: Floats) -> float:
    """Return sum(l) / sum(l*) over robots that arrived: 1 is best; NaN when nobody arrived."""
    entered = arrived(arrival_s) & np.isfinite(shortest_m)
    return _ratio(travelled_m[entered].sum(), shortest_m[entered].sum())


def spl(travelled_m: Floats, shortest_m: Floats, arrival_s: Floats) -> float:
    """Return success weighted by path length: the mean over robots of success l* / max(l, l*) (Anderson et
    al. 2018).

    A robot whose start is its goal (l* = l = 0) that arrived counts 1.
    """
    known = np.isfinite(shortest_m)
    best, longest = shortest_m[known], np.maximum(travelled_m[known], shortest_m[known])
    share = np.divide(best, longest, out=np.ones_like(best), where=longest > 0.0)
    return _mean(np.where(arrived(arrival_s)[known], share, 0.0))


def average_path_length_m(travelled_m: Floats, arrival_s: Floats) -> float:
    """Return the mean length [m] of the ways of robots that arrived (APL of SFM-MAS and GIWT)."""
    return _mean(travelled_m[arrived(arrival_s)])


def movers(starts_m: Floats, goals_m: Floats, arrive_m: float) -> Bools:
    """Say of each robot (N,) whether it starts farther than ``arrive_m`` from its goal.

    ``starts_m`` are (N, 2 or 3), ``goals_m`` (N, 2) [m].
    """
    away: Bools = np.hypot(*(goals_m[:, :2] - starts_m[:, :2]).T) > arrive_m
    return away


def mover_path_m(travelled_m: Floats, arrival_s: Floats, moves: Bools) -> float:
    """Return the mean length [m] of the ways of robots that had to move and arrived (APL of GIWT, Table II)."""
    return _mean(travelled_m[moves & arrived(arrival_s)])


def mover_arrival_rate(arrival_s: Floats, moves: Bools) -> float:
    """Return the share of robots that had to move that arrived (SR of GIWT, Table II)."""
    return _mean(arrived(arrival_s)[moves])


def sides_judged(told_side: NDArray[np.integer]) -> int:
    """Return how many choices (C,) have a side of the shortest way: ``told_side`` +1 left, -1 right, 0 none."""
    return int(np.count_nonzero(told_side))


def side_accuracy(side: NDArray[np.integer], told_side: NDArray[np.integer]) -> float:
    """Return the share of judged choices that took the side of the shortest way (Acc of GIWT, Table II)."""
    return _mean((side == told_side)[told_side != 0])


def duration_s(arrival_s: Floats) -> float:
    """Return the time [s] of the last arrival (t of Nav-SCOPE), NaN when nobody arrived."""
    return (
        float(np.max(arrival_s[arrived(arrival_s)], initial=-math.inf))
        if arrived(arrival_s).any()
        else math.nan
    )


def mean_arrival_s(arrival_s: Floats) -> float:
    """Return the mean time [s] of arrival of the robots that arrived."""
    return _mean(arrival_s[arrived(arrival_s)])


def waiting_times(speed_mps: Floats, t_s: Floats, arrival_s: Floats) -> Floats:
    """Return the time (N,) [s] that each robot was slower than 0.02 m/s before it arrived.

    ``speed_mps`` is (T, N): the speed at tick k holds until tick k + 1; the last one does not count.
    """
    waits = (np.abs(speed_mps[:-1]) < STANDING_MPS) & _under_way(t_s[:-1], arrival_s)
    times: Floats = np.sum(waits * np.diff(t_s)[:, None], axis=0)
    return times


def waiting_s(speed_mps: Floats, t_s: Floats, arrival_s: Floats) -> float:
    """Return the mean of `waiting_times` [s] over all robots."""
    return _mean(waiting_times(speed_mps, t_s, arrival_s))


def times_under_way(t_s: Floats, arrival_s: Floats) -> Floats:
    """Return how long (N,) [s] each robot was under way: until it arrived, or all of the run."""
    first, last = (float(t_s[0]), float(t_s[-1])) if len(t_s) else (0.0, 0.0)
    return np.where(arrived(arrival_s), arrival_s, last) - first


def mean_speed_mps(travelled_m: Floats, t_s: Floats, arrival_s: Floats) -> float:
    """Return the length travelled by all robots over the time they were under way [m/s]."""
    return _ratio(travelled_m.sum(), times_under_way(t_s, arrival_s).sum())


def bytes_per_robot_s(bytes_sent: NDArray[np.integer], t_s: Floats, arrival_s: Floats) -> float:
    """Return bytes sent per robot and second under way; ``bytes_sent`` (T, N) are running totals."""
    total = float(bytes_sent[-1].sum()) if len(bytes_sent) else 0.0
    return _ratio(total, times_under_way(t_s, arrival_s).sum())


def all_metrics(
    t_s: Floats,
    x_m: Floats,
    y_m: Floats,
    speed_mps: Floats,
    bytes_sent: NDArray[np.integer],
    arrival_s: Floats,
    collided: NDArray[np.uint8],
    shortest_m: Floats,
) -> dict[str, float]:
    """Return every figure of `METRICS` for one run's trace, in the order of the table."""
    travelled = path_lengths(x_m, y_m, t_s, arrival_s)
    values = {
        "arrival_rate": arrival_rate(arrival_s),
        "collision_rate": collision_rate(collided),
        "path_redundancy": path_redundancy(travelled, shortest_m, arrival_s),
        "path_redundancy_all": path_redundancy_all(travelled, shortest_m, arrival_s),
        "path_stretch": path_stretch(travelled, shortest_m, arrival_s),
        "spl": spl(travelled, shortest_m, arrival_s),
        "average_path_length_m": average_path_length_m(travelled, arrival_s),
        "duration_s": duration_s(arrival_s),
        "mean_arrival_s": mean_arrival_s(arrival_s),
        "waiting_s": waiting_s(speed_mps, t_s, arrival_s),
        "mean_speed_mps": mean_speed_mps(travelled, t_s, arrival_s),
        "bytes_per_robot_s": bytes_per_robot_s(bytes_sent, t_s, arrival_s),
    }
    return {metric.name: values[metric.name] for metric in METRICS}


def _under_way(t_s: Floats, arrival_s: Floats) -> Bools:
    """Say (T, N) whether each robot has not arrived at the beginning of each tick."""
    return t_s[:, None] < np.where(arrived(arrival_s), arrival_s, math.inf)[None, :]


def _mean(values: NDArray[np.float64] | Bools) -> float:
    return float(np.mean(values)) if len(values) else math.nan


def _ratio(above: float, below: float) -> float:
    return float(above / below) if below > 0.0 else math.nan
