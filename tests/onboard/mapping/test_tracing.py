"""Whether a way is closed, and what is told of what closes it."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from drawn_maps import map_of
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import one_robot, rig_of
from swarmscope.onboard.mapping.answering import closed_place
from swarmscope.onboard.mapping.heard import hear, is_told_closed
from swarmscope.onboard.mapping.memory import TALK
from swarmscope.onboard.mapping.tracing import JOINED, apart, trace
from swarmscope.onboard.sharing.message import Head
from swarmscope.onboard.sharing.way_message import CELL_M, Place, encode_closed, read_closed

FAR = 1000.0
Y = 20
WALL = [(ix, Y) for ix in range(-48, 49)]


@pytest.fixture
def see():
    bot = one_robot(rig_of(), "atlas")
    bot.scan[:] = 0.01  # nothing is seen to be free
    return bot.view


def closed(see, memory, *corners, reach=FAR):
    corners = np.array(corners, np.float64)
    return closed_place(see, memory, CELL_M, corners, (len(corners), reach))


def traced(see, memory, place, most=TALK, reach=FAR):
    n = trace(see, memory, CELL_M, place, (most, reach))
    return [tuple(cell) for cell in memory["talk_cell"][:n].tolist()]


@pytest.mark.parametrize("slant", [90, 60, 45, 30, 20])
def test_a_wall_closes_a_way_at_any_slant(see, slant):
    u, v = 30.0 * math.cos(math.radians(slant)), 30.0 * math.sin(math.radians(slant))
    found, at_u, at_v = closed(see, map_of(*WALL), (-u, Y - v), (u, Y + v))
    assert found
    assert abs(at_v - Y) < 4.0
    assert abs(at_u) < 4.0 / math.tan(math.radians(slant)) + 4.0


@pytest.mark.parametrize("slant", [90, 60, 45])
@pytest.mark.parametrize("aside", [-4, 0, 4])
def test_a_door_a_little_beside_the_way_is_left_open(see, slant, aside):
    u, v = 30.0 * math.cos(math.radians(slant)), 30.0 * math.sin(math.radians(slant))
    memory = map_of(*[cell for cell in WALL if abs(cell[0] - aside) > 8])
    assert not closed(see, memory, (-u, Y - v), (u, Y + v))[0]


def test_a_way_along_a_wall_is_left_open(see):
    assert not closed(see, map_of(*WALL), (-30.0, Y + 2.5), (30.0, Y + 2.5))[0]


def test_what_is_beyond_reach_is_not_looked_at(see):
    memory = map_of(*WALL)
    assert not closed(see, memory, (0.0, 0.0), (0.0, 40.0), reach=15.0)[0]
    assert closed(see, memory, (0.0, 0.0), (0.0, 40.0), reach=25.0)[0]


def test_a_straight_wall_is_told_in_equal_steps(see):
    told = traced(see, map_of(*WALL), (10.5, Y + 0.5))
    assert {y for _, y in told} == {Y}
    steps = [b[0] - a[0] for a, b in itertools.pairwise(told)]
    step = math.ceil(apart(map_of()))
    assert 96 // step <= len(told) <= 96 // step + 1
    assert set(steps) in ({step}, {-step})


def test_the_nearest_of_it_is_told_both_ways(see):
    told = traced(see, map_of(*WALL), (10.5, Y + 0.5), most=9)
    assert len(told) == 9
    assert min(x for x, _ in told) <= 10 - 9
    assert max(x for x, _ in told) >= 10 + 9
    assert traced(see, map_of(*WALL), (10.5, Y + 0.5), most=0) == []


def test_what_is_not_joined_to_it_is_left(see):
    other = [(ix, Y + 10) for ix in range(-48, 49)]
    assert {y for _, y in traced(see, map_of(*WALL, *other), (10.5, Y + 0.5))} == {Y}
    assert traced(see, map_of(*WALL), (10.5, Y + 20.5)) == []


PLACES = st.tuples(st.integers(-40, 40), st.integers(-40, 40)).filter(lambda cell: math.hypot(*cell) > 4.0)
"""Not under the robot."""
CELLS = st.sets(PLACES, min_size=1)


def joined(cells, first):
    """What belongs to the same thing as a cell."""
    thing, new = {first}, [first]
    while new:
        x, y = new.pop()
        beside = {cell for cell in cells - thing if max(abs(cell[0] - x), abs(cell[1] - y)) <= JOINED}
        thing |= beside
        new += beside
    return thing


@settings(deadline=None, max_examples=60)
@given(CELLS, st.integers(1, TALK))
def test_everything_is_near_a_told_cell_unless_there_are_too_many(cells, most):
    bot = one_robot(rig_of(), "atlas")
    bot.scan[:] = 0.01
    memory = map_of(*cells)
    first = min(cells)
    told = traced(bot.view, memory, (first[0] + 0.5, first[1] + 0.5), most)
    thing = joined(cells, first)
    assert 0 < len(told) == len(set(told)) <= most
    assert set(told) <= thing
    assert all(math.dist(a, b) >= apart(memory) for k, a in enumerate(told) for b in told[:k])
    if len(told) < most:
        assert all(min(math.dist(cell, other) for other in told) < apart(memory) for cell in thing)


def test_the_walls_of_a_room_fit_into_sixty_bytes(see):
    room = [(ix, y) for ix in range(-48, 49) for y in (-32, 32)] + [(x, iy) for iy in range(-32, 33) for x in (-48, 48)]
    memory = map_of(*room)
    n = trace(see, memory, CELL_M, (20.5, 32.5), (100, FAR))
    assert n >= 72  # of 20 m
    out = np.zeros(60, np.uint8)
    length = encode_closed(Head(1, 2, 3, 4), Place(0.0, 0.0, 1), memory["talk_cell"], n, out, 60)
    assert read_closed(out, length, np.zeros((TALK, 2), np.float32)) == n


@pytest.mark.parametrize("radius", [1.2, 1.7, 2.2, 3.2, 5.0])
@pytest.mark.parametrize(("width", "height"), [(40, 49), (31, 22), (18, 37)])
def test_nothing_gets_through_the_walls_of_a_room(see, radius, width, height):
    room = [(ix, y) for ix in range(10, 10 + width) for y in (0, height)]
    room += [(x, iy) for iy in range(height) for x in (10, 10 + width)]
    memory, other = map_of(*room, radius=radius), map_of(radius=radius)
    told = np.array(traced(see, memory, (10.5, 0.5)), np.float64) + 0.5
    assert hear(other, told, len(told), 0.0, 3)
    if len(told) < TALK:
        assert all(is_told_closed(other, x + 0.5, y + 0.5) for x, y in room)
