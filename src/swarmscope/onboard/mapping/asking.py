"""One question, forty bytes: "this is my way, who knows it is closed?"

A robot asks when its way has changed, when it meets somebody new, and every few seconds where somebody may have learnt
something meanwhile. Whoever hears it, knows where the asker is and has the way closed in its own map answers with what
closes it. Nobody sends more than its share of the air.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.mapping.answering import closed_place
from swarmscope.onboard.mapping.cells import LEAST
from swarmscope.onboard.mapping.evidence import closes, is_passed
from swarmscope.onboard.mapping.exchanging import begin_anew, tell_map
from swarmscope.onboard.mapping.frames import agree, is_shared, keep_frame, own_place, spot_of
from swarmscope.onboard.mapping.heard import distrusts, hear, note_wrong, review_heard, told_cell
from swarmscope.onboard.mapping.met import NOBODY, STRANGERS, note_heard, slot_of
from swarmscope.onboard.mapping.news import is_seen, keep_news, trust_own_eyes
from swarmscope.onboard.mapping.telling import MAPS, SCANS, WALLS, Talk, may_send, send, tell_closed, tell_scan
from swarmscope.onboard.mapping.words import Spot
from swarmscope.onboard.percept import NEVER_S, PEERS, Row
from swarmscope.onboard.sharing.inbox import start_round
from swarmscope.onboard.sharing.message import KIND_CHECK, OK, Head, decode
from swarmscope.onboard.sharing.way_message import (
    WAY_CORNERS,
    Place,
    encode_check,
    place_of,
    read_check,
    read_closed,
)
from swarmscope.onboard.view import View

TURNS = 10
"""Robots that are switched on at once ask one after the other."""
SAVED_S = 10.0
"""What has not been sent for so long may be sent at once."""
EVERY = 8
"""A told cell is looked at for being free in one tick of so many."""
SAME = 4.0
"""A corner so near [cells] to one that was asked about is the same."""
AHEAD_M = 40.0
"""So much of the way is asked about."""
SHARE = 0.25
"""Of the time between two answers to one robot, that between two to robots that have never been in sight."""
DOUBT_S = 20.0
"""So long nobody who has never been in sight is believed after one of them was wrong."""


@jit
def listen(see: View, memory: Row, talk: Talk) -> None:
    """Read this tick's packets about ways: answer who asks, take in what is told. Doubt what is told and seen free."""
    percept, shared = see.percept, see.shared
    cap = talk.budget * SAVED_S
    memory["budget"] = min(cap, memory["budget"] + talk.budget * percept["dt_s"])
    keep_frame(see, memory, talk.trust_m / talk.cell_m)
    review_heard(memory, percept["now_s"], talk.keep_s)
    _doubt(see, memory, talk.cell_m)
    trust_own_eyes(memory)
    if talk.what == MAPS:
        _tell_maps(see, memory, talk)
    for i in range(shared["told_n"]):
        k = shared["told_at"][i]
        if decode(percept["packet"][k], percept["packet_length"][k], see.header) != OK:
            continue
        if see.header[0] == KIND_CHECK:
            _answer(see, memory, talk, k)
        else:
            _take_in(see, memory, talk, k)


@jit_inner
def _doubt(see: View, memory: Row, cell_m: float) -> None:
    """Note told cells that the robot sees to be free; not those a little beside what it has seen: frames differ."""
    u, v = see.shared["x"] / cell_m, see.shared["y"] / cell_m
    k = memory["ticks"] % EVERY
    while k < memory["heard_n"]:
        at_u, at_v = told_cell(memory, k)
        if is_passed(see, at_u - u, at_v - v, cell_m) and not is_seen(memory, at_u, at_v):
            note_wrong(memory, k, see.percept["now_s"])
        k += EVERY


class Sender(NamedTuple):
    """Who has sent a packet."""

    slot: int
    """Where it is noted (`met`), -1: it is not believed."""
    known: bool
    """Whether it is known where it is."""
    at: Spot
    """Where [cells]."""


