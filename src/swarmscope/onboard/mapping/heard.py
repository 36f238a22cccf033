"""What others have told: cells that close a way, in a layer of its own that is believed least and never passed on.

A told cell keeps the robot's middle away by the least room only, so that no gap is closed that a body gets through. The
cells of one answer stand or fall together: where the robot sees for itself that several of them are free, all go.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.words import number
from swarmscope.onboard.percept import Row

HEARD = 2048
"""Cells that are remembered at once: where few are, a robot is told of one dead end while it forgets another."""
GRAIN = 8.0
"""Parts of a cell that a place is remembered in, as a whole number."""
FARTHEST = 4095.0
"""And so far from where the robot began [cells]."""
ANSWERS = 64
"""Answers that are."""
WRONG = 3
"""So many cells of an answer that turn out to be free make all of it wrong."""
WRONGED = 8
"""Senders that are remembered for what they told wrong."""
LEAST = 2
"""The room that told cells keep free (``cells.LEAST``)."""


@jit_inline
def told_cell(memory: Row, k: int) -> tuple[float, float]:
    """Return where told cell ``k`` is [cells]."""
    return memory["heard_u"][k] / GRAIN, memory["heard_v"][k] / GRAIN


@jit_inline
def is_told_closed(memory: Row, u: float, v: float) -> bool:
    """Tell whether a robot at (u, v) [cells] would be in a cell of which others have told."""
    if memory["answers_n"] == 0:
        return False
    return _is_within(memory, u, v, memory["disc_r"][LEAST])


@jit_inline
def is_told_near(memory: Row, u: float, v: float) -> bool:
    """Tell whether others have told of (u, v) [cells], or of what is so near that it closes the same."""
    return _is_within(memory, u, v, 0.5 * memory["disc_r"][LEAST])


@jit_inner
def _is_within(memory: Row, u: float, v: float, r: float) -> bool:
    """Tell whether a told cell lies within ``r`` [cells] of a place."""
    first = 0
    for a in range(memory["answers_n"]):
        n = number(memory["answer_n"][a])
        box = memory["answer_box"][a]
        if box[0] - r < u < box[1] + r and box[2] - r < v < box[3] + r:
            for k in range(first, first + n):
                at_u, at_v = told_cell(memory, k)
                du, dv = at_u - u, at_v - v
                if du * du + dv * dv < r * r:
                    return True
        first += n
    return False


@jit
def hear(memory: Row, cells: np.ndarray, n: int, now_s: float, sender: int) -> bool:
    """Take in the middles of ``n`` cells (n, 2) [cells]; return whether there is room for them. The oldest give way.

    Who has told wrong things is not believed for a while (`distrusts`).
    """
    if not 0 < n <= HEARD:
        return False
    for k in range(n):
        if not (abs(cells[k, 0]) <= FARTHEST and abs(cells[k, 1]) <= FARTHEST):
            return False
    while memory["answers_n"] == ANSWERS or memory["heard_n"] + n > HEARD:
        drop_answer(memory, 0)
    a, first = memory["answers_n"], memory["heard_n"]
    box = memory["answer_box"][a]
    box[0], box[1], box[2], box[3] = cells[0, 0], cells[0, 0], cells[0, 1], cells[0, 1]
    for k in range(n):
        u, v = cells[k, 0], cells[k, 1]
        memory["heard_u"][first + k] = int(math.floor(GRAIN * u + 0.5))
        memory["heard_v"][first + k] = int(math.floor(GRAIN * v + 0.5))
        memory["heard_free"][first + k] = 0
        box[0], box[1] = min(box[0], u), max(box[1], u)
        box[2], box[3] = min(box[2], v), max(box[3], v)
    memory["answer_n"][a], memory["answer_s"][a], memory["answer_wrong"][a] = n, now_s, 0
    memory["answer_from"][a] = sender
    memory["answers_n"], memory["heard_n"] = a + 1, first + n
    return True


@jit
def drop_answer(memory: Row, a: int) -> None:
    """Forget answer ``a``, the oldest being 0."""
    first = 0
    for k in range(a):
        first += number(memory["answer_n"][k])
    n = number(memory["answer_n"][a])
    for k in range(first, memory["heard_n"] - n):
        memory["heard_u"][k], memory["heard_v"][k] = memory["heard_u"][k + n], memory["heard_v"][k + n]
        memory["heard_free"][k] = memory["heard_free"][k + n]
    memory["heard_n"] -= n
    memory["answers_n"] -= 1
    for k in range(a, memory["answers_n"]):
        memory["answer_n"][k], memory["answer_s"][k] = memory["answer_n"][k + 1], memory["answer_s"][k + 1]
        memory["answer_wrong"][k] = memory["answer_wrong"][k + 1]
        memory["answer_from"][k] = memory["answer_from"][k + 1]
        for side in range(4):
            memory["answer_box"][k, side] = memory["answer_box"][k + 1, side]


@jit
def drop_cell(memory: Row, a: int, k: int) -> None:
    """Forget told cell ``k``, one of answer ``a``; the answer, too, when it was the last."""
    if memory["answer_n"][a] == 1:
        drop_answer(memory, a)
        return
    memory["answer_wrong"][a] -= memory["heard_free"][k]
    for j in range(k, memory["heard_n"] - 1):
        memory["heard_u"][j], memory["heard_v"][j] = memory["heard_u"][j + 1], memory["heard_v"][j + 1]
        memory["heard_free"][j] = memory["heard_free"][j + 1]
    memory["heard_n"] -= 1
    memory["answer_n"][a] -= 1


@jit
def forget_heard(memory: Row) -> bool:
    """Forget all that others have told; return whether there was anything."""
    some = memory["answers_n"] > 0
    memory["answers_n"] = memory["heard_n"] = 0
    return bool(some)


@jit
def note_wrong(memory: Row, k: int, now_s: float) -> None:
    """Note that told cell ``k`` has been seen to be free; enough of them make the answer wrong, and its sender."""
    first = 0
    for a in range(memory["answers_n"]):
        n = number(memory["answer_n"][a])
        if first <= k < first + n:
            memory["answer_wrong"][a] += 1 - memory["heard_free"][k]
            memory["heard_free"][k] = 1
            if memory["answer_wrong"][a] >= min(WRONG, n):
                if memory["answer_wrong"][a] >= WRONG:
                    at = number(memory["wrong_at"])
                    memory["wrong_id"][at], memory["wrong_s"][at] = memory["answer_from"][a], now_s
                    memory["wrong_at"] = (at + 1) % WRONGED
                drop_answer(memory, a)
                memory["opened"] = 1
            return
        first += n


@jit
def distrusts(memory: Row, sender: int, now_s: float, keep_s: float) -> bool:
    """Tell whether a robot has told something wrong within ``keep_s``: it lies, or its frame is not where we think."""
    found = False
    for k in range(WRONGED):
        found = found or (memory["wrong_id"][k] == sender and now_s - memory["wrong_s"][k] < keep_s)
    return bool(found)


@jit_inline
def review_heard(memory: Row, now_s: float, keep_s: float) -> None:
    """Forget answers that are older than ``keep_s``."""
    while memory["answers_n"] > 0 and now_s - memory["answer_s"][0] > keep_s:
        drop_answer(memory, 0)
        memory["opened"] = 1
