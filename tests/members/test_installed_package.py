"""A small package that is really installed brings a planner and a task along, by entry points."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
PROJECT = """
[build-system]
requires = ["setuptools"]
build-backend = "setuptools.build_meta"

[project]
name = "forest-people"
version = "0.1"

[project.entry-points."swarmscope.planners"]
go-straight = "forest_people.go_straight"

[project.entry-points."swarmscope.tasks"]
ring = "forest_people.ring"
"""


def example(name):
    """The file of docs/extending.md."""
    found = re.search(rf"^New file `mine/{name}`:\n\n```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    return found.group(1)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder of installed packages with ours in it."""
    source, target = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("site")
    package = source / "forest_people"
    package.mkdir()
    (source / "pyproject.toml").write_text(PROJECT, encoding="utf-8")
    (package / "__init__.py").write_text('"""Ours."""\n', encoding="utf-8")
    for name in ("go_straight.py", "ring.py"):
        (package / name).write_text(example(name), encoding="utf-8")
    options = ["--quiet", "--no-deps", "--no-index", "--no-build-isolation", "--disable-pip-version-check"]
    done = command("-m", "pip", "install", *options, "--target", str(target), str(source))
    assert done.returncode == 0, done.stdout + done.stderr
    return target


def command(*words, path=None, folder=None):
    environment = os.environ | {"NUMBA_DISABLE_JIT": "1"}
    environment.pop("PYTEST_XDIST_WORKER", None)
    if path is not None:
        environment["PYTHONPATH"] = os.pathsep.join([str(ROOT / "src"), str(path)])
    return subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True, check=False, timeout=300
    )


def test_both_are_listed(site):
    assert "go-straight" in command("-m", "swarmscope", "planners", path=site).stdout
    assert "ring" in command("-m", "swarmscope", "tasks", path=site).stdout


def test_both_run_by_their_names(site, tmp_path):
    words = ["run", "--task", "ring", "--planner", "go-straight", "--robots", "2", "--limit", "2", "--no-pictures"]
    done = command("-m", "swarmscope", *words, "--set", "lidar.beams=90", "--out", "out", path=site, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    about = json.loads((tmp_path / "out" / "metrics.json").read_text(encoding="utf-8"))["run"]
    assert (about["task"], about["planner"]) == ("ring", "go-straight")


def test_without_the_package_they_are_unknown(tmp_path):
    done = command("-m", "swarmscope", "run", "--planner", "go-straight", path=tmp_path, folder=tmp_path)
    assert done.returncode != 0
    assert "unknown planner 'go-straight'" in done.stderr
