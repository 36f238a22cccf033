"""Ways through gaps that the guard lets pass and the margin does not: gone when they are shorter by enough.

Maps err by half a cell, so that a gap which is just wide enough is closed by them as often as open: it is looked for
with the least room, and whether the body gets through is asked at each narrow place, a little to either side.

Among trees such a gap leads on, beside the furniture of a room into a corner. A robot tells the one from the other by
what has become of its ways so far: where they have turned out longer and longer, it wants more for its trouble.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.cells import FULL, LEAST, LESS, ask_for, is_open, is_seen_open
from swarmscope.onboard.mapping.way import copy_way, goal_place, search_way, way_length
from swarmscope.onboard.mapping.words import Spot
from swarmscope.onboard.percept import Row

STEP = 1.0
"""Cells between places at which the width of a way is looked at."""
BEGINS = 2.0
"""So far from the robot [cells]: it may stand in a narrow place."""
ASIDE = 0.75
"""The middle of a gap may lie so far beside the way along either axis [cells]."""
TRUSTS, WARY = 0.3, 0.45
"""A robot whose way has become longer than the straight one by this share begins to be wary, and is so altogether."""


class Terms(NamedTuple):
    """On what terms a narrow gap is gone through."""

    gain: float
    """What it has to save [cells]."""
    wary: float
    """And by a wary robot so many times the way to the gap and ..."""
    least: float
    """... this [cells]."""


@jit
def note_gone(memory: Row, here: Spot, goal: Spot) -> None:
    """Count how far the robot has gone, cell by cell."""
    if memory["straight"] == 0.0:
        memory["straight"] = math.sqrt((goal.u - here.u) ** 2 + (goal.v - here.v) ** 2)
        memory["gone_u"], memory["gone_v"] = here.u, here.v
    d2 = (memory["gone_u"] - here.u) ** 2 + (memory["gone_v"] - here.v) ** 2
    if d2 > 1.0:
        memory["gone"] += math.sqrt(d2)
        memory["gone_u"], memory["gone_v"] = here.u, here.v


@jit
def find_tighter(memory: Row, here: Spot, goal: Spot, terms: Terms) -> None:
    """Leave the way for one with less room, if there is one that is shorter by enough and the body gets through.

    Nobody squeezes past robots that stand: they are waited for, or gone round.
    """
    length, n = way_length(memory, here), memory["way_n"]
    straight = math.sqrt((goal.u - here.u) ** 2 + (goal.v - here.v) ** 2)
    if memory["way_room"] != FULL or memory["stand_n"] > 0 or length - straight < terms.gain:
        return
    copy_way(memory["way_u"], memory["way_v"], memory["old_u"], memory["old_v"], n)
    ask_for(memory, LEAST)
    memory["searches"] += 1
    found = search_way(memory, here, goal_place(memory, goal))
    saved = length - way_length(memory, here)
    if found and saved >= terms.gain and _is_worth_it(memory, here, saved - terms.gain, length, terms):
        memory["way_room"] = LEAST
    else:
        memory["way_n"] = n
        copy_way(memory["old_u"], memory["old_v"], memory["way_u"], memory["way_v"], n)
    ask_for(memory, FULL)


@jit_inline
def _wariness(memory: Row, left: float) -> float:
    """Return how wary a robot with so far to go [cells] is, 0 to 1."""
    longer = (memory["gone"] + left) / max(1.0, memory["straight"]) - 1.0
    return float(min(1.0, max(0.0, (longer - TRUSTS) / (WARY - TRUSTS))))


@jit_inner
def _is_worth_it(memory: Row, here: Spot, saved: float, left: float, terms: Terms) -> bool:
    """Tell whether the body gets through all narrow places of the way, and the first is near enough for what is saved.

    ``left`` is how far there is to go without them [cells].
    """
    near, gone, wary = True, 0.0, terms.wary * _wariness(memory, left)
    au, av = here.u, here.v
    for k in range(memory["way_n"]):
        bu, bv = memory["way_u"][k], memory["way_v"][k]
        length = math.sqrt((bu - au) ** 2 + (bv - av) ** 2)
        at = max(0.0, BEGINS - gone)
        while at < length:
            u, v = au + at / length * (bu - au), av + at / length * (bv - av)
            ask_for(memory, FULL)
            if not is_open(memory, u, v):
                if near and saved < wary * (terms.least + gone + at):
                    return False
                near = False
                if not _fits_beside(memory, u, v):
                    return False
            at += STEP
        gone += length
        au, av = bu, bv
    return True


@jit_inner
def _fits_beside(memory: Row, u: float, v: float) -> bool:
    """Tell whether what the guard asks for is free at a place or a little beside it."""
    ask_for(memory, LESS)
    free = False
    for k in range(9):
        free = free or is_seen_open(memory, u + ASIDE * (k % 3 - 1), v + ASIDE * (k // 3 - 1))
    return free
