"""What the guard and the LiDAR keep a robot from is said before the run, and what passes arrives."""

from __future__ import annotations

import numpy as np
import pytest

from helpers import place_scenario, run_scenario, wall
from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.tasks import check_setup, load_task, task_names
from swarmscope.tasks._check import Keeping

LINE = wall((-5, 2), (5, 2))


def goal_at(distance, **more):
    """A goal so far from the surface of a wall."""
    return place_scenario([(-1, -1, 1.5)], [(-1, 1.99 - distance)], [LINE], limit_s=60.0, **more)


def row_of(apart, robots=6, **more):
    """Goals in a row."""
    starts = [(-4.0, -2.0 + 0.8 * k, 0.0) for k in range(robots)]
    return place_scenario(starts, [(3.0, (k - 2.5) * apart) for k in range(robots)], limit_s=200.0, **more)


def door_of(width, **more):
    blocks = [[-3.0, -0.5 * width], [0.5 * width, 3.0]]
    boxes = [{"type": "polygon", "points": [[-0.05, a], [0.05, a], [0.05, b], [-0.05, b]]} for a, b in blocks]
    room = wall((-5, -3), (5, -3), (5, 3), (-5, 3), (-5, -3))
    bounds = (-5.2, -3.2, 5.2, 3.2)
    return place_scenario([(-3, 1, 0)], [(3, -1)], [*boxes, room], bounds, lidar={"range_min_m": 0.3}, **more)


def setup_of(values):
    return make_setup(parse_scenario(values, "test"))


@pytest.mark.parametrize("distance", [0.155, 0.17, 0.179])
def test_a_goal_closer_to_a_wall_than_robots_come_is_refused_with_what_would_do(distance):
    with pytest.raises(ConfigError, match=r"guard\.footprint_clearance_m: robot 0 cannot arrive.* 0\.18 m would do"):
        setup_of(goal_at(distance))


def test_a_goal_in_a_wall_is_refused_with_what_would_do():
    with pytest.raises(UnsolvableWorldError, match=r"robot 0: its goal .* 0\.18 m would do"):
        setup_of(goal_at(0.15))


@pytest.mark.parametrize(
    ("more", "key", "least"),
    [
        ({"guard": {"clearance_m": 0.1}}, "guard.clearance_m", 0.25),
        ({"guard": {"footprint_clearance_m": 0.06}}, "guard.footprint_clearance_m", 0.21),
        ({"lidar": {"range_min_m": 0.4}}, "lidar.range_min_m", 0.4),
        ({"robot": {"radius_m": 0.3}}, "guard.footprint_clearance_m", 0.33),
    ],
)
def test_the_key_that_asks_for_most_room_is_named(more, key, least):
    with pytest.raises(ConfigError, match=f"^{key}: .* {least:g} m would do"):
        setup_of(goal_at(least - 0.01, **more))
    assert setup_of(goal_at(least, **more)) is not None


@pytest.mark.parametrize("planner", ["nav-scope", "dh-bug", "sfm-mas"])
def test_a_goal_as_close_as_allowed_is_reached(planner):
    trace = run_scenario(goal_at(0.18, planner={"name": planner}))
    assert trace.robots["arrived"].tolist() == [1]
    assert not trace.robots["crashed"].any()


def test_who_starts_at_its_goal_may_stand_as_close_as_it_likes():
    assert setup_of(place_scenario([(0, 1.83, 0.0)], [(0, 1.83)], [LINE])) is not None


def test_goals_in_a_row_that_is_too_dense_are_refused_with_the_least_spacing():
    with pytest.raises(ConfigError, match=r"guard\.footprint_clearance_m: robots 0 and 1 .*0\.320 m apart.* 0\.36 m"):
        setup_of(row_of(0.32))
    with pytest.raises(ConfigError, match=r"lidar\.range_min_m: robots 0 and 1 .* 0\.55 m"):
        setup_of(row_of(0.5, lidar={"range_min_m": 0.4}))


@pytest.mark.parametrize("planner", ["nav-scope", "orca"])
def test_goals_in_a_row_as_dense_as_allowed_are_all_reached(planner):
    trace = run_scenario(row_of(0.36, planner={"name": planner}))
    assert trace.robots["arrived"].all()
    assert not trace.robots["crashed"].any()


def test_a_parked_row_is_nobodys_goal_to_reach():
    parked = [(2.0, 0.31 * k, 0.0) for k in range(3)]
    goals = [(2.0, 0.31 * k) for k in range(3)]
    assert setup_of(place_scenario([(-3, 0, 0), *parked], [(-1, 0), *goals])) is not None
    with pytest.raises(ConfigError, match="robots 0 and 1"):
        setup_of(place_scenario([(-3, 0, 0), *parked], [(2.0, -0.33), *goals]))


@pytest.mark.parametrize("width", [0.5, 0.6, 0.61])
def test_a_door_in_which_the_lidar_sees_nothing_is_refused_with_the_narrowest(width):
    with pytest.raises(ConfigError, match=r"lidar\.range_min_m: robot 0 has no way .* 0\.65 m wide"):
        setup_of(door_of(width))


def test_the_narrowest_door_that_was_named_is_passed():
    trace = run_scenario(door_of(0.65))
    assert trace.robots["arrived"].tolist() == [1]
    assert not trace.robots["crashed"].any()


def test_a_task_is_checked_against_the_guard_too():
    values = {"task": {"name": "doorway"}, "robots": 2, "guard": {"clearance_m": 0.5}}
    with pytest.raises(ConfigError, match=r"guard\.clearance_m: "):
        setup_of(values)


def test_wide_robots_of_task_one_of_giwt_keep_apart():
    for seed in range(3):
        setup = load_task("GIWT_1").make(seed, 8, 0.6, fewest=2, most=4)
        check_setup(setup, 0.6)
        points = np.vstack([setup.starts[:, :2], setup.goals[:1]])
        gaps = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))[np.triu_indices(9, 1)]
        assert gaps.min() >= 1.6 - 1e-9


@pytest.mark.parametrize("name", task_names())
@pytest.mark.parametrize("radius", [0.05, 0.15, 0.3, 0.6, 0.9])
def test_every_task_makes_what_passes_the_check_or_says_why_not(name, radius):
    try:
        setup = load_task(name).make(3, 4, radius)
    except (ConfigError, UnsolvableWorldError):
        assert radius > 0.3
        return
    check_setup(setup, radius, Keeping(0.02, 0.03, 0.0))
