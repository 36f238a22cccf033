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
from helpers import DT, circles_world, mirrored, one_robot, place_scenario, rig_of, run_scenario, scan_at, seen, tick
from swarmscope.held import Held
from swarmscope.onboard.percept import MAX_OUTBOX, PERCEPT
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.onboard.reasons import ARRIVED, STATE_NAMES
from swarmscope.onboard.sharing.message import OK, decode
from swarmscope.onboard.view import arrays_of, new_swarm

PLANNERS = planner_names()
MEMORY_LIMIT = 20_200
"""Bytes of planner memory per robot."""
ROOM = dict.fromkeys((name for name in PLANNERS if name.startswith("atlas")), 270_000)
"""Of planners that keep a map: what is set aside for the largest; what a place takes of it is less (docs/atlas.md)."""
LATENTS = 1_200
"""Bytes more for planners that keep what the networks of eight neighbours say."""
TEMPORARY = tempfile.TemporaryDirectory(prefix="swarmscope-models-")
every_planner = pytest.mark.parametrize("name", PLANNERS)


@cache
def model_of(name):
    """The folder of a network with random weights, None for planners without a network."""
    model = load_planner(name).model
    return model and make_model(Path(TEMPORARY.name) / name, network=min(model.networks))


@cache
def usable(name):
    """The planner, with a network of random weights where it needs one."""
    planner, model = load_planner(name), model_of(name)
    return planner if model is None else planner.with_model(model)


def robot_of(name):
    """A robot of the planner, its goal 5 m ahead."""
    robot = one_robot(planner=usable(name))
    robot.fill(goal_distance=5.0)
    return robot


def three_of(name):
    """The planner, the rows of three robots with goals 5 m ahead, their memory, and its parameters."""
    planner, swarm = usable(name), new_swarm(3, rig_of())
    swarm.percepts["dt_s"], swarm.percepts["goal_distance"] = DT, 5.0
    return planner, swarm, planner.new_memory(3), planner.params()


def command(robot):
    return robot.said("v"), robot.said("w")


def step(robot):
    """Make one tick and assert what holds after any; return the robot."""
    tick(robot)
    d, body = robot.decision, robot.rig.body
    assert np.isfinite(d["v"])
    assert np.isfinite(d["w"])
    assert 0.0 <= d["v"] <= body.v_max_mps + 1e-9
    assert np.abs(d["w"]) <= body.w_max_radps + 1e-9
    assert np.isfinite(d["heading"])
    assert d["state"] < len(STATE_NAMES)
    assert d["reason"] < len(robot.planner.reasons)
    assert d["side"] in (-1, 0, 1)
    assert 0 <= d["n_out"] <= MAX_OUTBOX
    for k in range(d["n_out"]):
        assert decode(d["out"][k], int(d["out_length"][k]), np.zeros(6, np.int64)) == OK
    for p in (d["p_self"], d["p_left"]):
        assert np.isnan(p) or 0.0 <= p <= 1.0
    return robot


def random_scene(name, seed, mirror=False):
    """A robot among random trees with a random goal."""
    robot = robot_of(name)
    rng = np.random.default_rng(seed)
    trees = np.column_stack([rng.uniform(-3, 3, (15, 2)), rng.uniform(0.1, 0.35, 15)])
    trees = trees[np.hypot(trees[:, 0], trees[:, 1]) - trees[:, 2] > 0.25]
    goal, speed = rng.uniform(-1.0, 1.0), rng.uniform(0.0, 0.2)
    ranges = scan_at(circles_world(trees), robot.rig)
    robot.scan[:] = mirrored(ranges) if mirror else ranges
    robot.fill(goal_bearing=-goal if mirror else goal, speed=speed)
    return robot


@every_planner
@settings(max_examples=40)
@given(seed=st.integers(0, 2**31))
def test_outputs_are_finite_and_within_limits(name, seed):
    robot = random_scene(name, seed)
    rng = np.random.default_rng(seed)
    for _ in range(10):
        robot.see([seen(k + 1, *rng.uniform(-3, 3, 2), rng.uniform(-3, 3)) for k in range(rng.integers(0, 4))])
        robot.fill(odom_x=rng.uniform(0, 0.1), compass=rng.uniform(-3, 3))
        step(robot)


@every_planner
def test_the_same_inputs_give_the_same_outputs(name):
    a, b = (random_scene(name, 5) for _ in range(2))
    for _ in range(5):
        step(a)
        step(b)
    for x, y in zip((a.decision, a.memory, a.shared), (b.decision, b.memory, b.shared), strict=True):
        assert x.tobytes() == y.tobytes()


@every_planner
def test_a_step_changes_its_own_rows_only(name):
    planner, swarm, memories, params = three_of(name)
    for k in range(3):
        swarm.scans[k] = scan_at(circles_world([(0.7, 0.1 * k, 0.3)]), swarm.rig)
    arrays = [*arrays_of(swarm), memories]
    before = [a.copy() for a in arrays]
    given = swarm.scans.tobytes(), swarm.percepts.tobytes()
    decided = swarm.decisions[1].tobytes()
    planner.step_all(1, 2, Held(swarm), memories, params)
    for a, b in zip(arrays, before, strict=True):
        assert a[0].tobytes() == b[0].tobytes()
        assert a[2].tobytes() == b[2].tobytes()
    assert (swarm.scans.tobytes(), swarm.percepts.tobytes()) == given
    assert swarm.decisions[1].tobytes() != decided


