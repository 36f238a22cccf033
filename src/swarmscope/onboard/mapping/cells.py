"""The map: where something stands, in two layers, in the frame of the robot's odometry and compass.

*Fine layer*: cells of ``cell_m``, a bit each, in a square of 256 x 256 cells that moves with the robot. Of these it is
asked whether the robot's disc fits at a place, to a quarter of a cell.
*Place layer*: all that the square has left behind. A bit for each node of a grid four cells wide says whether the disc
did not fit there, a second one whether the least one did, or the robot's body has been there. It is kept in pages of
64 x 64 nodes that are there only where something is; the directory wraps round after 16 pages, so that what lies that
far away is forgotten when its place is wanted.

Unknown is free. All places are in cells. ``memory`` is a robot's row of ``MAP`` (``mapping/memory.py``).
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.heard import is_told_closed
from swarmscope.onboard.mapping.pages import PAGE_BITS, block, forget_pages, is_blocked, is_slim
from swarmscope.onboard.mapping.words import ONE, WORD, ZERO, bit, number, window
from swarmscope.onboard.percept import Row

WIDE = 256
"""Cells on a side of the fine layer."""
WIDE_WORDS = WIDE // WORD
NODE = 4
"""Cells from node to node of the place layer; node (kx, ky) lies at (4 kx + 2, 4 ky + 2)."""
NODES = WIDE // NODE
LEAP = 4 * WIDE
"""Who is suddenly so many cells from where it was begins a new fine layer: its odometry has failed."""
RIM = 2
"""Nodes along the rim of the fine layer that are still asked of the place layer: discs there reach beyond it."""
QUARTERS = 4
"""Discs are drawn for places to a quarter of a cell."""
STRIDE = 2.0
"""Cells from disc to disc along a way: what lies between two sticks out of both by a tenth of a cell."""
LEAST_RADIUS = 0.5 * NODE + 0.1
"""Of a disc: a smaller one would fit between two nodes either side of a wall."""
FULL, LESS, LEAST = range(3)
"""How much room is asked for: what is wanted, what the guard keeps, or what a body takes that just gets through."""
ROOMS = 3
DISCS = 2
"""Drawn at once: the first, and that of the room that was last asked for."""
PHASES = 4
HALF_DIAGONAL = math.sqrt(0.5)
"""What stands in a cell may be so far from its middle."""
BESIDE = 5
_BESIDE_X, _BESIDE_Y = np.array([0, 1, -1, 0, 0]), np.array([0, 0, 0, 1, -1])
DISC_ROWS = 2 * NODE * RIM + 1
"""Of cells that a disc may have at most."""


@jit_inline
def is_near(memory: Row, ix: int, iy: int) -> bool:
    """Tell whether a cell lies in the fine layer."""
    return bool(0 <= ix - memory["west"] < WIDE and 0 <= iy - memory["south"] < WIDE)


@jit_inline
def row_of(memory: Row, ix: int, iy: int) -> np.uint64:
    """Return the 64 cells of the fine layer's row ``iy`` that begin at ``ix``."""
    row, word = iy & (WIDE - 1), (ix >> PAGE_BITS) & (WIDE_WORDS - 1)
    return window(memory["fine"][row, word], memory["fine"][row, (word + 1) & (WIDE_WORDS - 1)], ix & (WORD - 1))


@jit_inline
def is_set(memory: Row, ix: int, iy: int) -> bool:
    """Tell whether something stands in a cell of the fine layer."""
    word = memory["fine"][iy & (WIDE - 1), (ix >> PAGE_BITS) & (WIDE_WORDS - 1)]
    return bool((word >> np.uint64(ix & (WORD - 1))) & ONE)


@jit_inline
def set_cell(memory: Row, ix: int, iy: int) -> None:
    """Note that something stands in a cell of the fine layer."""
    memory["fine"][iy & (WIDE - 1), (ix >> PAGE_BITS) & (WIDE_WORDS - 1)] |= bit(ix & (WORD - 1))


@jit_inline
def clear_cell(memory: Row, ix: int, iy: int) -> None:
    """Note that nothing stands in a cell of the fine layer."""
    memory["fine"][iy & (WIDE - 1), (ix >> PAGE_BITS) & (WIDE_WORDS - 1)] &= ~bit(ix & (WORD - 1))


@jit
def is_shut(memory: Row, kx: int, ky: int) -> bool:
    """Tell whether node (kx, ky) of the place layer is closed to a robot that asks for as much room as it does now."""
    return is_blocked(memory, kx, ky) and not (memory["room"] != FULL and is_slim(memory, kx, ky))


