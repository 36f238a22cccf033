"""Property tests draw the same examples every time; new ones are drawn by ``make fuzz`` only."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from fuzz import FOUND, fuzz


def test_every_test_runs_with_the_fixed_profile():
    assert settings.default.derandomize
    assert settings.default.deadline is None
    assert settings.default.database is None


def test_the_same_examples_are_drawn_again():
    def drawn():
        values = []

        @settings(max_examples=20)
        @given(st.floats())
        def collect(value):
            values.append(repr(value))

        collect()
        return values

    assert drawn() == drawn()


def test_fuzzing_ends_with_the_first_find():
    codes = iter([0, 0, FOUND, 0])
    seeds = []

    def play(seed, seconds):
        seeds.append(seed)
        return next(codes)

    assert fuzz(1.0, play) == FOUND
    assert len(set(seeds)) == 3


def test_fuzzing_ends_with_the_time():
    left = []
    assert fuzz(0.0005, lambda seed, seconds: left.append(seconds)) == 0
    assert left == sorted(left, reverse=True)
    assert 0.0 < left[-1] <= left[0] <= 0.03
    assert fuzz(0.0, lambda seed, seconds: FOUND) == 0
