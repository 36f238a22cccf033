"""A map that is free up to the edge of its picture ends there: for robots, sensors, starts, goals and ways."""

from __future__ import annotations

import numpy as np
import pytest

from helpers import beams_of, rig_of, run_scenario
from swarmscope.judging.shortest_path import any_angle_paths, grid_paths
from swarmscope.scenarios.places import make_setup, world_of
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.lidar import cast_static
from swarmscope.sim.maps import load_map, save_map
from swarmscope.sim.world import compile_world, grid_from_solid
from swarmscope.tasks import UnsolvableWorldError

SIDE = (-4.0, -3.0, 4.0, 3.0)


@pytest.fixture
def open_map(tmp_path):
    """8 x 6 m, free up to the edge, a wall from the top down to 1 m above the bottom."""
    solid = np.zeros((60, 80), np.uint8)
    solid[10:, 40] = 1
    save_map(grid_from_solid(solid, 0.1, SIDE[:2]), tmp_path / "map.yaml")
    return tmp_path / "map.yaml"


def scenario(path, robots, **more):
    values = {"map": {"file": str(path), "min_distance_m": 3.0}, "robots": robots, "limit_s": 60.0} | more
    return {**values, "record_scans": "no"}


def test_sensing_and_contact_end_at_the_edge(open_map):
    spec = world_of(load_map(open_map))
    assert spec.bounds == pytest.approx(SIDE)
    world, rig = compile_world(spec), rig_of()
    out = np.full(rig.sensor.beams, np.inf, np.float32)
    cast_static(world, -3.0, -2.0, 0.0, beams_of(rig), out)
    assert out[0] == pytest.approx(1.0, abs=1e-6)
    assert out[90] == pytest.approx(1.0, abs=1e-6)
    assert static_clearance(world, -3.8, 0.0, -3.8, 1.0, 1.0) == pytest.approx(0.2)
    assert static_clearance(world, -3.8, 0.0, -9.0, 0.0, 1.0) == 0.0


def test_starts_goals_and_ways_stay_inside(open_map):
    setup = make_setup(parse_scenario(scenario(open_map, 15, seed=3), "test"))
    for points in (setup.starts[:, :2], setup.goals):
        assert np.all(points >= np.array(SIDE[:2]) + 0.2)
        assert np.all(points <= np.array(SIDE[2:]) - 0.2)
    starts, goals = np.array([[-2.0, 2.5, 0.0]]), np.array([[2.0, 2.5]])
    for ways in (grid_paths, any_angle_paths):
        (way,) = ways(setup.world, starts, goals, 0.15)
        assert np.all(way.points >= np.array(SIDE[:2]) + 0.1)
        assert np.all(way.points <= np.array(SIDE[2:]) - 0.1)
        assert way.length_m > 8.0  # below the wall; past the edge it is 4.9 m


def test_a_wall_across_the_map_parts_it(tmp_path):
    solid = np.zeros((60, 80), np.uint8)
    solid[:, 12] = 1
    save_map(grid_from_solid(solid, 0.1, SIDE[:2]), tmp_path / "map.yaml")
    setup = make_setup(parse_scenario(scenario(tmp_path / "map.yaml", 10), "test"))
    assert np.all(setup.starts[:, 0] > SIDE[0] + 1.3)
    assert np.all(setup.goals[:, 0] > SIDE[0] + 1.3)
    far = scenario(tmp_path / "map.yaml", 1)
    far["map"]["min_distance_m"] = 12.0
    with pytest.raises(UnsolvableWorldError):
        make_setup(parse_scenario(far, "test"))


def test_no_robot_leaves_the_map(open_map):
    trace = run_scenario(scenario(open_map, 8, seed=1))
    x, y = trace.records.x, trace.records.y
    assert not trace.robots["crashed"].any()
    assert x.min() > SIDE[0] and x.max() < SIDE[2] and y.min() > SIDE[1] and y.max() < SIDE[3]
