"""The packets of robots that remember: "this is my way, who knows it is closed?" (CHECK), and what closes it (CLOSED).

Byte by byte in docs/message.md. Places are in a frame that has a name; where it lies the receiver has to know. The
kernels never raise and never allocate.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline
from swarmscope.onboard.sharing.codes import get_u16, put_checksum, put_u16
from swarmscope.onboard.sharing.message import (
    CHECK_HEAD,
    CLOSED_HEAD,
    KIND_CHECK,
    KIND_CLOSED,
    MAX_CORNERS,
    Head,
    put_answer_head,
    put_head,
)

PLACE_M = 1.0 / 64.0
"""Step of the sender's place; places wrap round after 1024 m."""
CORNER_M = 1.0 / 8.0
CELL_M = 1.0 / 16.0
"""Side of the cells of a CLOSED."""
_NAME = 3
"""Bytes of a frame's name."""
FRAMES = 1 << 24
"""Names of frames."""
WAY_CORNERS = MAX_CORNERS - 1
"""Corners of the way in a CHECK; one has the frame's name."""
_CORNER_MOST = 2047
_NEAR = 7
"""Steps from cell to cell that one byte holds along either axis."""
_LEAP = 0x88
"""What no step is coded as: the next three bytes name a cell anew."""
_AGAIN = 8
"""What no step has in its lower half: the last step is repeated, as often as `_times` says of the upper half."""
_AGAIN_MOST = 15


class Place(NamedTuple):
    """Where a robot is [m], and the name of the frame in which it is there."""

    x: float
    y: float
    frame: int


@jit_inline
def _put_place(out: np.ndarray, at: int, place: Place) -> None:
    """Write a place into four bytes; what is no number is written as 0."""
    put_u16(out, at, _steps(place.x))
    put_u16(out, at + 2, _steps(place.y))


@jit_inline
def _steps(x: float) -> int:
    """Return a place along an axis [m] in steps, modulo 65536."""
    return math.floor(x / PLACE_M + 0.5) & 0xFFFF if abs(x) < 1e9 else 0


@jit_inline
def place_of(data: np.ndarray) -> Place:
    """Return where the sender of a CHECK or a CLOSED that ``decode`` found ``OK`` was, modulo 1024 m.

    The frame is 0, which no frame is called, where the packet names none.
    """
    is_check = int(data[0]) & 0xF == KIND_CHECK
    at, body = (7, CHECK_HEAD) if is_check else (9, CLOSED_HEAD)
    names = int(data[body - 1]) >= (1 if is_check else _NAME)
    frame = int(data[body]) | int(data[body + 1]) << 8 | int(data[body + 2]) << 16 if names else 0
    return Place(get_u16(data, at) * PLACE_M, get_u16(data, at + 2) * PLACE_M, frame)


@jit_inline
def _put_frame(out: np.ndarray, at: int, frame: int) -> None:
    """Write the name of a frame into three bytes."""
    out[at], out[at + 1], out[at + 2] = frame & 0xFF, (frame >> 8) & 0xFF, (frame >> 16) & 0xFF


@jit_inline
def unwrapped(step: float) -> float:
    """Return the difference [m] of two places that wrap round: the short way."""
    whole = 65536.0 * PLACE_M
    return step - whole * math.floor(step / whole + 0.5)


@jit
def encode_check(head: Head, place: Place, corners: np.ndarray, n: int, out: np.ndarray) -> int:
    """Write a CHECK into ``out`` uint8; return its length (0 when ``out`` is too small).

    ``corners (n, 2)`` [m] of the way, relative to the sender, the first where it begins. Of more than ``WAY_CORNERS``
    the first are sent; one that is farther than 255 m along an axis is moved there.
    """
    n = max(0, min(n, WAY_CORNERS, corners.shape[0]))
    if out.size < CHECK_HEAD + _NAME + 3 * n + 2:
        return 0
    put_head(out, KIND_CHECK, head)
    _put_place(out, 7, place)
    out[CHECK_HEAD - 1] = n + 1
    _put_frame(out, CHECK_HEAD, place.frame)
    for k in range(n):
        _put_pair(out, CHECK_HEAD + _NAME + 3 * k, _corner_code(corners[k, 0]), _corner_code(corners[k, 1]))
    return put_checksum(out, CHECK_HEAD + _NAME + 3 * n)


@jit_inline
def _put_pair(out: np.ndarray, at: int, x: int, y: int) -> None:
    """Write two numbers of twelve bits into three bytes."""
    out[at], out[at + 1], out[at + 2] = x & 0xFF, (x >> 8) | ((y & 0xF) << 4), y >> 4


@jit_inline
def _pair(data: np.ndarray, at: int) -> tuple[int, int]:
    """Read them, as two's complements."""
    a, b, c = int(data[at]), int(data[at + 1]), int(data[at + 2])
    return _signed(a | ((b & 0xF) << 8), 12), _signed((b >> 4) | (c << 4), 12)


@jit_inline
def _corner_code(x: float) -> int:
    """Return a place relative to the sender in twelve bits, two's complement; 0 for what is no number."""
    if not abs(x) < 1e9:
        return 0
    return int(max(-_CORNER_MOST, min(_CORNER_MOST, math.floor(x / CORNER_M + 0.5)))) & 0xFFF


