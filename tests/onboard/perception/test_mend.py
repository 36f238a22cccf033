"""Broken readings: what stands for them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import one_robot
from swarmscope.onboard.perception.mend import body_and_clearance, mend

ONE = math.radians(1.0)


def mended(scan):
    rows = one_robot()
    broken = np.full(360, 7, np.uint8)
    scan = scan.astype(np.float32)
    count = mend(scan, rows.rig, broken)
    return scan, count, np.flatnonzero(broken).tolist()


def test_sound_readings_stay():
    scan, count, broken = mended(np.linspace(0.2, 5.0, 360))
    assert scan == pytest.approx(np.linspace(0.2, 5.0, 360))
    assert (count, broken) == (0, [])


@pytest.mark.parametrize(("beside", "bridged"), [(2.0, 2.0), (0.5, 0.5 * (1.0 - ONE))])
def test_a_small_hole_is_as_near_as_what_is_beside_and_near_the_body_less_a_corner(beside, bridged):
    given = np.full(360, 3.0)
    given[[10, 11]] = np.nan
    given[12] = beside
    scan, count, broken = mended(given)
    assert scan[[10, 11]] == pytest.approx(bridged)
    assert (count, broken) == (2, [10, 11])


def test_a_body_may_be_in_a_hole_in_the_open():
    """A hole of 20 beams is 21 degrees from beam to beam: a body of 0.15 m fits 0.15 / sin(10.5) - 0.15 m away."""
    given = np.full(360, np.inf)
    given[100:120] = np.nan
    assert mended(given)[0][100:120] == pytest.approx(0.15 / math.sin(10.5 * ONE) - 0.15)


@pytest.mark.parametrize("bad", [math.nan, -1.0, 0.0, 0.05])
def test_a_scan_of_broken_readings_touches_the_body(bad):
    rows = one_robot()
    scan, count, _ = mended(np.full(360, bad))
    assert scan == pytest.approx(body_and_clearance(rows.rig))
    assert count == 360
