"""``swarmscope planners`` and ``swarmscope tasks``."""

from __future__ import annotations

import ast
import inspect
import sys
from types import ModuleType

from rich.table import Table

from swarmscope.cli._console import PlainConsole
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.scenarios.to_kernels import task_options
from swarmscope.tasks import load_task, task_names
from swarmscope.tasks._contract import Option


def list_planners() -> None:
    """Print every planner with what it is given and its parameters."""
    console = PlainConsole()
    for name in planner_names():
        planner = load_planner(name)
        console.print(f"[bold]{name}[/bold]  {planner.summary.removeprefix(f'{name}: ')}")
        console.print(f"  is given: {planner.needs}", highlight=False)
        table = Table("planner.params", "default", "bounds", "meaning")
        docs = field_docs(planner.module, "Params")
        for field, default in planner.defaults.items():
            table.add_row(field, str(default), planner.bounds(field), docs.get(field, ""))
        console.print(table)


def list_tasks() -> None:
    """Print every task with its options."""
    table = Table("task", "what it is", "task.options and defaults")
    for name in task_names():
        task = load_task(name)
        options = " ".join(f"{key}={_short(value)}" for key, value in task_options(task).items())
        table.add_row(name, task.SUMMARY, options)
    PlainConsole().print(table)
    print("Example of an option: swarmscope run --task T1 --set task.options.density=0.2")


def _short(value: Option) -> str:
    return value if isinstance(value, str) else f"{value:g}"


def field_docs(module: ModuleType, class_name: str) -> dict[str, str]:
    """Return the text that follows each field of a class in the source of the module that defines it."""
    source = sys.modules[getattr(module, class_name).__module__] if hasattr(module, class_name) else module
    for node in ast.parse(inspect.getsource(source)).body:
        if isinstance(node, ast.ClassDef) and node.name == class_name:
            return _texts_after_fields(node)
    return {}


def _texts_after_fields(node: ast.ClassDef) -> dict[str, str]:
    docs = {}
    for field, text in zip(node.body[:-1], node.body[1:], strict=True):
        if (
            isinstance(field, ast.AnnAssign)
            and isinstance(field.target, ast.Name)
            and isinstance(text, ast.Expr)
            and isinstance(text.value, ast.Constant)
        ):
            docs[field.target.id] = " ".join(str(text.value.value).split())
    return docs
