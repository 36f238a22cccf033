"""The guard against a naive simulation of a tick and the braking after it, and against adversaries."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from adversary import closest
from helpers import DT, circles_world, make_sensor, one_robot, place_sim, rig_of, scan_at, seen, world_of
from swarmscope.onboard.body import Body
from swarmscope.onboard.control.guard import guard
from swarmscope.onboard.control.wanting import halt, head_for
from swarmscope.onboard.perception.lost import keep_lost
from swarmscope.onboard.perception.mend import mend
from swarmscope.onboard.sharing.tracks import update_odometry, update_tracks
from swarmscope.sim.world import WorldSpec, compile_world

BODY = Body()
FINE = 200
"""Steps of the naive simulation per tick."""


def guarded(ranges, v0, v, w, rig=None, rows=None):
    """Let the guard have its say; return (v, w, whether it intervened)."""
    rows = rows or one_robot(rig)
    rows.scan[:] = ranges
    rows.fill(speed=v0)
    rows.decision["v"], rows.decision["w"] = v, w
    slowed = guard(rows.view)
    return rows.said("v"), rows.said("w"), bool(slowed)


def naive_path(v0, v, w, body=BODY, dt=DT):
    """Points of one tick at (v, w) from speed v0 and of the full braking after it, in a straight line."""
    x = y = yaw = 0.0
    speed, h = v0, dt / FINE
    points = [(x, y)]
    for _ in range(FINE):
        speed += min(body.a_max_mps2 * h, max(-body.a_max_mps2 * h, v - speed))
        x, y, yaw = x + speed * h * math.cos(yaw), y + speed * h * math.sin(yaw), yaw + w * h
        points.append((x, y))
    brake = speed * speed / (2.0 * body.a_max_mps2)
    for k in range(1, 21):
        points.append((x + brake * k / 20 * math.cos(yaw), y + brake * k / 20 * math.sin(yaw)))
    return np.array(points)


def gap_to(circles, points):
    """Smallest distance from the points to the surface of any circle."""
    c = np.asarray(circles, float)
    return float((np.hypot(*(points[:, None, :] - c[None, :, :2]).transpose(2, 0, 1)) - c[:, 2]).min())


circle_rows = st.lists(
    st.tuples(st.floats(0.16, 1.2), st.floats(-math.pi, math.pi), st.floats(0.05, 0.4)).map(
        lambda p: ((p[0] + p[2]) * math.cos(p[1]), (p[0] + p[2]) * math.sin(p[1]), p[2])
    ),
    min_size=1,
    max_size=8,
)


@settings(max_examples=400)
@given(circle_rows, st.floats(0.0, 0.5), st.floats(-0.2, 0.8), st.floats(-3.0, 3.0))
def test_after_a_guarded_tick_braking_touches_nothing(circles, v0, v, w):
    """Provided that braking straight on was free before, which the tick before has seen to."""
    brake = v0 * v0 / (2.0 * BODY.a_max_mps2)
    straight = np.column_stack([np.linspace(0.0, brake, 50), np.zeros(50)])
    assume(gap_to(circles, straight) >= BODY.radius_m + (0.0 if v0 == 0.0 else 0.02))
    rig = rig_of()
    new_v, new_w, slowed = guarded(scan_at(circles_world(circles), rig), v0, v, w)
    assert 0.0 <= new_v <= BODY.v_max_mps
    assert abs(new_w) <= BODY.w_max_radps
    points = naive_path(v0, new_v, new_w)
    assert gap_to(circles, points) >= BODY.radius_m - 1e-3
    if not slowed:
        assert new_v == pytest.approx(min(BODY.v_max_mps, max(0.0, v)))
        assert new_w == pytest.approx(min(BODY.w_max_radps, max(-BODY.w_max_radps, w)))


@settings(max_examples=200)
@given(circle_rows, st.floats(0.05, 0.5), st.floats(-2.0, 2.0))
def test_what_is_plainly_free_is_let_through(circles, v, w):
    """A command whose naive path keeps twice the clearance from everything is not touched."""
    rig = rig_of()
    points = naive_path(0.0, v, w)
    assume(gap_to(circles, points) > BODY.radius_m + 2.0 * rig.guarding.clearance_m + 0.01)
    assert guarded(scan_at(circles_world(circles), rig), 0.0, v, w) == pytest.approx((v, w, False))


def test_open_space_lets_everything_through():
    assert guarded(np.full(360, np.inf, np.float32), 0.3, 0.5, 1.0) == (0.5, 1.0, False)


@pytest.mark.parametrize("v0", [0.0, 0.3])
def test_an_all_invalid_scan_stops(v0):
    v, _, slowed = guarded(np.full(360, np.nan, np.float32), v0, 0.5, 0.0)
    assert (v, slowed) == (0.0, True)


def test_an_invalid_beam_ahead_stops_and_one_behind_does_not():
    ranges = np.full(360, np.inf, np.float32)
    ranges[180] = np.nan
    assert guarded(ranges, 0.0, 0.5, 0.0)[0] < 0.05
    ranges = np.full(360, np.inf, np.float32)
    ranges[0] = np.nan
    assert guarded(ranges, 0.0, 0.5, 0.0) == (0.5, 0.0, False)


@pytest.mark.parametrize(("width", "held"), [(1, False), (2, False), (5, True)])
def test_in_a_hole_stands_what_would_not_show_beside_it(width, held):
    """2 cm fill n + 1 degrees at 0.57 m (n = 1), 0.38 m (2), 0.19 m (5); 0.5 m/s need 0.33 m."""
    rows = one_robot()
    rows.scan[:] = 3.0
    rows.scan[180 : 180 + width] = np.nan
    broken = mend(rows.scan, rows.rig, rows.view.safe)
    keep_lost(rows.view, broken)
    assert rows.scan.min() > 1.0
    v, _, slowed = guarded(rows.scan.copy(), 0.0, 0.5, 0.0, rows=rows)
    assert slowed == held
    assert v <= 0.1 if held else v == 0.5


def test_a_reading_below_range_min_forbids_motion_towards_it():
    rig = rig_of(sensor=make_sensor(range_min=0.3))
    ranges = np.full(360, np.inf, np.float32)
    ranges[180] = 0.25
    assert guarded(ranges, 0.0, 0.5, 0.0, rig)[0] < 0.05


@pytest.mark.parametrize("v", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize("w", [0.0, math.nan, math.inf])
def test_commands_that_are_no_numbers_become_safe_ones(v, w):
    ranges = scan_at(circles_world([(0.5, 0.0, 0.2)]), rig_of())
    new_v, new_w, _ = guarded(ranges, 0.2, v, w)
    assert math.isfinite(new_v)
    assert math.isfinite(new_w)
    assert 0.0 <= new_v <= BODY.v_max_mps
    assert abs(new_w) <= BODY.w_max_radps
    assert gap_to([(0.5, 0.0, 0.2)], naive_path(0.2, new_v, new_w)) >= BODY.radius_m


@pytest.mark.parametrize("bearing_deg", [0, 60, -85, 110, -120, 180])
def test_closer_than_the_clearance_only_away_is_allowed(bearing_deg):
    """0.16 m to a surface, 0.17 m wanted: leaving is free, coming closer is not."""
    bearing = math.radians(bearing_deg)
    surface = scan_at(circles_world([(0.46 * math.cos(bearing), 0.46 * math.sin(bearing), 0.3)]), rig_of())
    assert surface.min() == pytest.approx(0.16, abs=1e-3)
    v, _, _ = guarded(surface, 0.0, 0.4, 0.0)
    if abs(bearing_deg) < 90:
        assert v < 0.02
    else:
        assert v == 0.4


def test_turning_on_the_spot_is_always_allowed_at_rest():
    ranges = np.full(360, 0.16, np.float32)
    assert guarded(ranges, 0.0, 0.0, 1.5) == (0.0, 1.5, False)


def test_halt_and_head_for():
    rows = one_robot()
    head_for(rows.view, 0.2, 0.5)
    assert rows.decision[["v", "w", "heading"]].tolist() == pytest.approx((0.5, 1.0, 0.2))
    halt(rows.view)
    assert rows.decision[["v", "w"]].tolist() == (0.0, 0.0)


def meeting(distance, v0, v, rig, known=True):
    """Robot 0 drives at a robot ``distance`` [m] ahead; ``known`` by the positioning or only by the LiDAR."""
    rows = one_robot(rig)
    if known:
        rows.see([seen(3, distance, 0.0, math.pi)])
    update_odometry(rows.percept, rows.shared)
    update_tracks(rows.percept, rows.shared, rig, 0.0, 0.0)
    return guarded(scan_at(circles_world([(distance, 0.0, rig.body.radius_m)]), rig), v0, v, 0.0, rows=rows)


@settings(max_examples=100)
@given(st.floats(0.35, 2.0), st.floats(0.0, 0.5))
def test_each_robot_uses_only_its_half_of_the_gap(distance, v):
    rig = rig_of()
    new_v, _, _ = meeting(distance, 0.0, v, rig)
    path = naive_path(0.0, new_v, 0.0)
    moved, stopped = path[FINE, 0], path[-1, 0]
    half = 0.5 * (distance - 2.0 * BODY.radius_m - rig.guarding.clearance_m)
    assert stopped + (stopped - moved) <= half + 1e-3  # the braking distance is kept twice
    wanted = naive_path(0.0, v, 0.0)
    if 2.0 * wanted[-1, 0] - wanted[FINE, 0] < half - 1e-3:
        assert new_v == v


@settings(max_examples=200)
@given(
    clearance=st.sampled_from([0.0, 0.02]), gap=st.floats(0.0, 0.05), bearing=st.floats(-math.pi, math.pi),
    v=st.floats(0.0, 0.2), w=st.floats(-2.0, 2.0), dt=st.sampled_from([0.1, 0.4, 0.8]),
)  # fmt: skip
@example(clearance=0.0, gap=0.01, bearing=-1.05, v=0.1, w=2.0, dt=0.8)
def test_who_turns_stays_in_its_half_all_the_way(clearance, gap, bearing, v, w, dt):
    """Not only where its way ends: one that turns past a neighbour and away is nearest in between."""
    rig = rig_of(clearance_m=clearance)
    rows = one_robot(rig)
    distance = 2.0 * BODY.radius_m + gap
    x, y = distance * math.cos(bearing), distance * math.sin(bearing)
    rows.see([seen(3, x, y, math.pi)])
    update_odometry(rows.percept, rows.shared)
    update_tracks(rows.percept, rows.shared, rig, 0.0, 0.0)
    rows.fill(dt_s=dt)
    new_v, new_w, _ = guarded(scan_at(circles_world([(x, y, BODY.radius_m)]), rig), 0.0, v, w, rows=rows)
    nearer = naive_path(0.0, new_v, new_w, dt=dt) @ (np.array([x, y]) / distance)
    assert nearer.max() <= max(0.5 * (gap - clearance), 0.0) + (0.5 if gap > clearance else 0.0) * clearance + 1e-5


def test_a_neighbour_is_kept_off_even_when_its_returns_are_missing():
    rows = one_robot()
    rows.see([seen(3, 0.36, 0.0)])
    update_tracks(rows.percept, rows.shared, rows.rig, 0.0, 0.0)
    assert guarded(np.full(360, np.inf, np.float32), 0.0, 0.5, 0.0, rows=rows)[0] < 0.2


def passing(shown, position_sigma, others=()):
    """The speed that is let through past a robot that stands 0.39 m away, 80 degrees to the left, 9 cm between both."""
    rig = rig_of(sensor=make_sensor(position_sigma=position_sigma))
    rows = one_robot(rig)
    x, y = 0.39 * math.cos(math.radians(80.0)), 0.39 * math.sin(math.radians(80.0))
    rows.see([seen(3, x, y)])
    update_odometry(rows.percept, rows.shared)
    update_tracks(rows.percept, rows.shared, rig, 0.0, 0.0)
    scan = scan_at(circles_world([(x, y, 0.15)] * shown + list(others)), rig)
    return guarded(scan, 0.0, 0.2, 0.0, rows=rows)[0]


def test_errors_of_positioning_count_only_where_the_scan_does_not_show_the_neighbour():
    """With 10 degrees of bearing error robots that stood side by side never parted."""
    exact = passing(True, 0.0)
    assert exact >= 0.1
    assert passing(True, math.radians(10.0)) == exact
    assert passing(False, math.radians(10.0)) < 0.03 < passing(False, 0.0)


def test_a_neighbour_that_is_nearer_than_positioning_says_is_as_near_as_the_scan_says():
    sigma = math.radians(10.0)
    rig = rig_of(sensor=make_sensor(position_sigma=sigma))
    speeds = []
    for true in (0.6, 0.5, 0.42):
        rows = one_robot(rig)
        rows.see([seen(3, 0.6, 0.0)])
        update_tracks(rows.percept, rows.shared, rig, 0.0, 0.0)
        speeds.append(guarded(scan_at(circles_world([(true, 0.0, 0.15)]), rig), 0.0, 0.5, 0.0, rows=rows)[0])
    assert speeds == sorted(speeds, reverse=True) and speeds[0] > speeds[2] > 0.0


BODIES = {
    "published": Body(),
    "fast": Body(v_max_mps=1.5, a_max_mps2=2.0),
    "weak brakes": Body(v_max_mps=0.6, a_max_mps2=0.6),
    "large": Body(radius_m=0.43, half_width_m=0.29, a_max_mps2=4.0, sensor_delay_s=0.0575),
}


@pytest.mark.parametrize("name", sorted(BODIES))
def test_adversarial_commands_never_touch_obstacles(name):
    """Random worlds of circles and a random planner: 40 runs of 200 ticks each."""
    body, rng = BODIES[name], np.random.default_rng(7)
    rig = rig_of(body)
    smallest = math.inf
    for run in range(40):
        rows = np.column_stack([rng.uniform(-3, 3, (30, 2)), rng.uniform(0.05, 0.4, 30)])
        rows = rows[np.hypot(rows[:, 0], rows[:, 1]) - rows[:, 2] > body.radius_m + rig.guarding.clearance_m]
        sim, swarm = place_sim(
            [(0.0, 0.0, rng.uniform(-3, 3))], world=circles_world(rows), rig=rig, seed=run
        )
        smallest = min(smallest, closest(sim, swarm, 200, run % 3))
    assert smallest > 0.0
    assert smallest < 0.05  # otherwise the adversary was too tame to show anything


def test_adversarial_commands_never_touch_walls():
    """Nor the ends of plates 2 cm thick. (A wall without thickness, seen end-on, is between two beams.)"""
    rig = rig_of()
    rng = np.random.default_rng(8)
    box = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0]]
    spike = {"type": "polygon", "points": [[-0.4, 0.4], [-0.41, 0.42], [-0.9, 0.62], [-0.9, 0.6]]}
    shelf = {"type": "polygon", "points": [[0.5, -0.2], [0.8, -0.2], [0.8, -0.18], [0.5, -0.18]]}
    obstacles = [{"type": "wall", "points": box}, spike, shelf]
    world = compile_world(WorldSpec(obstacles=obstacles, bounds=(-2, -2, 2, 2)))
    for run in range(30):
        sim, swarm = place_sim([(0.0, 0.0, rng.uniform(-3, 3))], world=world, rig=rig, seed=run)
        assert closest(sim, swarm, 300, run % 3) > 0.0


@pytest.mark.parametrize("robots", [2, 3])
@pytest.mark.parametrize("name", ["published", "fast", "weak brakes"])
def test_adversarial_robots_never_touch_each_other(name, robots):
    """All guarded, all asking for the worst: random, towards the nearest, at random for long; 1000 runs."""
    body, rng = BODIES[name], np.random.default_rng(robots)
    rig = rig_of(body)
    smallest = math.inf
    world = world_of()
    for run in range(1000):
        starts = []
        while len(starts) < robots:
            p = rng.uniform(-0.8, 0.8, 2)
            if all(math.hypot(*(p - q[:2])) > 2.0 * body.radius_m + 2.0 * rig.guarding.clearance_m for q in starts):
                starts.append((*p, rng.uniform(-3, 3)))
        sim, swarm = place_sim(starts, world=world, rig=rig, seed=run)
        smallest = min(smallest, closest(sim, swarm, 60, run % 3))
    assert smallest > 0.0
    assert smallest < 0.06


def test_a_robot_that_starts_within_its_clearance_gets_away_and_never_touches():
    rig = rig_of()
    world = circles_world([(0.0, 0.46, 0.3)])
    for run in range(20):
        sim, swarm = place_sim([(0.0, 0.0, -0.5 * math.pi)], world=world, rig=rig, seed=run)
        assert closest(sim, swarm, 30, 2) > 0.0


def test_who_was_just_switched_on_looks_three_times_before_it_sets_off():
    """Turning, so that other beams look where a stuck one did; somebody who drives brakes straight on."""
    rows = one_robot(rig_of(first_scans=3))
    driven = []
    for _ in range(4):
        update_odometry(rows.percept, rows.shared)
        driven.append(guarded(np.inf, 0.0, 0.5, 0.0, rows=rows))
    five = 5.0 * rows.rig.sensor.increment / DT
    assert [(v, pytest.approx(w)) for v, w, _ in driven[:2]] == [(0.0, pytest.approx(five))] * 2
    assert [(v, w) for v, w, _ in driven[2:]] == [(0.5, 0.0)] * 2
    rows = one_robot(rig_of(first_scans=3))
    assert guarded(np.inf, 0.3, 0.5, 1.0, rows=rows)[:2] == (0.0, 0.0)
