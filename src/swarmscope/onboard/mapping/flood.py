"""Ways where a search would take too many nodes: a flood that goes over 64 nodes at a time.

From the robot waves go over the nodes of the place layer, in turns to four and to eight neighbours, which is nearly as
far in all directions. Each node keeps the number of its wave modulo 6 in three bits: one step back from the goal is
always to a neighbour of the wave before. The way back is pulled taut as it is walked.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import point_segment_distance
from swarmscope.onboard.mapping.cells import FULL, LEAST, NODE, NODES, RIM, WIDE, is_fine, node_place, open_way
from swarmscope.onboard.mapping.heard import told_cell
from swarmscope.onboard.mapping.memory import CORNERS
from swarmscope.onboard.mapping.pages import NO_PAGE, PAGE_BITS
from swarmscope.onboard.mapping.words import ONE, WORD, ZERO, Spot, bit, lowest, number, without_lowest
from swarmscope.onboard.percept import Row

MARGIN = 4
"""Nodes beyond the goal."""
MOST_PAGES = 8
"""On a side."""
LABELS = 6
BLOCKED = 7
MOST_WAVES = 20_000


class Frame(NamedTuple):
    """What is flooded: its first node, and how many words wide and nodes high it is."""

    ox: int
    oy: int
    words: int
    height: int


@jit_inline
def _wide(wave: int) -> bool:
    """Tell whether a wave goes to eight neighbours: 5 of 12 do, the share that makes it a regular octagon."""
    return (5 * wave) % 12 < 5


@jit
def flood(memory: Row, u0: float, v0: float, u1: float, v1: float) -> bool:
    """Write a way from (u0, v0) to (u1, v1) [cells] into the memory's; return whether there is one.

    The memory holds no way afterwards if not.
    """
    memory["way_n"] = 0
    frame = _frame(memory, u0, v0, u1, v1)
    memory["scratch_n"] = max(memory["scratch_n"], _at(frame, 3, 0, 0))
    _block(memory, frame)
    start = _open_node(memory, frame, u0, v0)
    goal = _open_node(memory, frame, u1, v1)
    if start[0] < 0 or goal[0] < 0:
        return False
    waves = _spread(memory, frame, start, goal)
    return waves >= 0 and _walk_back(memory, frame, waves, goal, (Spot(u0, v0), Spot(u1, v1)))


@jit
def _frame(memory: Row, u0: float, v0: float, u1: float, v1: float) -> Frame:
    """Return the frame of all that is known, in whole pages, and of what was told, with room to go round that.

    Where that is more than the scratch holds, what is far from the robot is left out.
    """
    px, py = int(math.floor(u0 / NODE)) >> PAGE_BITS, int(math.floor(v0 / NODE)) >> PAGE_BITS
    west, east, south, north = px, px, py, py
    reach = WIDE // 2 // NODE
    for side in range(-1, 2, 2):
        for u, v in ((u0, v0), (u1, v1)):
            margin = reach if u == u0 else MARGIN
            kx, ky = _page_of(u, side * margin), _page_of(v, side * margin)
            west, east, south, north = min(west, kx), max(east, kx), min(south, ky), max(north, ky)
    for k in range(memory["pages_n"]):
        west, east = min(west, memory["page_x"][k]), max(east, memory["page_x"][k])
        south, north = min(south, memory["page_y"][k]), max(north, memory["page_y"][k])
    for a in range(memory["answers_n"]):
        box = memory["answer_box"][a]
        west, east = min(west, _page_of(box[0], -MARGIN)), max(east, _page_of(box[1], MARGIN))
        south, north = min(south, _page_of(box[2], -MARGIN)), max(north, _page_of(box[3], MARGIN))
    west, east = max(west, px - MOST_PAGES // 2), min(east, px + MOST_PAGES // 2 - 1)
    south, north = max(south, py - MOST_PAGES // 2), min(north, py + MOST_PAGES // 2 - 1)
    return Frame(west * WORD, south * WORD, east - west + 1, (north - south + 1) * WORD)


@jit_inline
def _page_of(at: float, nodes: int) -> int:
    """Return the number of the page so many nodes beyond a place [cells]."""
    return (int(math.floor(at / NODE)) + nodes) >> PAGE_BITS


@jit_inline
def _marks(frame: Frame) -> int:
    """Return how many words say in which words of nodes a wave is, a bit each; twice, for the last and the next."""
    return frame.words * (frame.height >> PAGE_BITS)


@jit_inline
def _at(frame: Frame, plane: int, y: int, w: int) -> int:
    return 2 * _marks(frame) + (plane * frame.height + y) * frame.words + w


@jit
def _block(memory: Row, frame: Frame) -> None:
    """Write which nodes cannot be gone over: label 7, all others 0."""
    scratch = memory["scratch"]
    for k in range(_at(frame, 3, 0, 0)):
        scratch[k] = ZERO
    _block_pages(memory, frame)
    x0, y0 = memory["west"] // NODE - frame.ox, memory["south"] // NODE - frame.oy
    for y in range(max(0, y0 + RIM), min(frame.height, y0 + NODES - RIM)):
        for x in range(max(0, x0 + RIM), min(frame.words * WORD, x0 + NODES - RIM)):
            open_here, _, _ = node_place(memory, frame.ox + x, frame.oy + y)
            for plane in range(3):
                at = _at(frame, plane, y, x >> 6)
                if open_here:
                    scratch[at] &= ~bit(x & (WORD - 1))
                else:
                    scratch[at] |= bit(x & (WORD - 1))
    for k in range(memory["stand_n"]):
        _close_round(memory, frame, memory["stand_u"][k], memory["stand_v"][k], memory["stand_r"][k])
    for k in range(memory["kept_n"]):
        _close_round(memory, frame, memory["kept_u"][k], memory["kept_v"][k], memory["kept_r"][k])
    _close_told(memory, frame)


@jit_inner
def _block_pages(memory: Row, frame: Frame) -> None:
    """Take over what the place layer has blocked, but for where less room would do if that is asked for."""
    for k in range(memory["pages_n"]):
        w, y0 = memory["page_x"][k] - (frame.ox >> PAGE_BITS), memory["page_y"][k] * WORD - frame.oy
        if 0 <= w < frame.words and 0 <= y0 < frame.height:
            for y in range(WORD):
                blocked = memory["rows"][k, y]
                if memory["room"] != FULL and memory["slim_at"][k] != NO_PAGE:
                    blocked &= ~memory["slim"][number(memory["slim_at"][k]) - 1, y]
                for plane in range(3):
                    memory["scratch"][_at(frame, plane, y0 + y, w)] = blocked


@jit_inner
def _close_round(memory: Row, frame: Frame, u: float, v: float, r: float) -> None:
    """Block the nodes within ``r`` of (u, v) [cells]."""
    for ky in range(int(math.ceil((v - r - 2) / NODE)), int(math.floor((v + r - 2) / NODE)) + 1):
        for kx in range(int(math.ceil((u - r - 2) / NODE)), int(math.floor((u + r - 2) / NODE)) + 1):
            x, y = kx - frame.ox, ky - frame.oy
            inside = 0 <= x < frame.words * WORD and 0 <= y < frame.height
            if inside and (NODE * kx + 2 - u) ** 2 + (NODE * ky + 2 - v) ** 2 < r * r:
                for plane in range(3):
                    memory["scratch"][_at(frame, plane, y, x >> 6)] |= bit(x & (WORD - 1))


@jit_inner
def _close_told(memory: Row, frame: Frame) -> None:
    """Block the nodes that are too near to told cells, and to the line between two that nothing gets through between.

    Without the lines a wall would leak between nodes.
    """
    r, first = memory["disc_r"][LEAST], 0
    for a in range(memory["answers_n"]):
        for k in range(first, first + memory["answer_n"][a]):
            u, v = told_cell(memory, k)
            wu, wv = u, v
            if k > first:
                wu, wv = told_cell(memory, k - 1)
                if (wu - u) ** 2 + (wv - v) ** 2 > 4.0 * r * r:
                    wu, wv = u, v
            _close_line(memory, frame, (wu, wv), (u, v), r)
        first += memory["answer_n"][a]


@jit_inner
def _close_line(memory: Row, frame: Frame, start: tuple[float, float], end: tuple[float, float], r: float) -> None:
    """Block the nodes within ``r`` of a line [cells]; those of the fine layer where they have been moved on to."""
    low_x, high_x = min(start[0], end[0]) - r - NODE, max(start[0], end[0]) + r + NODE
    low_y, high_y = min(start[1], end[1]) - r - NODE, max(start[1], end[1]) + r + NODE
    for ky in range(int(math.floor(low_y / NODE)), int(math.floor(high_y / NODE)) + 1):
        for kx in range(int(math.floor(low_x / NODE)), int(math.floor(high_x / NODE)) + 1):
            x, y = kx - frame.ox, ky - frame.oy
            if not (0 <= x < frame.words * WORD and 0 <= y < frame.height):
                continue
            u, v = float(NODE * kx + 2), float(NODE * ky + 2)
            if is_fine(memory, u, v):
                u, v = u + 2.0 * (memory["phase"] & 1), v + 2.0 * (memory["phase"] >> 1)
            if point_segment_distance(u, v, start[0], start[1], end[0], end[1]) < r:
                for plane in range(3):
                    memory["scratch"][_at(frame, plane, y, x >> 6)] |= bit(x & (WORD - 1))


@jit_inline
def _label(memory: Row, frame: Frame, x: int, y: int) -> int:
    """Return the label of a node, 0: not reached."""
    if x < 0 or y < 0 or x >= frame.words * WORD or y >= frame.height:
        return BLOCKED
    found = 0
    for plane in range(3):
        word = memory["scratch"][_at(frame, plane, y, x >> 6)]
        found |= number((word >> np.uint64(x & (WORD - 1))) & ONE) << plane
    return found


@jit
def _open_node(memory: Row, frame: Frame, u: float, v: float) -> tuple[int, int]:
    """Return the open node nearest to (u, v) [cells], (-1, -1): none is near; from beyond the frame, of its rim."""
    x0 = min(frame.words * WORD - 1, max(0, int(math.floor(u / NODE)) - frame.ox))
    y0 = min(frame.height - 1, max(0, int(math.floor(v / NODE)) - frame.oy))
    best, at_x, at_y = math.inf, -1, -1
    for y in range(y0 - 3, y0 + 4):
        for x in range(x0 - 3, x0 + 4):
            if _label(memory, frame, x, y) != 0:
                continue
            d = (NODE * (frame.ox + x) + 2 - u) ** 2 + (NODE * (frame.oy + y) + 2 - v) ** 2
            if d < best:
                best, at_x, at_y = d, x, y
    return at_x, at_y


@jit_inline
def _labelled(memory: Row, frame: Frame, y: int, w: int, label: int) -> np.uint64:
    """Return which of 64 nodes carry ``label``; none beyond the borders."""
    if w < 0 or w >= frame.words or y < 0 or y >= frame.height:
        return ZERO
    scratch = memory["scratch"]
    found = ~ZERO
    for plane in range(3):
        word = scratch[_at(frame, plane, y, w)]
        found &= word if (label >> plane) & 1 else ~word
    return found


@jit_inline
def _passable(memory: Row, frame: Frame, y: int, w: int) -> np.uint64:
    """Return which of 64 nodes are not blocked; none beyond the borders."""
    return ~_labelled(memory, frame, y, w, BLOCKED) if 0 <= w < frame.words and 0 <= y < frame.height else ZERO


@jit
def _spread(memory: Row, frame: Frame, start: tuple[int, int], goal: tuple[int, int]) -> int:
    """Let waves go out from a node; return the number of the one that reaches another, -1: none does."""
    scratch = memory["scratch"]
    _write_label(memory, frame, start[0], start[1], 1)
    if start == goal:
        return 0
    k = start[1] * frame.words + (start[0] >> 6)
    marks = _marks(frame)
    scratch[marks + (k >> 6)] |= bit(k & (WORD - 1))
    for wave in range(1, MOST_WAVES):
        now, some = marks * (wave & 1), False
        for m in range(marks):
            marked = scratch[now + m]
            scratch[now + m] = ZERO
            while marked != ZERO:
                some = _go_on(memory, frame, WORD * m + lowest(marked), wave) or some
                marked = without_lowest(marked)
        if not some:
            return -1
        if _label(memory, frame, goal[0], goal[1]) != 0:
            return wave
    return -1


@jit_inner
def _go_on(memory: Row, frame: Frame, k: int, wave: int) -> bool:
    """Let a wave go on from those nodes of word ``k``, counted row by row, that the last one has reached.

    Return whether it reaches new ones. Across a corner it goes only if one of the two nodes between is not blocked:
    nobody squeezes through between two that are.
    """
    y, w = k // frame.words, k % frame.words
    here = _labelled(memory, frame, y, w, (wave - 1) % LABELS + 1)
    some = _reach(memory, frame, y, w, (here << ONE) | (here >> ONE), wave)
    low, high = here & ONE, here >> np.uint64(WORD - 1)
    if low:
        some = _reach(memory, frame, y, w - 1, bit(WORD - 1), wave) or some
    if high:
        some = _reach(memory, frame, y, w + 1, ONE, wave) or some
    for other in range(y - 1, y + 2, 2):
        beside = here
        if _wide(wave):
            straight, along = here & _passable(memory, frame, other, w), _passable(memory, frame, y, w)
            beside |= (straight << ONE) | (straight >> ONE) | (((here << ONE) | (here >> ONE)) & along)
            if low and (straight & ONE or _passable(memory, frame, y, w - 1) >> np.uint64(WORD - 1)):
                some = _reach(memory, frame, other, w - 1, bit(WORD - 1), wave) or some
            if high and (straight >> np.uint64(WORD - 1) or _passable(memory, frame, y, w + 1) & ONE):
                some = _reach(memory, frame, other, w + 1, ONE, wave) or some
        some = _reach(memory, frame, other, w, beside, wave) or some
    return some


@jit
def _reach(memory: Row, frame: Frame, y: int, w: int, wanted: np.uint64, wave: int) -> bool:
    """Label those of some nodes of a word that are open and that no wave has reached; return whether there are any."""
    if w < 0 or w >= frame.words or y < 0 or y >= frame.height:
        return False
    scratch, plane, at = memory["scratch"], frame.words * frame.height, _at(frame, 0, y, w)
    new = wanted & ~(scratch[at] | scratch[at + plane] | scratch[at + 2 * plane])
    if new == ZERO:
        return False
    label = wave % LABELS + 1
    for one in range(3):
        if (label >> one) & 1:
            scratch[at + one * plane] |= new
    k = y * frame.words + w
    scratch[_marks(frame) * ((wave - 1) & 1) + (k >> 6)] |= bit(k & (WORD - 1))
    return True


@jit_inline
def _write_label(memory: Row, frame: Frame, x: int, y: int, label: int) -> None:
    for plane in range(3):
        if (label >> plane) & 1:
            memory["scratch"][_at(frame, plane, y, x >> 6)] |= bit(x & (WORD - 1))


@jit
def _walk_back(memory: Row, frame: Frame, waves: int, node: tuple[int, int], ends: tuple[Spot, Spot]) -> bool:
    """Write the way that the waves have found, pulled taut; the goal comes last, later corners than fit are left out.

    It ends in the ``node`` that wave number ``waves`` has reached; ``ends`` are start and goal.
    """
    x, y = node
    n = 0
    anchor = last = ends[1]
    for k in range(waves, -2, -1):
        here = ends[0]
        if k >= 0:
            _, u, v = node_place(memory, frame.ox + x, frame.oy + y)
            here = Spot(u, v)
        if last != anchor and not open_way(memory, here.u, here.v, anchor.u, anchor.v):
            n = _prepend(memory, n, anchor)
            anchor = last
        last = here
        if k > 0:
            x, y = _before(memory, frame, x, y, k)
            if x < 0:
                return False
    n = _prepend(memory, n, anchor)
    for k in range(n // 2):
        _swap(memory, k, n - 1 - k)
    memory["way_n"] = n
    memory["way_u"][n - 1], memory["way_v"][n - 1] = ends[1].u, ends[1].v
    return True


@jit_inner
def _prepend(memory: Row, n: int, spot: Spot) -> int:
    """Note one more corner, nearest to the goal first; those beyond the last place push out the first."""
    if n == CORNERS:
        for k in range(CORNERS - 1):
            memory["way_u"][k], memory["way_v"][k] = memory["way_u"][k + 1], memory["way_v"][k + 1]
        n -= 1
    memory["way_u"][n], memory["way_v"][n] = spot.u, spot.v
    return n + 1


@jit_inner
def _swap(memory: Row, i: int, j: int) -> None:
    u, v = memory["way_u"][i], memory["way_v"][i]
    memory["way_u"][i], memory["way_v"][i] = memory["way_u"][j], memory["way_v"][j]
    memory["way_u"][j], memory["way_v"][j] = u, v


@jit_inner
def _before(memory: Row, frame: Frame, x: int, y: int, wave: int) -> tuple[int, int]:
    """Return the neighbour from which wave ``wave`` came to node (x, y), (-1, -1): there is none."""
    label = (wave - 1) % LABELS + 1
    for k in range(4):
        ex, ey = (1, 0, -1, 0)[k], (0, 1, 0, -1)[k]
        if _label(memory, frame, x + ex, y + ey) == label:
            return x + ex, y + ey
    if _wide(wave):
        for k in range(4):
            ex, ey = (1, -1, -1, 1)[k], (1, 1, -1, -1)[k]
            shut = _label(memory, frame, x + ex, y) == BLOCKED and _label(memory, frame, x, y + ey) == BLOCKED
            if not shut and _label(memory, frame, x + ex, y + ey) == label:
                return x + ex, y + ey
    return -1, -1
