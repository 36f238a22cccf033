"""Holes of broken beams: what would show beside them, and what the last scan has looked through."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import make_sensor, one_robot, rig_of
from swarmscope.onboard.perception.holes import nothing_up_to, shows_beside
from swarmscope.onboard.perception.lost import keep_lost
from swarmscope.onboard.perception.mend import mend
from swarmscope.onboard.sensor import all_round
from swarmscope.onboard.view import BROKEN

DEGREE = math.radians(1.0)


def scan_of(*broken, distance=3.0):
    scan = np.full(360, distance, np.float32)
    scan[list(broken)] = np.nan
    return scan


def after(*scans, moved=(0.0, 0.0, 0.0), rows=None):
    """The beams in whose holes something may stand, after some scans; ``moved`` before the last of them."""
    rows = rows or one_robot()
    for k, scan in enumerate(scans):
        last = moved if k == len(scans) - 1 else (0.0, 0.0, 0.0)
        rows.view.scan[:] = scan
        broken = mend(rows.view.scan, rows.rig, rows.view.safe)
        rows.fill(odom_x=last[0], odom_y=last[1], odom_yaw=last[2])
        keep_lost(rows.view, broken)
    return np.flatnonzero(rows.view.unseen & BROKEN).tolist()


@pytest.mark.parametrize("width", [1, 2, 5])
def test_what_shows_beside_a_hole(width):
    """2 cm fill the hole there from beam to beam."""
    reach = shows_beside(width, rig_of())
    assert 2.0 * reach * math.sin(0.5 * (width + 1) * DEGREE) == pytest.approx(0.02)


def test_beside_broken_beams_all_round_nothing_shows():
    assert shows_beside(359, rig_of()) == 0.0


def test_where_nothing_is_narrow_nothing_stands_in_a_hole():
    rows = one_robot(rig=rig_of(thinnest_m=0.0))
    assert after(scan_of(10, 11, 200), rows=rows) == []
    assert nothing_up_to(rows.view, 10) == math.inf
    assert after(np.full(360, np.nan, np.float32), rows=rows) == []


def test_at_first_nobody_has_looked_into_a_hole():
    assert after(scan_of(10, 11, 200)) == [10, 11, 200]


def test_what_the_last_scan_has_looked_through_is_no_hole():
    assert after(scan_of(), scan_of(10, 11, 200)) == []
    assert after(scan_of(11), scan_of(10, 11, 200)) == [11]


def test_nor_is_it_one_tick_after_tick():
    assert after(scan_of(), *[scan_of(10, 11)] * 5) == []
    assert after(*[scan_of(10, 11)] * 5) == [10, 11]


def test_a_scan_that_ended_sooner_has_not_looked_there():
    """A wall 0.3 m away has gone, or is lost: nobody has looked behind it."""
    assert after(scan_of(distance=0.3), scan_of(180)) == [180]


def test_beams_of_the_last_scan_are_found_after_a_turn():
    """After 5 degrees to the left the place at beam 180 was at beam 185."""
    turn = (0.0, 0.0, 5.0 * DEGREE)
    assert after(scan_of(185), scan_of(180), moved=turn) == [180]
    assert after(scan_of(180), scan_of(180), moved=turn) == []


def test_a_hole_where_the_circle_closes_is_one_hole():
    rows = one_robot()
    assert after(scan_of(359, 0, 1), rows=rows) == [0, 1, 359]
    for n in (359, 0, 1):
        assert nothing_up_to(rows.view, n) == pytest.approx(shows_beside(3, rows.rig))


def test_out_of_a_limited_view_the_last_scan_has_not_looked():
    rig = rig_of(sensor=all_round(make_sensor(beams=181, fov=math.pi)))
    rows = one_robot(rig)
    rows.shared["view_first"], rows.shared["view_last"] = 89, 269
    turn = (0.0, 0.0, 30.0 * DEGREE)
    assert after(scan_of(), scan_of(265, 200), moved=turn, rows=rows) == [265]


def test_where_odometry_drifts_the_beams_beside_the_place_count():
    """5 cm after 1 m are 1.6 cm after 10 cm; thrice that are nine beams to either side of a place 0.3 m away."""
    near, moved = scan_of(), (0.1, 0.0, 0.0)
    near[175] = 0.2
    assert after(near, scan_of(180), moved=moved) == []
    drifting = one_robot(rig_of(odometry_drift_m=0.05))
    assert after(near, scan_of(180), moved=moved, rows=drifting) == [180]
    assert after(near, scan_of(180), moved=(0.0, 0.0, 0.0), rows=drifting) == []
