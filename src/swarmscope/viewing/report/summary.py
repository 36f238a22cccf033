"""The summary in words, made from the figures."""

from __future__ import annotations

import math
from itertools import pairwise

from swarmscope.evaluation.metrics import metric_named
from swarmscope.viewing.report import words
from swarmscope.viewing.report.blocks import Block, Line, Mark, Points, Row, Table, Text, cell

from swarmscope.viewing.report.material import ALL, Material
from swarmscope.viewing.report.tables import Paired, comparisons, target_table, total

Entry = tuple[Mark, str, str]


def summary_blocks(material: Material) -> list[Block]:
    """Return the summary: targets, order of planners, evidence, collisions."""
    if not material.main_runs():
        return [Text("There are no runs yet: nothing can be said.")]
    entries = [*_targets(material), *_orders(material), *_evidence(material), *_collisions(material)]
    blocks: list[Block] = [Points(entries)]
    if material.experiment.targets:
        blocks.append(target_table(material))
    table = order_table(material)
    return [*blocks, *([table] if table is not None else [])]


def _targets(material: Material) -> list[Entry]:
    targets = material.experiment.targets
    if not targets:
        return []
    missed = []
    for target in targets:
        found = material.figure(target.place, target.planner, target.metric)
        verdict = words.against_bound(target.metric, found.estimate, target.at_most, target.at_least)
        if verdict.mark == "bad":
            measured = words.value(target.metric, found.estimate)
            wanted = words.bound(target.metric, target.at_most, target.at_least)
            bound = target.at_most if target.at_most is not None else target.at_least
            near = "; the interval holds the target" if found.low <= (bound or 0.0) <= found.high else ""
            name = f"{words.in_text(target.metric)} of {target.planner} in {target.place}"
            missed.append(f"{name} is {measured} instead of {wanted} ({verdict.words}{near})")
    met = len(targets) - len(missed)
    text = f"{met} of {len(targets)} are met."
    text += f" Not met: {'; '.join(missed)}." if missed else ""
    return [("bad" if missed else "good", "Targets.", text)]


def departures(material: Material, metric: str, place: str) -> list[str] | None:
    """Return the neighbours in ``Experiment.order`` that do not follow it here, in words; None: not all were run."""
    order = [name for name in material.experiment.order if math.isfinite(_estimate(material, place, name, metric))]
    if len(order) < 2 or len(order) < len(material.experiment.order):
        return None
    found = []
    for worse, better in pairwise(order):
        first, second = _estimate(material, place, better, metric), _estimate(material, place, worse, metric)
        if words.better(metric, first, second) or first == second:
            continue
        gap = material.paired(place, better, worse, metric)
        name = f"{better} is behind {worse} by {words.difference(metric, abs(first - second), signed=False)}"
        paired = f"paired difference {words.difference(metric, gap.estimate)} {words.interval(metric, gap, True)}"
        says = "which is evidence" if gap.p_value < words.EVIDENCE else "no evidence either way"
        maps = words.count(gap.used, "map")
        found.append(f"{name} ({paired}, {words.p_words(gap.p_value)}, {maps}: {says})")
    return found


def _estimate(material: Material, place: str, planner: str, metric: str) -> float:
    return material.figure(place, planner, metric).estimate


def _ordered_metrics(material: Material) -> list[str]:
    """Return the figures of the published tables that planners can be put in order by."""
    known = [m for m in material.experiment.metrics if metric_named(m).better != "neither"]
    return [m for m in known if material.published_places(m)]


def _orders(material: Material) -> list[Entry]:
    if len(material.experiment.order) < 2:
        return []
    held, against, judged = 0, [], 0
    for metric in _ordered_metrics(material):
        for place in material.places:
            found = departures(material, metric, place)
            judged += found is not None
            held += found == []
            against += [f"{words.in_text(metric)}, {place}: {text}" for text in found or []]
    if not judged:
        return [("", "Order of the planners.", "Not all planners of the published order were run.")]
    order = " < ".join(material.experiment.order)
    text = f"The published order ({order}, worst to best) holds in {held} of {judged} columns of the tables."
    text += f" It does not in: {'; '.join(against)}." if against else ""
    return [("good" if held == judged else "bad", "Order of the planners.", text)]


