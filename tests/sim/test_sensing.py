"""What robots perceive: sight, order, noise by key, odometry, packets handed over."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import DT, circles_world, make_sensor, place_sim, rig_of, wall, world_of
from swarmscope.onboard.percept import MAX_INBOX, MAX_NEIGHBOURS
from swarmscope.onboard.sensor import all_round
from swarmscope.sim.cells import index_robots
from swarmscope.sim.sensing import sense
from swarmscope.sim.state import Noise

NOISE = Noise(range_fraction=0.02, dropout=0.05, bearing_rad=0.02, compass_rad=0.05)


def sensed(starts, tick=3, **options):
    sim, _ = place_sim(starts, **options)
    index_robots(sim)
    sense(sim, tick, 0, len(starts))
    return sim


def neighbours(sim, i):
    row = sim.percepts[i]
    n = int(row["n_neighbours"])
    return row["neighbour_id"][:n].tolist(), np.column_stack([row["neighbour_x"][:n], row["neighbour_y"][:n]])


@settings(max_examples=30)
@given(st.integers(0, 2**31))
def test_neighbours_are_where_they_are_nearest_first(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(2, 9))
    starts = np.column_stack([rng.uniform(-4, 4, (n, 2)), rng.uniform(-3, 3, n)])
    sim = sensed(starts)
    for i, (x, y, yaw) in enumerate(starts):
        ids, places = neighbours(sim, i)
        distances = np.hypot(*places.T)
        assert (np.diff(distances) >= 0.0).all()
        assert i not in ids
        assert len(set(ids)) == len(ids)
        for j, (bx, by) in zip(ids, places, strict=True):
            back = (x + math.cos(yaw) * bx - math.sin(yaw) * by, y + math.sin(yaw) * bx + math.cos(yaw) * by)
            assert back == pytest.approx(starts[j, :2], abs=1e-9)
            k = ids.index(j)
            turn = sim.percepts[i]["neighbour_yaw"][k] - (starts[j, 2] - yaw)
            assert math.remainder(turn, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-9)


def test_a_wall_hides_a_neighbour_and_a_robot_too():
    starts = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (3.0, 0.0, 0.0), (0.0, 3.0, 0.0)]
    sim = sensed(starts)
    assert neighbours(sim, 0)[0] == [1, 3]  # 2 is behind 1
    assert neighbours(sim, 1)[0] == [2, 0, 3]
    sim = sensed(starts, world=world_of(wall((-1.0, 1.5), (0.95, 1.5))))
    assert neighbours(sim, 0)[0] == [1]
    assert neighbours(sim, 3)[0] == [1, 2]  # past the wall's end


def test_nobody_is_seen_beyond_the_lidars_range():
    assert neighbours(sensed([(0.0, 0.0, 0.0), (5.3, 0.0, 0.0)]), 0)[0] == []
    assert neighbours(sensed([(0.0, 0.0, 0.0), (5.1, 0.0, 0.0)]), 0)[0] == [1]


def test_positioning_works_all_round_where_the_lidar_looks_ahead_only():
    """Robots 1 ahead, 2 behind, 3 behind 2, 4 out of range behind, 5 to the left."""
    starts = [(0.0, 0.0, 0.0), (2.1, 0.5, 0.0), (-2.0, 0.0, 0.0), (-3.0, 0.0, 0.0), (-4.0, 3.3, 0.0), (-0.5, 2.5, 0.0)]
    rig = rig_of(sensor=all_round(make_sensor(beams=181, fov=math.pi)))
    sim = sensed(starts, rig=rig)
    ids, places = neighbours(sim, 0)
    assert ids == [2, 1, 5]
    assert places[0] == pytest.approx([-2.0, 0.0])
    assert np.isinf(sim.scans[0, :89]).all() and np.isinf(sim.scans[0, 270:]).all()  # behind, no beam measures
    assert np.isfinite(sim.scans[0, 89:270]).any()
    behind_a_wall = sensed(starts, rig=rig, world=world_of(wall((-1.0, -1.0), (-1.0, 1.0))))
    assert neighbours(behind_a_wall, 0)[0] == [1, 5]


def test_no_more_than_the_table_holds_and_those_are_the_nearest():
    angles = np.linspace(-3.0, 3.0, MAX_NEIGHBOURS + 4)
    radii = 2.0 + 0.1 * np.random.default_rng(0).permutation(angles.size)
    starts = [
        (0.0, 0.0, 0.0),
        *((r * math.cos(a), r * math.sin(a), 0.0) for r, a in zip(radii, angles, strict=True)),
    ]
    ids, _ = neighbours(sensed(starts), 0)
    assert ids == (1 + np.argsort(radii)[:MAX_NEIGHBOURS]).tolist()


def test_robots_appear_in_each_others_scans():
    sim = sensed([(0.0, 0.0, 0.0), (2.0, 0.0, math.pi)])
    assert sim.ranges[0, 180] == pytest.approx(1.85, abs=1e-6)
    assert sim.ranges[1, 180] == pytest.approx(1.85, abs=1e-6)
    assert np.isfinite(sim.ranges[0]).sum() == pytest.approx(2 * math.degrees(math.asin(0.15 / 2.0)), abs=1)


def test_the_goal_is_given_in_the_body_frame():
    sim = sensed([(1.0, 1.0, 0.5)], goals=[(1.0, 3.0)])
    row = sim.percepts[0]
    assert row["goal_distance"] == pytest.approx(2.0)
    assert row["goal_bearing"] == pytest.approx(0.5 * math.pi - 0.5)
    assert row["compass"] == pytest.approx(0.5)
    assert row["now_s"] == pytest.approx(3 * DT)


def test_odometry_is_the_motion_since_the_last_tick_in_the_old_body_frame():
    sim, _ = place_sim([(1.0, 2.0, 0.5 * math.pi)])
    index_robots(sim)
    sense(sim, 0, 0, 1)
    assert [float(sim.percepts[0][k]) for k in ("odom_x", "odom_y", "odom_yaw")] == pytest.approx(
        [0.0, 0.0, 0.0]
    )
    sim.robots["x"], sim.robots["y"], sim.robots["yaw"] = 0.7, 2.4, 0.5 * math.pi + 0.1
    sense(sim, 1, 0, 1)
    assert [float(sim.percepts[0][k]) for k in ("odom_x", "odom_y", "odom_yaw")] == pytest.approx(
        [0.4, 0.3, 0.1]
    )
    sense(sim, 2, 0, 1)
    assert float(sim.percepts[0]["odom_x"]) == pytest.approx(0.0)


def test_no_field_of_the_percept_is_a_global_pose():
    """Moving and turning the whole world changes nothing but the compass."""
    starts = np.array([(0.0, 0.0, 0.3), (2.0, 0.5, 1.0), (1.0, -1.5, -2.0)])
    goals = np.array([(4.0, 1.0), (-1.0, 2.0), (0.0, 4.0)])
    turn, shift = 0.5 * math.pi, np.array([3.0, -2.0])
    rotate = np.array([[0.0, -1.0], [1.0, 0.0]])
    moved = np.column_stack([starts[:, :2] @ rotate.T + shift, starts[:, 2] + turn])
    a = sensed(starts, goals=goals)
    b = sensed(moved, goals=goals @ rotate.T + shift)
    for field in a.percepts.dtype.names:
        if field != "compass":
            assert b.percepts[field] == pytest.approx(a.percepts[field], abs=1e-9, nan_ok=True), field
    assert np.cos(b.percepts["compass"] - a.percepts["compass"]) == pytest.approx(np.cos(turn), abs=1e-9)


def noisy(seed=1, tick=3, **options):
    starts = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 1.5, 0.0)]
    options = {"noise": NOISE, "world": circles_world([(-2.0, 0.0, 0.5)])} | options
    return sensed(starts, tick=tick, seed=seed, **options)


def test_noise_is_the_same_for_the_same_seed_and_tick_only():
    a = noisy()
    assert a.percepts.tobytes() == noisy().percepts.tobytes()
    assert a.ranges.tobytes() == noisy().ranges.tobytes()
    for other in (noisy(seed=2), noisy(tick=4)):
        assert a.ranges.tobytes() != other.ranges.tobytes()
        assert (a.percepts["neighbour_x"] != other.percepts["neighbour_x"]).any()
        assert (a.percepts["compass"] != other.percepts["compass"]).all()


def test_noise_does_not_depend_on_the_order_in_which_robots_are_sensed():
    a = noisy()
    sim, _ = place_sim(
        [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0), (0.0, 1.5, 0.0)],
        noise=NOISE,
        world=circles_world([(-2.0, 0.0, 0.5)]),
        seed=1,
    )
    index_robots(sim)
    for i in (2, 0, 1):
        sense(sim, 3, i, i + 1)
    assert sim.ranges.tobytes() == a.ranges.tobytes()
    assert sim.percepts.tobytes() == a.percepts.tobytes()


def test_noise_has_the_size_that_is_asked_for():
    starts = [(0.0, 0.0, 0.0), (2.0, 0.0, 0.0)]
    sim, _ = place_sim(starts, noise=Noise(0.03, 0.0, 0.04, 0.05))
    index_robots(sim)
    rows = []
    for tick in range(2000):
        sense(sim, tick, 0, 1)
        (_, places) = neighbours(sim, 0)
        x, y = places[0]
        rows.append(
            (sim.ranges[0, 180], math.hypot(x, y), math.atan2(y, x), float(sim.percepts[0]["compass"]))
        )
    rows = np.array(rows)
    assert rows.mean(axis=0) == pytest.approx([1.85, 2.0, 0.0, 0.0], abs=0.01)
    assert rows.std(axis=0) == pytest.approx([0.03 * 1.85, 0.06, 0.04, 0.05], rel=0.08)


def test_compass_errors_turn_the_goal_but_not_the_scan():
    clean = sensed([(0.0, 0.0, 0.0)], goals=[(3.0, 0.0)])
    wrong = sensed([(0.0, 0.0, 0.0)], goals=[(3.0, 0.0)], noise=Noise(compass_rad=0.1))
    error = float(wrong.percepts[0]["compass"])
    assert error != 0.0
    assert float(wrong.percepts[0]["goal_bearing"]) == pytest.approx(-error)
    assert (wrong.ranges == clean.ranges).all()


def test_returns_below_range_min_are_invalid():
    rig = rig_of(sensor=make_sensor(range_min=0.5))
    sim = sensed([(0.0, 0.0, 0.0)], world=circles_world([(0.6, 0.0, 0.2), (-2.0, 0.0, 0.2)]), rig=rig)
    assert math.isnan(sim.ranges[0, 180])
    assert sim.ranges[0, 0] == pytest.approx(1.8, abs=1e-3)


def test_packets_are_handed_over_when_due_oldest_first_and_the_rest_waits():
    sim, _ = place_sim([(0.0, 0.0, 0.0)])
    index_robots(sim)
    count = MAX_INBOX + 3
    for q in range(count):
        sim.queue_due[0, q] = 0.0 if q != 1 else 10.0
        sim.queue_length[0, q] = 3
        sim.queue_data[0, q, :3] = q
    sim.robots["queued"] = count
    sense(sim, 1, 0, 1)
    row = sim.percepts[0]
    assert row["n_packets"] == MAX_INBOX
    expected = [q for q in range(count) if q != 1]
    assert row["packet"][:MAX_INBOX, 0].tolist() == expected[:MAX_INBOX]
    sense(sim, 2, 0, 1)
    row = sim.percepts[0]
    assert row["packet"][: row["n_packets"], 0].tolist() == expected[MAX_INBOX:]
    assert sim.robots[0]["queued"] == 1
    sense(sim, 60, 0, 1)
    assert sim.percepts[0]["packet"][0, 0] == 1
    assert sim.robots[0]["queued"] == 0
