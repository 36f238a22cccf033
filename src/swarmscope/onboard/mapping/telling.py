"""What is told: packets CLOSED, to be heard by everybody.

`WALLS`: who asks is told what closes its way. `SCANS` and `MAPS` are for comparison: who asks is told what stands in
front of whoever hears it; and nobody asks, but all tell each other all that they have learnt (`mapping/exchanging.py`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.memory import TALK
from swarmscope.onboard.mapping.tracing import trace, trace_scan
from swarmscope.onboard.mapping.words import number
from swarmscope.onboard.percept import EVERYBODY, MAX_OUTBOX, Row
from swarmscope.onboard.sharing.message import Head, name_of
from swarmscope.onboard.sharing.way_message import CELL_M, Place, encode_closed, read_closed
from swarmscope.onboard.view import View

WALLS, SCANS, MAPS = 1, 2, 3
SMALL_M = 1.5
"""What is smaller along both axes is not told: the way round it is hardly longer."""
TRIES = 3
"""What does not fit into a packet is traced anew, with fewer cells, so often."""


class Talk(NamedTuple):
    """How robots tell each other what closes their ways. Distances in m, times in s."""

    what: int
    """What is told: `WALLS`, `SCANS` or `MAPS`."""
    cell_m: float
    ask_s: float
    """Time between two questions at least."""
    again_s: float
    """And at most, where somebody may hear them."""
    reach_m: float
    """What is farther from the one who answers is not told."""
    cells: int
    """Cells that an answer has at most."""
    payload: int
    """Bytes that a packet has at most."""
    budget: float
    """Bytes that may be sent in a second on average."""
    link_bytes: int
    """Of these the link adds so many to each packet."""
    keep_s: float
    """So long others are believed."""
    trust_m: float
    """A robot that has gone so far without agreeing with one in sight begins anew in its own frame."""


@jit_inline
def may_send(see: View, memory: Row) -> bool:
    """Tell whether there is room on the air, and in this tick."""
    return bool(see.out["n_out"] < MAX_OUTBOX and memory["budget"] > 0.0)


@jit
def tell_closed(see: View, memory: Row, talk: Talk, place: tuple[float, float]) -> None:
    """Answer the question in ``see.header`` with what closes a place [cells], to be heard by everybody."""
    seq = (see.shared["seq"] + 1) & 0xFFFF
    head = Head(see.percept["id"], see.percept["boot"], seq, name_of(see.header[5], see.header[2]))
    _send_answer(see, memory, talk, seq, _write_closed(see, memory, talk, place, head))


@jit
def tell_scan(see: View, memory: Row, talk: Talk) -> None:
    """Answer the question in ``see.header`` with what stands in front of the robot, to be heard by everybody."""
    seq = (see.shared["seq"] + 1) & 0xFFFF
    head = Head(see.percept["id"], see.percept["boot"], seq, name_of(see.header[5], see.header[2]))
    n = trace_scan(see, memory, talk.cell_m, min(TALK, talk.cells))
    here = from_here(see, memory, n, talk.cell_m)
    data = see.out["out"][see.out["n_out"]]
    _send_answer(see, memory, talk, seq, encode_closed(head, here, memory["talk_cell"], n, data, talk.payload))


@jit_inner
def _send_answer(see: View, memory: Row, talk: Talk, seq: int, length: int) -> None:
    """Send the answer number ``seq`` that was written into the next place of the outbox, if any was."""
    if length > 0:
        see.shared["seq"] = seq
        memory["told"] += 1
        send(see, memory, talk, length)


@jit_inline
def send(see: View, memory: Row, talk: Talk, length: int) -> None:
    """Send the packet of ``length`` bytes that stands in the next place of the outbox to everybody."""
    out = see.out
    k = out["n_out"]
    out["out_to"][k], out["out_length"][k], out["n_out"] = EVERYBODY, length, k + 1
    memory["budget"] -= length + talk.link_bytes


@jit_inner
def _write_closed(see: View, memory: Row, talk: Talk, place: tuple[float, float], head: Head) -> int:
    """Write what closes a place [cells] into the outbox.

    Return its length, 0: there is none, or it is small. What is nearest to the place is told, as much of it as fits.
    """
    data = see.out["out"][see.out["n_out"]]
    most, length = min(TALK, talk.cells), 0
    for _ in range(TRIES):
        n = trace(see, memory, talk.cell_m, place, (most, talk.reach_m / talk.cell_m))
        if n == 0 or (n < most and _is_small(memory, n, SMALL_M / talk.cell_m)):
            return 0
        here = from_here(see, memory, n, talk.cell_m)
        length = encode_closed(head, here, memory["talk_cell"], n, data, talk.payload)
        most = read_closed(data, length, memory["talk_at"])
        if most >= n:
            break
    return int(length)


@jit_inner
def _is_small(memory: Row, n: int, small: float) -> bool:
    """Tell whether the first ``n`` cells to tell lie within ``small`` [cells] along both axes."""
    for axis in range(2):
        low, high = memory["talk_cell"][0, axis], memory["talk_cell"][0, axis]
        for k in range(n):
            low, high = min(low, memory["talk_cell"][k, axis]), max(high, memory["talk_cell"][k, axis])
        if high - low >= small:
            return False
    return True


@jit
def from_here(see: View, memory: Row, n: int, cell_m: float) -> Place:
    """Turn numbers of cells of the map into those of a packet's, which begin with the one in which the robot is.

    Return the middle of that one in the shared frame: so cells stay the same cells, wherever the frames' origins are.
    """
    ix, iy = math.floor(see.shared["x"] / cell_m), math.floor(see.shared["y"] / cell_m)
    for k in range(n):
        memory["talk_cell"][k, 0] = math.floor((memory["talk_cell"][k, 0] - ix) * cell_m / CELL_M + 0.5)
        memory["talk_cell"][k, 1] = math.floor((memory["talk_cell"][k, 1] - iy) * cell_m / CELL_M + 0.5)
    x, y = (ix + 0.5) * cell_m + memory["frame_x"], (iy + 0.5) * cell_m + memory["frame_y"]
    return Place(x, y, number(memory["frame"]))
