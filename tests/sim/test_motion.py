"""Motion in closed form, limits, contacts that nothing tunnels through, arrivals."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import DT, circles_world, place_sim, rig_of, wall, world_of
from swarmscope.onboard.body import Body
from swarmscope.onboard.reasons import ARRIVED
from swarmscope.sim.cells import index_robots
from swarmscope.sim.motion import judge, move


def drive(sim, commands, ticks, state=0, start=0):
    """Command each robot (v, w) for some ticks."""
    sim.decisions["v"], sim.decisions["w"] = np.array(commands, float).T
    sim.decisions["state"] = state
    for tick in range(start, start + ticks):
        index_robots(sim)
        move(sim, tick, 0, sim.robots.size)
        judge(sim, tick)


def pose(sim, i=0):
    return [float(sim.robots[i][k]) for k in ("x", "y", "yaw")]


def at_speed(v, start=(0.0, 0.0, 0.0), **options):
    sim, _ = place_sim([start], **options)
    sim.robots["v"] = v
    return sim


@settings(max_examples=50)
@given(st.floats(0.01, 0.5), st.floats(-math.pi, math.pi), st.integers(1, 10))
def test_straight_ahead_is_speed_times_time(v, yaw, ticks):
    sim = at_speed(v, (1.0, -2.0, yaw))
    drive(sim, [(v, 0.0)], ticks)
    way = v * DT * ticks
    assert pose(sim)[:2] == pytest.approx([1.0 + way * math.cos(yaw), -2.0 + way * math.sin(yaw)], abs=1e-9)
    assert float(sim.robots[0]["length"]) == pytest.approx(way)


@settings(max_examples=50)
@given(st.floats(0.1, 0.5), st.floats(-2.0, 2.0).filter(lambda w: abs(w) > 0.05), st.integers(1, 20))
def test_a_constant_turn_is_an_arc(v, w, ticks):
    """A step of 10 ms on its chord's direction: the radius is off by w^2 h^2 / 24."""
    sim = at_speed(v)
    drive(sim, [(v, w)], ticks)
    angle = w * DT * ticks
    expected = [v / w * math.sin(angle), v / w * (1.0 - math.cos(angle))]
    assert pose(sim)[:2] == pytest.approx(expected, abs=2e-4)
    assert math.remainder(pose(sim)[2] - angle, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)
    assert -math.pi < pose(sim)[2] <= math.pi


@settings(max_examples=50)
@given(st.floats(0.0, 0.5), st.floats(0.0, 0.5), st.floats(0.2, 4.0))
def test_acceleration_is_limited_and_the_way_follows_from_it(v0, v, a_max):
    rig = rig_of(Body(a_max_mps2=a_max, sensor_delay_s=0.0, half_width_m=0.1))
    sim = at_speed(v0, rig=rig)
    drive(sim, [(v, 0.0)], 1)
    reached = float(sim.robots[0]["v"])
    assert reached == pytest.approx(min(max(v, v0 - a_max * DT), v0 + a_max * DT))
    ramp = abs(reached - v0) / a_max
    expected = 0.5 * (v0 + reached) * ramp + reached * (DT - ramp)
    assert pose(sim)[0] == pytest.approx(expected, abs=2e-3)


def test_commands_beyond_the_limits_are_cut():
    sim = at_speed(0.5)
    drive(sim, [(9.0, 9.0)], 1)
    assert float(sim.robots[0]["v"]) == 0.5
    assert pose(sim)[2] == pytest.approx(2.0 * DT)
    sim = at_speed(0.0)
    drive(sim, [(-1.0, 0.0)], 3)
    assert pose(sim) == [0.0, 0.0, 0.0]


@pytest.mark.parametrize("command", [(math.nan, 0.0), (0.5, math.nan), (math.nan, math.nan)])
def test_commands_that_are_no_numbers_leave_the_robot_on_the_map(command):
    sim = at_speed(0.4)
    drive(sim, [command], 1)
    assert all(math.isfinite(value) for value in pose(sim))
    assert 0.0 <= float(sim.robots[0]["v"]) <= 0.5


def test_turning_on_the_spot():
    sim = at_speed(0.0)
    drive(sim, [(0.0, 1.0)], 4)
    assert pose(sim) == pytest.approx([0.0, 0.0, 0.8])
    assert float(sim.robots[0]["length"]) == 0.0
    assert float(sim.robots[0]["waited_s"]) == pytest.approx(0.8)


