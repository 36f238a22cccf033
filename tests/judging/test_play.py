"""From scenario to figures and folder: the same bytes twice, every promised key, figures that can be recomputed."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from helpers import circle, place_scenario, wall
from swarmscope.errors import ConfigError
from swarmscope.judging import references
from swarmscope.judging import run as runner
from swarmscope.judging.run_folder import read_config, read_metrics, read_trajectory, read_world
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.world import WorldSpec

WALL_CLOCK = {"plan_us_p50", "plan_us_p99", "measured"}
NOISY = {
    "noise": {"range_fraction": 0.05, "bearing_deg": 3.0, "compass_deg": 3.0, "dropout": 0.01},
    "radio": {"loss": 0.2, "latency_s": 0.2},
}
PROMISED = """arrival_rate path_redundancy path_redundancy_all path_stretch path_stretch_any_angle spl duration_s
collisions min_clearance_m fusions messages bytes_sent bytes_on_air air_bps mean_package_bytes bandwidth_kbps
requests waiting_s plan_us_p50 plan_us_p99 planner_memory_bytes run versions failures measured"""


def scenario_of(**values):
    return parse_scenario({"task": {"name": "T1"}, "robots": 4, "limit_s": 12.0} | values, "test")


@pytest.fixture(scope="module")
def crossing(tmp_path_factory):
    """A finished run of 12 robots: its folder and its figures."""
    out = tmp_path_factory.mktemp("runs") / "crossing"
    return out, runner.run_scenario(scenario_of(limit_s=200.0, seed=3, robots=12), out)


def test_all_promised_figures_are_there_and_in_the_file(crossing):
    out, figures = crossing
    stored = read_metrics(out)
    assert set(PROMISED.split()) <= set(stored)
    assert stored == json.loads(json.dumps(figures))
    assert stored["arrival_rate"] == 1.0 and stored["failures"] == []
    assert stored["run"] == {"task": "T1", "planner": "nav-scope", "robots": 12, "seed": 3}


def test_figures_agree_with_the_trajectory(crossing):
    out, figures = crossing
    arrays = read_trajectory(out)
    steps = np.hypot(np.diff(arrays["x_m"], axis=0), np.diff(arrays["y_m"], axis=0))
    shortest = runner.play(scenario_of(limit_s=0.2, seed=3, robots=12)).references.shortest_m
    assert figures["path_stretch"] == pytest.approx(steps.sum() / shortest.sum(), rel=5e-3)
    assert figures["path_redundancy"] == pytest.approx(1.0 - 1.0 / figures["path_stretch"])
    assert figures["duration_s"] == pytest.approx(float(np.nanmax(arrays["arrival_s"])))
    assert figures["min_clearance_m"] <= float(arrays["clearance_m"].min()) + 1e-6
    assert figures["bytes_sent"] >= int(arrays["bytes_sent"][-1].sum()) > 0
    assert figures["messages"] > figures["requests"] > 0
    assert 10.0 < figures["mean_package_bytes"] <= 42.0
    assert figures["bytes_on_air"] > figures["bytes_sent"]
    assert figures["path_stretch_any_angle"] >= 1.0


def test_trajectory_has_every_array_in_its_shape(crossing):
    arrays = read_trajectory(crossing[0])
    ticks, robots, beams = len(arrays["t_s"]), 12, 360
    for name in ("x_m", "y_m", "yaw_rad", "state", "reason", "speed_mps", "clearance_m", "p_left", "side"):
        assert arrays[name].shape == (ticks, robots), name
    for name, kind in {"state": "u1", "reason": "u1", "side": "i1", "neighbours": "u1", "bytes_sent": "i4"}.items():
        assert arrays[name].dtype == np.dtype(kind), name
    assert arrays["scan_u8"].shape == (ticks, robots, beams)
    assert arrays["safe_bits"].shape == (ticks, robots, beams // 8)
    assert arrays["beam_angles"].shape == (beams,) and arrays["links"].shape[1] == 4
    assert arrays["state"].max() < len(arrays["state_names"])
    assert arrays["reason"].max() < len(arrays["reason_names"])
    assert float(arrays["range_max_m"]) == 5.0


def test_world_names_robots_and_every_obstacle(crossing):
    world = read_world(crossing[0])
    assert [robot["id"] for robot in world["robots"]] == list(range(12))
    assert set(world["robots"][0]) == {"id", "radius", "start", "goal"}
    assert len(world["bounds"]) == 4
    spec = WorldSpec.model_validate({"obstacles": world["obstacles"], "bounds": world["bounds"]})
    assert len(spec.obstacles) == 140


def test_links_lie_between_robots_and_within_the_run(tmp_path):
    runner.run_scenario(scenario_of(robots=12, limit_s=30.0), tmp_path / "r")
    arrays = read_trajectory(tmp_path / "r")
    links = arrays["links"]
    assert len(links) > 0
    assert links[:, 0].max() < len(arrays["t_s"]) and links[:, 1:3].max() < 12
    assert np.all(links[:, 1] != links[:, 2])


@pytest.mark.parametrize("extra", [{}, NOISY], ids=["quiet", "noisy"])
def test_same_scenario_same_bytes_with_one_thread_or_two(extra, tmp_path):
    scenario = scenario_of(robots=9, limit_s=20.0, **extra)
    figures = [runner.run_scenario(scenario, tmp_path / str(k), threads) for k, threads in enumerate((1, 1, 2))]
    for name in ("config.yaml", "world.json", "trajectory.npz"):
        contents = {(tmp_path / str(k) / name).read_bytes() for k in range(3)}
        assert len(contents) == 1, name
    texts = {json.dumps({k: v for k, v in f.items() if k not in WALL_CLOCK}) for f in figures}
    assert len(texts) == 1


def test_the_config_of_a_run_gives_the_same_figures(crossing, tmp_path):
    out, figures = crossing
    again = runner.run_scenario(parse_scenario(read_config(out), "config.yaml"), tmp_path / "again")
    assert {k: v for k, v in again.items() if k not in WALL_CLOCK} == {
        k: v for k, v in figures.items() if k not in WALL_CLOCK
    }


def test_another_seed_is_another_run(crossing, tmp_path):
    runner.run_scenario(scenario_of(seed=4), tmp_path / "r")
    for name in ("world.json", "trajectory.npz"):
        assert (tmp_path / "r" / name).read_bytes() != (crossing[0] / name).read_bytes()


def test_robots_that_do_not_arrive_are_named_with_state_reason_and_distance():
    outcome = runner.play(scenario_of(limit_s=2.0))
    failures = runner.failures(outcome)
    assert [failure["robot"] for failure in failures] == [0, 1, 2, 3]
    for failure in failures:
        assert failure["why"].startswith("time limit in state '") and failure["why"].endswith("m from its goal")
    assert runner.figures(outcome)["arrival_rate"] == 0.0


def test_robots_that_collided_are_counted_and_named():
    outcome = runner.play(scenario_of(limit_s=2.0))
    robots = outcome.trace.robots.copy()
    robots["crashed"][2] = 1
    outcome = replace(outcome, trace=replace(outcome.trace, robots=robots))
    figures = runner.figures(outcome)
    assert figures["collisions"] == 1
    assert figures["failures"][2] == {"robot": 2, "why": "collided"}


BLOCKED = place_scenario(
    [(0.0, 0.0, 0.0), (-1.0, 3.0, 0.0)], [(8.0, 0.0), (-1.0, 3.0)], [wall((4.0, -4.0), (4.0, 2.0))],
    lidar={"beams": 120}, safety={"speed_step_mps": 0}, limit_s=60.0,
)  # fmt: skip
"""Robot 0 passes a wall, whose nearer end is on the left, by one decision; robot 1 stands at its goal."""


def figures_of(params, **values):
    scenario = BLOCKED | {"planner": {"name": "dh-bug", "params": params}} | values
    return runner.figures(runner.play(parse_scenario(scenario, "test")))


def test_choices_are_judged_and_told_when_the_scenario_says_so():
    left, right = (figures_of({"turn": turn}, judge_sides=True) for turn in (0, 1))
    assert (left["side_accuracy"], left["sides_judged"]) == (1.0, 1)
    assert right["side_accuracy"] < 1.0 and right["mover_path_m"] > left["mover_path_m"] + 0.3
    told = figures_of({"turn": 1, "told": 1}, judge_sides=True)
    assert told["side_accuracy"] == 1.0 and told["mover_path_m"] == left["mover_path_m"]
    alone = figures_of({"turn": 1, "told": 1})
    assert alone["sides_judged"] == 0 and alone["side_accuracy"] is None
    assert alone["mover_path_m"] == right["mover_path_m"]


def test_a_robot_that_stands_at_its_goal_does_not_enter_figures_of_movers():
    found = figures_of({"turn": 0}, limit_s=5.0)
    assert found["arrival_rate"] == 0.5 and found["mover_arrival_rate"] == 0.0
    assert np.isnan(found["mover_path_m"])


def test_figures_without_a_value_are_null_in_the_file(tmp_path):
    runner.run_scenario(scenario_of(robots=1, limit_s=1.0), tmp_path / "r")
    stored = read_metrics(tmp_path / "r")
    for name in ("duration_s", "path_redundancy", "path_stretch", "mean_package_bytes"):
        assert stored[name] is None
    assert stored["spl"] == 0.0


def test_without_recorded_scans_their_arrays_are_empty(tmp_path):
    runner.run_scenario(scenario_of(record_scans="no"), tmp_path / "r")
    arrays = read_trajectory(tmp_path / "r")
    assert arrays["scan_u8"].shape[0] == 0 and arrays["safe_bits"].shape[0] == 0
    assert len(arrays["x_m"]) == 60


def test_large_swarms_get_references_for_some_robots_only(monkeypatch):
    monkeypatch.setattr(references, "SEARCHED_M2", 2000.0)
    outcome = runner.play(scenario_of(robots=15, limit_s=1.0))
    known = np.flatnonzero(np.isfinite(outcome.references.shortest_m))
    assert known[0] == 0 and known[-1] == 14 and 2 <= len(known) < 15
    assert runner.figures(outcome)["reference_robots"] == len(known)


def test_any_angle_references_are_left_out_when_not_wanted_or_too_many(monkeypatch):
    assert np.isnan(runner.play(scenario_of(limit_s=1.0), any_angle=False).references.any_angle_m).all()
    monkeypatch.setattr(references, "ANY_ANGLE_ROBOTS", 3)
    assert np.isnan(runner.play(scenario_of(limit_s=1.0)).references.any_angle_m).all()


def test_any_angle_is_never_longer_than_the_grid():
    outcome = runner.play(scenario_of(limit_s=0.2, robots=15))
    assert np.all(outcome.references.any_angle_m <= outcome.references.shortest_m + 1e-9)


def test_a_refused_folder_is_noticed_before_the_run(tmp_path, monkeypatch):
    monkeypatch.setattr(runner, "play", lambda *_: pytest.fail("ran"))
    (tmp_path / "other.txt").touch()
    with pytest.raises(ConfigError, match=r"other\.txt"):
        runner.run_scenario(scenario_of(), tmp_path)


def test_progress_is_told(tmp_path):
    told = []
    values = place_scenario([(-3, 0, 0)], [(3, 0)], [circle(0, 0.1, 0.5)], limit_s=60.0)
    runner.run_scenario(parse_scenario(values, "test"), tmp_path / "r", progress=lambda s, done: told.append((s, done)))
    assert told and all(0 < seconds <= 60.0 and done in (0, 1) for seconds, done in told)
