"""``swarmscope experiment`` and ``swarmscope reproduce``."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from swarmscope.cli._code import announce, files_of, refuse_code
from swarmscope.cli._console import PlainConsole
from swarmscope.cli._errors import FAILED, INTERRUPTED
from swarmscope.experiments.campaign import Keyed, State, run_missing, state_of
from swarmscope.experiments.campaign import Progress as Report
from swarmscope.experiments.engines import make_engine
from swarmscope.experiments.experiment import (
    Experiment,
    load_experiment,
    shipped_experiment,
    shipped_experiments,
    units,
)
from swarmscope.experiments.store import Store
from swarmscope.experiments.weight import estimate_weight
from swarmscope.viewing.progress import Bar

MOST_ERRORS = 5


def reproduce_command(
    name: str,
    maps: int | None,
    engine: str,
    workers: int | None,
    address: str | None,
    store: Path | None,
    out: Path | None,
    code: bool = True,
    preset: str | None = None,
) -> None:
    """Run a shipped experiment."""
    shipped_experiment(name)  # names the valid ones
    run_command(name, maps, engine, workers, address, store, out, resume=False, code=code, preset=preset)


def run_command(
    file: str,
    maps: int | None,
    engine: str,
    workers: int | None,
    address: str | None,
    store: Path | None,
    out: Path | None,
    resume: bool,
    code: bool = True,
    preset: str | None = None,
) -> None:
    """Run what is missing and write the report."""
    experiment = load(file, preset)
    files = _code_in(experiment, code)
    machine = make_engine(engine, workers, address)
    place = store_path(experiment, store)
    with Store(place, create=not resume) as results:
        announce(files)
        try:
            with progress_bar(experiment.name) as progress:
                state = run_missing(experiment, results, machine, maps, resume, progress, _say)
        except KeyboardInterrupt:
            typer.echo(f"swarmscope: stopped; finished runs are kept in {place}; the same command goes on", err=True)
            raise typer.Exit(INTERRUPTED) from None
        _print_errors(state)
        write(experiment, results, state, place, out)
    if state.failed:
        raise typer.Exit(FAILED)


def status_command(file: str, maps: int | None, store: Path | None, preset: str | None = None) -> None:
    """Print what is done, failed and missing."""
    experiment = load(file, preset)
    place = store_path(experiment, store)
    with Store(place, create=False) as results:
        state = state_of(experiment, results, maps)
        table = Table("place", "planner", "done", "failed", "missing")
        for (where, planner), units in _cells(state.units).items():
            done = sum(key in state.done for _, key in units)
            failed = sum(key in state.failed for _, key in units)
            table.add_row(where, planner, str(done), str(failed), str(len(units) - done - failed))
        PlainConsole().print(table)
        missing = len({key for _, key in state.missing})
        health = results.check()
        print(f"{place}: {len(state.done)} done, {len(state.failed)} failed, {missing} missing; file {health}")
        _print_errors(state)
        _print_damage(state, place)
    if state.damaged or health != "ok":
        raise typer.Exit(FAILED)


def report_command(
    file: str, maps: int | None, store: Path | None, out: Path | None, code: bool = True, preset: str | None = None
) -> None:
    """Write the report of what is done; users' files are not run for it."""
    experiment = load(file, preset)
    _code_in(experiment, code)
    place = store_path(experiment, store)
    with Store(place, create=False) as results:
        state = state_of(experiment, results, maps)
        write(experiment, results, state, place, out, run_files=False)
        _print_damage(state, place)
    if state.damaged:
        raise typer.Exit(FAILED)


def export_command(file: str, csv: Path, store: Path | None, preset: str | None = None) -> None:
    """Write the results as CSV."""
    experiment = load(file, preset)
    with Store(store_path(experiment, store), create=False) as results:
        print(f"{csv}: {results.export(experiment.name, csv)} runs")


def _code_in(experiment: Experiment, allowed: bool) -> list[Path]:
    """Return the users' files that an experiment runs. Errors: ConfigError if there are some and none are allowed."""
    files = files_of(unit.scenario for unit in units(experiment, 1))
    if not allowed:
        refuse_code(files)
    return files


def load(file: str, preset: str | None = None) -> Experiment:
    """Return the experiment in a file, or the shipped one of that name, with ``preset`` if one is named."""
    path = Path(file)
    if not path.is_file() and (file in shipped_experiments() or path.suffix not in (".yaml", ".yml")):
        path = shipped_experiment(file)
    return load_experiment(path, preset)


def store_path(experiment: Experiment, store: Path | None) -> Path:
    """Return where the results are."""
    return store or Path("runs") / experiment.name / "results.sqlite"


def write(
    experiment: Experiment, results: Store, state: State, store: Path, out: Path | None, run_files: bool = True
) -> None:
    """Write the report of the runs that are done."""
    from swarmscope.viewing.report import write_report

    runs = list(results.runs(state.units))
    if not runs:
        print("nothing is done yet: no report")
        return
    with Console(stderr=True).status("writing the report ...") as status:
        wanted = experiment.weight and "weight" in experiment.figures and (run_files or not _code_in(experiment, True))
        weight = estimate_weight(experiment) if wanted else None
        folder = out or store.parent / "report"
        page = write_report(experiment, runs, folder, weight, status.update, run_files)
    print(page)


@contextmanager
def progress_bar(name: str) -> Iterator[Report]:
    """Show how many runs are done, the time that it took and the time left, while the body runs."""
    with Bar(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[note]}"),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=Console(stderr=True),
        transient=True,
    ) as bar:
        job = bar.add_task(name, total=None, note="")
        first: list[int] = []

        def progress(done: int, failed: int, total: int) -> None:
            if not first:  # what was done before does not count for the time left
                first.append(done + failed - 1)
                bar.update(job, total=total, completed=first[0])
                bar.reset(job, total=total, completed=first[0], note="")
            bar.update(job, completed=done + failed, total=total, note=f"{failed} failed" if failed else "")

        yield progress


def _say(words: str) -> None:
    print(words, file=sys.stderr)


def _print_errors(state: State) -> None:
    for key in list(state.failed)[:MOST_ERRORS]:
        unit = next(u for u, k in state.units if k == key)
        print(f"failed: {unit.place}, {unit.planner}, seed {unit.seed}: {state.failed[key]}", file=sys.stderr)
    if len(state.failed) > MOST_ERRORS:
        print(f"... and {len(state.failed) - MOST_ERRORS} more", file=sys.stderr)


def _print_damage(state: State, place: Path) -> None:
    for key in list(state.damaged)[:MOST_ERRORS]:
        unit = next(u for u, k in state.units if k == key)
        why = f"{unit.place}, {unit.planner}, seed {unit.seed}: {state.damaged[key]}"
        print(f"{place}: damaged row: {why}; 'resume' sets it aside and runs it again", file=sys.stderr)
    if len(state.damaged) > MOST_ERRORS:
        print(f"... and {len(state.damaged) - MOST_ERRORS} more", file=sys.stderr)


def _cells(units: list[Keyed]) -> dict[tuple[str, str], list[Keyed]]:
    cells: dict[tuple[str, str], list[Keyed]] = {}
    for unit, key in units:
        cells.setdefault((unit.place, unit.planner), []).append((unit, key))
    return cells
