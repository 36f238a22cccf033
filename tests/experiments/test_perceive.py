"""Recorded scans through the on-board perception."""

from __future__ import annotations

import csv
import math
from dataclasses import replace

import numpy as np
import pytest

from helpers import circles_world, one_robot, rig_of, scan_at
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.experiments.lay_out_scans import Use
from swarmscope.experiments.perceive import perceive, write_features
from swarmscope.onboard.body import Body
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.rig import AHEAD, Safety, Sharing
from swarmscope.onboard.tick import own_features
from swarmscope.sim.scan_files import SCAN_FOLDER, ScanLog, load_scans
from swarmscope.viewing.perceive_picture import PANELS, fan_reach, write_perceive_picture


def log_of(ranges, fov=2.0 * math.pi, range_max=30.0, range_min=0.0):
    """A log of scans (K, M); a full circle unless told otherwise."""
    ranges = np.atleast_2d(np.asarray(ranges, np.float32))
    beams = ranges.shape[1]
    full = fov == 2.0 * math.pi
    increment = fov / (beams if full else beams - 1)
    stamps = np.arange(len(ranges), dtype=float)
    return ScanLog("test", ranges, stamps, -0.5 * fov, increment, range_min, range_max, None)


@pytest.fixture(scope="module")
def real():
    return load_scans(SCAN_FOLDER / "malaga_telecom_2006_sick_lms.npz")


@pytest.fixture(scope="module")
def forest_scans():
    trees = [(1.5, 0.4, 0.3), (-2.0, 1.0, 0.4), (0.3, -1.8, 0.25), (3.0, -2.0, 0.5)]
    world = circles_world(trees)
    return np.stack([scan_at(world, rig_of(), 0.0, 0.0, yaw) for yaw in (0.0, 1.0, 2.5)])


def test_every_real_scan_is_perceived(real):
    seen = perceive(real)
    scans, beams = real.ranges_m.shape
    assert seen.safe.shape == seen.filtered_m.shape == (scans, beams)
    assert len(seen.features) == len(seen.packet_bytes) == len(seen.us) == scans
    assert 0.2 < seen.safe.mean() < 0.95
    assert np.array_equal(seen.packet_bytes, [12 + 2 * len(pairs) for pairs in seen.features])
    assert seen.packet_bytes.mean() <= 34.0
    assert np.all(seen.us > 0.0)
    assert not seen.rig.sensor.wraps and seen.rig.sensor.range_max == 5.0


def test_safe_directions_of_real_scans_lead_the_body_past_all_returns(real):
    seen = perceive(real)
    cos, sin = np.cos(seen.angles), np.sin(seen.angles)
    for k in range(0, len(seen.safe), 7):
        r = np.where(np.isfinite(seen.ranges_m[k]), seen.ranges_m[k], 1e6)
        x, y = r * cos, r * sin
        near = r < seen.rig.protection.l_th
        for n in np.flatnonzero(seen.safe[k]):
            ahead, across = x * cos[n] + y * sin[n], np.abs(y * cos[n] - x * sin[n])
            assert not np.any(near & (ahead > 0.0) & (across < seen.rig.body.radius_m)), (k, n)


def test_it_is_what_the_robots_kernels_say(forest_scans):
    seen = perceive(log_of(forest_scans))
    rig = seen.rig
    assert rig.sensor.wraps
    for k, scan in enumerate(forest_scans):
        see = one_robot(rig).view
        see.masked[:] = scan
        safe_directions(see.masked, rig.sensor, rig.reach[-1, AHEAD], see.edges, see.safe)
        count = own_features(see)
        assert np.array_equal(seen.safe[k], see.safe == 1)
        assert len(seen.features[k]) == count > 0
        assert np.allclose(seen.features[k][:, 1], see.own.distances[:count])


def test_turning_the_sensor_turns_the_features(forest_scans):
    scan = forest_scans[0]
    straight, turned = perceive(log_of(scan)), perceive(log_of(np.roll(scan, 90)))
    a, b = straight.features[0], turned.features[0]
    assert sorted(np.round(a[:, 1], 4)) == sorted(np.round(b[:, 1], 4))
    moved = np.sort(np.mod(a[:, 0] + 0.5 * math.pi, 2.0 * math.pi))
    assert np.allclose(moved, np.sort(np.mod(b[:, 0], 2.0 * math.pi)), atol=1e-5)


def test_returns_beyond_the_robots_range_count_as_none():
    far = np.full(360, 7.0, np.float32)
    seen = perceive(log_of(far), Use(range_m=5.0))
    assert np.isinf(seen.ranges_m).all() and seen.safe.all() and len(seen.features[0]) == 0


