"""DH-Bug: modes, sides, traps, loops, right of way."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import (
    DT,
    circle,
    circles_world,
    one_robot,
    place_scenario,
    rig_of,
    run_scenario,
    scan_at,
    seen,
    tick,
    wall,
)
from swarmscope.onboard.deciding.bug import (
    AT_GOAL,
    KEY_POINT,
    MODE_A,
    MODE_B,
    MODE_C,
    MODE_D,
    MODE_E,
    MODE_F,
    MODE_NAMES,
    STANDBY,
    STATES,
    toss,
)
from swarmscope.onboard.planning.dh_bug import TURN_LEFT, TURN_NEAREST, TURN_RANDOM, TURN_RIGHT, Params
from swarmscope.onboard.reasons import DECIDE, YIELD

BIG = [(2.3, 0.0, 2.0)]
"""0.3 m ahead and so wide that no direction within 80 degrees of the goal's is safe."""


class Robot:
    """One robot with a goal 8 m ahead, stepped by hand; it keeps no returns that are lost: scenes come and go."""

    def __init__(self, goal=8.0, **params):
        self.rows = one_robot(rig_of(lost_s=0.0), planner="dh-bug", **params)
        self.rows.fill(goal_distance=goal)
        self.memory, self.decision, self.shared = self.rows.memory, self.rows.decision, self.rows.shared
        self.yaw = 0.0

    def face(self, obstacles, yaw=0.0):
        """Show it obstacles; to another heading it has turned since the last tick."""
        self.rows.scan[:] = scan_at(circles_world(obstacles), self.rows.rig, yaw=yaw)
        self.rows.fill(compass=yaw, goal_bearing=-yaw, odom_yaw=yaw - self.yaw)
        self.yaw = yaw
        return self

    def step(self):
        tick(self.rows)
        self.rows.fill(odom_yaw=0.0)
        return self

    @property
    def mode(self):
        return int(self.memory["mode"])


def run_one(obstacles, start=(-3.0, 0.0, 0.0), goal=(3.0, 0.0), **params):
    """Run one robot to its goal; return its way (T, 2) and trace."""
    planner = {"name": "dh-bug", "params": params}
    trace = run_scenario(place_scenario([start], [goal], obstacles, planner=planner, limit_s=200.0))
    assert trace.robots["arrived"].all()
    assert not trace.robots["crashed"].any()
    n = len(trace.t_s)
    return np.column_stack([trace.records.x[:n, 0], trace.records.y[:n, 0]]), trace


def test_every_mode_has_a_name_and_a_state():
    assert len(MODE_NAMES) == len(STATES) == AT_GOAL + 1


def test_a_robot_turns_to_its_goal_before_it_drives_there():
    robot = Robot()
    assert robot.mode == STANDBY
    robot.face([], yaw=1.5).step()
    assert robot.mode == MODE_A
    assert robot.decision["v"] == 0.0
    assert robot.decision["w"] < 0.0
    robot.face([], yaw=0.1).step()
    assert robot.mode == MODE_B
    assert robot.decision["v"] == 0.5


def test_without_the_sector_a_gap_is_taken_that_the_body_fits_through():
    gap = [(0.5, 1.25, 1.0), (0.5, -1.25, 1.0)]  # 0.5 m wide, the body and its margins need 0.38 m
    robot = Robot(sector=0).face(gap).step()
    assert robot.mode == MODE_B and robot.decision["fused"] == 0
    robot = Robot(sector=1).face(gap).step()
    assert robot.mode != MODE_B
    closed = Robot(sector=0).face([(0.5, 1.15, 1.0), (0.5, -1.15, 1.0)]).step()
    assert closed.mode != MODE_B


@pytest.mark.parametrize(("ahead", "short", "long"), [(0.9, True, False), (1.3, True, True), (0.5, False, False)])
def test_how_far_a_way_must_be_free(ahead, short, long):
    """l_th is 0.6 m; with long gaps it is 1.2 m."""
    ring = [((ahead + 0.5) * math.cos(a), (ahead + 0.5) * math.sin(a), 0.5) for a in np.linspace(-1.5, 1.5, 31)]
    for long_gaps, free in ((0, short), (1, long)):
        assert (Robot(long_gaps=long_gaps).face(ring).step().mode == MODE_B) == free


@pytest.mark.parametrize(("turn", "side", "turns", "follows"), [(0, 1, MODE_C, MODE_E), (1, -1, MODE_D, MODE_F)])
def test_at_a_key_point_it_turns_and_then_follows(turn, side, turns, follows):
    robot = Robot(turn=turn).face(BIG).step()
    assert robot.mode == turns
    assert (robot.decision["fused"], robot.decision["state"], robot.decision["side"]) == (1, DECIDE, side)
    assert side * robot.decision["w"] > 0.0
    robot.face(BIG, yaw=side * 1.5).step()
    assert robot.mode == follows
    assert robot.decision["fused"] == 0
    assert robot.decision["v"] > 0.0
    assert KEY_POINT not in (turns, follows)


def test_a_following_ends_nearer_the_goal_with_the_goal_on_the_free_side():
    robot = Robot(turn=TURN_LEFT).face(BIG).step()
    robot.face([], yaw=0.3).step()
    assert robot.memory["side"] == 1  # as far from the goal as at the key point
    robot.rows.fill(goal_distance=7.9)
    robot.memory["heading"] = 0.3
    robot.step()
    assert robot.memory["side"] == 1  # the goal is on the obstacle's side
    robot.memory["heading"] = -0.3
    robot.step()
    assert robot.memory["side"] == 0
    assert robot.mode in (MODE_A, MODE_B)


