"""Ways through drawn maps: short, open, found whenever there are any, and the same by search and by flood."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drawn_maps import length_of, map_of, over_nodes, ring, way_of

from swarmscope.onboard.mapping.cells import FULL, PHASES, is_open, node_place, open_way, set_cell
from swarmscope.onboard.mapping.flood import flood
from swarmscope.onboard.mapping.kept import keep, review
from swarmscope.onboard.mapping.memory import KEPT, used_bytes
from swarmscope.onboard.mapping.pages import block
from swarmscope.onboard.mapping.search import FOUND, NOT_FOUND, shortest
from swarmscope.onboard.mapping.way import (
    find_shorter,
    find_way,
    forget_and_find,
    is_on_way,
    nearest_open,
    shorten,
    tighten,
    way_length,
)
from swarmscope.onboard.mapping.words import Spot

START, GOAL = (-60.0, 0.0), (60.0, 1.0)
WALL = [(0, y) for y in range(-30, 31)]


def check_open(memory, start):
    """Every leg of the way is open."""
    corners = way_of(memory)
    for a, b in zip([start, *corners], corners, strict=False):
        assert open_way(memory, *a, *b), (a, b)


def test_with_nothing_in_the_way_the_goal_is_the_only_corner():
    memory = map_of()
    assert shortest(memory, *START, *GOAL) == FOUND
    assert way_of(memory) == [GOAL]


@pytest.mark.parametrize("finder", [shortest, flood])
def test_a_way_round_a_wall_is_nearly_as_short_as_can_be(finder):
    memory = map_of(*WALL)
    assert finder(memory, *START, *GOAL)
    tighten(memory, *START)
    check_open(memory, START)
    best = math.hypot(60.0, 33.7) + math.hypot(60.0, 32.7)  # round the end that is nearer to the goal
    assert best - 1.0 < length_of(START, way_of(memory)) < best + 1.5
    assert all(v > 0.0 for _, v in way_of(memory)[:-1])


def random_map(rng):
    cells = rng.integers(-90, 90, (int(rng.integers(50, 700)), 2))
    return map_of(*cells)


@pytest.mark.parametrize("seed", range(40))
def test_search_and_flood_find_a_way_when_there_is_one(seed):
    rng = np.random.default_rng(seed)
    memory = random_map(rng)
    nodes = [(int(x), int(y)) for x, y in rng.integers(-24, 24, (60, 2)) if node_place(memory, int(x), int(y))[0]]
    a, b = nodes[:2]
    start, goal = node_place(memory, *a)[1:], node_place(memory, *b)[1:]
    far = over_nodes(memory, a)
    if shortest(memory, *start, *goal) == FOUND:
        tighten(memory, *start)
        check_open(memory, start)
        assert length_of(start, way_of(memory)) >= math.dist(start, goal) - 1e-6
    assert flood(memory, *start, *goal) == (b in far)
    if b in far:
        assert way_of(memory)[-1] == goal
        tighten(memory, *start)
        assert math.dist(start, goal) - 1e-6 <= length_of(start, way_of(memory)) <= 1.1 * far[b] + 2.0


def test_out_of_a_closed_ring_there_is_no_way():
    memory = map_of(*ring(30.0))
    assert shortest(memory, 0.0, 0.0, 100.0, 0.0) == NOT_FOUND
    assert not flood(memory, 0.0, 0.0, 100.0, 0.0)
    assert not flood(memory, 100.0, 0.0, 0.0, 0.0)
    assert memory["way_n"] == 0


@pytest.mark.parametrize("finder", [shortest, flood])
def test_out_of_an_open_ring_the_way_leads_through_the_gap(finder):
    memory = map_of(*ring(30.0, gap=0.5))
    assert finder(memory, 0.0, 0.0, 100.0, 0.0)
    tighten(memory, 0.0, 0.0)
    check_open(memory, (0.0, 0.0))
    assert min(u for u, _ in way_of(memory)) < -20.0


def test_a_flood_reaches_far_beyond_what_is_known():
    memory = map_of(*ring(30.0, gap=0.5))
    assert flood(memory, 0.0, 0.0, 3000.0, 0.0)
    assert way_of(memory)[-1] == (3000.0, 0.0)


def test_a_map_that_closes_everything_is_forgotten_in_the_stated_order():
    here, goal = Spot(0.0, 0.0), Spot(100.0, 0.0)
    memory = map_of(*ring(30.0, gap=0.5))
    assert forget_and_find(memory, here, goal) == 0
    memory["stand_n"], memory["stand_u"][0], memory["stand_r"][0] = 1, -30.0, 12.0
    assert forget_and_find(memory, here, goal) == 1
    assert memory["stand_n"] == 1
    narrow = map_of(*ring(30.0, gap=0.17))
    assert forget_and_find(narrow, here, goal) == 2
    assert (narrow["room"], narrow["disc_r"][FULL]) == (FULL, pytest.approx(3.2))
    shut = map_of(*ring(30.0))
    assert forget_and_find(shut, here, goal) == 3
    assert not shut["fine"].any()
    assert way_of(shut) == [(100.0, 0.0)]


def test_a_gap_that_was_too_narrow_is_tried_again_when_nothing_else_is_open():
    here, goal = Spot(0.0, 0.0), Spot(100.0, 0.0)
    memory = map_of(*ring(30.0, gap=0.5))
    keep(memory, Spot(-30.0, 0.0), 8.0, 60.0)
    assert not find_way(memory, here, goal)
    review(memory, 59.0)
    assert memory["kept_n"] == 1
    assert forget_and_find(memory, here, goal) == 2
    assert memory["kept_n"] == 0
    keep(memory, Spot(-30.0, 0.0), 8.0, 60.0)
    review(memory, 60.0)
    assert (memory["kept_n"], memory["opened"]) == (0, 1)
    assert forget_and_find(memory, here, goal) == 0


def test_more_gaps_than_can_be_kept_push_out_the_one_that_ends_first():
    memory = map_of()
    for k in range(KEPT + 1):
        keep(memory, Spot(20.0 * k, 0.0), 4.0, 60.0 - k)
    assert memory["kept_n"] == KEPT
    assert is_open(memory, 20.0 * (KEPT - 1), 0.0)
    assert not is_open(memory, 20.0 * KEPT, 0.0)
    keep(memory, Spot(1.0, 0.0), 4.0, 99.0)
    assert memory["kept_n"] == KEPT
    assert memory["kept_s"].max() == 99.0


@pytest.mark.parametrize("shift", range(4))
def test_a_gap_between_the_nodes_is_found_wherever_it_lies(shift):
    """A hole of 8 cells in a wall across the whole map, for a disc of 6.4: the flood's nodes may miss it."""
    wall = [(x, y) for x in (40, 41) for y in range(-110, 110) if not shift <= y < shift + 8]
    memory = map_of(*wall)
    found = []
    for phase in range(PHASES):
        memory["phase"] = phase
        found.append(bool(flood(memory, 0.0, 0.0, 80.0, 0.0)) and length_of((0.0, 0.0), way_of(memory)) < 100.0)
    assert any(found)


