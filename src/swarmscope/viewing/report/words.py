"""Figures in words: numbers with the digits they deserve, intervals, differences, and what they say."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple

from swarmscope.judging.metrics import metric_named
from swarmscope.judging.statistics import Interval, PairedDifference
from swarmscope.viewing.report.blocks import Mark

MISSING = "–"
EVIDENCE = 0.05
"""A p value below this is called evidence."""

TITLES = {
    "arrival_rate": "Arrival rate",
    "collision_rate": "Collision rate",
    "path_redundancy": "Path redundancy γ",
    "path_redundancy_all": "Path redundancy γ over all robots",
    "path_stretch": "Path stretch",
    "path_stretch_any_angle": "Path stretch against true shortest ways",
    "path_redundancy_any_angle": "Path redundancy γ against true shortest ways",
    "spl_any_angle": "SPL against true shortest ways",
    "spl": "SPL",
    "average_path_length_m": "Mean path length",
    "duration_s": "Duration t",
    "mean_arrival_s": "Mean time of arrival",
    "waiting_s": "Waiting time",
    "mean_speed_mps": "Mean speed",
    "bytes_per_robot_s": "Bytes per robot and second",
    "mover_path_m": "Path length APL",
    "mover_arrival_rate": "Success rate SR",
    "side_accuracy": "Accuracy of sides Acc",
    "path_reduction": "Ways shorter by",
    "gap_closed": "Gap closed",
    "sides_judged": "Choices judged",
    "planning_failures": "Planning failures N_a",
    "fusions": "Fusions N_u",
    "bandwidth_kbps": "Bandwidth",
    "mean_package_bytes": "Mean package",
    "planner_memory_bytes": "Memory per robot",
    "plan_us_p50": "t_plan, median",
    "plan_us_p99": "t_plan, 99th percentile",
    "bytes_on_air": "Bytes on air per run",
    "air_bps": "On air per robot, bit/s",
}
SHARES = frozenset(
    {
        "arrival_rate", "collision_rate", "path_redundancy", "path_redundancy_all", "spl", "mover_arrival_rate",
        "side_accuracy", "path_reduction", "gap_closed", "path_redundancy_any_angle", "spl_any_angle",
    }
)  # fmt: skip
RATIOS = frozenset({"path_stretch", "path_stretch_any_angle"})
SUMMARIES = {
    "path_redundancy": "γ = 1 − AR Σl* / Σl, sums over the robots that arrived",
    "path_redundancy_all": "γ = 1 − AR Σl* / Σl, sums over all robots",
    "path_stretch": "Σl / Σl*, sums over the robots that arrived",
    "path_stretch_any_angle": "Σl over the sum of the true shortest ways, robots that arrived",
    "path_redundancy_any_angle": "γ = 1 − AR Σl* / Σl with the true shortest ways for l*, robots that arrived",
    "spl_any_angle": "SPL with the true shortest ways; A* on a grid is 3 to 6 % longer and hides that much",
}
DECIMAL = {"s": 1, "m": 2}
"""Digits after the point."""
STEPS = {"B": ("B", "kB", "MB", "GB"), "us": ("µs", "ms", "s")}


class Verdict(NamedTuple):
    """What a comparison says."""

    words: str
    mark: Mark


def title(metric: str) -> str:
    """Return the name of a figure for headings."""
    return TITLES.get(metric, metric.replace("_", " ").capitalize())


def about(metric: str) -> str:
    """Return what a figure is, and which way is better."""
    known = metric_named(metric)
    wanted = {"higher": "; higher is better", "lower": "; lower is better", "neither": ""}[known.better]
    return f"{title(metric)}: {SUMMARIES.get(metric, known.summary)}{wanted}."


def in_text(metric: str) -> str:
    """Return the name of a figure within a sentence."""
    name = title(metric)
    return name if name.split()[0].isupper() else name[0].lower() + name[1:]


def value(metric: str, number: float | None) -> str:
    """Return one figure with its unit."""
    if number is None or not math.isfinite(number):
        return MISSING
    unit = metric_named(metric).unit
    if metric in SHARES:
        return f"{_fixed(100.0 * number, 1)} %"
    if metric in RATIOS:
        return _fixed(number, 3)
    if unit in STEPS:
        scaled, unit = _scaled(number, STEPS[unit])
        return f"{_digits(scaled)} {unit}"
    if unit in DECIMAL:
        return f"{_fixed(number, DECIMAL[unit])} {unit}"
    return f"{_digits(number)} {unit}".strip()


def difference(metric: str, number: float, signed: bool = True) -> str:
    """Return a difference of two figures with its unit; shares differ by points."""
    if not math.isfinite(number):
        return MISSING
    size = _size(metric, number)
    sign = "−" if number < 0 else "+"
    return f"{sign}{size}" if signed and not _nought(size) else size


def interval(metric: str, found: Interval | PairedDifference, differences: bool = False) -> str:
    """Return the bounds in brackets, without their unit if they share it; empty where there are none."""
    if not (math.isfinite(found.low) and math.isfinite(found.high)):
        return ""
    shown = difference if differences else value
    low, high = shown(metric, found.low), shown(metric, found.high)
    unit = high.rpartition(" ")[2] if " " in high else ""
    if unit and low.endswith(f" {unit}"):
        low, high = low.removesuffix(f" {unit}"), high.removesuffix(f" {unit}")
    return f"[{low}, {high}]"


def against_published(metric: str, found: Interval, published: float) -> Verdict:
    """Say how a measured figure compares with a published one."""
    if not math.isfinite(found.estimate):
        return Verdict(f"published {value(metric, published)}", "")
    apart, source = found.estimate - published, f"published {value(metric, published)}"
    if _nought(_size(metric, apart)):
        return Verdict(f"equal to {source}", "")
    words = f"{_size(metric, apart)} {_judged(metric, apart)} than {source}"
    if not math.isfinite(found.low):
        return Verdict(f"{words}, one map", "")
    if found.low <= published <= found.high:
        return Verdict(f"{source} is within the interval", "")
    return Verdict(words, _mark(metric, apart))


def against_bound(metric: str, found: Interval, at_most: float | None, at_least: float | None) -> Verdict:
    """Say whether a target is met and by how much it is missed; neither where the interval holds both."""
    measured = found.estimate
    if not math.isfinite(measured):
        return Verdict("not measured", "bad")
    if not math.isfinite(found.low):
        return Verdict("open: one map", "")
    bound = at_most if at_most is not None else at_least
    assert bound is not None  # noqa: S101 (Target has exactly one of them)
    over = measured - bound if at_most is not None else bound - measured
    worst = found.high if at_most is not None else found.low
    best = found.low if at_most is not None else found.high
    if min(best, worst) <= bound <= max(best, worst) and worst != bound:
        return Verdict("open: the interval holds the target", "")
    size = _size(metric, over)
    if over > 0.0:
        exact = f"less than {_size(metric, 0.0, smallest=True)}" if _nought(size) else size
        return Verdict(f"missed by {exact}", "bad")
    return Verdict("met exactly" if over == 0.0 or _nought(size) else f"met, {size} to spare", "good")


def bound(metric: str, at_most: float | None, at_least: float | None) -> str:
    """Return a target in words."""
    return f"at most {value(metric, at_most)}" if at_most is not None else f"at least {value(metric, at_least)}"


def evidence(metric: str, found: PairedDifference, p_value: float) -> Verdict:
    """Say what a paired difference (first - second) means for the first."""
    if found.used == 0:
        return Verdict("no map in common", "")
    if not math.isfinite(found.low):
        return Verdict("one map says nothing", "")
    if p_value >= EVIDENCE or found.estimate == 0.0:
        return Verdict("no evidence of a difference", "")
    return Verdict(_judged(metric, found.estimate), _mark(metric, found.estimate))


def p_words(p_value: float, name: str = "p") -> str:
    """Return 'p = 0.012'."""
    if not math.isfinite(p_value):
        return f"{name} {MISSING}"
    return f"{name} < 0.001" if p_value < 0.001 else f"{name} = {p_value:.3f}"


def holm(p_values: Sequence[float]) -> list[float]:
    """Return the p values corrected for all of them together (Holm 1979); NaN is no test and stays NaN."""
    tests = [k for k, p in enumerate(p_values) if math.isfinite(p)]
    corrected, highest = [math.nan] * len(p_values), 0.0
    for rank, k in enumerate(sorted(tests, key=lambda k: p_values[k])):
        highest = max(highest, min(1.0, (len(tests) - rank) * p_values[k]))
        corrected[k] = highest
    return corrected


def spans(seeds: Iterable[int]) -> str:
    """Return '0–19, 25' for seeds."""
    parts: list[list[int]] = []
    for seed in sorted(set(seeds)):
        if parts and seed == parts[-1][1] + 1:
            parts[-1][1] = seed
        else:
            parts.append([seed, seed])
    return ", ".join(str(a) if a == b else f"{a}–{b}" for a, b in parts) or MISSING


def listed(names: Sequence[str]) -> str:
    """Return 'a, b and c'."""
    if len(names) < 2:
        return "".join(names)
    return f"{', '.join(names[:-1])} and {names[-1]}"


def count(number: int, one: str, many: str = "") -> str:
    """Return '1 run', '3 runs', 'no runs'."""
    words = one if number == 1 else (many or f"{one}s")
    return f"{grouped(number) if number else 'no'} {words}"


def grouped(number: int) -> str:
    """Return a whole number with thin spaces between thousands."""
    return f"{number:,}".replace(",", "\u202f")


def better(metric: str, first: float, second: float) -> bool:
    """Say whether ``first`` is the better figure."""
    return first > second if metric_named(metric).better == "higher" else first < second


def _judged(metric: str, apart: float) -> str:
    wanted = metric_named(metric).better
    if wanted == "neither":
        return "more" if apart > 0 else "less"
    return "better" if (apart > 0) == (wanted == "higher") else "worse"


def _mark(metric: str, apart: float) -> Mark:
    judged = _judged(metric, apart)
    return "good" if judged == "better" else "bad" if judged == "worse" else ""


def _size(metric: str, number: float, smallest: bool = False) -> str:
    """Return the absolute difference with its unit."""
    number = abs(number)
    if metric in SHARES:
        return f"{_fixed(0.1 if smallest else 100.0 * number, 1)} points"
    if metric in RATIOS:
        return _fixed(0.001 if smallest else number, 3)
    unit = metric_named(metric).unit
    if unit in STEPS:
        scaled, unit = _scaled(number, STEPS[unit])
        return f"{_digits(scaled)} {unit}"
    digits = DECIMAL.get(unit, 1)
    return f"{_fixed(0.1**digits if smallest else number, digits)} {unit}".strip()


def _nought(size: str) -> bool:
    return not any(digit in size for digit in "123456789")


def _scaled(number: float, units: Sequence[str]) -> tuple[float, str]:
    step = 0
    while abs(number) >= 999.5 and step < len(units) - 1:
        number, step = number / 1000.0, step + 1
    return number, units[step]


def _digits(number: float) -> str:
    """Return three or four significant digits, all of those before the point."""
    size = abs(number)
    return _fixed(number, 0 if size >= 999.5 or number == int(number) else 1 if size >= 0.95 else 3)


def _fixed(number: float, digits: int) -> str:
    text = f"{number:,.{digits}f}".replace(",", "\u202f")
    if text.startswith("-"):
        return "−" + text[1:] if any(d in text for d in "123456789") else text[1:]
    return text
