"""Whether the way of somebody who asks is closed by the own map, and by which cells for sure.

The way is closed where the least disc does not fit, and where, moved aside a little, it is barred close by. Told is
what the robot has seen itself; of what it has left behind, the middles of the nodes that are shut.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.mapping.cells import FULL, LEAST, NODE, ask_for, fits, is_fine, is_set, row_of
from swarmscope.onboard.mapping.evidence import is_passed
from swarmscope.onboard.mapping.pages import is_blocked, is_slim
from swarmscope.onboard.mapping.words import ZERO, Spot, bit, lowest, without_lowest
from swarmscope.onboard.percept import Row
from swarmscope.onboard.view import View

STRIDE = 2.0
"""Cells from place to place along a way."""
ASIDE = (-6.0, -3.0, 3.0, 6.0)
"""A way is closed where it is in itself, and moved aside by so many cells, ..."""
SLANTED = 12
"""... not more than so many strides before or behind: it may meet a wall at a slant."""
AT_WALL = 6
"""What closes a place is no more than so many cells from it."""


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
    """Tell whether nothing fits at a place of a way, and it is barred close by when it is moved aside a little."""
    if fits(memory, at.u, at.v):
        return False
    for side in ASIDE:
        if not _is_barred(memory, Leg(at.u - side * at.ev, at.v + side * at.eu, at.eu, at.ev)):
            return False
    return wall_at(see, memory, cell, (at.u, at.v))[0]


@jit_inner
def _is_barred(memory: Row, at: Leg) -> bool:
    """Tell whether nothing fits somewhere along a way, not far before or behind a place of it."""
    for k in range(2 * SLANTED + 1):
        along = STRIDE * (k - SLANTED)
        if not fits(memory, at.u + along * at.eu, at.v + along * at.ev):
            return True
    return False


@jit
def wall_at(see: View, memory: Row, cell: float, at: tuple[float, float]) -> tuple[bool, int, int]:
    """Return the cell nearest to a place in which something stands for sure, and whether there is one."""
    cx, cy = int(math.floor(at[0])), int(math.floor(at[1]))
    best, at_x, at_y = AT_WALL * AT_WALL + 1, 0, 0
    for iy in range(cy - AT_WALL, cy + AT_WALL + 1):
        row = things(memory, cx - AT_WALL, iy, 2 * AT_WALL + 1)
        while row != ZERO:
            ix = cx - AT_WALL + lowest(row)
            row = without_lowest(row)
            d = (ix - cx) ** 2 + (iy - cy) ** 2
            if d < best and is_sure(see, memory, cell, ix, iy):
                best, at_x, at_y = d, ix, iy
    return best <= AT_WALL * AT_WALL, at_x, at_y


@jit
def things(memory: Row, ix: int, iy: int, n: int) -> np.uint64:
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


@jit
def is_sure(see: View, memory: Row, cell: float, ix: int, iy: int) -> bool:
    """Tell whether what stands in a cell closes it to the least disc, too, for all that is known, and is not gone.

    What came back from the place layer is one cell a node; where the least disc did fit at the node, it says nothing.
    What moved on is in the map until the robot comes near, but seen to be gone from afar.
    """
    at_node = ix % NODE == NODE // 2 and iy % NODE == NODE // 2
    if at_node and is_slim(memory, ix // NODE, iy // NODE):
        return False
    return not is_passed(see, ix + 0.5 - see.shared["x"] / cell, iy + 0.5 - see.shared["y"] / cell, cell)
