"""Replays, restarts and forged numbers: what is taken of a sender, and how long a forger can keep it unheard."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from packets import asked, dropped, features, read, request, rows_of
from swarmscope.onboard.percept import SENDERS
from swarmscope.onboard.sharing.peers import ANSWERS_PER_S, FORGET_S, QUIET_S, STRANGERS_PER_S


class Listener:
    """A robot that hears requests one at a time, each a while after the last."""

    def __init__(self, every_s=0.3, boot=0):
        self.rows, self.every_s = rows_of(boot=boot), every_s

    def hears(self, *packets):
        """How many of the packets are taken, a tick each."""
        return sum(self.takes(packet) for packet in packets)

    def takes(self, packet):
        self.rows.percept["now_s"] += self.every_s
        before = dropped(self.rows.shared)[1]
        row = read(self.rows, packet)
        assert dropped(row)[0] == 0
        assert int(row["ask_n"]) == 1 - (dropped(row)[1] - before)
        return int(row["ask_n"])


def test_a_peer_that_restarts_is_heard_from_its_second_packet():
    listener = Listener()
    assert listener.hears(*[request(2, seq, boot=7) for seq in range(480, 500)]) == 20
    taken = [listener.takes(request(2, seq, boot=9)) for seq in range(1, 20)]
    assert taken == [0] + [1] * 18


def test_a_peer_that_was_silent_meanwhile_is_heard_from_its_first_packet():
    listener = Listener()
    listener.hears(request(2, 500, boot=7))
    listener.rows.percept["now_s"] += QUIET_S
    assert listener.hears(*[request(2, seq, boot=9) for seq in range(1, 20)]) == 19


def test_a_restart_with_the_same_boot_number_by_chance_is_a_replay():
    """One in 65536; it is deaf to us until its counter has passed the old one."""
    listener = Listener()
    listener.hears(*[request(2, seq, boot=7) for seq in range(480, 500)])
    assert listener.hears(*[request(2, seq, boot=7) for seq in range(1, 400)]) == 0


@pytest.mark.parametrize("forged", [request(2, 100 + 32767, 7), request(2, 100 + 32769, 7), request(2, 5, 8)])
def test_one_forged_jump_costs_nothing(forged):
    listener = Listener()
    assert listener.hears(request(2, 100, boot=7)) == 1
    assert listener.hears(forged) == 0
    assert listener.hears(*[request(2, (100 + k) & 0xFFFF, boot=7) for k in range(1, 2001)]) == 2000


def test_one_forged_jump_after_a_silence_opens_a_window_and_costs_nothing():
    listener = Listener()
    listener.hears(request(2, 100, boot=7))
    listener.rows.percept["now_s"] += 5.0
    assert listener.hears(request(2, 30_000, boot=7)) == 1
    assert listener.hears(*[request(2, 100 + k, boot=7) for k in range(1, 2001)]) == 2000


def test_two_forged_packets_in_a_row_open_a_window_and_cost_nothing():
    listener = Listener()
    listener.hears(request(2, 100, boot=7))
    assert listener.hears(request(2, 30_000, boot=7), request(2, 30_001, boot=7)) == 1
    assert listener.hears(*[request(2, 100 + k, boot=7) for k in range(1, 2001)]) == 2000


def test_many_forged_jumps_take_one_anothers_window():
    """The true sender said more, and not long ago: its window stays."""
    listener = Listener()
    listener.hears(*[request(2, seq, boot=7) for seq in range(90, 101)])
    for k in range(20):
        listener.hears(request(2, 2000 + 1000 * k, boot=7), request(2, 2001 + 1000 * k, boot=7))
    assert listener.hears(*[request(2, 101 + k, boot=7) for k in range(1000)]) == 1000


def test_a_jump_within_the_window_costs_the_number_it_takes():
    listener = Listener()
    listener.hears(request(2, 100, boot=7))
    assert listener.hears(request(2, 163, boot=7)) == 1
    taken = [listener.takes(request(2, 100 + k, boot=7)) for k in range(1, 200)]
    assert taken == [0 if k == 63 else 1 for k in range(1, 200)]


def creep(listener):
    """Forge packets that push the window on until the true sender's numbers are behind it."""
    assert listener.hears(*[request(2, 100 + 60 * k, boot=7) for k in range(1, 40)]) == 39


def test_a_creeping_forger_silences_requests_until_the_peer_answers_us():
    listener = Listener()
    listener.hears(request(2, 100, boot=7))
    creep(listener)
    assert listener.hears(*[request(2, 101 + k, boot=7) for k in range(50)]) == 0
    name = asked(listener.rows, 2)
    assert int(read(listener.rows, features(2, 151, name, boot=7))["answers_n"]) == 1
    assert listener.hears(*[request(2, 152 + k, boot=7) for k in range(50)]) == 50
    assert listener.hears(*[request(2, 101 + k, boot=7) for k in range(50)]) == 0  # no older ones after that


