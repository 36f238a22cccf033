"""The scenario of a world, and the score."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarmscope.barn.rules import scenario_of, score
from swarmscope.barn.runs import Choice, Played
from swarmscope.barn.summary import pairs_of, rows_of
from swarmscope.barn.worlds import GOAL, START, BarnWorld
from swarmscope.errors import ConfigError

WORLD = BarnWorld(36, np.array([[-1.5, 6.0, 0.075], [-3.0, 7.0, 0.075]]), START, GOAL, 12.0)


def test_the_score_by_hand():
    # A way of 12 m takes 6 s at 2 m/s: the full half up to 12 s, an eighth from 48 s on.
    assert score(6.0, 12.0) == score(12.0, 12.0) == 0.5
    assert score(15.0, 12.0) == pytest.approx(0.4)
    assert score(24.0, 12.0) == pytest.approx(0.25)
    assert score(48.0, 12.0) == score(99.0, 12.0) == 0.125
    assert score(math.nan, 12.0) == 0.0


def test_the_scenario_of_a_world_says_what_the_benchmark_says():
    scenario = scenario_of(WORLD, "nav-scope", 1.5)
    place, robot, guard = scenario.place, scenario.robot, scenario.guard
    assert [one.center for one in place.world.obstacles] == [(-1.5, 6.0), (-3.0, 7.0)]
    assert place.starts == [START] and place.goals == [GOAL]
    assert (scenario.robots, scenario.limit_s, robot.v_max_mps, robot.a_max_mps2) == (1, 100.0, 1.5, 2.0)
    assert (robot.radius_m, robot.half_width_m, robot.sensor_delay_s) == (0.215, 0.215, 0.05)
    assert (scenario.lidar.beams, scenario.lidar.range_m, scenario.lidar.rate_hz) == (360, 5.0, 20.0)
    assert (guard.others_mps, guard.thinnest_m, scenario.safety.look_ahead_m) == (0.0, 0.1, 1.0)


def test_the_guard_counts_on_nothing_thinner_than_what_stands_there():
    thin = WORLD._replace(discs=np.array([[-1.5, 6.0, 0.075], [-3.0, 7.0, 0.02]]))
    assert scenario_of(thin, "nav-scope", 1.0).guard.thinnest_m == 0.04


def test_keys_can_be_changed_but_for_those_of_the_benchmark():
    assert scenario_of(WORLD, "nav-scope", 1.0, ["safety.look_ahead_m=3"]).safety.look_ahead_m == 3.0
    for change in ("robots=2", "robot.v_max_mps=3", "planner.name=orca", "place.goals=[]", "task.name=T1"):
        with pytest.raises(ConfigError, match=f"--set {change.partition('=')[0]}"):
            scenario_of(WORLD, "nav-scope", 1.0, [change])
    with pytest.raises(ConfigError, match=r"world 36: safety\.lok_ahead_m: unknown key"):
        scenario_of(WORLD, "nav-scope", 1.0, ["safety.lok_ahead_m=3"])
    with pytest.raises(ConfigError, match=r"world 36: robot\.v_max_mps"):
        scenario_of(WORLD, "nav-scope", -1.0)


def played(world, planner, time_s, **more):
    values = {"collided": False, "why": "", "clearance_m": 0.1} | more
    values |= {"time_s": time_s, "arrived": math.isfinite(time_s), "score": score(time_s, 12.0)}
    return Played(world, planner, 2.0, path_m=12.0, own_path=True, **values)


def test_rows_and_pairs_by_hand():
    first = [played(0, "a", 10.0), played(2, "a", 24.0), played(4, "a", math.nan, collided=True, clearance_m=0.0)]
    second = [played(0, "b", 24.0), played(2, "b", math.nan), played(4, "b", math.nan)]
    choices = [Choice("a", 2.0), Choice("b", 2.0)]
    row, other = rows_of([*first, *second], choices)
    assert (row.arrived, row.worlds, row.collisions, row.clearance_m) == (2, 3, 1, 0.0)
    assert row.score.estimate == pytest.approx((0.5 + 0.25) / 3)
    assert row.quartiles_s == pytest.approx((13.5, 17.0, 20.5))
    assert row.share.low == pytest.approx(0.2077, abs=1e-4) and row.share.high == pytest.approx(0.9385, abs=1e-4)
    assert other.arrived == 1 and other.collisions == 0
    (pair,) = pairs_of([*first, *second], choices)
    assert pair.score.estimate == pytest.approx((0.25 + 0.25) / 3)
    assert (pair.first, pair.second, pair.only_first, pair.only_second) == ("a", "b", 1, 0)


def test_a_row_without_arrivals_has_no_times():
    (row,) = rows_of([played(0, "a", math.nan, clearance_m=math.nan)], [Choice("a", 2.0)])
    assert row.arrived == 0 and all(map(math.isnan, (*row.quartiles_s, row.clearance_m)))
