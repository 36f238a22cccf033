"""Requests and answers: what to do with packets that came in, whom to ask, what to answer (Nav-SCOPE IV-B).

Bad packets (torn, corrupt, foreign) and stale ones (replayed, older than the newest of the sender, answers
to a question that is no longer open) are dropped and counted; nothing here raises or waits.
"""

from __future__ import annotations

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner, jit_paste
from swarmscope.onboard.percept import MAX_OUTBOX, PEERS, Row
from swarmscope.onboard.sharing.message import (
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
    read_features,
    seq_newer,
)
from swarmscope.onboard.view import View


@jit
def read_inbox(see: View) -> None:
    """Take in this tick's packets: remember features heard, who asks for ours, and which packets are LATENT answers.

    The last are left to the planner that asked for them. ``see.header`` and ``see.other`` are scratch.
    """
    percept, shared, header = see.percept, see.shared, see.header
    now = percept["now_s"]
    shared["ask_n"] = 0
    shared["latent_n"] = 0
    _forget_old_features(shared, now, see.rig.sharing.max_age_s)
    for k in range(percept["n_packets"]):
        data = percept["packet"][k]
        length = percept["packet_length"][k]
        if decode(data, length, header) != OK:
            shared["dropped_bad"] += 1
            continue
        if header[1] == percept["id"] or not _is_new(shared, header[1], header[2]):
            shared["dropped_stale"] += 1
            continue
        if is_request(header[0]):
            _note_request(shared, header)
            continue
        if header[3] != shared["asked_seq"] or now - shared["asked_s"] > see.rig.sharing.max_age_s:
            shared["dropped_stale"] += 1
            continue
        if header[0] == KIND_LATENT:
            shared["latent_at"][shared["latent_n"]] = k
            shared["latent_n"] += 1
            continue
        heard = see.other
        count = read_features(data, length, see.rig.sensor.range_max, heard.angles, heard.distances)
        _remember(shared, header[1], count, heard.angles, heard.distances)


@jit_inner
def _forget_old_features(shared: Row, now: float, max_age_s: float) -> None:
    """Forget features that were asked for too long ago."""
    for p in range(PEERS):
        if shared["heard_id"][p] >= 0 and now - shared["heard_s"][p] > max_age_s:
            shared["heard_id"][p] = -1


@jit_inner
def _note_request(shared: Row, header: np.ndarray) -> None:
    """Note who asks for our features, and in which direction."""
    if shared["ask_n"] < PEERS:
        directed = header[0] == KIND_DIRECTED_REQUEST
        shared["ask_direction"][shared["ask_n"]] = header[4] if directed else -1
        shared["ask_id"][shared["ask_n"]] = header[1]
        shared["ask_seq"][shared["ask_n"]] = header[2]
        shared["ask_n"] += 1


@jit_inner
def _is_new(shared: Row, sender: int, seq: int) -> bool:
    """Tell whether ``seq`` is newer than everything accepted from ``sender``, and note it."""
    slot = -1
    for p in range(PEERS):
        if shared["last_seq_id"][p] == sender:
            if not seq_newer(seq, shared["last_seq"][p]):
                return False
            slot = p
            break
        if slot < 0 and shared["last_seq_id"][p] < 0:
            slot = p
    if slot < 0:
        slot = sender % PEERS
    shared["last_seq_id"][slot] = sender
    shared["last_seq"][slot] = seq
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
    shared["answers_n"] += 1
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
    shared["answers_n"] = 0


@jit
def ask(see: View, peer: int) -> None:
    """Put a request to ``peer`` of the current round into the outbox (left out when that is full)."""
    k = see.out["n_out"]
    if k >= MAX_OUTBOX:
        return
    see.out["out_length"][k] = encode_request(see.percept["id"], see.shared["asked_seq"], see.out["out"][k])
    _asked(see, peer)


@jit
def ask_direction(see: View, peer: int, direction: float) -> None:
    """Ask ``peer`` what it sees in ``direction`` [rad, compass frame] (left out when the outbox is full)."""
    k = see.out["n_out"]
    if k >= MAX_OUTBOX:
        return
    see.out["out_length"][k] = encode_directed_request(
        see.percept["id"], see.shared["asked_seq"], direction, see.out["out"][k]
    )
    _asked(see, peer)


@jit_inner
def _asked(see: View, peer: int) -> None:
    """Close the request that was written last."""
    see.out["out_to"][see.out["n_out"]] = peer
    see.out["n_out"] += 1
    see.shared["asked_n"] += 1


@jit_inner
def _answer_head(see: View, q: int) -> Head:
    """Return the head of an answer to the ``q``-th of those who ask, addressed in the outbox."""
    shared = see.shared
    shared["seq"] = (shared["seq"] + 1) & 0xFFFF
    see.out["out_to"][see.out["n_out"]] = shared["ask_id"][q]
    return Head(see.percept["id"], shared["seq"], shared["ask_seq"][q])


@jit
def answer_directed(see: View, q: int, codes: np.ndarray, scale_code: int) -> None:
    """Answer the ``q``-th of those who ask with a network's features ``codes (128,)`` uint8."""
    k = see.out["n_out"]
    if k >= MAX_OUTBOX:
        return
    head = _answer_head(see, q)
    see.out["out_length"][k] = encode_latent(head, codes, scale_code, see.out["out"][k])
    see.out["n_out"] = k + 1


@jit
def answer_all(see: View, count: int) -> None:
    """Answer everybody who asked with our ``count`` features ``see.own``."""
    own = see.own
    for q in range(see.shared["ask_n"]):
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
