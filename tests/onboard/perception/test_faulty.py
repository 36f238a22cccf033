"""Beams that never see anything, told by what the beams beside them see."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import make_sensor, rig_of
from swarmscope.onboard.perception.faulty import PATIENCE, TOGETHER, leave_out_faulty
from swarmscope.onboard.sensor import all_round

INF = np.inf


def shown(scans, rig=None):
    """What is left of the last of some scans."""
    rig = rig or rig_of()
    misses = np.zeros(rig.sensor.beams, np.uint8)
    for scan in scans:
        out = np.array(scan, np.float32)
        leave_out_faulty(out, misses, rig)
    return out


def wall(*silent, distance=2.0):
    scan = np.full(360, distance, np.float32)
    scan[list(silent)] = INF
    return scan


def test_a_beam_that_misses_a_surface_again_and_again_is_broken():
    assert np.isinf(shown([wall(90)] * (PATIENCE - 1))[90])
    assert np.isnan(shown([wall(90)] * PATIENCE)[90])
    assert np.isnan(shown([wall(90)] * 300)[90])  # counts do not start again


def test_others_are_left_alone():
    out = shown([wall(90)] * PATIENCE)
    assert np.array_equal(np.delete(out, 90), np.delete(wall(90), 90))


@pytest.mark.parametrize("silent", [range(90, 90 + TOGETHER), range(91 - TOGETHER, 91), (359, 0), (0,), (359,)])
def test_a_few_side_by_side_are_noticed_wherever_they_are(silent):
    out = shown([wall(*silent)] * PATIENCE)
    assert np.isnan(out[list(silent)]).all()
    assert np.isfinite(np.delete(out, list(silent))).all()


def test_a_wider_gap_is_a_gap():
    silent = range(90, 91 + TOGETHER)
    assert np.isinf(shown([wall(*silent)] * 10)[list(silent)]).all()


def test_a_gap_between_a_near_and_a_far_thing_is_a_gap():
    scan = wall(90)
    scan[:90] = 3.0
    assert np.isinf(shown([scan] * 10)[90])


def test_what_is_near_the_end_of_the_range_may_be_missed():
    assert np.isinf(shown([wall(90, distance=4.8)] * 10)[90])


@pytest.mark.parametrize(("beams", "missed"), [(60, False), (120, False), (360, True)])
def test_a_door_is_no_fault(beams, missed):
    """Three silent beams of 60 are a gap of 0.8 m at 2 m, of 120 one of 0.4 m, of 360 one of 0.14 m."""
    scan = np.full(beams, 2.0, np.float32)
    scan[20:23] = INF
    assert np.isnan(shown([scan] * 10, rig_of(sensor=make_sensor(beams)))[20:23]).all() == missed


def test_one_return_clears_a_beam():
    out = shown([*[wall(90)] * 10, wall(), *[wall(90)] * (PATIENCE - 1)])
    assert np.isinf(out[90])


def test_the_longest_range_is_no_return():
    scan = wall(90)
    scan[90] = 5.0
    assert np.isnan(shown([scan] * PATIENCE)[90])


def test_out_of_a_limited_view_nothing_is_missed():
    rig = rig_of(sensor=all_round(make_sensor(90, 0.5 * math.pi)))
    sensor = rig.sensor
    scan = np.full(sensor.beams, INF, np.float32)
    scan[sensor.first : sensor.first + sensor.field] = 2.0
    scan[[sensor.first - 3, sensor.first + sensor.field + 1]] = 2.0
    assert not np.isnan(shown([scan] * 10, rig)).any()
