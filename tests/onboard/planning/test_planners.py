"""The same contract for every planner in the folder."""

from __future__ import annotations

import math
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from giwt_models import make_model
from helpers import DT, Rows, circles_world, mirrored, place_scenario, rig_of, run_scenario, scan_at
from swarmscope.onboard.percept import MAX_OUTBOX, PERCEPT
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.onboard.reasons import ARRIVED, REASON_NAMES, STATE_NAMES
from swarmscope.onboard.sharing.message import OK, decode

PLANNERS = planner_names()
MEMORY_LIMIT = 14_900
"""Bytes of planner memory per robot."""
LATENTS = 1_200
"""Bytes more for planners that keep what the networks of eight neighbours say."""
TEMPORARY = tempfile.TemporaryDirectory(prefix="swarmscope-models-")
every_planner = pytest.mark.parametrize("name", PLANNERS)


@cache
def model_of(name):
    """The folder of a network with random weights, None for planners without a network."""
    networks = getattr(getattr(load_planner(name), "PLANNER", None), "networks", None)
    return networks and make_model(Path(TEMPORARY.name) / name, network=min(networks))


@cache
def usable(name):
    """The planner, with a network of random weights where it needs one."""
    planner, model = load_planner(name), model_of(name)
    return planner if model is None else planner.with_model(model)


class Robots(Rows):
    """Rows of robots with a planner's memory."""

    def __init__(self, name, robots=1, rig=None):
        super().__init__(rig or rig_of(), robots)
        self.planner = usable(name)
        self.params = self.planner.Params()
        self.memories = self.planner.new_memory(robots)
        self.percepts["goal_distance"] = 5.0

    def step(self, first=0, last=None):
        last = len(self.percepts) if last is None else last
        arrays = (self.ranges, self.percepts, self.shared, self.memories, self.decisions, self.scratch)
        self.planner.step_all(first, last, *arrays, self.rig, self.params)
        self.percepts["now_s"] += DT
        return self

    def command(self):
        return float(self.decisions["v"][0]), float(self.decisions["w"][0])

    def check(self):
        """Assert what holds after any step."""
        d, body = self.decisions, self.rig.body
        assert np.isfinite(d["v"]).all()
        assert np.isfinite(d["w"]).all()
        assert ((d["v"] >= 0.0) & (d["v"] <= body.v_max_mps + 1e-9)).all()
        assert (np.abs(d["w"]) <= body.w_max_radps + 1e-9).all()
        assert np.isfinite(d["heading"]).all()
        assert (d["state"] < len(STATE_NAMES)).all()
        assert (d["reason"] < len(REASON_NAMES)).all()
        assert np.isin(d["side"], (-1, 0, 1)).all()
        assert ((d["n_out"] >= 0) & (d["n_out"] <= MAX_OUTBOX)).all()
        for i in range(len(d)):
            for k in range(d["n_out"][i]):
                assert decode(d["out"][i, k], int(d["out_length"][i, k]), np.zeros(5, np.int64)) == OK
        for p in (d["p_self"], d["p_left"]):
            assert (np.isnan(p) | ((p >= 0.0) & (p <= 1.0))).all()


def random_scene(robots, seed, mirror=False):
    """Random trees, goal and neighbours for robot 0."""
    rng = np.random.default_rng(seed)
    trees = np.column_stack([rng.uniform(-3, 3, (15, 2)), rng.uniform(0.1, 0.35, 15)])
    trees = trees[np.hypot(trees[:, 0], trees[:, 1]) - trees[:, 2] > 0.25]
    goal, speed = rng.uniform(-1.0, 1.0), rng.uniform(0.0, 0.2)
    sign = -1.0 if mirror else 1.0
    ranges = scan_at(circles_world(trees), robots.rig)
    robots.ranges[0] = mirrored(ranges) if mirror else ranges
    robots.percepts["goal_bearing"][0] = sign * goal
    robots.percepts["speed"][0] = speed
    return robots


@every_planner
@settings(max_examples=40)
@given(seed=st.integers(0, 2**31))
def test_outputs_are_finite_and_within_limits(name, seed):
    robots = random_scene(Robots(name), seed)
    rng = np.random.default_rng(seed)
    for _ in range(10):
        robots.see(*((k + 1, *rng.uniform(-3, 3, 2), rng.uniform(-3, 3)) for k in range(rng.integers(0, 4))))
        robots.percepts["odom_x"], robots.percepts["compass"] = rng.uniform(0, 0.1), rng.uniform(-3, 3)
        robots.step().check()


@every_planner
def test_the_same_inputs_give_the_same_outputs(name):
    a, b = (random_scene(Robots(name), 5) for _ in range(2))
    for _ in range(5):
        a.step()
        b.step()
    for x, y in zip((a.decisions, a.memories, a.shared), (b.decisions, b.memories, b.shared), strict=True):
        assert x.tobytes() == y.tobytes()


