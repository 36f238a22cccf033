"""What becomes of packets: good ones are used, all others are dropped and counted; no table overflows."""

from __future__ import annotations

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import one_robot, rig_of
from packets import (
    ANGLES,
    DISTANCES,
    RANGE_MAX,
    asked,
    dropped,
    features,
    header_of,
    latent,
    read,
    request,
    rows_of,
    sent,
)
from swarmscope.onboard.percept import MAX_INBOX, MAX_OUTBOX, PEERS, SHARED
from swarmscope.onboard.sharing.inbox import (
    OWN_ROOM,
    answer_all,
    ask,
    read_inbox,
    start_round,
    waiting_for_answers,
)
from swarmscope.onboard.sharing.message import (
    KIND_EXACT_FEATURES,
    KIND_FEATURES,
    KIND_REQUEST,
    MAX_FEATURES,
    MAX_PACKET_BYTES,
)
from swarmscope.onboard.sharing.peers import ANSWERS_PER_S
from swarmscope.onboard.view import new_swarm, python_view


def test_a_good_answer_is_remembered():
    rows = rows_of()
    seq = asked(rows, 5)
    row = read(rows, features(5, 40, seq))
    assert dropped(row) == (0, 0)
    slot = int(np.flatnonzero(row["heard_id"] == 5)[0])
    assert row["heard_n"][slot] == 3
    assert row["heard_angle"][slot, :3] == pytest.approx(ANGLES, abs=0.02)
    assert row["heard_distance"][slot, :3] == pytest.approx(DISTANCES, abs=0.02)
    assert row["answers_n"] == 1


def test_requests_wait_to_be_answered_for_this_tick_only():
    rows = rows_of()
    row = read(rows, request(5, 1), request(6, 9))
    assert row["ask_id"][: row["ask_n"]].tolist() == [5, 6]
    assert row["ask_name"][: row["ask_n"]].tolist() == [1, 9]
    assert read(rows)["ask_n"] == 0


@pytest.mark.parametrize("exact", [False, True])
def test_answers_name_the_request_and_carry_our_boot_number(exact):
    rows = rows_of(exact_features=exact, boot=0x4321)
    read(rows, request(5, 31, boot=0x0100), request(6, 777))
    own = rows.view.own
    own.angles[:3], own.distances[:3] = ANGLES, DISTANCES
    answer_all(rows.view, 3)
    out = sent(rows.decision)
    assert [to for to, _ in out] == [5, 6]
    kind = KIND_EXACT_FEATURES if exact else KIND_FEATURES
    headers = [header_of(packet) for _, packet in out]
    assert [h[0] for h in headers] == [kind, kind]
    assert [h[1] for h in headers] == [1, 1]
    assert [h[3] for h in headers] == [0x0100 + 31, 777]
    assert [h[5] for h in headers] == [0x4321, 0x4321]
    assert headers[0][2] != headers[1][2]


def test_requests_carry_our_address_our_boot_number_and_the_rounds_number():
    rows = rows_of(boot=0x4321)
    asked(rows, 4, 8)
    expected = [KIND_REQUEST, 1, 1, -1, -1, 0x4321]
    assert [(to, header_of(p)) for to, p in sent(rows.decision)] == [(4, expected), (8, expected)]


@given(st.integers(0, 17), st.integers(0, 7))
def test_a_corrupt_packet_is_dropped(byte, bit):
    rows = rows_of()
    packet = bytearray(features(5, 40, asked(rows, 5)))
    packet[byte] ^= 1 << bit
    row = read(rows, bytes(packet))
    assert dropped(row) == (1, 0)
    assert (row["heard_id"] == -1).all()


@pytest.mark.parametrize("length", range(18))
def test_a_truncated_packet_is_dropped(length):
    rows = rows_of()
    row = read(rows, features(5, 40, asked(rows, 5))[:length])
    assert dropped(row) == (1, 0)
    assert (row["heard_id"] == -1).all()


def test_a_foreign_packet_is_dropped():
    assert dropped(read(rows_of(), b"hello, this is not for you", bytes(20), b"\xff" * 140)) == (3, 0)


def test_our_own_packet_coming_back_is_dropped():
    row = read(rows_of(), request(1, 3))
    assert (dropped(row), int(row["ask_n"])) == ((0, 1), 0)


def test_a_replayed_packet_is_dropped():
    rows = rows_of()
    packet = features(5, 40, asked(rows, 5))
    assert dropped(read(rows, packet)) == (0, 0)
    row = read(rows, packet, packet)
    assert dropped(row) == (0, 2)
    assert row["answers_n"] == 1


def test_unasked_for_features_are_dropped():
    rows = rows_of()
    assert dropped(read(rows, features(5, 40, 0))) == (0, 1)
    seq = asked(rows, 5)
    assert dropped(read(rows, features(5, 41, seq + 1))) == (0, 2)
    assert dropped(read(rows, features(6, 41, seq))) == (0, 3)  # asked, but not this one


