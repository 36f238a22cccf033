"""Safe directions: against the printed rule in two other forms, and against a disc moved by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from helpers import circles_world, make_sensor, rig_of, scan_at
from swarmscope.onboard.perception.corridor import corridor_length
from swarmscope.onboard.perception.safety import (
    BINS,
    Rule,
    beam_of,
    blocking_half_angle,
    reach_table,
    safe_directions,
)
from swarmscope.onboard.rig import AHEAD, ESCAPE, NARROW

RANGE_MAX, L_TH, HALF = 5.0, 0.6, 30
INCREMENT = math.radians(1.0)
CIRCLE = make_sensor(360, range_max=RANGE_MAX)
BIN = RANGE_MAX / BINS
ROUNDED_L_TH = math.ceil(L_TH / BIN) * BIN
SECTOR = reach_table(INCREMENT, RANGE_MAX, 0.0, Rule(L_TH, math.radians(HALF)))
RULES = {
    "directions": ((0.18, Rule(0.6, 0.0, 2.0, 0.19)), ((0.18, 0.6), (0.19, 2.0))),
    "sector too": ((0.18, Rule(0.6, math.radians(30), 2.0, 0.19)), ((0.18, 0.6), (0.19, 2.0))),
    "narrow": ((0.18, Rule(1.2, 0.0, 0.0, 0.0)), ((0.18, 1.2),)),
    "large body": ((0.46, Rule(0.83, 0.0, 3.0, 0.47)), ((0.46, 0.83), (0.47, 3.0))),
}
RIG = rig_of(sensor=CIRCLE)
ranges_of = st.one_of(st.floats(0.015625, 6.0, width=32), st.just(math.inf))


def scans(beams):
    return hnp.arrays(np.float32, beams, elements=ranges_of, fill=st.just(np.float32(math.inf)))


def safe_of(ranges, reach, wraps=True, range_min=0.0, range_max=RANGE_MAX):
    sensor = CIRCLE._replace(beams=len(ranges), wraps=wraps, range_min=range_min, range_max=range_max)
    safe = np.full(len(ranges), 7, np.uint8)
    edges = np.full(len(ranges) + 1, 99, np.int16)
    count = safe_directions(ranges, sensor, reach, edges, safe)
    assert count == safe.sum()
    return safe


def windows(ranges, half, wraps, outside):
    """Every beam's window of 2 half + 1 beams (M, 2 half + 1); ``outside`` beyond the ends."""
    mode = {"mode": "wrap"} if wraps else {"mode": "constant", "constant_values": outside}
    return np.lib.stride_tricks.sliding_window_view(np.pad(ranges, half, **mode), 2 * half + 1)


@given(scans(360))
def test_the_sector_rule_is_a_sliding_window_minimum(ranges):
    expected = windows(ranges, HALF, True, 0.0).min(axis=1) >= ROUNDED_L_TH
    assert (safe_of(ranges, SECTOR) == expected).all()


@given(scans(240))
def test_the_sector_rule_in_a_limited_field_of_view(ranges):
    """A window that leaves the field of view holds something that nobody has seen."""
    expected = windows(ranges, HALF, False, 0.0).min(axis=1) >= ROUNDED_L_TH
    assert (safe_of(ranges, SECTOR, wraps=False) == expected).all()


@given(scans(360))
def test_the_sector_rule_is_the_printed_filter(ranges):
    """(5): y_1 = h_1 * min(s, l_th) >= l_th, by FFT; the tolerance is far below one beam's shortfall."""
    near = (ranges >= L_TH - BIN) & (ranges < ROUNDED_L_TH)
    cut = np.minimum(np.where(near, ROUNDED_L_TH, ranges).astype(float), L_TH)
    kernel = np.zeros(360)
    kernel[np.arange(-HALF, HALF + 1)] = 1.0 / (2 * HALF + 1)
    y_1 = np.fft.ifft(np.fft.fft(cut) * np.fft.fft(kernel)).real
    assert BIN / (2 * HALF + 1) > 1e-4
    ours = safe_of(np.where(near, np.float32(ROUNDED_L_TH + 1e-4), ranges).astype(np.float32), SECTOR)
    assert (ours == (y_1 >= L_TH - 1e-9)).all()


