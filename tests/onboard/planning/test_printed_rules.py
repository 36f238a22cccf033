"""Single rules as printed: who waits by (17) and (27), dead ends, turns, DH-Bug's modes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import DT, circles_world, one_robot, rig_of, scan_at, seen, tick
from swarmscope.onboard.deciding.waiting import AS_PRINTED, AT_LEAST_1, NOBODY
from swarmscope.onboard.planning.dh_bug import TURN_LEFT
from swarmscope.onboard.reasons import ESCAPE, YIELD

CLOSE = 0.6
"""Dead ahead, so near that (17) holds at w_i = 1, not at w_i = 0.1."""


def waits(planner, own=9, **params):
    """Whether the robot waits for one that comes head-on and has address 5."""
    rows = one_robot(rig_of(), planner=planner, **params)
    rows.fill(goal_distance=8.0, id=own)
    states = []
    for k in range(4):
        rows.see([seen(5, CLOSE - 0.001 * k, 0.0, math.pi)])
        rows.shared["track_moved_s"][:] = rows.percept["now_s"]
        tick(rows)
        states.append(int(rows.decision["state"]) == YIELD)
    return states[-1]


@pytest.mark.parametrize("planner", ["nav-scope", "sfm-mas"])
@pytest.mark.parametrize(
    ("repulsion", "w_i", "waiting"),
    [
        (AT_LEAST_1, 1.0, True),
        (AT_LEAST_1, 0.1, True),
        (AS_PRINTED, 1.0, True),
        (AS_PRINTED, 0.1, False),
        (AS_PRINTED, 0.0, False),
        (NOBODY, 4.0, False),
    ],
)
def test_the_weight_of_neighbours_decides_who_is_waited_for(planner, repulsion, w_i, waiting):
    assert waits(planner, repulsion=repulsion, w_i=w_i) == waiting


@pytest.mark.parametrize("planner", ["nav-scope", "sfm-mas"])
def test_without_priority_both_of_a_pair_wait(planner):
    assert [waits(planner, own) for own in (1, 9)] == [False, True]
    assert [waits(planner, own, priority=0) for own in (1, 9)] == [True, True]


def enclosed(**params):
    """A robot in a ring of posts through which nothing fits, with its planner's last command."""
    rows = one_robot(rig_of(lost_s=0.0), planner="nav-scope", **params)
    rows.fill(goal_distance=8.0)
    ring = [(0.55 * math.cos(a), 0.55 * math.sin(a), 0.12) for a in np.linspace(0.0, 2.0 * math.pi, 17)[:-1]]
    rows.scan[:] = scan_at(circles_world(ring), rows.rig)
    for _ in range(5):
        tick(rows)
    return rows.decision


def test_at_a_dead_end_the_printed_robot_turns_on_the_spot():
    found = enclosed(escape=0)
    assert (int(found["state"]), float(found["v"])) == (ESCAPE, 0.0)
    assert found["side"] * found["w"] == pytest.approx(math.pi / 2.0 / DT, rel=1.0)
    assert found["side"] * found["heading"] == pytest.approx(math.pi / 2.0)
    assert abs(float(enclosed()["heading"])) != pytest.approx(math.pi / 2.0)


def bug(yaw, **params):
    """DH-Bug's command, its goal ``yaw`` to the right of it, nothing in the way."""
    rows = one_robot(rig_of(lost_s=0.0), planner="dh-bug", **params)
    rows.fill(goal_distance=8.0, compass=yaw, goal_bearing=-yaw)
    rows.scan[:] = scan_at(circles_world([]), rows.rig, yaw=yaw)
    tick(rows)
    return rows.decision


def test_in_mode_a_the_printed_bug_stands_while_it_turns():
    turned = math.radians(25.0)  # more than theta_0
    assert bug(turned)["v"] > 0.0
    assert (bug(turned, in_place=1)["v"], bug(turned, in_place=1)["w"] < 0.0) == (0.0, True)
    assert bug(math.radians(5.0), in_place=1)["v"] > 0.0


@pytest.mark.parametrize(("nearer", "ends"), [(1, False), (0, True)])
def test_the_printed_bug_leaves_wherever_the_goal_is_on_the_free_side(nearer, ends):
    rows = one_robot(rig_of(lost_s=0.0), planner="dh-bug", turn=TURN_LEFT, nearer=nearer)
    rows.fill(goal_distance=8.0)
    rows.scan[:] = scan_at(circles_world([(2.3, 0.0, 2.0)]), rows.rig)
    tick(rows)
    assert rows.memory["side"] == 1
    rows.scan[:] = scan_at(circles_world([]), rows.rig)
    rows.memory["heading"] = -0.3  # the goal on its left, away from the obstacle; as far as at the key point
    tick(rows)
    assert (rows.memory["side"] == 0) == ends


@pytest.mark.parametrize(("loops", "noticed"), [(1, True), (0, False)])
def test_the_printed_bug_notices_no_loops(loops, noticed):
    rows = one_robot(rig_of(lost_s=0.0), planner="dh-bug", turn=TURN_LEFT, loops=loops)
    rows.fill(goal_distance=8.0)
    rows.scan[:] = scan_at(circles_world([(2.3, 0.0, 2.0)]), rows.rig)
    tick(rows)
    looped = []
    for _ in range(8):
        rows.fill(odom_yaw=math.radians(65.5))
        tick(rows)
        looped.append(bool(rows.memory["looped"]))
    assert any(looped) == noticed


@pytest.mark.parametrize("planner", ["nav-scope", "sfm-mas"])
def test_the_printed_robot_turns_before_it_drives(planner):
    def command(yaw, **params):
        rows = one_robot(rig_of(lost_s=0.0), planner=planner, **params)
        rows.fill(goal_distance=8.0, compass=yaw, goal_bearing=-yaw)
        rows.scan[:] = scan_at(circles_world([]), rows.rig, yaw=yaw)
        tick(rows)
        return float(rows.decision["v"])

    turned = math.radians(25.0)
    assert command(turned) > 0.0
    assert command(turned, in_place=1) == 0.0
    assert command(math.radians(5.0), in_place=1) > 0.0