@jit_inner
def _sender(see: View, memory: Row, talk: Talk, place: Place) -> Sender:
    """Return who has sent the packet in ``see.header``, which says that it is at ``place``.

    What it says of itself it said a tick ago. Who is in sight is understood in any frame.
    """
    shared, now, name, x, y = see.shared, see.percept["now_s"], STRANGERS, 0.0, 0.0
    for t in range(PEERS):
        if shared["track_id"][t] == see.header[1] and shared["track_seen_s"][t] == now:
            x, y = shared["x"] + shared["track_was_x"][t], shared["y"] + shared["track_was_y"][t]
            name = see.header[1]
    in_sight = name != STRANGERS
    if slot_of(memory, see.header[1]) >= 0:
        name = see.header[1]
    doubted_s = min(DOUBT_S, talk.keep_s) if name == STRANGERS else talk.keep_s
    # whole scans and maps hold what walks, too: their senders do not lie for that
    doubted = talk.what == WALLS and distrusts(memory, name, now, doubted_s)
    if place.frame == 0 or doubted or (in_sight and not agree(memory, place, x, y)):
        return Sender(NOBODY, False, Spot(0.0, 0.0))
    at = Spot(x / talk.cell_m, y / talk.cell_m)
    if is_shared(memory, place):
        at = spot_of(see, memory, place, talk.cell_m)
    return Sender(note_heard(memory, name, now), in_sight or is_shared(memory, place), at)


@jit_inner
def _from_there(memory: Row, there: Spot, n: int, cell_m: float) -> None:
    """Turn the first ``n`` places of a packet, relative to its sender [m], into places of our own map [cells]."""
    for k in range(n):
        memory["talk_at"][k, 0] = there.u + memory["talk_at"][k, 0] / cell_m
        memory["talk_at"][k, 1] = there.v + memory["talk_at"][k, 1] / cell_m


@jit_inner
def _answer(see: View, memory: Row, talk: Talk, packet: int) -> None:
    """Tell the sender of a CHECK what closes its way, if that is known and there is room on the air."""
    now = see.percept["now_s"]
    data, length = see.percept["packet"][packet], see.percept["packet_length"][packet]
    sender = _sender(see, memory, talk, place_of(data))
    if not sender.known or not may_send(see, memory):
        return
    pause = talk.ask_s * (SHARE if memory["met_id"][sender.slot] == STRANGERS else 1.0)
    if now - memory["met_told_s"][sender.slot] < pause:
        return
    memory["met_told_s"][sender.slot] = now
    if talk.what == SCANS:
        tell_scan(see, memory, talk)
        return
    n = read_check(data, length, memory["talk_at"])
    _from_there(memory, sender.at, n, talk.cell_m)
    reach = talk.reach_m / talk.cell_m
    closed, u, v = closed_place(see, memory, talk.cell_m, memory["talk_at"], (n, reach))
    if closed:
        tell_closed(see, memory, talk, (u, v))


@jit_inner
def _take_in(see: View, memory: Row, talk: Talk, packet: int) -> None:
    """Take in what closes the way by another robot's map."""
    data, length = see.percept["packet"][packet], see.percept["packet_length"][packet]
    sender = _sender(see, memory, talk, place_of(data))
    if not sender.known:
        return
    n = read_closed(data, length, memory["talk_at"])
    _from_there(memory, sender.at, n, talk.cell_m)
    n = keep_news(memory, memory["talk_at"], n)
    if not hear(memory, memory["talk_at"], n, see.percept["now_s"], memory["met_id"][sender.slot]):
        return
    memory["heard"] += 1
    here = Spot(see.shared["x"] / talk.cell_m, see.shared["y"] / talk.cell_m)
    r = memory["disc_r"][LEAST]
    for k in range(n):
        if closes(memory, here, Spot(memory["talk_at"][k, 0], memory["talk_at"][k, 1]), r):
            memory["closed"] = 1
            memory["changed"] += 1
            return


@jit
def ask(see: View, memory: Row, talk: Talk, here: Spot) -> None:
    """Ask everybody who may hear it whether the way is closed, if there is reason to, and room on the air."""
    shared, out, now = see.shared, see.out, see.percept["now_s"]
    if memory["asked_s"] == NEVER_S:
        memory["asked_s"] = now - talk.ask_s * (1.0 - see.percept["id"] % TURNS / TURNS)  # not all at once
    since = now - memory["asked_s"]
    if talk.what == MAPS or since < talk.ask_s or memory["way_n"] == 0 or not may_send(see, memory):
        return
    anybody, new_face = _who_is_there(see, memory)
    if not anybody:
        return
    first = _first_new(memory, here, talk.cell_m)
    if since < talk.again_s and first < 0 and not new_face:
        return
    if first < 0 or new_face or since >= talk.again_s:
        first = 0
    n = _write_way(memory, here, first, talk.cell_m)
    if n < 2:
        return
    start_round(see)
    shared["asked_all"] = 1
    head = Head(see.percept["id"], see.percept["boot"], shared["asked_seq"], 0)
    for k in range(n):
        memory["talk_at"][k, 0] -= shared["x"]
        memory["talk_at"][k, 1] -= shared["y"]
    k = out["n_out"]
    length = encode_check(head, own_place(see, memory), memory["talk_at"], n, out["out"][k])
    if length > 0:
        send(see, memory, talk, length)
        memory["asked_s"] = now
        memory["asked"] += 1
        _note_asked(see, memory, here, talk.cell_m)


