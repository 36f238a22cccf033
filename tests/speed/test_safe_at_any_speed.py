"""Whole runs that once ended with a contact, or would have, at speeds, views and losses that are not the usual ones."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from helpers import circle, place_scenario, run_scenario, wall
from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting


def task(name, robots, seed=1, **more):
    return {"task": {"name": name}, "robots": robots, "seed": seed, "record_scans": "no"} | more


def untouched(values, arrive=True):
    """Run; nobody touches anything, and unless a test says otherwise everybody arrives."""
    robots = run_scenario(values).robots
    assert not robots["crashed"].any()
    assert robots["min_clearance"].min() > 0.0
    assert robots["arrived"].all() or not arrive
    return robots


def test_orca_with_weak_brakes_rounds_the_corridors_corners():
    """Two of 15 robots showed to each other at a corner while their centres were still hidden."""
    untouched(task("corridor", 15, 63001, planner={"name": "orca"}, robot={"v_max_mps": 0.75, "a_max_mps2": 1.0}))


@pytest.mark.parametrize("range_m", [2.0, 5.0])
@pytest.mark.parametrize("a_max", [0.5, 1.0, 2.0])
def test_at_two_metres_a_second_robots_stop_within_what_they_see(a_max, range_m):
    """With 0.5 m/s^2 they need 4 m to stop, twice what the shorter range shows."""
    for seed in range(3):
        robot = {"v_max_mps": 2.0, "a_max_mps2": a_max}
        untouched(task("T3", 8, seed, robot=robot, lidar={"range_m": range_m}))


@pytest.mark.parametrize("name", ["T1", "T3"])
@pytest.mark.parametrize("fov_deg", [60.0, 90.0, 180.0, 270.0, 359.6])
def test_a_limited_view(name, fov_deg):
    untouched(task(name, 4, lidar={"fov_deg": fov_deg}))


@pytest.mark.parametrize("name", ["T1", "T3"])
def test_every_second_reading_gets_lost(name):
    untouched(task(name, 4, noise={"dropout": 0.5}))


END = {"along x": (1.0, 0.0), "along y": (0.0, 1.0)}


@pytest.mark.parametrize("beams", [180, 360])
@pytest.mark.parametrize("axis", sorted(END))
def test_a_wall_that_is_seen_end_on(axis, beams):
    """26 trips on the line of a wall of 4 m and within millimetres beside it: once no beam met the wall."""
    along = np.array(END[axis])
    aside = np.array([-along[1], along[0]])
    yaw = math.atan2(along[1], along[0])
    for mm in (-50, -10, -5, -2, -1, -0.5, 0, 0.5, 1, 2, 5, 10, 50):
        start, goal = -3.0 * along + 1e-3 * mm * aside, 6.0 * along
        values = place_scenario(
            [(*start.tolist(), yaw)],
            [goal.tolist()],
            [wall((0.0, 0.0), (4.0 * along).tolist())],
            limit_s=60.0,
            lidar={"beams": beams},
        )
        untouched(values, arrive=False)


def test_a_narrow_thing_that_slips_between_two_beams_blinds_nobody():
    untouched(place_scenario([(-3, 0.05, 0)], [(6, 0)], [wall((0, 0), (4, 0))], limit_s=60.0))


@pytest.mark.parametrize("robots", [1, 4, 15])
def test_robots_of_60_cm_in_task_one_of_giwt(robots):
    untouched(task("GIWT_1", robots, 2, robot={"radius_m": 0.6, "half_width_m": 0.6}), arrive=False)


@pytest.mark.parametrize(("radius", "said"), [(1.5, "15 robots do not fit"), (2.5, "15 robots do not fit")])
def test_robots_too_wide_for_task_one_of_giwt_are_refused(radius, said):
    values = task("GIWT_1", 15, 2, robot={"radius_m": radius, "half_width_m": radius}, lidar={"beams": 1000})
    with pytest.raises(UnsolvableWorldError, match=said):
        make_setup(parse_scenario(values, "test"))


def few_beams(beams, lidar=None, **more):
    """One robot, 2 m to drive, round a box and past the end of a wall."""
    things = [circle(0.0, 0.1, 0.2), wall((0.6, -1.0), (0.6, -0.3))]
    lidar = {"beams": beams} | (lidar or {})
    return place_scenario([(-1, 0, 0)], [(1, 0)], things, lidar=lidar, **({"limit_s": 200.0} | more))


def refusal(values):
    scenario = parse_scenario(values, "test")
    with pytest.raises(ConfigError) as refused:
        make_setting(scenario, make_setup(scenario))
    return str(refused.value)


@pytest.mark.parametrize(
    "more",
    [
        {},
        {"robot": {"radius_m": 0.4, "half_width_m": 0.4}},
        {"robot": {"a_max_mps2": 0.25}},
        {"guard": {"thinnest_m": 0.1}},
        {"lidar": {"rate_hz": 1.0}},
        {"lidar": {"fov_deg": 355.0}},
        {"lidar": {"fov_deg": 270.0}},
        {"lidar": {"fov_deg": 90.0}},
    ],
    ids=str,
)
def test_too_few_beams_are_refused_with_the_least_number_and_that_works(more):
    said = refusal(few_beams(8, **more))
    least = int(re.fullmatch(r"lidar\.beams: .*; 8 are too few, (\d+) would do", said)[1])
    assert re.search(f"; {least - 1} are too few, {least} would do", refusal(few_beams(least - 1, **more)))
    untouched(few_beams(least, **more))


def test_a_crowd_at_a_long_wall_ends():
    """60 robots of ORCA at 2 m/s, 10 scans a second of 720 beams whose ranges err by a tenth.

    The whole of it, 300 s, takes 20 s on one core; this is a tenth of it, in which they meet the wall.
    """
    values = task(
        "long_wall",
        60,
        0,
        planner={"name": "orca"},
        robot={"v_max_mps": 2.0, "a_max_mps2": 4.0},
        lidar={"beams": 720, "rate_hz": 10.0},
        noise={"range_fraction": 0.1},
        limit_s=30.0,
    )
    robots = untouched(values, arrive=False)
    assert robots["length"].max() > 2.0


SWEPT = {
    "a door at 2.3 m/s": task(
        "doorway",
        2,
        44,
        planner={"name": "nav-i"},
        robot={"v_max_mps": 2.339, "a_max_mps2": 1.52},
        lidar={"range_m": 2.16, "rate_hz": 9.8},
        guard={"clearance_m": 0.0},
        limit_s=21.1,
    ),
    "a field of 359.6 degrees": task(
        "T2",
        12,
        102,
        robot={"v_max_mps": 1.962, "a_max_mps2": 0.714},
        lidar={"range_m": 1.25, "fov_deg": 359.6, "rate_hz": 9.66},
        guard={"clearance_m": 0.0},
        limit_s=174.7,
    ),
    "a door at 1.2 m/s": task(
        "doorway",
        4,
        306,
        robot={"v_max_mps": 1.198, "a_max_mps2": 2.689},
        lidar={"range_m": 6.4, "rate_hz": 7.55},
        guard={"clearance_m": 0.02},
        limit_s=20.7,
    ),
    "slow scans": task(
        "GIWT_2",
        6,
        651,
        robot={"v_max_mps": 0.245, "a_max_mps2": 0.717},
        lidar={"range_m": 3.47, "rate_hz": 1.32},
        guard={"clearance_m": 0.0},
        limit_s=305.9,
    ),
}


@pytest.mark.parametrize("name", sorted(SWEPT))
def test_what_a_sweep_has_found(name):
    untouched(SWEPT[name], arrive=False)
    untouched(SWEPT[name] | {"limit_s": 2.0 * SWEPT[name]["limit_s"]}, arrive=name != "slow scans")


def test_a_command_that_is_heeded_at_once_is_judged_by_the_way_that_it_takes():
    """Scans up to 0.1 s old: the guard shifted its ways ahead, and a robot that turned sharply grazed a tree."""
    rng = np.random.default_rng([2, 5])
    values = task("T3", 1, 2, planner={"name": "dh-bug"}, limit_s=60.0)
    values["noise"] = {"range_fraction": 0.01, "scan_age_s": 0.1}
    for seed in range(12):
        sheet = {"v_max_mps": float(rng.uniform(0.8, 1.5)), "a_max_mps2": 1.2, "w_max_radps": 4.0}
        untouched(values | {"seed": seed, "robot": sheet | {"radius_m": 0.29, "half_width_m": 0.29}}, arrive=False)
