"""A frame for all: who meets takes over the one with the lower name, and two that share one stay together."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import one_robot, rig_of
from swarmscope.onboard.mapping.frames import (
    FAR_OFF_M,
    USUAL,
    agree,
    frame_name,
    is_shared,
    keep_frame,
    own_place,
    spot_of,
)
from swarmscope.onboard.sharing.way_message import CELL_M, FRAMES, PLACE_M, Place

WITHIN = 100.0


class Bot:
    """A robot of which only the frame counts: ``at`` is where it is, its own frame's origin lies at ``origin``."""

    def __init__(self, address, origin=(0.0, 0.0), at=(0.0, 0.0)):
        bot = one_robot(rig_of(), "atlas", address, share=1)
        self.view, self.memory = bot.view, bot.memory
        self.view.percept["boot"] = 17 * address
        self.origin = np.array(origin, np.float64)
        self.go(*at)
        keep_frame(self.view, self.memory, WITHIN)

    def go(self, x, y):
        self.at = np.array([x, y])
        self.view.shared["x"], self.view.shared["y"] = self.at - self.origin
        return self

    @property
    def name(self):
        return int(self.memory["frame"])

    @property
    def says(self):
        return own_place(self.view, self.memory)

    def sees(self, other):
        """Whether it believes what another says that it sees."""
        return agree(self.memory, other.says, *(other.at - self.origin))

    def places(self, other):
        """Where it takes another to be that it does not see, by what that says."""
        assert is_shared(self.memory, other.says)
        spot = spot_of(self.view, self.memory, other.says, CELL_M)
        return np.array(spot) * CELL_M + self.origin


def meet(*bots, times=1):
    for _ in range(times):
        for a, b in itertools.permutations(bots, 2):
            a.sees(b)


def test_a_robot_begins_in_its_own_frame():
    bot = Bot(3)
    assert bot.name == frame_name(3, 51)
    assert tuple(bot.says) == (0.0, 0.0, bot.name)
    assert bot.memory["frame_n"] == 0


def test_the_lower_name_wins_and_everybody_behind_a_wall_is_understood():
    low, middle, high = Bot(1, (5.0, 1.0), (6.0, 2.0)), Bot(2, (-3.0, 9.0), (4.0, 4.0)), Bot(3, (0.0, -7.0), (2.0, 3.0))
    meet(high, middle)
    assert high.name == middle.name != low.name
    meet(middle, low)
    meet(high, middle)
    assert {bot.name for bot in (low, middle, high)} == {frame_name(1, 17)}
    for a, b in itertools.permutations((low, middle, high), 2):  # low and high have not met
        assert np.abs(a.places(b) - b.at).max() <= PLACE_M


@settings(deadline=None, max_examples=30)
@given(st.lists(st.tuples(*[st.floats(-200.0, 200.0)] * 4), min_size=2, max_size=6), st.randoms(use_true_random=False))
def test_in_whatever_order_robots_meet_they_come_to_one_frame(where, random):
    bots = [Bot(k + 1, (a, b), (c, d)) for k, (a, b, c, d) in enumerate(where)]
    order = list(itertools.pairwise(bots)) * len(bots)
    random.shuffle(order)
    for a, b in order:
        meet(a, b)
    for a, b in list(itertools.pairwise(bots)) * len(bots):
        meet(a, b)
    assert len({bot.name for bot in bots}) == 1
    for a, b in itertools.permutations(bots, 2):
        assert np.abs(a.places(b) - b.at).max() <= 6.0 * PLACE_M


def test_places_wrap_round():
    a, b = Bot(1, (1000.0, 0.0), (1000.0, 0.0)), Bot(2, (-900.0, 0.0), (990.0, 0.0))
    meet(a, b)
    assert np.abs(a.places(b) - b.at).max() <= PLACE_M
    assert np.abs(b.places(a) - a.at).max() <= PLACE_M


def test_frames_that_drift_apart_are_drawn_together():
    a, b = Bot(1), Bot(2)
    meet(a, b, times=USUAL)
    a.origin += [0.8, 0.0]  # a has slipped
    a.go(*a.at)
    meet(a, b, times=10)
    assert np.abs(a.places(b) - b.at).max() < 0.1
    assert np.abs(b.places(a) - a.at).max() < 0.1


def test_who_says_that_it_is_elsewhere_is_not_believed_and_moves_nothing():
    a, b, lies = Bot(1), Bot(2), Bot(3)
    meet(a, b, lies, times=USUAL)
    before = a.says
    lies.memory["frame_x"] += FAR_OFF_M + 0.1
    for _ in range(3):
        assert not a.sees(lies)
    assert a.says == before
    assert a.sees(b)


@pytest.mark.parametrize("gone", [0.0, 1e6])
def test_who_has_slipped_is_understood_again_also_whose_frame_it_is(gone):
    owner, other = Bot(1), Bot(2)
    meet(owner, other, times=USUAL)
    owner.origin += [FAR_OFF_M + 0.5, 0.0]
    owner.go(*owner.at)
    owner.memory["gone"] = gone
    meet(owner, other, times=USUAL)
    assert owner.sees(other)
    assert other.sees(owner)
    assert np.abs(owner.places(other) - other.at).max() <= 0.1


def test_what_is_no_number_is_not_believed():
    a, b = Bot(1), Bot(2)
    meet(a, b)
    assert not agree(a.memory, Place(0.0, 0.0, a.name), float("nan"), 0.0)
    assert not agree(a.memory, Place(0.0, 0.0, 1), 0.0, float("inf"))
    assert np.isfinite(a.memory["frame_x"])


def test_who_has_gone_far_alone_begins_anew_and_agrees_again():
    a, b = Bot(1, (5.0, 5.0), (5.0, 5.0)), Bot(2)
    meet(a, b)
    b.memory["gone"] = WITHIN
    keep_frame(b.view, b.memory, WITHIN)
    assert b.name == a.name
    b.memory["gone"] = WITHIN + 1.0
    keep_frame(b.view, b.memory, WITHIN)
    assert b.name == frame_name(2, 34)
    assert b.memory["frame_n"] == 0
    assert not is_shared(b.memory, a.says)
    a.memory["gone"] = 1e6  # whose frame it is goes on in it
    keep_frame(a.view, a.memory, WITHIN)
    assert a.name == frame_name(1, 17)
    meet(a, b)
    assert np.abs(b.places(a) - a.at).max() <= PLACE_M


@settings(deadline=None)
@given(st.integers(0, 65535), st.integers(0, 65535))
def test_names_are_never_nought(address, boot):
    assert 0 < frame_name(address, boot) < FRAMES


def test_a_name_is_of_one_robot_and_one_life():
    names = {frame_name(address, boot) for address in range(40) for boot in range(0, 65536, 997)}
    assert len(names) == 40 * len(range(0, 65536, 997))


@pytest.mark.parametrize("frame", [0, 5])
def test_a_place_in_another_frame_is_not_shared(frame):
    assert not is_shared(Bot(1).memory, Place(0.0, 0.0, frame))
