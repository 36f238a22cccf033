"""Tables of the unit disk, for a terminal and as a page."""

from __future__ import annotations

import math
from collections.abc import Sequence

import rich.table
from rich import box

from swarmscope.disk.study.figures import (
    DIFFERENCE,
    PUBLISHED,
    Played,
    Row,
    compare,
    failures,
    rows_by_map,
)
from swarmscope.viewing.report import blocks
from swarmscope.viewing.report.page import page_text

PRINTED = "printed in the report"
MOST_FAILURES = 30
MOST_MAPS = 12
"""With more maps than that only the figures of all of them together are shown."""
PUBLISHED_RUNS = 120
NOTES = {
    "Bound": "every robot alone on its shortest way round the obstacles at full speed; the run's bound is that of the "
    "robot with the longest way. No controller can beat it, and where robots have to make way for each other it "
    "cannot be reached.",
    "Steps": "until all robots are within the tolerance of their goals at the same time. A run that does not arrive "
    "counts with all the steps that it had.",
    "Collisions": "robot with robot, robot with obstacle, a centre outside of the disk; looked for between the steps, "
    "too.",
    "Printed figures": DIFFERENCE,
}


def terminal_table(all_rows: Sequence[Row], title: str, printed: bool) -> rich.table.Table:
    """Return the rows as a table, with the printed ones where there are some."""
    table = rich.table.Table(title=title, box=box.SIMPLE_HEAD)
    for name in ("map", "controller"):
        table.add_column(name, no_wrap=True)
    for name in ("arrived", "mean", "± sd", "max", "min", "bound", "/ bound", "collisions", "gap robots", "obstacles"):
        table.add_column(name, justify="right", no_wrap=True)
    for place in dict.fromkeys(row.place for row in all_rows):
        if printed and place in PUBLISHED:
            known = PUBLISHED[place]
            table.add_row(
                place,
                PRINTED,
                f"{known.arrived}/{PUBLISHED_RUNS}",
                f"{known.mean:,.1f}",
                f"{known.sd:,.0f}",
                str(known.most),
                str(known.least),
                "",
                "",
                "",
                "",
                "",
                style="dim",
            )
        for row in all_rows:
            if row.place == place:
                table.add_row(place, row.controller, *_cells(row))
        table.add_section()
    return table


def _cells(row: Row) -> list[str]:
    return [
        f"{row.arrived}/{row.runs}",
        f"{row.mean:,.1f}",
        f"{row.sd:,.0f}",
        str(row.most),
        str(row.least),
        f"{row.bound:,.1f}",
        f"{row.ratio:.4f}",
        str(row.collisions),
        _gap(row.robot_gap),
        _gap(row.obstacle_gap),
    ]


def _gap(gap: float) -> str:
    return f"{gap:.1e}" if math.isfinite(gap) else "-"


def page(title: str, about: str, command: str, facts: list[tuple[str, str]], groups: Sequence[Sequence[Played]]) -> str:
    """Return a page with a section for each group of runs; in a group all controllers played the same runs."""
    notes = blocks.Points([("", front, text) for front, text in NOTES.items()])
    sections = [*(_section(group) for group in groups), blocks.Section("How to read this", "notes", [notes])]
    return page_text(blocks.Document(title, "unit disk", about, blocks.Facts(facts), blocks.Command(command), sections))


def _section(group: Sequence[Played]) -> blocks.Section:
    first = group[0].problem
    name = f"{first.rules.n} robots of radius {first.rules.r:.4g}"
    tables: list[blocks.Block] = [_figures(group)]
    if len(group) > 1:
        tables.append(_pairs(group))
    failed = [(of.label, *one) for of in group for one in failures(of)]
    if failed:
        tables.append(_failed(failed))
    return blocks.Section(name, f"n{first.rules.n}", tables)


def _figures(group: Sequence[Played]) -> blocks.Table:
    header = ["controller", "map", "arrived", "mean ± sd", "bound", "mean / bound", "collisions", "gaps"]
    rows = []
    by_map = [rows_by_map(of) if len(of.problem.maps) <= MOST_MAPS else rows_by_map(of)[-1:] for of in group]
    for k, place in enumerate(row.place for row in by_map[0]):
        if place in PUBLISHED and by_map[0][k].runs == PUBLISHED_RUNS:
            rows.append(_printed(place))
        rows += [_measured(rows_of[k]) for rows_of in by_map]
    return blocks.Table(
        "Steps until all have arrived", header, rows, "Gaps: the smallest between robots, to obstacles."
    )


def _printed(place: str) -> blocks.Row:
    known = PUBLISHED[place]
    mean = f"{known.mean:,.2f} ± {known.sd:,.0f}"
    spread = f"{known.least} to {known.most}"
    cells = [blocks.cell(text) for text in (PRINTED, place, f"{known.arrived}/{PUBLISHED_RUNS}")]
    return blocks.Row([*cells, blocks.cell(mean, "", spread), *(blocks.cell("") for _ in range(4))])


def _measured(row: Row) -> blocks.Row:
    cells = [
        blocks.cell(row.controller),
        blocks.cell(row.place),
        blocks.cell(f"{row.arrived}/{row.runs}", "", f"{row.share.low:.1%} to {row.share.high:.1%}"),
        blocks.cell(f"{row.mean:,.1f} ± {row.sd:,.0f}", "", f"{row.least} to {row.most}"),
        blocks.cell(f"{row.bound:,.1f}"),
        blocks.cell(f"{row.ratio:.4f}"),
        blocks.cell(_collisions(row)),
        blocks.cell(_gap(row.robot_gap), "", _gap(row.obstacle_gap)),
    ]
    return blocks.Row(cells, strong=row.place == "all")


def _collisions(row: Row) -> str:
    if not row.collisions:
        return "0"
    return f"{row.hit_robot} robots, {row.hit_obstacle} obstacles, {row.left_disk} rim"


def _pairs(group: Sequence[Played]) -> blocks.Table:
    rows = []
    for k, first in enumerate(group):
        for second in group[k + 1 :]:
            found = compare(first, second)
            cells = [
                f"{first.label} - {second.label}",
                f"{found.estimate:+,.1f}",
                f"{found.low:+,.1f} to {found.high:+,.1f}",
                f"{found.p_value:.4f}",
                str(found.used),
            ]
            rows.append(blocks.Row([blocks.cell(text) for text in cells]))
    return blocks.Table(
        "Steps, run by run",
        ["difference", "mean", "95 % interval", "p (sign flips)", "runs"],
        rows,
        "The same maps and permutations for both; intervals are bootstraps over runs.",
    )


def _failed(failed: Sequence[tuple[str, str, str, str]]) -> blocks.Folded:
    rows = [blocks.Row([blocks.cell(text) for text in one]) for one in failed[:MOST_FAILURES]]
    more = f"The first {MOST_FAILURES} of {len(failed)}." if len(failed) > MOST_FAILURES else ""
    table = blocks.Table(
        "Runs that did not arrive", ["controller", "map", "permutation", "what happened"], rows, more, words=True
    )
    return blocks.Folded(f"{len(failed)} runs did not arrive", [table])
