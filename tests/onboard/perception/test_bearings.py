"""Heading and way to the goal, steadied by odometry: a tenth of what is measured enters in a tick."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import one_robot
from swarmscope.onboard.perception.bearings import GAIN, JUMP_M, JUMP_RAD, steady
from swarmscope.onboard.sharing.tracks import update_odometry


class Robot:
    """A robot that is told a heading and a goal, and how it has moved since."""

    def __init__(self, compass=0.0, goal=(4.0, 0.0)):
        self.rows = one_robot()
        self.tell(compass, goal)

    def tell(self, compass, goal, moved=(0.0, 0.0, 0.0)):
        """Goal (x, y) in the body frame [m]; return what it makes of heading, bearing and distance."""
        rows = self.rows
        rows.fill(compass=compass, goal_bearing=math.atan2(goal[1], goal[0]), goal_distance=math.hypot(*goal))
        rows.fill(odom_x=moved[0], odom_y=moved[1], odom_yaw=moved[2])
        steady(rows.percept, rows.shared)
        update_odometry(rows.percept, rows.shared)
        return tuple(float(rows.percept[name]) for name in ("compass", "goal_bearing", "goal_distance"))


def test_the_first_tick_is_believed():
    robot = Robot(0.7, (0.0, 3.0))
    assert float(robot.rows.percept["compass"]) == 0.7
    assert (robot.rows.shared["goal_x"], robot.rows.shared["goal_y"]) == pytest.approx((0.0, 3.0))


def test_a_compass_that_errs_enters_by_a_tenth():
    robot = Robot(0.0)
    assert robot.tell(0.2, (4.0, 0.0))[0] == pytest.approx(0.02)
    assert robot.tell(0.2, (4.0, 0.0))[0] == pytest.approx(0.02 + 0.1 * 0.18)
    assert robot.tell(0.038, (4.0, 0.0))[0] == 0.038  # what agrees is taken as measured


def test_a_goal_that_errs_enters_by_a_tenth():
    """Predicted 4 m ahead, measured at (4, 1): believed to be at (4, 0.1)."""
    _, bearing, distance = Robot().tell(0.0, (4.0, 1.0))
    assert bearing == pytest.approx(math.atan2(0.1, 4.0))
    assert distance == pytest.approx(math.hypot(4.0, 0.1))


def test_goal_and_heading_are_predicted_by_odometry():
    """It drives 1 m ahead, then turns left by a right angle: the goal is 3 m to the right."""
    robot = Robot()
    moved = (1.0, 0.0, 0.5 * math.pi)
    found = robot.tell(0.5 * math.pi + 0.3, (0.0, -3.0 + 0.5), moved)
    assert found == pytest.approx((0.5 * math.pi + 0.03, -0.5 * math.pi, 3.0 - 0.05))


def test_the_goal_does_not_err_with_the_compass():
    _, bearing, distance = Robot().tell(0.3, (4.0, 0.0))
    assert (bearing, distance) == (0.0, 4.0)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_past_half_a_turn_the_shorter_way_is_mixed(side):
    robot = Robot(side * (math.pi - 0.05))
    compass, _, _ = robot.tell(side * (-math.pi + 0.05), (4.0, 0.0))
    assert compass == pytest.approx(side * (math.pi - 0.04))


@pytest.mark.parametrize(("off", "found"), [(JUMP_RAD - 0.01, GAIN * (JUMP_RAD - 0.01)), (JUMP_RAD + 0.01, 0.81)])
def test_a_compass_that_was_set_anew_is_believed_at_once(off, found):
    assert Robot().tell(off, (4.0, 0.0))[0] == pytest.approx(found)


@pytest.mark.parametrize("beyond", [-0.01, 0.01])
def test_another_goal_is_believed_at_once(beyond):
    """A goal measured 2 m away is new when it is more than JUMP_M + 2 JUMP_RAD from where it was."""
    far = JUMP_M + 2.0 * JUMP_RAD + beyond
    robot = Robot(goal=(2.0 - far, 0.0))
    _, bearing, distance = robot.tell(0.0, (2.0, 0.0))
    if beyond > 0.0:
        assert (bearing, distance) == (0.0, 2.0)
    else:
        assert (abs(bearing), distance) == pytest.approx((math.pi, far - 2.0 - GAIN * far))


def test_without_errors_nothing_changes():
    """A robot on a circle: what is measured agrees with odometry, but for rounding, and is left as it is."""
    rng = np.random.default_rng(0)
    robot, x, y, yaw = Robot(0.0, (4.0, 1.0)), 0.0, 0.0, 0.0
    for _ in range(200):
        step, turn = rng.uniform(0.0, 0.1), rng.uniform(-0.4, 0.4)
        x, y, yaw = x + step * math.cos(yaw), y + step * math.sin(yaw), yaw + turn
        compass = math.remainder(yaw, 2.0 * math.pi)
        gx, gy = 4.0 - x, 1.0 - y
        goal = math.cos(yaw) * gx + math.sin(yaw) * gy, math.cos(yaw) * gy - math.sin(yaw) * gx
        found = robot.tell(compass, goal, (step, 0.0, turn))
        assert found == (compass, math.atan2(goal[1], goal[0]), math.hypot(*goal))


def test_ten_degrees_of_jitter_become_a_quarter():
    """The filter leaves sqrt(GAIN / (2 - GAIN)) = 0.23 of independent errors."""
    rng = np.random.default_rng(1)
    robot, found = Robot(), []
    for _ in range(4000):
        found.append(robot.tell(float(rng.normal(0.0, math.radians(10.0))), (4.0, 0.0))[0])
    assert np.degrees(np.std(found[100:])) == pytest.approx(2.29, abs=0.25)
