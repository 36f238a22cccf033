"""A robot that the guard lets stand says why, and one that has not seen what is beside its way looks round."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import DT, circles_world, make_sensor, one_robot, place_scenario, rig_of, run_scenario, scan_at, seen, tick
from swarmscope.onboard.control.guard import guard
from swarmscope.onboard.perception.frames import keep_frame, look_back
from swarmscope.onboard.reasons import (
    R_FREE,
    R_HELD_BLIND,
    R_HELD_CORNER,
    R_HELD_HOLE,
    R_HELD_NO_NUMBER,
    R_HELD_ROBOT,
    R_HELD_STRANGER,
    R_HELD_THING,
    R_HELD_UNSEEN,
    REASON_NAMES,
)
from swarmscope.onboard.sensor import all_round
from swarmscope.onboard.sharing.tracks import update_odometry, update_tracks

OPEN = np.full(360, np.inf, np.float32)
HELD = [
    R_HELD_THING,
    R_HELD_ROBOT,
    R_HELD_CORNER,
    R_HELD_UNSEEN,
    R_HELD_HOLE,
    R_HELD_BLIND,
    R_HELD_NO_NUMBER,
    R_HELD_STRANGER,
]


def asked(rows, v=0.5, w=0.0, speed=0.0, scan=OPEN):
    """Ask the guard for (v, w); return what it allows and the reason that is given."""
    rows.scan[:] = scan
    rows.fill(speed=speed)
    rows.decision["v"], rows.decision["w"], rows.decision["reason"] = v, w, R_FREE
    guard(rows.view)
    return rows.said("v"), rows.said("w"), rows.said("reason")


def in_front_of(distance, rig):
    """A scan of something round whose surface is so far ahead of the body [m]."""
    return scan_at(circles_world([(0.15 + distance + 1.0, 0.0, 1.0)]), rig)


def test_the_guards_words_say_what_holds_it():
    words = ("in the way", "another robot", "round a corner", "has not seen", "a hole of its scan")
    words += ("loses too much", "a number is missing", "does not yield")
    for reason, said in zip(HELD, words, strict=True):
        assert REASON_NAMES[reason].startswith("guard: stands") and said in REASON_NAMES[reason]


def test_a_thing_in_the_way():
    """2.1 cm before it the robot may not even go the 4.7 mm that a twentieth of its speed makes in a tick."""
    rows = one_robot()
    assert asked(rows, scan=in_front_of(0.021, rows.rig)) == (0.0, 0.0, R_HELD_THING)


def test_it_may_turn_on_the_spot_before_it():
    rows = one_robot()
    assert asked(rows, w=1.0, scan=in_front_of(0.021, rows.rig)) == (0.0, 1.0, R_HELD_THING)


def test_a_robot_that_is_only_slowed_keeps_its_planners_reason():
    rows = one_robot()
    v, _, reason = asked(rows, scan=in_front_of(0.06, rows.rig))
    assert 0.0 < v < 0.5 and reason == R_FREE


def test_a_robot_that_still_brakes_keeps_its_planners_reason():
    rows = one_robot()
    assert asked(rows, speed=0.3, scan=in_front_of(0.021, rows.rig)) == (0.0, 0.0, R_FREE)


def test_a_robot_that_wants_to_stand_keeps_its_planners_reason():
    rows = one_robot()
    assert asked(rows, v=0.0, scan=in_front_of(0.021, rows.rig)) == (0.0, 0.0, R_FREE)


def test_another_robot_in_the_way():
    """1.1 cm of 3.1 between the bodies are above the clearance; each may use half: less than two brakings and a way."""
    rows = one_robot()
    rows.see([seen(3, 0.325, 0.0, math.pi)])
    update_odometry(rows.percept, rows.shared)
    update_tracks(rows.percept, rows.shared, rows.rig, 0.0, 0.0)
    scan = scan_at(circles_world([(0.325, 0.0, 0.15)]), rows.rig)
    assert asked(rows, scan=scan) == (0.0, 0.0, R_HELD_ROBOT)
    assert asked(rows) == (0.0, 0.0, R_HELD_ROBOT)  # whether the scan shows it or not


def corner():
    """An open scan with something round 0.25 m away, from 60 degrees to the left on: a robot has room behind it."""
    scan = OPEN.copy()
    scan[180 + 60 : 180 + 150] = 0.25
    return scan


def test_somebody_who_may_come_round_a_corner():
    """Others that do not yield make 0.4 m in a tick: less is left of the way round the corner."""
    rows = one_robot(rig_of(others_yield=False, others_mps=2.0))
    assert asked(rows, scan=corner()) == (0.0, 0.0, R_HELD_CORNER)


def test_a_corner_holds_nobody_where_others_yield_or_do_not_move():
    for options in ({}, {"others_mps": 0.0}):
        v, _, reason = asked(one_robot(rig_of(**options)), scan=corner())
        assert v > 0.1 and reason == R_FREE


def test_where_no_robot_fits_behind_it_is_no_corner():
    """Of 34 cm, two radii and two clearances, there are only 25 beside it."""
    scan = np.full(360, 0.5, np.float32)
    scan[180 + 60] = 0.25
    v, _, reason = asked(one_robot(rig_of(others_yield=False, others_mps=2.0)), scan=scan)
    assert v > 0.0 and reason == R_FREE


@pytest.mark.parametrize("speed", [0.0, 0.4])
@pytest.mark.parametrize(
    "strange",
    [
        {"dt_s": 0.0}, {"dt_s": -0.2}, {"dt_s": math.nan}, {"dt_s": math.inf},
        {"compass": math.nan}, {"compass": math.inf},
    ],
)  # fmt: skip
def test_time_that_does_not_pass_and_a_heading_that_is_none(strange, speed):
    rows = one_robot()
    rows.fill(**strange)
    assert asked(rows, w=1.0, speed=speed) == (0.0, 0.0, R_HELD_NO_NUMBER)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_speed_or_a_command_that_is_no_number(value):
    assert asked(one_robot(), speed=value) == (0.0, 0.0, R_HELD_NO_NUMBER)
    assert asked(one_robot(), v=value) == (0.0, 0.0, R_HELD_NO_NUMBER)
    assert asked(one_robot(), w=value) == (0.0, 0.0, R_HELD_NO_NUMBER)


@pytest.mark.parametrize(("blind_s", "found"), [(0.4, (0.5, 1.0, R_FREE)), (0.6, (0.0, 0.0, R_HELD_BLIND))])
def test_a_lidar_that_has_said_nothing_for_half_a_second(blind_s, found):
    rows = one_robot()
    rows.shared["blind_s"] = blind_s
    assert asked(rows, w=1.0) == found


@pytest.mark.parametrize(("losses", "v"), [(0.0, 0.5), (0.2, 0.5), (0.275, 0.25), (0.32, 0.1)])
def test_a_lidar_that_loses_much_makes_it_slow(losses, v):
    """From a fifth of the returns on, linearly down to standing still at 35 %."""
    rows = one_robot()
    rows.shared["losses"] = losses
    assert asked(rows) == (pytest.approx(v), 0.0, R_FREE)


def test_a_lidar_that_loses_too_much_makes_it_stand():
    rows = one_robot()
    rows.shared["losses"] = 0.36
    assert asked(rows, w=1.0, speed=0.3) == (0.0, 0.0, R_HELD_BLIND)


class Looker:
    """A robot with a view of 180 degrees that does what the guard says, in the open."""

    def __init__(self, fov=math.pi, beams=181):
        self.rows = one_robot(rig_of(sensor=all_round(make_sensor(beams=beams, fov=fov))))

    def see(self, turned=0.0):
        """Turn on the spot and look: nothing is there."""
        self.rows.scan[:] = np.inf
        self.rows.fill(odom_yaw=turned)
        look_back(self.rows.view)
        keep_frame(self.rows.view)

    def ask(self, v=0.5, w=0.0):
        rows = self.rows
        rows.decision["v"], rows.decision["w"], rows.decision["reason"] = v, w, R_FREE
        guard(rows.view)
        return rows.said("v"), rows.said("w"), rows.said("reason")


def test_a_robot_that_sees_only_ahead_looks_round_before_it_drives():
    """Half a field less than a round, 270 degrees, at 2 rad/s: 11.8 ticks of 0.4 rad."""
    robot = Looker()
    robot.see()
    said = [robot.ask()]
    while said[-1][2] == R_HELD_UNSEEN:
        assert said[-1] == (0.0, pytest.approx(-2.0), R_HELD_UNSEEN) and len(said) < 30
        robot.see(said[-1][1] * DT)
        said.append(robot.ask())
    assert said[-1] == (0.5, 0.0, R_FREE)
    assert len(said) - 1 == math.ceil(1.5 * math.pi / 0.4)


def test_the_look_goes_on_whatever_the_planner_asks_for_meanwhile():
    robot = Looker()
    robot.see()
    first = robot.ask()
    robot.see(first[1] * DT)
    assert robot.ask(0.0, 1.0) == (0.0, first[1], R_HELD_UNSEEN)


def test_it_looks_to_the_side_that_it_has_not_seen():
    """After turning left by 100 degrees it knows what is to its right, up to 190 degrees off."""
    robot = Looker()
    robot.see()
    robot.see(math.radians(100.0))
    assert robot.ask() == (0.0, 2.0, R_HELD_UNSEEN)
    robot = Looker()
    robot.see()
    robot.see(math.radians(-100.0))
    assert robot.ask() == (0.0, -2.0, R_HELD_UNSEEN)


def test_scans_of_a_narrow_view_overlap():
    """Of 30 degrees it turns by 12 in a tick: 1.05 rad/s."""
    robot = Looker(math.radians(30.0), 31)
    robot.see()
    _, w, reason = robot.ask()
    increment = robot.rows.rig.sensor.increment
    assert (abs(w), reason) == (pytest.approx(0.4 * 31 * increment / DT), R_HELD_UNSEEN)


def test_a_robot_that_turns_on_the_spot_need_not_look_round():
    robot = Looker()
    robot.see()
    assert robot.ask(0.0, 1.0) == (0.0, 1.0, R_FREE)


def test_a_full_view_needs_no_look_round():
    assert asked(one_robot()) == (0.5, 0.0, R_FREE)


def test_a_robot_on_its_way_needs_not_look_again():
    """What the body sweeps has been in view before: only at the start it looks round."""
    lidar = {"beams": 181, "fov_deg": 180.0}
    trace = run_scenario(place_scenario([(0.0, 0.0, 0.0)], [(3.0, 0.0)], lidar=lidar, limit_s=30.0))
    reasons = trace.records.reason[:, 0].tolist()
    looks = [k for k, reason in enumerate(reasons) if reason == R_HELD_UNSEEN]
    assert looks == list(range(12))
    assert trace.robots["arrived"].all()
    assert trace.records.x[13, 0] == 0.0


def test_a_tick_of_a_planner_ends_with_the_guards_reason():
    rows = one_robot(planner="nav-scope")
    rows.fill(goal_distance=5.0)
    rows.scan[:] = OPEN
    rows.shared["losses"] = 0.5
    tick(rows)
    assert (rows.said("v"), rows.said("reason")) == (0.0, R_HELD_BLIND)
