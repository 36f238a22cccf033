"""``swarmscope storm``: random hostile runs that look for contacts."""

from __future__ import annotations

import re
import shlex
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import typer
from rich.table import Table

from swarmscope.cli._code import announce, refuse_code
from swarmscope.cli._console import PlainConsole
from swarmscope.errors import ConfigError
from swarmscope.experiments.warm_up import warm_up_jobs
from swarmscope.experiments.work import work
from swarmscope.judging.provenance import own_revision
from swarmscope.onboard.planners import load_planner
from swarmscope.storm.breach_file import as_text, read_case
from swarmscope.storm.draw import draw
from swarmscope.storm.play import Played, Storm, code_of, watched
from swarmscope.storm.runs import Until, rage, shrink_all, usual_planners
from swarmscope.storm.shrink import shrink
from swarmscope.storm.tally import Piece, Sum, Tally, add_up, read_tally
from swarmscope.user_files import is_file_name, short_name, whole_path
from swarmscope.viewing.report.publish import put_in_place

BROKEN = 1
"""Exit code of a storm with a breach."""
DRAWN = re.compile(r"(\d+):(\d+)")
SHRUNK = 8
"""Breaches that are made small and written; of others the numbers are named."""
SAVED_S = 30.0
"""The file of ``--into`` is written at least so often."""
SHOWN_REASONS = 12
WIDE = 150


def storm_command(
    storm: Storm, until: Until, into: Path | None, workers: int | None, out: Path, code: bool
) -> None:
    """Run the storm and print what it adds up to; with a breach the exit code is 1."""
    planners = _checked(storm.planners, code)
    storm = storm._replace(planners=planners)
    piece = Piece(code_of(planners), " ".join(planners), storm.covered, storm.seed)
    told = _read(into)
    _warm_up(planners)
    rows = []
    mine, saved = Tally(), time.monotonic()
    for row in rage(storm, until._replace(done=told.numbers(piece)), workers):
        mine.add(piece, own_revision(), row)
        rows.append(row)
        _show(rows)
        if into is not None and time.monotonic() - saved > SAVED_S:
            _save(into, mine)
            saved = time.monotonic()
    _end_line()
    if into is not None:
        print_sum(add_up(rows), f"Storm {storm.seed}, this time")
        print_sum(add_up(_save(into, mine).rows()), f"All runs in {into}")
    else:
        print_sum(add_up(rows), f"Storm {storm.seed}")
    broken = sorted((row for row in rows if row.get("breach") is not None), key=lambda row: int(row["number"]))
    for row in broken:
        breach = row["breach"]
        print(f"breach {storm.seed}:{row['number']}: {breach['kind']}, {row['planner']}: {breach['text']}")
    if broken:
        _write_breaches(storm, broken, workers, out)
        raise typer.Exit(BROKEN)


def replay_command(what: str, storm: Storm, out: Path, code: bool) -> None:
    """Play one run of a storm, or that in a file; with a breach the exit code is 1. A drawn one is made small."""
    numbers = DRAWN.fullmatch(what)
    if numbers is None:
        case = read_case(Path(what))
        _checked([case.values.get("planner", {}).get("name", "nav-scope")], code)
        if _tell(watched(case)):
            raise typer.Exit(BROKEN)
        return
    seed, index = int(numbers[1]), int(numbers[2])
    drawn = draw(seed, index, _checked(storm.planners, code), storm.covered)
    if isinstance(drawn, dict):
        raise ConfigError(f"--replay {what}", "no possible run was drawn under this number")
    played = watched(drawn.case, drawn.again, drawn.setup)
    if not _tell(played) or played.breach is None:
        return
    breach = played.breach
    smaller, found = (drawn.case, None) if breach.kind == "bytes" else shrink(drawn.case, breach.kind)
    _put(out, f"breach-{seed}-{index}.yaml", as_text(smaller, found or breach, what))
    raise typer.Exit(BROKEN)


