"""The tables of a report."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from swarmscope.errors import SwarmscopeError
from swarmscope.experiments.results import Run, TimeBudget, time_budget
from swarmscope.experiments.weight import NEIGHBOUR_PRINTED, SELF_PRINTED, WEIGHT_PRINTED, WeightResult
from swarmscope.judging.statistics import PairedDifference
from swarmscope.members import told_by
from swarmscope.onboard.planners import load_planner
from swarmscope.user_files import is_file_name
from swarmscope.viewing.report import words
from swarmscope.viewing.report.blocks import Line, Mark, Row, Table, Value, cell
from swarmscope.viewing.report.material import ALL, Material

RESOURCES = (
    "plan_us_p50", "plan_us_p99", "planner_memory_bytes", "bandwidth_kbps", "mean_package_bytes", "bytes_on_air",
)  # fmt: skip
NOT_RUN = "not run"
GAP_METRIC = "mover_path_m"
"""The figure whose published values a gap is compared with."""


class Paired(NamedTuple):
    """One comparison of ours with another planner in a place."""

    place: str
    other: str
    found: PairedDifference
    holm: float


def metric_table(material: Material, metric: str) -> Table:
    """Return planners x places of one figure: measured with interval, published, and the difference in words."""
    places = [*material.places, *([ALL] if ALL in material.published_places(metric) else [])]
    rows = [
        _row(material, planner, [_measured(material, place, planner, metric) for place in places])
        for planner in material.shown_planners(metric)
    ]
    sources = material.sources(metric)
    note = f"Published: {words.listed(list(dict.fromkeys(sources)))}." if sources else ""
    return Table(words.about(metric), ["", *(_place(place) for place in places)], rows, note)


def _measured(material: Material, place: str, planner: str, metric: str) -> Value:
    found, published = material.figure(place, planner, metric), material.published(metric, place, planner)
    beside = [Line(f"published {words.value(metric, published)}", "sub")] if published is not None else []
    if planner not in material.planners or not material.of(place, planner):
        return [Line(NOT_RUN, "plain"), *beside]
    lines = cell(words.value(metric, found.estimate), words.interval(metric, found))
    if metric == "path_redundancy":
        every = material.figure(place, planner, "path_redundancy_all").estimate
        lines.append(Line(f"all robots {words.value(metric, every)}", "sub"))
    if published is not None:
        verdict = words.against_published(metric, found, published)
        lines.append(Line(verdict.words, "sub", verdict.mark))
    return lines


def target_table(material: Material) -> Table:
    """Return each target with what was measured."""
    rows = []
    for target in material.experiment.targets:
        found = material.figure(target.place, target.planner, target.metric)
        verdict = words.against_bound(target.metric, found, target.at_most, target.at_least)
        bounds = words.interval(target.metric, found)
        rows.append(
            Row(
                [
                    cell(words.title(target.metric)),
                    cell(target.place),
                    cell(target.planner),
                    cell(words.bound(target.metric, target.at_most, target.at_least)),
                    cell(words.value(target.metric, found.estimate), bounds),
                    [Line(verdict.words, "main", verdict.mark)],
                ]
            )
        )
    header = ["", "place", "planner", "target", "measured", "verdict"]
    return Table("Targets.", header, rows, words=True)


def comparisons(material: Material, metric: str) -> list[Paired]:
    """Return ours minus every other planner in every place, p values corrected (Holm) over this list."""
    ours = material.experiment.ours
    if ours is None:
        return []
    pairs = [(place, other) for other in material.planners if other != ours for place in material.places]
    pairs = [(place, other) for place, other in pairs if material.of(place, ours) and material.of(place, other)]
    found = [material.paired(place, ours, other, metric) for place, other in pairs]
    corrected = words.holm([difference.p_value for difference in found])
    return [Paired(*pair, *rest) for pair, rest in zip(pairs, zip(found, corrected, strict=True), strict=True)]


def paired_table(material: Material, metric: str) -> Table | None:
    """Return the table of `comparisons`; None when there is no map to compare on."""
    every = {(entry.place, entry.other): entry for entry in comparisons(material, metric)}
    if not any(entry.found.used for entry in every.values()):
        return None
    others = list(dict.fromkeys(other for _, other in every))
    rows = [
        _row(material, other, [_difference(metric, every.get((place, other))) for place in material.places], "minus ")
        for other in others
    ]
    caption = f"{words.title(metric)}: {material.experiment.ours} minus each other planner, map by map."
    return Table(caption, ["", *material.places], rows)


def _difference(metric: str, entry: Paired | None) -> Value:
    if entry is None:
        return [Line(NOT_RUN, "plain")]
    if entry.found.used == 0:
        return [Line("no map in common", "plain")]
    verdict = words.evidence(metric, entry.found, entry.holm)
    chance = f"{words.p_words(entry.found.p_value)}, {words.p_words(entry.holm, 'Holm')}"
    maps = words.count(entry.found.used, "map")
    lines = cell(words.difference(metric, entry.found.estimate), words.interval(metric, entry.found, True))
    return [*lines, Line(f"{chance}, {maps}", "sub"), Line(verdict.words, "sub", verdict.mark)]


def gap_table(material: Material) -> Table | None:
    """Return how much shorter ways are than those of the gap's worst planner, and the share of it that is closed."""
    asked = material.experiment.gap
    if asked is None:
        return None
    others = [planner for planner in material.planners if planner != asked.worst]
    places = material.places
    if not any(material.gap(place, planner) for planner in others for place in places):
        return None
    rows = [_row(material, planner, [_gap(material, place, planner) for place in places]) for planner in others]
    caption = f"Ways of robots that arrived with both planners: how much shorter than with {asked.worst}; "
    if asked.best is None:
        caption += f"and the share of what {asked.worst} goes beyond the true shortest way that is gone."
    else:
        caption += (
            f"of robots that also arrived with {asked.best}: the share of the gap between {asked.worst} and "
            f"{asked.best} that is closed."
        )
    published = any(material.published(GAP_METRIC, place, asked.worst) for place in places)
    note = "Published values follow from the published mean path lengths." if published else ""
    return Table(caption, ["", *places], rows, note)


