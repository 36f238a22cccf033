"""Keyed random numbers: which key gives which number, and how they are spread."""

from __future__ import annotations

from statistics import NormalDist

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope._jit import jit
from swarmscope.sim.streams import (
    BEARING_NOISE,
    COMPASS_NOISE,
    NORMAL_TABLE,
    RADIO_LOSS,
    RANGE_NOISE,
    SCAN_DROP,
    SCAN_NOISE,
    add_scan_noise,
    key,
    mix,
    normal,
    replace_readings,
    uniform,
)


@jit
def fill(seed, first, last, purpose, uniforms, normals):
    for k in range(first, last):
        uniforms[k] = uniform(key(seed, 3, k, purpose))
        normals[k] = normal(key(seed, 3, k, purpose))


def draws(count, seed=1, purpose=SCAN_NOISE):
    uniforms, normals = np.zeros(count), np.zeros(count)
    fill(seed, 0, count, purpose, uniforms, normals)
    return uniforms, normals


def test_purposes_are_distinct():
    purposes = {SCAN_NOISE, SCAN_DROP, RANGE_NOISE, BEARING_NOISE, COMPASS_NOISE, RADIO_LOSS}
    assert len(purposes) == 6


@settings(max_examples=50, deadline=None)
@given(st.integers(0, 2**31 - 1), st.integers(0, 200_000), st.integers(0, 10_000))
def test_every_part_of_the_key_counts(seed, robot, tick):
    base = key(seed, robot, tick, 1)
    assert base == key(seed, robot, tick, 1)
    others = [key(seed + 1, robot, tick, 1), key(seed, robot + 1, tick, 1), key(seed, robot, tick + 1, 1)]
    others += [key(seed, robot, tick, 2), key(seed, tick + 7, robot, 1)]
    assert base not in others


def test_keys_of_a_run_do_not_collide():
    keys = {
        key(0, robot, tick, purpose) for robot in range(20) for tick in range(50) for purpose in range(1, 7)
    }
    assert len(keys) == 20 * 50 * 6


def test_the_mixer_is_splitmix64():
    """First outputs of the published generator started at 0."""
    golden = 0x9E3779B97F4A7C15
    states = [np.uint64(golden * k % 2**64) for k in (1, 2, 3)]

    def plain(z):
        z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9 % 2**64
        z = (z ^ (z >> 27)) * 0x94D049BB133111EB % 2**64
        return z ^ (z >> 31)

    assert [int(mix(s)) for s in states] == [plain(int(s)) for s in states]
    assert int(mix(states[0])) == 0xE220A8397B1DCDAF


def test_order_does_not_matter():
    forward, _ = draws(100)
    backward, normals = np.zeros(100), np.zeros(100)
    for k in range(99, -1, -1):
        fill(1, k, k + 1, SCAN_NOISE, backward, normals)
    assert (forward == backward).all()


def test_uniform_numbers_are_uniform():
    u, _ = draws(200_000)
    assert u.min() >= 0.0
    assert u.max() < 1.0
    assert u.mean() == pytest.approx(0.5, abs=0.003)
    assert u.var() == pytest.approx(1.0 / 12.0, abs=0.001)
    counts = np.histogram(u, 64, (0.0, 1.0))[0]
    assert ((counts - 3125.0) ** 2 / 3125.0).sum() < 120.0  # 63 degrees of freedom
    assert abs(np.corrcoef(u[:-1], u[1:])[0, 1]) < 0.01


def test_normal_numbers_have_mean_zero_and_unit_variance():
    _, g = draws(200_000)
    assert g.mean() == pytest.approx(0.0, abs=0.01)
    assert g.std() == pytest.approx(1.0, abs=0.01)
    assert (g > 1.0).mean() == pytest.approx(1.0 - NormalDist().cdf(1.0), abs=0.004)
    assert (g > 2.0).mean() == pytest.approx(1.0 - NormalDist().cdf(2.0), abs=0.002)


def test_the_table_holds_the_quantiles_of_12_bits():
    assert NORMAL_TABLE.shape == (4096,)
    table = NORMAL_TABLE.astype(float)
    assert table.std() == pytest.approx(1.0, abs=1e-6)
    assert table == pytest.approx(-table[::-1], abs=1e-6)
    assert (np.diff(table) > 0.0).all()
    assert table[int(4096 * NormalDist().cdf(1.0))] == pytest.approx(1.0, abs=0.01)
    assert 3.5 < table[-1] < 3.8


def test_scan_noise_is_relative_and_cuts_at_the_longest_range():
    ranges = np.full(40_000, 2.0, np.float32)
    ranges[::4] = np.inf
    ranges[1::4] = 4.99
    add_scan_noise(ranges, np.uint64(77), 0.02, 5.0)
    near = ranges[2::4]
    assert near.mean() == pytest.approx(2.0, abs=0.002)
    assert near.std() == pytest.approx(0.04, abs=0.001)
    assert np.isinf(ranges[::4]).all()
    far = ranges[1::4]
    assert np.isinf(far).mean() == pytest.approx(1.0 - NormalDist().cdf((5.0 / 4.99 - 1.0) / 0.02), abs=0.02)
    assert far[np.isfinite(far)].max() <= 5.0
    assert abs(np.corrcoef(near[:-1], near[1:])[0, 1]) < 0.03


def test_neighbouring_beams_of_one_word_are_independent():
    ranges = np.full(40_000, 1.0, np.float32)
    add_scan_noise(ranges, np.uint64(5), 0.01, 5.0)
    for a in range(4):
        for b in range(a):
            assert abs(np.corrcoef(ranges[a::4], ranges[b::4])[0, 1]) < 0.04


def test_dropouts_come_with_the_given_share():
    ranges = np.full(40_000, 2.0, np.float32)
    replace_readings(ranges, np.uint64(9), 0.1, np.inf)
    assert np.isinf(ranges).mean() == pytest.approx(0.1, abs=0.006)
    same = np.full(40_000, 2.0, np.float32)
    replace_readings(same, np.uint64(9), 0.1, np.inf)
    assert (same == ranges).all()