def test_an_answer_to_an_earlier_round_is_dropped():
    rows = rows_of()
    first = asked(rows, 5)
    asked(rows, 5)
    assert dropped(read(rows, features(5, 40, first))) == (0, 1)


def test_an_answer_that_comes_too_late_is_dropped():
    rows = rows_of(max_age_s=1.5)
    seq = asked(rows, 5)
    rows.percept["now_s"] += 1.6
    row = read(rows, features(5, 40, seq))
    assert dropped(row) == (0, 1)
    assert (row["heard_id"] == -1).all()


def test_features_are_forgotten_when_they_are_old():
    rows = rows_of(max_age_s=1.5)
    row = read(rows, features(5, 40, asked(rows, 5)))
    rows.percept["now_s"] += 1.4
    assert 5 in read(rows)["heard_id"]
    rows.percept["now_s"] += 0.2
    assert 5 not in read(rows)["heard_id"]
    assert dropped(row) == (0, 0)


def test_waiting_ends_with_the_last_answer_or_with_the_patience():
    rows = rows_of()
    assert not waiting_for_answers(rows.percept, rows.shared, 0.6)
    seq = asked(rows, 5, 6)
    read(rows, features(5, 40, seq))
    assert waiting_for_answers(rows.percept, rows.shared, 0.6)
    read(rows, features(6, 2, seq))
    assert not waiting_for_answers(rows.percept, rows.shared, 0.6)
    asked(rows, 5)
    rows.percept["now_s"] += 0.7
    assert not waiting_for_answers(rows.percept, rows.shared, 0.6)


def test_more_senders_than_slots_keep_being_heard():
    rows = rows_of()
    for sender in range(100, 100 + 5 * PEERS):
        rows.percept["now_s"] += 0.2
        row = read(rows, request(sender, 7))
        assert row["ask_id"][0] == sender
    assert dropped(row) == (0, 0)


def test_a_full_outbox_takes_no_more():
    rows = rows_of()
    asked(rows, *range(100, 100 + MAX_OUTBOX + 5))
    assert rows.decision["n_out"] == MAX_OUTBOX
    assert rows.shared["asked_n"] == MAX_OUTBOX
    read(rows, *(request(200 + k, 1) for k in range(MAX_INBOX)))
    answer_all(rows.view, 16)
    assert rows.decision["n_out"] == MAX_OUTBOX


@pytest.mark.parametrize("make", [features, latent])
def test_everybody_answers_once_and_nobody_who_was_not_asked(make):
    rows = rows_of()
    seq = asked(rows, 5, 6)
    row = read(rows, make(5, 40, seq), make(5, 41, seq), make(999, 7, seq), make(999, 8, seq))
    assert (int(row["answers_n"]), dropped(row)) == (1, (0, 3))
    assert waiting_for_answers(rows.percept, row, 0.6)
    row = read(rows, *[make(6, 50 + k, seq) for k in range(MAX_INBOX)])
    assert int(row["answers_n"]) == int(row["asked_n"]) == 2
    assert 999 not in row["heard_id"]
    assert int(row["latent_n"]) == (1 if make is latent else 0)


def test_an_answer_to_an_earlier_life_is_dropped():
    """After a restart the counter begins anew: only the boot number tells the rounds apart."""
    rows = rows_of(boot=0x1111)
    old = features(5, 40, asked(rows, 5))
    rows = rows_of(boot=0x2222)
    seq = asked(rows, 5)
    assert rows.shared["asked_seq"] == 1
    assert dropped(read(rows, old)) == (0, 1)
    assert dropped(read(rows, features(5, 41, seq))) == (0, 1)
    assert rows.shared["answers_n"] == 1


def test_a_sender_is_answered_once_a_tick_and_five_times_a_second():
    rows = rows_of()
    row = read(rows, *[request(5, k) for k in range(1, 5)])
    assert row["ask_id"][: row["ask_n"]].tolist() == [5]
    assert row["ask_name"][0] == 4  # the newest: older rounds of it are closed
    answered = []
    for k in range(60):
        rows.percept["now_s"] += 0.05
        answered.append(int(read(rows, request(5, 5 + k), request(6, k))["ask_n"]))
    in_a_second = [sum(answered[k : k + 20]) for k in range(0, 60, 20)]
    assert max(in_a_second) <= 2 * 2 * ANSWERS_PER_S
    assert sum(answered) <= 2 * ANSWERS_PER_S * 4
    assert sum(answered) >= 2 * ANSWERS_PER_S * 3 - 1


def test_eight_requests_of_others_leave_room_for_our_own():
    rows = rows_of()
    read(rows, *(request(100 + k, 1) for k in range(MAX_INBOX)))
    answer_all(rows.view, 4)
    assert rows.decision["n_out"] == MAX_OUTBOX
    seq = asked(rows, 2, 3)
    assert (int(rows.decision["n_out"]), int(rows.shared["asked_n"])) == (MAX_OUTBOX, 2)
    out = sent(rows.decision)
    assert [to for to, packet in out if header_of(packet)[0] == KIND_REQUEST] == [3, 2]
    assert [to for to, _ in out[:6]] == list(range(100, 106))
    row = read(rows, features(2, 1, seq), features(3, 1, seq))
    assert int(row["answers_n"]) == 2


