"""Ways where a search would take too many nodes: a flood that goes over 64 nodes at a time.

From the robot a wave goes over the nodes (every second cell, wider apart where the place is larger than the scratch),
in turns to four and to eight neighbours, which is nearly as far in all directions. Each node keeps the number of its
wave modulo 6 in three bits: one step back from the goal is always to a neighbour of the wave before. The way back is
pulled taut as it is walked.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.cells import NODE, NODES, PAGE_BITS, RIM, WIDE, node_place, open_way
from swarmscope.onboard.mapping.memory import CORNERS
from swarmscope.onboard.mapping.words import ONE, WORD, ZERO, bit
from swarmscope.onboard.percept import Row

MARGIN = 4
"""Nodes beyond the goal."""
MOST_PAGES = 8
"""On a side."""
LABELS = 6
BLOCKED = 7
MOST_WAVES = 20_000
ROWS_ON = MOST_PAGES
"""Words that say which rows the last wave has reached."""


@jit_inline
def _wide(wave: int) -> bool:
    """Tell whether a wave goes to eight neighbours: 5 of 12 do, the share that makes it a regular octagon."""
    return (5 * wave) % 12 < 5


@jit
def flood(memory: Row, u0: float, v0: float, u1: float, v1: float) -> bool:
    """Write a way from (u0, v0) to (u1, v1) [cells] into the memory's; return whether there is one."""
    ox, oy, words, height = _frame(memory, u0, v0, u1, v1)
    memory["scratch_n"] = max(memory["scratch_n"], 3 * words * height + 2 * ROWS_ON)
    _block(memory, ox, oy, words, height)
    sx, sy = _open_node(memory, u0, v0, ox, oy, words, height)
    gx, gy = _open_node(memory, u1, v1, ox, oy, words, height)
    if sx < 0 or gx < 0:
        return False
    waves = _spread(memory, sx, sy, gx, gy, words, height)
    if waves < 0:
        return False
    return _walk_back(memory, waves, gx, gy, ox, oy, words, height, u0, v0, u1, v1)


