"""The way that a robot goes: found when it has none or something closes it, kept taut, shortened as it is gone."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import point_segment_distance
from swarmscope.onboard.mapping.cells import FULL, LEAST, LESS, PHASES, ask_for, forget_all, is_open, open_way
from swarmscope.onboard.mapping.flood import flood
from swarmscope.onboard.mapping.heard import forget_heard
from swarmscope.onboard.mapping.kept import give_up_once
from swarmscope.onboard.mapping.memory import CORNERS
from swarmscope.onboard.mapping.search import FOUND, TOO_MANY, shortest
from swarmscope.onboard.mapping.words import Spot, number
from swarmscope.onboard.percept import Row

HALVINGS = 4
SWEEPS = 2
BESIDE_LEG = 3.0
"""So far beside a leg of its way [cells] a robot is still on it."""
REACHED = 1.0
"""A corner so near [cells] is behind."""
LONG = 1.15
"""Times the straight line: a way that is longer is compared with what a flood finds."""
WHOLE, NOBODY, LESS_ROOM, LEAST_ROOM, AGAIN, NOTHING = range(6)
"""What a search goes by: all that is known; without robots that stand; less and less; nothing."""
START_WITHIN = 3
"""A robot in a gap that is hardly wide enough is a little beside where it fits by its map: it counts as being there."""
GOAL_WITHIN = 8
"""A goal that is not open is gone to as near as a place so many cells from it."""


@jit
def find_way(memory: Row, here: Spot, goal: Spot) -> bool:
    """Search a way; return whether there is one. Where the goal is not open it leads past the nearest open place."""
    memory["searches"] += 1
    near = goal_place(memory, goal)
    if not search_way(memory, here, near):
        memory["failures"] += 1
        return False
    memory["closed"], memory["way_room"] = 0, memory["room"]
    n = memory["way_n"]
    if near.u != goal.u or near.v != goal.v:
        n = min(CORNERS, n + 1)
        memory["way_u"][n - 1], memory["way_v"][n - 1] = goal.u, goal.v
        memory["way_n"] = n
    return True


@jit
def search_way(memory: Row, here: Spot, goal: Spot) -> bool:
    """Search, and flood where that takes too many nodes or the way is long: what is found must not depend on which.

    A search finds ways between the nodes of the place layer, a flood those over nodes between which no straight way is
    open; a robot to which now the one and now the other is known goes to and fro.
    """
    found = shortest(memory, here.u, here.v, goal.u, goal.v)
    straight = math.sqrt((goal.u - here.u) ** 2 + (goal.v - here.v) ** 2)
    if found == FOUND:
        tighten(memory, here.u, here.v)
        length = way_length(memory, here)
        if length <= LONG * straight:
            return True
        n = memory["way_n"]
        copy_way(memory["way_u"], memory["way_v"], memory["other_u"], memory["other_v"], n)
        memory["floods"] += 1
        if flood(memory, here.u, here.v, goal.u, goal.v):
            tighten(memory, here.u, here.v)
            if way_length(memory, here) < length:
                return True
        memory["way_n"] = n
        copy_way(memory["other_u"], memory["other_v"], memory["way_u"], memory["way_v"], n)
        return True
    reached = False
    for phase in range(PHASES if memory["room"] == FULL else 1):
        if not reached:
            memory["phase"] = phase
            memory["floods"] += 1
            reached = flood(memory, here.u, here.v, goal.u, goal.v)
            if reached:
                tighten(memory, here.u, here.v)
            if phase > 0:
                reached = reached and _is_all_open(memory, here)
    memory["phase"] = 0
    return reached


@jit_inner
def _is_all_open(memory: Row, here: Spot) -> bool:
    """Tell whether every leg of the way is open: two nodes either side of a gap may be where it is too narrow."""
    u, v = here.u, here.v
    for k in range(memory["way_n"]):
        if not open_way(memory, u, v, memory["way_u"][k], memory["way_v"][k]):
            return False
        u, v = memory["way_u"][k], memory["way_v"][k]
    return True


@jit_inline
def copy_way(from_u: np.ndarray, from_v: np.ndarray, to_u: np.ndarray, to_v: np.ndarray, n: int) -> None:
    """Copy the first ``n`` corners of a way."""
    for k in range(n):
        to_u[k], to_v[k] = from_u[k], from_v[k]


@jit_inline
def goal_place(memory: Row, goal: Spot) -> Spot:
    """Return the goal, or where it is not open the nearest open place to it."""
    return nearest_open(memory, goal, GOAL_WITHIN)


@jit
def nearest_open(memory: Row, here: Spot, within: int) -> Spot:
    """Return the open place that is nearest, ``within`` so many cells; the place itself where there is none."""
    u, v = here.u, here.v
    if is_open(memory, u, v):
        return here
    best, at_u, at_v = math.inf, u, v
    for y in range(-within, within + 1):
        for x in range(-within, within + 1):
            d = x * x + y * y
            if d < best and is_open(memory, u + x, v + y):
                best, at_u, at_v = d, u + x, v + y
    return Spot(at_u, at_v)


@jit
def tighten(memory: Row, u0: float, v0: float) -> None:
    """Pull the corners of the way towards the straight line, as far as it stays open."""
    for _ in range(SWEEPS):
        au, av = u0, v0
        k = 0
        while k < memory["way_n"] - 1:
            cu, cv = memory["way_u"][k], memory["way_v"][k]
            bu, bv = memory["way_u"][k + 1], memory["way_v"][k + 1]
            if open_way(memory, au, av, bu, bv):
                drop_corner(memory, k)
                continue
            # the foot of the corner on the line from a to b
            du, dv = bu - au, bv - av
            t = ((cu - au) * du + (cv - av) * dv) / max(1e-9, du * du + dv * dv)
            t = min(1.0, max(0.0, t))
            fu, fv = au + t * du, av + t * dv
            low, high = 0.0, 1.0
            for _ in range(HALVINGS):
                s = 0.5 * (low + high)
                mu, mv = cu + s * (fu - cu), cv + s * (fv - cv)
                if open_way(memory, au, av, mu, mv) and open_way(memory, mu, mv, bu, bv):
                    low = s
                else:
                    high = s
            memory["way_u"][k], memory["way_v"][k] = cu + low * (fu - cu), cv + low * (fv - cv)
            au, av = memory["way_u"][k], memory["way_v"][k]
            k += 1


@jit_inline
def shorten(memory: Row, here: Spot) -> None:
    """Drop the corners that are reached, and those from before which the next one is in sight."""
    while memory["way_n"] > 1 and (
        (memory["way_u"][0] - here.u) ** 2 + (memory["way_v"][0] - here.v) ** 2 < REACHED * REACHED
        or open_way(memory, here.u, here.v, memory["way_u"][1], memory["way_v"][1])
    ):
        memory["leg_u"], memory["leg_v"] = memory["way_u"][0], memory["way_v"][0]
        drop_corner(memory, 0)


@jit
def is_on_way(memory: Row, here: Spot) -> bool:
    """Tell whether the way's first corner is in sight, or the robot but a little beside a leg to it that is open.

    In a gap that is hardly wide enough the next corner is in sight from one line only; who leaves that by two
    centimetres and goes back to it does so for ever.
    """
    u, v = memory["way_u"][0], memory["way_v"][0]
    if open_way(memory, here.u, here.v, u, v):
        memory["leg_u"], memory["leg_v"] = here.u, here.v
        return True
    off = point_segment_distance(here.u, here.v, memory["leg_u"], memory["leg_v"], u, v)
    return bool(off < BESIDE_LEG and open_way(memory, memory["leg_u"], memory["leg_v"], u, v))


@jit_inline
def drop_corner(memory: Row, k: int) -> None:
    """Drop a corner of the way."""
    for i in range(k, memory["way_n"] - 1):
        memory["way_u"][i], memory["way_v"][i] = memory["way_u"][i + 1], memory["way_v"][i + 1]
    memory["way_n"] -= 1


@jit_inline
def way_length(memory: Row, here: Spot) -> float:
    """Return how long the way from here is [cells]."""
    length, au, av = 0.0, here.u, here.v
    for k in range(memory["way_n"]):
        bu, bv = memory["way_u"][k], memory["way_v"][k]
        length += math.sqrt((bu - au) ** 2 + (bv - av) ** 2)
        au, av = bu, bv
    return length


@jit
def find_shorter(memory: Row, here: Spot, goal: Spot, gain: float) -> None:
    """Search anew; keep the way that there is unless another one is shorter by ``gain`` [cells].

    Where its first corner is out of sight it is led on to from here: the two ways are compared as both would be gone,
    else a robot between two that are about as long would turn round for ever.
    """
    room = number(memory["way_room"])
    ask_for(memory, room)
    _join(memory, here)
    ask_for(memory, FULL)
    old_length, n = way_length(memory, here), memory["way_n"]
    copy_way(memory["way_u"], memory["way_v"], memory["old_u"], memory["old_v"], n)
    found = find_way(memory, here, goal)
    if not found or way_length(memory, here) > old_length - gain:
        memory["way_n"], memory["way_room"] = n, room
        copy_way(memory["old_u"], memory["old_v"], memory["way_u"], memory["way_v"], n)


@jit
def _join(memory: Row, here: Spot) -> None:
    """Lead on to the way's first corner where that is not in sight, if there is a way to it."""
    n = memory["way_n"]
    first = Spot(memory["way_u"][0], memory["way_v"][0])
    if open_way(memory, here.u, here.v, first.u, first.v):
        return
    copy_way(memory["way_u"], memory["way_v"], memory["old_u"], memory["old_v"], n)
    found = shortest(memory, here.u, here.v, first.u, first.v)
    if found == TOO_MANY and flood(memory, here.u, here.v, first.u, first.v):
        found = FOUND
    before = memory["way_n"] - 1 if found == FOUND else 0
    memory["way_n"] = min(CORNERS, before + n)
    for k in range(before, memory["way_n"]):
        memory["way_u"][k], memory["way_v"][k] = memory["old_u"][k - before], memory["old_v"][k - before]
    memory["way_u"][memory["way_n"] - 1] = memory["old_u"][n - 1]
    memory["way_v"][memory["way_n"] - 1] = memory["old_v"][n - 1]
    tighten(memory, here.u, here.v)


