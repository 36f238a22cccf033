"""What stands round a closed place, thinned out and put into rows: much of a wall in few bytes.

From what closes the place it goes on along the wall, both ways, as far as the answer holds and not farther than 8 m:
who knows only where a way ends tries the place beside it next. Everything told of is so near to a told cell that
nothing fits through, and told cells go straight on where they can: a packet holds a step that is repeated in a byte.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.answering import is_sure, things, wall_at
from swarmscope.onboard.mapping.cells import LEAST
from swarmscope.onboard.mapping.words import WORD, ZERO, Spot, bit, lowest, number, without_lowest
from swarmscope.onboard.percept import Row
from swarmscope.onboard.view import View

JOINED = 4
"""What is so many cells from a cell along either axis belongs to the same thing: nobody gets through between."""
HALF = 128
"""Cells either side of where the wall was met that are looked at."""
_ROW = 2 * HALF // WORD
_SEEN = 2 * HALF * _ROW
"""Words for a bit a cell; behind them the cells still to be looked round at, four in a word."""
_MOST = 4096
BEHIND = _SEEN + _MOST // 4
"""Where the scratch goes on behind them."""


class Start(NamedTuple):
    """Where the square of cells that are looked at begins."""

    x: int
    y: int


@jit
def trace(see: View, memory: Row, cell: float, place: tuple[float, float], terms: tuple[int, float]) -> int:
    """Write what closes a place, the nearest of it, in rows, into ``memory["talk_cell"]``; return how many cells.

    ``terms``: how many at most, and how far [cells] from the robot along an axis.
    """
    most, reach = terms
    found, x, y = wall_at(see, memory, cell, place)
    if not found or most < 1:
        return 0
    start = Start(x - HALF, y - HALF)
    unmark_all(memory)
    x, y = _gather(see, memory, cell, start, (most, reach))
    return int(put_in_rows(memory, start, (x, y), most))


@jit
def trace_scan(see: View, memory: Row, cell: float, most: int) -> int:
    """Write what is seen ahead, thinned out and in rows, the nearest first, into ``memory["talk_cell"]``.

    Return how many cells that are, not more than ``most``.
    """
    rig, percept = see.rig, see.percept
    u, v = see.shared["x"] / cell, see.shared["y"] / cell
    start = Start(int(math.floor(u)) - HALF, int(math.floor(v)) - HALF)
    c, s = math.cos(percept["compass"]) / cell, math.sin(percept["compass"]) / cell
    unmark_all(memory)
    first, last = 0, rig.sensor.beams - 1
    if rig.sensor.field > 0:
        first, last = see.shared["view_first"], see.shared["view_last"]
    for n in range(first, last + 1):
        r = see.masked[n]
        if rig.cos[n] <= 0.0 or not (rig.sensor.range_min <= r < rig.sensor.range_max) or see.unseen[n] != 0:
            continue
        x, y = u + r * (c * rig.cos[n] - s * rig.sin[n]), v + r * (s * rig.cos[n] + c * rig.sin[n])
        mark(memory, int(math.floor(x)) - start.x, int(math.floor(y)) - start.y)
    found, x, y = nearest_mark(memory, HALF, HALF)
    return int(put_in_rows(memory, start, (x, y), most)) if found else 0


@jit
def unmark_all(memory: Row) -> None:
    """Empty the square of marked cells."""
    memory["scratch_n"] = max(memory["scratch_n"], BEHIND)
    for k in range(_SEEN):
        memory["scratch"][k] = ZERO


@jit_inline
def mark(memory: Row, x: int, y: int) -> None:
    """Mark a cell of the square; nothing beyond it."""
    if 0 <= x < 2 * HALF and 0 <= y < 2 * HALF:
        memory["scratch"][y * _ROW + x // WORD] |= bit(x & (WORD - 1))


@jit_inline
def apart(memory: Row) -> float:
    """Return how far told cells are from one another at least [cells]; everything told of is nearer to one than that.

    It is what told cells keep free: so nothing fits through what is told of.
    """
    return float(min(JOINED, max(1.0, memory["disc_r"][LEAST])))


@jit_inner
def _gather(see: View, memory: Row, cell: float, start: Start, terms: tuple[int, float]) -> tuple[int, int]:
    """Mark the cells of what is met in the middle of the square, from the near to the far; return the last one.

    It ends when ``terms[0]`` cells that are `apart` would tell of them all.
    """
    most, reach = terms
    here = Spot(see.shared["x"] / cell, see.shared["y"] / cell)
    least, cells = apart(memory) ** 2, memory["talk_cell"]
    first, last, n = 0, _meet(memory, HALF, HALF, 0), 0
    x, y = HALF, HALF
    while first < last:
        kx, ky = _queued(memory, first)
        ix, iy = start.x + kx, start.y + ky
        if abs(ix + 0.5 - here.u) > reach or abs(iy + 0.5 - here.v) > reach:
            _unmark(memory, kx, ky)
            first += 1
            continue
        if _is_apart(cells, n, (ix, iy), least):
            if n == most:
                break
            cells[n, 0], cells[n, 1] = ix, iy
            n += 1
        x, y = kx, ky
        first += 1
        for j in range(iy - JOINED, iy + JOINED + 1):
            row = things(memory, ix - JOINED, j, 2 * JOINED + 1)
            while row != ZERO:
                i = ix - JOINED + lowest(row)
                row = without_lowest(row)
                if not _is_marked(memory, i - start.x, j - start.y) and is_sure(see, memory, cell, i, j):
                    last = _meet(memory, i - start.x, j - start.y, last)
    while first < last:  # what was met, but not looked round at
        kx, ky = _queued(memory, first)
        _unmark(memory, kx, ky)
        first += 1
    return x, y


@jit_inner
def _meet(memory: Row, x: int, y: int, last: int) -> int:
    """Put a cell of the square into the queue that ends at ``last``, and mark it; return where the queue ends."""
    if not (0 <= x < 2 * HALF and 0 <= y < 2 * HALF) or last >= _MOST:
        return last
    mark(memory, x, y)
    at, shift = _SEEN + last // 4, np.uint64(16 * (last & 3))
    rest = memory["scratch"][at] & ~(np.uint64(0xFFFF) << shift)
    memory["scratch"][at] = rest | (np.uint64(y * 2 * HALF + x) << shift)
    return last + 1


@jit_inline
def _queued(memory: Row, k: int) -> tuple[int, int]:
    """Return the ``k``-th cell of the queue."""
    word = number((memory["scratch"][_SEEN + k // 4] >> np.uint64(16 * (k & 3))) & np.uint64(0xFFFF))
    return word % (2 * HALF), word // (2 * HALF)


@jit_inline
def _is_marked(memory: Row, x: int, y: int) -> bool:
    """Tell whether a cell of the square is marked; none is beyond it."""
    if not (0 <= x < 2 * HALF and 0 <= y < 2 * HALF):
        return False
    return bool(memory["scratch"][y * _ROW + x // WORD] & bit(x & (WORD - 1)))


@jit_inline
def _unmark(memory: Row, x: int, y: int) -> None:
    if 0 <= x < 2 * HALF and 0 <= y < 2 * HALF:
        memory["scratch"][y * _ROW + x // WORD] &= ~bit(x & (WORD - 1))


@jit_inline
def _is_apart(cells: np.ndarray, n: int, cell: tuple[int, int], least: float) -> bool:
    """Tell whether a cell is far enough from the first ``n`` that are told."""
    for k in range(n):
        dx, dy = cells[k, 0] - cell[0], cells[k, 1] - cell[1]
        if dx * dx + dy * dy < least:
            return False
    return True


@jit
def put_in_rows(memory: Row, start: Start, first: tuple[int, int], most: int) -> int:
    """Tell of the marked cells, beginning with ``first``: write cells `apart`, each the next one in the same direction.

    Return how many there are, not more than ``most``.
    """
    x, y = first
    dx, dy, n = 0, 0, 0
    found = True
    while found and n < most:
        memory["talk_cell"][n, 0], memory["talk_cell"][n, 1] = start.x + x, start.y + y
        n += 1
        _unmark_round(memory, x, y)
        found, to_x, to_y = _next(memory, x, y, (dx, dy))
        if not found:
            found, to_x, to_y = nearest_mark(memory, x, y)
        dx, dy, x, y = to_x - x, to_y - y, to_x, to_y
    return n


@jit_inner
def _unmark_round(memory: Row, x: int, y: int) -> None:
    """Take the cells away of which a told cell tells."""
    far = apart(memory)
    for j in range(-JOINED, JOINED + 1):
        for i in range(-JOINED, JOINED + 1):
            if i * i + j * j < far * far:
                _unmark(memory, x + i, y + j)


@jit_inner
def _next(memory: Row, x: int, y: int, step: tuple[int, int]) -> tuple[bool, int, int]:
    """Return which marked cell beside one is nearest to where the last step would lead again, and whether any is."""
    best, to_x, to_y = 2**30, x, y
    for j in range(y - JOINED, y + JOINED + 1):
        for i in range(x - JOINED, x + JOINED + 1):
            if _is_marked(memory, i, j):
                d = (i - x - step[0]) ** 2 + (j - y - step[1]) ** 2
                if d < best:
                    best, to_x, to_y = d, i, j
    return best < 2**30, to_x, to_y


@jit
def nearest_mark(memory: Row, x: float, y: float) -> tuple[bool, int, int]:
    """Return the marked cell nearest to one, and whether any is left."""
    best, to_x, to_y = float(2**30), 0, 0
    for j in range(2 * HALF):
        for w in range(_ROW):
            word = memory["scratch"][j * _ROW + w]
            while word != ZERO:
                i = w * WORD + lowest(word)
                word = without_lowest(word)
                d = (i - x) ** 2 + (j - y) ** 2
                if d < best:
                    best, to_x, to_y = d, i, j
    return best < 2**30, to_x, to_y
