"""What can be set of a planner: names, bounds, types, and what variants keep to themselves."""

from __future__ import annotations

import math

import pytest

from swarmscope.errors import ConfigError, UnknownNameError
from swarmscope.onboard.planners import load_planner, planner_names

every_planner = pytest.mark.parametrize("name", planner_names())


def test_an_unknown_key_names_the_nearest():
    words = r"^planner 'nav-scope': unknown parameter 'paticence_s'; did you mean 'patience_s'\?"
    with pytest.raises(UnknownNameError, match=words):
        load_planner("nav-scope").params({"paticence_s": 1.0})


def test_what_is_fixed_is_neither_set_nor_offered():
    planner = load_planner("nav-i")
    with pytest.raises(ConfigError, match="planner 'nav-i': w_i: is fixed at 0"):
        planner.params({"w_i": 1.0})
    with pytest.raises(ConfigError, match="planner 'nav-i': w_i: is fixed at 0"):
        planner.params({"w_i": 0.0})
    with pytest.raises(UnknownNameError) as unknown:
        planner.params({"w_ii": 1.0})
    assert "w_i" not in unknown.value.valid
    assert planner.params().w_i == 0.0


@pytest.mark.parametrize(
    ("planner", "key", "value", "words"),
    [
        ("nav-scope", "patience_s", -1.0, "must be a number from 0 to 100000 s, not -1.0"),
        ("nav-scope", "arrive_m", 2000, "must be a number from 0 to 1000 m, not 2000"),
        ("nav-scope", "answers", 2, "must be a whole number from 0 to 1, not 2"),
        ("sfm-i", "turn_back", 7.0, "must be a number from 0 to 6.283185307 rad, not 7.0"),
        ("dh-bug", "turn", 4, "must be a whole number from 0 to 3, not 4"),
        ("dh-bug", "key_deg", 361.0, "must be a number from 0 to 360 deg, not 361.0"),
        ("giwt", "creep", -0.1, "must be a number from 0 to 100 m/s, not -0.1"),
        ("orca", "creep", 1.5, "must be a number from 0 to 1, not 1.5"),
        ("dh-bug", "seed", 2**31, "must be a whole number from 0 to 2147483647, not 2147483648"),
        ("dh-bug", "turn", 1.5, "must be a whole number from 0 to 3, not 1.5"),
        ("nav-scope", "w_i", math.nan, "must be a number from 0 to 1000, not nan"),
        ("nav-scope", "w_i", math.inf, "must be a number from 0 to 1000, not inf"),
        ("nav-scope", "w_i", True, "must be a number from 0 to 1000, not True"),
        ("nav-scope", "w_i", "one", "must be a number from 0 to 1000, not 'one'"),
    ],
)
def test_a_value_out_of_bounds_is_told_with_key_value_bounds_and_unit(planner, key, value, words):
    with pytest.raises(ConfigError, match=f"^planner '{planner}': {key}: {words}$"):
        load_planner(planner).params({key: value})


@every_planner
def test_every_parameter_has_bounds_and_takes_what_lies_within(name):
    planner = load_planner(name)
    for key, (_, _, default, (low, high, unit), _) in planner.fields.items():
        assert low <= default <= high
        for value in (low, high):
            assert getattr(planner.params({key: value}), key) == value
            assert type(getattr(planner.params({key: value}), key)) is type(default)
        for value in (low - 1, high + 1):
            with pytest.raises(ConfigError, match=f"planner '{name}': {key}: must be .*{unit}, not {value}"):
                planner.params({key: value})


def test_the_settings_of_nav_i_hold_no_w_i():
    settings = load_planner("nav-i").settings({"prior": 2})
    assert "w_i" not in settings
    assert not set(settings) & {"ask_ahead_s", "ask_every_s", "patience_s", "answers"}
    assert settings == load_planner("nav-i").defaults | {"prior": 2.0}
    assert isinstance(settings["prior"], float)
    assert load_planner("nav-scope").settings({})["w_i"] == 1.0


@every_planner
def test_settings_can_be_set_again(name):
    planner = load_planner(name)
    assert planner.params(planner.settings({})) == planner.params({})
    assert planner.settings({}) == planner.defaults
