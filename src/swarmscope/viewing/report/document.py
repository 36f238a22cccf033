"""The whole report, chapter by chapter."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import yaml

from swarmscope.errors import SwarmscopeError
from swarmscope.experiments.experiment import Experiment, shipped_experiments
from swarmscope.judging.provenance import own_revision, versions
from swarmscope.viewing.report import figures, tables, words
from swarmscope.viewing.report.again import Again
from swarmscope.viewing.report.blocks import (
    Block,
    Command,
    Document,
    Facts,
    Folded,
    Heading,
    Points,
    Section,
    Table,
    Text,
)
from swarmscope.viewing.report.cases import case_blocks
from swarmscope.viewing.report.material import ALL, POOLED, Material
from swarmscope.viewing.report.paths import path_picture
from swarmscope.viewing.report.summary import summary_blocks

Progress = Callable[[str], None]
HEADINGS = {
    "boxes": "Spread over the maps",
    "paths": "Paths",
    "sweeps": "Sweeps",
    "field": "Interaction force",
    "cases": "Convergence and divergence",
    "weight": "Weight of the neighbours, from data",
    "resources": "Computation and communication",
    "flow_time": "Flow-time increase",
}
MOST_NAMED = 12
"""More failures than this are folded away."""


def make_document(material: Material, progress: Progress, run_files: bool = True) -> Document:
    """Return the report of an experiment; every chapter stands even when there is nothing to put into it."""
    experiment = material.experiment
    progress("tables")
    sections = [
        Section("Summary", "summary", summary_blocks(material)),
        Section("Results", "results", _results(material)),
        Section("Paired differences", "differences", _differences(material)),
        Section("Failures and collisions", "failures", _failures(material)),
        Section("Figures", "figures", _figures(material, progress, run_files)),
        Section("Parameters", "parameters", _parameters(material)),
        Section("Known differences", "notes", _notes(experiment)),
    ]
    sections = [section for section in sections if section.blocks]
    return Document(experiment.title, experiment.name, _about(material), _facts(material), _again(experiment), sections)


def _about(material: Material) -> str:
    experiment, main = material.experiment, material.main_runs()
    robots = sum(len(run.arrival_s) for run in main)
    lost = robots - sum(int(np.isfinite(run.arrival_s).sum()) for run in main)
    hit = tables.total(main, "collisions")
    ran = [p for p in material.planners if material.of(ALL, p)]
    swept = len(material.runs) - len(main)
    text = f"{experiment.about} " if experiment.about else ""
    if not main:
        return f"{text}There are no runs yet."
    text += (
        f"{words.listed(ran)} in {words.listed(material.places)}: {words.count(len(main), 'run')} over the worlds of "
        f"seeds {words.spans(run.seed for run in main)}, {words.count(robots, 'journey')} of single robots. "
        + (f"{words.grouped(lost)} of them did not arrive; " if lost else "All arrived; ")
        + (f"{words.count(hit, 'robot')} touched something." if hit else "no robot touched anything.")
    )
    absent = [p for p in material.planners if p not in ran]
    text += f" Not run: {words.listed(absent)}." if absent else ""
    return text + (f" Sweeps add {words.count(swept, 'run')}." if swept else "")


def _facts(material: Material) -> Facts:
    main = material.main_runs()
    robots = sorted({len(run.arrival_s) for run in main})
    lost = sum(len(run.arrival_s) - int(np.isfinite(run.arrival_s).sum()) for run in main)
    installed = ", ".join(f"{name} {version}" for name, version in versions().items())
    return Facts(
        [
            ("Places", ", ".join(material.places)),
            ("Planners", ", ".join(material.planners)),
            ("Seeds", words.spans(run.seed for run in main)),
            ("Runs", f"{words.grouped(len(material.runs))}"),
            ("Robots per run", words.spans(robots)),
            ("Did not arrive", words.grouped(lost)),
            ("Collisions", words.grouped(tables.total(main, "collisions"))),
            ("Report made with", f"{installed}, revision {own_revision()}"),
        ]
    )


def _again(experiment: Experiment) -> Command:
    preset = "" if experiment.preset is None else f" --preset {experiment.preset}"
    name = experiment.name.removesuffix(f"-{experiment.preset}")
    if name in shipped_experiments():
        return Command(f"swarmscope reproduce {name}{preset}")
    return Command(f"swarmscope experiment run FILE{preset}")


def _results(material: Material) -> list[Block]:
    if not material.main_runs():
        return []
    shown = list(dict.fromkeys(material.experiment.metrics))
    published = {table.metric for table in material.experiment.published}
    costs = tables.RESOURCES if "resources" in material.experiment.figures else ()
    shown += [m for m in sorted(published) if m not in shown and m not in costs]
    intro = (
        "In brackets: 95 % intervals. Arrival rates have Wilson's interval over robots; path redundancy, path stretch "
        "and SPL are pooled over the robots of all runs, with a percentile bootstrap over the maps; everything else "
        "is the mean over the maps, bootstrapped in the same way."
    )
    if {"path_redundancy", "path_stretch"} & set(shown):
        intro += (
            " γ and path stretch sum over the robots that arrived; γ with sums over all robots stands below γ. "
            "Robots that are lost early have short ways, so read it beside the arrival rate."
        )
    intro += " Differences from published values are judged against the interval: green is better, red is worse."
    known = [m for m in shown if any(m in run.figures for run in material.main_runs()) or m in POOLED]
    blocks: list[Block] = [Text(intro), *(tables.metric_table(material, metric) for metric in known)]
    if "duration_s" in known:
        blocks.append(tables.time_table(material))
    absent = [words.in_text(metric) for metric in shown if metric not in known]
    if absent:
        blocks.append(Text(f"Not measured in these runs: {words.listed(absent)}.", "note"))
    return blocks


def _differences(material: Material) -> list[Block]:
    found = [tables.paired_table(material, metric) for metric in material.experiment.metrics]
    gap = tables.gap_table(material)
    shown = [table for table in [*found, gap] if table is not None]
    if not shown:
        return []
    intro = (
        "Every planner meets the same worlds, so differences are taken map by map: mean, 95 % bootstrap interval over "
        "the maps, p value of the sign-flip test, and the p value corrected for all comparisons of the table (Holm). "
        f"A difference is called better or worse when the corrected p is below {words.EVIDENCE:g}."
    )
    return [Text(intro), *shown]


def _failures(material: Material) -> list[Block]:
    if not material.main_runs():
        return []
    blocks: list[Block] = [tables.failure_table(material)]
    named, ours = tables.named_failures(material), material.leading()
    if not material.of(ALL, ours):
        return blocks
    if not named:
        return [*blocks, Text(f"Every robot of {ours} arrived, in every run.")]
    table = Table(f"Robots of {ours} that did not arrive.", ["place", "seed", "robot", "why"], named, words=True)
    if len(named) <= MOST_NAMED:
        return [*blocks, table]
    return [*blocks, Folded(f"The {len(named)} robots of {ours} that did not arrive, one by one", [table])]


def _figures(material: Material, progress: Progress, run_files: bool) -> list[Block]:
    makers: dict[str, Callable[[], list[Block]]] = {
        "boxes": lambda: list(figures.box_pictures(material)),
        "paths": lambda: _or_nothing(path_picture(material, again, progress)),
        "sweeps": lambda: list(figures.sweep_pictures(material)),
        "field": lambda: [figures.field_picture(material)],
        "cases": lambda: case_blocks(material, again, progress) if material.of(ALL, material.leading()) else [],
        "weight": lambda: [tables.weight_table(material.weight)] if material.weight is not None else [],
        "flow_time": lambda: _or_nothing(figures.flow_time_picture(material)),
        "resources": lambda: [tables.resource_table(material)] if material.main_runs() else [],
    }
    again, blocks = Again(run_files), list[Block]()
    for name in dict.fromkeys(material.experiment.figures):
        progress(f"figure: {name}")
        try:
            made = makers[name]()
        except SwarmscopeError as error:
            made = [Text(f"This could not be drawn: {error}", "note")]
        blocks += [Heading(HEADINGS[name]), *made] if made else []
    return blocks


def _or_nothing(block: Block | None) -> list[Block]:
    return [] if block is None else [block]


def _parameters(material: Material) -> list[Block]:
    blocks: list[Block] = [tables.needs_table(material), tables.parameter_table(material)]
    runs = material.of(ALL, material.leading()) or material.main_runs()
    if runs:
        where = f"{runs[0].planner} in {runs[0].place}, seed {runs[0].seed}"
        blocks.append(Folded(f"Complete scenario of one run ({where})", [Command(_yaml(runs[0].config))]))
    plain = material.experiment.model_dump(mode="json", exclude_none=True)
    blocks.append(Folded("The experiment", [Command(_yaml(plain))]))
    return blocks


def _yaml(values: dict[str, object]) -> str:
    return str(yaml.safe_dump(values, sort_keys=False, allow_unicode=True, width=100)).rstrip()


def _notes(experiment: Experiment) -> list[Block]:
    return [Points([("", "", note) for note in experiment.notes])] if experiment.notes else []