@given(scans(360), st.integers(0, 359))
def test_a_full_circle_has_no_seam(ranges, turn):
    reach = RIG.reach[-1, AHEAD]
    assert (safe_of(np.roll(ranges, turn), reach) == np.roll(safe_of(ranges, reach), turn)).all()


def least_clearance(points, direction, way):
    """Smallest distance from each point to the segment of length ``way`` along ``direction``."""
    u = np.array([math.cos(direction), math.sin(direction)])
    along = np.clip(points @ u, 0.0, way)
    return np.hypot(*(points - along[:, None] * u).T)


@settings(max_examples=60)
@given(scans(360), st.sampled_from(sorted(RULES)))
def test_a_disc_that_leaves_in_a_safe_direction_touches_no_return(ranges, name):
    rule, promises = RULES[name]
    safe = safe_of(ranges, reach_table(INCREMENT, RANGE_MAX, *rule))
    angles = -math.pi + INCREMENT * np.arange(360)
    seen = ranges < RANGE_MAX
    s = ranges[seen].astype(float)
    points = s[:, None] * np.column_stack([np.cos(angles[seen]), np.sin(angles[seen])])
    assume(len(points))
    for direction in angles[safe == 1]:
        for radius, reach in promises:
            kept = least_clearance(points, direction, reach - radius)
            assert (kept >= np.minimum(radius, s) - 1e-6).all()


@pytest.mark.parametrize("name", sorted(RULES))
def test_a_single_return_is_passed_no_closer_than_promised(name):
    """With beams of 0.1 degrees and ranges at the near end of their bins, where rounding hides nothing."""
    rule, promises = RULES[name]
    beams, increment = 3600, math.radians(0.1)
    reach = reach_table(increment, RANGE_MAX, *rule)
    for s in np.arange(1, 320, 7) * BIN + 1e-5:
        ranges = np.full(beams, math.inf, np.float32)
        ranges[1800] = s
        off = increment * np.abs(np.flatnonzero(safe_of(ranges, reach)) - 1800)
        if not off.size:
            continue
        for radius, until in promises:
            passed = s * math.sin(min(off.min(), 0.5 * math.pi))
            assert s >= until or passed >= min(radius, s) - 1e-6


@given(st.floats(0.01, 4.9), st.floats(-math.pi, math.pi))
def test_no_more_is_blocked_than_the_rule_says(s, bearing):
    """Directions beyond a return's half angle, and the rounding of one bin and one beam, stay safe."""
    rule = RULES["directions"][0]
    ranges = np.full(360, math.inf, np.float32)
    beam = beam_of(bearing, CIRCLE)
    ranges[beam] = s
    safe = safe_of(ranges, reach_table(INCREMENT, RANGE_MAX, *rule))
    half = blocking_half_angle(max(0.0, s - BIN), *rule)
    blocked = int(360 - safe.sum())
    assert blocked <= 2 * math.ceil(half / INCREMENT) + 1
    if half > 0.0 and blocking_half_angle(s, *rule) > 0.0:
        assert safe[beam] == 0
        assert blocked >= 2 * int(blocking_half_angle(s, *rule) / INCREMENT) + 1


@pytest.mark.parametrize("bad", [math.nan, 0.05, -math.inf])
@pytest.mark.parametrize("level", [AHEAD, NARROW, ESCAPE])
def test_an_invalid_beam_blocks_a_quarter_turn_to_either_side(bad, level):
    ranges = np.full(360, math.inf, np.float32)
    ranges[200] = bad
    safe = safe_of(ranges, RIG.reach[-1, level], range_min=0.1)
    turn = np.abs((np.arange(360) - 200 + 180) % 360 - 180)
    assert (safe[turn <= 90] == 0).all()
    assert (safe[turn > 91] == 1).all()


