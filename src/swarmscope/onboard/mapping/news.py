"""What of an answer is news: what the robot has seen itself, or was told before, need not be remembered again."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.cells import NODE, is_fine, row_of
from swarmscope.onboard.mapping.heard import drop_cell, is_told_near, told_cell
from swarmscope.onboard.mapping.pages import is_slim
from swarmscope.onboard.mapping.words import ZERO, bit, lowest, number, without_lowest
from swarmscope.onboard.percept import Row

ASIDE = 3
"""What others tell of is what the robot has seen itself when that is no more than so many cells aside: frames differ,
and what is told a little beside where it is would close narrow gaps."""
ROW = 6.0
"""Cells that are farther from one another are of two things: each ends there."""
EVERY = 32
"""An answer is compared with the own map in one tick of so many."""


@jit
def keep_news(memory: Row, cells: np.ndarray, n: int) -> int:
    """Leave of the first ``n`` told cells (n, 2) [cells] those that are news; return how many, 0: there is no news.

    What lies beside news in the row is left, too, so that walls have no gap where they were known.
    """
    left, news = 0, 0
    before, now = True, n > 0 and _is_known(memory, cells[0, 0], cells[0, 1])
    for k in range(n):
        ends = k + 1 == n or _ends(cells[k, 0], cells[k, 1], cells[k + 1, 0], cells[k + 1, 1])
        after = ends or _is_known(memory, cells[k + 1, 0], cells[k + 1, 1])
        news += 0 if now else 1
        if not (before and now and after):
            cells[left, 0], cells[left, 1] = cells[k, 0], cells[k, 1]
            left += 1
        if k + 1 < n:
            before, now = ends or now, after if not ends else _is_known(memory, cells[k + 1, 0], cells[k + 1, 1])
    return left if news > 0 else 0


@jit_inline
def _ends(u: float, v: float, next_u: float, next_v: float) -> bool:
    """Tell whether a row of told cells ends between two."""
    return bool((next_u - u) ** 2 + (next_v - v) ** 2 > ROW * ROW)


@jit_inner
def _is_known(memory: Row, u: float, v: float) -> bool:
    """Tell whether something stands at (u, v) [cells] by the own map, or others have told so."""
    return is_told_near(memory, u, v) or is_seen(memory, u, v)


@jit
def is_seen(memory: Row, u: float, v: float) -> bool:
    """Tell whether something stands at (u, v) [cells], or `ASIDE`, by what the robot has seen itself.

    What came back from the place layer does not say so where the least disc did fit (`answering.is_sure`).
    """
    if not is_fine(memory, u, v):
        return False
    ix, iy = int(math.floor(u)) - ASIDE, int(math.floor(v))
    for y in range(iy - ASIDE, iy + ASIDE + 1):
        row = row_of(memory, ix, y) & (bit(2 * ASIDE + 1) - bit(0))
        while row != ZERO:
            x = ix + lowest(row)
            row = without_lowest(row)
            at_node = x % NODE == NODE // 2 and y % NODE == NODE // 2
            if not (at_node and is_slim(memory, x // NODE, y // NODE)):
                return True
    return False


@jit
def trust_own_eyes(memory: Row) -> None:
    """Forget told cells that the robot has seen by now, and those before and behind in the row: it knows better."""
    first = memory["heard_n"]
    for a in range(memory["answers_n"] - 1, -1, -1):
        last = first - 1
        first -= number(memory["answer_n"][a])
        if a % EVERY == memory["ticks"] % EVERY:
            _drop_seen(memory, a, first, last)


@jit_inner
def _drop_seen(memory: Row, a: int, first: int, last: int) -> None:
    """Forget of answer ``a``, told cells ``first`` to ``last``, those that the robot has seen."""
    after = True
    for k in range(last, first - 1, -1):
        u, v = told_cell(memory, k)
        now, before, ends = is_seen(memory, u, v), True, True
        if k > first:
            before_u, before_v = told_cell(memory, k - 1)
            ends = _ends(u, v, before_u, before_v)
            before = ends or is_seen(memory, before_u, before_v)
        if now and after and before:
            drop_cell(memory, a, k)
            memory["opened"] = 1
        after = now or ends
