"""Sets of 64 cells against Python's whole numbers."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from swarmscope.onboard.mapping.words import bit, lowest, number, window, without_lowest

WORDS = st.integers(0, 2**64 - 1)


@given(WORDS.filter(bool))
def test_a_set_is_taken_apart_from_its_first_cell(word):
    cells, left = [], np.uint64(word)
    while left:
        cells.append(lowest(left))
        left = np.uint64(without_lowest(left))
    assert cells == [k for k in range(64) if word >> k & 1]


@given(WORDS, WORDS, st.integers(0, 63))
def test_a_window_over_two_words(first, second, shift):
    expected = (first | second << 64) >> shift & 2**64 - 1
    assert int(window(np.uint64(first), np.uint64(second), shift)) == expected


@given(st.integers(0, 63))
def test_one_cell(k):
    assert int(bit(k)) == 1 << k
    assert number(np.uint64(k)) - 64 < 0