def _gap(material: Material, place: str, planner: str) -> Value:
    asked, found = material.experiment.gap, material.gap(place, planner)
    if asked is None or found is None:
        return [Line(NOT_RUN, "plain")]
    if found.reduction.used == 0:
        return [Line("no robot in common", "plain")]
    shorter, closed = (
        (words.value(name, part.estimate), words.interval(name, part))
        for name, part in (("path_reduction", found.reduction), ("gap_closed", found.closed))
    )
    lines = cell(*shorter)
    if planner != asked.best:
        lines.append(Line(f"closes {' '.join(closed)}".rstrip(), "sub"))
    entered = f"{words.count(found.robots, 'robot')}, {words.count(found.reduction.used, 'map')}"
    lines.append(Line(entered, "sub"))
    ours, worst = (material.published(GAP_METRIC, place, name) for name in (planner, asked.worst))
    best = None if asked.best is None else material.published(GAP_METRIC, place, asked.best)
    if ours is None or worst is None:
        return lines
    printed = 1.0 - ours / worst
    text = f"published {100.0 * printed:.1f} %"
    if best is not None and planner != asked.best:
        text += f", closes {100.0 * (worst - ours) / (worst - best):.0f} %"
    outside = not found.reduction.low <= printed <= found.reduction.high and math.isfinite(found.reduction.low)
    mark: Mark = "" if not outside else "good" if found.reduction.estimate > printed else "bad"
    return [*lines, Line(text.replace("-", "−"), "sub", mark)]


def failure_table(material: Material) -> Table:
    """Return robots that did not arrive, collisions and fusions of every planner in every place."""
    rows = [
        _row(material, planner, [_failures(material, place, planner) for place in material.places])
        for planner in material.planners
    ]
    caption = "Robots that did not arrive (N_a), robots that collided, and choices of a side (N_u)."
    return Table(caption, ["", *material.places], rows)


def _failures(material: Material, place: str, planner: str) -> Value:
    runs = material.of(place, planner)
    if not runs:
        return [Line(NOT_RUN, "plain")]
    robots = sum(len(run.arrival_s) for run in runs)
    lost = robots - sum(int(math.isfinite(t)) for run in runs for t in run.arrival_s)
    hit = total(runs, "collisions")
    fusions = [run.figures.get("fusions") for run in runs]
    made = sum(int(f) for f in fusions if f is not None)
    per_robot = f"N_u {words.grouped(made)} ({made / robots:.1f} per robot)" if any(fusions) and robots else ""
    lines = cell(f"N_a {words.grouped(lost)} of {words.grouped(robots)}")
    lines.append(Line(words.count(hit, "collision"), "sub", "bad" if hit else ""))
    return [*lines, *([Line(per_robot, "sub")] if per_robot else [])]


def named_failures(material: Material) -> list[Row]:
    """Return each robot of ours that did not arrive: place, seed, robot, why."""
    runs = material.of(ALL, material.leading())
    return [
        Row([cell(run.place), cell(str(run.seed)), cell(str(failed.get("robot"))), cell(str(failed.get("why", "")))])
        for run in runs
        for failed in run.failures
    ]


def resource_table(material: Material) -> Table:
    """Return what planning and talking cost, over all places; published values (Nav-SCOPE Table II) beside."""
    names = list(dict.fromkeys(planner for metric in RESOURCES for planner in material.shown_planners(metric)))
    rows = [_row(material, name, [_resource(material, name, metric) for metric in RESOURCES]) for name in names]
    note = "Times were measured on the machine that ran the experiment and depend on it; all else is exact."
    sources = list(dict.fromkeys(source for metric in RESOURCES for source in material.sources(metric)))
    note += f" Published: {words.listed(sources)}." if sources else ""
    header = ["", "t_plan median", "t_plan 99 %", "memory per robot", "bandwidth", "mean package", "on air per run"]
    return Table("Computation and communication, means over all runs.", header, rows, note)


