"""The robot's own time: jumps of its clock are no time that has passed, and waits end all the same."""

from __future__ import annotations

import numpy as np
import pytest

from helpers import DT, circle, one_robot, place_scenario, run_scenario, seen, tick
from robots import Driver
from swarmscope.onboard.perception.clock import JUMP_PERIODS, keep_time


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
def test_a_clock_that_does_not_jump_is_taken_to_the_last_bit(start):
    steps = [DT, 2.0 * DT, 0.99 * JUMP_PERIODS * DT, 0.5 * DT]
    said = start
    for step, found in zip([0.0, *steps], times(steps, start), strict=True):
        said += step
        assert found == said


@pytest.mark.parametrize("jump", [3600.0, -3600.0, 5.0, -1.5])
def test_after_a_jump_time_goes_on_as_if_nothing_had_happened(jump):
    found = times([DT, DT, DT + jump, DT, DT, DT - jump, DT])
    assert found == pytest.approx(DT * np.arange(8), abs=1e-9)


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
    assert jumpy.robots["arrival_s"] == pytest.approx(steady.robots["arrival_s"], abs=2.0)


def test_a_pause_is_time_that_has_passed():
    """While ``Robot`` brakes its planner is not asked, and the neighbours drive on."""
    driver = Driver()
    driver.ticks(3, neighbours=[(4, 2.0, 0.5, 0.0)])
    shared = driver.robot.rows.shared
    assert (shared["track_id"] == 4).any()
    driver.ticks(15, goal=None)
    driver.tick()
    assert not (shared["track_id"] == 4).any()