def test_a_scan_that_is_invalid_throughout_leaves_no_direction():
    scans = np.full((2, 360), np.nan, np.float32)
    scans[1] = np.inf
    seen = perceive(log_of(scans))
    assert not seen.safe[0].any() and seen.safe[1].all()


@pytest.mark.parametrize("beams", [(10, 85, 160, 230, 310), (180,)])
@pytest.mark.parametrize("walls_m", [math.inf, 4.0])
def test_single_broken_readings_close_no_direction_and_are_counted(beams, walls_m):
    """In the open and in a round room: once five of 360 that were no number left no direction at all."""
    whole = np.full(360, walls_m, np.float32)
    torn = whole.copy()
    torn[list(beams)] = np.nan
    seen = perceive(log_of(np.stack([whole, torn])))
    assert seen.safe.all()
    assert seen.counts.broken.tolist() == [0, len(beams)]
    assert len(seen.features[1]) == len(seen.features[0])


def test_a_hole_in_which_a_body_fits_closes_its_directions():
    torn = np.full(360, np.inf, np.float32)
    torn[120:240] = np.nan
    seen = perceive(log_of(torn))
    assert not seen.safe[0, 120:240].any() and seen.safe[0, :25].all()
    assert seen.counts.broken.tolist() == [120]


def test_the_log_itself_is_not_changed(forest_scans):
    log = log_of(forest_scans)
    before = log.ranges_m.copy()
    perceive(log, Use(range_m=2.0, beam_step=2))
    assert np.array_equal(log.ranges_m, before)


def test_beam_step_takes_every_kth_beam(forest_scans):
    log = log_of(forest_scans)
    seen = perceive(log, Use(beam_step=3))
    assert seen.safe.shape == (3, 120) and seen.rig.sensor.wraps
    assert np.allclose(np.diff(seen.angles), 3.0 * log.increment)
    assert np.array_equal(seen.ranges_m[0][np.isfinite(seen.ranges_m[0])], _finite(log.ranges_m[0, ::3]))


def _finite(values):
    return values[np.isfinite(values)]


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"range_m": 0.0}, "--range"),
        ({"range_m": math.nan}, "--range"),
        ({"range_m": math.inf}, "--range"),
        ({"body": Body(radius_m=0.0)}, "radius"),
        ({"body": Body(radius_m=math.nan)}, "radius"),
        ({"beam_step": 0}, "--beam-step"),
        ({"beam_step": 500}, "two beams"),
    ],
)
def test_impossible_options_are_refused(options, words, forest_scans):
    with pytest.raises(ConfigError, match=words):
        perceive(log_of(forest_scans), Use(**options))


def test_more_readings_than_a_robot_uses_are_refused():
    with pytest.raises(ConfigError, match="--beam-step"):
        perceive(log_of(np.full(9000, 3.0)))
    assert perceive(log_of(np.full(9000, 3.0)), Use(beam_step=10)).safe.shape == (1, 900)


def test_a_range_below_the_scanners_smallest_is_refused(forest_scans):
    with pytest.raises(ConfigError, match="smallest range"):
        perceive(log_of(forest_scans, range_min=0.5), Use(range_m=0.4))


def test_features_table_holds_every_feature(forest_scans, tmp_path):
    seen = perceive(log_of(forest_scans))
    path = write_features(tmp_path / "new" / "features.csv", seen)
    rows = list(csv.DictReader(path.open()))
    assert len(rows) == sum(map(len, seen.features))
    k, direction, distance = (float(value) for value in rows[-1].values())
    assert [direction, distance] == pytest.approx(seen.features[int(k)][-1], abs=1e-4)


@pytest.mark.parametrize("scans", [1, 3, 20])
def test_picture_shows_up_to_six_scans_and_is_the_same_twice(scans, forest_scans, tmp_path):
    seen = perceive(log_of(np.resize(forest_scans, (scans, 360))))
    pictures = [write_perceive_picture(tmp_path / f"{k}.png", seen, "t").read_bytes() for k in range(2)]
    assert pictures[0] == pictures[1] and pictures[0].startswith(b"\x89PNG")
    assert PANELS == 6


def test_picture_says_when_it_cannot_be_written(forest_scans, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputFileError, match="cannot be written"):
        write_perceive_picture(tmp_path / "file" / "p.png", perceive(log_of(forest_scans)), "t")


@pytest.mark.parametrize("walls_m", [0.5, 1.0, 4.0])
def test_the_fan_of_safe_directions_ends_before_every_return(walls_m, forest_scans):
    """Returns are drawn over no fan: no point of a scan lies within the polygon of any run of safe directions."""
    seen = perceive(log_of(np.vstack([forest_scans, np.full((1, 360), walls_m)])))
    for k in range(4):
        reach, ranges = fan_reach(seen, k), seen.ranges_m[k]
        assert (reach <= 2.0).all() and (reach[np.isinf(ranges)] > 0.0).all()
        for n in np.flatnonzero(np.isfinite(ranges)):
            assert max(reach[n - 1], reach[n], reach[(n + 1) % 360]) <= 0.971 * ranges[n]