@jit
def forget_all(memory: Row) -> None:
    """Forget everything."""
    forget_pages(memory)
    _empty_fine_layer(memory)


@jit_inner
def _empty_fine_layer(memory: Row) -> None:
    for y in range(WIDE):
        for w in range(WIDE_WORDS):
            memory["fine"][y, w] = ZERO


@jit
def move_fine_layer(memory: Row, ix: int, iy: int) -> None:
    """Let the fine layer follow the robot to cell (ix, iy), node by node.

    What leaves it goes to the place layer; of what comes in, a blocked node becomes one cell, which blocks the same.
    """
    away = max(abs(ix - memory["west"] - WIDE // 2), abs(iy - memory["south"] - WIDE // 2))
    if memory["settled"] == 0 or away > LEAP:
        memory["settled"] = 1
        memory["west"], memory["south"] = NODE * ((ix // NODE) - NODES // 2), NODE * ((iy // NODE) - NODES // 2)
        _empty_fine_layer(memory)
    while ix // NODE - memory["west"] // NODE > NODES // 2:
        _shift(memory, 1, 0)
    while ix // NODE - memory["west"] // NODE < NODES // 2 - 1:
        _shift(memory, -1, 0)
    while iy // NODE - memory["south"] // NODE > NODES // 2:
        _shift(memory, 0, 1)
    while iy // NODE - memory["south"] // NODE < NODES // 2 - 1:
        _shift(memory, 0, -1)


@jit
def _shift(memory: Row, ex: int, ey: int) -> None:
    """Move the fine layer by one node along (ex, ey), one of the four directions."""
    out = RIM if ex + ey > 0 else NODES - 1 - RIM  # the line of nodes that leaves what is asked of the fine layer
    x0, y0 = memory["west"] // NODE, memory["south"] // NODE
    for k in range(RIM, NODES - RIM):
        kx, ky = (x0 + out, y0 + k) if ex != 0 else (x0 + k, y0 + out)
        fits_here = _any_fits(memory, kx, ky, _beside(memory))
        slim = not fits_here and is_slim(memory, kx, ky)
        if not fits_here and not slim:
            ask_for(memory, LEAST)
            slim = _any_fits(memory, kx, ky, 1.0)
            ask_for(memory, FULL)
        block(memory, kx, ky, not fits_here, slim)
    if memory["forget_n"] > 0:
        _forget_behind(memory, ex, ey)
    first = 0 if ex + ey > 0 else NODES - 1  # the line that leaves the layer
    for k in range(NODES):
        kx, ky = (x0 + first, y0 + k) if ex != 0 else (x0 + k, y0 + first)
        for iy in range(NODE * ky, NODE * ky + NODE):
            for ix in range(NODE * kx, NODE * kx + NODE):
                clear_cell(memory, ix, iy)
    memory["west"] += NODE * ex
    memory["south"] += NODE * ey
    x0, y0 = x0 + ex, y0 + ey
    last = NODES - 1 if ex + ey > 0 else 0  # the line that comes in
    for k in range(NODES):
        kx, ky = (x0 + last, y0 + k) if ex != 0 else (x0 + k, y0 + last)
        if is_blocked(memory, kx, ky):
            set_cell(memory, NODE * kx + 2, NODE * ky + 2)


@jit_inline
def _remembered(memory: Row) -> int:
    """Return how many nodes away along x or y the place layer is remembered, where not all of it is."""
    return max(number(memory["forget_n"]), NODES // 2 - RIM)


@jit_inner
def _forget_behind(memory: Row, ex: int, ey: int) -> None:
    """Forget the line of nodes that a step along (ex, ey) leaves farther behind than is remembered."""
    n = _remembered(memory)
    x0, y0 = memory["west"] // NODE + NODES // 2, memory["south"] // NODE + NODES // 2
    behind = -n if ex + ey > 0 else n - 1
    for k in range(-n, n):
        kx, ky = (x0 + behind, y0 + k) if ex != 0 else (x0 + k, y0 + behind)
        block(memory, kx, ky, False, False)


@jit_inner
def _is_forgotten(memory: Row, kx: int, ky: int) -> bool:
    """Tell whether a node is so far away that it is not remembered."""
    if memory["forget_n"] == 0:
        return False
    n = _remembered(memory)
    x, y = kx - memory["west"] // NODE - NODES // 2, ky - memory["south"] // NODE - NODES // 2
    return not (-n <= x < n and -n <= y < n)


@jit_inner
def _beside(memory: Row) -> float:
    """Return how far from a node a robot that is at it may be [cells]; of two either side of a wall one stays shut."""
    spare: float = memory["disc_r"][memory["room"]] - LEAST_RADIUS
    return min(1.0, math.floor(QUARTERS * spare) / QUARTERS)


@jit_inner
def _any_fits(memory: Row, kx: int, ky: int, aside: float) -> bool:
    """Tell whether the disc fits at a node or ``aside`` [cells] of it."""
    for k in range(BESIDE if aside > 0.0 else 1):
        if _disc_fits(memory, NODE * kx + 2 + aside * _BESIDE_X[k], NODE * ky + 2 + aside * _BESIDE_Y[k]):
            return True
    return False


@jit
def block_round(memory: Row, u: float, v: float) -> None:
    """Block the nodes of the place layer from which something at (u, v), beyond the fine layer, is too near."""
    r, less = memory["disc_r"][FULL], memory["disc_r"][LESS]
    for ky in range(int(math.ceil((v - r - 2) / NODE)), int(math.floor((v + r - 2) / NODE)) + 1):
        for kx in range(int(math.ceil((u - r - 2) / NODE)), int(math.floor((u + r - 2) / NODE)) + 1):
            d2 = (NODE * kx + 2 - u) ** 2 + (NODE * ky + 2 - v) ** 2
            if d2 < r * r and not _is_forgotten(memory, kx, ky):
                slim = d2 >= less * less and (is_slim(memory, kx, ky) or not is_blocked(memory, kx, ky))
                block(memory, kx, ky, True, slim)


@jit
def draw_discs(memory: Row, full: float, less: float) -> None:
    """Draw the discs: of the radius [cells] that is wanted, of the one that the guard keeps, and the least."""
    full = max(LEAST_RADIUS, full)
    less = min(full, max(LEAST_RADIUS, less))
    memory["disc_r"][FULL], memory["disc_r"][LESS] = full, less
    memory["disc_r"][LEAST] = max(LEAST_RADIUS, less - HALF_DIAGONAL)
    memory["disc_half"] = min(DISC_ROWS // 2, int(math.ceil(full)))
    _draw_disc(memory, FULL)
    _draw_disc(memory, LESS)


@jit
def ask_for(memory: Row, room: int) -> None:
    """Ask for so much room from now on."""
    memory["room"] = room
    if room != FULL and memory["disc_of"] != room:
        _draw_disc(memory, room)


@jit_inner
def _draw_disc(memory: Row, room: int) -> None:
    """Draw a disc: the cells whose middle it holds, for a centre in each quarter of a cell."""
    half, radius, at = memory["disc_half"], memory["disc_r"][room], min(room, 1)
    if at > 0:
        memory["disc_of"] = room
    for qy in range(QUARTERS):
        for qx in range(QUARTERS):
            cx, cy = (qx + 0.5) / QUARTERS, (qy + 0.5) / QUARTERS
            for j in range(2 * half + 1):
                row = ZERO
                for i in range(2 * half + 1):
                    ex, ey = i - half + 0.5 - cx, j - half + 0.5 - cy
                    if ex * ex + ey * ey < radius * radius:
                        row |= bit(i)
                memory["disc"][at, qy, qx, j] = row


@jit_inline
def _disc_fits(memory: Row, u: float, v: float) -> bool:
    """Tell whether nothing stands in the cells that the disc holds at (u, v), within the fine layer."""
    ix, iy = int(math.floor(u)), int(math.floor(v))
    half = memory["disc_half"]
    x0, y0 = ix - half, iy - half
    qx, qy, room = int(QUARTERS * (u - ix)), int(QUARTERS * (v - iy)), 0 if memory["room"] == FULL else 1
    shift = x0 & (WORD - 1)
    word = (x0 >> PAGE_BITS) & (WIDE_WORDS - 1)
    if shift + 2 * half < WORD:
        for j in range(2 * half + 1):
            row = memory["fine"][(y0 + j) & (WIDE - 1), word] >> np.uint64(shift)
            if row & np.uint64(memory["disc"][room, qy, qx, j]):
                return False
        return True
    taken = ZERO
    for j in range(2 * half + 1):
        taken |= row_of(memory, x0, y0 + j) & np.uint64(memory["disc"][room, qy, qx, j])
    return bool(taken == ZERO)


@jit_inline
def is_fine(memory: Row, u: float, v: float) -> bool:
    """Tell whether a place is one of which the fine layer is asked."""
    ex, ey = u - memory["west"], v - memory["south"]
    rim = float(NODE * RIM)
    return bool(rim <= ex < WIDE - rim and rim <= ey < WIDE - rim)


@jit_inline
def fits(memory: Row, u: float, v: float) -> bool:
    """Tell whether the disc fits at (u, v) by the map."""
    if is_fine(memory, u, v):
        return _disc_fits(memory, u, v) or (memory["room"] != FULL and _was_slim(memory, u, v))
    west, east = int(math.floor(u - 1.0)) // NODE, int(math.floor(u + 1.0)) // NODE
    south, north = int(math.floor(v - 1.0)) // NODE, int(math.floor(v + 1.0)) // NODE
    # none leaks through between two nodes that touch at a corner
    return not (
        is_shut(memory, west, south)
        or is_shut(memory, east, north)
        or is_shut(memory, west, north)
        or is_shut(memory, east, south)
    )


@jit_inner
def _was_slim(memory: Row, u: float, v: float) -> bool:
    """Tell whether less room did at the node nearest to a place when the fine layer last left it.

    What comes back into it is one cell a node, between which less room does not tell a gap from a wall.
    """
    return is_slim(memory, int(math.floor(u)) // NODE, int(math.floor(v)) // NODE)


@jit_inner
def _in_the_way(memory: Row, u: float, v: float) -> bool:
    """Tell whether a robot that stands, a place kept closed, or what others have told is in the way at (u, v)."""
    for k in range(memory["stand_n"]):
        ex, ey = u - memory["stand_u"][k], v - memory["stand_v"][k]
        if ex * ex + ey * ey < memory["stand_r"][k] ** 2:
            return True
    for k in range(memory["kept_n"]):
        ex, ey = u - memory["kept_u"][k], v - memory["kept_v"][k]
        if ex * ex + ey * ey < memory["kept_r"][k] ** 2:
            return True
    return is_told_closed(memory, u, v)


@jit_inline
def is_open(memory: Row, u: float, v: float) -> bool:
    """Tell whether the robot may be at (u, v) by all that it knows."""
    return fits(memory, u, v) and not _in_the_way(memory, u, v)


@jit_inline
def fits_seen(memory: Row, u: float, v: float) -> bool:
    """Tell whether the disc fits at (u, v) by the cells of the fine layer alone, whoever stands there."""
    return is_fine(memory, u, v) and _disc_fits(memory, u, v)


@jit
def is_seen_open(memory: Row, u: float, v: float) -> bool:
    """Tell whether the robot may be at (u, v) by the cells of the fine layer alone."""
    return fits_seen(memory, u, v) and not _in_the_way(memory, u, v)


@jit_inline
def node_place(memory: Row, kx: int, ky: int) -> tuple[bool, float, float]:
    """Return whether the robot may be at node (kx, ky) or a cell beside it, and where.

    A gap that is hardly wider than the robot lies between the nodes more often than not. The nodes of the fine layer
    may be moved on by half of the way to the next (``phase`` 1 to 3): then they lie where gaps were missed.
    """
    u, v = float(NODE * kx + 2), float(NODE * ky + 2)
    if is_fine(memory, u, v):
        u, v = u + 2.0 * (memory["phase"] & 1), v + 2.0 * (memory["phase"] >> 1)
    else:
        return not is_shut(memory, kx, ky) and not _in_the_way(memory, u, v), u, v
    aside = _beside(memory)
    for k in range(BESIDE if aside > 0.0 else 1):
        pu, pv = u + aside * _BESIDE_X[k], v + aside * _BESIDE_Y[k]
        if _disc_fits(memory, pu, pv) and not _in_the_way(memory, pu, pv):
            return True, pu, pv
    slim = memory["room"] != FULL and is_slim(memory, kx, ky) and not _in_the_way(memory, u, v)
    return slim, u, v


@jit
def open_way(memory: Row, u0: float, v0: float, u1: float, v1: float) -> bool:
    """Tell whether the straight way between two places is open; where it begins does not count."""
    du, dv = u1 - u0, v1 - v0
    length = math.sqrt(du * du + dv * dv)
    if length <= 0.0:
        return True
    du, dv = du / length, dv / length
    at = 0.0
    while at < length:
        at = min(length, at + STRIDE)
        if not is_open(memory, u0 + at * du, v0 + at * dv):
            return False
    return True
