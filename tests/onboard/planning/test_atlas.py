"""Atlas in whole runs: where a robot has to remember what it has seen, it does."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import circle, one_robot, place_scenario, rig_of, run_scenario, tick, wall
from swarmscope.onboard.planning.atlas import R_FORGOT

ATLAS = {"planner": {"name": "atlas"}}
LIMIT = {"limit_s": 240.0}


def drive(starts, goals, obstacles=(), **more):
    trace = run_scenario(place_scenario(starts, goals, obstacles, **(ATLAS | more)))
    assert not trace.robots["crashed"].any()
    return trace


def test_nothing_in_the_way_is_a_straight_line():
    robot = drive([(-4, 0, 0)], [(4, 1)]).robots[0]
    assert robot["length"] == pytest.approx(math.hypot(8, 1), rel=2e-3)


def test_a_dead_end_is_left_once_and_for_all():
    """A pocket of 7 m depth: deeper than the LiDAR sees."""
    pocket = wall((-3, -1.2), (4, -1.2), (4, 1.2), (-3, 1.2))
    robot = drive([(-6, 0, 0)], [(6, 0)], [pocket]).robots[0]
    assert robot["arrived"]
    assert robot["length"] < 26.0  # in, out, round: 6 + 7 + 11


def test_rooms_that_lead_nowhere_are_not_entered_twice():
    rooms = [
        wall((-8, 8), (8, 8), (8, -8), (-8, -8), (-8, 8)),
        wall((-2, -8), (-2, -0.6)), wall((-2, 0.6), (-2, 6.5)),  # a door into a pocket, and one at the top
        wall((4, -8), (4, 6.5)),  # its far wall, open at the top
        wall((-2, 4), (2, 4), (2, -4), (-2, -4)),
    ]  # fmt: skip
    robot = drive([(-5, 0, 0)], [(6, 0)], rooms, **LIMIT).robots[0]
    assert robot["arrived"]
    assert robot["length"] < 45.0


def test_a_robot_that_is_walled_in_says_that_it_forgets_why():
    bot = one_robot(rig_of(), "atlas")
    bot.scan[:] = 1.0
    bot.fill(goal_distance=10.0)
    said = [int(tick(bot)["reason"]) for _ in range(3)]
    assert R_FORGOT in said
    assert abs(bot.decision["v"]) <= 0.5


def test_two_meet_head_on():
    trace = drive([(-3, 0.05, 0), (3, -0.05, math.pi)], [(3, 0.05), (-3, -0.05)])
    assert trace.robots["arrived"].all()
    assert (trace.robots["length"] < 6.6).all()


def test_somebody_parked_in_the_way_is_gone_round():
    trace = drive([(-3, 0, 0), (0, 0, 0)], [(3, 0), (0, 0)], [circle(0, 2, 0.2)])
    assert trace.robots["arrived"].all()
    assert trace.robots[0]["length"] < 6.4


def test_somebody_parked_in_the_only_short_way_is_not_gone_to_again_and_again():
    """In a ring of corridors the short way is closed by a robot at its goal, out of sight from where one turns off."""
    outside = wall((-0.5, -0.5), (14.5, -0.5), (14.5, 10.5), (-0.5, 10.5), (-0.5, -0.5))
    inside = wall((0.5, 0.5), (13.5, 0.5), (13.5, 9.5), (0.5, 9.5), (0.5, 0.5))
    trace = drive([(0, 0, 0), (7, 0, 0)], [(14, 0), (7, 0)], [outside, inside], bounds=(-1, -1, 15, 11), limit_s=200.0)
    assert trace.robots["arrived"].all()
    assert trace.robots[0]["length"] < 60.0  # there, back, and round: 4 + 4 + 34


def test_the_same_run_by_one_thread_and_by_many():
    scenario = {"task": {"name": "T3"}, "robots": 8, "seed": 1003, "limit_s": 60.0, "record_scans": "no"} | ATLAS
    one, many = run_scenario(scenario, 1), run_scenario(scenario, 4)
    assert one.robots.tobytes() == many.robots.tobytes()


def test_a_robot_keeps_its_map_from_tick_to_tick():
    rig = rig_of()
    bot = one_robot(rig, "atlas")
    bot.scan[:] = 2.0
    bot.scan[:90] = np.inf
    bot.fill(goal_distance=10.0)
    tick(bot)
    cells = np.bitwise_count(bot.memory["fine"]).sum()
    assert cells > 100
    bot.scan[:] = np.inf
    tick(bot)
    assert np.bitwise_count(bot.memory["fine"]).sum() > 0.9 * cells


@pytest.mark.parametrize("cell_m", [0.03, 0.25, 1.0])
def test_every_cell_size_that_can_be_set_drives(cell_m):
    trace = drive(
        [(-3, 0, 0)], [(3, 0)], [circle(0, 0.1, 0.4)], planner={"name": "atlas", "params": {"cell_m": cell_m}}
    )
    assert trace.robots["arrived"].all()


@pytest.mark.parametrize("goal", [math.nan, math.inf, 1e300])
def test_a_goal_that_is_no_place_stops_nobody_for_good(goal):
    bot = one_robot(rig_of(), "atlas")
    bot.scan[:] = np.inf
    bot.fill(goal_distance=goal)
    said = tick(bot)
    assert math.isfinite(said["v"])
    bot.fill(goal_distance=5.0)
    for _ in range(10):
        said = tick(bot)
    assert said["v"] > 0.3


@pytest.mark.parametrize("leap", [1e3, 1e6, 1e12])
def test_odometry_that_leaps_costs_the_map_and_no_time(leap):
    bot = one_robot(rig_of(), "atlas")
    bot.scan[:] = 2.0
    bot.scan[150:210] = np.inf
    bot.fill(goal_distance=9.0)
    tick(bot)
    bot.fill(odom_x=leap)
    tick(bot)
    bot.fill(odom_x=0.0)
    assert tick(bot)["v"] > 0.0
    assert np.bitwise_count(bot.memory["fine"]).sum() > 20


def test_a_robot_finds_back_out_of_where_it_came_in_by_a_narrow_gap():
    """Rubble on a tuning seed: by its map the gap that it came in by is closed, and its only way leads back through."""
    values = ATLAS | {"task": {"name": "rubble"}, "seed": 1046, "robots": 1, "limit_s": 600.0}
    assert run_scenario(values).robots["arrived"].all()
