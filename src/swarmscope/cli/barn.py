"""``swarmscope barn``: the BARN navigation benchmark."""

from __future__ import annotations

import json
import math
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from rich.console import Console
from rich.measure import Measurement
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from swarmscope.api import add_pictures
from swarmscope.barn.rules import scenario_of
from swarmscope.barn.runs import Choice, Played, play_all
from swarmscope.barn.summary import Pair, Row, as_dict, pairs_of, rows_of
from swarmscope.barn.worlds import Worlds, chosen, find_worlds
from swarmscope.cli._code import allow_code
from swarmscope.cli._console import PlainConsole
from swarmscope.errors import ConfigError
from swarmscope.experiments.seeds import seed_set
from swarmscope.experiments.warm_up import warm_up_jobs
from swarmscope.experiments.work import work
from swarmscope.judging.provenance import own_revision, versions
from swarmscope.judging.run import run_scenario
from swarmscope.judging.run_folder import check_out
from swarmscope.scenarios.plain import plain
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import planner_of
from swarmscope.scenarios.written import written_out
from swarmscope.user_files import short_name
from swarmscope.viewing.progress import Bar
from swarmscope.viewing.report.publish import put_in_place

SHOWN_FAILURES = 20
WIDE = 150
"""Columns of a table that goes into a file or another program."""
WORDS = ("planner", "m/s", "arrived", "95 %", "collisions", "score", "95 %", "time, median", "quartiles", "nearest")
"""Of the table."""


def barn_command(
    place: Path,
    planners: Sequence[str],
    speeds: Sequence[float],
    changes: Sequence[str],
    asked: str | None,
    every: int,
    workers: int | None,
    out: Path | None,
    runs_in: Path | None,
    code: bool,
) -> None:
    """Play every planner at every speed in the same worlds and print what came out."""
    worlds = find_worlds(place)
    numbers = chosen(worlds.numbers, _asked(asked), every)
    choices = choices_of(planners, speeds)
    _check(worlds, numbers[0], choices, changes, code)
    if out is not None:
        _check_writable(out)
    if runs_in is not None:
        for number in numbers:
            for choice in choices:
                check_out(_folder(runs_in, number, choice, choices))
    _warm_up([choice.planner for choice in choices])
    with _progress_bar(len(numbers) * len(choices)) as progress:
        runs = play_all(worlds, numbers, choices, changes, workers, progress)
    rows, pairs = rows_of(runs, choices), pairs_of(runs, choices)
    print_rows(rows, f"BARN, {len(numbers)} world{'' if len(numbers) == 1 else 's'} of {place.name}")
    print_pairs(pairs)
    print_failures(runs)
    _print_own_paths(runs)
    if out is not None:
        put_in_place(out.parent, {out.name: _as_json(rows, pairs, runs).encode()})
        print(out)
    if runs_in is not None:
        for folder in write_runs(runs_in, worlds, numbers, choices, changes):
            print(folder / "replay.html")


def write_command(
    place: Path, number: int, file: Path, planners: Sequence[str], speeds: Sequence[float], changes: Sequence[str]
) -> None:
    """Write the scenario of one world for ``swarmscope run``."""
    if len(planners) > 1 or len(speeds) > 1:
        raise ConfigError("--write-scenario", "give one planner and one speed")
    worlds = find_worlds(place)
    chosen(worlds.numbers, [number], 1)
    scenario = scenario_of(worlds.read(number), planners[0], speeds[0], changes)
    _check_writable(file)
    put_in_place(file.parent, {file.name: written_out(scenario).encode()})
    print(f"{file} is there; run it:")
    print(f"  {shlex.join(['swarmscope', 'run', str(file)])}")


def write_runs(
    out: Path, worlds: Worlds, numbers: Sequence[int], choices: Sequence[Choice], changes: Sequence[str]
) -> Iterator[Path]:
    """Make a folder of each run, with picture and page, as ``swarmscope run`` does; yield it when it is done."""
    for number in numbers:
        world = worlds.read(number)
        for choice in choices:
            folder = _folder(out, number, choice, choices)
            run_scenario(scenario_of(world, *choice, changes), folder, extras=add_pictures)
            yield folder


def _folder(out: Path, number: int, choice: Choice, choices: Sequence[Choice]) -> Path:
    """Return the folder of a run; planner and speed are in its name where there are several."""
    several = len(choices) > 1
    return out / (f"world-{number}" + (f"-{short_name(choice.planner)}-{choice.speed_mps:g}" if several else ""))


def _asked(text: str | None) -> list[int]:
    """Return the numbers of ``--worlds``, none where nothing is asked."""
    if text is None:
        return []
    if not set(text) <= set("0123456789-, "):
        raise ConfigError(f"--worlds {text}", "must look like 0,4,10-19")
    return seed_set(text)


def choices_of(planners: Sequence[str], speeds: Sequence[float]) -> list[Choice]:
    """Return every planner at every speed; a ConfigError names one that is there twice."""
    for key, given in (("--planner", list(map(short_name, planners))), ("--speed", [f"{v:g}" for v in speeds])):
        twice = next((one for one in given if given.count(one) > 1), None)
        if twice is not None:
            raise ConfigError(key, f"'{twice}' is there twice; name each once, and give files different names")
    return [Choice(planner, speed) for planner in planners for speed in speeds]


