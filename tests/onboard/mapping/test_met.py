"""Whom a robot has heard lately."""

from __future__ import annotations

from swarmscope.onboard.mapping.memory import new_memory
from swarmscope.onboard.mapping.met import MET, NOBODY, note_heard, slot_of
from swarmscope.onboard.percept import NEVER_S


def test_who_was_heard_is_found_again_with_what_was_noted():
    memory = new_memory(1)[0]
    assert slot_of(memory, 0) == NOBODY
    k = note_heard(memory, 7, 1.0)
    memory["met_told_s"][k] = 1.5
    assert note_heard(memory, 8, 2.0) != k
    assert note_heard(memory, 7, 3.0) == slot_of(memory, 7) == k
    assert memory["met_told_s"][k] == 1.5


def test_who_was_not_heard_for_longest_gives_way_with_all_that_was_noted():
    memory = new_memory(1)[0]
    for address in range(MET):
        k = note_heard(memory, address, 10.0 + address)
        memory["met_told_s"][k] = memory["met_asked_s"][k] = 10.0
    note_heard(memory, 0, 99.0)
    k = note_heard(memory, 500, 100.0)
    assert slot_of(memory, 1) == NOBODY
    assert all(slot_of(memory, address) >= 0 for address in (0, 2, MET - 1, 500))
    assert memory["met_told_s"][k] == memory["met_asked_s"][k] == NEVER_S