def test_own_requests_leave_half_of_a_full_outbox_to_answers():
    rows = rows_of()
    read(rows, *(request(100 + k, 1) for k in range(MAX_INBOX)))
    answer_all(rows.view, 4)
    asked(rows, *range(2, 10))
    kinds = [header_of(packet)[0] for _, packet in sent(rows.decision)]
    assert (kinds.count(KIND_REQUEST), kinds.count(KIND_FEATURES)) == (OWN_ROOM, MAX_OUTBOX - OWN_ROOM)
    assert rows.shared["asked_n"] == OWN_ROOM


@pytest.mark.parametrize("wild", [-(2**62), -1, MAX_INBOX + 1, 2**62])
def test_wild_counts_are_clamped(wild):
    """No count is trusted, whoever filled it in: nothing beside the tables is read or written."""
    swarm = new_swarm(3, rig_of())
    before = [array.tobytes() for array in (swarm.percepts[1:], swarm.shared[1:], swarm.decisions[1:])]
    see = python_view(swarm, 0)
    see.percept["n_packets"] = wild
    see.percept["packet_length"] = wild
    read_inbox(see)
    assert dropped(see.shared) == (0 if wild < 0 else MAX_INBOX, 0)
    see.shared["ask_n"] = wild
    see.out["n_out"] = 0
    answer_all(see, wild)
    assert 0 <= see.out["n_out"] <= MAX_OUTBOX
    after = [array.tobytes() for array in (swarm.percepts[1:], swarm.shared[1:], swarm.decisions[1:])]
    assert after == before


GUARDED = [name for name in SHARED.names if name.startswith("track_")] + ["x", "y", "compass", "started"]
packets = st.one_of(
    st.binary(max_size=MAX_PACKET_BYTES),
    st.builds(request, st.integers(0, 65535), st.integers(0, 65535), st.integers(0, 65535)),
    st.builds(request, st.integers(0, 3), st.integers(0, 200), st.integers(0, 2)),
    st.builds(features, st.integers(0, 65535), st.integers(0, 65535), st.integers(0, 3)),
    st.builds(features, st.integers(4, 6), st.integers(0, 65535), st.integers(0, 12), st.integers(0, 2)),
    st.builds(latent, st.integers(4, 6), st.integers(0, 65535), st.integers(0, 12), st.integers(0, 2)),
)


@settings(max_examples=60)
@given(st.lists(st.lists(packets, max_size=MAX_INBOX), max_size=12))
def test_any_packets_in_any_order_leave_the_tables_whole(ticks):
    swarm = new_swarm(3, rig_of())
    see, given = python_view(swarm, 0), one_robot(swarm.rig)
    before = swarm.shared.copy()
    seen = 0
    for k, inbox in enumerate(ticks):
        given.fill(now_s=0.2 * k)
        given.receive(inbox)
        swarm.percepts[0] = given.percept
        swarm.decisions["n_out"] = 0
        start_round(see)
        ask(see, 5)
        ask(see, 6)
        guarded = [see.shared[name].tobytes() for name in GUARDED]
        read_inbox(see)
        row = see.shared
        assert [row[name].tobytes() for name in GUARDED] == guarded  # no packet moves what the guard looks at
        seen += len(inbox)
        assert 0 <= row["ask_n"] <= PEERS
        assert 0 <= row["answers_n"] <= row["asked_n"] == 2
        assert 0 <= row["latent_n"] <= 2
        senders = row["sender_id"][row["sender_id"] >= 0].tolist()
        assert len(senders) == len(set(senders))
        assert ((row["heard_n"] >= 0) & (row["heard_n"] <= MAX_FEATURES)).all()
        assert np.isfinite(row["heard_angle"]).all()
        assert ((row["heard_distance"] >= 0.0) & (row["heard_distance"] <= RANGE_MAX)).all()
        assert sum(dropped(row)) <= seen
        answer_all(see, 16)
        assert 0 <= see.out["n_out"] <= MAX_OUTBOX
        for _, packet in sent(see.out):
            header_of(packet)
    assert swarm.shared[1:].tobytes() == before[1:].tobytes()


def test_no_index_leaves_its_table():
    """The same stress with plain Python kernels, where numpy checks every index."""
    code = "import test_inbox as t; t.test_any_packets_in_any_order_leave_the_tables_whole()"
    here = os.path.dirname(__file__)
    path = os.pathsep.join([here, os.path.join(here, "..", ".."), *sys.path])
    environment = os.environ | {
        "NUMBA_DISABLE_JIT": "1",
        "PYTHONPATH": path,
        "PYTHONWARNINGS": "error::RuntimeWarning",
    }
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr[-3000:]
