"""SFM-MAS: its forces by hand, its golden rows, who stops, who asks, who goes first, and whole runs."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from helpers import circle, circles_world, one_robot, place_scenario, rig_of, run_scenario, scan_at, seen, tick, wall
from swarmscope.errors import ConfigError
from swarmscope.onboard.deciding.choosing import own_probability
from swarmscope.onboard.deciding.fields import (
    following_probability,
    fuse,
    interaction_force,
    obstacle_constant,
    obstacle_force,
    obstacle_potential,
    propulsion,
    yields_to,
)
from swarmscope.onboard.deciding.waiting import PROPULSION, goes_first
from swarmscope.onboard.perception.areas import normalise, passable_distance
from swarmscope.onboard.planners import load_planner
from swarmscope.onboard.planning.sfm_mas import obstacle_stops
from swarmscope.onboard.reasons import ADVANCE, DECIDE, FOLLOW, YIELD
from swarmscope.onboard.view import Table

L_TH = 0.6
HALF = math.radians(30.0)
TREES = [circle(-1.0, 0.3, 0.35), circle(0.6, -0.8, 0.4), circle(1.2, 0.5, 0.3), circle(-0.4, -1.6, 0.3)]
STARTS = [(-3.0, -1.5, 0.0), (-3.0, 0.0, 0.0), (-3.0, 1.5, 0.0)]
GOALS = [(3.0, 1.0), (3.0, 0.0), (3.0, -1.0)]
LETTER = {"look_ahead_m": 0.0, "sector": True}


def test_the_constant_by_hand():
    """|F_a| = 0.5, l_th = 0.6 m, alpha = 60 deg: V_0B = 0.36 / 0.8660 x 0.5 = 0.2078; at 1 m F_aB = -0.2078."""
    assert propulsion(1.0, 0.5) == 0.5
    assert obstacle_constant(0.5, L_TH, HALF) == pytest.approx(0.207846, abs=1e-6)
    assert obstacle_force(1.0, 0.207846) == pytest.approx(-0.207846)
    assert obstacle_force(0.5, 0.207846) == pytest.approx(-0.831384)
    assert obstacle_potential(0.5, 0.207846) == pytest.approx(-0.415692)


@given(st.floats(0.05, 2.0), st.floats(0.1, 3.0), st.floats(0.0, 1.4))
def test_the_forces_balance_at_the_critical_point(own, reach, half):
    force = obstacle_force(reach, obstacle_constant(own, reach, half))
    assert own + force * math.cos(half) == pytest.approx(0.0, abs=1e-12 * own)
    assert yields_to(own, obstacle_force(0.999 * reach, obstacle_constant(own, reach, half)), math.cos(half))
    assert not yields_to(own, obstacle_force(1.001 * reach, obstacle_constant(own, reach, half)), math.cos(half))


@given(st.floats(0.1, 5.0))
def test_the_force_is_minus_the_slope_of_the_potential(d):
    h = 1e-5 * d
    slope = (obstacle_potential(d + h, 0.3) - obstacle_potential(d - h, 0.3)) / (2.0 * h)
    assert slope > 0.0
    assert obstacle_force(d, 0.3) == pytest.approx(-slope, rel=1e-6)


TABLE_HALF = math.radians(36.0)
R3 = [[54, 1.62], [83, 1.53], [128, 1.78], [177, 1.55], [231, 1.89], [282, 1.55], [302, 1.58], [359, 1.18]]
R4 = [[8, 1.78], [109, 1.17], [176, 1.85], [237, 1.27], [300, 1.69], [329, 1.62]]


def test_table_ii_as_this_planner_reads_it():
    """P_s of R3 by triangles, P_n of R4 with borders on the polygon, and the choice: alone left, together right."""
    rows = np.array(R3)
    p_self = own_probability(Table(np.radians(rows[:, 0]), rows[:, 1].copy()), len(rows), TABLE_HALF, 0.0, True)
    assert p_self == pytest.approx(0.5042, abs=5e-5)
    rows = np.array(R4)
    features = np.radians(rows[:, 0]), rows[:, 1].copy(), len(rows)
    x_1 = passable_distance(*features, 0.0, TABLE_HALF, True)
    x_2 = passable_distance(*features, -TABLE_HALF, 0.0, True)
    assert following_probability(x_1, x_2, normalise(2.696, 5.0), False) == pytest.approx(0.4137, abs=5e-4)
    p, f = np.array([0.395, 0.581, 0.403, 0.414]), np.array([0.236, 0.279, 0.266, 0.247])
    assert fuse(p_self, float(p @ f), float(f.sum())) == pytest.approx(0.478, abs=5e-4)


def stops_for(ranges, bearing, rig):
    """Whether the masked scan ``ranges`` stops a robot on its way to ``bearing``."""
    robot = one_robot(rig)
    robot.fill(goal_bearing=bearing)
    see = robot.view
    see.masked[:] = ranges
    return obstacle_stops(see)


@pytest.mark.parametrize(
    ("distance", "degrees", "stops"),
    [
        (0.62, 0, True),  # 0.36 / 0.8660 / 0.62^2 = 1.081
        (0.65, 0, False),  # 0.984
        (0.62, 20, True),  # 1.081 x 0.9397 = 1.016
        (0.62, 29, False),  # 1.081 x 0.8746 = 0.946
        (0.59, 29, True),
        (0.30, 31, False),  # not in the safety sector
        (0.30, 180, False),
    ],
)
def test_who_stops_by_the_letter(distance, degrees, stops):
    rig = rig_of(**LETTER)
    for sign in (1, -1):
        ranges = np.full(360, np.inf, np.float32)
        ranges[180 + sign * degrees if degrees < 180 else 0] = distance
        assert stops_for(ranges, 0.0, rig) is stops
        assert stops_for(np.roll(ranges, 90), 0.5 * math.pi, rig) is stops


@pytest.mark.parametrize(
    ("x", "y", "stops"),
    [
        (1.95, 0.0, True),
        (2.1, 0.0, False),
        (1.9, 0.17, True),
        (1.9, 0.2, False),
        (0.3, 0.25, False),
        (-0.3, 0.0, False),
    ],
)
def test_with_look_ahead_it_stops_for_what_is_in_the_way_of_the_body(x, y, stops):
    ranges = np.full(360, np.inf, np.float32)
    bearing = math.atan2(y, x)
    beam = round(math.degrees(bearing)) + 180
    ranges[beam % 360] = math.hypot(x, y)
    turn = math.radians(beam - 180) - bearing  # the return lies on a whole beam
    assert stops_for(ranges, turn, rig_of()) is stops


def test_an_invalid_beam_ahead_stops():
    ranges = np.full(360, np.inf, np.float32)
    ranges[200] = np.nan
    assert stops_for(ranges, 0.0, rig_of())
    assert not stops_for(ranges, math.pi, rig_of())


def robot_before(*trees, planner="sfm-mas", **params):
    robot = one_robot(planner=planner, **params)
    robot.fill(goal_distance=5.0)
    robot.scan[:] = scan_at(circles_world(trees), robot.rig)
    return robot


def test_it_asks_only_when_it_has_to_decide_and_does_not_wait_for_ever():
    robot = robot_before((2.6, 0.05, 0.3))  # 2.3 m away: beyond what stops it
    robot.see([seen(1, 1.2, 0.8)])
    decision = tick(robot)
    assert (decision["state"], decision["n_out"]) == (ADVANCE, 0)
    robot.scan[:] = scan_at(circles_world([(2.1, 0.05, 0.3)]), robot.rig)
    decision = tick(robot)
    assert (decision["state"], decision["n_out"], decision["v"]) == (DECIDE, 1, 0.0)
    states = []
    for _ in range(5):
        decision = tick(robot)
        assert decision["n_out"] == 0
        states.append(int(decision["state"]))
    assert states[-1] in (FOLLOW, YIELD)
    assert decision["side"] == -1


def test_it_decides_at_once_when_nobody_is_in_the_pass_band():
    robot = robot_before((2.1, 0.05, 0.3))
    robot.see([seen(1, 3.2, 0.8)])
    decision = tick(robot)
    assert (decision["n_out"], decision["fused"], decision["side"]) == (0, 1, -1)


def test_its_own_opinion_is_by_triangles():
    opinions = []
    for planner in ("sfm-mas", "nav-scope"):
        robot = robot_before((1.2, 0.05, 0.3), (0.5, 1.5, 0.4), planner=planner, prior=0.0)
        opinions.append(float(tick(robot)["p_self"]))
    assert abs(opinions[0] - opinions[1]) > 1e-3


NEAR = interaction_force(0.5, 0.9, 1.0)
cosine = st.floats(-1.0, 1.0)


@given(cosine, cosine)
def test_of_two_that_would_wait_exactly_one_goes(ours, its):
    if yields_to(0.5, NEAR, ours) and yields_to(0.5, NEAR, its):
        assert goes_first(NEAR, ours, its, True) != goes_first(NEAR, its, ours, False)


def test_who_is_ahead_goes_first():
    assert PROPULSION == 0.5
    assert goes_first(NEAR, 1.0, -1.0, False)  # it drives away from us
    assert goes_first(NEAR, 1.0, 0.0, False)  # it crosses before us
    assert goes_first(NEAR, 1.0, 0.7, False)  # we see it straight ahead, it sees us to its side
    assert not goes_first(NEAR, 0.7, 1.0, True)
    assert goes_first(NEAR, 1.0, 1.0, True)  # head on: the smaller address
    assert not goes_first(NEAR, 1.0, 1.0, False)


def meeting(yaw, peer, ticks):
    """A robot (address 5) sees robot ``peer`` 0.6 m ahead, moving along ``yaw``; return its states."""
    robot = robot_before()
    robot.fill(id=5)
    states = []
    for k in range(ticks):
        back = 0.1 * (k % 2)  # it moves, but stays where it is
        robot.see([seen(peer, 0.6 - back * math.cos(yaw), -back * math.sin(yaw), yaw)])
        states.append(int(tick(robot)["state"]))
    return states


def test_it_waits_for_one_that_drives_ahead_and_every_wait_ends():
    states = meeting(0.0, 9, 14)
    assert states[0] == YIELD
    assert ADVANCE in states


def test_head_on_the_smaller_address_goes_on():
    assert meeting(math.pi, 2, 1) == [YIELD]
    assert meeting(math.pi, 9, 1) == [ADVANCE]


def trace_of(name, starts=STARTS, goals=GOALS, obstacles=TREES, **more):
    planner = {"name": name, "params": more.pop("params", {})}
    trace = run_scenario(place_scenario(starts, goals, obstacles, planner=planner, **more))
    assert trace.robots["arrived"].all()
    assert not trace.robots["crashed"].any()
    return trace


def test_sfm_i_runs_like_sfm_mas_without_weight_bit_for_bit():
    alone, weightless = trace_of("sfm-i"), trace_of("sfm-mas", params={"w_i": 0.0})
    assert (alone.records.side != 0).any()
    assert alone.robots.tobytes() == weightless.robots.tobytes()
    for one, other in zip(alone.records, weightless.records, strict=True):
        assert one.tobytes() == other.tobytes()
    assert alone.robots["bytes"].sum() == 0
    assert trace_of("sfm-mas").robots["bytes"].sum() > 0
    ours, full = load_planner("sfm-i").defaults, load_planner("sfm-mas").defaults
    assert set(full) - set(ours) == {"w_i", "patience_s", "answers"}
    assert set(ours) <= set(full)
    assert all(full[name] == value for name, value in ours.items())


@pytest.mark.parametrize("key", ["w_i", "patience_s", "answers"])
def test_what_makes_sfm_i_what_it_is_cannot_be_set(key):
    with pytest.raises(ConfigError, match=f"planner 'sfm-i': {key}: is fixed at 0"):
        load_planner("sfm-i").params({key: 1})


@pytest.mark.parametrize("name", ["sfm-mas", "sfm-i"])
def test_out_of_a_dead_end_through_a_door_and_past_each_other(name):
    trap = wall((-2.5, -0.8), (0, -0.8), (0, 0.8), (-2.5, 0.8))
    trace_of(name, [(-1.5, 0.1, 0.0)], [(3.0, 0.0)], [trap])
    door = [wall((0, 0.4), (0, 4)), wall((0, -0.4), (0, -4)), wall((-4, 4), (4, 4), (4, -4), (-4, -4), (-4, 4))]
    trace_of(name, [(-2, 0.2, 0), (2, -0.2, math.pi)], [(2, 0.2), (-2, -0.2)], door)
    starts = [(-3, 0, 0), (3, 0, math.pi), (0, -3, 1.57), (0, 3, -1.57)]
    trace = trace_of(name, starts, [(3, 0), (-3, 0), (0, 3), (0, -3)], [])
    assert (trace.robots["length"] <= 1.5 * 6.0).all()


def test_the_letter_runs_too():
    letter = {"look_ahead_m": 0.0, "sector": True}
    trace_of("sfm-mas", safety=letter, params={"prior": 0.0})