def corridor_log(v, w, scans=4, beams=360, hz=5.0, **more):
    """What a LiDAR that turns once a scan sees in a corridor 2 m wide, on a robot that drives an arc."""
    rows, odom, stamps = [], [], np.arange(scans) / hz
    for stamp in stamps:
        t = stamp + np.arange(beams) / beams / hz
        x, y, yaw = on_arc(t, v, w)
        angles = yaw - math.pi + 2.0 * math.pi * np.arange(beams) / beams
        with np.errstate(divide="ignore"):
            side = np.where(np.sin(angles) > 0.0, 1.0 - y, -1.0 - y) / np.sin(angles)
            end = np.where(np.cos(angles) > 0.0, 4.0 - x, -4.0 - x) / np.cos(angles)
        rows.append(np.minimum(side, end))
        odom.append(np.array(on_arc(stamp, v, w)))
    log = log_of(rows)
    return replace(log, stamp_s=stamps, odom=np.array(odom), time_increment=1.0 / hz / beams, **more)


def on_arc(t, v, w):
    return (v / w * np.sin(w * t), v / w * (1.0 - np.cos(w * t)), w * t) if w else (v * t, 0.0 * t, 0.0 * t)


def bent(seen, k, pose):
    """How far the median return of scan k lies off the walls of the corridor, and the 9th decile [m]."""
    angles, ranges = seen.angles + pose[2], seen.ranges_m[k]
    near = np.isfinite(ranges)
    x, y = pose[0] + ranges[near] * np.cos(angles[near]), pose[1] + ranges[near] * np.sin(angles[near])
    off = np.minimum(np.abs(np.abs(y) - 1.0), np.abs(np.abs(x) - 4.0))
    return np.quantile(off, [0.5, 0.9])


@pytest.mark.parametrize(("v", "w"), [(1.0, 0.0), (1.0, 0.8), (0.2, -1.0)])
def test_scans_are_put_right_for_the_robots_own_motion(v, w):
    """By odometry, and by the speed that the user says; at 1 m/s and 5 Hz; without either they are bent."""
    log = corridor_log(v, w)
    last_s = [stamp + 0.2 * 359 / 360 for stamp in log.stamp_s]
    for chosen, use in ((log, Use()), (replace(log, odom=None), Use(motion=(v, w)))):
        seen = perceive(chosen, use)
        assert seen.counts.moved == 4
        for k, at in enumerate(last_s):
            assert bent(seen, k, on_arc(at, v, w))[1] < 0.002
    for chosen, use in ((replace(log, odom=None), Use()), (log, Use(time_increment_s=0.0))):
        seen = perceive(chosen, use)
        assert seen.counts.moved == 0
        assert bent(seen, 1, on_arc(last_s[1], v, w))[1] > 0.03


def test_scans_that_take_too_long_are_refused():
    with pytest.raises(ConfigError, match=r"would take 35\.9 s"):
        perceive(corridor_log(1.0, 0.0), Use(time_increment_s=0.1))


def test_the_whole_data_sheet_counts(forest_scans):
    """A wider robot has fewer safe directions, and so has a faster one, or one that keeps off more."""
    log = log_of(forest_scans)
    free = [
        perceive(log, use).safe.sum()
        for use in (
            Use(),
            Use(body=Body(radius_m=0.3, half_width_m=0.3)),
            Use(body=Body(v_max_mps=2.0)),
            Use(safety=Safety(margin_m=0.3)),
        )
    ]
    assert all(less < free[0] for less in free[1:])
    assert (perceive(log, Use(range_min_m=2.0)).counts.below > 0).all()
    exact = perceive(log, Use(sharing=Sharing(exact_features=True)))
    assert exact.packet_bytes.min() > perceive(log).packet_bytes.max() > 20


def test_half_a_circle_in_the_open_is_free_while_the_robot_drives():
    log = replace(log_of(np.full((2, 181), np.inf), fov=math.pi), time_increment=0.001)
    still, driven = perceive(log), perceive(log, Use(motion=(1.0, 0.0)))
    assert driven.counts.moved == 2 and np.array_equal(driven.safe, still.safe) and still.safe.sum() > 200
    other = perceive(replace(log, geometry=np.array([[-0.5 * math.pi, math.pi / 180], [-0.5 * math.pi, 0.0175]])))
    assert other.counts.turned == 1 and other.safe[1].sum() > 100
