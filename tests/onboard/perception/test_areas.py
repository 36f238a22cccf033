"""Areas (22), (24) against numeric integration and the shoelace formula; passable distances (23) by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.onboard.perception.areas import (
    normalise,
    passable_distance,
    quadrant_area,
    sector_area,
    triangle_area,
)
from swarmscope.onboard.perception.features import reconstruct

TWO_PI = 2.0 * math.pi
features = st.lists(st.tuples(st.floats(0.0, 6.28), st.floats(1.0, 2.0)), min_size=0, max_size=12)
spans = st.tuples(st.floats(-2.0, 2.0), st.floats(0.05, 1.5)).map(lambda s: (s[0], s[0] + s[1]))


def arrays(pairs):
    pairs = sorted({round(a, 4): d for a, d in pairs}.items())
    return np.array([a for a, _ in pairs]), np.array([d for _, d in pairs]), len(pairs)


@settings(max_examples=60, deadline=None)
@given(features, spans)
def test_area_under_the_linear_reconstruction_by_numeric_integration(pairs, span):
    angles, distances, count = arrays(pairs)
    lower, upper = span
    steps = 4000
    middle = lower + (np.arange(steps) + 0.5) * (upper - lower) / steps
    d = np.array([reconstruct(angles, distances, count, phi % TWO_PI, False) for phi in middle])
    numeric = 0.5 * float((d * d).sum()) * (upper - lower) / steps
    assert quadrant_area(angles, distances, count, lower, upper, False) == pytest.approx(
        numeric, rel=2e-3, abs=1e-9
    )


@settings(max_examples=60, deadline=None)
@given(features, spans)
def test_area_of_the_triangles_by_the_shoelace_formula(pairs, span):
    angles, distances, count = arrays(pairs)
    lower, upper = span
    inside = [lower + (a - lower) % TWO_PI for a in angles]
    vertices = sorted((a, d) for a, d in zip(inside, distances, strict=True) if lower < a < upper)
    ends = [(phi, reconstruct(angles, distances, count, phi % TWO_PI, False)) for phi in span]
    corners = [ends[0], *vertices, ends[1]]
    x = np.array([0.0] + [d * math.cos(a) for a, d in corners])
    y = np.array([0.0] + [d * math.sin(a) for a, d in corners])
    shoelace = 0.5 * float((x * np.roll(y, -1) - y * np.roll(x, -1)).sum())
    assert quadrant_area(angles, distances, count, lower, upper, True) == pytest.approx(
        shoelace, rel=1e-9, abs=1e-9
    )


@settings(deadline=None)
@given(features, st.floats(-1.5, 0.0), st.floats(0.1, 1.0), st.floats(0.1, 1.0))
def test_areas_add_up(pairs, lower, first, second):
    angles, distances, count = arrays(pairs)
    middle, upper = lower + first, lower + first + second
    parts = quadrant_area(angles, distances, count, lower, middle, False) + quadrant_area(
        angles, distances, count, middle, upper, False
    )
    assert quadrant_area(angles, distances, count, lower, upper, False) == pytest.approx(parts, abs=1e-9)


def test_areas_of_a_circle_and_of_nothing():
    angles, distances = np.array([0.0, 2.0, 4.0]), np.full(3, 2.0)
    assert quadrant_area(angles, distances, 3, 0.0, 0.5, False) == pytest.approx(0.5 * 0.5 * 4.0)
    assert quadrant_area(angles, distances, 3, 0.0, 0.5, True) == pytest.approx(0.5 * 4.0 * math.sin(0.5))
    assert quadrant_area(np.zeros(0), np.zeros(0), 0, 0.0, 0.5, False) == 0.0


def test_single_pieces():
    assert sector_area(1.0, 2.0, 2.0) == pytest.approx(2.0)
    assert sector_area(0.6, 1.0, 2.0) == pytest.approx(0.1 * (1.0 + 2.0 + 4.0))
    assert triangle_area(0.5 * math.pi, 2.0, 3.0) == pytest.approx(3.0)


def test_normalisation_is_affine():
    assert [normalise(d, 5.0) for d in (0.0, 2.5, 5.0)] == [1.0, 1.5, 2.0]


ANGLES = np.radians([20.0, 60.0, 120.0, 200.0, 280.0, 340.0])
DISTANCES = np.array([1.2, 1.9, 1.3, 1.8, 1.1, 1.7])


def passable(lower_deg, upper_deg):
    return passable_distance(ANGLES, DISTANCES, 6, math.radians(lower_deg), math.radians(upper_deg), False)


def test_without_a_minimum_the_largest_distance_passes():
    assert passable(50.0, 70.0) == pytest.approx(1.9)


def test_without_any_feature_the_larger_boundary_value_passes():
    assert passable(30.0, 40.0) == pytest.approx(1.2 + 0.7 * 20.0 / 40.0)


def test_a_minimum_is_averaged_with_the_largest():
    assert passable(0.0, 36.0) == pytest.approx(0.5 * (1.2 + max(1.45, 1.2 + 0.7 * 16.0 / 40.0)))


def test_a_minimum_at_the_seam_is_found():
    """Feature 5 before and feature 0 after the seam: only the latter is a minimum."""
    low = 1.7 - 0.5 * 10.0 / 40.0
    assert passable(-10.0, 25.0) == pytest.approx(0.5 * (low + 1.2))


def test_the_smallest_of_two_minima_counts():
    assert passable(10.0, 130.0) == pytest.approx(0.5 * (1.9 + 1.2))


def test_one_feature_is_neither_minimum_nor_maximum():
    assert passable_distance(np.array([0.1]), np.array([1.4]), 1, 0.0, 0.5, False) == pytest.approx(1.4)


def test_nothing_heard_passes_nothing():
    assert passable_distance(np.zeros(1), np.zeros(1), 0, 0.0, 0.5, False) == 0.0
