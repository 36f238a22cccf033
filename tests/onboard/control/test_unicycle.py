"""From a heading to a speed and a turn rate."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from helpers import DT
from swarmscope.onboard.control.unicycle import (
    FULL_SPEED_WITHIN,
    TURN_IN_PLACE_BEYOND,
    arrival_speed,
    steer,
)


@given(st.floats(-10.0, 10.0), st.floats(0.0, 2.0), st.floats(0.1, 5.0))
def test_commands_stay_within_limits_and_turn_the_right_way(heading, speed, w_max):
    v, w = steer(heading, speed, w_max, DT)
    error = math.remainder(heading, 2.0 * math.pi)
    assert 0.0 <= v <= speed
    assert abs(w) <= w_max
    if abs(error) > 1e-6 and math.pi - abs(error) > 1e-6:
        assert w * error > 0.0
        assert abs(w * DT) <= abs(error) + 1e-9


@given(st.floats(-3.1, 3.1), st.floats(0.0, 2.0))
def test_left_and_right_are_alike(heading, speed):
    v, w = steer(heading, speed, 2.0, DT)
    assert steer(-heading, speed, 2.0, DT) == pytest.approx((v, -w))


@given(st.floats(-0.4, 0.4))
def test_a_small_error_is_gone_at_the_next_tick(heading):
    assert steer(heading, 0.5, 2.0, DT)[1] * DT == pytest.approx(heading)


def test_speed_falls_linearly_between_the_two_errors():
    assert steer(0.99 * FULL_SPEED_WITHIN, 0.5, 2.0, DT)[0] == 0.5
    middle = 0.5 * (FULL_SPEED_WITHIN + TURN_IN_PLACE_BEYOND)
    assert steer(middle, 0.5, 2.0, DT)[0] == pytest.approx(0.25)
    assert steer(1.01 * TURN_IN_PLACE_BEYOND, 0.5, 2.0, DT)[0] == 0.0
    assert steer(math.pi, 0.5, 2.0, DT)[0] == 0.0


@given(st.floats(0.0, 10.0), st.floats(0.1, 2.0), st.floats(0.2, 5.0))
def test_from_the_arrival_speed_one_more_tick_and_braking_ends_at_the_goal(distance, v_max, a_max):
    v = arrival_speed(distance, v_max, a_max, DT)
    assert 0.0 <= v <= v_max
    assert v * DT + v * v / (2.0 * a_max) <= distance + 1e-9
    if v < v_max:
        assert v * DT + v * v / (2.0 * a_max) == pytest.approx(distance, abs=1e-9)


def test_behind_the_goal_nothing_is_driven():
    assert arrival_speed(-0.1, 0.5, 2.0, DT) == 0.0
