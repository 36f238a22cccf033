"""ORCA through its library: what it does in tiny worlds, what it is given, and what happens without it."""

from __future__ import annotations

import math
import sys
import threading

import numpy as np
import pytest

from helpers import circle, circles_world, one_robot, place_scenario, rig_of, run_scenario, scan_at, seen, tick, wall
from swarmscope.errors import MissingExtraError
from swarmscope.geometry import point_segment_distance
from swarmscope.onboard.perception.segments import LINE_ERROR, MAX_LINES
from swarmscope.onboard.planners import planner_names
from swarmscope.onboard.planning import orca
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.loop import run

pytest.importorskip("navground.core", reason="the library of the extra 'orca' is not installed")

U_TRAP = [wall((-2, -1.5), (1, -1.5), (1, 1.5), (-2, 1.5))]


def drive(starts, goals, obstacles=(), threads=1, **params):
    planner = {"name": "orca", "params": params}
    return run_scenario(place_scenario(starts, goals, obstacles, planner=planner), threads)


def play_task(name, seed=1000, **more):
    scenario = parse_scenario({"task": {"name": name}, "seed": seed, "planner": {"name": "orca"}} | more, "test")
    return run(make_setting(scenario, make_setup(scenario)))


def assert_all_arrive(trace):
    robots = trace.robots
    assert not robots["crashed"].any()
    assert robots["arrived"].all(), robots[["x", "y", "goal_x", "goal_y"]]
    assert robots["min_clearance"].min() > 0.0


def robot_at(ranges, goal=(5.0, 0.0), **params):
    """One robot that has made a step in front of what ``ranges`` shows."""
    robot = one_robot(planner="orca", **params)
    robot.scan[:] = ranges
    robot.fill(goal_bearing=goal[1], goal_distance=goal[0])
    tick(robot)
    return robot


def lines_of(robot):
    return robot.memory["lines"][: robot.memory["lines_n"]].astype(float)


def test_two_robots_head_on_pass_each_other():
    trace = drive([(-3, 0, 0), (3, 0, math.pi)], [(3, 0), (-3, 0)])
    assert_all_arrive(trace)
    assert (trace.robots["length"] < 1.1 * 6.0).all()


def test_a_robot_gives_way_by_half_of_what_is_needed():
    robot = robot_at(np.full(360, np.inf))
    for k in range(4):  # somebody comes towards us, a little to the left
        robot.see([seen(7, 2.2 - 0.1 * k, 0.05, math.pi)])
        tick(robot)
    assert robot.memory["others_n"] == 1
    assert robot.memory["others"][0, 1, 0] == pytest.approx(-0.5, abs=0.05)
    assert robot.said("heading") < -0.02


def test_a_disc_in_the_way_is_passed():
    trace = drive([(-3, 0, 0)], [(3, 0)], [circle(0.0, 0.1, 0.5)])
    assert_all_arrive(trace)
    assert trace.robots["length"][0] < 1.2 * 6.0


def test_six_robots_change_places():
    assert_all_arrive(play_task("swap", robots=6))


def test_a_light_forest_is_crossed_without_contact():
    assert_all_arrive(play_task("T1", robots=6, task={"name": "T1", "options": {"density": 0.05}}))


def test_a_dead_end_needs_the_rule_above_orca():
    assert_all_arrive(drive([(-3, 0.1, 0)], [(3, 0)], U_TRAP))
    stands = drive([(-3, 0.1, 0)], [(3, 0)], U_TRAP, deadlock=0.0)
    assert not stands.robots["arrived"][0]
    assert not stands.robots["crashed"][0]
    assert stands.robots["x"][0] < 1.0


def test_the_way_through_a_door_that_just_fits():
    door = [wall((0, 0.25), (0, 4)), wall((0, -0.25), (0, -4))]
    trace = drive([(-3, 0, 0)], [(3, 0)], door)
    assert_all_arrive(trace)
    assert trace.robots["length"][0] < 1.1 * 6.0


@pytest.mark.parametrize("trees", [[(0.9, 0.1, 0.3)], [(0.8, 0.3, 0.2), (0.7, -0.5, 0.25), (-0.6, 0.2, 0.3)]])
def test_every_return_in_reach_lies_on_a_segment(trees):
    robot = robot_at(scan_at(circles_world(trees), rig_of()))
    assert 0 < len(lines_of(robot)) <= MAX_LINES
    ranges, rig = robot.scan, robot.rig
    reach = rig.body.v_max_mps * robot.params.obstacle_horizon_s + rig.body.radius_m + robot.params.margin
    near = [n for n in range(360) if ranges[n] < reach]
    assert near
    for n in near:
        x, y = float(ranges[n] * rig.cos[n]), float(ranges[n] * rig.sin[n])
        away = min(point_segment_distance(x, y, *a, *b) for a, b in lines_of(robot))
        assert away <= LINE_ERROR + 1e-5


@pytest.mark.parametrize(("gap", "closed"), [(0.3, True), (0.45, False)])
def test_a_gap_too_narrow_for_the_body_is_closed(gap, closed):
    half = 0.5 * gap + 0.2
    robot = robot_at(scan_at(circles_world([(0.6, half, 0.2), (0.6, -half, 0.2)]), rig_of()))
    crossing = [a[1] * b[1] < 0.0 for a, b in lines_of(robot)]
    assert any(crossing) == closed


def test_a_crowded_scan_is_made_coarser_until_it_fits():
    ranges = np.full(360, 0.54, np.float32)
    ranges[::2] = 0.5
    robot = robot_at(ranges)
    assert 6 < len(lines_of(robot)) <= MAX_LINES
    assert robot.said("v") < 0.5


def test_a_scan_of_nothing_but_single_returns_fits_too():
    """Range errors tear returns apart; no coarser error joins them."""
    ranges = np.full(360, np.inf, np.float32)
    ranges[::3] = np.where(np.arange(120) % 2, 0.6, 1.4)
    robot = robot_at(ranges)
    assert 0 < len(lines_of(robot)) <= MAX_LINES


def test_the_same_bytes_every_time_with_any_number_of_threads():
    starts = [(-3, 0.2, 0), (3, 0, math.pi), (0, -3, 1.57)]
    goals = [(3, 0.2), (-3, 0), (0, 3)]
    one, same, many = (drive(starts, goals, [circle(0.2, 0.3, 0.4)], threads=n) for n in (1, 1, 3))
    for other in (same, many):
        assert one.robots.tobytes() == other.robots.tobytes()
        assert all(a.tobytes() == b.tobytes() for a, b in zip(one.records, other.records, strict=True))


def test_without_the_library_it_is_listed_but_not_run(monkeypatch):
    monkeypatch.setitem(sys.modules, "navground", None)
    monkeypatch.setitem(sys.modules, "navground.core", None)
    monkeypatch.setattr(orca, "_local", threading.local())
    assert "orca" in planner_names()
    with pytest.raises(MissingExtraError, match=r"planner 'orca' .* 'swarmscope\[orca\]'"):
        drive([(0, 0, 0)], [(1, 0)])
