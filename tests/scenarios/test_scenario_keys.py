"""Every key says what it takes and means; a scenario written out reads back as itself; the page is fresh."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path
from typing import NamedTuple

import pytest
import yaml

from swarmscope.onboard.planners import planner_names
from swarmscope.scenarios.keys import (
    MUST,
    docs_of,
    meanings,
    obstacle_keys,
    planner_keys,
    robot_keys,
    scenario_keys,
    task_keys,
)
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import complete
from swarmscope.scenarios.written import written_out
from swarmscope.tasks import task_names

DOCS = Path(__file__).parents[2] / "docs"
MEMBERS = [*((task_keys, name) for name in task_names()), *((planner_keys, name) for name in planner_names())]


def page_maker():
    spec = importlib.util.spec_from_file_location("scenario_page", DOCS / "scenario.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_of_keys_is_fresh():
    fresh = (DOCS / "scenario.md").read_text(encoding="utf-8") == page_maker().page()
    assert fresh, "docs/scenario.md is stale: run 'python docs/scenario.py'"


def test_what_people_look_for_is_on_the_page():
    text = (DOCS / "scenario.md").read_text(encoding="utf-8")
    for words in ("P_ni (14)", "wait rule (17)", "following_probability", "yields_to", "`radio.bitrate_bps`"):
        assert words in text
    for words in ("`max_wait_s` = 0.5 s", "`packets_crowded_out`", "bandwidth limit"):
        assert words in text


def test_keys_of_lists_are_on_the_page():
    assert [key.name for key in robot_keys()] == ["robot.N.start_s"]
    kinds = obstacle_keys()
    assert sorted(kinds) == ["circle", "door", "grid", "polygon", "wall"]
    assert {key.name for key in kinds["circle"]} > {"center", "radius", "velocity", "way", "repeat"}
    assert {key.name for key in kinds["door"]} == {"points", "open_s", "every_s"}
    assert all(key.meaning for kind in kinds.values() for key in kind)
    text = (DOCS / "scenario.md").read_text(encoding="utf-8")
    assert all(f"| `{name}` |" in text for name in ("robot.N.start_s", "circle: way", "door: open_s"))


def test_a_complete_scenario_holds_the_keys_that_are_listed():
    written = complete(parse_scenario({"task": {"name": "T1"}}, "test"))
    for key in scenario_keys():
        group, *rest = key.name.split(".")
        if group in ("map", "place") or key.name == "planner.model" or key.default is None:
            continue
        value = written[group]
        for part in rest:
            value = value[part]
        if key.default not in (MUST, {}):
            assert value == key.default, key.name


def test_units_and_bounds_are_read_off():
    keys = {key.name: key for key in scenario_keys()}
    assert keys["robot.a_max_mps2"].unit == "m/s²" and keys["robot.radius_m"].takes == "number ≥ 0.001, ≤ 100"
    assert keys["lidar.beams"].takes == "whole number ≥ 8, ≤ 4096"
    assert keys["record_scans"].takes == "auto, yes, no" and keys["radio.bitrate_bps"].unit == "bit/s"
    assert keys["place.starts"].default == MUST and keys["place.world.obstacles"].default == []
    assert {key.unit for key in planner_keys("nav-scope")} >= {"m", "s", "rad"}
    assert [key.takes for key in task_keys("T1")][-1] == "one of trees, rocks"


@pytest.mark.parametrize(("keys_of", "name"), MEMBERS, ids=lambda item: item if isinstance(item, str) else "")
def test_every_option_and_parameter_says_what_it_means(keys_of, name):
    assert all(len(key.meaning) > 3 for key in keys_of(name)), [key.name for key in keys_of(name) if not key.meaning]


def test_every_key_and_group_has_a_text():
    texts = meanings()
    assert set(Scenario.model_fields) < set(texts) and {key.name for key in scenario_keys()} < set(texts)
    assert all(texts.values())


@pytest.mark.parametrize("task", task_names())
@pytest.mark.parametrize("planner", ["nav-scope", "dh-bug"])
def test_written_out_it_reads_back_as_itself(task, planner):
    scenario = parse_scenario({"task": {"name": task}, "planner": {"name": planner}}, "test")
    text = written_out(scenario)
    assert yaml.safe_load(text) == json.loads(json.dumps(complete(scenario)))
    assert written_out(parse_scenario(yaml.safe_load(text), "again")) == text


def test_other_places_can_be_written_out():
    place = {"world": {"bounds": [-5, -5, 5, 5]}, "starts": [[0, 0, 0]], "goals": [[1, 0]]}
    for values in ({"map": {"file": "willow_garage_office"}}, {"place": place, "robots": 1}):
        scenario = parse_scenario(values, "test")
        assert complete(parse_scenario(yaml.safe_load(written_out(scenario)), "again")) == complete(scenario)


class Behind(NamedTuple):
    """Texts on both sides."""

    first: int = 1  # behind it
    second: int = 2
    """After it,
    on two lines."""
    third: int = 3


def test_texts_stand_after_a_field_or_behind_it():
    assert docs_of(Behind) == {"first": "behind it", "second": "After it, on two lines."}
