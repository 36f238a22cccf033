"""``swarmscope run``."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from swarmscope.api import add_pictures
from swarmscope.bounds import number_of
from swarmscope.cli._code import announce, files_of, refuse_code
from swarmscope.cli._console import PlainConsole
from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.experiments.warm_up import COMPILING, kernels_are_cold
from swarmscope.judging.run import Watch, run_scenario
from swarmscope.judging.run_folder import check_out, check_same
from swarmscope.judging.run_names import headline, usual_folder
from swarmscope.scenarios.overrides import PLACES, choose, set_key, set_path
from swarmscope.scenarios.read import parse_scenario, read_scenario_file
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import complete
from swarmscope.viewing.bag.exact import Exact
from swarmscope.viewing.bag.make import NAME as MCAP
from swarmscope.viewing.bag.make import adder, check_packages
from swarmscope.viewing.progress import progress_bar

MOST_FAILURES = 10
OPTIONS = {"starts": "start", "goals": "goal", "resolution_m": "resolution", "first_trip": "first-trip"}
"""Options that are not called as their keys."""
PLACED = ("starts", "goals")
"""Options that are places."""
ROWS = (
    ("arrival_rate", "arrived", "{:.1%}"),
    ("collisions", "collisions", "{:.0f}"),
    ("path_redundancy", "path redundancy (24), A* at 0.05 m", "{:.2%}"),
    ("path_stretch", "path stretch over A*", "{:.4f}"),
    ("path_stretch_any_angle", "path stretch over the true shortest way", "{:.4f}"),
    ("spl", "SPL", "{:.2%}"),
    ("duration_s", "last arrival", "{:.1f} s"),
    ("waiting_s", "waiting, mean per robot", "{:.1f} s"),
    ("min_clearance_m", "smallest clearance", "{:.3f} m"),
    ("fusions", "sides chosen", "{:.0f}"),
    ("messages", "packets sent", "{:.0f}"),
    ("mean_package_bytes", "mean package of features", "{:.1f} bytes"),
    ("bytes_sent", "payload sent, all robots", "{:.0f} bytes"),
    ("bytes_on_air", "on the air, all robots", "{:.0f} bytes"),
    ("plan_us_p50", "planning step, median", "{:.1f} us"),
    ("plan_us_p99", "planning step, 99 %", "{:.1f} us"),
)


class Make(NamedTuple):
    """What a run folder is to hold beside the results."""

    pictures: bool = True
    mcap: bool = False


def run_command(
    file: Path | None,
    task: str | None,
    map_: str | None,
    planner: str | None,
    options: dict[str, Any],
    changes: list[str],
    out: Path | None,
    threads: int,
    make: Make,
    code: bool = True,
    force: bool = False,
) -> None:
    """Run what the command line asks for and print what came out."""
    if make.mcap:
        check_packages()
    scenario = read_options(file, task, map_, planner, options, changes)
    files = files_of([scenario])
    if not code:
        refuse_code(files)
    place = out or usual_folder(scenario)
    check_out(place)
    if not force:
        check_same(place, complete(scenario))
    announce(files)
    if kernels_are_cold(scenario.planner.name):
        print(COMPILING, file=sys.stderr)
    exact = Exact() if make.mcap else None
    with progress_bar(scenario) as progress, _named(file):
        metrics = run_scenario(scenario, place, threads, progress, *_extras(make, exact))
    print_metrics(PlainConsole(), metrics)
    print_failures(metrics["failures"])
    made = ["paths.png", "replay.html"] if make.pictures else ["metrics.json"]
    for name in [*made, MCAP] if make.mcap else made:
        print(place / name)


@contextmanager
def _named(file: Path | None) -> Iterator[None]:
    """Name the scenario's file in what is wrong with the place that it describes."""
    try:
        yield
    except (ConfigError, UnsolvableWorldError) as error:
        if file is None:
            raise
        raise ConfigError(str(file), str(error)) from None


def _extras(make: Make, exact: Exact | None) -> tuple[Callable[[Path], None], Watch]:
    """Return what adds to the folder what was asked for, and who looks on for that."""
    steps: list[Callable[[Path], None]] = [add_pictures] if make.pictures else []
    if exact is not None:
        steps.append(adder(exact))

    def extras(folder: Path) -> None:
        for step in steps:
            step(folder)

    return extras, Watch() if exact is None else exact.watch


def _set_option(values: dict[str, Any], key: str, value: Any) -> None:
    """Set an option; starts and goals are text with degrees."""
    group, _, name = key.rpartition(".")
    option = f"--{OPTIONS.get(name, name)}"
    if group == "map" and not isinstance(values.get(group), dict):
        raise ConfigError(option, "needs --map, or a scenario with a map")
    if name in PLACED:
        value = [_read_place(text, option) for text in value]
    set_path(values, key.split("."), value, option)


def _read_place(text: str, option: str) -> list[float]:
    """Return x, y [m] and what may follow, degrees in radians."""
    numbers = [number_of(part) for part in text.split(",")]
    if len(numbers) not in (2, 3) or not np.isfinite(numbers).all():
        raise ConfigError(f"{option} {text}", "must look like X,Y or X,Y,DEG")
    return [*numbers[:2], *np.radians(numbers[2:]).tolist()]


def print_metrics(console: Console, metrics: dict[str, Any]) -> None:
    """Print the key figures as a table."""
    about = metrics["run"]
    table = Table(title=headline(about, about["robots"]), show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    for key, words, form in ROWS:
        value = metrics.get(key)
        if value is not None and np.isfinite(value):
            table.add_row(words, form.format(value))
    console.print(table)


def print_failures(failures: list[dict[str, Any]]) -> None:
    """Print why robots did not arrive; of many only the first."""
    for failure in failures[:MOST_FAILURES]:
        print(f"robot {failure['robot']} did not arrive: {failure['why']}")
    if len(failures) > MOST_FAILURES:
        print(f"... and {len(failures) - MOST_FAILURES} more robots, all named in metrics.json")


def read_options(
    file: Path | None,
    task: str | None,
    map_: str | None,
    planner: str | None,
    options: dict[str, Any],
    changes: list[str],
) -> Scenario:
    """Return the scenario of the file, changed by the options; without any place the task is T1."""
    values: dict[str, Any] = read_scenario_file(file) if file is not None else {}
    if task is not None and map_ is not None:
        raise ConfigError("--task and --map", "give one of them")
    if task is not None:
        choose(values, "task", "name", task)
    if map_ is not None:
        choose(values, "map", "file", map_)
    if planner is not None:
        choose(values, "planner", "name", planner)
    for key, value in options.items():
        if value is not None:
            _set_option(values, key, value)
    named = {change.replace("=", ".").partition(".")[0] for change in changes}
    if not any(key in values for key in PLACES) and not named & {"map", "place"}:
        values["task"] = {"name": "T1"}
    for change in changes:
        set_key(values, change)
    return parse_scenario(values, str(file) if file is not None else "command line")
