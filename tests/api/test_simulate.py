"""``simulate``, ``load_run`` and ``Run``: what scripts and notebooks use."""

from __future__ import annotations

import subprocess
import sys
import webbrowser
from pathlib import Path

import numpy as np
import pytest
import yaml
from typer.testing import CliRunner

import swarmscope
from swarmscope import Run, api, load_run, load_scenario, simulate
from swarmscope.cli.main import app
from swarmscope.errors import ConfigError, InputFileError, MissingPackageError, SwarmscopeError, UnknownNameError
from swarmscope.judging.run_folder import REQUIRED, RUN_FILES, read_config, read_metrics, read_trajectory, read_world
from swarmscope.onboard.deciding.fields import fuse

ROOT = Path(__file__).parents[2]
SHORT = {"robots": 3, "limit_s": 6}
WALL = {"type": "wall", "points": [[2.0, -1.0], [2.0, 1.0]]}
PLACE = {
    "place": {
        "world": {"bounds": [-2, -4, 8, 4], "obstacles": [WALL]},
        "starts": [[0, 0, 0], [0, 2, 0]],
        "goals": [[4, 0], [4, 2]],
    },
    "robots": 2,
}


@pytest.fixture(scope="module")
def crossing():
    """Four robots through a forest, all arrive."""
    return simulate("T1", robots=4, seed=1, noise={"bearing_deg": 1.0}, record_scans="no")


def test_a_run_says_what_it_was_in_one_line(crossing):
    assert isinstance(crossing, Run)
    assert repr(crossing).startswith("<Run T1 · nav-scope · 4 robots · seed 1: 100.0% arrived, 0 collisions, path red")
    assert "\n" not in repr(crossing)
    short = simulate("swap", robots=2, limit_s=1)
    assert repr(short) == "<Run swap · nav-scope · 2 robots · seed 0: 0.0% arrived, 0 collisions>"


def test_what_is_given_reaches_the_scenario_and_the_rest_is_written_out():
    values = {"limit_s": 4, "robot__v_max_mps": np.float64(0.4), "radio": {"loss": 0.5, "range_m": 3}}
    run = simulate("T2", planner="dh-bug", robots=np.int64(2), seed=5, task__options__density=0.1, **values)
    found = run.scenario
    assert (found["task"]["name"], found["task"]["options"]["density"]) == ("T2", 0.1)
    assert (found["planner"]["name"], found["robots"], found["seed"], found["limit_s"]) == ("dh-bug", 2, 5, 4.0)
    assert (found["robot"]["v_max_mps"], found["robot"]["radius_m"]) == (0.4, 0.15)
    assert (found["radio"]["loss"], found["radio"]["range_m"], found["radio"]["latency_s"]) == (0.5, 3.0, 0.005)
    assert len(found["planner"]["params"]) > 5


def test_a_place_is_a_task_a_file_a_mapping_or_a_scenario(tmp_path):
    file = tmp_path / "s.yaml"
    file.write_text(yaml.safe_dump({**PLACE, "planner": {"name": "nav-i"}, "seed": 3, "limit_s": 4}))
    runs = [simulate(file), simulate(str(file)), simulate(load_scenario(str(file)))]
    runs.append(simulate(PLACE, planner="nav-i", seed=3, limit_s=4))
    for run in runs:
        assert run.scenario == runs[0].scenario
        assert run.trace.x_m.tobytes() == runs[0].trace.x_m.tobytes()
    assert runs[0].scenario["planner"]["name"] == "nav-i" and runs[0].scenario["seed"] == 3
    assert simulate(file, planner="dh-bug", seed=1).scenario["planner"]["name"] == "dh-bug"
    assert PLACE["place"]["world"]["obstacles"] == [WALL]


def test_robots_of_a_list_go_by_their_numbers():
    run = simulate("swap", robot=[{}, {"v_max_mps": 0.7}], robot__1__radius_m=0.3, robot__0__start_s=1.0, limit_s=1)
    sheets = run.scenario["robot"]
    assert [(sheet["radius_m"], sheet["start_s"]) for sheet in sheets] == [(0.15, 1.0), (0.3, 0.0)]
    assert sheets[1]["v_max_mps"] == 0.7


def test_a_map_takes_the_place_of_the_task():
    run = simulate(map__file="willow_garage_office", robots=1, limit_s=1, record_scans="no")
    assert run.metrics["run"]["task"] == "willow_garage_office" and "task" not in run.scenario


WRONG = {
    "key": ({"radio__los": 1}, r"^simulate: radio\.los: unknown key; did you mean 'loss'\?"),
    "key in a group": ({"radio": {"los": 1}}, r"^simulate: radio\.los: unknown key; did you mean 'loss'\?"),
    "key at the top": ({"limits": 1}, r"^simulate: limits: unknown key; did you mean 'limit_s'\?"),
    "value": ({"radio__loss": 1.5}, r"^simulate: radio\.loss: .*less than or equal to 1"),
    "no group": ({"limit_s": 3, "limit_s__x": 1}, r"^simulate: limit_s\.x: 'limit_s' is not a group"),
    "list": ({"robot": [{}, {}], "robot__2__radius_m": 1}, r"^simulate: robot\.2\.radius_m: 'robot' is a list of 2"),
    "planner": ({"planner": "nav-scop"}, "did you mean 'nav-scope'"),
    "robots": ({"robots": 0}, "^simulate: robots: "),
    "parameter": ({"planner__params__w_ii": 1}, "did you mean 'w_i'"),
    "option": ({"task__options__densities": 1}, "did you mean 'density'"),
}