def test_a_creeping_forger_does_not_silence_a_peer_that_restarts():
    listener = Listener()
    listener.hears(request(2, 100, boot=7))
    creep(listener)
    assert listener.hears(*[request(2, 1 + k, boot=8) for k in range(50)]) == 49


def test_a_replay_is_rejected_directly_and_after_ten_other_senders():
    listener = Listener(0.05)
    packet = request(2, 50, boot=7)
    assert listener.hears(packet) == 1
    assert listener.hears(packet) == 0
    assert listener.hears(*[request(100 + k, 1) for k in range(10)]) == 10
    assert listener.hears(packet) == 0


def test_who_is_in_sight_keeps_its_slot_whatever_addresses_are_made_up():
    listener = Listener()
    listener.rows.shared["track_id"][3] = 2
    packet = request(2, 50, boot=7)
    assert listener.hears(packet) == 1
    assert listener.hears(*[request(1000 + k, 1) for k in range(3 * SENDERS)]) == 3 * SENDERS
    assert listener.hears(packet) == 0
    assert listener.hears(request(1000, 1)) == 1  # nobody knows it any more: the oldest gave way


def test_packets_that_overtake_one_another_pass_once():
    listener = Listener()
    order = [10, 12, 11, 12, 11, 9, 14, 13]
    assert [listener.takes(request(2, seq, boot=7)) for seq in order] == [1, 1, 1, 0, 0, 1, 1, 1]


def test_numbers_wrap():
    listener = Listener()
    order = [65530, 65529, 3, 65535, 65530, 3, 0]
    assert [listener.takes(request(2, seq, boot=7)) for seq in order] == [1, 1, 1, 1, 0, 0, 1]


def test_an_earlier_life_is_rejected_until_its_window_is_forgotten():
    """Then two of its packets in a row are taken for a restart: an answer too many, no more."""
    old = [request(2, seq, boot=7) for seq in range(1, 30)]
    new = [request(2, seq, boot=8) for seq in range(1, 30)]
    listener = Listener()
    assert listener.hears(*old) == 29
    assert listener.hears(*new) == 28
    assert listener.hears(*old) == 0
    listener.rows.percept["now_s"] += FORGET_S
    assert listener.hears(*[request(2, seq, boot=9) for seq in range(1, 30)]) == 29
    assert listener.hears(*old) == 28
    assert listener.hears(*[request(2, seq, boot=9) for seq in range(30, 60)]) >= 29


def test_the_share_of_one_sender_is_counted_anew_every_second():
    listener = Listener(0.01)
    taken = [int(bool(listener.takes(request(2, k, boot=7)))) for k in range(1, 101)]
    assert sum(taken) == ANSWERS_PER_S
    assert taken[:ANSWERS_PER_S] == [1] * ANSWERS_PER_S
    listener.rows.percept["now_s"] += 1.0
    assert listener.takes(request(2, 101, boot=7)) == 1


def test_made_up_addresses_share_what_is_not_for_those_in_sight():
    """Eight strangers a tick: 16 answers a second for all of them, and the neighbour gets its own."""
    rows = rows_of()
    rows.shared["track_id"][0] = 2
    answered, own = 0, 0
    for k in range(25):
        rows.percept["now_s"] += 0.2
        forged = [request(1000 + 7 * k + j, 1) for j in range(7)]
        row = read(rows, *forged, request(2, k + 1, boot=7))
        asking = row["ask_id"][: row["ask_n"]].tolist()
        own += 2 in asking
        answered += len([who for who in asking if who != 2])
    assert own == 25
    assert answered == 5 * STRANGERS_PER_S


@settings(deadline=None, max_examples=50)
@given(
    st.integers(0, 65535),
    st.lists(st.integers(1, 20), min_size=5, max_size=60),
    st.lists(st.tuples(st.integers(0, 60), st.booleans()), max_size=40),
)
def test_nothing_heard_in_a_life_is_taken_again(first, steps, replays):
    """A sender with gaps, replays of anything before: each number is taken once, whenever it comes again."""
    listener = Listener(0.3)
    numbers = np.cumsum([first, *steps]) & 0xFFFF
    told = []
    for k, number in enumerate(numbers.tolist()):
        packet = request(2, number, boot=7)
        assert listener.takes(packet) == 1
        told.append(packet)
        for at, late in replays:
            if at == k:
                listener.rows.percept["now_s"] += 2.0 * QUIET_S if late else 0.0
                assert listener.takes(told[(7 * at) % len(told)]) == 0
