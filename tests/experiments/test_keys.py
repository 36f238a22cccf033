"""Content keys: what changes them and what does not, tried in a copy of the sources."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
CODE = """
import json, os, sys
from swarmscope.experiments.work import unit_key, world_key
from swarmscope.scenarios.read import parse_scenario
for line in sys.stdin:
    if os.fork():
        if os.wait()[1]:
            print("null", flush=True)
        continue
    found = {}
    for label, keys in json.loads(line).items():
        scenario = parse_scenario(keys, label)
        found[label] = [unit_key(scenario), world_key(scenario)]
    print(json.dumps(found), flush=True)
    os._exit(0)
"""
RUNS = {
    "nav": {"task": {"name": "T1"}, "planner": {"name": "nav-scope"}},
    "bug": {"task": {"name": "T1"}, "planner": {"name": "dh-bug"}},
    "swap": {"task": {"name": "swap"}, "planner": {"name": "nav-scope"}},
    "map": {"map": {"file": "willow_garage_office"}, "planner": {"name": "nav-scope"}},
}
EVERY = set(RUNS)


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    shutil.copytree(ROOT / "src", folder / "src", ignore=shutil.ignore_patterns("__pycache__", "data", "*.html"))
    shutil.copytree(ROOT / "src/swarmscope/data/maps", folder / "src/swarmscope/data/maps")
    return folder


@pytest.fixture(scope="module")
def keys_of(tree):
    """A function that returns the keys (of the unit, of its world) of runs.

    Every call is answered by a fork of one process that has imported everything and read nothing: a process of its own,
    without the seconds that imports take.
    """
    with subprocess.Popen(
        [sys.executable, "-c", CODE],
        cwd=tree,
        env=os.environ | {"NUMBA_DISABLE_JIT": "1", "PYTHONPATH": str(tree / "src")},
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    ) as asked:

        def ask(runs=RUNS):
            asked.stdin.write(json.dumps(runs) + "\n")
            asked.stdin.flush()
            found = json.loads(asked.stdout.readline())
            assert found is not None, "it failed; what it said is among the captured output"
            return found

        yield ask
        asked.stdin.close()


@pytest.fixture(scope="module")
def before(keys_of):
    return keys_of()


@pytest.mark.parametrize(
    ("file", "units", "worlds"),
    [
        ("learning/figures.py", set(), set()),
        ("viewing/replay.py", set(), set()),
        ("cli/run.py", set(), set()),
        ("disk/runs.py", set(), set()),
        ("experiments/store.py", set(), set()),
        ("onboard/planning/sfm_mas.py", set(), set()),
        ("tasks/corridor.py", set(), set()),
        ("onboard/planning/dh_bug.py", {"bug"}, set()),
        ("onboard/planning/nav_scope.py", {"nav", "swap", "map"}, set()),
        ("tasks/t1.py", {"nav", "bug"}, {"nav", "bug"}),
        ("sim/loop.py", EVERY, set()),
        ("judging/cases.py", EVERY, set()),
        ("experiments/work.py", EVERY, set()),
        ("onboard/tick.py", EVERY, set()),
        ("judging/shortest_path.py", EVERY, EVERY),
        ("sim/world.py", EVERY, EVERY),
    ],
)
def test_a_blank_line_changes_the_keys_of_what_imports_the_file(tree, keys_of, before, file, units, worlds):
    path = tree / "src/swarmscope" / file
    text = path.read_text(encoding="utf-8")
    path.write_text(text + "\n", encoding="utf-8")
    try:
        after = keys_of()
    finally:
        path.write_text(text, encoding="utf-8")
    assert {label for label in RUNS if after[label][0] != before[label][0]} == units
    assert {label for label in RUNS if after[label][1] != before[label][1]} == worlds


def test_a_new_file_that_judging_imports_counts(tree, keys_of, before):
    metrics, new = tree / "src/swarmscope/judging/metrics.py", tree / "src/swarmscope/judging/brand_new.py"
    text = metrics.read_text(encoding="utf-8")
    try:
        metrics.write_text(text + "\nfrom swarmscope.judging import brand_new as brand_new\n", encoding="utf-8")
        keys = []
        for words in ("ONE = 1\n", "ONE = 2\n"):
            new.write_text(words)
            keys.append(keys_of()["nav"][0])
    finally:
        metrics.write_text(text, encoding="utf-8")
        new.unlink()
    assert len({*keys, before["nav"][0]}) == 3


TASK = """
from helper import PLACES
from swarmscope.tasks import Setup, WorldSpec
NAME, SUMMARY = "mine", "a task of my own"
def make(seed, robots=1, radius=0.15, *, length_m: float = 4.0):
    return Setup(WorldSpec(bounds=(-9, -9, 9, 9)), PLACES, [[length_m, 0]])
"""


def test_the_key_of_a_users_file_is_that_of_its_content_wherever_it_lies(keys_of, tmp_path):
    def key(folder, **options):
        task = {"name": str(tmp_path / folder / "mine.py"), "options": options}
        return tuple(keys_of({"mine": {"task": task, "robots": 1}})["mine"])

    for folder in ("a", "b"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "mine.py").write_text(TASK)
        (tmp_path / folder / "helper.py").write_text("PLACES = [[0, 0, 0]]\n")
    first = key("a")
    assert key("b") == first
    assert key("a", length_m=5.0)[0] != first[0]
    (tmp_path / "b/helper.py").write_text("PLACES = [[0, 0.1, 0]]\n")
    assert not set(key("b")) & set(first)
    (tmp_path / "a/mine.py").write_text("raise RuntimeError('is not run for a key')\n")
    assert not set(key("a")) & set(first)


def test_libraries_of_the_planner_count_and_others_do_not(monkeypatch):
    from swarmscope.experiments import work

    def key(planner, **changed):
        monkeypatch.setattr(work, "library_version", lambda name: changed.get(name, "1"))
        work._code_state.cache_clear()
        return work.code_state({"task": {"name": "T1"}, "planner": {"name": planner}})

    assert key("orca") != key("orca", navground="2")
    assert key("giwt") != key("giwt", onnxruntime="2")
    assert key("nav-scope") == key("nav-scope", navground="2", onnxruntime="2", pydantic="2")
    work._code_state.cache_clear()
