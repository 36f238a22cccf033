"""Getting past others that move."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from helpers import one_robot, rig_of, scan_at, seen, tick, world_of
from swarmscope.onboard.deciding.evading import Evading, comes, evade, keep_right, time_to_meet
from swarmscope.sim.world import Wall

MANNER = Evading(ahead_s=3.0, apart_m=0.04, weight=3.0, slow=1.0, right=0.5, lane_s=10.0, lane_m=1.0)
STILL_S = 2.0


@pytest.mark.parametrize(
    ("x", "y", "vx", "vy", "when"),
    [
        (3.0, 0.0, -1.0, 0.0, 2.5),  # head on: 3 m less the 0.5 m apart, at 1 m/s
        (3.0, 0.3, -1.0, 0.0, 3.0 - 0.4),
        (3.0, 0.6, -1.0, 0.0, math.inf),  # passes
        (3.0, 0.0, 1.0, 0.0, math.inf),  # goes away
        (0.3, 0.0, -0.1, 0.0, 0.0),  # has come too near already
        (0.3, 0.0, 0.1, 0.0, math.inf),  # and leaves again
        (3.0, 0.0, 0.0, 0.0, math.inf),
    ],
)
def test_when_somebody_is_met(x, y, vx, vy, when):
    assert time_to_meet(x, y, vx, vy, 0.5) == pytest.approx(when)


@given(*[st.floats(-5.0, 5.0)] * 4, st.floats(0.1, 1.0))
def test_when_somebody_is_met_it_is_as_near_as_that(x, y, vx, vy, apart):
    t = time_to_meet(x, y, vx, vy, apart)
    if 0.0 < t < 1e3:
        assert math.hypot(x + t * vx, y + t * vy) == pytest.approx(apart, abs=1e-3)


def meeting(x, y, vx, vy, yaw, world=None, speed=0.5):
    """A robot that drives along x and has seen somebody for a second."""
    rig = rig_of()
    bot = one_robot(rig, "dh-bug")
    bot.scan[:] = scan_at(world, rig) if world else math.inf
    bot.fill(goal_distance=20.0, speed=speed, odom_x=0.0)
    for k in range(6):
        t = 0.2 * (k - 5)
        bot.see([seen(1, x + t * vx, y + t * vy, yaw)])
        bot.fill(speed=speed)
        tick(bot)
    return bot.view


def test_who_meets_nobody_keeps_heading_and_speed():
    view = meeting(2.0, 2.0, 0.0, 0.5, 1.57)
    assert evade(view, 0.1, 0.5, STILL_S, MANNER) == (0.1, 0.5)


def test_head_on_both_turn_to_the_right():
    view = meeting(2.0, 0.0, -0.5, 0.0, math.pi)
    heading, speed = evade(view, 0.0, 0.5, STILL_S, MANNER)
    assert -math.pi / 3 < heading < 0.0
    assert speed > 0.0


def test_without_looking_ahead_nobody_is_got_past():
    view = meeting(1.0, 0.0, -0.5, 0.0, math.pi)
    assert evade(view, 0.0, 0.5, STILL_S, MANNER._replace(ahead_s=0.0)) == (0.0, 0.5)


def test_nobody_turns_into_a_wall():
    walls = world_of(Wall(points=[(-3, 0.3), (5, 0.3)]), Wall(points=[(-3, -0.3), (5, -0.3)]))
    view = meeting(2.0, 0.0, -0.5, 0.0, math.pi, walls)
    heading, speed = evade(view, 0.0, 0.5, STILL_S, MANNER)
    assert abs(heading) < 0.3 or speed == 0.0


@pytest.mark.parametrize(
    ("x", "y", "vx", "comes_towards"),
    [(3.0, 0.2, -0.5, True), (3.0, 0.2, 0.5, False), (-3.0, 0.2, -0.5, False), (3.0, 2.0, -0.5, False)],
)
def test_who_comes_towards_us(x, y, vx, comes_towards):
    view = meeting(x, y, vx, 0.0, math.pi if vx < 0 else 0.0)
    assert comes(view, 0.0, STILL_S, 5.0) == comes_towards


@pytest.mark.parametrize(
    ("left", "right", "turns"), [(0.75, 0.75, -1), (1.125, 0.375, 0), (1.2, 0.2, 1), (2.0, 2.0, 0), (0.3, 0.3, 0)]
)
def test_a_place_for_two_is_gone_through_on_the_right(left, right, turns):
    world = world_of(Wall(points=[(-3, left), (5, left)]), Wall(points=[(-3, -right), (5, -right)]))
    view = meeting(4.0, 0.0, -0.5, 0.0, math.pi, world)
    heading = keep_right(view, 0.0)
    assert abs(heading) < 0.7
    assert heading * turns > 0.0 or (turns == 0 and abs(heading) < 0.01)