@pytest.mark.parametrize("case", WRONG)
def test_a_slip_is_told_as_on_the_command_line(case):
    overrides, words = WRONG[case]
    with pytest.raises(SwarmscopeError, match=words):
        simulate("T1", **overrides)


@pytest.mark.parametrize("place", ["T9", "t1", "", None, 3, {"tusk": {}}, {}])
def test_a_place_that_is_none_is_named(place):
    with pytest.raises((UnknownNameError, ConfigError)):
        simulate(place)


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(InputFileError, match="No such file"):
        simulate(tmp_path / "nowhere.yaml")
    with pytest.raises(InputFileError, match="no such run folder"):
        load_run(tmp_path / "nowhere")


def test_the_trace_is_the_trajectory_and_cannot_be_changed(crossing, tmp_path):
    folder = crossing.save(tmp_path / "r", pictures=False)
    stored = read_trajectory(folder)
    trace = crossing.trace
    assert set(trace.names) == set(stored) == set(trace)
    for name, array in stored.items():
        assert np.array_equal(trace[name], array, equal_nan=array.dtype.kind == "f"), name
        assert getattr(trace, name) is trace[name]
        with pytest.raises(ValueError, match="read-only"):
            trace[name][...] = 0
    assert trace.states.shape == trace.reasons.shape == trace.x_m.shape
    assert trace.reasons[-1, 0] == trace.reason_names[trace.reason[-1, 0]]
    with pytest.raises(AttributeError, match="did you mean 'speed_mps'"):
        _ = trace.speed_mp
    with pytest.raises(KeyError, match="did you mean 'x_m'"):
        trace["x_n"]
    assert "x_m" in dir(trace) and "4 robots" in repr(trace)


def test_saved_and_loaded_is_the_same_run(crossing, tmp_path):
    folder = crossing.save(tmp_path / "r")
    assert {entry.name for entry in folder.iterdir()} == RUN_FILES
    again = load_run(str(folder))
    assert again.metrics == crossing.metrics == read_metrics(folder)
    assert again.scenario == crossing.scenario == read_config(folder)
    assert again.world == crossing.world == read_world(folder)
    assert set(again.trace) == set(crossing.trace)
    for name, array in crossing.trace.items():
        assert again.trace[name].dtype == array.dtype
        assert np.array_equal(again.trace[name], array, equal_nan=array.dtype.kind == "f"), name
    for name, column in crossing.robots.items():
        assert np.array_equal(again.robots[name], column), name
    assert repr(again) == repr(crossing)
    for name in REQUIRED:
        assert (again.save(tmp_path / "s", pictures=False) / name).read_bytes() == (folder / name).read_bytes(), name


def test_the_command_line_repeats_it_to_the_byte(crossing, tmp_path):
    folder = crossing.save(tmp_path / "r", pictures=False)
    words = ["run", str(folder / "config.yaml"), "--no-pictures", "--out", str(tmp_path / "again")]
    assert CliRunner().invoke(app, words).exit_code == 0
    for name in ("config.yaml", "world.json", "trajectory.npz"):
        assert (tmp_path / "again" / name).read_bytes() == (folder / name).read_bytes(), name


def test_a_run_folder_is_only_read(crossing, tmp_path):
    """What its config names is not imported, not even looked for."""
    folder = crossing.save(tmp_path / "r", pictures=False)
    spy = tmp_path / "spy.py"
    spy.write_text(f"from pathlib import Path\nPath({str(tmp_path / 'seen')!r}).touch()\n")
    text = (folder / "config.yaml").read_text().replace("name: nav-scope", f"name: {spy}").replace("T1", str(spy))
    (folder / "config.yaml").write_text(text)
    run = load_run(folder)
    assert str(spy) in (run.scenario["planner"]["name"], run.scenario["task"]["name"])
    run.show(open=False)
    assert len(run.robots["robot"]) == 4 and not (tmp_path / "seen").exists()


def test_robots_as_columns(crossing):
    robots = crossing.robots
    assert {len(column) for column in robots.values()} == {4}
    assert np.all(robots["stretch"] > 1.0) and np.all(robots["stretch"] < 1.5)
    assert robots["travelled_m"].sum() / robots["shortest_m"].sum() == pytest.approx(
        crossing.metrics["path_stretch_any_angle"], rel=1e-12
    )
    assert not robots["collided"].any() and set(robots["reason"]) <= set(crossing.trace.reason_names)
    assert np.array_equal(robots["goal_x_m"], [robot["goal"][0] for robot in crossing.world["robots"]])