def test_all_beams_invalid_leaves_no_direction():
    assert safe_of(np.full(360, math.nan, np.float32), RIG.reach[-1, AHEAD]).sum() == 0


def test_open_space_is_safe_everywhere():
    assert safe_of(np.full(360, math.inf, np.float32), RIG.reach[-1, AHEAD]).all()
    assert safe_of(np.full(360, 5.0, np.float32), RIG.reach[-1, AHEAD]).all()


@pytest.mark.parametrize("level", [AHEAD, NARROW, ESCAPE])
@pytest.mark.parametrize("fov_deg", [120, 180, 270])
def test_directions_at_the_border_of_the_field_of_view_are_not_safe(fov_deg, level):
    """What is beside the outermost beam has not been seen: alpha/2 of the published robot is 30 degrees."""
    sensor = make_sensor(beams=fov_deg + 1, fov=math.radians(fov_deg))
    rig = rig_of(sensor=sensor)
    safe = safe_of(np.full(sensor.beams, math.inf, np.float32), rig.reach[-1, level], wraps=False)
    assert (safe[: rig.half] == 0).all()
    assert (safe[-rig.half :] == 0).all()
    assert safe[rig.half + 1 : -rig.half - 1].all()


def test_gaps_narrower_than_the_body_are_closed_and_wider_ones_open():
    rig = rig_of()
    for gap, free in ((0.30, False), (0.35, False), (0.40, True), (0.60, True)):
        half = 0.5 * gap
        scan = scan_at(circles_world([(0.5, half + 0.2, 0.2), (0.5, -half - 0.2, 0.2)]), rig)
        assert bool(safe_of(scan, rig.reach[-1, NARROW])[180]) is free


@given(st.floats(-20.0, 20.0))
def test_beam_of_is_the_nearest_beam(bearing):
    n = beam_of(bearing, CIRCLE)
    error = (bearing - (-math.pi + n * INCREMENT) + math.pi) % (2.0 * math.pi) - math.pi
    assert abs(error) <= 0.5 * INCREMENT + 1e-9


def test_beam_of_outside_the_field_of_view():
    sensor = CIRCLE._replace(beams=121, angle_min=math.radians(-60), wraps=False)
    assert beam_of(math.radians(61), sensor) == -1
    assert beam_of(math.radians(-61), sensor) == -1
    assert beam_of(math.radians(60), sensor) == 120


@settings(max_examples=60)
@given(scans(360), st.floats(-math.pi, math.pi), st.floats(0.05, 3.0))
def test_corridor_length_is_how_far_the_disc_gets(ranges, bearing, limit):
    half_width = 0.18
    free = corridor_length(ranges, RIG, bearing, half_width, limit)
    angles = -math.pi + INCREMENT * np.arange(360)
    seen = np.isfinite(ranges)
    s = ranges[seen].astype(float)
    points = s[:, None] * np.column_stack([np.cos(angles[seen]), np.sin(angles[seen])])
    assert 0.0 <= free <= limit
    ahead = points @ [math.cos(bearing), math.sin(bearing)] > 1e-9
    if ahead.any():
        kept = least_clearance(points[ahead], bearing, free)
        assert (kept >= np.minimum(half_width, s[ahead]) - 1e-6).all() or free == 0.0
        if 0.0 < free < limit - 1e-6:
            assert least_clearance(points[ahead], bearing, free + 1e-3).min() < half_width


def test_an_invalid_beam_closes_the_corridor_ahead_only():
    ranges = np.full(360, math.inf, np.float32)
    ranges[180] = math.nan
    rig = rig_of(sensor=make_sensor(range_min=0.1))
    assert corridor_length(ranges, rig, 0.0, 0.18, 2.0) == 0.0
    assert corridor_length(ranges, rig, math.pi, 0.18, 2.0) == 2.0
