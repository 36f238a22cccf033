"""Features (7): hand-worked scans, symmetries, alignment and reconstruction."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from helpers import circles_world, make_sensor, rig_of, scan_at
from swarmscope.onboard.perception.features import (
    MASK_ALL,
    MASK_MAXIMA,
    MAXIMA,
    MINIMA,
    UNMASKED,
    align_features,
    extrema,
    reconstruct,
    what_counts,
)
from swarmscope.onboard.perception.filters import filter_padded, prepare_scan
from swarmscope.onboard.sharing.message import MAX_FEATURES

TWO_PI = 2.0 * math.pi
RANGE_MAX = 5.0


def find(values, safe=None, wraps=True, room=MAX_FEATURES, mask=MASK_ALL):
    """Extrema of a filtered scan as [(beam, distance)], beams counted from angle_min."""
    values = np.asarray(values, np.float32)
    increment = TWO_PI / len(values) if wraps else math.radians(1.0)
    sensor = make_sensor(len(values), range_max=RANGE_MAX)
    sensor = sensor._replace(angle_min=-math.pi, increment=increment, wraps=wraps)
    counts = np.ones(len(values), np.uint8) if safe is None else np.asarray(safe, np.uint8)
    what_counts(mask, counts)
    angles, distances = np.full(room, np.nan), np.full(room, np.nan)
    count = extrema(values, counts, sensor, angles, distances)
    assert np.isnan(angles[count:]).all()
    assert (np.diff(angles[:count]) > 0.0).all()
    beams = (angles[:count] + math.pi) / increment
    assert beams == pytest.approx(np.round(beams), abs=1e-6)
    return [(round(b), round(float(d), 5)) for b, d in zip(beams, distances[:count], strict=True)]


def test_peaks_and_dips_of_a_full_circle():
    assert find([1, 2, 3, 2, 1, 2, 4, 2]) == [(0, 1.0), (2, 3.0), (4, 1.0), (6, 4.0)]


def test_ends_of_a_limited_field_of_view_are_no_extrema():
    assert find([1, 2, 3, 2, 1, 2, 4, 2], wraps=False) == [(2, 3.0), (4, 1.0), (6, 4.0)]


def test_a_plateau_counts_once_at_its_middle():
    assert find([1, 2, 3, 3, 3, 2, 1, 1, 1, 1]) == [(3, 3.0), (8, 1.0)]


def test_of_two_middles_the_first_counts():
    assert find([1, 2, 2, 1, 0]) == [(1, 2.0), (4, 0.0)]


def test_a_plateau_across_the_seam_counts_once():
    assert find([3, 3, 2, 1, 2, 3]) == [(0, 3.0), (3, 1.0)]


def test_a_step_without_a_turn_is_no_extremum():
    assert find([1, 2, 2, 2, 3, 4], wraps=False) == []


@pytest.mark.parametrize("wraps", [True, False])
def test_flat_scans_have_no_features(wraps):
    assert find(np.full(36, 5.0), wraps=wraps) == []
    assert find(5.0 + 1e-6 * np.sin(np.arange(36)), wraps=wraps) == []


@pytest.mark.parametrize(
    ("mask", "found"),
    [
        (MASK_MAXIMA, [(0, 1.0), (4, 1.0), (6, 4.0)]),
        (MASK_ALL, [(0, 1.0), (6, 4.0)]),
        (UNMASKED, [(0, 1.0), (2, 3.0), (4, 1.0), (6, 4.0)]),
    ],
)
def test_maxima_in_unsafe_directions_are_left_out_and_minima_only_if_everything_is_masked(mask, found):
    """A maximum at beam 2, a gap too narrow; a minimum at beam 4, the obstacle beside it."""
    safe = [1, 1, 0, 1, 0, 1, 1, 1]
    assert find([1, 2, 3, 2, 1, 2, 4, 2], safe, mask=mask) == found


def test_nothing_counts_where_neither_kind_does():
    values, none = np.array([1, 2, 3, 2, 1, 2], np.float32), np.zeros(6, np.uint8)
    sensor = make_sensor(6, range_max=RANGE_MAX)
    angles, distances = np.zeros(6), np.zeros(6)
    assert extrema(values, none, sensor, angles, distances) == 0
    assert extrema(values, none + np.uint8(MINIMA), sensor, angles, distances) == 2
    assert extrema(values, none + np.uint8(MAXIMA), sensor, angles, distances) == 2


def test_no_more_than_fit_are_written():
    values = np.tile([1.0, 2.0], 60)
    assert len(find(values)) == MAX_FEATURES
    assert len(find(values, room=120)) == 120


levels = hnp.arrays(np.int8, 48, elements=st.integers(0, 6))


@given(levels, st.integers(0, 47))
def test_turning_the_scan_turns_the_features(values, turn):
    before = find(values, room=64)
    after = find(np.roll(values, turn), room=64)
    assert sorted(((b + turn) % 48, d) for b, d in before) == after


@given(levels)
def test_maxima_and_minima_take_turns(values):
    distances = [d for _, d in find(values, room=64)]
    assert len(distances) % 2 == 0
    turns = [b > a for a, b in zip(distances, distances[1:] + distances[:1], strict=True)]
    assert all(a != b for a, b in pairwise(turns))


@settings(max_examples=25)
@given(st.integers(0, 2**31))
def test_a_scan_has_no_more_features_than_a_packet_holds(seed):
    """About 2 pi / alpha maxima and as many minima: the filter leaves at most two extrema per window."""
    rng = np.random.default_rng(seed)
    rig = rig_of()
    scan = scan_at(
        circles_world(np.column_stack([rng.uniform(-4, 4, (40, 2)), rng.uniform(0.05, 0.3, 40)])), rig
    )
    padded, out = np.zeros(360 + 2 * rig.half, np.float32), np.zeros(360, np.float32)
    prepare_scan(scan, 0.0, RANGE_MAX, True, rig.half, padded)
    filter_padded(padded, rig.taps, RANGE_MAX, out)
    assert len(find(out, room=64)) <= MAX_FEATURES


def test_alignment_turns_wraps_and_sorts():
    angles, distances = np.array([-3.0, 0.5, 2.0]), np.array([1.0, 2.0, 3.0])
    out_a, out_d = np.zeros(3), np.zeros(3)
    align_features(angles, distances, 3, 1.5, out_a, out_d)
    assert out_a == pytest.approx([2.0, 3.5, TWO_PI - 1.5])
    assert out_d.tolist() == [2.0, 3.0, 1.0]


@given(
    st.lists(st.floats(-math.pi, math.pi), min_size=1, max_size=16),
    st.floats(-20.0, 20.0),
)
def test_alignment_keeps_every_feature(angles, turn):
    angles = np.array(angles)
    distances = np.arange(len(angles), dtype=float)
    out_a, out_d = np.zeros(16), np.zeros(16)
    align_features(angles, distances, len(angles), turn, out_a, out_d)
    out_a, out_d = out_a[: len(angles)], out_d[: len(angles)]
    assert ((out_a >= 0.0) & (out_a <= TWO_PI)).all()
    assert (np.diff(out_a) >= 0.0).all()
    assert sorted(out_d) == distances.tolist()
    back = angles[out_d.astype(int)] + turn
    assert np.cos(out_a) == pytest.approx(np.cos(back), abs=1e-9)
    assert np.sin(out_a) == pytest.approx(np.sin(back), abs=1e-9)


def test_reconstruction_of_none_and_one():
    assert reconstruct(np.zeros(2), np.zeros(2), 0, 1.0, False) == 0.0
    assert reconstruct(np.array([2.0]), np.array([1.3]), 1, 5.0, False) == 1.3


@pytest.mark.parametrize(
    ("phi", "linear"),
    [
        (0.5, 1.0),
        (1.0, 1.5),
        (1.5, 2.0),
        (0.0, 1.0 + 0.5 * 1.0 / (TWO_PI - 1.0)),
        (2.0, 2.0 - 0.5 / (TWO_PI - 1.0)),
    ],
)
def test_reconstruction_is_linear_in_the_angle_and_crosses_the_seam(phi, linear):
    angles, distances = np.array([0.5, 1.5]), np.array([1.0, 2.0])
    assert reconstruct(angles, distances, 2, phi, False) == pytest.approx(linear)


def test_reconstruction_on_a_chord_lies_on_the_straight_line():
    angles, distances = np.radians([30.0, 90.0]), np.array([2.0, 1.0])
    a = 2.0 * np.array([math.cos(angles[0]), math.sin(angles[0])])
    b = np.array([0.0, 1.0])
    for phi in np.radians([31.0, 45.0, 60.0, 89.0]):
        d = reconstruct(angles, distances, 2, phi, True)
        p = d * np.array([math.cos(phi), math.sin(phi)])
        assert (b - a)[0] * (p - a)[1] - (b - a)[1] * (p - a)[0] == pytest.approx(0.0, abs=1e-9)
        assert d < reconstruct(angles, distances, 2, phi, False)