def _resource(material: Material, planner: str, metric: str) -> Value:
    published = material.published(metric, ALL, planner)
    beside = f"published {words.value(metric, published)}" if published is not None else ""
    if planner not in material.planners or not material.of(ALL, planner):
        return [Line(NOT_RUN, "plain"), *([Line(beside, "sub")] if beside else [])]
    return cell(words.value(metric, material.figure(ALL, planner, metric).estimate), "", beside)


def weight_table(weight: WeightResult) -> Table:
    """Return error rates, weight (21) and what it means for w_i, printed values beside."""
    own, others = weight.own, weight.neighbours
    optimum = weight.weight / weight.peak_force if weight.peak_force > 0.0 else math.nan
    bounds = f"[{weight.low:.3f}, {weight.high:.3f}]" if math.isfinite(weight.low) else ""
    rows = [
        _weight_row("error rate of P_a", own.estimate, _bounds(own.low, own.high), SELF_PRINTED, own.used, "choices"),
        _weight_row(
            "error rate of P_ni", others.estimate, _bounds(others.low, others.high), NEIGHBOUR_PRINTED, others.used,
            "opinions",
        ),
        _weight_row("optimal |f_ai| by (21)", weight.weight, bounds, WEIGHT_PRINTED, len(weight.seeds), "samples"),
        _weight_row("largest |f_ai| at w_i = 1 [1/m]", weight.peak_force, "", None, 0, ""),
        _weight_row("w_i that makes the peak optimal", optimum, "", None, 0, ""),
    ]  # fmt: skip
    note = "Wilson intervals for the error rates, bootstrap over samples for the weight. "
    note += f"Samples: seeds {words.spans(weight.seeds)}."
    return Table("w_i from data (Nav-SCOPE V-C 4).", ["", "measured", "printed", "from"], rows, note)


def _weight_row(name: str, number: float, bounds: str, printed: float | None, used: int, of: str) -> Row:
    measured = f"{number:.3f}" if math.isfinite(number) else words.MISSING
    beside = f"{printed:.3f}" if printed is not None else ""
    return Row([cell(name), cell(measured, bounds), cell(beside), cell(f"{used} {of}" if used else "")])


def _bounds(low: float, high: float) -> str:
    return f"[{low:.3f}, {high:.3f}]" if math.isfinite(low) and math.isfinite(high) else ""


TIME_PARTS = {
    "shortest_s": "shortest way at top speed",
    "detour_s": "detours at top speed",
    "waiting_s": "standing still",
    "slow_s": "turning, starting, driving slower",
    "last_s": "from the mean arrival to the last",
    "duration_s": "last arrival",
}


def time_table(material: Material) -> Table:
    """Return where the seconds of a task go, for every planner in every place."""
    rows = [
        _row(material, planner, [_times(material.of(place, planner)) for place in material.places])
        for planner in material.planners
    ]
    caption = "Where the seconds go: the parts of the time of the last arrival, means over the maps."
    return Table(caption, ["", *material.places], rows)


def _times(runs: list[Run]) -> Value:
    if not runs:
        return [Line(NOT_RUN, "plain")]
    budget: TimeBudget = time_budget(runs)
    if math.isnan(budget.duration_s):
        return [Line("nobody arrived", "plain")]
    lines = [Line(f"{budget.duration_s:.1f} s", "main")]
    return lines + [Line(f"{getattr(budget, k):.1f} s {w}", "sub") for k, w in TIME_PARTS.items() if k != "duration_s"]


def needs_table(material: Material) -> Table:
    """Return what each planner is given, as its module says."""
    rows = []
    for planner in material.planners:
        keys = material.planner_keys(planner)
        name = str(keys.get("name", ""))
        summary, needs = _about(name)
        rows.append(_row(material, planner, [[Line(Path(name).name, "code")], cell(summary), cell(needs)]))
    return Table("What each planner does and is given.", ["", "module", "does", "is given"], rows, words=True)


def parameter_table(material: Material) -> Table:
    """Return the parameters of every planner."""
    rows = []
    for planner in material.planners:
        params = dict(material.planner_keys(planner).get("params", {}))
        text = ", ".join(f"{key} = {number:g}" for key, number in params.items()) or "none set"
        rows.append(_row(material, planner, [[Line(text, "code")]]))
    return Table("Parameters of the planners.", ["", "parameters"], rows, words=True)


def _about(planner: str) -> tuple[str, str]:
    try:
        if is_file_name(planner):
            return told_by(Path(planner), "SUMMARY") or words.MISSING, told_by(Path(planner), "NEEDS") or words.MISSING
        found = load_planner(planner)
    except SwarmscopeError:
        return "not installed", words.MISSING
    return found.summary, found.needs


def total(runs: list[Run], metric: str) -> int:
    """Return the sum of a counted figure over runs."""
    return int(sum(run.figures.get(metric) or 0 for run in runs))


def _row(material: Material, planner: str, values: list[Value], before: str = "") -> Row:
    ours = planner == material.experiment.ours
    return Row([cell(f"{before}{planner}"), *values], ours, material.colour(planner))


def _place(place: str) -> str:
    return "all places" if place == ALL else place
