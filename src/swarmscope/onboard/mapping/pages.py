"""The place layer's pages: for nodes of a coarse grid, whether they are blocked, and whether less room would do there.

A page holds 64 x 64 nodes and is there only where something is blocked; the directory wraps round.
"""

from __future__ import annotations

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.words import ONE, WORD, ZERO, bit, number
from swarmscope.onboard.percept import Row

PAGES = 127
"""That there can be at once, 512 bytes each."""
SLIM_PAGES = 64
"""Of these with a place where less room would do, 512 bytes more each."""
DIRECTORY = 16
NO_PAGE = 0
PAGE_BITS = 6


@jit_inline
def page_of(memory: Row, kx: int, ky: int) -> int:
    """Return the slot of the page that node (kx, ky) lies in, -1: there is none, all of it is free."""
    px, py = kx >> PAGE_BITS, ky >> PAGE_BITS
    slot = number(memory["page_at"][py & (DIRECTORY - 1), px & (DIRECTORY - 1)]) - 1
    if slot >= 0 and (memory["page_x"][slot] != px or memory["page_y"][slot] != py):
        return -1
    return slot


@jit_inline
def is_blocked(memory: Row, kx: int, ky: int) -> bool:
    """Tell whether the place layer has node (kx, ky) blocked."""
    slot = page_of(memory, kx, ky)
    return slot >= 0 and bool((memory["rows"][slot, ky & (WORD - 1)] >> np.uint64(kx & (WORD - 1))) & ONE)


@jit
def is_slim(memory: Row, kx: int, ky: int) -> bool:
    """Tell whether the least disc did fit at node (kx, ky) when the fine layer last left it, or the robot was there."""
    slot = page_of(memory, kx, ky)
    if slot < 0 or memory["slim_at"][slot] == NO_PAGE:
        return False
    word = memory["slim"][number(memory["slim_at"][slot]) - 1, ky & (WORD - 1)]
    return bool((word >> np.uint64(kx & (WORD - 1))) & ONE)


@jit
def block(memory: Row, kx: int, ky: int, blocked: bool, slim: bool) -> None:
    """Write into the place layer whether node (kx, ky) is blocked, and whether less room would do there."""
    slot = page_of(memory, kx, ky)
    if slot < 0:
        if not blocked:
            return
        slot = _new_page(memory, kx >> PAGE_BITS, ky >> PAGE_BITS)
    row, one = ky & (WORD - 1), bit(kx & (WORD - 1))
    memory["rows"][slot, row] = memory["rows"][slot, row] | one if blocked else memory["rows"][slot, row] & ~one
    at = number(memory["slim_at"][slot]) - 1
    if slim and at < 0 and memory["slims_n"] < SLIM_PAGES:
        at = memory["slims_n"]
        memory["slims_n"] += 1
        memory["slim_at"][slot] = at + 1
        _empty_slim(memory, at)
    if at >= 0:
        memory["slim"][at, row] = memory["slim"][at, row] | one if slim else memory["slim"][at, row] & ~one


@jit_inner
def _empty_slim(memory: Row, at: int) -> None:
    for k in range(WORD):
        memory["slim"][at, k] = ZERO


@jit_inner
def _new_page(memory: Row, px: int, py: int) -> int:
    """Return the slot of a new, empty page: a free one, else that of the page farthest from this one."""
    at_y, at_x = py & (DIRECTORY - 1), px & (DIRECTORY - 1)
    slot = number(memory["page_at"][at_y, at_x]) - 1
    if slot < 0 and memory["pages_n"] < PAGES:
        slot = memory["pages_n"]
        memory["pages_n"] += 1
    elif slot < 0:
        slot, farthest = 0, -1
        for k in range(PAGES):
            d = (memory["page_x"][k] - px) ** 2 + (memory["page_y"][k] - py) ** 2
            if d > farthest:
                slot, farthest = k, d
        memory["page_at"][memory["page_y"][slot] & (DIRECTORY - 1), memory["page_x"][slot] & (DIRECTORY - 1)] = NO_PAGE
    memory["page_at"][at_y, at_x] = slot + 1
    memory["page_x"][slot], memory["page_y"][slot] = px, py
    for k in range(WORD):
        memory["rows"][slot, k] = ZERO
    if memory["slim_at"][slot] != NO_PAGE:
        _empty_slim(memory, number(memory["slim_at"][slot]) - 1)
    return slot


@jit
def forget_pages(memory: Row) -> None:
    """Forget all nodes."""
    for y in range(DIRECTORY):
        for x in range(DIRECTORY):
            memory["page_at"][y, x] = NO_PAGE
    for k in range(PAGES):
        memory["slim_at"][k] = NO_PAGE
    memory["pages_n"] = memory["slims_n"] = 0
