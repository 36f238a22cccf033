"""Returns that get lost: where and how long they are kept, what shows that they are gone, how losses are counted."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import DT, make_sensor, one_robot, rig_of, seen
from swarmscope.onboard.body import Body
from swarmscope.onboard.edge import Seen
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


@pytest.mark.parametrize(("lost_s", "ticks"), [(1.0, 5), (0.8, 4), (0.4, 3), (0.0, 0)])
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


@pytest.mark.parametrize("distance", [0.5, 4.0])
def test_a_beam_through_it_or_something_nearer_there_ends_it(distance):
    assert after(scan_of(at_180=2.0), scan_of(at_180=distance)) == {AHEAD: distance}


@pytest.mark.parametrize("beside", [-1, 1])
def test_a_beam_beside_it_proves_nothing(beside):
    """A wall's end of 2 cm may lie between the two."""
    kept = {AHEAD: 2.0, AHEAD + beside: 4.0}
    assert after(scan_of(at_180=2.0), scan_of(**{f"at_{AHEAD + beside}": 4.0})) == kept


def test_between_two_beams_the_one_that_does_not_see_it_keeps_it_unless_the_other_does():
    """After a turn by 0.4 degrees it lies between beams 179 and 180."""
    turned = (0.0, 0.0, math.radians(0.4))
    before = scan_of(at_180=2.0)
    assert after(before, scan_of(at_180=4.0), turned) == {179: 2.0, 180: 4.0}
    assert after(before, scan_of(at_179=4.0), turned) == {179: 4.0, 180: 2.0}
    assert after(before, scan_of(at_179=4.0, at_180=4.0), turned) == {179: 4.0, 180: 4.0}
    assert after(before, scan_of(at_179=2.05), turned) == {179: 2.05}
    assert after(before, scan_of(at_179=1.0), turned) == {179: 1.0}


@pytest.mark.parametrize("longest", [5.0, 10.2785, 1.81, 0.1 + 0.2, 19.99999])
def test_a_beam_that_says_the_longest_range_has_seen_nothing(longest):
    """As float32 10.2785 is a little less than itself: it has not looked through the place."""
    rig = rig_of(sensor=make_sensor(range_max=longest))
    near = 0.5 * longest
    then = {int(n): pytest.approx(longest, abs=1e-5) for n in range(360) if n != AHEAD}
    kept = after(scan_of(at_180=near), np.full(360, longest, np.float32), rows=one_robot(rig))
    assert kept == then | {AHEAD: pytest.approx(near, abs=1e-5)}


def test_what_a_neighbour_left_a_tick_ago_is_not_kept_however_slow_scans_are():
    """Once a second others come 1 m: what stood there and was no neighbour's stays, what was his does not."""
    for place, stays in ((0.75, True), (2.0, False)):
        rows = one_robot(rig_of(body=Body(v_max_mps=1.0)))
        for k, x in enumerate((2.0 + 0.15, 1.4)):
            rows.set_time(float(k), 1.0)
            rows.see([Seen(7, x, 0.0)])
            dx, dy = update_odometry(rows.percept, rows.shared)
            update_tracks(rows.percept, rows.shared, rows.rig, dx, dy)
            scan = given(rows, scan_of(at_180=place) if k == 0 else scan_of())
        assert returns(scan) == ({AHEAD: place} if stays else {})


def test_the_end_of_a_wall_stays_nearer_than_the_hole_that_hides_it_is_bridged():
    """A wall comes nearer towards its end at 0.30 m, the beam beside it says 0.36 m; that end is broken twice."""
    rows, wall = one_robot(), scan_of(at_180=0.30, at_181=0.36, at_182=0.43, at_179=2.3)
    broken = scan_of(at_180=np.nan, at_181=0.36, at_182=0.43, at_179=2.3)
    assert returns(given(one_robot(), broken))[180] == pytest.approx(0.36, abs=0.01)
    given(rows, wall)
    for _ in range(2):
        assert returns(given(rows, broken)) == {179: 2.3, 180: 0.30, 181: 0.36, 182: 0.43}


def test_through_a_hole_nobody_looks_farther_than_to_what_bridges_it():
    """Behind a broken beam 1 m away nothing has been seen when the next scan is broken there and 3 m to its sides."""
    near = np.full(360, 3.0, np.float32)
    near[178:183] = 1.0
    hole, far = near.copy(), np.full(360, 3.0, np.float32)
    hole[180] = far[180] = np.nan
    rows = one_robot()
    given(rows, near)
    given(rows, hole)
    assert rows.view.hidden[180] == math.inf
    assert rows.view.kept[180] == pytest.approx(1.0, abs=0.02)  # it was there, and is kept
    rows = one_robot()
    for scan in (np.full(360, 3.0, np.float32), hole):
        given(rows, scan)
    assert rows.view.kept[180] == pytest.approx(-1.0, abs=0.02)
    given(rows, far)
    assert rows.view.hidden[180] == pytest.approx(1.0, abs=0.02)


def test_what_is_near_is_found_again_where_it_has_gone_in_a_step():
    """0.5 m beside the robot, which drives 0.2 m: 22 degrees farther behind; all other beams see a wall."""
    wall = np.full(360, 3.0, np.float32)
    thing, gap = wall.copy(), wall.copy()
    thing[90] = 0.5
    gap[67:70] = np.inf
    assert after(thing, gap, (0.2, 0.0, 0.0))[68] == pytest.approx(math.hypot(0.5, 0.2))


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


def test_the_share_of_losses_is_remembered_but_for_two_that_slip_between_beams():
    """Five of six returns are lost once, which counts as three; then they are there again, then all six are lost."""
    rows = one_robot()
    places = ("at_10", "at_60", "at_100", "at_190", "at_240", "at_280")
    six = scan_of(**dict.fromkeys(places, 2.0))
    given(rows, six)
    given(rows, scan_of(at_10=2.0))
    assert rows.shared["losses"] == pytest.approx(0.1 * 3 / 4)
    given(rows, six)
    assert rows.shared["losses"] == pytest.approx(MEMORY * 0.075)
    given(rows, scan_of())
    assert rows.shared["losses"] == pytest.approx(MEMORY * MEMORY * 0.075 + 0.1)


def test_a_lidar_that_goes_blind_is_noticed_until_it_sees_again():
    rows = one_robot()
    given(rows, scan_of(at_100=2.0, at_180=2.0, at_260=2.0))
    blind = []
    for _ in range(8):  # longer than the returns themselves are kept
        given(rows, scan_of())
        blind.append(float(rows.shared["blind_s"]))
    assert blind == pytest.approx(DT * np.arange(1, 9))
    given(rows, scan_of(at_20=4.0))
    assert rows.shared["blind_s"] == 0.0


def test_one_return_that_slips_between_two_beams_is_not_blindness():
    rows = one_robot()
    given(rows, scan_of(at_180=2.0))
    given(rows, scan_of())
    assert (rows.shared["blind_s"], rows.shared["losses"]) == (0.0, 0.0)


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


def test_what_a_long_step_leaves_behind_out_of_range_is_not_blindness():
    """At 4.4 m of 5, and 1 m farther away at the next scan."""
    rows = one_robot()
    given(rows, scan_of(**{f"at_{n}": 4.4 for n in range(170, 190)}))
    given(rows, scan_of(), (-1.0, 0.0, 0.0))
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
