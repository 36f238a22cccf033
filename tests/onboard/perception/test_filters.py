"""The filters (4) and (6): against FFT and the printed linear form, and the laws that they keep."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from helpers import make_sensor
from swarmscope.onboard.perception.filters import (
    feature_filter,
    filter_padded,
    prepare_scan,
    scope_filter,
    window_half,
)

RANGE_MAX = 5.0
RANGE_MIN = 0.1
SPECIAL = st.sampled_from([math.inf, math.nan, 0.0, 0.05, -1.0, 5.0, 7.0])
VALUE = st.one_of(st.floats(0.0, 6.0, width=32), SPECIAL)


def scans(beams):
    return hnp.arrays(np.float32, beams, elements=VALUE)


def filtered(ranges, taps, wraps=True, range_min=RANGE_MIN):
    half = len(taps) // 2
    padded = np.full(len(ranges) + 2 * half, np.nan, np.float32)
    out = np.full(len(ranges), np.nan, np.float32)
    prepare_scan(ranges, range_min, RANGE_MAX, wraps, half, padded)
    filter_padded(padded, taps, RANGE_MAX, out)
    return out


def plain(ranges, range_min=RANGE_MIN):
    """The scan as the filters should see it: cut at RANGE_MAX, invalid beams 0."""
    with np.errstate(invalid="ignore"):
        return np.where(ranges >= range_min, np.minimum(ranges, RANGE_MAX), 0.0).astype(float)


def fft_circular(values, taps):
    kernel = np.zeros(len(values))
    half = len(taps) // 2
    kernel[np.arange(-half, half + 1)] = taps
    return np.fft.ifft(np.fft.fft(values) * np.fft.fft(kernel)).real


@pytest.mark.parametrize("half", [1, 2, 5, 30, 36, 90])
@pytest.mark.parametrize("make", [scope_filter, feature_filter])
def test_taps_are_positive_symmetric_and_sum_to_one(make, half):
    taps = make(half)
    assert taps.dtype == np.float32
    assert len(taps) == 2 * half + 1
    assert (taps > -1e-8).all()
    assert (taps[1:-1] > 0.0).all()
    assert taps.astype(float).sum() == pytest.approx(1.0, abs=1e-6)
    assert taps == pytest.approx(taps[::-1], abs=1e-8)


def test_the_feature_filter_is_a_low_pass_with_its_edge_at_one_over_t_c():
    taps = feature_filter(30).astype(float)
    response = np.abs(np.fft.rfft(taps, 7200))
    frequency = np.arange(response.size) / 7200.0
    assert (response[frequency > 2.0 / 60.0] < 10 ** (-30.0 / 20.0)).all()
    assert (np.diff(response[frequency < 1.0 / 60.0]) < 0.0).all()


@pytest.mark.parametrize(
    ("alpha_deg", "beams", "half"), [(60, 360, 30), (60, 720, 60), (72.6, 360, 36), (59.9, 360, 29)]
)
def test_window_half_counts_the_beams_within_half_alpha(alpha_deg, beams, half):
    assert window_half(math.radians(alpha_deg), 2.0 * math.pi / beams) == half


@given(scans(90), st.integers(1, 20))
def test_equals_the_circular_convolution_by_fft(ranges, half):
    for taps in (scope_filter(half), feature_filter(half)):
        expected = fft_circular(plain(ranges), taps.astype(float))
        assert filtered(ranges, taps) == pytest.approx(expected, abs=2e-5)


@settings(max_examples=30)
@given(scans(360))
def test_equals_the_printed_linear_convolution_on_the_wrapped_scan(ranges):
    """(6) as printed, the transform long enough for 360 beams: 1024 points on the wrapped scan."""
    half = 30
    taps = feature_filter(half)
    values = plain(ranges)
    wrapped = np.concatenate([values[-half:], values, values[:half]])
    product = np.fft.rfft(wrapped, 1024) * np.fft.rfft(taps.astype(float), 1024)
    linear = np.fft.irfft(product, 1024)
    assert filtered(ranges, taps) == pytest.approx(linear[2 * half : 2 * half + 360], abs=2e-5)


def test_512_points_without_wrapping_are_wrong_at_the_seam():
    """Zero padding alone does not reach the beams across the seam: the scan has to be wrapped first."""
    values = np.full(360, 5.0)
    values[:3] = 1.0
    taps = feature_filter(30).astype(float)
    cut = np.fft.irfft(np.fft.rfft(values, 512) * np.fft.rfft(taps, 512), 512)[30:390]
    assert np.abs(cut - fft_circular(values, taps)).max() > 0.5


@given(scans(60), st.integers(1, 12))
def test_a_limited_field_of_view_continues_with_its_end_values(ranges, half):
    taps = feature_filter(half)
    values = np.pad(plain(ranges), half, mode="edge")
    expected = np.convolve(values, taps.astype(float), mode="valid")
    assert filtered(ranges, taps, wraps=False) == pytest.approx(expected, abs=2e-5)


@given(scans(90), st.integers(1, 20))
def test_never_overshoots(ranges, half):
    values = plain(ranges)
    for taps in (scope_filter(half), feature_filter(half)):
        out = filtered(ranges, taps)
        assert out.min() >= values.min() - 2e-5
        assert out.max() <= values.max() + 2e-5


@pytest.mark.parametrize("wraps", [True, False])
def test_open_space_is_exactly_flat(wraps):
    out = filtered(np.full(360, math.inf, np.float32), feature_filter(30), wraps)
    assert (out == np.float32(RANGE_MAX)).all()


@pytest.mark.parametrize("bad", [math.nan, 0.05, -math.inf])
def test_an_invalid_beam_counts_as_range_zero(bad):
    ranges = np.full(60, 2.0, np.float32)
    ranges[20] = bad
    zero = ranges.copy()
    zero[20] = 0.0
    taps = feature_filter(5)
    assert (filtered(ranges, taps) == filtered(zero, taps, range_min=0.0)).all()
    assert filtered(ranges, taps)[20] < 2.0


@given(scans(72), st.integers(0, 71))
def test_turning_the_scan_turns_the_result(ranges, turn):
    taps = feature_filter(6)
    assert (filtered(np.roll(ranges, turn), taps) == np.roll(filtered(ranges, taps), turn)).all()


def test_sensor_helper_is_a_full_circle():
    assert make_sensor().wraps
    assert not make_sensor(fov=math.pi).wraps
