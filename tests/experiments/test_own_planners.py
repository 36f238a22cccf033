"""A planner of one's own in an experiment: found beside it, run once, and run again when it was edited, alone."""

from __future__ import annotations

import pytest
import yaml

from swarmscope.experiments.campaign import run_missing, state_of
from swarmscope.experiments.engines import make_engine
from swarmscope.experiments.experiment import load_experiment
from swarmscope.experiments.store import Store

PLANNER = '''"""Straight on, at a share of the top speed."""

from swarmscope.kit import ADVANCE, R_FREE, head_for

NAME = "{name}"
SUMMARY = "straight on"
NEEDS = "goal bearing and distance"


def decide(see, memory, params):
    head_for(see, float(see.percept["goal_bearing"]), {share} * see.rig.body.v_max_mps)
    see.out["state"], see.out["reason"] = ADVANCE, R_FREE
'''
EXPERIMENT = {
    "name": "mine",
    "title": "Two planners of mine",
    "seeds": "1000-1001",
    "scenario": {"robots": 2, "limit_s": 1.0, "lidar": {"beams": 90}},
    "places": {"near": {"task": {"name": "T1", "options": {"size_m": 5.0}}}},
    "planners": {"one": {"planner": {"name": "one.py"}}, "two": {"planner": {"name": "two.py"}}},
}


def write(folder, name, share):
    text = PLANNER.format(name=name, share=share)
    (folder / f"{name}.py").write_text(text, encoding="utf-8")


@pytest.fixture
def folder(tmp_path):
    for name in ("one", "two"):
        write(tmp_path, name, 0.5)
    (tmp_path / "mine.yaml").write_text(yaml.safe_dump(EXPERIMENT), encoding="utf-8")
    return tmp_path


def missing(folder, store):
    state = state_of(load_experiment(folder / "mine.yaml"), store)
    assert not state.failed
    return sorted((unit.planner, unit.seed) for unit, _ in state.missing)


def test_an_edited_planner_is_run_again_and_no_other(folder):
    with Store(folder / "s.sqlite") as store:
        assert len(missing(folder, store)) == 4
        run_missing(load_experiment(folder / "mine.yaml"), store, make_engine("in-process"))
        assert missing(folder, store) == []
        write(folder, "two", 0.25)
        assert missing(folder, store) == [("two", 1000), ("two", 1001)]
        ran = []
        run_missing(
            load_experiment(folder / "mine.yaml"), store, make_engine("in-process"), progress=lambda *n: ran.append(n)
        )
        assert len(ran) == 2
        assert missing(folder, store) == []
