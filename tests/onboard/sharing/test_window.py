"""The window of sequence numbers, worked by hand and beside a set of all that came in."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.onboard.sharing.window import CLOSED, OPEN, WINDOW, ahead_by, is_near, is_seen, with_seen


@pytest.mark.parametrize(
    ("seq", "newest", "ahead"),
    [
        (1, 0, 1),
        (0, 1, -1),
        (7, 7, 0),
        (0, 65535, 1),
        (65535, 0, -1),
        (3, 65530, 9),
        (0x7FFF, 0, 0x7FFF),
        (0x8000, 0, -0x8000),
        (0x8001, 0, -0x7FFF),
        (65536, 65535, 1),
    ],
)
def test_how_far_a_number_is_ahead(seq, newest, ahead):
    assert ahead_by(seq, newest) == ahead


def test_bits_worked_by_hand():
    seen = with_seen(OPEN, 3)  # 0b1 moved by 3, and the new one
    assert int(seen) == 0b1001
    assert [bool(is_seen(seen, -k)) for k in range(5)] == [True, False, False, True, False]
    seen = with_seen(seen, -1)
    assert int(seen) == 0b1011
    assert int(with_seen(seen, 63)) == 1 << 63 | 1 << 64 - 1 | 1
    assert int(with_seen(seen, 64)) == 1
    assert int(with_seen(CLOSED, 1)) == 2**64 - 1
    assert not is_seen(CLOSED, 1)
    assert is_seen(CLOSED, -63)


@pytest.mark.parametrize(("ahead", "near"), [(-64, False), (-63, True), (0, True), (64, True), (65, False)])
def test_what_belongs_to_a_window(ahead, near):
    assert is_near(ahead) == near


@settings(deadline=None)
@given(st.integers(0, 65535), st.lists(st.integers(-80, 80), max_size=60))
def test_a_window_takes_each_number_once_in_any_order(first, steps):
    """Beside a set: what is in the window and has not come in is taken, once; nothing else is."""
    newest, seen = first, OPEN
    came, top = {0}, 0  # unwrapped
    at = 0
    for step in steps:
        at += step
        ahead = ahead_by((first + at) & 0xFFFF, newest)
        assert ahead == at - top
        fresh = bool(is_near(ahead)) and not is_seen(seen, ahead)
        assert fresh == (top - WINDOW < at <= top + WINDOW and at not in came)
        if fresh:
            seen = np.uint64(with_seen(seen, ahead))
            newest = (newest + max(0, ahead)) & 0xFFFF
            came.add(at)
            top = max(top, at)
