"""What GIWT's network is told of neighbours: gains, cells, features as bytes; by hand and by counting."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmscope.onboard.network.graph import (
    FEATURES,
    GRID_M,
    OWN_CELL,
    VIEW_M,
    information_gain,
    information_gain_series,
    position_cell,
    quantise,
    restore,
    scale_of,
)


@pytest.mark.parametrize("distance", [0.0, 0.5, 1.0, 2.5, 3.7, 5.0, 9.0])
def test_the_gain_is_the_share_of_the_neighbours_disc_outside_ones_own(distance):
    rng = np.random.default_rng(1)
    points = rng.uniform(-VIEW_M, VIEW_M, (400_000, 2))
    inside = points[np.hypot(*points.T) <= VIEW_M]
    outside_own = np.hypot(inside[:, 0] + distance, inside[:, 1]) > VIEW_M
    assert information_gain(distance, VIEW_M) == pytest.approx(outside_own.mean(), abs=0.003)


def test_gains_worked_by_hand():
    # q = 1/2: arccos = pi/3, so 1 - 2/3 + sqrt(3)/(2 pi); the series 2/pi - 1/(12 pi)
    assert information_gain(2.5, 2.5) == pytest.approx(1.0 / 3.0 + math.sqrt(3.0) / (2.0 * math.pi))
    assert information_gain_series(2.5, 2.5) == pytest.approx((2.0 - 1.0 / 12.0) / math.pi)
    assert information_gain_series(0.0, 2.5) == 0.0


@given(st.floats(0.0, 20.0))
def test_the_series_stays_close_to_the_gain_and_grows(distance):
    # the terms left out are q^5 / (10 pi) + ...: at q = 1 the series is 10 / (3 pi) = 1.061 instead of 1
    exact, series = information_gain(distance, VIEW_M), information_gain_series(distance, VIEW_M)
    q = min(1.0, 0.5 * distance / VIEW_M)
    assert abs(exact - series) <= 0.062 * q**3 + 1e-12
    assert information_gain_series(distance + 0.1, VIEW_M) >= series


@pytest.mark.parametrize(
    ("x", "y", "cell"),
    [
        (0.0, 0.0, OWN_CELL),
        (0.71, -0.71, OWN_CELL),
        (0.72, 0.0, 25),  # ahead
        (-0.72, 0.0, 23),
        (0.0, 0.72, 31),  # left
        (0.0, -0.72, 17),
        (4.9, 4.9, 48),
        (-4.9, -4.9, 0),
        (4.9, -4.9, 6),
        (99.0, -99.0, 6),
    ],
)
def test_cells_worked_by_hand(x, y, cell):
    assert position_cell(x, y) == cell


@given(st.floats(-GRID_M, GRID_M - 1e-6), st.floats(-GRID_M, GRID_M - 1e-6))
def test_a_cell_holds_its_point(x, y):
    row, column = divmod(position_cell(x, y), 7)
    side = 10.0 / 7.0
    assert column * side - 5.0 - 1e-9 <= x <= (column + 1) * side - 5.0 + 1e-9
    assert row * side - 5.0 - 1e-9 <= y <= (row + 1) * side - 5.0 + 1e-9


@given(st.integers(0, 2**31), st.floats(-3.0, 3.0))
def test_quantised_features_are_off_by_half_a_step_at_most(seed, power):
    features = (10.0**power * np.random.default_rng(seed).normal(size=FEATURES)).astype(np.float32)
    codes, back = np.zeros(FEATURES, np.uint8), np.zeros(FEATURES, np.float32)
    code = quantise(features, codes)
    restore(codes, code, back)
    step = scale_of(code)
    assert np.abs(back - features).max() <= 0.5 * step * (1.0 + 1e-5)
    assert step * 127.0 <= np.abs(features).max() * 2.0 ** (1.0 / 8.0) * (1.0 + 1e-6)  # the ladder's next step


def test_features_that_are_no_numbers_become_0():
    features = np.zeros(FEATURES, np.float32)
    features[:4] = [math.nan, math.inf, -math.inf, 1.0]
    codes, back = np.zeros(FEATURES, np.uint8), np.ones(FEATURES, np.float32)
    restore(codes, quantise(features, codes), back)
    assert back[:4] == pytest.approx([0.0, 0.0, 0.0, 1.0], rel=0.05)
    assert quantise(np.zeros(FEATURES, np.float32), codes) == 0
    assert not codes.any()
