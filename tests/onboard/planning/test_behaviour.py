"""Whole runs in tiny worlds: what a person would expect of the robots there."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import circle, place_scenario, run_scenario, wall

ROOM = wall((-4, 4), (4, 4), (4, -4), (-4, -4), (-4, 4))


def door(width):
    """A room of 8 m x 8 m, divided at x = 0 but for a door in the middle."""
    return [wall((0, width / 2), (0, 4)), wall((0, -width / 2), (0, -4)), ROOM]


def tube(width, length=5.0):
    return [wall((-length, y), (length, y)) for y in (-0.5 * width, 0.5 * width)]


def u_trap(depth, half_width):
    """A trap that opens to the left and ends at x = 0."""
    return [wall((-depth, -half_width), (0, -half_width), (0, half_width), (-depth, half_width))]


def arrive(starts, goals, obstacles=(), stretch=math.inf, **more):
    """Run; everybody must arrive unharmed on a way at most ``stretch`` times the straight line."""
    trace = run_scenario(place_scenario(starts, goals, obstacles, **more))
    robots = trace.robots
    assert not robots["crashed"].any()
    assert robots["arrived"].all(), f"{robots['goal_x'] - robots['x']}, {robots['goal_y'] - robots['y']}"
    assert robots["min_clearance"].min() > 0.0
    straight = np.hypot(*(np.asarray(goals) - np.asarray(starts)[:, :2]).T)
    assert (robots["length"] <= stretch * np.maximum(straight, 0.2)).all(), robots["length"]
    return trace


def test_nothing_in_the_way_is_a_straight_line():
    trace = arrive([(-4, 0, 0)], [(4, 1)])
    assert float(trace.robots[0]["length"]) == pytest.approx(math.hypot(8, 1), rel=2e-3)
    assert float(trace.robots[0]["arrival_s"]) == pytest.approx(math.hypot(8, 1) / 0.5, abs=1.5)


def test_a_goal_behind_its_back():
    trace = arrive([(0, 0, 0)], [(-3, 0)])
    assert float(trace.robots[0]["length"]) == pytest.approx(3.0, rel=0.02)


@pytest.mark.parametrize("offset", [0.0, 0.05, 0.2])
def test_two_robots_head_on(offset):
    arrive([(-3, offset, 0), (3, -offset, math.pi)], [(3, offset), (-3, -offset)], stretch=1.25)


def test_four_robots_cross():
    starts = [(-3, 0, 0), (3, 0, math.pi), (0, -3, 1.57), (0, 3, -1.57)]
    arrive(starts, [(3, 0), (-3, 0), (0, 3), (0, -3)], stretch=1.5)


@pytest.mark.parametrize("robots", [2, 8])
def test_robots_change_places_across_a_ring(robots):
    trace = run_scenario({"task": {"name": "swap"}, "robots": robots, "limit_s": 200.0, "record_scans": "no"})
    assert trace.robots["arrived"].all()
    assert not trace.robots["crashed"].any()


@pytest.mark.parametrize(("depth", "half_width"), [(0.8, 1.2), (2.5, 0.8), (2.5, 1.5)])
def test_out_of_a_dead_end(depth, half_width):
    arrive([(-1.5 if depth > 1.0 else -3.0, 0.1, 0)], [(3, 0)], u_trap(depth, half_width))


def test_round_a_long_wall_on_either_side():
    arrive([(-3, 0, 0)], [(3, 0)], [wall((0, -6), (0, 5))], stretch=4.0)
    arrive([(-3, -3, 0)], [(3, -3)], [wall((0, -9.9), (0, 5))], stretch=5.0)


def test_a_goal_close_behind_a_tree():
    arrive([(-3, 0, 0)], [(0.45, 0)], [circle(0, 0, 0.27)], stretch=1.6)


def test_a_goal_close_before_a_tree():
    arrive([(-3, 0, 0)], [(0, 0)], [circle(0.43, 0, 0.25)])


def test_a_goal_close_to_a_wall():
    arrive([(-3, 0, 0)], [(0, 0)], [wall((0.19, -2), (0.19, 2))])


@pytest.mark.parametrize("goal", [(0.0, 0.0), (-0.6, 0.0)])
def test_a_goal_behind_a_robot_that_has_arrived(goal):
    arrive([(-1, 0, 0), (-4, 0, 0)], [(-1, 0), goal], stretch=1.4)


@pytest.mark.parametrize("width", [0.5, 0.8, 1.2])
def test_two_robots_want_through_the_same_door(width):
    arrive([(-2, 0.2, 0), (2, -0.2, math.pi)], [(2, 0.2), (-2, -0.2)], door(width))


def test_a_standing_robot_in_a_corridor_is_passed():
    arrive([(0, 0.3, 0), (-4, 0, 0)], [(0, 0.3), (4, 0)], tube(1.2), stretch=1.2)
    arrive([(0, 0, 0), (-4, 0, 0)], [(0, 0), (4, 0)], tube(1.6), stretch=1.2)


PARKED = [(0, 0, 0), (-3, 0.5, 0)], [(0, 0), (3, 0)]
"""Robot 0 stands at its goal in the door through which robot 1 has to go."""


def test_who_cannot_pass_a_door_in_which_another_has_parked_touches_nobody():
    trace = run_scenario(place_scenario(*PARKED, door(0.7)))
    assert trace.robots["arrived"].tolist() == [1, 0]
    assert not trace.robots["crashed"].any()


def test_a_door_in_which_another_has_parked_is_left_for_a_second_one():
    """0.7 m wide, 2 m beside it."""
    second = [wall((0, 0.35), (0, 4)), wall((0, -0.35), (0, -1.7)), wall((0, -2.4), (0, -4)), ROOM]
    arrive(*PARKED, second)


def test_two_robots_head_on_in_a_corridor():
    arrive([(-3, 0, 0), (3, 0, math.pi)], [(3, 0), (-3, 0)], tube(1.2), stretch=1.5)


@pytest.mark.parametrize("obstacle", [wall((-3, 0.17), (2, 0.17)), wall((0.17, -1), (0.17, 1)), circle(0.46, 0.1, 0.3)])
def test_a_start_closer_than_the_margin_to_something(obstacle):
    arrive([(0, 0, 0)], [(3, 0)], [obstacle], stretch=2.5)


@pytest.mark.parametrize("width", [0.47, 0.52])
def test_a_narrow_gap_is_passed(width):
    arrive([(-2, 0.3, 0)], [(2, 0)], door(width), stretch=1.2)


@pytest.mark.parametrize("fov_deg", [120, 180, 270])
def test_a_limited_field_of_view(fov_deg):
    trees = [circle(-1, 0.1, 0.3), circle(1, -0.2, 0.4)]
    arrive([(-4, 0, 0)], [(4, 0)], trees, 1.3, lidar={"fov_deg": float(fov_deg), "beams": fov_deg + 1})


def test_a_robot_that_never_moves_again_is_passed():
    """A standing robot beside a tree is one obstacle with it."""
    arrive([(0, 0, 0), (-4, 0, 0)], [(0, 0), (4, 0)], [circle(0, 0.6, 0.2)], stretch=1.2)


def test_a_goal_that_nobody_can_reach_in_time_is_left_unreached_safely():
    trace = run_scenario(place_scenario([(-3, 0, 0)], [(3, 0)], [wall((0, -9.9), (0, 9.9))], limit_s=10.0))
    assert not trace.robots["arrived"].any()
    assert not trace.robots["crashed"].any()
