"""Places that a robot keeps closed for a while though they are open by its map.

Gaps that its body would not take, each time for longer; and where somebody stood when last seen, if that is not the
first time: a robot that turns back for somebody out of sight, and comes again as soon as it no longer sees why, does so
for ever.
"""

from __future__ import annotations

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.memory import KEPT, LOST
from swarmscope.onboard.mapping.trail import close_round
from swarmscope.onboard.mapping.words import Spot, number
from swarmscope.onboard.percept import Row

SAME = 4.0
"""Places so near to each other [cells] are one."""
LOST_S, MOST_DOUBLINGS = 15.0, 5
"""Who is lost from sight for the second time is thought to stand there for so long; each time twice as long."""


@jit
def keep(memory: Row, place: Spot, r: float, until_s: float) -> None:
    """Keep ``r`` [cells] off a place until then; where there are too many, the one that ends first is given up.

    A place that is kept already is kept no shorter and no closer than it was.
    """
    at, same = memory["kept_n"], False
    for k in range(memory["kept_n"]):
        if (memory["kept_u"][k] - place.u) ** 2 + (memory["kept_v"][k] - place.v) ** 2 < SAME * SAME:
            at, same = k, True
    if at == KEPT:
        at = 0
        for k in range(KEPT):
            if memory["kept_s"][k] < memory["kept_s"][at]:
                at = k
    if same:
        r, until_s = max(r, memory["kept_r"][at]), max(until_s, memory["kept_s"][at])
    memory["kept_n"] = max(memory["kept_n"], at + 1)
    memory["kept_u"][at], memory["kept_v"][at], memory["kept_r"][at] = place.u, place.v, r
    memory["kept_s"][at] = until_s
    memory["closed"] = 1


@jit_inline
def review(memory: Row, now_s: float) -> None:
    """Give up the places whose time is over."""
    n = 0
    for k in range(memory["kept_n"]):
        if now_s < memory["kept_s"][k]:
            _move(memory, k, n)
            n += 1
    if n < memory["kept_n"]:
        memory["opened"] = 1
    memory["kept_n"] = n


@jit_inner
def _move(memory: Row, k: int, to: int) -> None:
    """Move a place that is kept within the list."""
    memory["kept_u"][to], memory["kept_v"][to] = memory["kept_u"][k], memory["kept_v"][k]
    memory["kept_r"][to], memory["kept_s"][to] = memory["kept_r"][k], memory["kept_s"][k]


@jit
def lose_sight(memory: Row, place: Spot, r: float, now_s: float) -> None:
    """Note that somebody who stood at a place is out of sight; keep ``r`` [cells] off it if that happens again."""
    times = _count(memory, place)
    if times > 0:
        keep(memory, place, r, now_s + LOST_S * 2.0 ** (times - 1))


@jit
def find_narrow(memory: Row, place: Spot, r: float, now_s: float, keep_s: float) -> None:
    """Note a gap that the body does not take; keep ``r`` [cells] off it for ``keep_s``, each time twice as long."""
    close_round(memory, place.u, place.v, r)
    keep(memory, place, r, now_s + keep_s * 2.0 ** _count(memory, place))


@jit
def give_up_once(memory: Row) -> None:
    """Give up the places that are kept closed for the first time."""
    n = 0
    for k in range(memory["kept_n"]):
        at = _counted(memory, Spot(float(memory["kept_u"][k]), float(memory["kept_v"][k])))
        if at >= 0 and memory["lost_times"][at] > 1:
            _move(memory, k, n)
            n += 1
    memory["kept_n"] = n


@jit_inner
def _counted(memory: Row, place: Spot) -> int:
    """Return where it is noted how often something has been so at a place, -1: nowhere."""
    at = -1
    for k in range(LOST):
        near = (memory["lost_u"][k] - place.u) ** 2 + (memory["lost_v"][k] - place.v) ** 2 < SAME * SAME
        if near and memory["lost_times"][k] > 0:
            at = k
    return at


@jit_inner
def _count(memory: Row, place: Spot) -> int:
    """Count once more what happens at a place; return how often it had happened before."""
    at = _counted(memory, place)
    if at < 0:
        at = number(memory["lost_at"])
        memory["lost_at"] = (at + 1) % LOST
        memory["lost_u"][at], memory["lost_v"][at], memory["lost_times"][at] = place.u, place.v, 0
    times = number(memory["lost_times"][at])
    memory["lost_times"][at] = min(times + 1, MOST_DOUBLINGS + 1)
    return times
