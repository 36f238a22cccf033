"""Requests and answers: what to do with packets that came in, whom to ask, what to answer (Nav-SCOPE IV-B).

Bad packets (torn, corrupt, foreign) and stale ones (replayed, unasked for, answers to a question that is no longer
open) are dropped and counted; nothing here raises or waits. Nothing here trusts a packet either: who has not been asked
in the present round is not listened to, but for what closes ways, which is for all; nobody is answered more often than
``peers.ANSWERS_PER_S``, and requests of others leave room in the outbox for our own.
"""

from __future__ import annotations

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner, jit_paste
from swarmscope.onboard.percept import MAX_INBOX, MAX_OUTBOX, PEERS, Row
from swarmscope.onboard.sharing.message import (
    KIND_CHECK,
    KIND_CLOSED,
    KIND_DIRECTED_REQUEST,
    KIND_LATENT,
    OK,
    Head,
    decode,
    encode_directed_request,
    encode_exact_features,
    encode_features,
    encode_latent,
    encode_request,
    is_request,
    name_of,
    read_features,
)
from swarmscope.onboard.sharing.peers import may_answer, note_answer, take_request
from swarmscope.onboard.sharing.window import ahead_by
from swarmscope.onboard.view import View

OWN_LAST, LATE_S = 8, 10.0
"""An answer to one of our questions of so many packets ago is late; then none to others are heard for so long."""
OWN_ROOM = 4
"""So many requests of our own have room in the outbox of a tick, whatever else is in it."""


@jit_inline
def read_inbox(see: View) -> None:
    """Take in this tick's packets: remember features heard, who asks for ours, and which packets are LATENT answers.

    The last are left to the planner that asked for them. ``see.header`` and ``see.other`` are scratch.
    """
    percept, shared, header = see.percept, see.shared, see.header
    now = percept["now_s"]
    shared["ask_n"] = 0
    shared["latent_n"] = shared["told_n"] = 0
    _forget_old_features(shared, now, see.rig.sharing.max_age_s)
    for k in range(min(MAX_INBOX, percept["n_packets"])):
        data = percept["packet"][k]
        length = percept["packet_length"][k]
        if decode(data, length, header) != OK:
            shared["dropped_bad"] += 1
            continue
        if header[1] == percept["id"]:
            shared["dropped_stale"] += 1
            continue
        if header[0] in (KIND_CHECK, KIND_CLOSED):
            if _is_told(see, header):
                shared["told_at"][shared["told_n"]] = k
                shared["told_n"] += 1
            else:
                shared["dropped_stale"] += 1
            continue
        if is_request(header[0]):
            if not _note_request(see, header):
                shared["dropped_stale"] += 1
            continue
        if not _is_wanted(see, header):
            shared["dropped_stale"] += 1
            continue
        note_answer(see, header)
        shared["answers_n"] += 1
        if header[0] == KIND_LATENT:
            shared["latent_at"][shared["latent_n"]] = k
            shared["latent_n"] += 1
            continue
        heard = see.other
        count = read_features(data, length, see.rig.sensor.range_max, heard.angles, heard.distances)
        _remember(shared, header[1], count, heard.angles, heard.distances)


@jit_inner
def _is_told(see: View, header: np.ndarray) -> bool:
    """Tell whether a packet about ways is left to planners that keep a map: a new question, or an answer to anybody."""
    if header[0] == KIND_CHECK:
        return take_request(see, header) >= 0
    if not _is_wanted(see, header):
        return _is_overheard(see, header)
    note_answer(see, header)
    see.shared["answers_n"] += 1
    return True


