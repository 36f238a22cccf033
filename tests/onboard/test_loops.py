"""The loops round a decision: compiled, plain and in batches do the same, and all of them end with the guard."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

from helpers import circle, circles_world, one_robot, place_scenario, scan_at, tick
from swarmscope.onboard.loops import is_compiled
from swarmscope.onboard.planners import planners_in
from swarmscope.onboard.planning import nav_scope
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.loop import run

BOLD = '''
"""Drives at its goal as fast as it may ask for, and counts its ticks."""

from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit

NAME = "bold"
SUMMARY = "full speed towards the goal, whatever stands there"
NEEDS = "goal bearing"
MEMORY = np.dtype([("ticks", np.int64)])


class Params(NamedTuple):
    """What can be set."""

    speed: float = 0.5
    still_s: float = 0.6


@jit
def decide(see, memory, params):
    memory["ticks"] += 1
    see.out["v"], see.out["w"] = params.speed, 2.0 * see.percept["goal_bearing"]
'''
PLAIN = BOLD.replace("@jit\n", "")
BATCH = PLAIN.replace(
    "def decide(see, memory, params):\n",
    "def decide_all(first, last, swarm, memories, params):\n"
    "    for i in range(first, last):\n"
    "        decide_one(swarm.percepts[i], swarm.decisions[i], memories[i], params)\n\n\n"
    "def decide_one(percept, out, memory, params):\n",
).replace("see.percept", "percept").replace("see.out", "out")  # fmt: skip
KINDS = {"compiled": BOLD, "plain": PLAIN, "batch": BATCH}


@pytest.fixture(scope="module")
def bold(tmp_path_factory):
    """The planner in each of the three kinds of loop."""
    folder = tmp_path_factory.mktemp("planners")
    found = {}
    sys.path.insert(0, str(folder))
    for kind, text in KINDS.items():
        (folder / f"bold_{kind}.py").write_text(text, encoding="utf-8")
        importlib.invalidate_caches()
        [found[kind]] = planners_in(importlib.import_module(f"bold_{kind}"))
    sys.path.remove(str(folder))
    yield found
    if hasattr(found["compiled"]._step, "stats"):
        forget(found["compiled"]._step.stats.cache_path, folder)


def forget(kept, folder):
    """Remove what Numba has kept of a planner in ``folder``."""
    assert Path(kept).name.startswith(folder.name)
    shutil.rmtree(kept, ignore_errors=True)


def test_the_kinds_of_loop_are_what_they_are_called(bold):
    compiled = os.environ.get("NUMBA_DISABLE_JIT", "0") != "1"
    assert is_compiled(bold["compiled"]._step) == compiled
    assert not is_compiled(bold["plain"]._step)
    assert not is_compiled(bold["batch"]._step)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("speed", [0.5, 40.0, -3.0, float("nan"), float("inf")])
def test_the_guard_has_the_last_word_in_every_loop(bold, kind, speed):
    robot = one_robot(planner=replace(bold[kind]))
    robot.params = robot.params._replace(speed=speed)
    robot.scan[:] = scan_at(circles_world([(2.175, 0.0, 2.0)]), robot.rig)  # 5 mm beyond the clearance
    tick(robot)
    assert (robot.said("v"), robot.memory["ticks"]) == (0.0, 1)
    robot.scan[:] = 4.0  # it is gone: what stands behind it shows
    tick(robot)
    assert robot.said("v") == (0.5 if speed in (0.5, 40.0) else 0.0)
    assert robot.memory["ticks"] == 2


def scene(planner, params=None):
    """A run of three robots past two obstacles."""
    starts = [(-2.0, 0.0, 0.0), (2.0, 0.3, 3.1), (0.0, -2.0, 1.5)]
    goals = [(2.0, 0.0), (-2.0, 0.1), (0.0, 2.0)]
    values = place_scenario(starts, goals, [circle(0.0, 0.1, 0.6), circle(0.9, -1.0, 0.3)], limit_s=12.0)
    scenario = parse_scenario(values | {"lidar": {"beams": 120}}, "test")
    setting = make_setting(scenario, make_setup(scenario))
    return run(replace(setting, planner=planner, params=params or planner.params()))


def same(one, other):
    assert one.robots.tobytes() == other.robots.tobytes()
    assert one.shared.tobytes() == other.shared.tobytes()
    assert one.choices.tobytes() == other.choices.tobytes()
    for a, b in zip(one.records, other.records, strict=True):
        assert a.tobytes() == b.tobytes()


def test_the_three_loops_give_the_same_run(bold):
    runs = {kind: scene(planner) for kind, planner in bold.items()}
    assert not runs["compiled"].robots["crashed"].any()
    assert (runs["compiled"].robots["length"] > 0.5).all()
    same(runs["compiled"], runs["plain"])
    same(runs["compiled"], runs["batch"])


def plain_nav_scope():
    """Nav-SCOPE with its decision as plain Python in the plain loop."""
    module = ModuleType("plain_nav_scope")
    vars(module).update({key: value for key, value in vars(nav_scope).items() if not key.startswith("__")})
    module.decide = getattr(nav_scope.decide, "py_func", nav_scope.decide)
    return planners_in(module)[0]


def test_nav_scope_decides_the_same_in_the_plain_loop():
    compiled, plain = planners_in(nav_scope)[0], plain_nav_scope()
    assert not is_compiled(plain._step)
    one, other = scene(compiled), scene(plain)
    assert len(one.choices) > 0
    assert one.robots["sent"].sum() > 0
    same(one, other)


WITHOUT_JIT = """
import json, sys
import test_loops as t
trace = t.scene(t.planners_in(t.nav_scope)[0])
assert not t.is_compiled(t.nav_scope.decide)
records = {name: getattr(trace.records, name).tolist() for name in ("x", "y", "state", "reason", "side", "bytes_sent")}
print(json.dumps(records))
"""


def python(code, **environment):
    """Run code in another process that can import this module; return what it prints."""
    here = Path(__file__).parent
    path = os.pathsep.join([*environment.pop("folders", []), str(here), str(here.parent), *sys.path])
    done = subprocess.run(
        [sys.executable, "-W", "ignore::RuntimeWarning", "-c", code],
        env=os.environ | {"PYTHONPATH": path} | environment,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    return done.stdout


def test_nav_scope_decides_the_same_without_the_compiler():
    compiled = scene(planners_in(nav_scope)[0]).records
    plain = json.loads(python(WITHOUT_JIT, NUMBA_DISABLE_JIT="1"))
    for name, values in plain.items():
        assert getattr(compiled, name).tolist() == values, name


COUNT = """
import importlib
from helpers import one_robot, tick
from swarmscope.onboard.planners import planners_in
[planner] = planners_in(importlib.import_module("kept_on_disk"))
robot = one_robot(planner=planner)
tick(robot)
stats = planner._step.stats
print(sum(stats.cache_hits.values()), sum(stats.cache_misses.values()), robot.said("v"))
print(stats.cache_path)
"""


def test_a_second_process_finds_a_planners_loop_on_disk(tmp_path):
    """The seconds that compiling takes are waited for once; that edited text is compiled: ``test_kernel_cache``."""

    def said():
        numbers, kept = python(COUNT, folders=[str(tmp_path)], NUMBA_DISABLE_JIT="0").splitlines()
        return [float(number) for number in numbers.split()], kept

    place = tmp_path / "kept_on_disk.py"
    place.write_text(BOLD, encoding="utf-8")
    assert said()[0] == [0, 1, 0.5]  # cache hits, misses, speed
    numbers, kept = said()
    assert numbers == [1, 0, 0.5]
    forget(kept, tmp_path)