@every_planner
def test_a_step_changes_its_own_rows_only(name):
    robots = Robots(name, 3)
    for k in range(3):
        robots.ranges[k] = scan_at(circles_world([(0.7, 0.1 * k, 0.3)]), robots.rig)
    arrays = [
        robots.percepts,
        robots.shared,
        robots.memories,
        robots.decisions,
        robots.ranges,
        *robots.scratch,
    ]
    before = [a.copy() for a in arrays]
    inputs = robots.ranges.tobytes()
    robots.step(1, 2)
    for a, b in zip(arrays, before, strict=True):
        if a is not robots.percepts:
            assert a[0].tobytes() == b[0].tobytes()
            assert a[2].tobytes() == b[2].tobytes()
    assert robots.ranges.tobytes() == inputs
    robots.percepts["now_s"] -= DT
    assert robots.percepts.tobytes() == before[0].tobytes()
    assert robots.decisions[1].tobytes() != before[3][1].tobytes()


@every_planner
def test_the_number_of_robots_in_a_call_does_not_matter(name):
    together, apart = Robots(name, 3), Robots(name, 3)
    for robots in (together, apart):
        for k in range(3):
            robots.ranges[k] = scan_at(
                circles_world([(1.0, 0.2 * k - 0.2, 0.3), (0.0, 1.0 + k, 0.5)]), robots.rig
            )
    together.step()
    for k in (2, 0, 1):
        apart.step(k, k + 1)
    assert together.decisions.tobytes() == apart.decisions.tobytes()


@every_planner
@settings(max_examples=60)
@given(seed=st.integers(0, 2**31))
def test_the_mirrored_scene_gets_the_mirrored_command(name, seed):
    if model_of(name) is not None:
        pytest.skip("a network is not its own mirror image")
    here, there = random_scene(Robots(name), seed), random_scene(Robots(name), seed, mirror=True)
    for _ in range(4):
        v, w = here.step().command()
        if abs(here.decisions["p_left"][0] - 0.5) < 1e-3:
            return
        assert there.step().command() == pytest.approx((v, -w), abs=1e-5)
        assert there.decisions["side"][0] == -here.decisions["side"][0]
        assert there.decisions["state"][0] == here.decisions["state"][0]


@every_planner
@settings(max_examples=40)
@given(seed=st.integers(0, 2**31), beams=st.integers(1, 359))
def test_turning_the_robot_turns_its_heading(name, seed, beams):
    """The scene seen by a robot turned by whole beams: the direction wanted is the same in the world."""
    here, there = random_scene(Robots(name), seed), random_scene(Robots(name), seed)
    turn = beams * here.rig.sensor.increment
    there.ranges[0] = np.roll(here.ranges[0], -beams)
    there.percepts["goal_bearing"] = math.remainder(here.percepts["goal_bearing"][0] - turn, 2.0 * math.pi)
    there.percepts["compass"] = turn
    here.percepts["speed"] = there.percepts["speed"] = 0.0
    here.step()
    there.step()
    difference = there.decisions["heading"][0] + turn - here.decisions["heading"][0]
    assert math.remainder(difference, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert there.decisions["side"][0] == here.decisions["side"][0]


@every_planner
def test_the_first_tick_with_an_empty_percept(name):
    robots = Robots(name)
    robots.percepts[:] = np.zeros((), PERCEPT)
    robots.percepts["dt_s"] = DT
    robots.step().check()


@every_planner
@pytest.mark.parametrize("value", [math.nan, -1.0, -math.inf])
def test_a_useless_scan_stops_the_robot(name, value):
    robots = Robots(name)
    robots.ranges[:] = value
    for _ in range(20):
        robots.step().check()
        assert robots.decisions["v"][0] < 1e-6


@every_planner
def test_with_nothing_in_range_it_drives_to_the_goal(name):
    robots = Robots(name)
    robots.step().check()
    assert robots.command() == pytest.approx((0.5, 0.0))
    robots.percepts["goal_bearing"] = 0.3
    robots.step().check()
    assert robots.command()[1] > 0.0


@every_planner
def test_at_the_goal_it_stands_still_for_good(name):
    robots = Robots(name)
    robots.percepts["goal_distance"] = 0.0
    robots.step().check()
    assert robots.command() == (0.0, 0.0)
    assert robots.decisions["state"][0] == ARRIVED
    robots.percepts["goal_distance"] = 0.2
    robots.step()
    assert robots.command() == (0.0, 0.0)


@every_planner
def test_an_obstacle_ahead_is_not_driven_at(name):
    robots = Robots(name)
    robots.ranges[0] = scan_at(circles_world([(0.6, 0.05, 0.3)]), robots.rig)
    for _ in range(5):
        robots.step().check()
        assert abs(robots.decisions["heading"][0]) > math.radians(30.0) or robots.decisions["v"][0] == 0.0


@every_planner
def test_memory_per_robot_stays_small(name):
    model = model_of(name)
    planner = {"name": name} if model is None else {"name": name, "model": str(model)}
    trace = run_scenario(place_scenario([(0.0, 0.0, 0.0)], [(1.0, 0.0)], planner=planner, limit_s=1.0))
    assert 0 < trace.memory_bytes <= MEMORY_LIMIT + (0 if model is None else LATENTS)


def test_the_percept_has_no_global_pose():
    relative = {"neighbour_x", "neighbour_y", "odom_x", "odom_y"}
    for field in PERCEPT.names:
        words = set(field.split("_"))
        if field not in relative:
            assert not words & {"x", "y", "pose", "position", "world", "map", "gps", "lat", "lon"}, field
