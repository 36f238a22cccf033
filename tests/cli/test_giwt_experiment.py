"""``swarmscope reproduce giwt`` in small: DH-Bug's arms on small maps, and a network that is not there."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest
import yaml
from command_line import refused, swarmscope

from swarmscope.experiments.experiment import shipped_experiment

ARMS = ["turn left", "turn right", "A* sides"]
SMALL = {"robots": 4, "lidar": {"beams": 120}, "limit_s": 60.0}
SIZE = {"size_m": 9.0, "fewest": 3, "most": 5, "apart_m": 5.0}


@pytest.fixture
def values(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    full = yaml.safe_load(shipped_experiment("giwt").read_text())
    full |= {"name": "small", "seeds": "31000-31002", "ours": "A* sides", "targets": [], "order": []}
    full["scenario"] |= SMALL
    full["planners"] = {arm: full["planners"][arm] for arm in ARMS}
    for place in ("task I", "task II"):
        full["places"][place]["task"]["options"] = SIZE
    return full


def write(values) -> Path:
    path = Path("small.yaml")
    path.write_text(yaml.safe_dump(values, allow_unicode=True))
    return path


def test_dh_bugs_arms_from_run_to_report(values):
    done = swarmscope("experiment", "run", write(values), "--engine", "in-process")
    assert done.exit_code == 0, done.stderr
    page = Path("runs/small/report/report.html").read_text()
    for words in ("Success rate SR", "the share of the gap between turn left and A* sides", "Flow-time increase"):
        assert words in page
    assert swarmscope("experiment", "export", "small.yaml", "all.csv").exit_code == 0
    rows = list(csv.DictReader(Path("all.csv").read_text().splitlines()))
    assert len(rows) == 3 * 3 * 3
    assert {row["movers"] for row in rows if row["place"] == "task I"} == {"1.0"}
    told = [row for row in rows if row["planner"] == "A* sides" and float(row["sides_judged"]) > 0]
    assert told and any(float(row["side_accuracy"]) == 1.0 for row in told)
    assert all(float(row["collisions"]) == 0 for row in rows)


def test_a_network_that_is_not_there_is_named_with_its_planner(values):
    values["planners"]["GIWT"] = {"planner": {"name": "giwt", "model": "nowhere"}}
    said = refused("experiment", "run", write(values), "--engine", "in-process")
    assert "small: planner 'GIWT': has no model to run: " in said and "nowhere/model.json: cannot be read" in said
