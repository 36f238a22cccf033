"""Shortest ways among discs: hand-worked lengths, the published bounds, and a grid search as a second opinion."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from swarmscope.disk import bounds, geodesic, maps, rules, runs


def way(discs, start, goal, margin=0.0):
    ways = geodesic.build([np.array(discs, dtype=float).reshape(-1, 3)], margin)
    ways = geodesic.add_goals(ways, np.zeros(1, dtype=np.int64), np.array([goal], dtype=float))
    out = np.empty((1, 3))
    geodesic.look_up_many(ways, np.zeros(1, dtype=np.int64), np.array([start], dtype=float), out)
    return out[0]


def test_straight_where_nothing_is_in_the_way():
    assert way([], (0.5, 0.0), (-0.5, 0.0)) == pytest.approx([1.0, -1.0, 0.0])
    assert way([(0.0, 0.5, 0.3)], (0.5, 0.0), (-0.5, 0.0)) == pytest.approx([1.0, -1.0, 0.0])


def test_round_one_disc_by_tangent_arc_tangent():
    # Two tangents of length sqrt(0.8^2 - 0.4^2) and the arc between their ends: pi - 2 acos(0.4 / 0.8).
    length, dx, dy = way([(0.0, 0.0, 0.3)], (0.8, 0.0), (-0.8, 0.0), margin=0.1)
    assert length == pytest.approx(2 * math.sqrt(0.48) + 0.4 * math.pi / 3)
    assert abs(dy) == pytest.approx(0.5)  # 30 degrees off the straight line
    assert dx == pytest.approx(-math.sqrt(0.75))


def test_round_two_discs_by_their_common_tangent():
    # Both discs on the line, the way runs along their tops.
    length, _, _ = way([(-0.3, -0.01, 0.2), (0.3, -0.01, 0.2)], (0.7, 0.19), (-0.7, 0.19))
    assert length == pytest.approx(1.4)


def test_overlapping_discs_are_one_obstacle():
    closed = [(0.0, 0.15, 0.1), (0.0, -0.15, 0.1)]
    through = way(closed, (0.5, 0.0), (-0.5, 0.0), margin=0.04)[0]
    round_it = way(closed, (0.5, 0.0), (-0.5, 0.0), margin=0.051)[0]
    assert through == pytest.approx(1.0)
    assert round_it > 1.1


def test_no_way_through_a_wall_from_rim_to_rim():
    wall = [(x, 0.0, 0.06) for x in np.arange(-1.0, 1.01, 0.1)]
    assert way(wall, (0.0, 0.5), (0.0, -0.5)).tolist() == [math.inf, 0.0, 0.0]


def test_ways_do_not_leave_the_workspace():
    # Outside of the disc at the rim the way would be shorter.
    beyond = way([(0.75, 0.0, 0.24)], (0.9, 0.35), (0.9, -0.35), margin=0.02)
    assert beyond[1] < 0.0
    assert beyond[0] > 0.8


def test_who_stands_in_the_margin_can_leave():
    length, dx, dy = way([(0.0, 0.0, 0.3)], (0.299, 0.0), (-0.8, 0.0))
    assert math.isfinite(length)
    assert abs(dx) < 0.1 and abs(abs(dy) - 1.0) < 0.01


def test_who_stands_in_two_margins_does_not_go_through_a_closed_gap():
    # A gap that is open for the robot alone, but not with the margin: from its mouth the way leads back and round.
    gap = [(0.5, 0.22, 0.2), (0.5, -0.22, 0.2)]
    assert way(gap, (0.62, 0.0), (-0.999, 0.0), margin=0.054)[0] > 1.9
    assert way(gap, (0.62, 0.0), (-0.999, 0.0), margin=0.0)[0] == pytest.approx(1.619)


def test_who_is_to_go_into_a_disc_arrives_as_who_starts_in_it_leaves():
    # Seen from the start the goal lies deep behind the disc: round it, to the place on the rim beside the goal.
    inside, outside, disc = (-0.2, 0.0), (0.8, 0.0), [(0.0, 0.0, 0.4)]
    round_it = math.sqrt(0.8**2 - 0.4**2) + 0.4 * (math.pi - math.acos(0.4 / 0.8))
    assert way(disc, outside, inside)[0] == pytest.approx(round_it)
    assert way(disc, inside, outside)[0] == pytest.approx(round_it)
    # Seen from the other side it is in sight.
    assert way(disc, (-0.8, 0.0), inside) == pytest.approx([0.6, 1.0, 0.0])
    assert way(disc, inside, (-0.8, 0.0)) == pytest.approx([0.6, -1.0, 0.0])


def test_a_goal_in_the_only_disc_has_a_way_there_as_it_has_one_back():
    discs, start, goal = [(0.5, -0.5, 0.25)], (0.95, 0.0), (0.95 * math.cos(5.5), 0.95 * math.sin(5.5))
    assert depth(discs, goal) > 0.0
    assert way(discs, start, goal)[0] == pytest.approx(way(discs, goal, start)[0])
    assert math.dist(start, goal) - 1e-9 <= way(discs, start, goal)[0] < 0.8


def test_two_ends_in_overlapping_discs_have_the_same_way_in_both_directions():
    discs = [(-0.1, 0.0, 0.3), (0.1, 0.0, 0.3), (0.0, 0.6, 0.1)]
    for one, two in (((0.0, 0.1), (0.0, -0.2)), ((0.0, 0.1), (0.6, 0.0)), ((0.3, 0.05), (-0.3, -0.05))):
        there, back = way(discs, one, two)[0], way(discs, two, one)[0]
        assert math.isfinite(there)
        assert there == pytest.approx(back)


def test_bounds_are_the_published_ones():
    of = runs.problem(rules.Rules(), list(maps.REPORT_MAPS.values()), list(rules.all_permutations(5)))
    found = bounds.bound(of).reshape(5, 120)
    # field notes 3.2: mean, min and max of the steps that a robot alone needs
    assert found.mean(axis=1) == pytest.approx([7870.5, 8062.5, 8154.1, 7820.7, 8119.6], abs=0.05)
    assert found.min(axis=1).tolist() == [6449, 6449, 6449, 6449, 6565]
    assert found.max(axis=1).tolist() == [8067, 8432, 9102, 8017, 8562]


disc = st.tuples(st.floats(-0.5, 0.5), st.floats(-0.5, 0.5), st.floats(0.05, 0.3))
turn = st.floats(0, 6.28)
reach = st.floats(0, 1)


def depth(discs, point):
    """How deep a point lies in a disc at most."""
    return max((rho - math.dist(point, (x, y)) for x, y, rho in discs), default=0.0)


def assume_that_no_hair_decides(discs, start, goal):
    """Leave aside discs that touch, or have a common tangent with a third: either answer is right there."""
    tighter, wider = (way(discs, start, goal, hair)[0] for hair in (-1e-6, 1e-6))
    assume(tighter == pytest.approx(wider, abs=1e-4))


@settings(max_examples=60)
@given(st.lists(disc, max_size=5), turn, turn)
def test_following_the_direction_takes_the_length_that_was_promised(discs, a, b):
    start, goal = [(0.95 * math.cos(t), 0.95 * math.sin(t)) for t in (a, b)]
    assume(max(depth(discs, start), depth(discs, goal)) <= 0.0)
    ways = geodesic.build([np.array(discs, dtype=float).reshape(-1, 3)], 0.0)
    ways = geodesic.add_goals(ways, np.zeros(1, dtype=np.int64), np.array([goal]))
    field, out = np.zeros(1, dtype=np.int64), np.empty((1, 3))
    point, step, gone = np.array([start]), 0.002, 0.0
    geodesic.look_up_many(ways, field, point, out)
    promised = out[0, 0]
    if not math.isfinite(promised):
        return
    while out[0, 0] > step and gone < promised + 0.05:
        point += step * out[:, 1:]
        gone += step
        assert all(math.hypot(point[0, 0] - x, point[0, 1] - y) > rho - 1e-6 for x, y, rho in discs)
        geodesic.look_up_many(ways, field, point, out)
    assert gone + out[0, 0] == pytest.approx(promised, abs=0.01)


@settings(max_examples=60)
@given(st.lists(disc, max_size=5), turn, reach, turn, reach)
@example([(0.5, -0.5, 0.25)], 0.0, 0.95, 5.5, 0.95)  # a goal in the disc had no way there, but one back
@example([(0.0, 0.125, 0.25), (0.0, -0.125, 0.25), (0.25, 0.0, 0.25)], 0.0, 0.0, 0.0, 1.0)  # in a line with centres
def test_lengths_obey_the_triangle_inequality_and_symmetry(discs, a, from_centre, b, to_centre):
    start, goal = ((far * math.cos(t), far * math.sin(t)) for t, far in ((a, from_centre), (b, to_centre)))
    assume_that_no_hair_decides(discs, start, goal)
    there, back = way(discs, start, goal)[0], way(discs, goal, start)[0]
    assert there == pytest.approx(back, rel=1e-6)
    not_counted = max(0.0, depth(discs, start)) + max(0.0, depth(discs, goal))
    assert there >= math.dist(start, goal) - not_counted - 1e-9
