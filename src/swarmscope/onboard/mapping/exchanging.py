"""Maps told without being asked for: what comparisons of what is worth telling need (``share=3``).

Robots that meet tell each other all that they know within reach, and then whatever is new: node by node the cells in
which something stands, square after square, the near ones first. What has been told is kept in a table; where more than
eight nodes have one place in it, the oldest is told again. Whoever sees somebody new begins anew, and before it is
forgotten. Who hears it keeps as much as of answers, 64 packets and 2048 cells.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.answering import is_sure
from swarmscope.onboard.mapping.cells import NODE, is_fine, row_of
from swarmscope.onboard.mapping.memory import SENT, WAYS
from swarmscope.onboard.mapping.pages import is_blocked
from swarmscope.onboard.mapping.telling import SMALL_M, TRIES, Talk, from_here, may_send, send
from swarmscope.onboard.mapping.tracing import BEHIND, HALF, Start, mark, nearest_mark, put_in_rows, unmark_all
from swarmscope.onboard.mapping.words import WORD, ZERO, Spot, bit, lowest, number, without_lowest
from swarmscope.onboard.percept import Row
from swarmscope.onboard.sharing.message import Head
from swarmscope.onboard.sharing.way_message import encode_closed, read_closed
from swarmscope.onboard.view import View

_SIDE = 2 * HALF
"""Cells along a side of a square that is told of at once."""
_NODES = _SIDE // NODE
_WORDS = _SIDE // WORD
_ROWS = BEHIND
"""Scratch behind the square: a bit for each node, ..."""
_LIST = _ROWS + _NODES
"""... and a list of nodes."""
FEW = 4
"""Nodes that are waited for: who told of each new one at once would fill the others' memories with headers."""
_EVEN = 0x9E3779B1
"""Spreads places over the table (Knuth's multiplicative hash)."""


@jit
def tell_map(see: View, memory: Row, talk: Talk, here: Spot) -> bool:
    """Tell everybody who may hear it of what has not been told yet, as much as a packet holds; return whether any was.

    The square in which the robot is comes first, then those round it.
    """
    if not may_send(see, memory):
        return False
    reach = talk.reach_m / talk.cell_m
    at_x, at_y = int(math.floor(here.u / _SIDE)), int(math.floor(here.v / _SIDE))
    far = int(math.ceil(reach / _SIDE))
    for ring in range(far + 1):
        for py in range(at_y - ring, at_y + ring + 1):
            for px in range(at_x - ring, at_x + ring + 1):
                on_ring = max(abs(px - at_x), abs(py - at_y)) == ring
                if on_ring and _tell_square(see, memory, talk, Start(px * _SIDE, py * _SIDE), reach):
                    return True
    return False


