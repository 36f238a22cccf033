"""``swarmscope planners`` and ``swarmscope tasks``."""

from __future__ import annotations

import sys
from typing import Any

from rich.markup import escape
from rich.table import Table

from swarmscope.bounds import Value, about
from swarmscope.cli._console import PlainConsole
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.scenarios.keys import planner_keys
from swarmscope.tasks import load_task, task_names
from swarmscope.tasks._contract import all_options

WIDE = 150
"""Columns of a table that goes into a file or another program."""


def list_planners() -> None:
    """Print every planner with what it is given and its parameters."""
    console = PlainConsole(width=None if sys.stdout.isatty() else WIDE)
    for name in planner_names():
        planner = load_planner(name)
        console.print(f"[bold]{name}[/bold]  {planner.summary.removeprefix(f'{name}: ')}")
        console.print(f"  is given: {planner.needs}", highlight=False)
        for preset, keys in planner.presets.items():
            told = " ".join(f"{key}={_plain(value)}" for key, value in keys.items())
            console.print(f"  planner.preset={preset}: {told}", highlight=False)
        table = Table("planner.params", "default", "takes", "meaning")
        meanings = [escape(key.meaning.replace("``", "")) for key in planner_keys(name)]
        for field, meaning in zip(planner.fields.values(), meanings, strict=True):
            table.add_row(field.name, str(field.default), about(field), meaning)
        console.print(table)


def list_tasks() -> None:
    """Print every task with its options."""
    table = Table("task", "what it is", "task.options and defaults")
    for name in task_names():
        task = load_task(name)
        options = " ".join(f"{key}={_short(value)}" for key, value in all_options(task, {}).items())
        table.add_row(name, task.SUMMARY, options)
    PlainConsole().print(table)
    print("Example of an option: swarmscope run --task T1 --set task.options.density=0.2")


def _plain(value: Any) -> str:
    """Return a value as --set takes it."""
    return str(value).lower() if isinstance(value, bool) else _short(value)


def _short(value: Value) -> str:
    return value if isinstance(value, str) else f"{value:g}"
