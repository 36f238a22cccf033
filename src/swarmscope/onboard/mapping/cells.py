"""The map: cells in which something stands, a bit each, in pages that are there only where something is.

Cells are squares of ``cell_m`` in the *odometry frame*: x east, y north as the robot's compass says, the origin where
it started. Page (px, py) holds 64 x 64 cells; the directory wraps round after 32 pages, so that what lies that far
away is forgotten when its place is wanted. Unknown is free.

``rows`` are kept per robot; ``memory`` is its row of ``MAP`` (``mapping/memory.py``).
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.words import ONE, WORD, ZERO, bit, window
from swarmscope.onboard.percept import Row

PAGES = 255
"""That there can be at once, 512 bytes each: at 0.125 m 130 m x 125 m."""
DIRECTORY = 32
NO_PAGE = 0
PAGE_BITS = 6
QUARTERS = 4
"""Discs are drawn for places to a quarter of a cell."""
DISC_ROWS = 20
"""Of cells that a disc may have at most."""


@jit_inline
def page_of(memory: Row, ix: int, iy: int) -> int:
    """Return the slot of the page that cell (ix, iy) lies in, -1: there is none, all of it is free."""
    px, py = ix >> PAGE_BITS, iy >> PAGE_BITS
    slot = np.int64(memory["page_at"][py & (DIRECTORY - 1), px & (DIRECTORY - 1)]) - 1
    if slot >= 0 and (memory["page_x"][slot] != px or memory["page_y"][slot] != py):
        return -1
    return slot


@jit_inline
def row_of(memory: Row, ix: int, iy: int) -> np.uint64:
    """Return the 64 cells of the page of (ix, iy) that lie in its row."""
    slot = page_of(memory, ix, iy)
    return memory["rows"][slot, iy & (WORD - 1)] if slot >= 0 else ZERO


@jit_inline
def is_set(memory: Row, ix: int, iy: int) -> bool:
    """Tell whether something stands in cell (ix, iy)."""
    return bool((row_of(memory, ix, iy) >> np.uint64(ix & (WORD - 1))) & ONE)


@jit
def set_cell(memory: Row, ix: int, iy: int) -> None:
    """Note that something stands in cell (ix, iy)."""
    slot = page_of(memory, ix, iy)
    if slot < 0:
        slot = _new_page(memory, ix >> PAGE_BITS, iy >> PAGE_BITS)
    memory["rows"][slot, iy & (WORD - 1)] |= bit(ix & (WORD - 1))


@jit_inline
def clear_cell(memory: Row, ix: int, iy: int) -> None:
    """Note that nothing stands in cell (ix, iy)."""
    slot = page_of(memory, ix, iy)
    if slot >= 0:
        memory["rows"][slot, iy & (WORD - 1)] &= ~bit(ix & (WORD - 1))


@jit
def _new_page(memory: Row, px: int, py: int) -> int:
    """Return the slot of a new, empty page: a free one, else that of the page farthest from this one."""
    at_y, at_x = py & (DIRECTORY - 1), px & (DIRECTORY - 1)
    slot = np.int64(memory["page_at"][at_y, at_x]) - 1
    if slot < 0 and memory["pages_n"] < PAGES:
        slot = memory["pages_n"]
        memory["pages_n"] += 1
    elif slot < 0:
        slot, farthest = 0, -1
        for k in range(PAGES):
            d = (memory["page_x"][k] - px) ** 2 + (memory["page_y"][k] - py) ** 2
            if d > farthest:
                slot, farthest = k, d
        memory["page_at"][memory["page_y"][slot] & (DIRECTORY - 1), memory["page_x"][slot] & (DIRECTORY - 1)] = NO_PAGE
    memory["page_at"][at_y, at_x] = slot + 1
    memory["page_x"][slot], memory["page_y"][slot] = px, py
    for k in range(WORD):
        memory["rows"][slot, k] = ZERO
    return slot


@jit
def forget_all(memory: Row) -> None:
    """Forget every cell."""
    for y in range(DIRECTORY):
        for x in range(DIRECTORY):
            memory["page_at"][y, x] = NO_PAGE
    memory["pages_n"] = 0


@jit
def draw_disc(memory: Row, radius: float) -> None:
    """Draw the disc of ``radius`` [cells]: the cells whose middle it holds, for a centre in each quarter of a cell."""
    half = min(DISC_ROWS // 2 - 1, int(math.ceil(radius)))
    memory["disc_half"] = half
    for qy in range(QUARTERS):
        for qx in range(QUARTERS):
            cx, cy = (qx + 0.5) / QUARTERS, (qy + 0.5) / QUARTERS
            for j in range(2 * half + 1):
                row = ZERO
                for i in range(2 * half + 1):
                    ex, ey = i - half + 0.5 - cx, j - half + 0.5 - cy
                    if ex * ex + ey * ey < radius * radius:
                        row |= bit(i)
                memory["disc"][qy, qx, j] = row


@jit_inline
def fits(memory: Row, u: float, v: float) -> bool:
    """Tell whether the disc fits at (u, v) [cells]: nothing stands in the cells that it holds."""
    ix, iy = int(math.floor(u)), int(math.floor(v))
    half = memory["disc_half"]
    x0, y0 = ix - half, iy - half
    qx, qy = int(QUARTERS * (u - ix)), int(QUARTERS * (v - iy))
    shift = x0 & (WORD - 1)
    if shift + 2 * half < WORD and (y0 & (WORD - 1)) + 2 * half < WORD:
        slot = page_of(memory, x0, y0)
        if slot < 0:
            return True
        first = y0 & (WORD - 1)
        for j in range(2 * half + 1):
            if (memory["rows"][slot, first + j] >> np.uint64(shift)) & memory["disc"][qy, qx, j]:
                return False
        return True
    return _fits_over_borders(memory, x0, y0, qx, qy)


@jit
def _fits_over_borders(memory: Row, x0: int, y0: int, qx: int, qy: int) -> bool:
    shift = x0 & (WORD - 1)
    for j in range(2 * memory["disc_half"] + 1):
        row = window(row_of(memory, x0, y0 + j), row_of(memory, x0 + WORD, y0 + j), shift)
        if row & memory["disc"][qy, qx, j]:
            return False
    return True


@jit_inner
def _in_the_way(memory: Row, u: float, v: float) -> bool:
    """Tell whether a robot that stands for long is in the way of a disc at (u, v) [cells]."""
    for k in range(memory["stand_n"]):
        ex, ey = u - memory["stand_u"][k], v - memory["stand_v"][k]
        if ex * ex + ey * ey < memory["stand_r"][k] ** 2:
            return True
    return False


@jit_inline
def is_open(memory: Row, u: float, v: float) -> bool:
    """Tell whether the robot may be at (u, v) [cells] by all that it knows."""
    return fits(memory, u, v) and not _in_the_way(memory, u, v)


@jit
def open_way(memory: Row, u0: float, v0: float, u1: float, v1: float) -> bool:
    """Tell whether the straight way between two places [cells] is open; where it begins does not count."""
    du, dv = u1 - u0, v1 - v0
    steps = int(math.ceil(math.sqrt(du * du + dv * dv)))
    for k in range(1, steps + 1):
        if not is_open(memory, u0 + du * k / steps, v0 + dv * k / steps):
            return False
    return True