def print_sum(total: Sum, title: str) -> None:
    """Print what runs add up to."""
    table = Table(title=title, show_header=False)
    table.add_column(no_wrap=True)
    table.add_column()
    per = f"{total.contacts} contacts in {total.under_way_h:.2f} h" if total.under_way_h > 0.0 else "nothing drove"
    for name, text in (
        ("runs", f"{total.runs}, {total.repeated} of them run twice"),
        ("robots", f"{total.robots}, of which {total.arrived} arrived"),
        ("robot-hours under way", f"{total.under_way_h:.2f}, {total.driving_h:.2f} of them driving"),
        ("contacts", str(total.contacts)),
        ("breaches, contacts included", str(total.breaches)),
        ("contact rate, 95 %", f"below {total.bound_per_h:.3g} per robot-hour ({per})"),
        ("draws refused", _counts(total.refused)),
        ("not arrived", _counts(total.reasons)),
        ("slowest run", _slowest(total)),
    ):
        table.add_row(name, text)
    PlainConsole(width=None if sys.stdout.isatty() else WIDE).print(table)


def _counts(counts: dict[str, int]) -> str:
    """Return counts, a line each."""
    lines = [f"{count:6d}  {what}" for what, count in list(counts.items())[:SHOWN_REASONS]]
    if len(counts) > SHOWN_REASONS:
        lines.append(f"{sum(list(counts.values())[SHOWN_REASONS:]):6d}  others")
    return "\n".join(lines) or "none"


def _slowest(total: Sum) -> str:
    row = total.slowest
    if row is None:
        return "none"
    planner = short_name(row["planner"])
    return f"number {row['number']}: {row['wall_s']:.1f} s, {row['robots']} robots, {planner}, {row['where']}"


def _checked(planners: Sequence[str], code: bool) -> list[str]:
    """Return the planners, users' files by their full names. Errors: those of names, files and libraries."""
    found = list(planners) or usual_planners()
    files = [whole_path(name) for name in found if is_file_name(name)]
    if not code:
        refuse_code(files)
    announce(files)
    for name in found:
        load_planner(name).check_available()
    return [str(whole_path(name)) if is_file_name(name) else name for name in found]


def _read(into: Path | None) -> Tally:
    """Return what the file holds. Errors: before any work, where it cannot be read or written."""
    if into is None:
        return Tally()
    if into.is_dir():
        raise ConfigError(str(into), "is a folder; name the file to add to")
    told = read_tally(into)
    put_in_place(into.parent, {})
    return told


def _save(into: Path, mine: Tally) -> Tally:
    """Add to what the file holds now, and write it in one step."""
    both = read_tally(into)
    both.merge(mine)
    put_in_place(into.parent, {into.name: both.as_text().encode()})
    return both


def _write_breaches(storm: Storm, broken: Sequence[dict[str, Any]], workers: int | None, out: Path) -> None:
    sys.stdout.flush()
    print(f"making {min(len(broken), SHRUNK)} of {len(broken)} breaches small ...", file=sys.stderr)
    for number, text in shrink_all(storm, broken[:SHRUNK], workers):
        _put(out, f"breach-{storm.seed}-{number}.yaml", text)


def _put(out: Path, name: str, text: str) -> None:
    put_in_place(out, {name: text.encode()})
    print(f"{out / name} is there; see it again:")
    print(f"  {shlex.join(['swarmscope', 'storm', '--replay', str(out / name)])}")


def _tell(played: Played) -> bool:
    """Print how a run ended; return whether it broke something."""
    if played.breach is not None:
        print(f"breach in tick {played.breach.tick}: {played.breach.kind}: {played.breach.text}")
        return True
    print(f"no breach in {played.simulated_s:.1f} s; {played.arrived} robots arrived")
    for reason, count in played.reasons.items():
        print(f"{count:6d}  {reason}")
    return False


def _warm_up(planners: Sequence[str]) -> None:
    """Compile what has to be compiled once, instead of in every process at the same time."""
    jobs = warm_up_jobs(planners)
    if jobs:
        print("compiling kernels for the first time (a minute or two, kept on disk) ...", file=sys.stderr)
    for job in jobs:
        work(job)


def _show(rows: Sequence[dict[str, Any]]) -> None:
    """Show on stderr how far the storm is: on a terminal one line, else every hundredth run."""
    if not sys.stderr.isatty() and len(rows) % 100:
        return
    hours = sum(float(row.get("under_way_s", 0.0)) for row in rows) / 3600.0
    broken = sum(row.get("breach") is not None for row in rows)
    end = "\r" if sys.stderr.isatty() else "\n"
    print(f"{len(rows)} runs, {hours:.2f} robot-hours, {broken} breaches", end=end, file=sys.stderr, flush=True)


def _end_line() -> None:
    if sys.stderr.isatty():
        print(file=sys.stderr)