def print_rows(rows: Sequence[Row], title: str, width: int | None = None) -> None:
    """Print the table, a line for each planner and speed; a column where a terminal of ``width`` is too narrow."""
    lines = [WORDS, *map(_cells, rows)]
    if width is None and not sys.stdout.isatty():
        width = WIDE
    console = PlainConsole(width=width)
    table = _table(lines, title)
    if Measurement.get(console, console.options.update(width=WIDE), table).maximum > console.width:
        table = _table(list(zip(*lines, strict=True)), title)
    console.print(table)


def _table(lines: Sequence[Sequence[str]], title: str) -> Table:
    """Return the table of lines, the first of which is its head."""
    table = Table(title=title)
    for k, word in enumerate(lines[0]):
        table.add_column(word, justify="right" if k else "left", no_wrap=True)
    for line in lines[1:]:
        table.add_row(*line)
    return table


def _cells(row: Row) -> list[str]:
    """Return a row in words."""
    low, middle, high = row.quartiles_s
    score, share = row.score, row.share
    return [
        short_name(row.planner),
        f"{row.speed_mps:g}",
        f"{row.arrived} of {row.worlds}",
        f"{100.0 * share.low:.1f}-{100.0 * share.high:.1f} %",
        str(row.collisions),
        f"{score.estimate:.4f}",
        _known("{:.4f}-{:.4f}", score.low, score.high),
        _known("{:.1f} s", middle),
        _known("{:.1f}-{:.1f} s", low, high),
        _known("{:.3f} m", row.clearance_m),
    ]


def _known(form: str, *values: float) -> str:
    """Return numbers in words, a dash where one is not known."""
    return form.format(*values) if all(map(math.isfinite, values)) else "-"


def print_pairs(pairs: Sequence[Pair]) -> None:
    """Print what planners differ by in the same worlds."""
    for pair in pairs:
        of, first, second = pair.score, short_name(pair.first), short_name(pair.second)
        sure = _known(" ({:+.4f} to {:+.4f}, p = {:.2g})", of.low, of.high, of.p_value).removesuffix("-")
        print(
            f"{pair.speed_mps:g} m/s, same worlds: score of {first} less {second} {of.estimate:+.4f}{sure}; "
            f"only {first} arrives in {pair.only_first}, only {second} in {pair.only_second}"
        )


def print_failures(runs: Sequence[Played]) -> None:
    """Name the worlds in which a robot did not arrive, and why; of many only the first."""
    failed = [one for one in runs if not one.arrived]
    for one in failed[:SHOWN_FAILURES]:
        print(f"{short_name(one.planner)}, {one.speed_mps:g} m/s, world {one.world}: {one.why}")
    if len(failed) > SHOWN_FAILURES:
        print(f"... and {len(failed) - SHOWN_FAILURES} more, all named in the file of --out")


def _print_own_paths(runs: Sequence[Played]) -> None:
    """Say so where scores compare with another way than the challenge's."""
    without = len({one.world for one in runs if not one.own_path})
    if without:
        print(f"{without} worlds come without a path file: their scores compare with the shortest way of the robot")


def _check(worlds: Worlds, number: int, choices: Sequence[Choice], changes: Sequence[str], code: bool) -> None:
    """Raise an error before anything is run: in keys, users' files, or libraries of planners."""
    world = worlds.read(number)
    scenarios: list[Scenario] = [scenario_of(world, *choice, changes) for choice in choices]
    allow_code(scenarios, code)
    for scenario in scenarios:
        planner_of(scenario.planner).check_available()


def _check_writable(file: Path) -> None:
    """Raise an error before the work when a file cannot be written."""
    if file.is_dir():
        raise ConfigError(str(file), "is a folder; name the file to write")
    put_in_place(file.parent, {})


def _warm_up(planners: Sequence[str]) -> None:
    """Compile what has to be compiled once, instead of in every process at the same time."""
    jobs = warm_up_jobs(planners)
    if jobs:
        print("compiling kernels for the first time (a minute or two, kept on disk) ...", file=sys.stderr)
    for job in jobs:
        work(job)


def _as_json(rows: Sequence[Row], pairs: Sequence[Pair], runs: Sequence[Played]) -> str:
    about = {"command": shlex.join(["swarmscope", *sys.argv[1:]]), "revision": own_revision(), "versions": versions()}
    values = {
        "about": about,
        "rows": [as_dict(row) for row in rows],
        "pairs": [pair._asdict() | {"score": pair.score._asdict()} for pair in pairs],
        "runs": [one._asdict() for one in runs],
    }
    return json.dumps(plain(values, finite=True), indent=1, allow_nan=False) + "\n"


@contextmanager
def _progress_bar(total: int) -> Iterator[Callable[[int], None]]:
    """Show on stderr how many runs are done."""
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Bar(
        *columns, TextColumn("left"), TimeRemainingColumn(), console=Console(stderr=True), transient=True
    ) as bar:
        job = bar.add_task("BARN", total=total)
        yield lambda done: bar.update(job, completed=done)