def test_who_does_not_arrive_has_no_stretch():
    robots = simulate("T1", **SHORT).robots
    assert np.isnan(robots["arrival_s"]).all() and np.isnan(robots["stretch"]).all()
    assert np.all(robots["travelled_m"] > 1.0)


def test_frames(crossing):
    pandas = pytest.importorskip("pandas")
    robots, ticks = crossing.frame(), crossing.frame("ticks")
    assert isinstance(robots, pandas.DataFrame) and list(robots.columns) == list(crossing.robots)
    assert len(robots) == 4 and len(ticks) == crossing.trace.x_m.size
    one = ticks[ticks.robot == 2]
    assert np.array_equal(one.x_m, crossing.trace.x_m[:, 2]) and np.array_equal(one.t_s, crossing.trace.t_s)
    assert set(ticks.reason) <= set(crossing.trace.reason_names)


def test_frames_without_pandas_say_what_to_install(crossing, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    for of in ("robots", "ticks"):
        with pytest.raises(MissingPackageError, match=r"^a frame needs pandas: pip install pandas$"):
            crossing.frame(of)
    with pytest.raises(UnknownNameError, match="did you mean 'robots'"):
        crossing.frame("robot")


def test_ticks_as_columns(crossing):
    columns = api.tick_columns(crossing.trace)
    ticks, robots = crossing.trace.x_m.shape
    assert {len(column) for column in columns.values()} == {ticks * robots}
    assert columns["robot"][:robots].tolist() == list(range(robots))
    assert np.array_equal(columns["y_m"].reshape(ticks, robots), crossing.trace.y_m)


def test_show_writes_the_page_and_opens_it(crossing, monkeypatch, capsys):
    opened = []
    monkeypatch.setenv("DISPLAY", ":0")
    monkeypatch.setattr(webbrowser, "open", lambda uri: opened.append(uri) or True)
    page = crossing.show(open=False)
    assert page.name == "replay.html" and "T1 · nav-scope" in page.read_text("utf-8")
    assert opened == []
    assert crossing.show() == page and opened == [page.as_uri()]
    assert capsys.readouterr().out == ""
    monkeypatch.setattr(webbrowser, "open", lambda uri: False)
    crossing.show()
    assert capsys.readouterr().out == f"{page}\n"


def test_show_without_a_display_prints_the_path(crossing, monkeypatch, capsys):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(webbrowser, "open", lambda uri: pytest.fail("a text browser would start"))
    page = crossing.show()
    assert capsys.readouterr().out == f"{page}\n"


def test_a_folder_with_other_things_is_not_touched(crossing, tmp_path):
    (tmp_path / "thesis.tex").write_text("precious")
    with pytest.raises(ConfigError, match=r"holds 'thesis\.tex'"):
        crossing.save(tmp_path)


def test_progress_is_shown_on_a_terminal_only_and_only_if_it_takes_long(monkeypatch, capsys):
    simulate("swap", **SHORT)
    assert capsys.readouterr().err == ""
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setattr(api, "kernels_are_cold", lambda planner: True)
    simulate("swap", progress=False, **SHORT)
    assert capsys.readouterr().err == ""
    simulate("swap", **SHORT)
    assert capsys.readouterr().err == "compiling the kernels for the first time (a minute or two, kept on disk) ...\n"
    monkeypatch.setattr(api, "kernels_are_cold", lambda planner: False)
    monkeypatch.setattr(api, "QUIET_S", 0.0)
    simulate("swap", robots=3, limit_s=30)
    assert "swap nav-scope" in capsys.readouterr().err


def test_the_example_compares_three_planners():
    words = [sys.executable, str(ROOT / "examples/compare.py"), "2", "3"]
    done = subprocess.run(words, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("mean") == 12 and done.stdout.count("95 %") == 8
    assert len((ROOT / "examples/compare.py").read_text().splitlines()) <= 25


def test_version_is_still_there():
    assert swarmscope.__version__.count(".") == 2


def test_every_neighbours_opinion_is_kept(tmp_path):
    """P_dir (15) follows from P_a, each P_ni (14) and each f_ai (12) as they are kept."""
    run = simulate("T3", robots=8, seed=3, limit_s=40.0, record_scans="no", progress=False)
    choices, opinions = run.trace.choices, run.trace.opinions
    assert len(choices) > 3 and len(opinions) > 3
    assert opinions[:, 0].max() < len(choices)
    for k, (_, robot, p_self, p_left, side, heard) in enumerate(choices):
        own = opinions[opinions[:, 0] == k]
        assert len(own) == heard and robot not in own[:, 1]
        assert set(np.unique(own[:, 2])) <= {-1.0, 1.0} and side in (-1.0, 1.0)
        p_ni, f_ai = own[:, 3], own[:, 4]
        assert p_left == pytest.approx(fuse(p_self, float((f_ai * p_ni).sum()), float(f_ai.sum())))
    again = load_run(run.save(tmp_path / "run", pictures=False))
    assert (again.trace.choices == choices).all() and (again.trace.opinions == opinions).all()