@every_planner
def test_the_number_of_robots_in_a_call_does_not_matter(name):
    (planner, together, memories, params), (_, apart, other_memories, _) = three_of(name), three_of(name)
    for swarm in (together, apart):
        for k in range(3):
            swarm.scans[k] = scan_at(circles_world([(1.0, 0.2 * k - 0.2, 0.3), (0.0, 1.0 + k, 0.5)]), swarm.rig)
    planner.step_all(0, 3, Held(together), memories, params)
    for k in (2, 0, 1):
        planner.step_all(k, k + 1, Held(apart), other_memories, params)
    assert together.decisions.tobytes() == apart.decisions.tobytes()


@every_planner
@settings(max_examples=60)
@given(seed=st.integers(0, 2**31))
def test_the_mirrored_scene_gets_the_mirrored_command(name, seed):
    if model_of(name) is not None or name in ROOM:
        pytest.skip("a network is not its own mirror image, nor is a grid whose robots keep to the right")
    here, there = random_scene(name, seed), random_scene(name, seed, mirror=True)
    for _ in range(4):
        v, w = command(step(here))
        if abs(here.said("p_left") - 0.5) < 1e-3:
            return
        assert command(step(there)) == pytest.approx((v, -w), abs=1e-5)
        assert there.said("side") == -here.said("side")
        assert there.said("state") == here.said("state")


@every_planner
@settings(max_examples=40)
@given(seed=st.integers(0, 2**31), beams=st.integers(1, 359))
def test_turning_the_robot_turns_its_heading(name, seed, beams):
    """The scene seen by a robot turned by whole beams: the direction wanted is the same in the world."""
    here, there = random_scene(name, seed), random_scene(name, seed)
    turn = beams * here.rig.sensor.increment
    there.scan[:] = np.roll(here.scan, -beams)
    there.fill(goal_bearing=math.remainder(here.percept["goal_bearing"] - turn, 2.0 * math.pi), compass=turn)
    here.fill(speed=0.0)
    there.fill(speed=0.0)
    step(here)
    step(there)
    difference = there.said("heading") + turn - here.said("heading")
    assert math.remainder(difference, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-6)
    assert there.said("side") == here.said("side")


@every_planner
def test_the_first_tick_with_an_empty_percept(name):
    robot = one_robot(planner=usable(name))
    robot.swarm.percepts[:] = np.zeros((), PERCEPT)
    robot.fill(dt_s=DT)
    step(robot)


@every_planner
@pytest.mark.parametrize("value", [math.nan, -1.0, -math.inf])
def test_a_useless_scan_stops_the_robot(name, value):
    robot = robot_of(name)
    robot.scan[:] = value
    for _ in range(20):
        assert step(robot).said("v") < 1e-6


@every_planner
def test_with_nothing_in_range_it_drives_to_the_goal(name):
    robot = robot_of(name)
    assert command(step(robot)) == pytest.approx((0.5, 0.0))
    robot.fill(goal_bearing=0.3)
    assert step(robot).said("w") > 0.0


@every_planner
def test_at_the_goal_it_stands_still_for_good(name):
    robot = robot_of(name)
    robot.fill(goal_distance=0.0)
    assert command(step(robot)) == (0.0, 0.0)
    assert robot.said("state") == ARRIVED
    robot.fill(goal_distance=0.2)
    assert command(step(robot)) == (0.0, 0.0)


@every_planner
def test_an_obstacle_ahead_is_not_driven_at(name):
    robot = robot_of(name)
    robot.scan[:] = scan_at(circles_world([(0.6, 0.05, 0.3)]), robot.rig)
    for _ in range(5):
        step(robot)
        assert abs(robot.said("heading")) > math.radians(30.0) or robot.said("v") == 0.0


@every_planner
def test_memory_per_robot_stays_small(name):
    model = model_of(name)
    planner = {"name": name} if model is None else {"name": name, "model": str(model)}
    trace = run_scenario(place_scenario([(0.0, 0.0, 0.0)], [(1.0, 0.0)], planner=planner, limit_s=1.0))
    assert 0 < trace.memory_bytes <= ROOM.get(name, MEMORY_LIMIT) + (0 if model is None else LATENTS)


def test_the_percept_has_no_global_pose():
    relative = {"neighbour_x", "neighbour_y", "odom_x", "odom_y", "scan_x", "scan_y"}
    for field in PERCEPT.names:
        words = set(field.split("_"))
        if field not in relative:
            assert not words & {"x", "y", "pose", "position", "world", "map", "gps", "lat", "lon"}, field


def test_the_percept_has_no_field_for_what_only_others_know():
    """The side of the shortest way is told in the memory of planners that declare it, never in the percept."""
    for field in PERCEPT.names:
        assert not set(field.split("_")) & {"told", "side", "advice", "oracle", "seed", "truth", "true"}, field
    told = {name for name in PLANNERS if load_planner(name).is_told}
    assert told == {"dh-bug", "oracle"}
