"""Tracks of neighbours: following, persistence, standing still, and the mask of moving neighbours."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import DT, circles_world, make_sensor, one_robot, rig_of, scan_at, seen
from swarmscope.onboard.percept import PEERS
from swarmscope.onboard.rig import SIGMAS
from swarmscope.onboard.sharing.tracks import (
    gains,
    mask_moving_neighbours,
    near_track,
    update_odometry,
    update_tracks,
)
from swarmscope.sim.beams import make_beams

STILL_S = 0.6


class Watcher:
    """A robot with a pose in the world; it watches neighbours (id -> x, y, yaw)."""

    def __init__(self, rig=None, pose=(0.0, 0.0, 0.0)):
        self.rows = one_robot(rig)
        self.pose = self.last = pose
        self.tick = 0

    def watch(self, neighbours, pose=None):
        rows, (x, y, yaw) = self.rows, pose or self.pose
        self.last, self.pose = self.pose, (x, y, yaw)
        c, s = math.cos(self.last[2]), math.sin(self.last[2])
        dx, dy = x - self.last[0], y - self.last[1]
        rows.fill(odom_x=c * dx + s * dy, odom_y=c * dy - s * dx, compass=yaw, now_s=self.tick * DT)
        c, s = math.cos(yaw), math.sin(yaw)
        rows.see(
            [
                seen(name, c * (nx - x) + s * (ny - y), c * (ny - y) - s * (nx - x), nyaw - yaw)
                for name, (nx, ny, nyaw) in neighbours.items()
            ]
        )
        dx, dy = update_odometry(rows.percept, rows.shared)
        update_tracks(rows.percept, rows.shared, rows.rig, dx, dy)
        self.tick += 1

    def track(self, name):
        """Position and velocity in the world, when it moved last; None without a track."""
        row = self.rows.shared
        at = np.flatnonzero(row["track_id"] == name)
        if not at.size:
            return None
        t = at[0]
        place = np.array([self.pose[0] + row["track_x"][t], self.pose[1] + row["track_y"][t]])
        return place, np.array([row["track_vx"][t], row["track_vy"][t]]), row["track_moved_s"][t]

    def mask(self, ranges):
        see = self.rows.view
        see.scan[:], see.masked[:] = ranges, -1.0
        mask_moving_neighbours(see, STILL_S)
        return see.masked.copy()


@settings(max_examples=30)
@given(st.floats(-math.pi, math.pi), st.floats(0.0, 0.45), st.floats(-0.5, 0.5), st.floats(-1.0, 1.0))
def test_a_neighbour_at_constant_velocity_is_followed(course, speed, own_speed, own_turn):
    """Whatever the watcher does itself."""
    watcher = Watcher()
    velocity = speed * np.array([math.cos(course), math.sin(course)])
    x = y = yaw = 0.0
    for k in range(15):
        place = np.array([2.0, 1.0]) + velocity * k * DT
        watcher.watch({7: (*place, course)}, (x, y, yaw))
        found, estimate, _ = watcher.track(7)
        assert found == pytest.approx(place, abs=1e-9)
        x, y, yaw = (
            x + own_speed * DT * math.cos(yaw),
            y + own_speed * DT * math.sin(yaw),
            yaw + own_turn * DT,
        )
    assert estimate == pytest.approx(velocity, abs=1e-3)


def test_noise_is_averaged():
    rng = np.random.default_rng(1)
    watcher = Watcher(rig_of(sensor=make_sensor(position_sigma=0.02)))
    errors, raw = [], []
    for k in range(300):
        true = np.array([2.0, 0.3 * math.sin(0.05 * k)])
        measured = true * (1.0 + 0.02 * rng.normal())
        watcher.watch({7: (*measured, 0.0)})
        errors.append(np.hypot(*(watcher.track(7)[0] - true)))
        raw.append(np.hypot(*(measured - true)))
    assert np.mean(errors[20:]) < np.mean(raw[20:])


def test_a_vanished_neighbour_is_kept_for_the_persistence_and_then_dropped():
    watcher = Watcher(rig_of(persistence_s=2.0))
    for k in range(10):
        watcher.watch({7: (2.0 + 0.3 * k * DT, 0.0, 0.0)})
    last = watcher.track(7)[0]
    kept = 0
    while watcher.track(7) is not None and kept < 50:
        watcher.watch({})
        kept += 1
        if watcher.track(7) is not None:
            place = watcher.track(7)[0]
            assert last[0] < place[0] <= last[0] + 0.3 * kept * DT + 1e-9
            last_place = place
    assert kept == 11  # 2 s after it was seen last it is still there, 2.2 s after it is not
    assert last_place[0] - last[0] > 0.1


def test_own_motion_does_not_move_an_unseen_neighbour():
    watcher = Watcher()
    watcher.watch({7: (2.0, 1.0, 0.0)})
    watcher.watch({7: (2.0, 1.0, 0.0)})
    for k in range(5):
        watcher.watch({}, (0.1 * k, 0.05 * k, 0.3 * k))
        assert watcher.track(7)[0] == pytest.approx([2.0, 1.0], abs=1e-9)


def test_standing_still_and_moving_on_are_noticed():
    watcher = Watcher()
    for k in range(5):
        watcher.watch({7: (2.0 + 0.1 * k, 0.0, 0.0)})
    assert watcher.track(7)[2] == pytest.approx(4 * DT)
    for _ in range(10):
        watcher.watch({7: (2.4, 0.0, 0.0)})
    assert watcher.track(7)[2] == pytest.approx(4 * DT)
    for k in range(3):
        watcher.watch({7: (2.4 + 0.1 * k, 0.0, 0.0)})
    assert watcher.track(7)[2] == pytest.approx(17 * DT)


def test_a_standing_neighbour_stands_also_while_the_watcher_drives_past():
    watcher = Watcher()
    for k in range(20):
        watcher.watch({7: (2.0, 1.0, 0.0)}, (0.1 * k, 0.0, 0.1 * k))
    assert watcher.track(7)[2] == 0.0


def test_estimated_speed_stays_within_what_robots_can_do():
    watcher = Watcher()
    watcher.watch({7: (2.0, 0.0, 0.0)})
    watcher.watch({7: (-2.0, 0.0, 0.0)})
    assert np.hypot(*watcher.track(7)[1]) <= 0.5 + 1e-9


def test_the_nearest_neighbours_win_a_full_table():
    watcher = Watcher()
    far = {100 + k: (3.0 + 0.1 * k, 0.0, 0.0) for k in range(PEERS)}
    watcher.watch(far)
    watcher.watch({1: (1.0, 1.0, 0.0), 2: (9.0, 9.0, 0.0)})
    assert watcher.track(1) is not None
    assert watcher.track(2) is None
    assert watcher.track(100 + PEERS - 1) is None
    assert watcher.track(100) is not None


def neighbour_scan(rig, neighbours, others=(), pose=(0.0, 0.0, 0.0)):
    return scan_at(circles_world([(x, y, 0.15) for x, y in neighbours] + list(others)), rig, *pose)


@settings(max_examples=40)
@given(st.floats(0.35, 4.0), st.floats(-math.pi, math.pi), st.floats(-math.pi, math.pi))
def test_the_mask_removes_a_moving_neighbour_and_nothing_else(distance, bearing, yaw):
    rig = rig_of()
    watcher = Watcher(rig, (0.0, 0.0, yaw))
    x, y = distance * math.cos(bearing), distance * math.sin(bearing)
    watcher.watch({7: (x - 0.1, y, 0.0)})
    watcher.watch({7: (x, y, 0.0)})
    opposite = (-x / distance * (distance + 0.5), -y / distance * (distance + 0.5), 0.2)
    alone = scan_at(circles_world([opposite]), rig, yaw=yaw)
    both = neighbour_scan(rig, [(x, y)], [opposite], (0.0, 0.0, yaw))
    assert (both != alone).any()
    assert (watcher.mask(both) == alone).all()


def test_a_standing_neighbour_stays_in_the_scan_and_a_moving_one_does_not():
    rig = rig_of()
    watcher = Watcher(rig)
    ticks = round(STILL_S / DT)
    scan = neighbour_scan(rig, [(2.0, 0.0)])
    for k in range(ticks + 1):
        watcher.watch({7: (2.0, 0.0, 0.0)})
        masked = watcher.mask(scan)
        assert (masked == scan).all() == (k >= ticks), k
    assert np.isfinite(scan).any()


def test_the_mask_of_an_unseen_neighbour_moves_on():
    rig = rig_of()
    watcher = Watcher(rig)
    for k in range(10):
        watcher.watch({7: (2.0, -1.0 + 0.06 * k, 0.0)})
    watcher.watch({})
    assert np.isinf(watcher.mask(neighbour_scan(rig, [(2.0, -1.0 + 0.6)]))).all()


def test_invalid_beams_stay_invalid():
    rig = rig_of(sensor=make_sensor(range_min=0.1))
    watcher = Watcher(rig)
    watcher.watch({7: (0.5, 0.0, 0.0)})
    scan = neighbour_scan(rig, [(0.5, 0.0)])
    scan[175:186] = np.nan
    assert np.isnan(watcher.mask(scan)[175:186]).all()


@pytest.mark.parametrize("fov_deg", [120.0, 270.0])
def test_masks_at_the_border_of_a_limited_field_of_view(fov_deg):
    sensor = make_sensor(beams=121, fov=math.radians(fov_deg))
    rig = rig_of(sensor=sensor)
    edge = sensor.angle_min
    for bearing in (edge, -edge, edge - 0.05, -edge + 0.05):
        watcher = Watcher(rig)
        x, y = 1.5 * math.cos(bearing), 1.5 * math.sin(bearing)
        watcher.watch({7: (x, y, 0.0)})
        assert np.isinf(watcher.mask(neighbour_scan(rig, [(x, y)]))).all()
    assert make_beams(121, math.radians(fov_deg), 5.0).wraps is False


@pytest.mark.parametrize("speed", [0.2, 0.5])
def test_two_observations_are_enough_for_a_line_however_positioning_errs(speed):
    watcher = Watcher(rig_of(sensor=make_sensor(position_sigma=0.05)))
    for k in range(4):
        watcher.watch({7: (2.0, speed * DT * k, 0.0)})
        if k > 0:
            place, velocity, _ = watcher.track(7)
            np.testing.assert_allclose(place, (2.0, speed * DT * k), atol=1e-9)
            np.testing.assert_allclose(velocity, (0.0, speed), atol=1e-9)


def test_one_that_comes_into_view_again_is_where_it_is_seen():
    watcher = Watcher(rig_of(sensor=make_sensor(position_sigma=0.05)))
    for k in range(6):
        watcher.watch({7: (2.0, 0.1 * k, 0.0)})
    for _ in range(4):
        watcher.watch({})
    watcher.watch({7: (1.5, 0.0, 0.0)})
    np.testing.assert_allclose(watcher.track(7)[0], (1.5, 0.0), atol=1e-9)


@pytest.mark.parametrize(("index", "alpha", "beta"), [(1e-9, 0.0, 0.0), (1.0, 0.75, 0.5), (1e9, 1.0, 2.0)])
def test_gains_suit_the_tracking_index(index, alpha, beta):
    """Kalata's relation: index^2 = beta^2 / (1 - alpha); at index 1 the root is 1/2."""
    found = gains(255, 1.0 / SIGMAS, index)
    assert found == pytest.approx((max(alpha, 1018 / 65280), max(beta, 6 / 65280)), abs=1e-3)


def test_a_return_where_a_neighbour_is_seen_is_its_own_however_far_its_track_lags():
    rows = one_robot(rig_of(sensor=make_sensor(position_sigma=0.03)))
    rows.see([seen(7, 1.0, 0.5)])
    assert near_track(rows.percept, rows.shared, 1.0, 0.4, rows.rig)
    assert not near_track(rows.percept, rows.shared, 2.0, 0.4, rows.rig)