@jit_inner
def _is_overheard(see: View, header: np.ndarray) -> bool:
    """Tell whether this is a new answer to somebody else, and answers are in time.

    They are not while those to our own last questions come when we do not wait for them any more: who says where it is
    says where it was long ago.
    """
    percept, shared = see.percept, see.shared
    if take_request(see, header) < 0:
        return False
    since = ahead_by(shared["asked_seq"], name_of(percept["boot"], header[3]))
    if shared["asked_seq"] >= 0 and 0 <= since < OWN_LAST:
        if since > 0 or percept["now_s"] - shared["asked_s"] > see.rig.sharing.max_age_s:
            shared["late_s"] = percept["now_s"]
        return False
    return bool(percept["now_s"] - shared["late_s"] > LATE_S)


@jit_inner
def _forget_old_features(shared: Row, now: float, max_age_s: float) -> None:
    """Forget features that were asked for too long ago."""
    for p in range(PEERS):
        if shared["heard_id"][p] >= 0 and now - shared["heard_s"][p] > max_age_s:
            shared["heard_id"][p] = -1


@jit_inner
def _note_request(see: View, header: np.ndarray) -> bool:
    """Note who asks for our features, and in which direction; return whether it is answered."""
    shared = see.shared
    slot = take_request(see, header)
    if slot < 0:
        return False
    q = 0
    while q < shared["ask_n"] and shared["ask_id"][q] != header[1]:
        q += 1
    if q == shared["ask_n"]:
        if q >= PEERS or not may_answer(see, slot):
            return False
        shared["ask_n"] = q + 1
    shared["ask_direction"][q] = header[4] if header[0] == KIND_DIRECTED_REQUEST else -1
    shared["ask_id"][q] = header[1]
    shared["ask_name"][q] = name_of(header[5], header[2])
    return True


@jit_inner
def _is_wanted(see: View, header: np.ndarray) -> bool:
    """Tell whether an answer is one to the present round of somebody who has not answered it yet, and note that."""
    percept, shared = see.percept, see.shared
    if shared["asked_seq"] < 0 or percept["now_s"] - shared["asked_s"] > see.rig.sharing.max_age_s:
        return False
    if header[3] != name_of(percept["boot"], shared["asked_seq"]):
        return False
    for a in range(min(MAX_OUTBOX, shared["asked_n"])):
        if shared["asked_id"][a] == header[1]:
            first = shared["asked_done"][a] == 0
            shared["asked_done"][a] = 1
            return bool(first)
    if header[0] != KIND_CLOSED or shared["asked_all"] == 0 or shared["asked_n"] >= MAX_OUTBOX:
        return False
    a = shared["asked_n"]  # who answers is noted now
    shared["asked_id"][a], shared["asked_done"][a] = header[1], 1
    shared["asked_n"] = a + 1
    return True


@jit_inner
def _remember(shared: Row, sender: int, count: int, angles: np.ndarray, distances: np.ndarray) -> None:
    """Store the features of ``sender``, in its slot, a free one, or the oldest."""
    slot = -1
    oldest = 0
    for p in range(PEERS):
        if shared["heard_id"][p] == sender:
            slot = p
            break
        if slot < 0 and shared["heard_id"][p] < 0:
            slot = p
        if shared["heard_s"][p] < shared["heard_s"][oldest]:
            oldest = p
    if slot < 0:
        slot = oldest
    shared["heard_id"][slot] = sender
    shared["heard_s"][slot] = shared["asked_s"]
    shared["heard_n"][slot] = count
    for j in range(count):
        shared["heard_angle"][slot, j] = angles[j]
        shared["heard_distance"][slot, j] = distances[j]


@jit_paste
def start_round(see: View) -> None:
    """Begin a new round of requests; answers to earlier rounds are stale from here on."""
    shared = see.shared
    shared["seq"] = (shared["seq"] + 1) & 0xFFFF
    shared["asked_seq"] = shared["seq"]
    shared["asked_s"] = see.percept["now_s"]
    shared["asked_n"] = 0
    shared["asked_all"] = 0
    shared["answers_n"] = 0


@jit
def ask(see: View, peer: int) -> None:
    """Put a request to ``peer`` of the current round into the outbox (left out when our own requests fill it)."""
    k = _room_to_ask(see)
    if k < 0:
        return
    see.out["out_length"][k] = encode_request(_request_head(see), see.out["out"][k])
    _asked(see, k, peer)


