"""What a limited field of view remembers: where kept scans show things, what was seen free, which scans are kept.

The LiDAR has 181 beams 1 degree apart, from -90 to 90 degrees; in the full circle they are beams 89 to 269.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import make_sensor, one_robot, rig_of, seen
from swarmscope.onboard.perception.frames import in_view, keep_frame, look_back, shorten_frame, was_free
from swarmscope.onboard.perception.mend import mend
from swarmscope.onboard.sensor import all_round
from swarmscope.onboard.sharing.tracks import update_odometry, update_tracks

RADIUS = 0.15
NAN, INF = math.nan, math.inf
SIXTY = math.radians(60.0)
NARROW = rig_of().horizon.things
"""Farther away 2 cm may slip between two beams."""


def beam(degrees):
    """The beam of the full circle that looks at so many degrees, 0 = ahead."""
    return (degrees + 179) % 360


def remembered(distance):
    """A return is remembered nearer by what may reach beside it to the next beam, less the clearance of 2 cm."""
    return distance - max(0.0, math.radians(1.0) * distance - 0.02)


class Robot:
    """A robot that looks ahead only."""

    def __init__(self, beams=181, fov=math.pi, **guarding):
        self.rows = one_robot(rig_of(sensor=all_round(make_sensor(beams=beams, fov=fov)), **guarding))
        self.view = self.rows.view

    def look(self, returns=None, moved=(0.0, 0.0, 0.0), neighbours=()):
        """See ``returns`` {degrees: m} after having ``moved``; return what it sees and remembers, as {degrees: m}."""
        rows, view = self.rows, self.view
        rows.fill(odom_x=moved[0], odom_y=moved[1], odom_yaw=moved[2])
        rows.scan[:] = INF
        for degrees, distance in (returns or {}).items():
            view.scan[beam(degrees)] = distance
        rows.see([seen(4 + k, x, y) for k, (x, y) in enumerate(neighbours)])
        dx, dy = update_odometry(rows.percept, rows.shared)
        update_tracks(rows.percept, rows.shared, rows.rig, dx, dy)
        look_back(view)
        mend(view.scan, rows.rig, view.safe)
        keep_frame(view)
        found = np.flatnonzero(np.isfinite(view.scan))
        return {math.remainder(n - 179, 360): pytest.approx(float(view.scan[n]), abs=1e-5) for n in found.tolist()}

    def free(self, x, y):
        return bool(was_free(self.view, x, y))

    @property
    def kept(self):
        return int(self.rows.shared["frames_n"])

    @property
    def newest(self):
        return int(self.rows.shared["frame_at"])


def test_nothing_is_known_at_first_but_what_is_in_view():
    robot = Robot()
    assert robot.look({0: 2.0, 90: 1.0}) == {0: 2.0, 90: 1.0}
    assert (robot.rows.shared["view_first"], robot.rows.shared["view_last"]) == (89, 269)


def test_what_was_left_by_another_tick_outside_the_view_is_gone():
    robot = Robot()
    robot.view.scan[beam(180)] = 1.0
    assert robot.look() == {}


def test_beams_at_the_edge_that_know_nothing_are_not_in_view():
    """A sensor beside the centre leaves some: here 3 at the right edge, 1 at the left one."""
    robot = Robot()
    robot.look({-90: NAN, -89: NAN, -88: NAN, 0: NAN, 90: NAN})
    assert (robot.rows.shared["view_first"], robot.rows.shared["view_last"]) == (92, 268)


@pytest.mark.parametrize(("degrees", "inside"), [(0, True), (89.9, True), (90.1, False), (179, False)])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_in_view(degrees, inside, side):
    robot = Robot()
    robot.look()
    a = side * math.radians(degrees)
    assert in_view(2.0 * math.cos(a), 2.0 * math.sin(a), robot.view) == inside


def test_what_the_robot_drives_past_stays_where_it_was():
    """80 degrees to the left 1 m away; half a metre on it is at (-0.326, 0.985), 108.3 degrees, 1.037 m."""
    robot = Robot()
    robot.look({80: 1.0})
    x, y = math.cos(math.radians(80.0)) - 0.5, math.sin(math.radians(80.0))
    assert robot.look({}, (0.5, 0.0, 0.0)) == {108: math.hypot(x, y)}


def test_what_the_robot_turns_away_from_stays_where_it_was():
    robot = Robot()
    robot.look({-60: 2.0, 30: 4.0})
    turned = robot.look({}, (0.0, 0.0, math.radians(100.0)))
    assert turned == {-160: remembered(2.0)}  # 30 - 100 is in view: nothing is there now


def test_it_is_carried_on_from_tick_to_tick():
    """At (1, 1) first; after 2 m in four ticks, and a quarter turn to the right in five, at (-1, -1): 225 degrees."""
    robot = Robot()
    robot.look({45: math.sqrt(2.0)})
    for _ in range(4):
        found = robot.look({}, (0.5, 0.0, 0.0))
    assert found == {135: remembered(math.sqrt(2.0))}
    for _ in range(5):
        found = robot.look({}, (0.0, 0.0, math.radians(-18.0)))
    assert found == {-135: remembered(math.sqrt(2.0))}


def test_returns_in_view_are_not_drawn_over():
    robot = Robot()
    robot.look({0: 2.0})
    assert robot.look({0: 3.0}, (0.5, 0.0, 0.0)) == {0: 3.0}


def test_a_neighbour_out_of_view_is_in_the_scan():
    """2 m behind, radius 0.15: 4.3 degrees to either side, the middle of it 1.85 m away."""
    found = Robot().look(neighbours=[(-2.0, 0.0)])
    assert sorted(n % 360 for n in found) == list(range(176, 185))
    edge = 2.0 * math.cos(math.radians(4.0)) - math.sqrt(RADIUS**2 - (2.0 * math.sin(math.radians(4.0))) ** 2)
    assert (found.get(180, found.get(-180)), found[176]) == (1.85, edge)


def test_what_was_a_neighbours_is_not_remembered_as_a_thing():
    """Its place counts as seen free up to its return."""
    robot = Robot()
    robot.look({60: 1.0, -60: 1.0}, neighbours=[(1.15 * math.cos(SIXTY), 1.15 * math.sin(SIXTY))])
    assert robot.view.frames.scans[0, [150, 30]].tolist() == [-1.0, 1.0]
    robot.rows.shared["track_id"] = -1  # it is forgotten
    assert robot.look({}, (2.0, 0.0, 0.0)) == {-150: math.sqrt(3.0)}
    a = SIXTY
    assert robot.free(0.9 * math.cos(a) - 2.0, 0.9 * math.sin(a))
    assert not robot.free(1.1 * math.cos(a) - 2.0, 1.1 * math.sin(a))


def test_places_are_seen_free_in_view_up_to_the_return():
    """It saw 1 m at 30 degrees and nothing at 31 degrees, and is 3 m farther now; 2 cm do not show farther off."""
    robot = Robot()
    robot.look({30: 1.0})
    robot.look({}, (3.0, 0.0, 0.0))
    for degrees, free_to in ((30, 1.0), (31, NARROW)):
        a = math.radians(degrees)
        for distance in (0.5, 0.99, 1.01, NARROW - 0.01, NARROW + 0.01, 3.0):
            assert robot.free(distance * math.cos(a) - 3.0, distance * math.sin(a)) == (distance < free_to)


def test_places_that_were_never_in_view_are_not_seen_free():
    robot = Robot()
    robot.look()
    assert not robot.free(-0.2, 0.0)
    robot.look({}, (1.0, 0.0, 0.0))
    assert robot.free(-0.2, 0.0)
    assert not robot.free(-1.2, 0.0)


def test_where_the_body_stands_or_stood_is_free():
    robot = Robot()
    robot.look()
    assert robot.free(-0.14, 0.0) and not robot.free(-0.16, 0.0)
    robot.look({}, (0.0, 1.0, 0.0))
    assert robot.free(-0.14, -1.0) and not robot.free(-0.16, -1.0)


def test_nobody_knows_what_a_wide_hole_hides():
    """Broken readings: 3 degrees are bridged by the nearer of what is beside, 60 degrees block."""
    robot = Robot()
    robot.look({59: 1.0, 60: NAN, 61: NAN, 62: 3.0} | {-d: NAN for d in range(30, 90)})
    scan = robot.view.frames.scans[0]
    assert scan[[149, 150, 151, 152]] == pytest.approx([1.0, -1.0, -1.0, 3.0])
    assert np.isnan(scan[1:61]).all() and (scan[[0, 61]] == 5.0).all()
    robot.look({}, (2.0, 0.0, 0.0))
    a = SIXTY
    assert robot.free(0.95 * math.cos(a) - 2.0, 0.95 * math.sin(a))
    assert not robot.free(1.05 * math.cos(a) - 2.0, 1.05 * math.sin(a))
    assert not robot.free(0.5 * math.cos(a) - 2.0, -0.5 * math.sin(a))


@pytest.mark.parametrize(
    ("moved", "kept"),
    [
        ((0.05, 0.0, 0.0), 1),
        ((0.07, 0.0, 0.0), 2),
        ((0.0, -0.07, 0.0), 2),
        ((0.0, 0.0, math.radians(72.0)), 1),
        ((0.0, 0.0, math.radians(-73.0)), 2),
    ],
)
def test_another_scan_is_kept_after_a_way_or_a_turn(moved, kept):
    """After 0.4 radii, 6 cm, or 0.4 of the field, 72.4 degrees."""
    robot = Robot()
    robot.look()
    robot.look({}, moved)
    assert (robot.kept, robot.newest) == (kept, kept - 1)


def test_short_ways_add_up():
    robot = Robot()
    for _ in range(7):
        robot.look({}, (0.025, 0.0, 0.0))
    assert robot.kept == 3  # after 0, 7.5 and 15 cm


def test_back_at_a_place_its_scan_is_renewed():
    """The robot goes 10 cm to and fro: within 0.2 radii, 3 cm, of where the first scan was taken."""
    robot = Robot()
    robot.look({80: 1.0})
    robot.look({}, (0.1, 0.0, 0.0))
    assert (robot.kept, robot.newest) == (2, 1)
    robot.look({}, (-0.09, 0.0, 0.0))
    assert (robot.kept, robot.newest) == (2, 0)
    assert not robot.view.frames.poses[0].any()
    assert (robot.view.frames.scans[0] == 5.0).all()


def test_when_there_is_no_room_the_oldest_gives_way():
    robot = Robot()
    room = len(robot.view.frames.poses)
    for k in range(room + 2):
        robot.look({}, (0.1, 0.0, 0.0))
        assert (robot.kept, robot.newest) == (min(k + 1, room), k % room)
    assert robot.view.frames.poses[:, 0] == pytest.approx([-0.1, 0.0, -0.5, -0.4, -0.3, -0.2])


@pytest.mark.parametrize(("beams", "fov", "room"), [(181, 180.0, 6), (271, 270.0, 6), (91, 90.0, 11), (61, 60.0, 16)])
def test_narrow_views_keep_more_scans(beams, fov, room):
    """2.7 times as many as fill the circle, 6 at least."""
    frames = Robot(beams, math.radians(fov)).view.frames
    assert (len(frames.poses), *frames.scans.shape) == (room, room, beams)


def test_a_full_circle_keeps_none():
    assert one_robot().view.frames.scans.size == 0


def test_beyond_the_range_nothing_was_seen_free():
    """The range is 5 m: a scan without returns shows what is in view up to there, and not what lies behind it.

    Narrow things show between two beams up to 1.1 m, unless nothing is narrow.
    """
    for thinnest_m, reach in ((0.0, 5.0), (0.02, NARROW)):
        robot = Robot(thinnest_m=thinnest_m)
        robot.look({}, (0.0, 0.0, 0.0))
        robot.look({}, (0.0, 0.0, math.pi))
        robot.look({}, (0.0, 0.0, 0.0))
        assert robot.free(-reach + 0.1, 0.0)
        assert not robot.free(-reach - 0.1, 0.0)


def test_a_kept_scan_shows_no_more_of_a_hole_than_the_guard_knows_of_it():
    robot = Robot()
    robot.look({60: NAN})
    robot.view.hidden[:] = INF
    robot.view.hidden[beam(60)] = 0.5
    shorten_frame(robot.view, 0)
    assert robot.view.frames.scans[0][[149, 150, 151]] == pytest.approx([5.0, -0.5, 5.0])
    robot.look({}, (1.0, 0.0, 0.0))
    assert robot.free(0.49 * math.cos(SIXTY) - 1.0, 0.49 * math.sin(SIXTY))
    assert not robot.free(0.52 * math.cos(SIXTY) - 1.0, 0.52 * math.sin(SIXTY))