@jit
def begin_anew(memory: Row) -> None:
    """Tell of everything again: somebody has come who has not heard it."""
    for place in range(SENT // WAYS):
        for k in range(WAYS):
            memory["sent"][place, k] = 0


@jit_inner
def _tell_square(see: View, memory: Row, talk: Talk, start: Start, reach: float) -> bool:
    """Send what has not been told of a square, as much as a packet holds; return whether there was anything."""
    seq = (see.shared["seq"] + 1) & 0xFFFF
    head = Head(see.percept["id"], see.percept["boot"], seq, 0)
    data = see.out["out"][see.out["n_out"]]
    memory["scratch_n"] = max(memory["scratch_n"], _LIST + _NODES * _NODES)
    here = Spot(see.shared["x"] / talk.cell_m - start.x, see.shared["y"] / talk.cell_m - start.y)
    most, length, fits = talk.cells, 0, False
    for _ in range(TRIES):
        if not _mark_things(see, memory, talk.cell_m, start, reach):
            return False
        _unmark_small(memory, SMALL_M / talk.cell_m)
        if _unmark_told(memory, start) < FEW:
            return False
        _, x, y = nearest_mark(memory, here.u, here.v)
        n = put_in_rows(memory, start, (x, y), most)
        place = from_here(see, memory, n, talk.cell_m)
        length = encode_closed(head, place, memory["talk_cell"], n, data, talk.payload)
        most = read_closed(data, length, memory["talk_at"])
        fits = most >= n
        if fits:
            break
    if not fits or length == 0:
        return False
    _note_told(memory, start)
    see.shared["seq"] = seq
    memory["told"] += 1
    send(see, memory, talk, length)
    return True


@jit_inner
def _mark_things(see: View, memory: Row, cell: float, start: Start, reach: float) -> bool:
    """Mark what stands in a square for sure; return whether anything does."""
    u, v, some = see.shared["x"] / cell, see.shared["y"] / cell, False
    unmark_all(memory)
    for ky in range(start.y // NODE, start.y // NODE + _NODES):
        for kx in range(start.x // NODE, start.x // NODE + _NODES):
            ix, iy = NODE * kx, NODE * ky
            if abs(ix - u) > reach or abs(iy - v) > reach:
                continue
            if is_fine(memory, float(ix), float(iy)):
                some = _mark_node(see, memory, cell, start, (ix, iy)) or some
            elif is_blocked(memory, kx, ky) and is_sure(see, memory, cell, ix + NODE // 2, iy + NODE // 2):
                mark(memory, ix + NODE // 2 - start.x, iy + NODE // 2 - start.y)
                some = True
    return some


@jit_inner
def _mark_node(see: View, memory: Row, cell: float, start: Start, at: tuple[int, int]) -> bool:
    """Mark what stands for sure in a node of the fine layer that begins at a cell; return whether anything does."""
    some = False
    for iy in range(at[1], at[1] + NODE):
        row = row_of(memory, at[0], iy) & (bit(NODE) - bit(0))
        while row != ZERO:
            ix = at[0] + lowest(row)
            row = without_lowest(row)
            if is_sure(see, memory, cell, ix, iy):
                mark(memory, ix - start.x, iy - start.y)
                some = True
    return some


@jit_inner
def _unmark_told(memory: Row, start: Start) -> int:
    """Take away what has been told; return how many nodes are left, a bit for each in the scratch's rows."""
    left = 0
    for y in range(_NODES):
        memory["scratch"][_ROWS + y] = ZERO
        for x in range(_NODES):
            if _is_told(memory, start.x // NODE + x, start.y // NODE + y):
                _unmark_node(memory, x, y)
            elif _marks_of(memory, x, y) != ZERO:
                memory["scratch"][_ROWS + y] |= bit(x)
                left += 1
    return left


@jit_inner
def _note_told(memory: Row, start: Start) -> None:
    """Note the nodes that were left by `_unmark_told` and have no mark any more: all in them is told of."""
    for y in range(_NODES):
        row = memory["scratch"][_ROWS + y]
        while row != ZERO:
            x = lowest(row)
            row = without_lowest(row)
            if _marks_of(memory, x, y) == ZERO:
                kx, ky = start.x // NODE + x, start.y // NODE + y
                at = _at(kx, ky)
                for k in range(WAYS - 1, 0, -1):
                    memory["sent"][at, k] = memory["sent"][at, k - 1]
                memory["sent"][at, 0] = _name(kx, ky)


@jit_inner
def _unmark_small(memory: Row, small: float) -> None:
    """Take things away that are smaller along both axes, but for those at the square's edge, which may go on: they may
    be robots."""
    rows = memory["scratch"][_ROWS : _ROWS + _NODES]
    for y in range(_NODES):
        rows[y] = ZERO
        for x in range(_NODES):
            if _marks_of(memory, x, y) != ZERO:
                rows[y] |= bit(x)
    for y in range(_NODES):
        while rows[y] != ZERO:
            n, low_x, high_x, low_y, high_y = _thing_round(memory, rows, lowest(rows[y]), y)
            inside = low_x > 0 and high_x < _NODES - 1 and low_y > 0 and high_y < _NODES - 1
            if inside and NODE * max(high_x - low_x, high_y - low_y) < small:
                for k in range(n):
                    node = number(memory["scratch"][_LIST + k])
                    _unmark_node(memory, node % _NODES, node // _NODES)


@jit_inner
def _thing_round(memory: Row, rows: np.ndarray, x: int, y: int) -> tuple[int, int, int, int, int]:
    """Take a node and all that hang together with it out of ``rows`` and put them into a list.

    Return how many they are, and where they begin and end along both axes.
    """
    stack = memory["scratch"][_LIST : _LIST + _NODES * _NODES]
    rows[y] &= ~bit(x)
    stack[0] = np.uint64(y * _NODES + x)
    n, k, low_x, high_x, low_y, high_y = 1, 0, x, x, y, y
    while k < n:
        node = number(stack[k])
        kx, ky = node % _NODES, node // _NODES
        low_x, high_x, low_y, high_y = min(low_x, kx), max(high_x, kx), min(low_y, ky), max(high_y, ky)
        k += 1
        for j in range(max(0, ky - 1), min(_NODES, ky + 2)):
            for i in range(max(0, kx - 1), min(_NODES, kx + 2)):
                if rows[j] & bit(i) != ZERO:
                    rows[j] &= ~bit(i)
                    stack[n] = np.uint64(j * _NODES + i)
                    n += 1
    return n, low_x, high_x, low_y, high_y


@jit_inline
def _marks_of(memory: Row, x: int, y: int) -> np.uint64:
    """Return the marked cells of a node of the square."""
    found = ZERO
    for j in range(NODE):
        found |= memory["scratch"][(NODE * y + j) * _WORDS + NODE * x // WORD] >> np.uint64(NODE * x & (WORD - 1))
    return found & (bit(NODE) - bit(0))


@jit_inline
def _unmark_node(memory: Row, x: int, y: int) -> None:
    """Take the marks of a node of the square away."""
    for j in range(NODE):
        all_of_it = (bit(NODE) - bit(0)) << np.uint64(NODE * x & (WORD - 1))
        memory["scratch"][(NODE * y + j) * _WORDS + NODE * x // WORD] &= ~all_of_it


@jit_inner
def _is_told(memory: Row, kx: int, ky: int) -> bool:
    at, name, found = _at(kx, ky), _name(kx, ky), False
    for k in range(WAYS):
        found = found or number(memory["sent"][at, k]) == name
    return found


@jit_inner
def _name(kx: int, ky: int) -> int:
    """Return a node's name, not 0; they wrap round after 32768 nodes."""
    return (((ky & 0x7FFF) << 16) | (kx & 0xFFFF)) + 1


@jit_inner
def _at(kx: int, ky: int) -> int:
    """Return where in the table a node is kept."""
    return ((_name(kx, ky) * _EVEN) >> 16) % (SENT // WAYS)