@jit
def forget_and_find(memory: Row, here: Spot, goal: Spot) -> int:
    """Find a way; where the map closes everything, leave out who stands, ask for less room, forget what others told.

    Less room is what the guard lets pass, then what may be as wide as that, since maps err by a cell. What others told
    goes when that is no help, and all begins again; then gaps that turned out too narrow once before, then everything.
    Return how far that went, 0 to 3, at least 1 when what others told is forgotten.
    """
    stood, kept, told = memory["stand_n"], memory["kept_n"], 0
    step = WHOLE
    while True:
        if step == NOBODY:
            memory["stand_n"] = 0
        elif step == LESS_ROOM:
            ask_for(memory, LESS)
        elif step == LEAST_ROOM:
            ask_for(memory, LEAST)
        elif step == AGAIN:
            give_up_once(memory)
            kept = memory["kept_n"]
        elif step == NOTHING:
            kept = memory["kept_n"] = 0
            memory["room"] = FULL
            forget_all(memory)
        if find_way(memory, here, goal) or step == NOTHING:
            break
        if step == LEAST_ROOM and forget_heard(memory):
            memory["room"], memory["stand_n"], step, told = FULL, stood, WHOLE, 1
            continue
        step += 1
        if step == NOBODY and stood == 0:
            step += 1
        if step == AGAIN and kept == 0:
            step += 1
    memory["room"], memory["stand_n"], memory["kept_n"] = FULL, stood, kept
    if step <= NOBODY:
        return max(step, told)
    return 3 if step == NOTHING else 2
