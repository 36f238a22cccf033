"""What a robot tells who asks whether its way is closed: the cells of its own map that close it, thinned out.

The way is closed where the least disc fits neither on it nor a little beside it. From what stands there the answer goes
on along the wall, both ways, as far as the packet holds: who knows only where a way ends tries the place beside it
next. Told is what the robot has seen itself; of what it has left behind, the middles of the nodes that are shut.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.cells import FULL, LEAST, NODE, ask_for, fits, is_fine, is_set, row_of
from swarmscope.onboard.mapping.evidence import is_passed
from swarmscope.onboard.mapping.pages import is_blocked, is_slim
from swarmscope.onboard.mapping.words import WORD, ZERO, Spot, bit, lowest, number, without_lowest
from swarmscope.onboard.percept import Row
from swarmscope.onboard.view import View

STRIDE = 2.0
"""Cells from place to place along a way."""
ASIDE = 3.0
"""A way is closed where it is so many cells beside it, twice as many, and in itself."""
AT_WALL = 6
"""What closes a place is no more than so many cells from it."""
APART = 3.0
"""Told cells are so far from one another at least [cells]: nothing fits between two neighbours."""
JOINED = 4
"""What is so many cells from a cell along either axis belongs to the same thing: nobody gets through between."""
_HALF = 64
"""Cells either side of where the wall was met that are looked at."""
_SEEN = 2 * _HALF * 2 * _HALF // WORD
_MOST = 4096


@jit
def closed_place(
    see: View, memory: Row, cell: float, corners: np.ndarray, ways: tuple[int, float]
) -> tuple[bool, float, float]:
    """Return whether the way through ``corners (n, 2)`` [cells] is closed near to the robot, and where.

    ``ways``: how many corners there are, and how far from the robot [cells] they are looked at.
    """
    n, reach = ways
    here = Spot(see.shared["x"] / cell, see.shared["y"] / cell)
    ask_for(memory, LEAST)
    found, at_u, at_v = False, 0.0, 0.0
    for k in range(n - 1):
        au, av, bu, bv = corners[k, 0], corners[k, 1], corners[k + 1, 0], corners[k + 1, 1]
        length = math.sqrt((bu - au) ** 2 + (bv - av) ** 2)
        if not 0.0 < length < 1e6:
            continue
        eu, ev = (bu - au) / length, (bv - av) / length
        at = STRIDE
        while at < length and not found:
            u, v = au + at * eu, av + at * ev
            at += STRIDE
            if (u - here.u) ** 2 + (v - here.v) ** 2 > reach * reach:
                continue
            if _is_walled(see, memory, cell, Leg(u, v, eu, ev)):
                found, at_u, at_v = True, u, v
        if found:
            break
    ask_for(memory, FULL)
    return found, at_u, at_v


class Leg(NamedTuple):
    """A place of a way [cells], and where the way leads there."""

    u: float
    v: float
    eu: float
    ev: float


@jit_inner
def _is_walled(see: View, memory: Row, cell: float, at: Leg) -> bool:
    """Tell whether nothing fits at a place of a way, nor beside it."""
    for k in range(5):
        aside = ASIDE * (k - 2)
        if fits(memory, at.u - aside * at.ev, at.v + aside * at.eu):
            return False
    return _wall_at(see, memory, cell, (at.u, at.v))[0]


@jit_inner
def _wall_at(see: View, memory: Row, cell: float, at: tuple[float, float]) -> tuple[bool, int, int]:
    """Return the cell nearest to a place in which something stands for sure, and whether there is one."""
    cx, cy = int(math.floor(at[0])), int(math.floor(at[1]))
    best, at_x, at_y = AT_WALL * AT_WALL + 1, 0, 0
    for iy in range(cy - AT_WALL, cy + AT_WALL + 1):
        row = _things(memory, cx - AT_WALL, iy, 2 * AT_WALL + 1)
        while row != ZERO:
            ix = cx - AT_WALL + lowest(row)
            row = without_lowest(row)
            d = (ix - cx) ** 2 + (iy - cy) ** 2
            if d < best and _is_sure(see, memory, cell, ix, iy):
                best, at_x, at_y = d, ix, iy
    return best <= AT_WALL * AT_WALL, at_x, at_y


@jit_inner
def _things(memory: Row, ix: int, iy: int, n: int) -> np.uint64:
    """Return in which of ``n`` cells of a row something stands: beyond the fine layer, in the middles of shut nodes."""
    if is_fine(memory, float(ix), float(iy)) and is_fine(memory, float(ix + n), float(iy)):
        return row_of(memory, ix, iy) & (bit(n) - bit(0))
    row = ZERO
    if iy % NODE == NODE // 2:
        first = (NODE // 2 - ix) % NODE
        for k in range(first, n, NODE):
            if is_fine(memory, float(ix + k), float(iy)):
                row |= bit(k) if is_set(memory, ix + k, iy) else ZERO
            elif is_blocked(memory, (ix + k) // NODE, iy // NODE):
                row |= bit(k)
    return row


@jit_inner
def _is_sure(see: View, memory: Row, cell: float, ix: int, iy: int) -> bool:
    """Tell whether what stands in a cell closes it to the least disc, too, for all that is known, and is not gone.

    What came back from the place layer is one cell a node; where the least disc did fit at the node, it says nothing.
    What moved on is in the map until the robot comes near, but seen to be gone from afar.
    """
    at_node = ix % NODE == NODE // 2 and iy % NODE == NODE // 2
    if at_node and is_slim(memory, ix // NODE, iy // NODE):
        return False
    return not is_passed(see, ix + 0.5 - see.shared["x"] / cell, iy + 0.5 - see.shared["y"] / cell, cell)


@jit
def trace(see: View, memory: Row, cell: float, place: tuple[float, float], terms: tuple[int, float]) -> int:
    """Write what closes a place into ``memory["talk_cell"]``, nearest to it first; return how many.

    ``terms``: how many at most, and how far [cells] from the robot along an axis.
    """
    most, reach = terms
    here = Spot(see.shared["x"] / cell, see.shared["y"] / cell)
    found, sx, sy = _wall_at(see, memory, cell, place)
    if not found:
        return 0
    scratch = memory["scratch"]
    memory["scratch_n"] = max(memory["scratch_n"], _SEEN + _MOST)
    for k in range(_SEEN):
        scratch[k] = ZERO
    first, last, n = 0, 0, 0
    last = _meet(memory, (sx, sy), (sx, sy), last)
    while first < last and n < most:
        word = number(scratch[_SEEN + first])
        first += 1
        ix, iy = sx - _HALF + (word & 127), sy - _HALF + (word >> 7)
        if abs(ix + 0.5 - here.u) > reach or abs(iy + 0.5 - here.v) > reach:
            continue
        if _is_apart(memory, n, ix, iy):
            memory["talk_cell"][n, 0], memory["talk_cell"][n, 1] = ix, iy
            n += 1
        for y in range(iy - JOINED, iy + JOINED + 1):
            row = _things(memory, ix - JOINED, y, 2 * JOINED + 1)
            while row != ZERO:
                x = ix - JOINED + lowest(row)
                row = without_lowest(row)
                if _is_sure(see, memory, cell, x, y):
                    last = _meet(memory, (sx, sy), (x, y), last)
    return n


@jit_inner
def _meet(memory: Row, start: tuple[int, int], cell: tuple[int, int], last: int) -> int:
    """Put a cell into the queue that ends at ``last`` if it has not been there yet; return where the queue ends."""
    x, y = cell[0] - start[0] + _HALF, cell[1] - start[1] + _HALF
    if not (0 <= x < 2 * _HALF and 0 <= y < 2 * _HALF) or last >= _MOST:
        return last
    at = (y * 2 * _HALF + x) // WORD
    if memory["scratch"][at] & bit(x & (WORD - 1)):
        return last
    memory["scratch"][at] |= bit(x & (WORD - 1))
    memory["scratch"][_SEEN + last] = np.uint64(y * 128 + x)
    return last + 1


@jit_inline
def _is_apart(memory: Row, n: int, ix: int, iy: int) -> bool:
    """Tell whether a cell is far enough from the first ``n`` that are told."""
    for k in range(n):
        dx, dy = memory["talk_cell"][k, 0] - ix, memory["talk_cell"][k, 1] - iy
        if dx * dx + dy * dy < APART * APART:
            return False
    return True


@jit
def put_in_a_row(memory: Row, n: int) -> None:
    """Order the first ``n`` told cells so that each is the nearest to the one before: steps get short."""
    cells = memory["talk_cell"]
    _swap(memory, 0, n - 1)
    for k in range(1, n):
        best, at = 2**40, k
        for j in range(k, n):
            d = (cells[j, 0] - cells[k - 1, 0]) ** 2 + (cells[j, 1] - cells[k - 1, 1]) ** 2
            if d < best:
                best, at = d, j
        _swap(memory, k, at)


@jit_inner
def _swap(memory: Row, i: int, j: int) -> None:
    cells = memory["talk_cell"]
    x, y = cells[i, 0], cells[i, 1]
    cells[i, 0], cells[i, 1] = cells[j, 0], cells[j, 1]
    cells[j, 0], cells[j, 1] = x, y
