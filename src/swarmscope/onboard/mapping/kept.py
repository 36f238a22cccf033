"""Gaps that a robot keeps closed for a while though they are open by its map: its body would not take them."""

from __future__ import annotations

from swarmscope._jit import jit, jit_inline
from swarmscope.onboard.mapping.memory import KEPT
from swarmscope.onboard.mapping.words import Spot
from swarmscope.onboard.percept import Row

SAME = 4.0
"""Places so near to each other [cells] are one."""


@jit
def keep(memory: Row, place: Spot, r: float, until_s: float) -> None:
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
    memory["kept_s"][at] = until_s
    memory["closed"] = 1


@jit_inline
def review(memory: Row, now_s: float) -> None:
    """Give up the places whose time is over."""
    n = 0
    for k in range(memory["kept_n"]):
        if now_s < memory["kept_s"][k]:
            memory["kept_u"][n], memory["kept_v"][n] = memory["kept_u"][k], memory["kept_v"][k]
            memory["kept_r"][n], memory["kept_s"][n] = memory["kept_r"][k], memory["kept_s"][k]
            n += 1
    if n < memory["kept_n"]:
        memory["opened"] = 1
    memory["kept_n"] = n
