"""Returns that get lost: where and how long they are kept, what shows that they are gone, how losses are counted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import DT, make_sensor, one_robot, rig_of, seen
from swarmscope.onboard.perception.frames import look_back
from swarmscope.onboard.perception.lost import MEMORY, WITHIN, keep_lost
from swarmscope.onboard.perception.mend import mend
from swarmscope.onboard.sensor import all_round
from swarmscope.onboard.sharing.tracks import update_odometry, update_tracks

AHEAD = 180
"""The beam straight ahead; beams are 1 degree apart."""


def scan_of(**returns):
    """An open scan with returns: ``at_180=2.0`` is 2 m on beam 180."""
    scan = np.full(360, np.inf, np.float32)
    for beam, distance in returns.items():
        scan[int(beam[3:])] = distance
    return scan


def given(rows, scan, moved=(0.0, 0.0, 0.0)):
    """Tell the robot a scan and how it has moved since the last; return the scan with what it has kept."""
    rows.scan[:] = scan
    broken = mend(rows.scan, rows.rig, rows.view.safe)
    rows.fill(odom_x=moved[0], odom_y=moved[1], odom_yaw=moved[2])
    keep_lost(rows.view, broken)
    return rows.scan.copy()


def returns(scan):
    return {int(n): pytest.approx(float(scan[n]), abs=1e-5) for n in np.flatnonzero(np.isfinite(scan))}


def after(first, then, moved=(0.0, 0.0, 0.0), rows=None):
    """What is kept when ``then`` follows ``first``."""
    rows = rows or one_robot()
    given(rows, first)
    return returns(given(rows, then, moved))


def test_a_scan_with_nothing_lost_stays_as_it_is():
    rows = one_robot()
    scan = np.linspace(1.0, 4.0, 360).astype(np.float32)
    for _ in range(3):
        assert given(rows, scan).tobytes() == scan.tobytes()
    assert (rows.shared["losses"], rows.shared["blind_s"]) == (0.0, 0.0)


@pytest.mark.parametrize(("lost_s", "ticks"), [(1.0, 5), (0.4, 2), (0.0, 0)])
def test_what_is_lost_is_kept_where_it_was_for_a_while(lost_s, ticks):
    rows = one_robot(rig_of(lost_s=lost_s))
    given(rows, scan_of(at_180=2.0))
    kept = [returns(given(rows, scan_of())) for _ in range(8)]
    assert kept == [{AHEAD: 2.0}] * ticks + [{}] * (8 - ticks)


def test_what_shows_again_is_kept_anew():
    rows = one_robot()
    given(rows, scan_of(at_180=2.0))
    for _ in range(3):
        given(rows, scan_of())
    given(rows, scan_of(at_180=2.0))
    assert [len(returns(given(rows, scan_of()))) for _ in range(6)] == [1, 1, 1, 1, 1, 0]


def test_it_is_moved_by_odometry():
    """2 m ahead, then half a metre nearer; 30 degrees to the right after a turn to the left; both."""
    assert after(scan_of(at_180=2.0), scan_of(), (0.5, 0.0, 0.0)) == {180: 1.5}
    assert after(scan_of(at_180=2.0), scan_of(), (0.0, 0.0, math.radians(30.0))) == {150: 2.0}
    assert after(scan_of(at_180=2.0), scan_of(), (0.0, 0.0, math.radians(-170.0))) == {350: 2.0}
    assert after(scan_of(at_180=2.0), scan_of(), (2.0, -1.0, math.radians(30.0))) == {240: 1.0}  # 90 - 30 degrees
    assert after(scan_of(at_5=2.0), scan_of(), (0.0, 0.0, math.radians(10.0))) == {355: 2.0}  # past the circle's end


@pytest.mark.parametrize("beside", [-1, 0, 1])
@pytest.mark.parametrize("distance", [0.5, 4.0])
def test_a_beam_that_passes_it_or_something_nearer_ends_it(beside, distance):
    other = {f"at_{AHEAD + beside}": distance}
    assert after(scan_of(at_180=2.0), scan_of(**other)) == {AHEAD + beside: distance}


def test_two_beams_beside_it_end_nothing():
    assert after(scan_of(at_180=2.0), scan_of(at_182=4.0)) == {180: 2.0, 182: 4.0}


@pytest.mark.parametrize(("share", "kept"), [(WITHIN - 0.001, 1), (WITHIN + 0.001, 0)])
def test_what_is_near_the_longest_range_leaves_it_by_itself(share, kept):
    assert len(after(scan_of(at_180=5.0 * share), scan_of())) == kept


def test_what_the_robot_has_driven_over_is_not_there():
    """It cannot be nearer than half the radius, 0.075 m."""
    assert after(scan_of(at_180=0.5), scan_of(), (0.42, 0.0, 0.0)) == {180: 0.08}
    assert after(scan_of(at_180=0.5), scan_of(), (0.44, 0.0, 0.0)) == {}


def test_of_two_that_come_to_lie_on_a_beam_the_nearer_is_kept():
    """From 1 m on and 1 m to the right the returns at (2, 0) and nearly (3, 1) are both 45 degrees to the left."""
    assert after(scan_of(at_180=2.0, at_198=3.16), scan_of(), (1.0, -1.0, 0.0)) == {225: math.sqrt(2.0)}


def test_a_neighbour_that_drives_on_leaves_nothing_behind():
    rows = one_robot()
    rows.see([seen(3, 2.15, 0.0)])
    update_odometry(rows.percept, rows.shared)
    update_tracks(rows.percept, rows.shared, rows.rig, 0.0, 0.0)
    assert after(scan_of(at_180=2.0), scan_of(), rows=rows) == {}


def test_what_leaves_a_limited_view_is_not_lost():
    """180 degrees, beams 89 to 269: after a turn of 20 degrees the return on beam 95 is behind."""
    rows = one_robot(rig_of(sensor=all_round(make_sensor(beams=181, fov=math.pi))))
    view = rows.view
    for scan, turn in ((scan_of(at_95=2.0, at_180=2.0), 0.0), (scan_of(), math.radians(20.0))):
        view.scan[:] = scan
        rows.fill(odom_yaw=turn)
        look_back(view)
        keep_lost(view, 0)
    assert returns(view.scan) == {160: 2.0}


def test_the_share_of_losses_is_remembered():
    """Three of four returns are lost once; then they are there again, then all four are lost."""
    rows = one_robot()
    four = scan_of(at_10=2.0, at_100=2.0, at_190=2.0, at_280=2.0)
    given(rows, four)
    given(rows, scan_of(at_10=2.0))
    assert rows.shared["losses"] == pytest.approx(0.1 * 3 / 4)
    given(rows, four)
    assert rows.shared["losses"] == pytest.approx(MEMORY * 0.075)
    given(rows, scan_of())
    assert rows.shared["losses"] == pytest.approx(MEMORY * MEMORY * 0.075 + 0.1)


def test_a_lidar_that_goes_blind_is_noticed_until_it_sees_again():
    rows = one_robot()
    given(rows, scan_of(at_180=2.0))
    blind = []
    for _ in range(8):  # longer than the return itself is kept
        given(rows, scan_of())
        blind.append(float(rows.shared["blind_s"]))
    assert blind == pytest.approx(DT * np.arange(1, 9))
    given(rows, scan_of(at_20=4.0))
    assert rows.shared["blind_s"] == 0.0


def test_an_open_place_is_not_blindness():
    rows = one_robot()
    for _ in range(10):
        given(rows, scan_of())
    assert (rows.shared["blind_s"], rows.shared["losses"]) == (0.0, 0.0)


def test_what_left_the_range_is_not_blindness():
    rows = one_robot()
    given(rows, scan_of(at_180=4.6))
    given(rows, scan_of())
    assert (rows.shared["blind_s"], rows.shared["losses"]) == (0.0, 0.0)


def test_a_broken_beam_has_not_passed_the_place_where_something_was():
    wall = np.full(360, 3.0, np.float32)
    wall[AHEAD] = 0.5
    torn = wall.copy()
    torn[AHEAD] = np.nan
    rows = one_robot()
    given(rows, wall)
    assert given(rows, torn)[AHEAD] == np.float32(0.5)  # bridged from beside it would be 3 m
    for _ in range(3):
        assert given(rows, torn)[AHEAD] == np.float32(0.5)
    assert given(rows, np.full(360, 3.0, np.float32))[AHEAD] == np.float32(3.0)
    assert given(rows, torn)[AHEAD] == np.float32(3.0)
    assert rows.shared["losses"] == 0.0


def test_what_a_hole_was_bridged_with_is_not_kept():
    torn = np.full(360, 3.0, np.float32)
    torn[AHEAD], torn[AHEAD + 1] = np.nan, 1.0
    rows = one_robot()
    assert given(rows, torn)[AHEAD] == np.float32(1.0)
    torn[AHEAD + 1] = 3.0
    assert given(rows, torn)[AHEAD] == np.float32(3.0)
