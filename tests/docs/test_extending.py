"""The recipes of docs/extending.md, carried out in a copy of the sources and run there in plain Python."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^(New file|In) `([^`]+)`([^:\n]*):\n\n```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
ANCHORS = {
    ", at the end of `METRICS`": "]\nCOUNTED: list[Metric]",
    ", before `all_metrics`": "def all_metrics(",
    ", at the end of `values` in `all_metrics`": "    }\n    return {metric.name",
}


def blocks():
    return BLOCK.findall(PAGE)


def carry_out(tree):
    """Do what the page says; return the test files that it adds."""
    tests = []
    for kind, path, where, code in blocks():
        file = tree / path
        if kind == "New file":
            assert not file.exists(), f"{path} is there already: choose another example"
            file.parent.mkdir(parents=True, exist_ok=True)
            file.write_text(code, encoding="utf-8")
            if Path(path).name.startswith("test_"):
                tests.append(path)
            continue
        text, anchor = file.read_text(encoding="utf-8"), ANCHORS[where]
        assert text.count(anchor) == 1, (path, where)
        file.write_text(text.replace(anchor, code + anchor), encoding="utf-8")
    return tests


def make_tree(folder):
    ignore = shutil.ignore_patterns("__pycache__", "data", "*.html")
    shutil.copytree(ROOT / "src", folder / "src", ignore=ignore)
    (folder / "tests").mkdir()
    shutil.copy(ROOT / "tests" / "helpers.py", folder / "tests")
    (folder / "pytest.ini").write_text("[pytest]\npythonpath = src tests\n", encoding="utf-8")


def run_in(folder, *arguments):
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(folder / "src")}
    environment.pop("PYTEST_XDIST_WORKER", None)
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    folder = tmp_path_factory.mktemp("extended")
    make_tree(folder)
    return folder, carry_out(folder)


@pytest.mark.parametrize("name", ["mine/go_straight.py", "mine/widest.py"])
def test_a_planner_takes_no_more_than_45_lines(name):
    (code,) = (code for _, path, _, code in blocks() if path == name)
    assert len(code.splitlines()) <= 45


def test_every_python_block_is_part_of_a_recipe():
    assert PAGE.count("```python") == len(blocks())
    assert {block[2] for block in blocks() if block[0] == "In"} == set(ANCHORS)


def test_the_recipes_work(tree):
    folder, tests = tree
    assert len(tests) == 2
    done = run_in(folder, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", *tests)
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-2000:]


def test_the_recipes_are_clean(tree):
    folder, _ = tree
    ruff = shutil.which("ruff", path=str(Path(sys.executable).parent)) or shutil.which("ruff")
    if ruff is None:
        pytest.skip("ruff is not installed")
    added = [path for _, path, _, _ in blocks() if not path.startswith("tests/")]
    options = ["--no-cache", "--config", str(ROOT / "pyproject.toml"), "--ignore", "ANN,D1,I001,S101"]
    done = subprocess.run(
        [ruff, "check", *options, *sorted(set(added))],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout
