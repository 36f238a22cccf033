"""Whom a robot has heard in sight: when it answered them last, and whether it has asked them.

Who has never been in sight may be nobody: all those count as one, `STRANGERS`, with what they are answered and with
what they told that was wrong.
"""

from __future__ import annotations

from swarmscope._jit import jit
from swarmscope.onboard.percept import NEVER_S, Row

MET = 16
"""Robots that are noted at once."""
NOBODY = -1
STRANGERS = -2


@jit
def slot_of(memory: Row, address: int) -> int:
    """Return where a robot is noted, -1: nowhere."""
    for k in range(MET):
        if memory["met_s"][k] > NEVER_S and memory["met_id"][k] == address:
            return k
    return NOBODY


@jit
def note_heard(memory: Row, address: int, now_s: float) -> int:
    """Note that a robot has been heard; return where. Who was not heard for longest gives way."""
    k = slot_of(memory, address)
    if k < 0:
        k = 0
        for j in range(MET):
            if memory["met_s"][j] < memory["met_s"][k]:
                k = j
        memory["met_id"][k] = address
        memory["met_told_s"][k] = memory["met_asked_s"][k] = NEVER_S
    memory["met_s"][k] = now_s
    return k
