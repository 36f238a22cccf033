"""The on-board part stays small in every direction: arguments, files, and a planners' folder of planners only."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

ONBOARD = Path(__file__).resolve().parents[2] / "src" / "swarmscope" / "onboard"
FILES = sorted(ONBOARD.glob("**/*.py"))
PLANNER_FILES = sorted(path for path in (ONBOARD / "planning").iterdir() if path.name != "__pycache__")
MOST_ARGUMENTS, MOST_LINES = 6, 400


def name_of(path):
    return path.relative_to(ONBOARD).as_posix()


EVERYTHING = {"robot.py": ["tick"]}
"""What a robot is told in a tick is handed over by name, one argument for each thing that it knows."""


def count_of(function):
    """How many arguments a function has, as ruff counts: without ``self`` and starred ones."""
    a = function.args
    return len([arg for arg in (*a.posonlyargs, *a.args, *a.kwonlyargs) if arg.arg != "self"])


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_no_function_has_more_than_six_arguments(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            name = getattr(node, "name", "lambda")
            if name in EVERYTHING.get(name_of(path), ()):
                assert not node.args.posonlyargs and [arg.arg for arg in node.args.args] == ["self"]
                continue
            assert count_of(node) <= MOST_ARGUMENTS, (name, node.lineno)


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_no_file_has_more_than_400_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= MOST_LINES


def test_the_files_are_found_at_all():
    assert {"view.py", "tick.py", "planning/nav_scope.py", "control/guard.py"} <= {name_of(path) for path in FILES}


def defined_in(path):
    """The names that a file defines or imports at its top."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.Assign):
            yield from (target.id for target in node.targets if isinstance(target, ast.Name))


@pytest.mark.parametrize("path", PLANNER_FILES, ids=lambda path: path.name)
def test_the_planners_folder_holds_planner_files_only(path):
    assert path.is_file() and path.suffix == ".py"
    if path.name == "__init__.py":
        assert list(defined_in(path)) == []
        return
    assert not path.name.startswith("_")
    names = set(defined_in(path))
    assert {"NAME", "SUMMARY", "NEEDS"} <= names
    assert len({"decide", "decide_all"} & names) == 1
