"""What maps are made of: sets of 64 cells in one number, a bit each, and places."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit_inline

WORD = 64
ONE, ZERO, FULL = np.uint64(1), np.uint64(0), np.uint64(2**64 - 1)
_SEQUENCE = np.uint64(0x03F79D71B4CB0A89)
"""De Bruijn's: every six bits in a row of it are different."""
_PLACES = np.zeros(WORD, np.int64)
for _k in range(WORD):
    _PLACES[(int(_SEQUENCE) << _k & 2**64 - 1) >> 58] = _k


@jit_inline
def bit(k: int) -> np.uint64:
    """Return the set of cell ``k`` alone, 0 to 63."""
    return ONE << np.uint64(k)


@jit_inline
def lowest(word: np.uint64) -> int:
    """Return the first cell of a set that is not empty."""
    alone = word & (~word + ONE)
    return int(_PLACES[(alone * _SEQUENCE) >> np.uint64(58)])


@jit_inline
def without_lowest(word: np.uint64) -> np.uint64:
    """Return the set without its first cell."""
    return word & (word - ONE)


@jit_inline
def window(first: np.uint64, second: np.uint64, shift: int) -> np.uint64:
    """Return the 64 cells that begin at ``shift`` (0 to 63) of a word and go on in the next one."""
    if shift == 0:
        return first
    return (first >> np.uint64(shift)) | (second << np.uint64(WORD - shift))


@jit_inline
def number(word: np.uint64) -> int:
    """Return a word, or what is kept in few bits, as a whole number that may be reckoned with below 0."""
    return np.int64(word)  # type: ignore[return-value]  # a plain number in kernels


class Spot(NamedTuple):
    """A place on the map [cells]."""

    u: float
    v: float
