"""Scans as seen from elsewhere, against scans that are cast there."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from helpers import beams_of, circles_world, make_sensor, rig_of, scan_at
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.perception.mend import shows_beside
from swarmscope.onboard.perception.rays import Rays
from swarmscope.onboard.perception.reproject import Found, Grid, Seat, reproject, settle
from swarmscope.sim.beams import make_beams
from swarmscope.sim.lidar import cast_static

RIG = rig_of()
CIRCLE = Rays(-math.pi, math.pi / 180.0, True, 5.0)
CORE = 0.17
ONE = math.radians(1.0)


def world_and_seat(seed, away=0.3):
    rng = np.random.default_rng(seed)
    trees = np.column_stack([rng.uniform(-4.0, 4.0, (12, 2)), rng.uniform(0.1, 0.4, 12)])
    trees = trees[np.hypot(trees[:, 0], trees[:, 1]) - trees[:, 2] > 0.5]
    angle, far = rng.uniform(-3.0, 3.0), rng.uniform(0.0, away)
    x, y = far * math.cos(angle), far * math.sin(angle)
    return circles_world(trees), Seat(x, y, rng.uniform(-3.0, 3.0), x, y, CORE)


def found_from(scan, seat, rays=CIRCLE, grid=CIRCLE, size=360, hides=None):
    found = Found(np.empty(size, np.float32), np.empty(size, np.float32))
    angles = grid.start + grid.increment * np.arange(size)
    hides = np.full(scan.size, np.nan, np.float32) if hides is None else hides
    reproject(scan, hides, rays, seat, Grid(grid, np.cos(angles), np.sin(angles)), found)
    return found


def moved(scan, seat, rays=CIRCLE, grid=CIRCLE, size=360):
    return found_from(scan, seat, rays, grid, size).scan


def points(ranges):
    angles = -np.pi + np.pi / 180.0 * np.arange(360)
    finite = np.isfinite(ranges)
    return np.column_stack([ranges[finite] * np.cos(angles[finite]), ranges[finite] * np.sin(angles[finite])])


def test_from_the_same_seat_nothing_changes():
    for seed in range(20):
        world, _ = world_and_seat(seed)
        scan = scan_at(world, RIG)
        np.testing.assert_allclose(moved(scan, Seat(0.0, 0.0, 0.0, 0.0, 0.0, CORE)), scan, rtol=1e-6)


def test_turned_by_whole_beams_it_is_rolled():
    world, _ = world_and_seat(3)
    scan = scan_at(world, RIG)
    turned = moved(scan, Seat(0.0, 0.0, math.radians(30.0), 0.0, 0.0, CORE))
    np.testing.assert_allclose(turned, np.roll(scan, 30), rtol=1e-6)


@given(seed=st.integers(0, 2**31))
def test_seen_from_elsewhere_no_return_is_farther_than_it_is(seed):
    world, seat = world_and_seat(seed)
    out, true = moved(scan_at(world, RIG, seat.x, seat.y, seat.yaw), seat), scan_at(world, RIG)
    assert not np.isnan(out).any()
    near = np.where(true < 2.0, true, np.inf)  # nearer than that, readings are less than 4 cm apart
    apart = np.linalg.norm(points(near)[:, None] - points(out)[None], axis=2).min(axis=1)
    farther = out[np.isfinite(near)] > near[np.isfinite(near)] + 0.02
    assert (apart[farther] < 0.2).all()  # rays that graze a tree end up to 0.2 m apart


def test_most_of_it_is_where_it_was():
    close = []
    for seed in range(50):
        world, seat = world_and_seat(seed)
        out, true = moved(scan_at(world, RIG, seat.x, seat.y, seat.yaw), seat), scan_at(world, RIG)
        both = np.isfinite(out) & np.isfinite(true)
        close.append(np.abs(out[both] - true[both]) < 0.05)
    assert np.concatenate(close).mean() > 0.8


def test_what_lies_in_a_shadow_is_not_free():
    world = circles_world([(1.0, 0.0, 0.2)])
    seat = Seat(0.0, 0.3, 0.0, 0.0, 0.3, CORE)
    out = moved(scan_at(world, RIG, 0.0, 0.3), seat)
    behind = slice(180 - 16, 180 - 12)  # right of the tree, as seen from the origin; hidden for the sensor
    assert np.isinf(scan_at(world, RIG)[behind]).all()
    assert (out[behind] < 2.0).all()


def test_a_broken_ray_becomes_a_wall_from_the_body_outwards():
    scan = np.full(360, np.inf, np.float32)
    scan[180] = math.nan
    out = moved(scan, Seat(0.0, 0.0, 0.0, 0.0, 0.0, CORE))
    assert out[180] == pytest.approx(CORE)
    assert np.isinf(np.delete(out, 180)).all()
    out = moved(scan, Seat(-0.3, 0.5, 0.0, -0.3, 0.5, CORE))  # passes 0.5 m to our left
    assert out[180 + 90] == pytest.approx(0.5, abs=0.01)
    assert out[180 + 45] == pytest.approx(0.5 * math.sqrt(2.0), abs=0.01)
    assert np.isinf(out[90])


def test_what_a_limited_field_does_not_cover_is_broken():
    beams = make_beams(181, math.pi, 5.0)
    rays = Rays(beams.angle_min, beams.increment, False, 5.0)
    scan = np.full(181, np.inf, np.float32)
    out = moved(scan, Seat(-0.3, 0.0, 0.0, -0.3, 0.0, CORE), rays, rays, 181)
    assert np.isinf(out).all()
    out = moved(scan, Seat(-0.3, 0.0, -0.5, -0.3, 0.0, CORE), rays, rays, 181)  # we have turned to the left
    assert np.isnan(out[-26:]).all()
    assert np.isinf(out[:120]).all()


@pytest.mark.parametrize("thing", [(1.0, 0.6, 0.2), (0.15, 1.0, 0.1), (0.6, -1.5, 0.4), (0.5, 2.9, 0.05)])
def test_what_only_a_sensor_before_us_sees_leaves_no_holes(thing):
    """The line beside the sensor is crossed before anything that it has seen: nobody has looked that far."""
    beams = make_beams(181, math.pi, 5.0)
    rays, before = Rays(beams.angle_min, beams.increment, False, 5.0), 0.1
    scan = np.full(181, np.inf, np.float32)
    cast_static(circles_world([thing]), before, 0.0, 0.0, beams, scan)
    out = moved(scan, Seat(before, 0.0, 0.0, 0.0, 0.0, CORE), rays, rays, 181)
    seen = np.flatnonzero(~np.isnan(out))
    edge = math.degrees(math.acos(before / CORE))
    assert (np.diff(seen) == 1).all()
    assert seen[0] == 90 - math.floor(edge)
    assert seen[-1] == 90 + math.floor(edge)


@pytest.mark.parametrize("fov", [300, 330, 350])
@pytest.mark.parametrize("turned", [-1.0, -0.4, 0.4, 1.0])
def test_of_a_wide_field_that_has_turned_most_is_still_seen(fov, turned):
    beams = make_beams(fov + 1, math.radians(fov), 5.0)
    rays = Rays(beams.angle_min, beams.increment, False, 5.0)
    scan = np.full(fov + 1, np.inf, np.float32)
    out = moved(scan, Seat(-0.02, 0.0, turned, -0.02, 0.0, CORE), rays, rays, fov + 1)
    seen, away = np.isinf(out), fov + 1 - math.degrees(abs(turned)) - 4
    assert seen.sum() >= away
    assert seen[fov // 2 - 60 : fov // 2 + 60].all()


def hole_at(*rays, from_m=0.5):
    hides = np.full(360, np.nan, np.float32)
    hides[list(rays)] = from_m
    return hides


def test_what_was_bridged_is_broken_from_elsewhere_too():
    seat = Seat(0.05, 0.0, 0.0, 0.05, 0.0, CORE)
    out = found_from(np.full(360, 2.0, np.float32), seat, hides=hole_at(180, 270, 271)).scan
    assert np.flatnonzero(np.isnan(out)).tolist() == [180, 269, 270]


def test_a_hole_hides_what_lies_along_the_sensors_rays():
    """A sensor 0.1 m behind the centre has a hole straight ahead, one 0.1 m before it has one to its left."""
    scan = np.full(360, 2.0, np.float32)
    hidden = found_from(scan, Seat(-0.1, 0.0, 0.0, 0.0, 0.0, CORE), hides=hole_at(179, 180, 181)).hidden
    near = 0.5 * math.cos(math.radians(2.0)) - 0.1
    assert hidden[178:183] == pytest.approx(near, rel=2e-3)
    assert (hidden[:176] == np.inf).all() and (hidden[185:] == np.inf).all()
    hidden = found_from(scan, Seat(0.1, 0.0, 0.0, 0.0, 0.0, CORE), hides=hole_at(270)).hidden
    crossed = np.flatnonzero(hidden < np.inf)
    assert crossed.tolist() == list(range(258, 269))  # 0.5 to 2 m beside a place 0.1 m ahead
    assert hidden[258] == pytest.approx(math.hypot(0.1, 0.5), abs=0.01)
    assert (hidden[259:269] < 2.01).all() and (np.diff(hidden[259:269]) > -0.01).all()


@given(seed=st.integers(0, 2**31))
def test_no_post_in_a_hole_is_nearer_than_what_may_be_hidden_there(seed):
    """Posts of 2 cm that the beams beside a hole do not meet, wherever the sensor is."""
    rng = np.random.default_rng(seed)
    width, first = int(rng.integers(1, 7)), int(rng.integers(0, 360))
    rays = (first + np.arange(width)) % 360
    away, angle = rng.uniform(0.0, 0.14), rng.uniform(-math.pi, math.pi)
    seat = Seat(away * math.cos(angle), away * math.sin(angle), rng.uniform(-3.0, 3.0), 0.0, 0.0, CORE)
    half = math.radians(0.5 * (width + 1))
    far = rng.uniform(0.01 / math.sin(half), 2.9)
    aside = max(0.0, half - math.asin(0.01 / far))
    along = CIRCLE.start + seat.yaw + math.radians(first + 0.5 * (width - 1)) + rng.uniform(-aside, aside)
    x, y = seat.x + far * math.cos(along), seat.y + far * math.sin(along)
    if math.hypot(x, y) < CORE + 0.01:
        return
    hides = hole_at(*rays, from_m=shows_beside(width, RIG))
    hidden = found_from(np.full(360, 3.0, np.float32), seat, hides=hides).hidden
    distance = math.hypot(x, y)
    beams = [n for n in range(360) if abs(wrap_angle(CIRCLE.start + math.radians(n) - math.atan2(y, x))) < ONE]
    assert hidden[beams].min() < distance - 0.01 + 0.005


def test_broken_edges_of_a_field_are_no_part_of_it():
    beams = make_beams(181, math.pi, 5.0)
    rays = Rays(beams.angle_min, beams.increment, False, 5.0)
    scan = np.full(181, np.inf, np.float32)
    scan[:10] = scan[-4:] = np.nan
    out = moved(scan, Seat(0.0, 0.0, 0.0, 0.0, 0.0, CORE), rays, rays, 181)
    assert np.isnan(out[:10]).all() and np.isnan(out[-4:]).all()
    assert np.isinf(out[11:-5]).all()
    assert np.isnan(moved(np.full(181, np.nan, np.float32), Seat(0.1, 0.0, 0.0, 0.0, 0.0, CORE), rays, rays, 181)).all()


def test_who_cannot_see_straight_ahead_from_here_sees_nothing():
    beams = make_beams(61, math.radians(60.0), 5.0)
    rays = Rays(beams.angle_min, beams.increment, False, 5.0)
    scan = np.full(61, np.inf, np.float32)
    for side in (0.14, -0.14):
        assert np.isnan(moved(scan, Seat(0.0, side, 0.0, 0.0, 0.0, CORE), rays, rays, 61)).all()


def test_twice_the_beams_into_a_scan():
    sensor = make_sensor(720)
    world, _ = world_and_seat(5)
    fine = np.full(720, np.inf, np.float32)
    cast_static(world, 0.0, 0.0, 0.0, beams_of(rig_of(sensor=sensor)), fine)
    out = moved(fine, Seat(0.0, 0.0, 0.0, 0.0, 0.0, CORE), Rays(-math.pi, math.pi / 360.0, True, 5.0))
    assert (out <= scan_at(world, RIG) + 1e-4).all()
    seen = np.isfinite(fine[::2])
    assert (np.abs(out[seen] - fine[::2][seen]) < 0.2).mean() > 0.8


def test_settle_sorts_out_what_is_no_range():
    raw = np.array([1.0, np.inf, -np.inf, np.nan, -1.0, 0.05, 6.0, 5.0], np.float32)
    out = np.empty(8, np.float32)
    assert settle(raw, np.arange(8), 0.1, 5.0, out) == 4
    assert np.array_equal(out, np.array([1.0, np.inf, np.nan, np.nan, np.nan, np.nan, np.inf, 5.0]), equal_nan=True)
