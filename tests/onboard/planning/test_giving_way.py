"""Who waits before a narrow place, where, and how long."""

from __future__ import annotations

import math

import pytest
from drawn_rooms import door_map
from test_evading import STILL_S, meeting

from helpers import one_robot, rig_of, run_scenario, seen, tick
from swarmscope.onboard.deciding.giving_way import (
    BEFORE_M,
    LANE_M,
    SIDE_M,
    Narrow,
    comes_through,
    has_room_aside,
    narrow_ahead,
    where_to_wait,
)
from swarmscope.onboard.mapping.words import Spot
from swarmscope.onboard.planning.atlas import R_GIVES_WAY

CELL = 0.0625


@pytest.mark.parametrize(("wide", "narrow"), [(0.6, True), (1.0, True), (1.6, False)])
def test_a_door_is_narrow_and_a_wide_opening_is_not(wide, narrow):
    memory = door_map(2.0, wide)  # in a wall 2 m ahead
    found = narrow_ahead(memory, Spot(0.0, 0.0), CELL, 1.0)
    if not narrow:
        assert found.far_m < 0.0
        return
    assert found.far_m == pytest.approx(2.0, abs=0.3)
    assert (found.x, found.y) == pytest.approx((found.far_m, 0.0), abs=1e-6)
    assert (found.dx, found.dy) == pytest.approx((1.0, 0.0))


def test_a_door_that_the_way_leads_past_does_not_count():
    memory = door_map(2.0, 1.0)
    memory["way_u"][0], memory["way_v"][0] = 0.0, 40.0
    assert narrow_ahead(memory, Spot(0.0, 0.0), CELL, 1.0).far_m < 0.0
    memory["way_u"][0], memory["way_v"][0] = 80.0, 0.0
    assert narrow_ahead(memory, Spot(-20.0, 0.0), CELL, 1.0).far_m < 0.0  # too far yet
    assert narrow_ahead(memory, Spot(-20.0, 0.0), CELL, 2.0).far_m > 2.5  # not for a robot twice as large


def test_there_is_room_aside_in_a_room_and_none_in_a_corridor():
    place = Narrow(1.0, 0.0, 1.0, 0.0, 1.0)
    assert has_room_aside(door_map(2.0, 1.0), Spot(0.0, 0.0), place, SIDE_M / CELL)
    assert not has_room_aside(door_map(2.0, 1.0, corridor=1.2), Spot(0.0, 0.0), place, SIDE_M / CELL)


@pytest.mark.parametrize(
    ("x", "y", "vx", "comes"),
    [
        (1.5, 0.0, -0.4, True),
        (1.5, 0.0, 0.4, False),  # goes through before us
        (1.5, 0.0, 0.0, False),
        (1.5, 1.2, -0.4, False),  # beside the door
        (2.6, 0.0, -0.4, False),  # not in it yet
        (0.9, 0.0, -0.4, False),  # out of it
    ],
)
def test_who_comes_through(x, y, vx, comes):
    view = meeting(x, y, vx, 0.0, math.pi)
    assert comes_through(view, Narrow(1.5, 0.0, 1.0, 0.0, 1.5), STILL_S) == comes


@pytest.mark.parametrize(("yaw", "comes"), [(math.pi, True), (0.5 * math.pi, False), (0.0, False)])
def test_who_stands_in_it_and_faces_us_wants_to_come_through(yaw, comes):
    """Until it has stood for so long that it has parked."""
    rig = rig_of()
    bot = one_robot(rig, "dh-bug")
    bot.scan[:] = math.inf
    bot.fill(goal_distance=20.0)
    place, said = Narrow(1.5, 0.0, 1.0, 0.0, 1.5), []
    for _ in range(200):
        bot.see([seen(1, 1.5, 0.0, yaw)])
        tick(bot)
        said.append(comes_through(bot.view, place, STILL_S))
    assert said[20] == comes
    assert not said[-1]


@pytest.mark.parametrize(
    ("place", "where"),
    [
        (Narrow(1.5, 0.0, 1.0, 0.0, 1.5), (0.0, -LANE_M)),  # in the others' way: to the right
        (Narrow(0.4, 0.0, 1.0, 0.0, 0.4), (0.4 - BEFORE_M, -LANE_M)),  # too near: back as well
        (Narrow(0.0, 1.5, 0.0, 1.0, 1.5), (LANE_M, 0.0)),  # the right of a way to the left is ahead
        (Narrow(1.5, 0.7, 1.0, 0.0, 1.6), (0.0, 0.0)),  # well on the right already
        (Narrow(1.5, -0.8, 1.0, 0.0, 1.7), (0.0, 0.0)),  # or on the left
        (Narrow(1.0, 1.0, -1.0, 0.0, 3.0), (0.0, 0.0)),  # round a bend, behind a wall
    ],
)
def test_where_one_waits(place, where):
    assert where_to_wait(place, 1.0) == pytest.approx(where, abs=1e-9)


def crossing(seed, **params):
    planner = {"name": "atlas", "params": params}
    values = {"task": {"name": "doorway"}, "seed": seed, "limit_s": 240.0, "record_scans": "no", "planner": planner}
    trace = run_scenario(values)
    assert not trace.robots["crashed"].any()
    assert trace.robots["arrived"].all()
    return trace


def test_fifteen_at_a_door_arrive_sooner_over_shorter_ways_when_some_wait():
    seeds = range(1001, 1005)
    waits, never = [crossing(seed) for seed in seeds], [crossing(seed, give_s=0.0) for seed in seeds]
    assert all((trace.records.reason == R_GIVES_WAY).any() for trace in waits)
    assert not any((trace.records.reason == R_GIVES_WAY).any() for trace in never)
    for value, share in (("arrival_s", 0.9), ("length", 0.95)):
        sums = [sum(float(trace.robots[value].sum()) for trace in part) for part in (waits, never)]
        assert sums[0] < share * sums[1]


def test_nobody_waits_longer_than_was_said():
    reasons = crossing(1003, give_s=3.0).records.reason == R_GIVES_WAY
    longest = max(len(run) for robot in reasons.T for run in "".join("x" if w else " " for w in robot).split())
    assert 0 < longest <= 3.0 / 0.2 + 1
