"""What of an answer is news: what the robot has seen itself, or was told before, need not be remembered again."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.mapping.cells import is_fine, row_of
from swarmscope.onboard.mapping.heard import is_told_near
from swarmscope.onboard.mapping.words import ZERO, bit
from swarmscope.onboard.percept import Row


@jit
def keep_news(memory: Row, cells: np.ndarray, n: int) -> int:
    """Leave of the first ``n`` told cells (n, 2) [cells] those that are news; return how many, 0: there is no news.

    What lies beside news in the row is left, too, so that walls have no gap where they were known.
    """
    left, news = 0, 0
    before, now = True, n > 0 and _is_known(memory, cells[0, 0], cells[0, 1])
    for k in range(n):
        after = k + 1 == n or _is_known(memory, cells[k + 1, 0], cells[k + 1, 1])
        news += 0 if now else 1
        if not (before and now and after):
            cells[left, 0], cells[left, 1] = cells[k, 0], cells[k, 1]
            left += 1
        before, now = now, after
    return left if news > 0 else 0


@jit_inner
def _is_known(memory: Row, u: float, v: float) -> bool:
    """Tell whether something stands at (u, v) [cells], a cell aside at most, by the own map, or others have told so."""
    if is_told_near(memory, u, v):
        return True
    if not is_fine(memory, u, v):
        return False
    ix, iy = int(math.floor(u)), int(math.floor(v))
    found = ZERO
    for y in range(iy - 1, iy + 2):
        found |= row_of(memory, ix - 1, y) & (bit(0) | bit(1) | bit(2))
    return bool(found != ZERO)