@jit
def ask_direction(see: View, peer: int, direction: float) -> None:
    """Ask ``peer`` what it sees in ``direction`` [rad, compass frame]; as ``ask``."""
    k = _room_to_ask(see)
    if k < 0:
        return
    see.out["out_length"][k] = encode_directed_request(_request_head(see), direction, see.out["out"][k])
    _asked(see, k, peer)


@jit
def room_to_ask(see: View, owed: int) -> int:
    """Return how many can be asked in this tick so that ``owed`` answers have room, too, or half of the outbox each."""
    room = MAX_OUTBOX - min(MAX_OUTBOX, max(0, see.out["n_out"]))
    return int(max(room - owed, min(room, OWN_ROOM)))


@jit_inner
def _room_to_ask(see: View) -> int:
    """Return the place of our next request in the outbox, -1 if there is none.

    When the outbox is full, and ``OWN_ROOM`` of our requests are not in it, the last answer gives way.
    """
    if see.shared["asked_n"] >= MAX_OUTBOX:
        return -1
    n = int(see.out["n_out"])
    if n < MAX_OUTBOX:
        return n
    own, answer = 0, -1
    for k in range(MAX_OUTBOX):
        if is_request(see.out["out"][k, 0]):
            own += 1
        else:
            answer = k
    return answer if own < OWN_ROOM else -1


@jit_inner
def _request_head(see: View) -> Head:
    """Return the head of the present round's requests."""
    return Head(see.percept["id"], see.percept["boot"], see.shared["asked_seq"], 0)


@jit_inner
def _asked(see: View, k: int, peer: int) -> None:
    """Close the request that was written to place ``k`` of the outbox."""
    shared, out = see.shared, see.out
    out["out_to"][k] = peer
    out["n_out"] = max(out["n_out"], k + 1)
    shared["asked_id"][shared["asked_n"]], shared["asked_done"][shared["asked_n"]] = peer, 0
    shared["asked_n"] += 1


@jit_inner
def _answer_head(see: View, q: int) -> Head:
    """Return the head of an answer to the ``q``-th of those who ask, addressed in the outbox."""
    shared = see.shared
    shared["seq"] = (shared["seq"] + 1) & 0xFFFF
    see.out["out_to"][see.out["n_out"]] = shared["ask_id"][q]
    return Head(see.percept["id"], see.percept["boot"], shared["seq"], shared["ask_name"][q])


@jit
def answer_directed(see: View, q: int, codes: np.ndarray, scale_code: int) -> None:
    """Answer the ``q``-th of those who ask with a network's features ``codes (128,)`` uint8."""
    k = see.out["n_out"]
    if k >= MAX_OUTBOX or q < 0 or q >= PEERS:
        return
    head = _answer_head(see, q)
    see.out["out_length"][k] = encode_latent(head, codes, scale_code, see.out["out"][k])
    see.out["n_out"] = k + 1


@jit_inline
def answer_all(see: View, count: int) -> None:
    """Answer everybody who asked with our ``count`` features ``see.own``."""
    own = see.own
    for q in range(min(PEERS, see.shared["ask_n"])):
        k = see.out["n_out"]
        if k >= MAX_OUTBOX:
            return
        head, packet = _answer_head(see, q), see.out["out"][k]
        if see.rig.sharing.exact_features:
            length = encode_exact_features(head, own.angles, own.distances, count, packet)
        else:
            length = encode_features(head, own.angles, own.distances, count, see.rig.sensor.range_max, packet)
        see.out["out_length"][k] = length
        see.out["n_out"] = k + 1


@jit_inline
def waiting_for_answers(percept: Row, shared: Row, patience: float) -> bool:
    """Tell whether answers to a round younger than ``patience`` [s] are still out."""
    return bool(shared["answers_n"] < shared["asked_n"] and percept["now_s"] - shared["asked_s"] < patience)
