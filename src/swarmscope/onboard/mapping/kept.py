"""Places that a robot keeps closed though its map has nothing there: robots that stood when they were last seen, and
gaps that its body would not take."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.mapping.evidence import is_passed
from swarmscope.onboard.mapping.memory import KEPT
from swarmscope.onboard.mapping.words import Spot
from swarmscope.onboard.percept import Row
from swarmscope.onboard.view import View

GAP, ROBOT = 1, 2
SAME = 4.0
"""Places so near to each other [cells] are one."""


@jit
def keep(memory: Row, place: Spot, r: float, until_s: float, kind: int) -> None:
    """Keep ``r`` [cells] off a place until then; where there are too many, the one that ends first is given up."""
    at = memory["kept_n"]
    for k in range(memory["kept_n"]):
        if (memory["kept_u"][k] - place.u) ** 2 + (memory["kept_v"][k] - place.v) ** 2 < SAME * SAME:
            at = k
    if at == KEPT:
        at = 0
        for k in range(KEPT):
            if memory["kept_s"][k] < memory["kept_s"][at]:
                at = k
    memory["kept_n"] = max(memory["kept_n"], at + 1)
    memory["kept_u"][at], memory["kept_v"][at], memory["kept_r"][at] = place.u, place.v, r
    memory["kept_s"][at], memory["kept_is"][at] = until_s, kind
    memory["closed"] = 1


@jit
def review(see: View, memory: Row, cell_m: float) -> None:
    """Give up places whose time is over, and those of robots of which now can be seen that nobody is there."""
    now, n = see.percept["now_s"], 0
    for k in range(memory["kept_n"]):
        over = not now < memory["kept_s"][k] or (memory["kept_is"][k] == ROBOT and _is_empty(see, memory, k, cell_m))
        if over:
            memory["opened"] = 1
            continue
        memory["kept_u"][n], memory["kept_v"][n] = memory["kept_u"][k], memory["kept_v"][k]
        memory["kept_r"][n], memory["kept_s"][n] = memory["kept_r"][k], memory["kept_s"][k]
        memory["kept_is"][n] = memory["kept_is"][k]
        n += 1
    memory["kept_n"] = n


@jit_inner
def _is_empty(see: View, memory: Row, k: int, cell_m: float) -> bool:
    du = memory["kept_u"][k] - see.shared["x"] / cell_m
    dv = memory["kept_v"][k] - see.shared["y"] / cell_m
    return is_passed(see, du, dv, cell_m)
