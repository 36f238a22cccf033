"""The shortest way through the map, unknown counting as free: Lazy Theta* (Nash, Koenig, Tovey 2010) on every second
cell, for as long as it takes few nodes. What takes more is flooded (``mapping/flood.py``).

A node is one word: place, parent, whether it is closed, and the way to it in 64ths of a cell. As soon as the goal is
in sight of a node that comes out of the queue, the way over that node is the shortest that there is.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.cells import is_open, open_way
from swarmscope.onboard.mapping.memory import CORNERS
from swarmscope.onboard.percept import Row

STEP = 2
"""Cells from node to node."""
TABLE = 2048
MOST_NODES = 1400
QUEUE = 1024
ROOT = TABLE
NOT_FOUND, FOUND, TOO_MANY = range(3)
_FRACTION = 64.0
_BIAS = 1024
_ELEVEN, _TWELVE, _G_BITS = np.uint64(2047), np.uint64(4095), np.uint64(2**24 - 1)
_CLOSED, _USED, _FIRST = np.uint64(1 << 34), np.uint64(1 << 35), np.uint64(1 << 60)
_STEPS_X = np.array([1, 0, -1, 0, 1, -1, -1, 1])
_STEPS_Y = np.array([0, 1, 0, -1, 1, 1, -1, -1])


@jit_inline
def _node(x: int, y: int, parent: int, g: float) -> np.uint64:
    """Return the word of an open node."""
    return (
        np.uint64(x + _BIAS)
        | (np.uint64(y + _BIAS) << np.uint64(11))
        | (np.uint64(parent) << np.uint64(22))
        | _USED
        | (np.uint64(int(g * _FRACTION)) << np.uint64(36))
    )


@jit_inline
def _x(word: np.uint64) -> int:
    return np.int64(word & _ELEVEN) - _BIAS


@jit_inline
def _y(word: np.uint64) -> int:
    return np.int64((word >> np.uint64(11)) & _ELEVEN) - _BIAS


@jit_inline
def _parent(word: np.uint64) -> int:
    return np.int64((word >> np.uint64(22)) & _TWELVE)


@jit_inline
def _g(word: np.uint64) -> float:
    return float((word >> np.uint64(36)) & _G_BITS) / _FRACTION


@jit_inner
def _slot(memory: Row, x: int, y: int) -> int:
    """Return where node (x, y) is in the table, or the free place where it would be."""
    k = ((x * 73856093) ^ (y * 19349663)) & (TABLE - 1)
    while memory["scratch"][k] & _USED and (_x(memory["scratch"][k]) != x or _y(memory["scratch"][k]) != y):
        k = (k + 1) & (TABLE - 1)
    return k


@jit_inner
def _push(memory: Row, n: int, f: float, slot: int) -> None:
    """Put an entry into the queue of ``n``."""
    heap = memory["scratch"]
    entry = (np.uint64(int(f * _FRACTION)) << np.uint64(12)) | np.uint64(slot)
    k = n
    while k > 0:
        up = (k - 1) >> 1
        if heap[TABLE + up] <= entry:
            break
        heap[TABLE + k] = heap[TABLE + up]
        k = up
    heap[TABLE + k] = entry


@jit_inner
def _pop(memory: Row, n: int) -> int:
    """Take the best out of the queue of ``n``; return its slot."""
    heap = memory["scratch"]
    best = heap[TABLE]
    last = heap[TABLE + n - 1]
    k = 0
    while True:
        down = 2 * k + 1
        if down >= n - 1:
            break
        if down + 1 < n - 1 and heap[TABLE + down + 1] < heap[TABLE + down]:
            down += 1
        if last <= heap[TABLE + down]:
            break
        heap[TABLE + k] = heap[TABLE + down]
        k = down
    heap[TABLE + k] = last
    return np.int64(best & _TWELVE)


@jit
def shortest(memory: Row, u0: float, v0: float, u1: float, v1: float) -> int:
    """Write the way from (u0, v0) to (u1, v1) [cells] into the memory's; return FOUND, NOT_FOUND or TOO_MANY.

    The way holds its corners and (u1, v1); it is left as it was when none is found.
    """
    if open_way(memory, u0, v0, u1, v1):
        memory["way_n"], memory["way_u"][0], memory["way_v"][0] = 1, u1, v1
        return FOUND
    table = memory["scratch"]
    for k in range(TABLE):
        table[k] = np.uint64(0)
    memory["scratch_n"] = max(memory["scratch_n"], TABLE + QUEUE)
    ox, oy = int(round(u0 / STEP)), int(round(v0 / STEP))
    nodes, queue = 0, 0
    for strict in range(2):
        for y in range(-2, 3):
            for x in range(-2, 3):
                u, v = float(STEP * (ox + x)), float(STEP * (oy + y))
                if not is_open(memory, u, v) or (strict == 0 and not open_way(memory, u0, v0, u, v)):
                    continue
                g = math.sqrt((u - u0) ** 2 + (v - v0) ** 2)
                slot = _slot(memory, x, y)
                table[slot] = _node(x, y, ROOT, g) | _FIRST
                _push(memory, queue, g + math.sqrt((u - u1) ** 2 + (v - v1) ** 2), slot)
                nodes, queue = nodes + 1, queue + 1
        if nodes > 0:
            break
    while queue > 0:
        at = _pop(memory, queue)
        queue -= 1
        word = table[at]
        if word & _CLOSED:
            continue
        x, y = _x(word), _y(word)
        u, v = float(STEP * (ox + x)), float(STEP * (oy + y))
        parent = _parent(word)
        pu, pv, pg = u0, v0, 0.0
        if parent != ROOT:
            other = table[parent]
            pu, pv, pg = float(STEP * (ox + _x(other))), float(STEP * (oy + _y(other))), _g(other)
        if not (word & _FIRST or open_way(memory, pu, pv, u, v)):
            best, parent = math.inf, -1
            for k in range(8):
                near = _slot(memory, x + _STEPS_X[k], y + _STEPS_Y[k])
                if not table[near] & _CLOSED:
                    continue
                g = _g(table[near]) + math.sqrt(float(STEP * STEP * (_STEPS_X[k] ** 2 + _STEPS_Y[k] ** 2)))
                if g < best:
                    best, parent = g, near
            if parent < 0:
                continue
            other = table[parent]
            pu, pv, pg = float(STEP * (ox + _x(other))), float(STEP * (oy + _y(other))), _g(other)
        g = pg + math.sqrt((u - pu) ** 2 + (v - pv) ** 2)
        table[at] = _node(x, y, parent, g) | _CLOSED
        if open_way(memory, u, v, u1, v1):
            _write_way(memory, at, ox, oy, u1, v1)
            return FOUND
        for k in range(8):
            nx, ny = x + _STEPS_X[k], y + _STEPS_Y[k]
            if abs(nx) >= _BIAS or abs(ny) >= _BIAS:
                return TOO_MANY
            slot = _slot(memory, nx, ny)
            there = table[slot]
            if there & _CLOSED:
                continue
            nu, nv = float(STEP * (ox + nx)), float(STEP * (oy + ny))
            ng = pg + math.sqrt((nu - pu) ** 2 + (nv - pv) ** 2)
            if there & _USED:
                if _g(there) <= ng + 0.02:
                    continue
            elif not is_open(memory, nu, nv):
                continue
            else:
                nodes += 1
            if nodes > MOST_NODES or queue >= QUEUE:
                return TOO_MANY
            table[slot] = _node(nx, ny, parent, ng)
            _push(memory, queue, ng + math.sqrt((nu - u1) ** 2 + (nv - v1) ** 2), slot)
            queue += 1
    return NOT_FOUND


@jit_inner
def _write_way(memory: Row, at: int, ox: int, oy: int, u1: float, v1: float) -> None:
    """Write the way that ends over node ``at``."""
    n = 1
    k = at
    while k != ROOT:
        n += 1
        k = _parent(memory["scratch"][k])
    n = min(n, CORNERS)
    memory["way_n"] = n
    memory["way_u"][n - 1], memory["way_v"][n - 1] = u1, v1
    k, i = at, n - 2
    while k != ROOT:
        if i >= 0:
            word = memory["scratch"][k]
            memory["way_u"][i], memory["way_v"][i] = float(STEP * (ox + _x(word))), float(STEP * (oy + _y(word)))
        i -= 1
        k = _parent(memory["scratch"][k])
