"""Robots that may be hidden past a corner: where at the nearest, how far round it, and what that allows."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from helpers import make_sensor, one_robot, rig_of, scan_at, world_of
from swarmscope.onboard.body import Body
from swarmscope.onboard.control.corners import Corner, apart_round, come_along, hidden_at, way_round
from swarmscope.onboard.control.guard import guard
from swarmscope.onboard.sensor import all_round
from swarmscope.sim.world import Wall
from swarmscope.storm.draw import Case
from swarmscope.storm.play import watched

FAR = 10.0


def edge_of(ranges, opens_left):
    """The beam of the nearest return past which it opens to a side."""
    step = 1 if opens_left else -1
    edges = [n for n in range(360) if np.isfinite(ranges[n]) and np.isinf(ranges[(n + step) % 360])]
    return min(edges, key=lambda n: ranges[n])


def test_the_way_round_is_tangent_arc_and_tangent():
    """Corner 1 m ahead, opening to the left; both keep 0.2 m off; to a place 0.2 m beyond and 0.3 m to the right."""
    corner = Corner(1.0, 0.0, 1.0, 1.0, 0.0, 0.2)
    arc = math.atan2(0.3, 0.2) + math.pi - math.acos(0.2) - math.acos(0.2 / math.hypot(0.2, 0.3))
    way = way_round(1.2, 0.3, corner)
    assert way.length == pytest.approx(math.sqrt(0.96) + 0.3 + 0.2 * arc)
    assert way.length == pytest.approx(1.6342, abs=1e-4)


def test_how_far_a_robot_has_come_round_a_corner():
    """The way touches the arc 0.2 m off the corner at (0.96, 0.196); off the way only what lies along it counts."""
    corner = Corner(1.0, 0.0, 1.0, 1.0, 0.0, 0.2)
    way, first = way_round(1.2, 0.3, corner), math.sqrt(0.96)
    ahead = np.array([first, 0.2])  # the direction of the first part
    assert come_along(0.0, 0.0, way, corner) == pytest.approx(0.0)
    assert come_along(*(0.5 * ahead), way, corner) == pytest.approx(0.5)
    assert come_along(*(0.5 * ahead + np.array([-0.06, 0.3])), way, corner) == pytest.approx(0.5, abs=0.01)
    for off in (0.2, 0.7):
        beside = 1.0 + off * math.cos(0.9), off * math.sin(0.9)
        assert come_along(*beside, way, corner) == pytest.approx(first + 0.2 * (math.pi - 0.9 - math.acos(0.2)))
    assert come_along(1.2, -0.3, way, corner) == pytest.approx(way.length)


def test_where_the_corner_is_not_between_the_way_is_straight():
    corner = Corner(1.0, 0.0, 1.0, 1.0, 0.6, 0.2)
    way = way_round(2.0, 0.1, corner)
    assert way.length == pytest.approx(math.hypot(2.0, 0.1))
    assert come_along(0.0, 0.0, way, corner) == pytest.approx(0.0)
    assert come_along(1.0, 0.4, way, corner) == pytest.approx((2.0 - 0.04) / math.hypot(2.0, 0.1))
    assert come_along(2.0, -0.1, way, corner) == pytest.approx(way.length)


@pytest.mark.parametrize("side", [1, -1])
def test_a_way_round_is_the_same_in_the_mirror(side):
    corner = Corner(0.8, side * 0.6, float(side), 0.7, 0.01, 0.17)
    mirror = Corner(0.8, -side * 0.6, -float(side), 0.7, 0.01, 0.17)
    ways = way_round(0.9, 0.15, corner), way_round(0.9, 0.15, mirror)
    assert ways[0] == pytest.approx(ways[1])
    assert come_along(0.1, 0.2, ways[0], corner) == pytest.approx(come_along(0.1, -0.2, ways[1], mirror))


lengths = st.floats(0.02, 3.0)


@given(st.floats(0.1, 2.0), st.floats(0.05, 0.5), lengths, lengths, st.data())
def test_nobody_comes_along_faster_than_he_drives(x, keeps, along, beside, data):
    """That is what rule 4 of docs/safety.md needs of lengths round a corner; of places that keep off it."""
    corner = Corner(1.0, 0.0, 1.0, x, 0.0, keeps)
    way = way_round(x + along, beside, corner)
    angle, off = st.floats(-math.pi, 1.5), st.floats(0.0, 2.0)

    def place():
        a, r = data.draw(angle), keeps + data.draw(off)
        return x + r * math.cos(a), -r * math.sin(a)

    a, b = place(), place()
    gap = math.dist(a, b)
    nearest = min(math.hypot(x - a[0] - t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])) for t in np.linspace(0, 1, 50))
    assume(nearest >= keeps)
    assert abs(come_along(*a, way, corner) - come_along(*b, way, corner)) <= gap + 1e-6


def test_bodies_that_touch_round_a_corner_are_a_chord_of_the_circle_that_both_keep_off():
    assert apart_round(rig_of()) == pytest.approx(0.34 * math.asin(0.15 / 0.17))
    assert apart_round(rig_of(clearance_m=0.0)) == pytest.approx(0.15 * math.pi)


def hidden(ranges, n, side, rig=None, broken=()):
    """How far along the line of sight past beam n a body is hidden."""
    rows = one_robot(rig or rig_of())
    rows.view.scan[:] = ranges
    rows.view.hidden[list(broken)] = 0.5
    return hidden_at(rows.view, n, side, rows.rig.body.radius_m, FAR)


def test_behind_a_wall_across_a_body_is_hidden_as_soon_as_it_is_behind_the_wall():
    """A wall 1 m ahead that ends to the right of us: what touches the line of sight past its end stands behind it."""
    ranges = scan_at(world_of(Wall(points=[(1.0, 0.0), (1.0, 3.0)])), rig_of())
    n = edge_of(ranges, False)
    assert hidden(ranges, n, -1) == pytest.approx(0.99 + 0.15, abs=0.02)


def test_beams_that_say_nothing_do_not_show_a_body_behind_a_wall():
    """The same wall, with holes: broken ones show nothing; where a beam in view meets nothing a body would show."""
    ranges = scan_at(world_of(Wall(points=[(1.0, 0.0), (1.0, 3.0)])), rig_of())
    n = edge_of(ranges, False)
    whole = hidden(ranges, n, -1)
    for holes in ([n + 3], [n + 2, n + 5, n + 9]):
        with_holes = ranges.copy()
        with_holes[holes] = np.inf
        assert hidden(with_holes, n, -1, broken=holes) == whole
        assert hidden(with_holes, n, -1) > 2.0


def test_out_of_view_an_open_beam_shows_nothing():
    sensor = all_round(make_sensor(beams=181, fov=math.pi))
    rows = one_robot(rig_of(sensor=sensor))
    rows.shared["view_first"], rows.shared["view_last"] = 89, 269
    ranges = np.full(360, np.inf, np.float32)
    ranges[265:290] = 0.5  # at the left edge of the view, the end of a wall, and what old scans show of it
    rows.view.scan[:] = ranges
    whole = hidden_at(rows.view, 265, -1, rows.rig.body.radius_m, FAR)
    rows.view.scan[[271, 275]] = np.inf
    assert hidden_at(rows.view, 265, -1, rows.rig.body.radius_m, FAR) == whole < 1.5
    rows.view.scan[267] = np.inf
    assert hidden_at(rows.view, 265, -1, rows.rig.body.radius_m, FAR) > 2.0


def test_behind_a_wall_along_a_body_is_hidden_beside_its_near_end():
    """A wall that leads away from its near end, 1 m ahead: hidden as soon as no beam past the end meets the body."""
    ranges = scan_at(world_of(Wall(points=[(1.0, 0.3), (3.0, 0.9)])), rig_of())
    n = edge_of(ranges, False)
    assert ranges[n] == pytest.approx(math.hypot(1.0, 0.3), abs=0.05)
    assert hidden(ranges, n, -1) > 3.0  # the wall is seen along: behind its near end there is no room


def test_behind_a_post_that_is_narrower_a_body_shows():
    rig = rig_of()
    ranges = np.full(360, np.inf, np.float32)
    ranges[178:183] = 1.0  # 5 degrees wide
    assert hidden(ranges, 182, 1, rig) > 0.15 / math.tan(math.radians(6.0) / 2) - 0.2


def allowed(speed, rig):
    """What the guard leaves of 0.5 m/s beside a wall on the left, 0.2 m away, that ends 0.1 m ahead."""
    rows = one_robot(rig)
    rows.scan[:] = scan_at(world_of(Wall(points=[(-2.0, 0.2), (0.1, 0.2)])), rig)
    rows.fill(speed=speed)
    rows.decision["v"] = 0.5
    guard(rows.view)
    return rows.said("v")


def test_a_robot_that_needs_long_to_stop_slows_down_beside_a_corner():
    """Half of the way round is 0.16 m; at 0.4 m/s with 2 m/s^2 it takes 0.08 + 0.08 m, with 0.5 m/s^2 twice as much."""
    assert allowed(0.5, rig_of(others_mps=0.0)) == 0.5
    assert allowed(0.5, rig_of()) == pytest.approx(0.4)
    assert allowed(0.5, rig_of(body=Body(a_max_mps2=0.5), others_mps=0.0)) == 0.5
    assert allowed(0.5, rig_of(body=Body(a_max_mps2=0.5))) < 0.3


def case_of(planner, v, a, rate, radius):
    """Two robots on either side of the end of a wall, each with its goal where the other one is."""
    y = radius + 0.07
    return {
        "seed": 1,
        "record_scans": "no",
        "robots": 2,
        "planner": {"name": planner},
        "robot": {"radius_m": radius, "half_width_m": radius, "v_max_mps": v, "a_max_mps2": a},
        "lidar": {"rate_hz": rate},
        "limit_s": 25.0,
        "place": {
            "world": {
                "obstacles": [{"type": "wall", "points": [[-6.0, 0.0], [2.0, 0.0]]}],
                "bounds": [-7.0, -4.0, 6.0, 4.0],
            },
            "starts": [[-1.0, -y, 0.0], [-1.1, y, 0.0]],
            "goals": [[-2.0, y + 0.2], [-2.0, -y - 0.2]],
        },
    }


@pytest.mark.parametrize("planner", ["nav-scope", "dh-bug"])
@pytest.mark.parametrize(("v", "a"), [(0.5, 0.25), (1.0, 0.5), (2.0, 1.0)])
def test_robots_that_come_round_the_same_corner_do_not_meet(planner, v, a):
    for rate, radius in itertools.product((1.0, 2.0, 10.0), (0.1, 0.15, 0.3)):
        played = watched(Case(case_of(planner, v, a, rate, radius)))
        assert played.breach is None, (rate, radius)
        assert played.under_way_s > 0.0