def test_a_small_tree_is_passed_without_a_decision():
    robot = Robot().face([(0.7, 0.05, 0.15)]).step()
    assert robot.decision["fused"] == 0
    assert robot.decision["heading"] < -0.3


@pytest.mark.parametrize(("turn", "sign"), [(TURN_LEFT, 1.0), (TURN_RIGHT, -1.0)])
@pytest.mark.parametrize("offset", [0.1, -0.1])
def test_a_disc_is_passed_on_the_side_that_is_set(turn, sign, offset):
    way, _ = run_one([circle(0.0, offset, 1.2)], turn=turn, key_deg=20.0)
    beside = way[np.argmin(np.abs(way[:, 0])), 1]
    assert sign * beside > 1.2


@pytest.mark.parametrize("offset", [0.3, -0.3])
def test_a_disc_is_passed_on_the_shorter_side(offset):
    way, _ = run_one([circle(0.0, offset, 1.2)], turn=TURN_NEAREST)
    assert np.sign(way[np.argmin(np.abs(way[:, 0])), 1]) == -np.sign(offset)


def test_the_toss_is_even_and_the_same_every_time():
    sides = np.array([[toss(0, robot, count) for count in range(100)] for robot in range(50)])
    assert set(np.unique(sides)) == {-1, 1}
    assert abs(sides.mean()) < 0.05
    assert (np.abs(sides.mean(axis=0)) < 0.6).all()
    assert (np.abs(sides.mean(axis=1)) < 0.6).all()
    assert toss(0, 3, 4) == sides[3, 4]
    assert any(toss(1, 3, count) != sides[3, count] for count in range(20))


def test_an_oracle_is_listened_to_only_if_told_to():
    for told, side in ((0, 1), (1, -1)):
        robot = Robot(turn=TURN_LEFT, told=told)
        robot.memory["told"] = -1
        assert robot.face(BIG).step().decision["side"] == side


@pytest.mark.parametrize("turn", [TURN_LEFT, TURN_RIGHT, TURN_RANDOM, TURN_NEAREST])
def test_out_of_a_u_trap(turn):
    trap = [wall((-2.0, -1.2), (0.5, -1.2), (0.5, 1.2), (-2.0, 1.2))]
    way, _ = run_one(trap, turn=turn)
    assert way[:, 0].max() > 2.9


def test_being_back_at_a_pose_of_the_same_following_is_a_loop():
    """Round a disc with the goal's distance never falling: after one round the robot faces the goal anew."""
    robot = Robot(turn=TURN_LEFT).face(BIG).step()
    robot.rows.fill(speed=0.4)
    robot.face(BIG, yaw=1.5)
    robot.rows.fill(goal_distance=9.0)
    looped = None
    for k in range(100):
        angle = 2.0 * math.pi * k / 40
        robot.shared["x"], robot.shared["y"] = math.cos(angle), math.sin(angle)
        robot.step()
        if robot.memory["looped"]:
            looped = k
            break
    assert looped in (40, 41)


def test_turning_on_the_spot_for_more_than_390_degrees_is_a_loop():
    robot = Robot(turn=TURN_LEFT).face(BIG).step()
    looped = []
    for _ in range(6):
        robot.rows.fill(odom_yaw=math.radians(65.5))  # so far off that compass and goal are believed as they are
        looped.append(bool(robot.step().memory["looped"]))
    assert looped == [False] * 5 + [True]


def test_the_robot_with_the_smaller_address_goes_first_and_nobody_waits_for_ever():
    """A neighbour comes head-on; it is waited for by a larger address only, and no longer than wait_s."""
    waits = {}
    for own in (0, 9):
        robot = Robot()
        robot.rows.fill(id=own)
        states = []
        for k in range(30):
            robot.rows.see([seen(5, 0.8 + 0.04 * math.sin(9.0 * k) - 0.001 * k, 0.0, math.pi)])
            robot.shared["track_moved_s"][:] = robot.rows.percept["now_s"]
            robot.shared["track_vx"][:] = -0.5
            robot.step()
            states.append(int(robot.decision["state"]))
        waits[own] = np.array(states) == YIELD
    assert not waits[0].any()
    assert waits[9].any()
    assert not waits[9].all()
    longest = max(len(run) for run in "".join("w" if w else " " for w in waits[9]).split())
    assert longest * DT <= Params().wait_s + 2.0 * DT


def test_two_robots_head_on_arrive():
    values = place_scenario([(-3, 0.0, 0), (3, 0.0, math.pi)], [(3, 0.0), (-3, 0.0)], planner={"name": "dh-bug"})
    trace = run_scenario(values)
    assert trace.robots["arrived"].all()
    assert not trace.robots["crashed"].any()


def test_fifteen_robots_cross_a_forest_the_same_way_every_time():
    values = {"task": {"name": "T1"}, "seed": 1000, "robots": 15, "record_scans": "no", "planner": {"name": "dh-bug"}}
    one, two = run_scenario(values), run_scenario(values, threads=2)
    assert one.robots.tobytes() == two.robots.tobytes()
    assert not one.robots["crashed"].any()
    assert one.robots["arrived"].mean() >= 0.9
