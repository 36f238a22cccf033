"""Robots of several sizes, speeds and starting times in one run, and headings at goals."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import circle, one_robot, place_scenario, rig_of, run_scenario, scan_at, wall, world_of
from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.onboard.control.corners import apart_round, touch_round
from swarmscope.onboard.sharing.tracks import measure_bodies, update_tracks
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario

HEADINGS = np.linspace(0.0, 2.0 * math.pi, 6, endpoint=False)


def crossing(sheets, **more):
    """Robots on a circle, each to the other side."""
    ring = 4.0 * np.column_stack([np.cos(HEADINGS), np.sin(HEADINGS)])[: len(sheets)]
    starts = [(*place, math.atan2(-place[1], -place[0])) for place in ring.tolist()]
    return place_scenario(starts, (-ring).tolist(), robot=sheets, **more)


MIXED = [
    {"radius_m": 0.12, "half_width_m": 0.12, "v_max_mps": 1.0},
    {"radius_m": 0.4, "half_width_m": 0.4, "v_max_mps": 0.4, "a_max_mps2": 0.5},
    {"radius_m": 0.2, "half_width_m": 0.2, "v_max_mps": 0.7},
    {"radius_m": 0.12, "half_width_m": 0.12, "v_max_mps": 1.0},
    {"radius_m": 0.3, "half_width_m": 0.25},
]


@pytest.mark.parametrize("planner", ["nav-scope", "dh-bug"])
def test_five_of_four_kinds_cross_without_contact_with_any_number_of_threads(planner):
    values = crossing(MIXED, planner={"name": planner})
    one, three = run_scenario(values), run_scenario(values, threads=3)
    assert one.robots["arrived"].all() and one.robots["min_clearance"].min() > 0.0
    assert one.robots["radius"].tolist() == [0.12, 0.4, 0.2, 0.12, 0.3]
    assert (one.records.speed.max(axis=0) <= np.array([1.0, 0.4, 0.7, 1.0, 0.5]) + 1e-6).all()
    assert one.robots.tobytes() == three.robots.tobytes() and one.records.x.tobytes() == three.records.x.tobytes()


def test_a_list_of_equal_sheets_is_the_run_of_one_sheet():
    values = crossing([{}] * 4)
    same = run_scenario(values | {"robot": {}})
    assert run_scenario(values).records.x.tobytes() == same.records.x.tobytes()


def test_who_starts_late_stands_in_silence_until_then():
    trace = run_scenario(crossing([{}, {"start_s": 6.0}]))
    moved = np.flatnonzero(np.hypot(np.diff(trace.records.x[:, 1]), np.diff(trace.records.y[:, 1])) > 0.0)
    assert trace.robots["arrived"].all() and trace.t_s[moved[0]] == pytest.approx(6.0, abs=0.41)
    assert np.ptp(trace.records.x[:5, 0]) > 0.0 and trace.robots["boots"].tolist() == [0, 0]


def test_as_many_robots_as_sheets_and_an_error_for_another_number():
    assert parse_scenario({"task": {"name": "T1"}, "robot": [{}, {}, {}]}, "test").robots == 3
    with pytest.raises(ConfigError, match="3 data sheets in 'robot' for 2 'robots'"):
        parse_scenario({"task": {"name": "T1"}, "robot": [{}, {}, {}], "robots": 2}, "test")
    with pytest.raises(ConfigError, match=r"robot\.1\.radius: unknown key.*radius_m"):
        parse_scenario({"task": {"name": "T1"}, "robot": [{}, {"radius": 1}]}, "test")
    with pytest.raises(ConfigError, match=r"robot\.radius: unknown key.*radius_m"):
        parse_scenario({"task": {"name": "T1"}, "robot": {"radius": 1}}, "test")
    place = place_scenario(
        [(0.0, 0.0, 0.0)], [(1.0, 0.0)], [{"type": "circle", "center": [3, 3], "radius": 1, "sped": 1}]
    )
    with pytest.raises(ConfigError, match=r"obstacles\.0\.circle\.sped: unknown key.*speed_mps"):
        parse_scenario(place, "test")


def test_each_is_checked_with_its_own_size():
    """Through a gap of 0.9 m the small one gets, the large one does not; side by side at goals both count."""
    gap = [wall((0.0, -14.0), (0.0, 0.05)), wall((0.0, 0.95), (0.0, 14.0))]
    values = place_scenario([(-3.0, -2.0, 0.0), (-3.0, 2.0, 0.0)], [(3.0, -2.0), (3.0, 2.0)], gap)
    small, large = {"radius_m": 0.15}, {"radius_m": 0.45, "half_width_m": 0.45}
    make_setup(parse_scenario(values | {"robot": [small, small]}, "test"))
    with pytest.raises(UnsolvableWorldError, match=r"robot 1: no way .* radius 0\.45 m"):
        make_setup(parse_scenario(values | {"robot": [small, large]}, "test"))
    near = place_scenario([(-3.0, 0.0, 0.0), (-3.0, 2.0, 0.0)], [(3.0, 0.0), (3.0, 0.5)])
    with pytest.raises(UnsolvableWorldError, match=r"goals are 0\.500 m apart, less than two radii \(0\.6 m\)"):
        make_setup(parse_scenario(near | {"robot": [small, large]}, "test"))


def test_a_footprint_becomes_radius_and_half_width():
    corners = [[0.3, 0.2], [-0.1, 0.2], [-0.1, -0.2], [0.3, -0.2]]
    sheet = parse_scenario({"task": {"name": "T1"}, "robot": {"footprint": corners}}, "test").widest
    assert sheet.radius_m == pytest.approx(math.hypot(0.3, 0.2)) and sheet.half_width_m == 0.2
    with pytest.raises(ConfigError, match=r"the footprint makes radius_m 0\.3606, not 0\.2: leave it out"):
        parse_scenario({"task": {"name": "T1"}, "robot": {"footprint": corners, "radius_m": 0.2}}, "test")
    with pytest.raises(ConfigError, match="footprint"):
        parse_scenario({"task": {"name": "T1"}, "robot": {"footprint": [["a", 0], [1, 2], [2, 3]]}}, "test")


@pytest.mark.parametrize("planner", ["nav-scope", "dh-bug", "orca"])
def test_a_robot_turns_to_the_heading_at_its_goal_before_it_has_arrived(planner):
    values = place_scenario([(-2.0, 0.0, 0.0)], [(1.0, 0.0, 1.57)], planner={"name": planner})
    trace = run_scenario(values)
    straight = run_scenario(values | {"place": values["place"] | {"goals": [[1.0, 0.0]]}})
    assert trace.robots["arrived"].all() and trace.robots["yaw"][0] == pytest.approx(1.57, abs=0.04)
    assert straight.robots["yaw"][0] == pytest.approx(0.0, abs=0.1)
    assert trace.robots["arrival_s"][0] > straight.robots["arrival_s"][0] + 0.5


def sized(radius, at=(1.0, 0.3), **others):
    """A robot that sees another one of ``radius``; what it takes for its radius."""
    rows = one_robot(rig_of(others_smallest_m=0.1, others_largest_m=0.5, **others))
    rows.percept["n_neighbours"], rows.percept["neighbour_id"][0] = 1, 7
    rows.percept["neighbour_x"][0], rows.percept["neighbour_y"][0] = at
    update_tracks(rows.percept, rows.shared, rows.rig, 0.0, 0.0)
    rows.view.scan[:] = scan_at(world_of(circle(*at, radius)), rows.rig)
    measure_bodies(rows.view)
    return float(rows.shared["track_radius"][0])


@pytest.mark.parametrize("radius", [0.1, 0.2, 0.45])
def test_how_large_a_neighbour_is_is_measured_and_never_below(radius):
    assert radius <= sized(radius) <= radius + 0.011


def test_what_nobody_sees_is_as_large_as_the_largest():
    rows = one_robot(rig_of(others_smallest_m=0.1, others_largest_m=0.5))
    rows.percept["n_neighbours"], rows.percept["neighbour_id"][0], rows.percept["neighbour_x"][0] = 1, 7, 2.0
    update_tracks(rows.percept, rows.shared, rows.rig, 0.0, 0.0)
    measure_bodies(rows.view)
    assert rows.shared["track_radius"][0] == 0.5


def test_no_two_bodies_that_touch_are_farther_apart_round_a_corner_than_is_said():
    """Of two that keep off a corner what suits their size, lengths along what suits the smaller one."""
    rng = np.random.default_rng(4)
    for _ in range(3000):
        a, b = rng.uniform(0.05, 0.6, 2)
        spare = float(rng.choice([0.0, 0.02]))
        near, apart = min(a, b) + spare, a + b
        said = touch_round(a + spare, b + spare, apart, near)
        p, q = np.array([a, b]) + spare + rng.uniform(0.0, 0.3, 2) ** 2
        if abs(p - q) <= apart:
            assert touch_round(p, q, apart, near) <= said + 1e-9


def test_robots_of_one_size_are_as_far_apart_as_before():
    assert apart_round(rig_of()) == pytest.approx(touch_round(0.17, 0.17, 0.3, 0.17))
    larger = rig_of(others_largest_m=0.4)
    assert apart_round(larger) == pytest.approx(touch_round(0.17, 0.42, 0.55, 0.17))
