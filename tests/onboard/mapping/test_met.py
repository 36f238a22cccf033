"""Where the frames of others lie: from what they say while they are in sight, and for as long as that holds."""

from __future__ import annotations

import numpy as np
import pytest

from swarmscope.onboard.mapping.memory import new_memory
from swarmscope.onboard.mapping.met import MET, NOBODY, is_known, known_at, note_met, slot_of
from swarmscope.onboard.mapping.words import Spot
from swarmscope.onboard.sharing.way_message import Place

CELL = 0.0625


def met(memory, address, theirs, ours, boot=1):
    return note_met(memory, (address, boot), Place(*theirs), Spot(*ours), CELL)


def test_somebody_who_was_met_is_found_where_it_says_it_is():
    memory = new_memory(1)[0]
    k = met(memory, 7, (2.0, 3.0), (16.0, -32.0))
    assert slot_of(memory, 7) == k
    assert slot_of(memory, 8) == NOBODY
    assert tuple(known_at(memory, k, Place(3.0, 2.0), CELL)) == pytest.approx((32.0, -48.0))


def test_places_wrap_round():
    memory = new_memory(1)[0]
    k = met(memory, 7, (1023.5, 0.5), (0.0, 0.0))
    assert tuple(known_at(memory, k, Place(0.5, 1023.5), CELL)) == pytest.approx((16.0, -16.0))


def test_the_shift_is_the_mean_of_what_is_measured():
    memory = new_memory(1)[0]
    rng = np.random.default_rng(0)
    for _ in range(200):
        x = rng.uniform(0.0, 10.0)
        k = met(memory, 7, (x, 0.0), (x / CELL + rng.normal(0.0, 2.0), 0.0))
    assert abs(known_at(memory, k, Place(5.0, 0.0), CELL).u - 80.0) < 2.0
    met(memory, 7, (5.0, 0.0), (96.0, 0.0))  # one that is a metre off moves it by an eighth
    assert known_at(memory, k, Place(5.0, 0.0), CELL).u == pytest.approx(80.0 + 16.0 / 8.0, abs=2.0)


def test_who_says_that_it_is_elsewhere_is_not_believed_and_forgotten_when_that_goes_on():
    memory = new_memory(1)[0]
    for _ in range(8):
        k = met(memory, 7, (5.0, 0.0), (80.0, 0.0))
    assert met(memory, 7, (500.0, 0.0), (80.0, 0.0)) == NOBODY
    assert known_at(memory, k, Place(5.0, 0.0), CELL).u == 80.0
    for _ in range(3):
        assert met(memory, 7, (500.0, 0.0), (80.0, 0.0)) == NOBODY
    assert met(memory, 7, (500.0, 0.0), (80.0, 0.0)) == k
    assert known_at(memory, k, Place(500.0, 0.0), CELL).u == 80.0


def test_who_has_restarted_has_a_new_frame():
    memory = new_memory(1)[0]
    k = met(memory, 7, (50.0, 0.0), (0.0, 0.0))
    assert is_known(memory, k, 1, 10.0)
    assert not is_known(memory, k, 2, 10.0)
    assert met(memory, 7, (0.0, 0.0), (0.0, 0.0), boot=2) == k
    assert tuple(known_at(memory, k, Place(1.0, 0.0), CELL)) == (16.0, 0.0)


def test_who_has_gone_far_since_does_not_know_any_more():
    memory = new_memory(1)[0]
    memory["gone"] = 5.0
    k = met(memory, 7, (0.0, 0.0), (0.0, 0.0))
    memory["gone"] = 15.0
    assert is_known(memory, k, 1, 10.0)
    memory["gone"] = 15.5
    assert not is_known(memory, k, 1, 10.0)


def test_who_was_met_longest_ago_gives_way():
    memory = new_memory(1)[0]
    for address in range(MET):
        memory["gone"] = 10.0 + address
        met(memory, address, (0.0, 0.0), (0.0, 0.0))
    memory["gone"] = 99.0
    met(memory, 0, (0.0, 0.0), (0.0, 0.0))
    met(memory, 500, (0.0, 0.0), (0.0, 0.0))
    assert slot_of(memory, 1) == NOBODY
    assert all(slot_of(memory, address) >= 0 for address in (0, 2, MET - 1, 500))
