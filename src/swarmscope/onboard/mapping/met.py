"""Where the frames of others lie in our own: known from when they are in sight and say where they are in theirs.

All frames are those of odometry, turned as compasses say, so they differ by a shift, which drifts: what was found is
forgotten when the robot has gone far since. A packet may be older than it looks, so that somebody who moves is
elsewhere than it says by a little: the shift is the mean of the last few.
"""

from __future__ import annotations

from swarmscope._jit import jit, jit_inline
from swarmscope.onboard.mapping.words import Spot, number
from swarmscope.onboard.percept import NEVER_S, Row
from swarmscope.onboard.sharing.way_message import Place, unwrapped

MET = 12
"""Robots whose frames are known at once."""
NOBODY = -1
FAR_OFF_M = 1.5
"""A robot is no farther from where its last packets had it: a longer way than in some late ticks is a lie."""
USUAL = 8
"""A shift is the mean of about so many last ones."""


@jit
def slot_of(memory: Row, address: int) -> int:
    """Return where a robot is noted, -1: nowhere."""
    for k in range(MET):
        if memory["met_n"][k] > 0 and memory["met_id"][k] == address:
            return k
    return NOBODY


@jit
def note_met(memory: Row, who: tuple[int, int], theirs: Place, ours: Spot, cell_m: float) -> int:
    """Note where a robot is in its own frame and in ours; return where that is noted.

    ``who`` is its address and its boot number: one that has restarted has a new frame. Who says that it is far from
    where it should be is not believed (NOBODY); what was known of it is forgotten when it says so again and again.
    """
    k = slot_of(memory, who[0])
    if k < 0 or number(memory["met_boot"][k]) != who[1]:
        k = _free_slot(memory) if k < 0 else k
        if number(memory["met_id"][k]) != who[0]:
            memory["met_told_s"][k] = NEVER_S
        memory["met_asked_s"][k] = NEVER_S
        memory["met_n"][k], memory["met_id"][k], memory["met_boot"][k] = 0, who[0], who[1]
    u, v = ours.u, ours.v
    n = number(memory["met_n"][k])
    if n > 0:
        there = known_at(memory, k, theirs, cell_m)
        if (u - there.u) ** 2 + (v - there.v) ** 2 > (FAR_OFF_M / cell_m) ** 2:
            memory["met_n"][k] = 0 if n == 1 else n // 2
            return NOBODY
        share = 1.0 / min(USUAL, n + 1)
        u, v = there.u + share * (u - there.u), there.v + share * (v - there.v)
    memory["met_n"][k] = min(USUAL, n + 1)
    memory["met_x"][k], memory["met_y"][k] = theirs.x, theirs.y
    memory["met_u"][k], memory["met_v"][k] = u, v
    memory["met_gone"][k] = memory["gone"]
    return k


@jit
def _free_slot(memory: Row) -> int:
    """Return a free slot, else that of whom we have not seen for longest."""
    oldest = 0
    for k in range(MET):
        if memory["met_n"][k] == 0:
            return k
        if memory["met_gone"][k] < memory["met_gone"][oldest]:
            oldest = k
    return oldest


@jit
def is_known(memory: Row, k: int, boot: int, within: float) -> bool:
    """Tell whether the frame of the robot noted at ``k`` is known: it has not restarted, nor have we gone far since.

    ``within`` [cells] is how far that may be.
    """
    return k >= 0 and number(memory["met_boot"][k]) == boot and memory["gone"] - memory["met_gone"][k] <= within


@jit_inline
def known_at(memory: Row, k: int, theirs: Place, cell_m: float) -> Spot:
    """Return where the robot noted at ``k`` is in our frame [cells], that says it is at ``theirs`` in its own."""
    x, y = unwrapped(theirs.x - memory["met_x"][k]), unwrapped(theirs.y - memory["met_y"][k])
    return Spot(memory["met_u"][k] + x / cell_m, memory["met_v"][k] + y / cell_m)
