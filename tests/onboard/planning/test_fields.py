"""Interaction fields, probabilities and fusion: laws, and the mirror that turns P into 1 - P."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from helpers import one_robot
from swarmscope.onboard.deciding.choosing import choose_side, own_probability
from swarmscope.onboard.deciding.fields import (
    following_probability,
    fuse,
    in_pass_band,
    interaction_force,
    left_probability,
    neighbour_weight,
    sigmoid,
    yields_to,
)
from swarmscope.onboard.view import Table

TWO_PI = 2.0 * math.pi
SIGMA = 0.9
HALF_ALPHA = math.radians(30.0)
probability = st.floats(0.0, 1.0)


@given(st.floats(-30.0, 30.0))
def test_sigmoid(x):
    assert sigmoid(x) + sigmoid(-x) == pytest.approx(1.0)
    assert sigmoid(x) == pytest.approx(0.5 * (1.0 + math.tanh(0.5 * x)))


@given(st.floats(0.05, 5.0), st.floats(0.01, 3.0))
def test_the_force_changes_sign_at_sigma_a(sigma, w_i):
    assert interaction_force(sigma, sigma, w_i) == pytest.approx(0.0, abs=1e-9)
    for factor in (0.2, 0.7, 0.99):
        assert interaction_force(factor * sigma, sigma, w_i) < 0.0
    for factor in (1.01, 1.5, 3.0):
        assert interaction_force(factor * sigma, sigma, w_i) > 0.0


@given(st.floats(0.1, 3.0), st.floats(0.1, 2.0))
def test_the_force_scales_with_weight_and_length(ratio, w_i):
    one = interaction_force(ratio * SIGMA, SIGMA, 1.0)
    assert interaction_force(ratio * SIGMA, SIGMA, w_i) == pytest.approx(w_i * one)
    assert interaction_force(ratio * 2.0 * SIGMA, 2.0 * SIGMA, 1.0) == pytest.approx(0.5 * one)


def test_repulsion_grows_as_robots_come_closer():
    forces = [interaction_force(d, SIGMA, 1.0) for d in np.linspace(0.2, SIGMA, 50)]
    assert (np.diff(forces) > 0.0).all()


@pytest.mark.parametrize(
    ("ratio", "inside"),
    [(0.5, False), (1.0, False), (1.0001, True), (2.0, True), (3.0, True), (3.001, False)],
)
def test_the_pass_band(ratio, inside):
    assert in_pass_band(ratio, 1.0) is inside


@given(
    st.floats(0.0, 2.0), st.floats(0.0, 2.0), st.floats(0.0, 2.0), st.floats(0.0, 2.0), st.floats(-2.0, 2.0)
)
def test_own_probability_prefers_the_more_open_side(a_1, a_2, a_3, a_4, bias):
    p = left_probability(a_1, a_2, a_3, a_4, bias)
    assert p + left_probability(a_2, a_1, a_4, a_3, -bias) == pytest.approx(1.0)
    assert left_probability(a_1 + 0.5, a_2, a_3, a_4, bias) > p
    assert left_probability(a_1, a_2, a_3, a_4 + 0.5, bias) < p
    assert left_probability(a_1, a_1, a_3, a_3, 0.0) == 0.5


@given(st.floats(1.0, 2.0), st.floats(1.0, 2.0), st.floats(1.0, 2.0))
def test_a_neighbour_with_a_free_way_speaks_for_its_side(x_1, x_2, threshold):
    left = following_probability(x_1, x_2, threshold, True)
    assert left + following_probability(x_1, x_2, threshold, False) == pytest.approx(1.0)
    assert (left > 0.5) == (x_1 + x_2 > 2.0 * threshold) or left == 0.5


@given(probability, st.lists(st.tuples(probability, st.floats(0.0, 0.5)), max_size=6))
def test_fusion_is_a_weighted_mean(p_self, neighbours):
    weighted, weights = sum(p * f for p, f in neighbours), sum(f for _, f in neighbours)
    fused = fuse(p_self, weighted, weights)
    everyone = [p_self, *(p for p, _ in neighbours)]
    assert min(everyone) - 1e-12 <= fused <= max(everyone) + 1e-12
    assert fuse(p_self, 0.0, 0.0) == p_self


def test_yielding_weighs_propulsion_against_repulsion_ahead():
    assert yields_to(0.5, -1.0, 1.0)
    assert not yields_to(0.5, -1.0, 0.4)
    assert not yields_to(0.5, -1.0, -1.0)
    assert not yields_to(0.5, 0.3, 1.0)


def test_equal_errors_weigh_the_same_and_a_coin_weighs_nothing():
    assert neighbour_weight(0.2, 0.2) == pytest.approx(1.0)
    assert neighbour_weight(0.2, 0.5) == pytest.approx(0.0)
    assert neighbour_weight(0.2, 0.3) > neighbour_weight(0.2, 0.4)


feature_lists = st.lists(
    st.tuples(st.floats(0.01, TWO_PI - 0.01), st.floats(0.3, 5.0)),
    min_size=2,
    max_size=10,
    unique_by=lambda f: round(f[0], 2),
)


def as_arrays(pairs, mirror=False):
    pairs = sorted(((TWO_PI - a) if mirror else a, d) for a, d in pairs)
    angles, distances = np.zeros(16), np.zeros(16)
    angles[: len(pairs)] = [a for a, _ in pairs]
    distances[: len(pairs)] = [d for _, d in pairs]
    return angles, distances, len(pairs)


def as_table(pairs, mirror=False):
    angles, distances, count = as_arrays(pairs, mirror)
    return Table(angles, distances), count


@given(feature_lists, st.floats(-1.0, 1.0))
def test_the_mirrored_scene_has_the_opposite_own_probability(pairs, bias):
    p = own_probability(*as_table(pairs), HALF_ALPHA, bias, False)
    assert own_probability(*as_table(pairs, True), HALF_ALPHA, -bias, False) == pytest.approx(1.0 - p, abs=1e-9)


def decide(pairs, neighbours, goal_bearing=0.0, compass=0.0, mirror=False, w_i=1.0, bias=0.0, polygon=False, w_n=0.0):
    """Robot 0 with features ``pairs``, neighbours (distance, bearing, features), in the compass frame."""
    rows = one_robot()
    sign = -1.0 if mirror else 1.0
    rows.fill(compass=sign * compass, goal_bearing=sign * goal_bearing)
    for slot, (distance, bearing, heard) in enumerate(neighbours):
        row = rows.shared
        row["track_id"][slot], row["heard_id"][slot] = 10 + slot, 10 + slot
        row["track_x"][slot] = distance * math.cos(sign * bearing)
        row["track_y"][slot] = distance * math.sin(sign * bearing)
        angles, distances, count = as_arrays(heard, mirror)
        row["heard_angle"][slot], row["heard_distance"][slot], row["heard_n"][slot] = angles, distances, count
    see = rows.view
    see.own.angles[:], see.own.distances[:], count = as_arrays(pairs, mirror)
    side = choose_side(see, count, w_i, sign * bias, polygon, w_n)
    return side, rows.said("p_self"), rows.said("p_left"), rows.said("heard")


peers = st.lists(st.tuples(st.floats(0.5, 3.5), st.floats(-3.0, 3.0), feature_lists), max_size=4)


@settings(max_examples=60)
@given(feature_lists, peers, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_the_mirrored_scene_with_neighbours_has_the_opposite_choice(pairs, neighbours, goal_bearing, compass):
    side, p_self, p_left, heard = decide(pairs, neighbours, goal_bearing, compass)
    assume(all(abs(math.sin(b - goal_bearing - compass)) > 1e-6 for _, b, _ in neighbours))
    other = decide(pairs, neighbours, goal_bearing, compass, mirror=True)
    assert other[1:] == pytest.approx((1.0 - p_self, 1.0 - p_left, heard), abs=1e-6)
    assume(abs(p_left - 0.5) > 1e-5)
    assert other[0] == -side
    assert side == (1 if p_left > 0.5 else -1)


@settings(max_examples=60)
@given(feature_lists, peers, st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_turning_the_whole_scene_changes_nothing(pairs, neighbours, goal_bearing, compass, turn):
    rounded = [((a + turn) % TWO_PI, d) for a, d in pairs]
    assume(
        all(
            abs(abs(math.remainder(b - goal_bearing - compass, TWO_PI)) - 0.5 * math.pi) > 1e-6
            for _, b, _ in neighbours
        )
    )
    assume(all(abs(math.sin(b - goal_bearing - compass)) > 1e-6 for _, b, _ in neighbours))
    turned = [(d, b + turn, [((a + turn) % TWO_PI, s) for a, s in heard]) for d, b, heard in neighbours]
    a = decide(pairs, neighbours, goal_bearing, compass)
    b = decide(rounded, turned, goal_bearing, compass + turn)
    assert b[1:] == pytest.approx(a[1:], abs=1e-5)


def test_without_neighbours_or_weight_the_own_probability_decides():
    pairs = [(0.3, 4.0), (2.0, 1.0), (4.0, 2.0)]
    side, p_self, p_left, heard = decide(pairs, [])
    assert (p_self, heard) == (p_left, 0)
    far = [(0.3, 5.0), (6.0, 5.0)]
    assert decide(pairs, [(1.5, 0.4, far)], w_i=0.0)[2] == pytest.approx(p_self)
    assert decide(pairs, [(1.5, 0.4, far)])[2] != p_self
    assert side == (1 if p_self >= 0.5 else -1)


@pytest.mark.parametrize(
    ("distance", "bearing", "counts"),
    [(1.5, 0.4, 1), (0.89, 0.4, 0), (2.71, 0.4, 0), (1.5, 1.6, 0), (1.5, -1.5, 1), (1.5, math.pi, 0)],
)
def test_only_neighbours_ahead_in_the_pass_band_are_heard(distance, bearing, counts):
    pairs = [(0.3, 4.0), (2.0, 1.0), (4.0, 2.0)]
    assert decide(pairs, [(distance, bearing, pairs)])[3] == counts


def test_a_neighbour_on_the_left_with_a_free_way_pulls_left():
    pairs = [(0.5, 2.0), (2.0, 1.0), (TWO_PI - 0.5, 2.0), (TWO_PI - 2.0, 1.0)]
    free, shut = [(0.2, 5.0), (6.1, 5.0)], [(0.2, 0.5), (6.1, 0.5)]
    assert decide(pairs, [])[2] == pytest.approx(0.5)
    assert decide(pairs, [(1.5, 0.5, free)])[2] > 0.5
    assert decide(pairs, [(1.5, 0.5, shut)])[2] < 0.5
    assert decide(pairs, [(1.5, -0.5, free)])[2] < 0.5
    assert decide(pairs, [(1.5, -0.5, shut)])[2] > 0.5


def test_the_threshold_can_be_another_than_20():
    """The neighbour on the left sees 3 m all round: more than 1.95 m, less than 3.8 m."""
    sees = [(angle, 3.0) for angle in (0.1, 1.6, 3.1, 4.7)]
    assert decide(sees, [(1.5, 0.5, sees)])[2] > 0.5
    assert decide(sees, [(1.5, 0.5, sees)], w_n=1.95)[2] == pytest.approx(decide(sees, [(1.5, 0.5, sees)])[2])
    assert decide(sees, [(1.5, 0.5, sees)], w_n=3.8)[2] < 0.5


def test_the_polygon_reading_takes_triangles_and_chords():
    """One neighbour; its quadrants I and II hold no feature, so their borders count: on the chord of 1.2 rad."""
    pairs = [(0.5, 2.0), (2.0, 1.0), (4.0, 2.5)]
    heard = [(0.6, 3.0), (TWO_PI - 0.6, 3.0)]
    _, p_self, p_left, _ = decide(pairs, [(1.5, 0.4, heard)], polygon=True)
    angles, distances, count = as_arrays(pairs)
    distances[:count] = distances[:count] / 5.0 + 1.0
    assert p_self == pytest.approx(own_probability(Table(angles, distances), count, HALF_ALPHA, 0.0, True))
    assert p_self != pytest.approx(own_probability(Table(angles, distances), count, HALF_ALPHA, 0.0, False), abs=1e-4)
    border = 1.6 * math.cos(0.6) / math.cos(HALF_ALPHA)  # the farther of the two borders of each quadrant
    force = interaction_force(1.5, SIGMA, 1.0)
    follow = sigmoid(2.0 * border - 2.0 * (1.95 / 5.0 + 1.0))
    assert p_left == pytest.approx((p_self + force * follow) / (1.0 + force), abs=1e-6)
    _, p_self, p_left, _ = decide(pairs, [(1.5, 0.4, heard)])
    follow = sigmoid(2.0 * 1.6 - 2.0 * (1.95 / 5.0 + 1.0))  # linear in the angle: 1.6 all along
    assert p_left == pytest.approx((p_self + force * follow) / (1.0 + force), abs=1e-6)