def order_table(material: Material) -> Table | None:
    """Return where the published order of the planners holds; None without an order."""
    if len(material.experiment.order) < 2 or not _ordered_metrics(material):
        return None
    rows = [
        Row([cell(words.title(metric)), *(_order_cell(material, metric, place) for place in material.places)])
        for metric in _ordered_metrics(material)
    ]
    caption = f"Order of the planners, worst to best; published: {' < '.join(material.experiment.order)}."
    return Table(caption, ["", *material.places], rows, words=True)


def _order_cell(material: Material, metric: str, place: str) -> list[Line]:
    order = [name for name in material.experiment.order if math.isfinite(_estimate(material, place, name, metric))]
    reverse = metric_named(metric).better == "lower"
    ranked = sorted(order, key=lambda name: _estimate(material, place, name, metric), reverse=reverse)
    found = departures(material, metric, place)
    lines = [Line(" < ".join(ranked) or words.MISSING)]
    if found is None:
        return [*lines, Line("not all were run", "sub")]
    lines.append(Line("differs", "sub", "bad") if found else Line("as published", "sub", "good"))
    theirs = [material.published(metric, place, name) for name in material.experiment.order]
    values = [v for v in theirs if v is not None]
    if len(values) == len(theirs) and any(words.better(metric, a, b) for a, b in pairwise(values)):
        lines.append(Line("the published values of this column have another order themselves", "sub"))
    return lines


def _evidence(material: Material) -> list[Entry]:
    """Return what the paired differences of the first figure say of ours."""
    if material.experiment.ours is None or not material.experiment.metrics:
        return []
    metric = material.experiment.metrics[0]
    entries = [entry for entry in comparisons(material, metric) if entry.found.used]
    if not entries:
        return []
    verdicts = [(entry, words.evidence(metric, entry.found, entry.holm)) for entry in entries]
    parts = []
    for word in ("better", "worse"):
        chosen = [entry for entry, verdict in verdicts if verdict.words == word]
        if chosen:
            parts.append(f"{word} than {words.listed([_against(metric, entry) for entry in chosen])}")
    open_ones = [f"{e.other} in {e.place}" for e, verdict in verdicts if verdict.words not in ("better", "worse")]
    if open_ones:
        parts.append(f"without evidence of a difference from {words.listed(open_ones)}")
    text = f"By {words.in_text(metric)}, map by map, {material.experiment.ours} is {'; '.join(parts)}."
    worse = any(verdict.words == "worse" for _, verdict in verdicts)
    return [("bad" if worse else "" if open_ones else "good", "Differences.", text)]


def _against(metric: str, entry: Paired) -> str:
    size = words.difference(metric, entry.found.estimate)
    bounds = words.interval(metric, entry.found, True)
    return f"{entry.other} in {entry.place} ({size} {bounds}, {words.p_words(entry.holm, 'Holm p')})"


def _collisions(material: Material) -> list[Entry]:
    hits = {planner: total(material.of(ALL, planner), "collisions") for planner in material.planners}
    robots = {p: sum(len(run.arrival_s) for run in material.of(ALL, p)) for p in material.planners}
    ran = [planner for planner in material.planners if robots[planner]]
    touched = [p for p in ran if hits[p]]
    whole = words.count(sum(robots[p] for p in ran), "journey")
    if not touched:
        return [("good", "Collisions.", f"None in {whole} of {words.listed(ran)}.")]
    parts = [f"{p} {hits[p]} of {words.grouped(robots[p])}" for p in touched]
    clean = [p for p in ran if not hits[p]]
    text = f"Robots that touched something: {words.listed(parts)}."
    text += f" None with {words.listed(clean)}." if clean else ""
    return [("bad", "Collisions.", text)]
