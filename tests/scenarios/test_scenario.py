"""Scenarios: validation, completeness, and that no input makes anything but a scenario or a plain error."""

from __future__ import annotations

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from swarmscope.errors import ConfigError, InputFileError, SwarmscopeError, UnknownNameError
from swarmscope.onboard.deciding.bug import toss
from swarmscope.scenarios.places import make_setup, map_path
from swarmscope.scenarios.read import load_scenario, parse_scenario
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import complete, make_rig_of, make_setting
from swarmscope.sim.maps import packaged_map
from swarmscope.tasks import load_task, task_names
from swarmscope.tasks._contract import all_options, option_fields

T1 = {"task": {"name": "T1"}}
PLACE = {
    "world": {"bounds": [-5, -5, 5, 5], "obstacles": [{"type": "circle", "center": [0, 0], "radius": 1}]},
    "starts": [[-3, 0, 0], [-3, 2, 0]],
    "goals": [[3, 0], [3, 2]],
}


def test_the_shortest_scenario_is_a_task():
    scenario = parse_scenario(T1, "test")
    assert (scenario.robots, scenario.seed, scenario.planner.name) == (15, 0, "nav-scope")


@pytest.mark.parametrize(
    ("place", "key", "hint"),
    [
        ("radio", "los", "loss"),
        ("noise", "bearing", "bearing_deg"),
        ("robot", "radius", "radius_m"),
        ("planner", "nme", "name"),
        ("guard", "clearence_m", "clearance_m"),
        ("safety", "sectr", "sector"),
        ("task", "optoins", "options"),
    ],
)
def test_unknown_keys_name_place_and_nearest(place, key, hint):
    values = {**T1, place: {**T1.get(place, {}), key: 1}}
    with pytest.raises(ConfigError, match=rf"^here: {place}\.{key}: unknown key; did you mean '{hint}'\?"):
        parse_scenario(values, "here")


def test_unknown_keys_inside_a_written_world_name_their_place():
    wrong = {**PLACE, "world": {**PLACE["world"], "obstacels": []}}
    with pytest.raises(ConfigError, match=r"place\.world\.obstacels: unknown key; did you mean 'obstacles'"):
        parse_scenario({"place": wrong, "robots": 2}, "here")


@pytest.mark.parametrize("values", [{}, {**T1, "map": {"file": "x"}}, {"task": None}, {**T1, "place": PLACE}])
def test_exactly_one_place(values):
    with pytest.raises(ConfigError, match="exactly one of"):
        parse_scenario(values, "test")


@pytest.mark.parametrize("name", ["t1", "T1 ", "", "../T1"])
def test_task_names_are_exact(name):
    with pytest.raises(UnknownNameError, match="unknown task"):
        parse_scenario({"task": {"name": name}}, "test")


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("robots", 0),
        ("robots", 2.5),
        ("robots", "many"),
        ("seed", -1),
        ("seed", 2**31),
        ("limit_s", 0),
        ("limit_s", float("nan")),
        ("limit_s", float("inf")),
        ("substeps", 0),
        ("record_scans", "maybe"),
        ("judge_sides", "some"),
        ("radio", {"loss": 1.1}),
        ("noise", {"range_fraction": -0.1}),
        ("lidar", {"beams": 7}),
        ("lidar", {"fov_deg": 361}),
        ("robot", {"radius_m": float("inf")}),
        ("planner", {"params": {"w_i": float("nan")}}),
        ("planner", {"params": {"w_i": "much"}}),
    ],
)
def test_values_out_of_range_are_refused_at_their_place(key, value):
    with pytest.raises(ConfigError, match=f"^test: {key}"):
        parse_scenario({**T1, key: value}, "test")


def test_unknown_parameters_and_options_name_the_nearest():
    scenario = parse_scenario({**T1, "planner": {"params": {"patience": 1}}}, "test")
    with pytest.raises(UnknownNameError, match="did you mean 'patience_s'"):
        complete(scenario)
    scenario = parse_scenario({"task": {"name": "T1", "options": {"densities": 1}}}, "test")
    with pytest.raises(UnknownNameError, match="did you mean 'density'"):
        make_setup(scenario)


@pytest.mark.parametrize(
    "values",
    [
        {**T1, "planner": {"params": {"w_i": 0}}, "noise": {"bearing_deg": 3}},
        {"map": {"file": "willow_garage_office"}, "robots": 3},
        {"place": PLACE, "robots": 2, "radio": {"exact_features": True}},
        {"task": {"name": "T3", "options": {"density": 0.1}}, "lidar": {"beams": 180}},
    ],
)
def test_a_complete_scenario_survives_yaml_and_says_everything(values):
    scenario = parse_scenario(values, "test")
    written = complete(scenario)
    again = parse_scenario(yaml.safe_load(yaml.safe_dump(written)), "test")
    assert complete(again) == written
    assert set(written) == set(Scenario.model_fields) - ({"task", "map", "place"} - set(values))
    assert set(written["planner"]["params"]) == set(make_setting_params(scenario))
    if "task" in written:
        assert set(written["task"]["options"]) == set(option_fields(load_task(scenario.task.name)))


def make_setting_params(scenario):
    from swarmscope.onboard.planners import load_planner

    return load_planner(scenario.planner.name).defaults


