"""Places on the front of a body of limited view that nobody has seen free."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import make_sensor, one_robot, rig_of
from swarmscope.onboard.control.unseen import out_of_sight
from swarmscope.onboard.control.way import way_of
from swarmscope.onboard.perception.frames import look_back
from swarmscope.onboard.sensor import all_round

NEED = 0.2
"""Of a body with a radius of 0.15 m."""


def robot_that_has_seen(*yaws, view=90):
    """A robot with a view [degrees] and a kept scan for each yaw [degrees], open up to 3 m."""
    rig = rig_of(sensor=all_round(make_sensor(view + 1, math.radians(view))))
    rows = one_robot(rig=rig)
    rows.view.scan[:] = np.inf
    look_back(rows.view)
    frames = rows.view.frames
    rows.view.shared["frames_n"] = len(yaws)
    for k, yaw in enumerate(yaws):
        frames.scans[k] = 3.0
        frames.poses[k] = (0.0, 0.0, math.radians(yaw), 0.0, 0.0)
    return rows


def remember(rows, bearing_deg, s):
    """Something is known at a range [m], out of view."""
    sensor = rows.rig.sensor
    n, half = round((math.radians(bearing_deg) - sensor.angle_min) / sensor.increment), (sensor.field - 1) // 2
    rows.view.scan[n] = s
    for k in range(rows.view.shared["frames_n"]):
        seen = math.degrees(math.radians(bearing_deg) - rows.view.frames.poses[k, 2])
        if abs(seen) <= half:
            rows.view.frames.scans[k, round(half + seen)] = s


def unseen(rows, v=0.5):
    return out_of_sight(rows.view, way_of(v, v, 0.0, 0.0, rows.view), NEED)


def test_who_has_looked_all_round_is_held_by_nothing():
    assert unseen(robot_that_has_seen(-80, 0, 80)) == (0.0, 0.0)


def test_who_has_not_looked_to_the_left_is_held_by_a_place_there():
    x, y = unseen(robot_that_has_seen(-80, 0))
    assert y > 0.1
    assert 0.0 < x < 0.3


@pytest.mark.parametrize("s", [0.05, 0.1, 0.16])
def test_something_remembered_too_near_does_not_open_the_rest_of_the_front(s):
    """It may even seem to lie within the body."""
    rows = robot_that_has_seen(-80, 0)
    remember(rows, -90.0, s)
    assert unseen(rows)[1] > 0.1


def test_a_thing_beside_the_way_that_is_nearer_than_wanted_holds_nobody_by_what_it_hides():
    rows = robot_that_has_seen(-80, 0, 80)
    for bearing in range(70, 111):
        remember(rows, bearing, 0.18 / math.sin(math.radians(bearing)))  # a wall along the way
    assert unseen(rows) == (0.0, 0.0)


def test_but_where_the_body_itself_would_get_to_a_hidden_place_it_is_held():
    rows = robot_that_has_seen(-100, -50, 0, 50, 100, view=60)
    assert unseen(rows) == (0.0, 0.0)
    for bearing in range(35, 48):
        remember(rows, bearing, 0.18)
    assert unseen(rows) != (0.0, 0.0)
