"""Presets of planners and the guard's switch: what they set, what stays above them, what is refused."""

from __future__ import annotations

import pytest

from helpers import circle, place_scenario, run_scenario
from swarmscope.errors import ConfigError, SwarmscopeError, UnknownNameError
from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.onboard.robot import Robot
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import complete

T1 = {"task": {"name": "T1"}}
PRINTED = ("dh-bug", "giwt", "giwt-cnn", "giwt-gat", "giwt-sage", "nav-i", "nav-scope", "oracle", "sfm-i", "sfm-mas")


def whole(planner=None, **keys):
    return complete(parse_scenario(T1 | {"planner": planner or {}} | keys, "test"))


def value_at(values, key):
    for part in key.split("."):
        values = values[part]
    return values


def test_these_planners_can_run_as_printed():
    assert [name for name in planner_names() if "printed" in load_planner(name).presets] == list(PRINTED)


@pytest.mark.parametrize("name", PRINTED)
def test_every_key_of_a_preset_is_one_that_it_changes(name):
    usual, printed = whole({"name": name}), whole({"name": name, "preset": "printed"})
    for key, value in load_planner(name).presets["printed"].items():
        assert value_at(printed, key) == value, key
        assert value_at(usual, key) != value, key


def test_what_the_scenario_says_stands_above_the_preset():
    planner = {"preset": "printed", "params": {"prior": 1.5}}
    found = whole(planner, safety={"sector": False})
    assert (found["safety"]["sector"], found["planner"]["params"]["prior"]) == (False, 1.5)
    assert (found["safety"]["look_ahead_m"], found["planner"]["params"]["reopen"]) == (0.0, 0.0)


def test_a_whole_scenario_with_a_preset_reads_back_as_the_same():
    found = whole({"name": "sfm-mas", "preset": "printed"})
    assert found["planner"]["preset"] == "printed"
    assert complete(parse_scenario(found, "again")) == found


def test_parameters_that_a_variant_fixes_are_left_alone():
    assert "planner.params.ask_ahead_s" in load_planner("nav-scope").presets["printed"]
    assert "planner.params.ask_ahead_s" not in load_planner("nav-i").presets["printed"]


@pytest.mark.parametrize(
    ("planner", "kind", "words"),
    [
        ({"preset": "printd"}, UnknownNameError, "planner.preset: unknown preset 'printd'; did you mean 'printed'?"),
        ({"name": "orca", "preset": "printed"}, ConfigError, "planner.preset: planner 'orca' has no presets"),
        ({"name": "mine.py", "preset": "printed"}, ConfigError, "planner.preset: only planners known by their name"),
        ({"name": "nav-skope", "preset": "printed"}, UnknownNameError, "planner.name: unknown planner 'nav-skope'"),
        ({"preset": 3}, ConfigError, "planner.preset"),
        ({"name": 7, "preset": "printed"}, ConfigError, "planner.name"),
    ],
)
def test_presets_that_there_are_not_are_told(planner, kind, words):
    with pytest.raises(kind, match="test: ") as told:
        whole(planner)
    assert words in str(told.value)


@pytest.mark.parametrize(
    "keys",
    [
        {"safety": 3},
        {"safety": {"sector": "perhaps"}},
        {"planner": {"preset": "printed", "params": 1}},
        {"guard": "no"},
    ],
)
def test_what_is_no_key_is_told_as_without_a_preset(keys):
    with pytest.raises(SwarmscopeError, match="test: "):
        parse_scenario(T1 | {"planner": {"preset": "printed"}} | keys, "test")


def test_the_guard_can_be_left_out_and_then_contacts_happen():
    """The printed Nav-I has no repulsion: two that meet head-on drive into one another."""
    assert whole(guard=False)["guard"]["enabled"] is False
    assert whole(guard=True) == whole()
    starts, goals = [(-3, 0.0, 0.0), (3, 0.0, 3.1)], [(3, 0.0), (-3, 0.0)]
    planner = {"name": "nav-i", "preset": "printed"}
    with_guard = run_scenario(place_scenario(starts, goals, [circle(0, 3, 0.3)], planner=planner, limit_s=40.0))
    without = run_scenario(
        place_scenario(starts, goals, [circle(0, 3, 0.3)], planner=planner, guard=False, limit_s=40.0)
    )
    assert not with_guard.robots["crashed"].any()
    assert without.robots["crashed"].all()
    assert not without.robots["arrived"].any()


def test_a_robot_on_wheels_cannot_do_without_its_guard():
    with pytest.raises(UnknownNameError, match="enabled"):
        Robot("nav-scope", Body(), Lidar(), address=1, enabled=False)
