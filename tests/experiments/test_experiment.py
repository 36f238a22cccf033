import copy
from pathlib import Path

import pytest
import yaml
from small_experiment import CELLS, LABELS, VALUES, small

from swarmscope.errors import ConfigError, InputFileError, SwarmscopeError, UnknownNameError
from swarmscope.experiments.experiment import (
    load_experiment,
    merged,
    shipped_experiment,
    shipped_experiments,
    units,
)
from swarmscope.experiments.work import unit_key, world_key


def test_units_are_every_place_label_and_seed():
    every = units(small())
    assert len(every) == CELLS == len({(u.place, u.planner, u.seed) for u in every})
    assert list(dict.fromkeys(u.planner for u in every)) == LABELS
    assert {u.scenario.task.name for u in every if u.place == "ring"} == {"T3"}
    assert all(u.scenario.seed == u.seed and u.scenario.robots == 3 for u in every)
    assert [u.seed for u in units(small(), maps=2)][:4] == [1000, 1001, 1000, 1001]


def test_the_key_is_that_of_the_content():
    keys = {(u.planner, u.place, u.seed): unit_key(u.scenario) for u in units(small())}
    assert keys["alone", "near", 1000] == keys["Nav-SCOPE w_i=0", "near", 1000]
    assert len(set(keys.values())) == 24
    worlds = {world_key(u.scenario) for u in units(small())}
    assert len(worlds) == 8  # places x seeds, whoever plans


def test_merging_keeps_what_is_not_named():
    base = {"a": {"b": 1, "c": 2}, "d": 3}
    assert merged(base, {"a": {"b": 5}}) == {"a": {"b": 5, "c": 2}, "d": 3}
    assert base["a"]["b"] == 1


@pytest.mark.parametrize("name", shipped_experiments())
def test_shipped_experiments_load(name):
    assert load_experiment(shipped_experiment(name)).name == name


def wrong(**changes):
    with pytest.raises(SwarmscopeError) as error:
        small(**changes)
    return str(error.value)


def test_errors_name_place_and_nearest():
    assert "sedes: unknown key; did you mean 'seeds'?" in wrong(sedes="evaluation")
    assert "did you mean 'Nav-SCOPE'" in wrong(ours="NavSCOPE")
    assert "did you mean 'path_redundancy'" in wrong(metrics=["path_redundency"])
    places = {"x": {"task": {"name": "T1"}, "robot": {"radius": 1.0}}}
    assert "x, alone" in wrong(places=places) and "radius_m" in wrong(places=places)
    sweep = VALUES["sweeps"][0] | {"planner": "Nav"}
    assert "sweep w_i: unknown planner 'Nav'" in wrong(sweeps=[sweep])
    assert "unknown key" in wrong(sweeps=[VALUES["sweeps"][0] | {"vals": [1]}])
    target = {"planner": "alone", "place": "near", "metric": "spl"}
    assert "exactly one of" in wrong(targets=[target])
    with pytest.raises(UnknownNameError, match="nav-scope"):
        shipped_experiment("nav-scop")


def test_files(tmp_path):
    file = tmp_path / "e.yaml"
    file.write_text(yaml.safe_dump(copy.deepcopy(VALUES)))
    assert load_experiment(file) == small()
    with pytest.raises(InputFileError, match="cannot be read"):
        load_experiment(tmp_path / "none.yaml")
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputFileError, match="not text"):
        load_experiment(file)
    file.write_text("a: [")
    with pytest.raises(InputFileError, match="not YAML"):
        load_experiment(file)
    file.write_text("- 1")
    with pytest.raises(ConfigError, match="mapping"):
        load_experiment(Path(file))


def test_gap_and_flow_time_name_planners():
    asked = small(gap={"worst": "alone", "best": "Nav-SCOPE"}, flow_time="alone")
    assert asked.gap.worst == "alone" and asked.flow_time == "alone"
    assert "gap: unknown planner 'Nav'" in wrong(gap={"worst": "alone", "best": "Nav"})
    target = {"planner": "alone", "place": "ring", "metric": "gap_closed", "at_least": 0.5}
    assert "unknown metric 'gap_closed'" in wrong(targets=[target])
    assert small(gap={"worst": "alone", "best": "Nav-SCOPE"}, targets=[target]).targets[0].metric == "gap_closed"
    assert "same planner" in wrong(gap={"worst": "alone", "best": "alone"})
    assert "did you mean 'worst'" in wrong(gap={"worst": "alone", "best": "Nav-SCOPE", "wors": "alone"})
    assert "flow_time: unknown planner 'alon'; did you mean 'alone'" in wrong(flow_time="alon")


def test_table_two_of_giwt_is_complete():
    giwt = load_experiment(shipped_experiment("giwt"))
    found = units(giwt)
    assert len({u.seed for u in found}) == 500 and len(found) == 3 * 13 * 500
    assert all(u.scenario.judge_sides and u.scenario.limit_s == 300.0 for u in found)
    told = {u.planner for u in found if u.scenario.planner.params.get("told")}
    assert told == {"A* sides"}
    of_table_two = [table for table in giwt.published if table.source == "GIWT, Table II"]
    assert [len(row) for table in of_table_two for row in table.values.values()] == [6] * 6