def test_who_is_a_little_beside_an_open_leg_is_on_its_way():
    """Between two things the next corner is in sight from one line only."""
    memory = map_of((20, 3), (20, -4))
    memory["way_n"], memory["way_u"][0] = 1, 40.0
    assert is_on_way(memory, Spot(10.0, 0.0))
    assert not open_way(memory, 14.0, 1.5, 40.0, 0.0)
    assert is_on_way(memory, Spot(14.0, 1.5))
    assert not is_on_way(memory, Spot(14.0, 4.0))
    set_cell(memory, 30, 0)
    assert not is_on_way(memory, Spot(14.0, 1.5))


def test_who_is_a_little_beside_where_it_fits_counts_as_being_there():
    memory = map_of((0, 0))
    assert nearest_open(memory, Spot(30.0, 0.0), 3) == Spot(30.0, 0.0)
    there = nearest_open(memory, Spot(2.9, 0.5), 3)
    assert is_open(memory, there.u, there.v)
    assert math.dist(there, (2.9, 0.5)) <= 1.0
    assert nearest_open(memory, Spot(0.5, 0.5), 2) == Spot(0.5, 0.5)


def test_a_goal_that_is_not_open_is_gone_to_as_near_as_can_be():
    memory = map_of((60, 0), (61, 1))
    assert find_way(memory, Spot(0.0, 0.0), Spot(60.0, 1.0))
    before_last, last = way_of(memory)[-2:]
    assert last == (60.0, 1.0)
    assert is_open(memory, *before_last)
    assert 2.0 < math.dist(before_last, last) < 5.0


def test_another_way_is_taken_only_when_it_is_shorter_by_enough():
    here, goal = Spot(-60.0, 0.0), Spot(60.0, 0.0)
    memory = map_of(*WALL)
    memory["way_n"] = 2
    memory["way_u"][:2], memory["way_v"][:2] = (0.0, 60.0), (-35.0, 0.0)
    long = way_length(memory, here)
    find_shorter(memory, here, goal, 10.0)
    assert way_length(memory, here) == long
    memory["way_v"][0] = -60.0
    find_shorter(memory, here, goal, 10.0)
    assert way_length(memory, here) < long + 1.0


def test_corners_that_are_reached_or_passed_are_dropped():
    memory = map_of(*WALL)
    assert find_way(memory, Spot(*START), Spot(*GOAL))
    corner = way_of(memory)[-2]
    shorten(memory, Spot(*START))
    assert way_of(memory)[-2] == corner
    shorten(memory, Spot(corner[0] + 3.0, corner[1]))
    assert way_of(memory) == [GOAL]


def test_a_place_of_64_m_takes_less_than_64_kB():
    memory = map_of()
    for kx in range(-128, 128, 4):
        for ky in range(-128, 128):
            block(memory, kx, ky, True, False)
    assert flood(memory, 0.0, 0.0, 500.0, 500.0)
    assert used_bytes(memory) <= 64_000
    memory["budget"] = 1.0  # with what is for asking others
    assert 64_000 < used_bytes(memory) <= 80_000
