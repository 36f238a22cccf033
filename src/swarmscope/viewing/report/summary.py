"""The summary in words, made from the figures."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

from swarmscope.judging.metrics import metric_named
from swarmscope.judging.statistics import PairedDifference
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
    missed, met = [], 0
    for target in targets:
        found = material.figure(target.place, target.planner, target.metric)
        verdict = words.against_bound(target.metric, found, target.at_most, target.at_least)
        if verdict.mark == "bad":
            measured = words.value(target.metric, found.estimate)
            wanted = words.bound(target.metric, target.at_most, target.at_least)
            name = f"{words.in_text(target.metric)} of {target.planner} in {target.place}"
            missed.append(f"{name} is {measured} instead of {wanted} ({verdict.words})")
        met += verdict.mark == "good"
    still = len(targets) - met - len(missed)
    text = f"{met} of {len(targets)} are met."
    text += f" Of {still} the interval holds both: they are neither met nor missed." if still else ""
    text += f" Missed: {'; '.join(missed)}." if missed else ""
    return [("bad" if missed else "good" if not still else "", "Targets.", text)]


class Swap(NamedTuple):
    """Two neighbours in ``Experiment.order`` that do not follow it."""

    better: str
    """The one that should be better."""
    worse: str
    gap: PairedDifference
    """Of the first minus the second, over the maps."""

    @property
    def is_evidence(self) -> bool:
        """Say whether the order is really the other way round."""
        return self.gap.p_value < words.EVIDENCE


def departures(material: Material, metric: str, place: str) -> list[Swap] | None:
    """Return the neighbours in ``Experiment.order`` that do not follow it here; None: not all were run."""
    order = material.experiment.order
    if len(order) < 2 or not all(math.isfinite(_estimate(material, place, name, metric)) for name in order):
        return None
    found = []
    for worse, better in pairwise(order):
        first, second = _estimate(material, place, better, metric), _estimate(material, place, worse, metric)
        if not words.better(metric, first, second) and first != second:
            found.append(Swap(better, worse, material.paired(place, better, worse, metric)))
    return found


def _estimate(material: Material, place: str, name: str, metric: str) -> float:
    return material.figure(place, name, metric).estimate


def _ordered_metrics(material: Material) -> list[str]:
    """Return the figures of the published tables that planners can be put in order by."""
    known = [m for m in material.experiment.metrics if metric_named(m).better != "neither"]
    return [m for m in known if material.published_places(m)]


def _orders(material: Material) -> list[Entry]:
    if len(material.experiment.order) < 2:
        return []
    columns = [(m, place) for m in _ordered_metrics(material) for place in material.places]
    found = {column: departures(material, *column) for column in columns}
    judged = {column: swaps for column, swaps in found.items() if swaps is not None}
    if not judged:
        return [("", "Order of the planners.", "Not all planners of the published order were run.")]
    held = sum(not swaps for swaps in judged.values())
    order = " < ".join(material.experiment.order)
    text = f"The published order ({order}, worst to best) holds in {held} of {len(judged)} columns of the tables."
    text += _swapped(judged) if held < len(judged) else ""
    real = any(swap.is_evidence for swaps in judged.values() for swap in swaps)
    return [("bad" if real else "good" if held == len(judged) else "", "Order of the planners.", text)]


def _swapped(judged: dict[tuple[str, str], list[Swap]]) -> str:
    """Return which planners stand the other way round where, and what the paired differences say of it."""
    sentences = []
    for real in (True, False):
        where: dict[tuple[str, str], dict[str, list[str]]] = {}
        for (metric, place), swaps in judged.items():
            for swap in swaps:
                if swap.is_evidence is real:
                    shown = f"{place}: {_gap(metric, swap)}" if real else place
                    where.setdefault((swap.better, swap.worse), {}).setdefault(metric, []).append(shown)
        for (better, worse), by_metric in where.items():
            names = [f"{words.in_text(metric)} ({', '.join(places)})" for metric, places in by_metric.items()]
            says = "which the paired differences confirm" if real else "without evidence in the paired differences"
            sentences.append(f" {better} is behind {worse} by {words.listed(names)}, {says}.")
    return "".join(sentences)


def _gap(metric: str, swap: Swap) -> str:
    """Return the paired difference of two planners with interval, p value and number of maps."""
    if swap.gap.used == 0:
        return "no map in common"
    gap = f"{words.difference(metric, swap.gap.estimate)} {words.interval(metric, swap.gap, True)}".strip()
    return f"{gap}, {words.p_words(swap.gap.p_value)}, {words.count(swap.gap.used, 'map')}"


def order_table(material: Material) -> Table | None:
    """Return where the published order of the planners holds; None without an order."""
    if len(material.experiment.order) < 2 or not _ordered_metrics(material):
        return None
    rows = [
        Row([cell(words.title(metric)), *(_order_cell(material, metric, place) for place in material.places)])
        for metric in _ordered_metrics(material)
    ]
    caption = (
        f"Order of the planners, worst to best, against {' < '.join(material.experiment.order)}. Where it differs: the "
        "paired difference of the two planners that stand the other way round."
    )
    return Table(caption, ["", *material.places], rows, words=True)


def _order_cell(material: Material, metric: str, place: str) -> list[Line]:
    order = [name for name in material.experiment.order if math.isfinite(_estimate(material, place, name, metric))]
    reverse = metric_named(metric).better == "lower"
    swaps = departures(material, metric, place)
    ranked = sorted(order, key=lambda name: _estimate(material, place, name, metric), reverse=reverse)
    if swaps is None:
        return [Line(" < ".join(ranked) or words.MISSING), Line("not all were run", "sub")]
    if not swaps:
        return [Line("holds", "main", "good"), *_printed_order(material, metric, place)]
    lines = [Line(" < ".join(ranked), "main", "bad" if any(swap.is_evidence for swap in swaps) else "")]
    lines += [Line(f"{swap.better} − {swap.worse}: {_gap(metric, swap)}", "sub") for swap in swaps]
    return [*lines, *_printed_order(material, metric, place)]


def _printed_order(material: Material, metric: str, place: str) -> list[Line]:
    """Return the order of the published values where it is not ``Experiment.order`` itself."""
    values = {name: material.published(metric, place, name) for name in material.experiment.order}
    known = {name: value for name, value in values.items() if value is not None}
    reverse = metric_named(metric).better == "lower"
    printed = sorted(known, key=lambda name: known[name], reverse=reverse)
    if printed == [name for name in material.experiment.order if name in known]:
        return []
    return [Line(f"printed values: {' < '.join(printed)}", "sub")]


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
    undecided: dict[str, list[str]] = {}
    for entry, verdict in verdicts:
        if verdict.words not in ("better", "worse"):
            undecided.setdefault(entry.other, []).append(entry.place)
    if undecided:
        names = [f"{other} in {words.listed(places)}" for other, places in undecided.items()]
        parts.append(f"without evidence of a difference from {'; from '.join(names)}")
    text = f"By {words.in_text(metric)}, map by map, {material.experiment.ours} is {'; '.join(parts)}."
    worse = any(verdict.words == "worse" for _, verdict in verdicts)
    return [("bad" if worse else "" if undecided else "good", "Differences.", text)]


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