@jit_inner
def _tell_maps(see: View, memory: Row, talk: Talk) -> None:
    """Tell everybody who may hear it what is new, and all of it again to somebody new, and before it is forgotten."""
    shared, now = see.shared, see.percept["now_s"]
    anybody, new_face = _who_is_there(see, memory)
    for t in range(PEERS):
        if shared["track_id"][t] >= 0 and slot_of(memory, shared["track_id"][t]) < 0:
            note_heard(memory, shared["track_id"][t], now)
            new_face = True
    if not anybody:
        return
    if new_face or now - memory["sent_s"] > 0.5 * talk.keep_s:
        begin_anew(memory)
        _note_faces(see, memory)
        memory["sent_s"] = now
    here = Spot(shared["x"] / talk.cell_m, shared["y"] / talk.cell_m)
    if now - memory["asked_s"] >= talk.ask_s and not tell_map(see, memory, talk, here):
        memory["asked_s"] = now


@jit_inner
def _who_is_there(see: View, memory: Row) -> tuple[bool, bool]:
    """Return whether somebody may hear and understand us, and whether somebody is in sight that was not asked yet."""
    shared, anybody, new_face = see.shared, memory["frame_n"] > 0, False
    for t in range(PEERS):
        if shared["track_id"][t] >= 0:
            anybody = True
            k = slot_of(memory, shared["track_id"][t])
            new_face = new_face or (k >= 0 and memory["met_asked_s"][k] < 0.0)
    return anybody, new_face


@jit_inner
def _corners_ahead(memory: Row, here: Spot, cell_m: float) -> int:
    """Return how many corners of the way are asked about."""
    at, far, n = here, 0.0, 0
    while n < min(memory["way_n"], WAY_CORNERS - 1) and far < AHEAD_M / cell_m:
        to = Spot(memory["way_u"][n], memory["way_v"][n])
        far += math.sqrt((to.u - at.u) ** 2 + (to.v - at.v) ** 2)
        at = to
        n += 1
    return n


@jit_inner
def _first_new(memory: Row, here: Spot, cell_m: float) -> int:
    """Return the first corner of the way that was not asked about, as far as it is asked about; -1: all were."""
    for k in range(_corners_ahead(memory, here, cell_m)):
        same = False
        for j in range(memory["asked_n"]):
            du, dv = memory["asked_u"][j] - memory["way_u"][k], memory["asked_v"][j] - memory["way_v"][k]
            same = same or du * du + dv * dv < SAME * SAME
        if not same:
            return k
    return -1


@jit_inner
def _note_asked(see: View, memory: Row, here: Spot, cell_m: float) -> None:
    """Note which way has been asked about, and who was."""
    n = _corners_ahead(memory, here, cell_m)
    memory["asked_n"] = n
    for k in range(n):
        memory["asked_u"][k], memory["asked_v"][k] = memory["way_u"][k], memory["way_v"][k]
    _note_faces(see, memory)


@jit_inner
def _note_faces(see: View, memory: Row) -> None:
    """Note who in sight has been asked."""
    for t in range(PEERS):
        k = slot_of(memory, see.shared["track_id"][t])
        if k >= 0:
            memory["met_asked_s"][k] = see.percept["now_s"]


@jit_inner
def _write_way(memory: Row, here: Spot, first: int, cell_m: float) -> int:
    """Write the way from before its corner ``first`` into ``memory["talk_at"]`` [m]; return how many places."""
    at, far, n = here, 0.0, 0
    most = AHEAD_M / cell_m
    for k in range(memory["way_n"]):
        to = Spot(memory["way_u"][k], memory["way_v"][k])
        length = math.sqrt((to.u - at.u) ** 2 + (to.v - at.v) ** 2)
        if k >= first:
            if n == 0:
                memory["talk_at"][0, 0], memory["talk_at"][0, 1] = cell_m * at.u, cell_m * at.v
                n = 1
            part = min(1.0, max(0.0, most - far) / max(length, 1e-9))
            memory["talk_at"][n, 0] = cell_m * (at.u + part * (to.u - at.u))
            memory["talk_at"][n, 1] = cell_m * (at.v + part * (to.v - at.v))
            n += 1
        far += length
        at = to
        if n == WAY_CORNERS or far >= most:
            break
    return n
