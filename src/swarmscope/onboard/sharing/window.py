"""Sequence numbers that have come in: the newest, and which of the 63 before it (RFC 4303, 3.4.3; RFC 6479).

A window is ``newest`` and ``seen``, 64 bits: bit k says that ``newest - k`` has come in. Packets that overtake one
another pass once each, a replay never. Numbers have 16 bits and wrap; they are compared as in RFC 1982.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from swarmscope._jit import jit

WINDOW = 64
"""Numbers that a window remembers, and how far ahead of the newest one the next may be."""
Seen: TypeAlias = Any
"""64 bits, a numpy uint64."""
OPEN = np.uint64(1)
"""Only the newest has come in."""
CLOSED = np.uint64(0xFFFFFFFFFFFFFFFF)
"""Nothing before the newest is taken any more."""
_ONE = np.uint64(1)


@jit
def ahead_by(seq: int, newest: int) -> int:
    """Return by how much the 16-bit number ``seq`` is ahead of ``newest``, -32768 to 32767."""
    return ((int(seq) - int(newest) + 0x8000) & 0xFFFF) - 0x8000


@jit
def is_near(ahead: int) -> bool:
    """Tell whether a number so far ahead of the newest belongs to its window."""
    return -WINDOW < ahead <= WINDOW


@jit
def is_seen(seen: Seen, ahead: int) -> bool:
    """Tell whether a number so far ahead of the newest (``is_near``) has come in already."""
    if ahead > 0:
        return False
    return bool((np.uint64(seen) >> np.uint64(-ahead)) & _ONE)


@jit
def with_seen(seen: Seen, ahead: int) -> Seen:
    """Return the bits once a number so far ahead of the newest (``is_near``) has come in."""
    if ahead >= WINDOW:
        return _ONE
    if ahead > 0:
        return (np.uint64(seen) << np.uint64(ahead)) | _ONE
    return np.uint64(seen) | (_ONE << np.uint64(-ahead))
