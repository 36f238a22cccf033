"""Nav-I is Nav-SCOPE with w_i = 0, and the oracle is Nav-I that is told a side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from helpers import circle, circles_world, one_robot, place_scenario, run_scenario, scan_at, seen, tick
from swarmscope.errors import ConfigError
from swarmscope.judging.sides import judged_by, make_advice
from swarmscope.onboard.planners import load_planner
from swarmscope.onboard.reasons import ADVANCE, DECIDE, FOLLOW
from swarmscope.onboard.sharing.message import REQUEST_BYTES, Head, encode_request
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.loop import run

TREES = [circle(-1.0, 0.3, 0.35), circle(0.6, -0.8, 0.4), circle(1.2, 0.5, 0.3), circle(-0.4, -1.6, 0.3)]
STARTS = [(-3.0, -1.5, 0.0), (-3.0, 0.0, 0.0), (-3.0, 1.5, 0.0)]
GOALS = [(3.0, 1.0), (3.0, 0.0), (3.0, -1.0)]


def trace_of(name, **params):
    planner = {"name": name, "params": params}
    return run_scenario(place_scenario(STARTS, GOALS, TREES, planner=planner, limit_s=30.0))


def test_nav_i_runs_like_nav_scope_without_weight_bit_for_bit():
    alone, weightless = trace_of("nav-i"), trace_of("nav-scope", w_i=0.0)
    assert alone.robots["arrived"].all()
    assert (alone.records.side != 0).any()
    assert alone.t_s.tobytes() == weightless.t_s.tobytes()
    assert alone.robots.tobytes() == weightless.robots.tobytes()
    assert alone.shared.tobytes() == weightless.shared.tobytes()
    for one, other in zip(alone.records, weightless.records, strict=True):
        assert one.tobytes() == other.tobytes()
    assert alone.robots["bytes"].sum() == 0
    assert trace_of("nav-scope").robots["bytes"].sum() > 0


def test_nav_i_has_nav_scopes_parameters_but_for_the_neighbours():
    ours, full = load_planner("nav-i").defaults, load_planner("nav-scope").defaults
    assert set(full) - set(ours) == {"w_i", "ask_ahead_s", "ask_every_s", "patience_s", "answers"}
    assert set(ours) <= set(full)
    assert all(full[name] == value for name, value in ours.items())
    assert load_planner("oracle").defaults == ours


@pytest.mark.parametrize("name", ["nav-i", "oracle"])
def test_what_makes_them_what_they_are_cannot_be_set(name):
    planner = load_planner(name)
    for key in ("w_i", "ask_ahead_s", "ask_every_s", "patience_s", "answers"):
        with pytest.raises(ConfigError, match=f"planner '{name}': {key}: is fixed at 0"):
            planner.params({key: 1})
    assert planner.params({"prior": 2.0}).w_i == 0.0


def robot_before(name, tree, told=0):
    """A robot without neighbours, ``tree`` (x, y, radius) before it."""
    robot = one_robot(planner=name)
    robot.fill(goal_distance=5.0)
    robot.memory["told"] = told
    robot.scan[:] = scan_at(circles_world([tree]), robot.rig)
    return robot


@pytest.mark.parametrize("name", ["nav-i", "oracle"])
def test_nobody_is_asked_or_answered(name):
    robot = robot_before(name, (1.2, 0.05, 0.3))
    robot.see([seen(1, 1.2, 0.8)])
    robot.shared["ask_n"], robot.shared["ask_id"][0] = 1, 1
    for _ in range(3):
        assert tick(robot)["n_out"] == 0
    assert robot.memory["mode"] == FOLLOW


def test_a_request_is_not_answered():
    """Packed as on the radio; Nav-SCOPE answers the same one."""
    out = np.zeros(REQUEST_BYTES, np.uint8)
    packet = out[: encode_request(Head(1, 0, 7, 0), out)].tobytes()
    for name, answers in (("nav-scope", 1), ("nav-i", 0), ("oracle", 0)):
        robot = robot_before(name, (1.2, 0.05, 0.3))
        robot.receive([packet])
        tick(robot)
        assert robot.shared["ask_n"] == 1
        assert len(robot.outbox()) == answers


@pytest.mark.parametrize("told", [1, -1])
@pytest.mark.parametrize("y", [0.15, -0.15])
def test_the_oracle_takes_the_side_it_is_told(told, y):
    decision = tick(robot_before("oracle", (1.2, y, 0.3), told))
    assert (decision["side"], decision["fused"], decision["heard"]) == (told, 1, 0)
    assert decision["p_left"] == (1.0 if told > 0 else 0.0)
    assert np.sign(decision["heading"]) == told


@pytest.mark.parametrize("y", [0.15, -0.15])
def test_the_oracle_chooses_itself_when_nobody_says(y):
    robot, other = robot_before("oracle", (1.2, y, 0.3)), robot_before("nav-i", (1.2, y, 0.3))
    chosen, own = tick(robot), tick(other)
    assert chosen["side"] == own["side"] == (1 if y < 0.0 else -1)
    assert chosen.tobytes() == own.tobytes()
    assert robot.memory.tobytes() == other.memory.tobytes()


def told_run(name, advised):
    """A run past one disc whose shorter way is on the right, the simulator knowing that or not."""
    values = place_scenario([(-3.0, 0.0, 0.0)], [(3.0, 0.0)], [circle(0.0, 0.15, 0.8)], planner={"name": name})
    scenario = parse_scenario(values, "test")
    setup = make_setup(scenario)
    setting = make_setting(scenario, setup)
    if advised:
        setting = replace(setting, advice=make_advice(setup, *judged_by(scenario, setting.rig)))
    return run(setting)


def test_nav_i_does_not_listen():
    """It is not told at all: where the simulator knows sides, which are noted, it drives as where it does not."""
    advised, alone = told_run("nav-i", True), told_run("nav-i", False)
    assert (advised.choices["told_side"] != 0).any()
    assert not alone.choices["told_side"].any()
    assert advised.robots.tobytes() == alone.robots.tobytes()
    for one, other in zip(advised.records, alone.records, strict=True):
        assert one.tobytes() == other.tobytes()


def test_the_simulator_tells_the_oracle():
    advised = told_run("oracle", True)
    told = advised.choices["told_side"] != 0
    assert told.any()
    assert (advised.choices["side"] == advised.choices["told_side"])[told].all()
    assert np.isin(advised.choices["p_left"][told], (0.0, 1.0)).all()


def test_the_oracle_changes_its_mind_at_decisions_only():
    robot = robot_before("oracle", (1.2, 0.15, 0.3), 1)
    assert tick(robot)["side"] == 1
    robot.memory["told"] = -1
    for _ in range(5):
        assert tick(robot)["side"] == 1
    robot.scan[:] = 4.0  # it is gone: what stands behind it shows
    assert tick(robot)["state"] == ADVANCE
    robot.fill(odom_x=1.0)  # far from the last obstacle: a new decision
    tick(robot)
    robot.fill(odom_x=0.0)
    robot.scan[:] = scan_at(circles_world([(1.2, 0.15, 0.3)]), robot.rig)
    decision = tick(robot)
    assert (decision["side"], decision["fused"]) == (-1, 1)
    assert decision["state"] in (DECIDE, FOLLOW)


def test_only_the_oracle_asks_the_simulator_for_the_side():
    assert load_planner("oracle").told is True
    assert load_planner("oracle").is_told
    for name in ("nav-i", "nav-scope"):
        assert not load_planner(name).told
        assert not load_planner(name).is_told
