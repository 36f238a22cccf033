"""Holes of broken beams: what would show beside them, and what the last scan has looked at."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import make_sensor, one_robot, rig_of
from swarmscope.onboard.perception.lost import keep_lost
from swarmscope.onboard.perception.mend import mend, shows_beside
from swarmscope.onboard.sensor import all_round

DEGREE = math.radians(1.0)


def scan_of(*broken, distance=3.0):
    scan = np.full(360, distance, np.float32)
    scan[list(broken)] = np.nan
    return scan


def after(*scans, moved=(0.0, 0.0, 0.0), rows=None):
    """The beams in which something may be hidden within 1 m, after some scans; ``moved`` before the last of them."""
    rows = rows or one_robot()
    for k, scan in enumerate(scans):
        last = moved if k == len(scans) - 1 else (0.0, 0.0, 0.0)
        rows.view.scan[:], rows.view.hidden[:] = scan, np.inf
        broken = mend(rows.view.scan, rows.rig, rows.view.safe)
        rows.fill(odom_x=last[0], odom_y=last[1], odom_yaw=last[2])
        keep_lost(rows.view, broken)
    return np.flatnonzero(rows.view.hidden < 1.0).tolist()


@pytest.mark.parametrize("width", [1, 2, 5])
def test_what_shows_beside_a_hole(width):
    """The post of 2 cm that ends there touches the beams on both sides of the hole."""
    reach = shows_beside(width, rig_of())
    assert (reach + 0.01) * math.sin(0.5 * (width + 1) * DEGREE) == pytest.approx(0.01)


def test_beside_broken_beams_all_round_nothing_shows():
    assert shows_beside(359, rig_of()) == 0.0


def test_where_nothing_is_narrow_nothing_stands_in_a_hole():
    rows = one_robot(rig=rig_of(thinnest_m=0.0))
    assert after(scan_of(10, 11, 200), rows=rows) == []
    assert shows_beside(1, rows.rig) == math.inf
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
        assert rows.view.hidden[n] == pytest.approx(shows_beside(3, rows.rig))


def test_out_of_a_limited_view_the_last_scan_has_not_looked():
    rig = rig_of(sensor=all_round(make_sensor(beams=181, fov=math.pi)))
    rows = one_robot(rig)
    for name, beam in (("view_first", 89), ("view_last", 269), ("was_first", 89), ("was_last", 269)):
        rows.shared[name] = beam
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


def test_of_a_hole_that_stays_as_much_is_known_as_was_looked_at_before():
    """A hole of five beams ahead is turned into after 1 m ahead has been seen; then the robot drives on."""
    rows, hole = one_robot(), scan_of(*range(178, 183))
    assert after(scan_of(), hole, rows=rows) == []
    known = rows.view.hidden[180]
    assert known == math.inf  # up to where 2 cm show between two beams
    assert after(hole, moved=(0.1, 0.0, 0.0), rows=rows) == []
    assert rows.view.hidden[180] == pytest.approx(rows.rig.horizon.things - 0.1, abs=0.02)
    for _ in range(9):
        flagged = after(hole, moved=(0.1, 0.0, 0.0), rows=rows)
    assert 180 in flagged
    assert rows.view.hidden[180] == pytest.approx(shows_beside(5, rows.rig), abs=0.02)


def test_both_beams_beside_a_place_must_have_looked_there():
    """After a turn by half a beam the place of beam 180 lies between two; one of them ended before it."""
    turn = (0.0, 0.0, 0.5 * DEGREE)
    for blocked in (180, 181):
        near = scan_of()
        near[blocked] = 0.3
        assert after(near, scan_of(180), moved=turn) == [180]
    near = scan_of()
    near[[179, 182]] = 0.3
    assert after(near, scan_of(180), moved=turn) == []


def test_a_post_that_slips_between_two_beams_has_not_been_looked_past():
    """2 cm wide and 1.3 m away it may show in no beam: then the hole is on it until it is near."""
    rows, hole = one_robot(), scan_of(179, 180, 181)
    after(scan_of(), rows=rows)
    for _ in range(4):
        after(hole, moved=(0.1, 0.0, 0.0), rows=rows)
    assert rows.view.hidden[180] < 1.3 - 0.4 - 0.01
