"""What the guard once let through: numbers that are none beside a wall or a neighbour, fast bodies, short ranges."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import DT, make_sensor, one_robot, rig_of
from swarmscope.onboard.body import Body
from swarmscope.onboard.control.guard import guard

ANGLES = -math.pi + math.pi / 180.0 * np.arange(360)
FREE = np.full(360, np.inf, np.float32)
WALL = np.where(np.abs(ANGLES) < 1.0, 0.175 / np.maximum(np.cos(ANGLES), 0.1), np.inf).astype(np.float32)
"""2.5 cm ahead of a body of 15 cm."""
NO_NUMBERS = [
    {"speed": math.nan}, {"speed": math.inf}, {"speed": -math.inf},
    {"dt_s": math.nan}, {"dt_s": 0.0}, {"dt_s": -1.0}, {"dt_s": math.inf}, {"dt_s": -0.2},
    {"compass": math.nan}, {"compass": math.inf},
]  # fmt: skip
FAST = [(0.5, 2.0), (1.0, 0.5), (2.0, 0.5), (2.0, 1.0), (2.0, 2.0)]
"""Top speed [m/s], acceleration [m/s^2]."""
NEEDED_M = 1e-3


def allowed(scan, rows=None, v=0.5, w=0.0, **percept):
    """What the guard makes of a command."""
    rows = rows or one_robot()
    rows.scan[:] = scan
    rows.fill(**percept)
    rows.decision["v"], rows.decision["w"] = v, w
    guard(rows.view)
    return rows.said("v"), rows.said("w")


def with_track(x, y=0.0, rig=None):
    """A robot with a neighbour in its tracks only: no return shows it."""
    rows = one_robot(rig)
    rows.shared["track_id"][0] = 2
    rows.shared["track_x"][0], rows.shared["track_y"][0] = x, y
    rows.shared["track_radius"][0] = rows.rig.body.radius_m
    return rows


def way_of(v, a_max):
    """From standing still: to the next tick, and braking after it [m]."""
    reached = min(v, a_max * DT)
    return v * DT, reached * reached / (2.0 * a_max)


def test_a_wall_just_ahead_is_not_driven_into():
    v, _ = allowed(WALL)
    assert sum(way_of(v, 2.0)) <= 0.005 + NEEDED_M


@pytest.mark.parametrize("numbers", NO_NUMBERS, ids=str)
def test_a_wall_just_ahead_and_a_number_that_is_none(numbers):
    assert allowed(WALL, **numbers) == (0.0, 0.0)


def test_a_wall_just_ahead_and_a_speed_backwards():
    v, _ = allowed(WALL, speed=-3.0)
    assert sum(way_of(v, 2.0)) <= 0.005 + NEEDED_M


def test_a_neighbour_that_only_the_positioning_knows_is_not_driven_into():
    v, _ = allowed(FREE, with_track(0.32))
    assert sum(way_of(v, 2.0)) <= NEEDED_M


@pytest.mark.parametrize("numbers", NO_NUMBERS, ids=str)
def test_a_neighbour_that_only_the_positioning_knows_and_a_number_that_is_none(numbers):
    assert allowed(FREE, with_track(0.32), **numbers) == (0.0, 0.0)


@pytest.mark.parametrize("x", [math.nan, math.inf])
def test_a_neighbour_at_a_place_that_is_none_leaves_numbers(x):
    v, w = allowed(FREE, with_track(x))
    assert 0.0 <= v <= 0.5 and w == 0.0


def test_a_neighbour_in_the_same_place_is_not_driven_through():
    assert allowed(FREE, with_track(0.0))[0] == 0.0


@pytest.mark.parametrize("command", [{"w": math.nan}, {"v": math.nan}, {"v": math.inf}], ids=str)
def test_a_wall_just_ahead_and_a_command_that_is_none(command):
    assert allowed(WALL, **command) == (0.0, 0.0)


def test_a_huge_command_in_the_open_is_the_most_that_the_body_does():
    assert allowed(FREE, v=1e300, w=-1e300) == (0.5, -2.0)


@pytest.mark.parametrize("distance", [1.0, 1.5, 1.7, 1.76, 2.0, 3.0, 5.0, 8.0, 12.0])
@pytest.mark.parametrize(("v_max", "a_max"), FAST)
def test_a_fast_robot_leaves_a_neighbour_its_half_at_any_distance(v_max, a_max, distance):
    """At full speed towards it. Once nothing beyond 1.6 m counted, whatever the way to stop."""
    rig = rig_of(Body(v_max_mps=v_max, a_max_mps2=a_max))
    v, _ = allowed(FREE, with_track(distance, rig=rig), v=v_max, speed=v_max)
    open_v, _ = allowed(FREE, one_robot(rig), v=v_max, speed=v_max)
    needed = 2.0 * (v_max * DT + v_max * v_max / a_max) + 0.32
    assert v <= open_v
    if distance < needed - NEEDED_M and v > 0.0:
        assert v < v_max
        slower = 0.5 * (v_max + max(v, v_max - a_max * DT))
        left = max(v, v_max - a_max * DT)
        assert slower * DT + left * left / a_max <= 0.5 * (distance - 0.32) + 0.02
    if distance >= needed + 0.1:
        assert v == open_v


@pytest.mark.parametrize(
    ("v_max", "a_max", "range_m"),
    [(2.0, 1.0, 2.0), (1.0, 0.25, 2.0), (0.5, 0.1, 0.5), (0.5, 0.05, 1.0), (2.0, 0.5, 3.0)],
)
def test_an_open_scan_of_a_short_range_allows_what_stops_within_it(v_max, a_max, range_m):
    rig = rig_of(Body(v_max_mps=v_max, a_max_mps2=a_max), make_sensor(range_max=range_m))
    v, _ = allowed(FREE, one_robot(rig), v=v_max, speed=v_max)
    assert v * DT + v * v / (2.0 * a_max) <= range_m - 0.15 - 0.02 + NEEDED_M
    assert v < v_max