@pytest.mark.parametrize("speed", [1.0, 20.0, 300.0])
def test_a_fast_robot_does_not_tunnel_through_a_thin_wall(speed):
    rig = rig_of(Body(v_max_mps=speed, a_max_mps2=2e5, half_width_m=0.1))
    sim = at_speed(speed, rig=rig, world=world_of(wall((2.0, -9.0), (2.0, 9.0))), substeps=20)
    drive(sim, [(speed, 0.0)], 30)
    assert sim.robots[0]["crashed"] == 1
    assert pose(sim)[0] < 2.0 - 0.15 + 1e-9
    assert float(sim.robots[0]["v"]) == 0.0
    assert float(sim.robots[0]["min_clearance"]) <= 0.0


def test_a_crashed_robot_stays_where_it_is():
    sim = at_speed(0.5, world=circles_world([(0.5, 0.0, 0.2)]))
    drive(sim, [(0.5, 0.0)], 5)
    before = pose(sim)
    assert sim.robots[0]["crashed"] == 1
    drive(sim, [(0.5, 1.0)], 5)
    assert pose(sim)[:2] == before[:2]
    assert not sim.robots[0]["arrived"]


def test_clearance_is_measured_along_the_way():
    sim = at_speed(0.5, (-1.0, 0.0, 0.0), world=circles_world([(0.0, 0.5, 0.2)]))
    drive(sim, [(0.5, 0.0)], 20)
    assert float(sim.robots[0]["min_clearance"]) == pytest.approx(0.5 - 0.2 - 0.15, abs=1e-6)


def test_two_robots_that_meet_both_stop():
    sim, _ = place_sim([(-0.5, 0.0, 0.0), (0.5, 0.02, math.pi), (5.0, 5.0, 0.0)])
    drive(sim, [(0.5, 0.0)] * 3, 10)
    assert sim.robots["crashed"].tolist() == [1, 1, 0]
    assert sim.robots["v"][:2].tolist() == [0.0, 0.0]
    gap = np.hypot(sim.robots["x"][0] - sim.robots["x"][1], sim.robots["y"][0] - sim.robots["y"][1])
    assert 0.3 <= gap < 0.32
    assert sim.robots["min_clearance"][0] <= 0.0


def test_fast_robots_do_not_pass_through_each_other():
    rig = rig_of(Body(v_max_mps=30.0, a_max_mps2=1e4, half_width_m=0.1))
    sim, _ = place_sim([(-3.0, 0.0, 0.0), (3.0, 0.1, math.pi)], rig=rig)
    sim.robots["v"] = 30.0
    drive(sim, [(30.0, 0.0)] * 2, 1)
    assert sim.robots["crashed"].tolist() == [1, 1]
    assert sim.robots["x"][0] < sim.robots["x"][1]


def test_robots_that_pass_closely_do_not_crash_and_know_how_closely():
    sim, _ = place_sim([(-1.0, 0.0, 0.0), (1.0, 0.35, math.pi)])
    drive(sim, [(0.5, 0.0)] * 2, 20)
    assert sim.robots["crashed"].tolist() == [0, 0]
    assert sim.robots["min_clearance"] == pytest.approx([0.05, 0.05], abs=1e-3)


def test_a_robot_arrives_when_it_says_so_and_stands():
    sim = at_speed(0.4, goals=[(0.1, 0.02)])
    drive(sim, [(0.0, 0.0)], 1, state=ARRIVED)
    row = sim.robots[0]
    assert row["arrived"] == 1
    assert float(row["arrival_s"]) == pytest.approx(DT)
    rest = math.hypot(0.1 - pose(sim)[0], 0.02 - pose(sim)[1])
    assert float(row["length"]) == pytest.approx(pose(sim)[0] + rest)
    before = float(row["length"])
    drive(sim, [(0.5, 0.0)], 5)
    assert float(sim.robots[0]["length"]) == before


def test_saying_arrived_while_moving_is_not_arriving():
    sim = at_speed(0.5)
    drive(sim, [(0.5, 0.0)], 3, state=ARRIVED)
    assert sim.robots[0]["arrived"] == 0