@jit
def read_check(data: np.ndarray, length: int, corners: np.ndarray) -> int:
    """Write the corners of a CHECK that ``decode`` found ``OK`` into ``corners (N, 2)`` [m]; return how many, -1: none.

    They are relative to the sender, along the axes of all frames.
    """
    if length < CHECK_HEAD + _NAME + 2 or length > data.size or int(data[0]) & 0xF != KIND_CHECK:
        return -1
    n = max(0, min(int(data[CHECK_HEAD - 1]) - 1, corners.shape[0], (length - CHECK_HEAD - _NAME - 2) // 3))
    for k in range(n):
        x, y = _pair(data, CHECK_HEAD + _NAME + 3 * k)
        corners[k, 0], corners[k, 1] = x * CORNER_M, y * CORNER_M
    return int(n)


@jit_inline
def _signed(value: int, bits: int) -> int:
    """Return the number that the lowest ``bits`` stand for in two's complement."""
    value &= (1 << bits) - 1
    return value - (1 << bits) if value >> (bits - 1) else value


@jit
def encode_closed(head: Head, place: Place, cells: np.ndarray, n: int, out: np.ndarray, most: int) -> int:
    """Write a CLOSED of at most ``most`` bytes into ``out`` uint8; return its length, 0: nothing fits.

    ``cells (n, 2)`` are numbers of cells of `CELL_M`, of that in whose middle ``place`` is: none is farther than 127 m
    along an axis. Those that come first are sent; what is near the cell before takes one byte, else four; the same step
    again and again, up to 15 times, takes one more.
    """
    most = min(most, out.size)
    n = min(n, cells.shape[0])
    at, x, y = CLOSED_HEAD + _NAME, 0, 0
    if n <= 0 or most < CLOSED_HEAD + _NAME + 5:
        return 0
    put_answer_head(out, KIND_CLOSED, head)
    _put_place(out, 9, place)
    _put_frame(out, CLOSED_HEAD, place.frame)
    dx, dy, again = 0, 0, 0
    for k in range(n):
        was_x, was_y, dx, dy = dx, dy, cells[k, 0] - x, cells[k, 1] - y
        near = k > 0 and abs(dx) <= _NEAR and abs(dy) <= _NEAR
        same = near and (dx, dy) == (was_x, was_y)
        if same and 0 < again < _AGAIN_MOST:
            again += 1
            out[at - 1] = _AGAIN | (_half_of(again) << 4)
        elif at + (1 if near else 3 + min(1, k)) + 2 > most:
            break
        elif same:
            again = 1
            out[at] = _AGAIN | (_half_of(again) << 4)
            at += 1
        elif near:
            again = 0
            out[at] = (dx & 0xF) | ((dy & 0xF) << 4)
            at += 1
        else:
            again, dx, dy = 0, 0, 0
            if k > 0:
                out[at] = _LEAP
                at += 1
            _put_pair(out, at, cells[k, 0] & 0xFFF, cells[k, 1] & 0xFFF)
            at += 3
        x, y = cells[k, 0], cells[k, 1]
    out[CLOSED_HEAD - 1] = at - CLOSED_HEAD
    return put_checksum(out, at)


@jit_inline
def _half_of(times: int) -> int:
    """Return the upper half of the byte that repeats a step so often, 1 to 15: there is no 8, which is the leap's."""
    return times - 1 if times <= _AGAIN else times


@jit_inline
def _times(half: int) -> int:
    """Return how often the byte with this upper half repeats the step."""
    return half + 1 if half < _AGAIN else half


@jit
def read_closed(data: np.ndarray, length: int, cells: np.ndarray) -> int:
    """Write the middles of the cells of a CLOSED that ``decode`` found ``OK`` into ``cells (N, 2)`` [m].

    Return how many, -1 for other packets.

    They are relative to the sender, along the axes of all frames; what is torn ends the list.
    """
    if length < CLOSED_HEAD + _NAME + 2 or length > data.size or int(data[0]) & 0xF != KIND_CLOSED:
        return -1
    at, end, n, x, y = CLOSED_HEAD + _NAME, length - 2, 0, 0, 0
    dx, dy, times, anew = 0, 0, 1, True
    while at < end and n < cells.shape[0]:
        code = int(data[at])
        if anew or code == _LEAP:
            at += 0 if anew else 1
            if at + 3 > end:
                break
            x, y = _pair(data, at)
            dx, dy, times = 0, 0, 0
            at += 3
            n = _note_cell(cells, n, x, y)
        elif code & 0xF == _AGAIN:
            times = _times(code >> 4)
            at += 1
        else:
            dx, dy, times = _signed(code, 4), _signed(code >> 4, 4), 1
            at += 1
        anew = False
        for _ in range(min(times, cells.shape[0] - n)):
            x, y = x + dx, y + dy
            n = _note_cell(cells, n, x, y)
    return n


@jit_inline
def _note_cell(cells: np.ndarray, n: int, x: int, y: int) -> int:
    """Write the middle of a cell as the ``n``-th; return how many there are."""
    cells[n, 0], cells[n, 1] = x * CELL_M, y * CELL_M
    return n + 1
