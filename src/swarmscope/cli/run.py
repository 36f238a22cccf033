"""``swarmscope run``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import yaml
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from swarmscope.errors import ConfigError
from swarmscope.evaluation.runner import place_name, run_scenario
from swarmscope.evaluation.scenario import Scenario, parse_scenario, read_scenario_file
from swarmscope.sim.maps import packaged_map

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


def run_command(
    file: Path | None,
    task: str | None,
    map_: str | None,
    planner: str | None,
    options: dict[str, Any],
    changes: list[str],
    out: Path | None,
    threads: int,
    pictures: bool,
) -> None:
    """Run what the command line asks for and print what came out."""
    scenario = read_options(file, task, map_, planner, options, changes)
    place = out or Path("runs") / f"{place_name(scenario)}-{scenario.planner.name}-{scenario.seed}"
    console = Console()
    if kernels_are_cold():
        console.print("compiling the kernels for the first time (about 40 s, kept on disk) ...")
    with Progress(
        TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"), TimeElapsedColumn()
    ) as bar:
        job = bar.add_task(f"{place_name(scenario)} {scenario.planner.name}", total=scenario.limit_s, note="")

        def progress(simulated: float, done: int) -> None:
            bar.update(job, completed=simulated, note=f"{simulated:.0f} s, {done}/{scenario.robots} robots done")

        metrics = run_scenario(scenario, place, threads, progress, add_pictures if pictures else None)
        bar.update(job, completed=scenario.limit_s, note=f"{metrics['simulated_s']:.0f} s simulated")
    print_metrics(console, metrics)
    for failure in metrics["failures"]:
        console.print(f"robot {failure['robot']} did not arrive: {failure['why']}", highlight=False)
    for name in ("paths.png", "replay.html") if pictures else ("metrics.json",):
        print(place / name)


def add_pictures(folder: Path) -> None:
    """Add the picture and the replay page to a run folder."""
    from swarmscope.viewing.pictures import write_picture
    from swarmscope.viewing.replay import write_replay

    write_picture(folder)
    write_replay(folder)


def print_metrics(console: Console, metrics: dict[str, Any]) -> None:
    """Print the key figures as a table."""
    about = metrics["run"]
    title = f"{about['task']} · {about['planner']} · {about['robots']} robots · seed {about['seed']}"
    table = Table(title=title, show_header=False)
    table.add_column(style="bold")
    table.add_column(justify="right")
    for key, words, form in ROWS:
        value = metrics.get(key)
        if value is not None and value == value:
            table.add_row(words, form.format(value))
    console.print(table)


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
    if task is not None or map_ is not None:
        for key in ("task", "map", "place"):
            values.pop(key, None)
    if task is not None:
        values["task"] = {"name": task}
    if map_ is not None:
        path = map_ if map_.endswith((".yaml", ".yml")) else str(packaged_map(map_))
        values["map"] = {"file": path}
    if not any(key in values for key in ("task", "map", "place")):
        values["task"] = {"name": "T1"}
    if planner is not None:
        values["planner"] = {"name": planner}
    values |= {key: value for key, value in options.items() if value is not None}
    for change in changes:
        set_key(values, change)
    return parse_scenario(values, str(file) if file is not None else "command line")


def set_key(values: dict[str, Any], change: str) -> None:
    """Apply one ``key.path=value`` to the nested mapping."""
    path, equals, text = change.partition("=")
    if not equals or not path:
        raise ConfigError(f"--set {change}", "must look like key.path=value")
    at: Any = values
    *parents, last = path.split(".")
    for part in parents:
        at = at.setdefault(part, {})
        if not isinstance(at, dict):
            raise ConfigError(f"--set {change}", f"'{part}' is not a group of keys")
    try:
        at[last] = yaml.safe_load(text)
    except yaml.YAMLError:
        raise ConfigError(f"--set {change}", "the value is not valid YAML") from None


def kernels_are_cold() -> bool:
    """Tell whether the compiled kernels of the simulator are not on disk yet."""
    from swarmscope.sim.loop import world_phase

    cache = getattr(world_phase, "_cache", None)
    folder = getattr(cache, "cache_path", None)
    return folder is not None and not any(Path(folder).glob("loop.world_phase-*.nbi"))
