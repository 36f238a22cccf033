"""Print an experiment's tables as docs/results.md and docs/printed.md have them, from the store of its runs.

    swarmscope reproduce nav-scope && python docs/tables.py nav-scope
    swarmscope reproduce nav-scope --preset printed && python docs/tables.py nav-scope --preset printed

One table for each of the experiment's metrics: planners, then what was published, apart, for it was measured in other
worlds; then the paired differences of 'ours' to the others, with Holm's correction over the table.
"""

from __future__ import annotations

import argparse
import math
from pathlib import Path

from swarmscope.cli.experiment import load, store_path
from swarmscope.experiments.campaign import state_of
from swarmscope.experiments.experiment import sweep_label
from swarmscope.experiments.store import Store
from swarmscope.judging.statistics import PairedDifference
from swarmscope.viewing.report import words
from swarmscope.viewing.report.material import Material

MINUS = str.maketrans("-", "−")


def shown(metric: str, value: float) -> str:
    """Return a figure in words, with a true minus sign."""
    return words.value(metric, value).translate(MINUS)


def cell(material: Material, place: str, planner: str, metric: str) -> str:
    """Return a figure with its interval; arrivals as counts."""
    runs = material.of(place, planner)
    if not runs:
        return ""
    found = material.figure(place, planner, metric)
    if metric == "arrival_rate":
        robots = sum(len(run.arrival_s) for run in runs)
        arrived = sum(int(math.isfinite(t)) for run in runs for t in run.arrival_s)
        return f"{arrived} of {robots}" + ("" if arrived == robots else f" ({shown(metric, found.estimate)})")
    if not math.isfinite(found.low):
        return shown(metric, found.estimate)
    return f"{shown(metric, found.estimate)} ({shown(metric, found.low)} to {shown(metric, found.high)})"


def table(material: Material, metric: str) -> str:
    """Return the table of a metric."""
    places, ours = material.places, material.experiment.ours
    lines = [f"{words.title(metric)}:", "", "| | " + " | ".join(places) + " |", "|---" * (len(places) + 1) + "|"]
    for planner in material.planners:
        name = f"**{planner}**" if planner == ours else planner
        lines.append(f"| {name} | " + " | ".join(cell(material, place, planner, metric) for place in places) + " |")
    for planner in material.shown_planners(metric):
        values = [material.published(metric, place, planner) for place in places]
        if any(value is not None for value in values):
            cells = ["" if value is None else f"*{shown(metric, value)}*" for value in values]
            lines.append(f"| *published, other worlds: {planner}* | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def differences(material: Material, metric: str) -> str:
    """Return what ours differs by from each other planner, map by map."""
    ours, places = material.experiment.ours, material.places
    if ours is None:
        return ""
    others = [planner for planner in material.planners if planner != ours]
    found = {(other, place): material.paired(place, ours, other, metric) for other in others for place in places}
    sure = dict(zip(found, words.holm([one.p_value for one in found.values()]), strict=True))
    sign = f"\\* Holm's p below {words.EVIDENCE}"
    head = f"{words.title(metric)} of {ours} minus that of the others, map by map ({sign}):"
    lines = [head, "", "| | " + " | ".join(places) + " |", "|---" * (len(places) + 1) + "|"]
    for other in others:
        cells = [_difference(metric, found[other, place], sure[other, place]) for place in places]
        lines.append(f"| minus {other} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _difference(metric: str, found: PairedDifference, p_value: float) -> str:
    if not math.isfinite(found.low):
        return ""
    star = "\\*" if p_value < words.EVIDENCE else ""
    return f"{words.difference(metric, found.estimate)} {words.interval(metric, found, True)}{star}".translate(MINUS)


def main() -> None:
    """Read the options, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("name", help="a shipped experiment, or a file")
    parser.add_argument("--preset", help="of its planners")
    parser.add_argument("--store", type=Path, help="else runs/<name>/results.sqlite")
    options = parser.parse_args()
    experiment = load(options.name, options.preset)
    with Store(store_path(experiment, options.store), create=False) as results:
        material = Material(experiment, list(results.runs(state_of(experiment, results, None).units)))
    for metric in experiment.metrics:
        print(f"\n{table(material, metric)}")
    for metric in experiment.metrics:
        print(f"\n{differences(material, metric)}")
    for sweep in experiment.sweeps:
        print(f"\nγ by {sweep.name}:\n\n| {sweep.name} | " + " | ".join(f"{value:g}" for value in sweep.values) + " |")
        print("|---" * (len(sweep.values) + 1) + "|")
        for place in material.places:
            labels = [sweep_label(sweep, value) for value in sweep.values]
            cells = [cell(material, place, label, "path_redundancy") for label in labels]
            print(f"| {place} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