@jit
def _frame(memory: Row, u0: float, v0: float, u1: float, v1: float) -> tuple[int, int, int, int]:
    """Return the node at the corner of all that is known, in whole pages, how many words wide and nodes high it is.

    Where that is more than the scratch holds, what is far from the robot is left out.
    """
    px, py = int(math.floor(u0 / NODE)) >> PAGE_BITS, int(math.floor(v0 / NODE)) >> PAGE_BITS
    west, east, south, north = px, px, py, py
    reach = WIDE // 2 // NODE
    for side in range(-1, 2, 2):
        for u, v in ((u0, v0), (u1, v1)):
            margin = reach if u == u0 else MARGIN
            kx = (int(math.floor(u / NODE)) + side * margin) >> PAGE_BITS
            ky = (int(math.floor(v / NODE)) + side * margin) >> PAGE_BITS
            west, east, south, north = min(west, kx), max(east, kx), min(south, ky), max(north, ky)
    for k in range(memory["pages_n"]):
        west, east = min(west, memory["page_x"][k]), max(east, memory["page_x"][k])
        south, north = min(south, memory["page_y"][k]), max(north, memory["page_y"][k])
    west, east = max(west, px - MOST_PAGES // 2), min(east, px + MOST_PAGES // 2 - 1)
    south, north = max(south, py - MOST_PAGES // 2), min(north, py + MOST_PAGES // 2 - 1)
    return west * WORD, south * WORD, east - west + 1, (north - south + 1) * WORD


@jit_inline
def _at(plane: int, y: int, w: int, words: int, height: int) -> int:
    return 2 * ROWS_ON + (plane * height + y) * words + w


@jit
def _block(memory: Row, ox: int, oy: int, words: int, height: int) -> None:
    """Write which nodes cannot be gone over: label 7, all others 0."""
    scratch = memory["scratch"]
    for k in range(2 * ROWS_ON + 3 * words * height):
        scratch[k] = ZERO
    for k in range(memory["pages_n"]):
        w, y0 = memory["page_x"][k] - (ox >> PAGE_BITS), memory["page_y"][k] * WORD - oy
        if 0 <= w < words and 0 <= y0 < height:
            for y in range(WORD):
                for plane in range(3):
                    scratch[_at(plane, y0 + y, w, words, height)] = memory["rows"][k, y]
    x0, y0 = memory["west"] // NODE - ox, memory["south"] // NODE - oy
    for y in range(max(0, y0 + RIM), min(height, y0 + NODES - RIM)):
        for x in range(max(0, x0 + RIM), min(words * WORD, x0 + NODES - RIM)):
            open_here, _, _ = node_place(memory, ox + x, oy + y)
            for plane in range(3):
                at = _at(plane, y, x >> 6, words, height)
                if open_here:
                    scratch[at] &= ~bit(x & (WORD - 1))
                else:
                    scratch[at] |= bit(x & (WORD - 1))
    for k in range(memory["stand_n"]):
        _close_round(memory, memory["stand_u"][k], memory["stand_v"][k], memory["stand_r"][k], ox, oy, words, height)


@jit_inner
def _close_round(memory: Row, u: float, v: float, r: float, ox: int, oy: int, words: int, height: int) -> None:
    """Block the nodes within ``r`` of (u, v) [cells]."""
    for ky in range(int(math.ceil((v - r - 2) / NODE)), int(math.floor((v + r - 2) / NODE)) + 1):
        for kx in range(int(math.ceil((u - r - 2) / NODE)), int(math.floor((u + r - 2) / NODE)) + 1):
            inside = 0 <= kx - ox < words * WORD and 0 <= ky - oy < height
            if inside and (NODE * kx + 2 - u) ** 2 + (NODE * ky + 2 - v) ** 2 < r * r:
                for plane in range(3):
                    memory["scratch"][_at(plane, ky - oy, (kx - ox) >> 6, words, height)] |= bit((kx - ox) & (WORD - 1))


@jit_inline
def _label(memory: Row, x: int, y: int, words: int, height: int) -> int:
    """Return the label of a node, 0: not reached."""
    if x < 0 or y < 0 or x >= words * WORD or y >= height:
        return BLOCKED
    found = 0
    for plane in range(3):
        found |= np.int64((memory["scratch"][_at(plane, y, x >> 6, words, height)] >> np.uint64(x & (WORD - 1))) & ONE) << plane
    return found


@jit
def _open_node(
    memory: Row, u: float, v: float, ox: int, oy: int, words: int, height: int
) -> tuple[int, int]:
    """Return the open node nearest to (u, v) [cells], (-1, -1) where none is near."""
    x0, y0 = int(math.floor(u / NODE)) - ox, int(math.floor(v / NODE)) - oy
    best, at_x, at_y = math.inf, -1, -1
    for y in range(y0 - 3, y0 + 4):
        for x in range(x0 - 3, x0 + 4):
            if _label(memory, x, y, words, height) != 0:
                continue
            d = (NODE * (ox + x) + 2 - u) ** 2 + (NODE * (oy + y) + 2 - v) ** 2
            if d < best:
                best, at_x, at_y = d, x, y
    return at_x, at_y


@jit_inline
def _labelled(memory: Row, y: int, w: int, label: int, words: int, height: int) -> np.uint64:
    """Return which of 64 nodes carry ``label``; none beyond the borders."""
    if w < 0 or w >= words or y < 0 or y >= height:
        return ZERO
    scratch = memory["scratch"]
    found = ~ZERO
    for plane in range(3):
        word = scratch[_at(plane, y, w, words, height)]
        found &= word if (label >> plane) & 1 else ~word
    return found


@jit_inline
def _passable(memory: Row, y: int, w: int, words: int, height: int) -> np.uint64:
    """Return which of 64 nodes are not blocked; none beyond the borders."""
    return ~_labelled(memory, y, w, BLOCKED, words, height) if 0 <= w < words and 0 <= y < height else ZERO


@jit_inline
def _widened(left: np.uint64, here: np.uint64, right: np.uint64) -> np.uint64:
    """Return 64 nodes with those beside them, given the 64 to the left and to the right."""
    return here | (here << ONE) | (here >> ONE) | (left >> np.uint64(63)) | (right << np.uint64(63))


@jit_inline
def _beside(memory: Row, y: int, w: int, label: int, words: int, height: int) -> np.uint64:
    """Return which of 64 nodes carry ``label`` or lie left or right of one that does."""
    return _widened(
        _labelled(memory, y, w - 1, label, words, height),
        _labelled(memory, y, w, label, words, height),
        _labelled(memory, y, w + 1, label, words, height),
    )


@jit_inline
def _across(memory: Row, y: int, other: int, w: int, label: int, words: int, height: int) -> np.uint64:
    """Return which of 64 nodes of row ``y`` lie across a corner from one of row ``other`` that carries ``label``.

    One of the two nodes between must not be blocked: nobody squeezes through between two that are.
    """
    first = _beside(memory, other, w, label, words, height) & _passable(memory, other, w, words, height)
    then = _widened(
        _labelled(memory, other, w - 1, label, words, height) & _passable(memory, y, w - 1, words, height),
        _labelled(memory, other, w, label, words, height) & _passable(memory, y, w, words, height),
        _labelled(memory, other, w + 1, label, words, height) & _passable(memory, y, w + 1, words, height),
    )
    return first | then


@jit
def _spread(memory: Row, sx: int, sy: int, gx: int, gy: int, words: int, height: int) -> int:
    """Let waves go out from node (sx, sy); return the number of the one that reaches (gx, gy), -1: none does."""
    scratch = memory["scratch"]
    _write_label(memory, sx, sy, 1, words, height)
    if sx == gx and sy == gy:
        return 0
    scratch[sy >> 6] = bit(sy & (WORD - 1))
    low, high = sy, sy
    for wave in range(1, MOST_WAVES):
        before, label = (wave - 1) % LABELS + 1, wave % LABELS + 1
        wide = _wide(wave)
        on, off = ROWS_ON * ((wave - 1) & 1), ROWS_ON * (wave & 1)
        first, last = max(0, low - 1), min(height - 1, high + 1)
        low, high = height, -1
        for k in range(ROWS_ON):
            scratch[off + k] = ZERO
        for y in range(first, last + 1):
            if not (_is_on(memory, on, y - 1) or _is_on(memory, on, y) or _is_on(memory, on, y + 1)):
                continue
            some = ZERO
            for w in range(words):
                reached = _beside(memory, y, w, before, words, height)
                if wide:
                    reached |= _across(memory, y, y - 1, w, before, words, height)
                    reached |= _across(memory, y, y + 1, w, before, words, height)
                else:
                    reached |= _labelled(memory, y - 1, w, before, words, height)
                    reached |= _labelled(memory, y + 1, w, before, words, height)
                if reached == ZERO:
                    continue
                at = _at(0, y, w, words, height)
                plane = words * height
                reached &= ~(scratch[at] | scratch[at + plane] | scratch[at + 2 * plane])
                for k in range(3):
                    if (label >> k) & 1:
                        scratch[at + k * plane] |= reached
                some |= reached
            if some != ZERO:
                low, high = min(low, y), max(high, y)
                scratch[off + (y >> 6)] |= bit(y & (WORD - 1))
        if high < 0:
            return -1
        if _label(memory, gx, gy, words, height) != 0:
            return wave
    return -1


@jit_inline
def _is_on(memory: Row, base: int, y: int) -> bool:
    if y < 0 or y >= ROWS_ON * WORD:
        return False
    return bool((memory["scratch"][base + (y >> 6)] >> np.uint64(y & (WORD - 1))) & ONE)


@jit_inline
def _write_label(memory: Row, x: int, y: int, label: int, words: int, height: int) -> None:
    for plane in range(3):
        if (label >> plane) & 1:
            memory["scratch"][_at(plane, y, x >> 6, words, height)] |= bit(x & (WORD - 1))


@jit
def _walk_back(
    memory: Row, waves: int, gx: int, gy: int, ox: int, oy: int, words: int, height: int,
    u0: float, v0: float, u1: float, v1: float,
) -> bool:  # fmt: skip
    """Write the way that the waves have found, pulled taut; the goal comes last, later corners than fit are left out."""
    n = 0
    anchor_u, anchor_v = u1, v1
    last_u, last_v = u1, v1
    x, y = gx, gy
    for k in range(waves, -1, -1):
        _, u, v = node_place(memory, ox + x, oy + y)
        if not open_way(memory, anchor_u, anchor_v, u, v) and (last_u != anchor_u or last_v != anchor_v):
            n = _prepend(memory, n, anchor_u, anchor_v)
            anchor_u, anchor_v = last_u, last_v
        last_u, last_v = u, v
        if k > 0:
            x, y = _before(memory, x, y, k, words, height)
            if x < 0:
                return False
    if not open_way(memory, anchor_u, anchor_v, u0, v0):
        n = _prepend(memory, n, anchor_u, anchor_v)
        anchor_u, anchor_v = last_u, last_v
    n = _prepend(memory, n, anchor_u, anchor_v)
    for k in range(n // 2):
        _swap(memory, k, n - 1 - k)
    memory["way_n"] = n
    if memory["way_u"][n - 1] != u1 or memory["way_v"][n - 1] != v1:
        memory["way_u"][n - 1], memory["way_v"][n - 1] = u1, v1
    return True


@jit_inner
def _prepend(memory: Row, n: int, u: float, v: float) -> int:
    """Note one more corner, nearest to the goal first; those beyond the last place push out the first."""
    if n == CORNERS:
        for k in range(CORNERS - 1):
            memory["way_u"][k], memory["way_v"][k] = memory["way_u"][k + 1], memory["way_v"][k + 1]
        n -= 1
    memory["way_u"][n], memory["way_v"][n] = u, v
    return n + 1


@jit_inner
def _swap(memory: Row, i: int, j: int) -> None:
    u, v = memory["way_u"][i], memory["way_v"][i]
    memory["way_u"][i], memory["way_v"][i] = memory["way_u"][j], memory["way_v"][j]
    memory["way_u"][j], memory["way_v"][j] = u, v


@jit_inner
def _before(memory: Row, x: int, y: int, wave: int, words: int, height: int) -> tuple[int, int]:
    """Return the neighbour from which wave ``wave`` came to node (x, y), (-1, -1): there is none."""
    label = (wave - 1) % LABELS + 1
    for k in range(4):
        ex, ey = (1, 0, -1, 0)[k], (0, 1, 0, -1)[k]
        if _label(memory, x + ex, y + ey, words, height) == label:
            return x + ex, y + ey
    if _wide(wave):
        for k in range(4):
            ex, ey = (1, -1, -1, 1)[k], (1, 1, -1, -1)[k]
            between = (
                _label(memory, x + ex, y, words, height) == BLOCKED and _label(memory, x, y + ey, words, height) == BLOCKED
            )
            if not between and _label(memory, x + ex, y + ey, words, height) == label:
                return x + ex, y + ey
    return -1, -1
