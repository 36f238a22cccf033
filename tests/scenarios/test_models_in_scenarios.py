"""``planner.model``: found beside the scenario, refused where there is no network, part of the content key."""

from __future__ import annotations

import json

import pytest
import yaml

from giwt_models import make_model, write_card
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.experiments.work import finished, make_job, unit_key, work, world_key
from swarmscope.onboard.planners import load_planner
from swarmscope.scenarios import to_kernels
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import load_scenario, parse_scenario
from swarmscope.scenarios.to_kernels import complete, make_setting, planner_of

T1 = {"task": {"name": "T1"}, "robots": 2, "limit_s": 2.0, "record_scans": "no"}


def scenario_with(model, name="giwt"):
    return parse_scenario({**T1, "planner": {"name": name, "model": str(model)}}, "test")


def job_of(scenario):
    config = complete(scenario)
    return make_job(unit_key(scenario), world_key(scenario), config, None)


def test_a_model_is_looked_for_beside_the_scenario_and_then_as_it_is(tmp_path, monkeypatch):
    make_model(tmp_path / "a/model")
    path = tmp_path / "a/s.yaml"
    path.write_text(yaml.safe_dump({**T1, "planner": {"name": "giwt", "model": "model"}}))
    scenario = load_scenario(path)
    assert scenario.planner.model == str(tmp_path / "a/model")
    monkeypatch.chdir(tmp_path / "a")
    here = complete(scenario_with("model"))
    assert here["planner"]["model"] == str(tmp_path / "a/model")
    assert complete(parse_scenario(here, "again")) == here
    setting = make_setting(scenario, make_setup(scenario))
    assert (setting.planner.name, str(setting.planner.model.folder)) == ("giwt", str(tmp_path / "a/model"))
    assert planner_of(scenario.planner) != load_planner("giwt")


def test_planners_without_a_network_refuse_a_model(tmp_path):
    with pytest.raises(ConfigError, match=r"test: planner\.model: planner 'dh-bug' runs no network"):
        scenario_with(tmp_path, "dh-bug")


def test_the_content_key_follows_the_model(tmp_path):
    keys = set()
    for seed in range(2):
        keys.add(unit_key(scenario_with(make_model(tmp_path / "m", seed))))
        keys.add(unit_key(scenario_with(make_model(tmp_path / "m", seed))))
    assert len(keys) == 2
    write_card(tmp_path / "m", accuracy=0.5)
    assert unit_key(scenario_with(tmp_path / "m")) not in keys
    with pytest.raises(InputFileError, match=r"nowhere/model\.json"):
        unit_key(scenario_with(tmp_path / "nowhere"))


def test_the_key_of_a_shipped_model_is_that_of_its_card(tmp_path, monkeypatch):
    scenario = parse_scenario({**T1, "planner": {"name": "giwt"}}, "test")
    keys = []
    for seed in range(2):
        shipped = load_planner("giwt").with_model(make_model(tmp_path / "shipped", seed))
        monkeypatch.setattr(to_kernels, "load_planner", {"giwt": shipped}.get)
        keys.append(unit_key(scenario))
    assert keys[0] != keys[1]


def test_a_unit_is_run_with_the_model_that_it_was_asked_with(tmp_path):
    scenario = scenario_with(make_model(tmp_path / "m"))
    job = job_of(scenario)
    first, second = work(job), work(job)
    assert json.loads(first).get("error") is None
    assert finished(complete(scenario), first).digest == finished(complete(scenario), second).digest
    make_model(tmp_path / "m", seed=1)
    assert "network is another one" in json.loads(work(job))["error"]