def test_options_of_every_task_can_be_given_back():
    for name in task_names():
        options = all_options(load_task(name), {})
        assert options and all(isinstance(value, float | str) for value in options.values())
        a = make_setup(parse_scenario({"task": {"name": name}, "robots": 2}, "test"))
        b = make_setup(parse_scenario({"task": {"name": name, "options": options}, "robots": 2}, "test"))
        assert a.world == b.world and np.array_equal(a.starts, b.starts)


def test_packaged_maps_go_by_name_and_files_by_path(tmp_path):
    assert map_path("willow_garage_office") == packaged_map("willow_garage_office")
    assert map_path("maps/office.yaml").name == "office.yaml"
    with pytest.raises(UnknownNameError, match="did you mean 'willow_garage_office'"):
        map_path("willow_garage")


def test_a_map_file_of_a_scenario_is_written_with_its_whole_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    written = complete(parse_scenario({"map": {"file": "hall.yaml"}}, "test"))
    assert written["map"]["file"] == str((tmp_path / "hall.yaml").resolve())


def test_numbers_of_robots_starts_and_goals_must_agree():
    for values in ({"robots": 3}, {"robots": 1}, {"place": PLACE | {"goals": [*PLACE["goals"], [0, 0]]}}):
        with pytest.raises(ConfigError, match="as many starts and goals as robots"):
            make_setup(parse_scenario({"place": PLACE} | values, "test"))
    for values in ({"robots": 2}, {}):
        assert len(make_setup(parse_scenario({"place": PLACE} | values, "test")).starts) == 2


def test_settings_reach_the_kernels_in_their_units():
    values = {
        **T1,
        "robots": 2,
        "seed": 9,
        "noise": {"range_fraction": 0.05, "bearing_deg": 3.0, "compass_deg": 6.0, "dropout": 0.1},
        "radio": {"loss": 0.2, "latency_s": 0.3, "range_m": 7.0, "bitrate_bps": 1000.0},
        "lidar": {"beams": 90, "fov_deg": 180.0, "range_m": 8.0, "rate_hz": 10.0},
        "robot": {"radius_m": 0.2, "half_width_m": 0.18, "v_max_mps": 0.4},
        "guard": {"clearance_m": 0.05},
        "limit_s": 12.0,
    }
    scenario = parse_scenario(values, "test")
    setting = make_setting(scenario, make_setup(scenario), threads=2)
    assert setting.noise.bearing_rad == pytest.approx(np.pi / 60)
    assert setting.noise.compass_rad == pytest.approx(np.pi / 30)
    assert (setting.noise.range_fraction, setting.noise.dropout) == (0.05, 0.1)
    assert (setting.radio.loss, setting.radio.latency_s, setting.radio.range_m) == (0.2, 0.3, 7.0)
    assert (setting.dt, setting.limit_s, setting.seed, setting.threads) == (0.1, 12.0, 9, 2)
    rig = make_rig_of(scenario)
    assert (setting.beams.cos.size, setting.beams.wraps, setting.beams.range_max) == (90, False, 8.0)
    sensor = rig.sensor  # the same beams in the full circle: pi / 89 apart, 44 before them
    assert (sensor.beams, sensor.first, sensor.field, sensor.wraps, sensor.range_max) == (178, 44, 90, True, 8.0)
    assert (rig.body.radius_m, rig.body.v_max_mps, rig.guarding.clearance_m) == (0.2, 0.4, 0.05)


@pytest.mark.parametrize(("robots", "choice", "kept"), [(2, "auto", True), (2000, "auto", False), (2, "no", False)])
def test_scans_are_recorded_unless_they_would_be_huge(robots, choice, kept):
    scenario = parse_scenario({"task": {"name": "swap"}, "robots": robots, "record_scans": choice}, "test")
    assert make_setting(scenario, make_setup(scenario)).record_scans is kept


def test_files_that_cannot_be_read_are_named(tmp_path):
    with pytest.raises(InputFileError, match=r"nowhere\.yaml: cannot be read \(No such file"):
        load_scenario(tmp_path / "nowhere.yaml")
    with pytest.raises(InputFileError, match="is a folder"):
        load_scenario(tmp_path)


plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8) | st.integers(), inner, max_size=3),
    max_leaves=8,
)
tables = st.dictionaries(st.sampled_from([*Scenario.model_fields, "other"]), plain, max_size=4)


@given(tables | plain)
def test_anything_is_a_scenario_or_a_plain_error(values):
    try:
        assert isinstance(parse_scenario(values, "test"), Scenario)
    except SwarmscopeError as error:
        assert str(error).startswith("test")


@given(
    st.sampled_from(["radio", "noise", "robot", "lidar", "guard", "safety", "planner", "task", "map", "place"]), plain
)
def test_any_group_is_valid_or_named(group, content):
    try:
        parse_scenario({**T1, group: content}, "test")
    except SwarmscopeError as error:
        assert str(error).startswith("test")


def test_what_is_tossed_for_depends_on_the_seed_of_the_run():
    """Else every robot would toss for the same sides in every world."""

    def sides(seed, own=0):
        values = {"task": {"name": "T1"}, "seed": seed, "planner": {"name": "dh-bug", "params": {"seed": own}}}
        scenario = parse_scenario(values, "test")
        params = make_setting(scenario, make_setup(scenario)).params
        return [toss(params.seed, robot, count) for robot in range(15) for count in range(4)]

    assert sides(7) == sides(7)
    assert sides(7) != sides(8)
    assert sides(7) != sides(7, own=1)
    assert abs(np.mean([sides(seed)[0] for seed in range(40)])) < 0.5
