"""The robot's own time: jumps of its clock are no time that has passed, and waits end all the same."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import DT, circle, one_robot, place_scenario, run_scenario, seen, tick
from robots import Driver
from swarmscope.onboard.deciding.waiting import wait
from swarmscope.onboard.perception.clock import JUMP_PERIODS, keep_time

WAITING = np.dtype([("wait_s", np.float64), ("push_s", np.float64)])


def times(steps, start=0.0):
    """What a planner is told the time is, of a clock that goes on by ``steps`` [s] from tick to tick."""
    rows = one_robot()
    said, found = start, []
    for step in (0.0, *steps):
        said += step
        rows.fill(now_s=said)
        keep_time(rows.percept, rows.shared)
        rows.shared["started"] = 1
        found.append(float(rows.percept["now_s"]))
    return found


@pytest.mark.parametrize("start", [0.0, -7.0, 1.7e9])
def test_time_begins_with_the_first_tick_and_goes_on_as_the_clock_does(start):
    steps = [DT, 2.0 * DT, 0.99 * JUMP_PERIODS * DT, 0.5 * DT]
    assert times(steps, start) == pytest.approx([0.0, *np.cumsum(steps)], abs=2e-6)


@pytest.mark.parametrize("start", [0.0, -7.0, 0.123, 1.7e9])
def test_ticks_on_time_are_the_same_to_the_last_bit_wherever_the_clock_stands(start):
    assert times([DT] * 200, start) == [DT * k for k in range(201)]


@pytest.mark.parametrize("jump", [3600.0, -3600.0, 5.0, -1.5])
def test_after_a_jump_time_goes_on_as_if_nothing_had_happened(jump):
    assert times([DT, DT, DT + jump, DT, DT, DT - jump, DT]) == [DT * k for k in range(8)]


def test_another_period_is_counted_from_there_on():
    rows, found = one_robot(), []
    for said, dt in [(7.0, 0.2), (7.2, 0.2), (7.4, 0.2), (7.5, 0.1), (7.6, 0.1), (7.75, 0.1)]:
        rows.fill(now_s=said, dt_s=dt)
        keep_time(rows.percept, rows.shared)
        rows.shared["started"] = 1
        found.append(float(rows.percept["now_s"]))
    assert found == pytest.approx([0.0, 0.2, 0.4, 0.5, 0.6, 0.75])


@pytest.mark.parametrize("strange", [{"dt_s": math.nan}, {"dt_s": 0.0}, {"dt_s": -0.2}, {"now_s": math.nan}])
def test_what_is_no_number_spoils_one_tick(strange):
    """A period that is none lets no time pass; a clock that says nothing counts as on time."""
    rows, found = one_robot(), []
    for k in range(5):
        rows.fill(now_s=k * DT, dt_s=DT)
        rows.fill(**(strange if k == 2 else {}))
        keep_time(rows.percept, rows.shared)
        rows.shared["started"] = 1
        found.append(float(rows.percept["now_s"]))
    third = 2.0 * DT if "now_s" in strange else DT
    assert found == pytest.approx([0.0, DT, third, third + DT, third + 2.0 * DT])


def test_a_wait_ends_though_the_clock_stands_below_zero():
    """Times below 0 mean "does not wait": a wait that began at one began anew in every tick."""
    rows = one_robot()
    memory = np.zeros(1, WAITING)[0]
    memory["wait_s"] = -1.0
    waits = []
    for k in range(15):
        rows.fill(now_s=k * DT - 3600.0)
        keep_time(rows.percept, rows.shared)
        rows.shared["started"] = 1
        rows.decision["v"] = 0.5
        wait(rows.view, memory, True, 2.0)
        waits.append(rows.said("v") == 0.0)
    assert waits == [True] * 11 + [False] * 4


@pytest.mark.parametrize("jump", [3600.0, -3600.0])
def test_a_neighbour_out_of_sight_is_remembered_as_long_whatever_the_clock_does(jump):
    """Forward, it was forgotten at once; back, it was remembered for an hour."""
    kept = []
    for off in (0.0, jump):
        rows = one_robot()
        count = 0
        for k in range(40):
            rows.fill(now_s=k * DT + (off if k >= 5 else 0.0), goal_distance=5.0)
            rows.see([seen(7, 2.0, 0.5)] if k < 4 else [])
            tick(rows)
            count += bool((rows.shared["track_id"] == 7).any())
        kept.append(count)
    assert 10 < kept[0] < 20
    assert kept[1] == kept[0]


def test_robots_arrive_with_clocks_that_jump_back_an_hour_and_answers_that_are_lost():
    starts = [(-4.0, 1.2 * k - 3.0, 0.0) for k in range(6)]
    goals = [(4.0, 3.0 - 1.2 * k) for k in range(6)]
    trees = [circle(x, y, 0.3) for x in (-2.0, 0.0, 2.0) for y in (-2.0, -0.7, 0.6, 1.9)]
    faults = {"clock_jumps_per_h": 1800, "clock_jump_s": 3600.0}
    more = {"seed": 3, "limit_s": 60.0, "radio": {"loss": 0.5}}
    jumpy = run_scenario(place_scenario(starts, goals, trees, faults=faults, **more))
    steady = run_scenario(place_scenario(starts, goals, trees, **more))
    assert jumpy.robots["clock_jumps"].sum() > 30
    assert steady.robots["arrived"].all()
    assert jumpy.robots["arrival_s"].tolist() == steady.robots["arrival_s"].tolist()
    for one, other in zip(jumpy.records, steady.records, strict=True):
        assert one.tobytes() == other.tobytes()


def test_a_pause_is_time_that_has_passed():
    """While ``Robot`` brakes its planner is not asked, and the neighbours drive on."""
    driver = Driver()
    driver.ticks(3, neighbours=[(4, 2.0, 0.5, 0.0)])
    shared = driver.robot.rows.shared
    assert (shared["track_id"] == 4).any()
    driver.ticks(15, goal=None)
    driver.tick()
    assert not (shared["track_id"] == 4).any()
