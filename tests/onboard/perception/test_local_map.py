"""Pictures from scans: hand-worked cells, turning, mirroring, robots taken out."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from helpers import make_sensor
from swarmscope.onboard.network.local_map import (
    CELL_ANGLE,
    CELL_DISTANCE,
    CELLS,
    FARTHEST,
    FREE,
    HIT,
    NOTHING,
    UNKNOWN,
    Drawing,
    draw_map,
    encode_scan,
    hide_robot,
)

BEAMS = 360
INCREMENT = 2.0 * math.pi / BEAMS
MIDDLE = CELLS // 2
SENSOR = make_sensor(BEAMS)


def codes_of(ranges):
    codes = np.zeros(BEAMS, np.uint8)
    encode_scan(np.asarray(ranges, np.float32), codes)
    return codes


def picture(codes, target=0.0, radius=2.5, seen=2.5):
    out = np.full((2, CELLS, CELLS), 9, np.uint8)
    draw_map(codes, Drawing(-math.pi, INCREMENT, target, radius, seen), CELL_ANGLE, CELL_DISTANCE, out)
    return out


def test_codes_of_ranges():
    ranges = np.full(BEAMS, 1.0)
    ranges[:6] = [np.nan, np.inf, 0.0, 5.06, 5.09, 0.032]
    codes = codes_of(ranges)
    assert codes[:7].tolist() == [UNKNOWN, NOTHING, 1, FARTHEST, NOTHING, 2, 50]


def test_a_wall_ahead_is_a_line_of_hits_and_hides_what_is_behind():
    angles = -math.pi + INCREMENT * np.arange(BEAMS)
    ranges = np.where(np.cos(angles) > 0.05, 1.0 / np.maximum(np.cos(angles), 0.05), np.inf)  # x = 1 m
    drawn = picture(codes_of(ranges))
    column = MIDDLE + 20  # 1 m in cells of 0.05 m
    near = slice(MIDDLE - 15, MIDDLE + 16)
    assert drawn[HIT, near, column].all()
    assert drawn[FREE, near, MIDDLE : column - 1].all()
    assert not drawn[:, near, column + 2 :].any()
    assert drawn[FREE, MIDDLE, 0] == 1  # nothing behind the robot


def test_a_sensor_that_sees_less_far_leaves_the_rest_unknown():
    drawn = picture(codes_of(np.full(BEAMS, np.inf)), radius=5.0, seen=2.5)
    assert drawn[FREE, MIDDLE, MIDDLE + 25] == 1 and drawn[FREE, MIDDLE, MIDDLE + 26] == 0
    assert drawn[FREE].sum() == pytest.approx(math.pi * 25.0**2, rel=0.02) and not drawn[HIT].any()


def test_nothing_is_drawn_beyond_the_radius_and_nothing_is_both():
    drawn = picture(codes_of(np.full(BEAMS, np.inf)))
    assert drawn[FREE][CELL_DISTANCE <= MIDDLE].all()
    assert not drawn[FREE][CELL_DISTANCE > MIDDLE].any()
    drawn = picture(codes_of(np.random.default_rng(0).uniform(0.3, 4.0, BEAMS)))
    assert not (drawn[HIT] & drawn[FREE]).any()


@given(st.integers(-7, 7), st.integers(0, 2**31 - 1))
def test_a_quarter_turn_of_scan_and_target_gives_the_same_picture(quarters, seed):
    codes = codes_of(np.random.default_rng(seed).uniform(0.3, 4.0, BEAMS))
    turned = np.roll(codes, 90 * quarters)
    assert np.array_equal(picture(codes), picture(turned, quarters * math.pi / 2.0))


def test_a_wider_view_shows_the_same_wall_nearer():
    drawn = picture(codes_of(np.full(BEAMS, 2.0)), radius=5.0)
    assert drawn[HIT, MIDDLE, MIDDLE + 20] == 1  # 2 m in cells of 0.1 m


@pytest.mark.parametrize("bearing", [0.0, 1.3, math.pi, -2.0])
def test_a_robot_is_taken_out_but_not_what_stands_before_or_beside_it(bearing):
    angles = -math.pi + INCREMENT * np.arange(BEAMS)
    off = np.abs(np.angle(np.exp(1j * (angles - bearing))))
    ranges = np.where(off < math.asin(0.15 / 2.0) + 1e-6, 2.0 - 0.15, 4.0)
    ranges[np.argmin(off)] = 1.0  # a thin post in front of it
    codes = codes_of(ranges)
    hide_robot(codes, SENSOR, 2.0 * math.cos(bearing), 2.0 * math.sin(bearing), 0.15)
    assert codes[np.argmin(off)] == 50
    hidden = codes == UNKNOWN
    assert hidden.sum() == (off < math.asin(0.15 / 2.0) + 1e-6).sum() - 1
    assert not hidden[off > 0.1].any()
