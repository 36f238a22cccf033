"""The shortest way through the map, unknown counting as free: Lazy Theta* (Nash, Koenig, Tovey 2010) on every second
cell, for as long as it takes few nodes. What takes more is flooded (``mapping/flood.py``).

A node is one word: place, parent, whether it is closed, and the way to it in 64ths of a cell. As soon as the goal is
in sight of a node that comes out of the queue, the way over that node is the shortest that there is.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.cells import is_open, open_way
from swarmscope.onboard.mapping.memory import CORNERS
from swarmscope.onboard.mapping.words import number
from swarmscope.onboard.percept import Row

STEP = 2
"""Cells from node to node."""
TABLE = 2048
MOST_NODES = 1400
QUEUE = 1024
ROOT = TABLE
"""The parent of those that are in sight of the start."""
NOT_FOUND, FOUND, TOO_MANY = range(3)
_FRACTION = 64.0
_SHORTER = 0.02
"""A way that is shorter by less [cells] is none: words hold 64ths."""
_BIAS = 1024
_ELEVEN, _TWELVE, _G_BITS = np.uint64(2047), np.uint64(4095), np.uint64(2**24 - 1)
_CLOSED, _USED, _FIRST = np.uint64(1 << 34), np.uint64(1 << 35), np.uint64(1 << 60)
_STEPS_X = np.array([1, 0, -1, 0, 1, -1, -1, 1])
_STEPS_Y = np.array([0, 1, 0, -1, 1, 1, -1, -1])


class Trip(NamedTuple):
    """From where to where [cells], and the node from which all others are counted."""

    u0: float
    v0: float
    u1: float
    v1: float
    ox: int
    oy: int


@jit
def shortest(memory: Row, u0: float, v0: float, u1: float, v1: float) -> int:
    """Write the way from (u0, v0) to (u1, v1) [cells] into the memory's; return FOUND, NOT_FOUND or TOO_MANY.

    The way holds its corners and (u1, v1); it is left as it was when none is found.
    """
    if open_way(memory, u0, v0, u1, v1):
        memory["way_n"], memory["way_u"][0], memory["way_v"][0] = 1, u1, v1
        return FOUND
    trip = Trip(u0, v0, u1, v1, int(round(u0 / STEP)), int(round(v0 / STEP)))
    memory["scratch_n"] = max(memory["scratch_n"], TABLE + QUEUE)
    _begin(memory, trip)
    while memory["queue_n"] > 0:
        at = _pop(memory)
        if memory["scratch"][at] & _CLOSED or not _settle(memory, trip, at):
            continue
        u, v = _spot(trip, _x(memory["scratch"][at]), _y(memory["scratch"][at]))
        if open_way(memory, u, v, u1, v1):
            _write_way(memory, trip, at)
            return FOUND
        if not _go_on(memory, trip, at):
            return TOO_MANY
    return NOT_FOUND


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
    return number(word & _ELEVEN) - _BIAS


@jit_inline
def _y(word: np.uint64) -> int:
    return number((word >> np.uint64(11)) & _ELEVEN) - _BIAS


@jit_inline
def _parent(word: np.uint64) -> int:
    return number((word >> np.uint64(22)) & _TWELVE)


@jit_inline
def _g(word: np.uint64) -> float:
    return float((word >> np.uint64(36)) & _G_BITS) / _FRACTION


@jit_inline
def _spot(trip: Trip, x: int, y: int) -> tuple[float, float]:
    """Return where node (x, y) lies [cells]."""
    return float(STEP * (trip.ox + x)), float(STEP * (trip.oy + y))


@jit_inline
def _reached(memory: Row, trip: Trip, slot: int) -> tuple[float, float, float]:
    """Return where a parent lies, and how long the way to it is [cells]."""
    if slot == ROOT:
        return trip.u0, trip.v0, 0.0
    word = memory["scratch"][slot]
    u, v = _spot(trip, _x(word), _y(word))
    return u, v, _g(word)


@jit_inner
def _slot(memory: Row, x: int, y: int) -> int:
    """Return where node (x, y) is in the table, or the free place where it would be."""
    k = ((x * 73856093) ^ (y * 19349663)) & (TABLE - 1)
    while memory["scratch"][k] & _USED and (_x(memory["scratch"][k]) != x or _y(memory["scratch"][k]) != y):
        k = (k + 1) & (TABLE - 1)
    return k


@jit_inner
def _push(memory: Row, f: float, slot: int) -> None:
    """Put an entry into the queue."""
    heap = memory["scratch"]
    entry = (np.uint64(int(f * _FRACTION)) << np.uint64(12)) | np.uint64(slot)
    k = memory["queue_n"]
    memory["queue_n"] += 1
    while k > 0:
        up = (k - 1) >> 1
        if heap[TABLE + up] <= entry:
            break
        heap[TABLE + k] = heap[TABLE + up]
        k = up
    heap[TABLE + k] = entry


@jit_inner
def _pop(memory: Row) -> int:
    """Take the best out of the queue; return its slot."""
    heap = memory["scratch"]
    memory["queue_n"] -= 1
    n = memory["queue_n"]
    best, last = heap[TABLE], heap[TABLE + n]
    k = 0
    while True:
        down = 2 * k + 1
        if down >= n:
            break
        if down + 1 < n and heap[TABLE + down + 1] < heap[TABLE + down]:
            down += 1
        if last <= heap[TABLE + down]:
            break
        heap[TABLE + k] = heap[TABLE + down]
        k = down
    heap[TABLE + k] = last
    return number(best & _TWELVE)


@jit_inner
def _begin(memory: Row, trip: Trip) -> None:
    """Empty table and queue; open the nodes round the start that are in sight, else those that are open at all."""
    for k in range(TABLE):
        memory["scratch"][k] = np.uint64(0)
    memory["nodes_n"], memory["queue_n"] = 0, 0
    for strict in range(2):
        for k in range(25):
            x, y = k % 5 - 2, k // 5 - 2
            u, v = _spot(trip, x, y)
            if not is_open(memory, u, v) or (strict == 0 and not open_way(memory, trip.u0, trip.v0, u, v)):
                continue
            g = math.sqrt((u - trip.u0) ** 2 + (v - trip.v0) ** 2)
            slot = _slot(memory, x, y)
            memory["scratch"][slot] = _node(x, y, ROOT, g) | _FIRST
            _push(memory, g + math.sqrt((u - trip.u1) ** 2 + (v - trip.v1) ** 2), slot)
            memory["nodes_n"] += 1
        if memory["nodes_n"] > 0:
            return


@jit_inner
def _settle(memory: Row, trip: Trip, at: int) -> bool:
    """Close a node: from the parent that it was given, if that is in sight, else from the best one beside it."""
    word = memory["scratch"][at]
    x, y, parent = _x(word), _y(word), _parent(word)
    u, v = _spot(trip, x, y)
    pu, pv, pg = _reached(memory, trip, parent)
    if not (word & _FIRST or open_way(memory, pu, pv, u, v)):
        best, parent = math.inf, -1
        for k in range(8):
            near = _slot(memory, x + _STEPS_X[k], y + _STEPS_Y[k])
            g = _g(memory["scratch"][near]) + STEP * math.sqrt(float(_STEPS_X[k] ** 2 + _STEPS_Y[k] ** 2))
            if memory["scratch"][near] & _CLOSED and g < best:
                best, parent = g, near
        if parent < 0:
            return False
        pu, pv, pg = _reached(memory, trip, parent)
    memory["scratch"][at] = _node(x, y, parent, pg + math.sqrt((u - pu) ** 2 + (v - pv) ** 2)) | _CLOSED
    return True


@jit_inner
def _go_on(memory: Row, trip: Trip, at: int) -> bool:
    """Open the nodes round a closed one, as if its parent saw them; return whether there was room for all."""
    word = memory["scratch"][at]
    parent = _parent(word)
    pu, pv, pg = _reached(memory, trip, parent)
    for k in range(8):
        x, y = _x(word) + _STEPS_X[k], _y(word) + _STEPS_Y[k]
        if abs(x) >= _BIAS or abs(y) >= _BIAS or memory["nodes_n"] >= MOST_NODES or memory["queue_n"] >= QUEUE:
            return False
        slot = _slot(memory, x, y)
        there = memory["scratch"][slot]
        if there & _CLOSED:
            continue
        u, v = _spot(trip, x, y)
        g = pg + math.sqrt((u - pu) ** 2 + (v - pv) ** 2)
        if there & _USED:
            if _g(there) <= g + _SHORTER:
                continue
        elif not is_open(memory, u, v):
            continue
        else:
            memory["nodes_n"] += 1
        memory["scratch"][slot] = _node(x, y, parent, g)
        _push(memory, g + math.sqrt((u - trip.u1) ** 2 + (v - trip.v1) ** 2), slot)
    return True


@jit_inner
def _write_way(memory: Row, trip: Trip, at: int) -> None:
    """Write the way that ends over node ``at``; of more corners than fit the later ones are left out."""
    n, k = 0, at
    while k != ROOT:
        n += 1
        k = _parent(memory["scratch"][k])
    k, i = at, n - 1
    while k != ROOT:
        word = memory["scratch"][k]
        if i < CORNERS - 1:
            memory["way_u"][i], memory["way_v"][i] = _spot(trip, _x(word), _y(word))
        i -= 1
        k = _parent(word)
    n = min(n, CORNERS - 1)
    memory["way_u"][n], memory["way_v"][n] = trip.u1, trip.v1
    memory["way_n"] = n + 1
