"""Narrow places: gone through when that saves enough, remembered where the body was, given up where it did not fit."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_maps import map_of, ring, way_of

from swarmscope.onboard.mapping.cells import (
    FULL,
    LEAST,
    LESS,
    ask_for,
    draw_discs,
    is_open,
    is_seen_open,
    move_fine_layer,
    set_cell,
)
from swarmscope.onboard.mapping.kept import find_narrow, give_up_once, keep, review
from swarmscope.onboard.mapping.pages import block, is_blocked, is_slim
from swarmscope.onboard.mapping.tight import Terms, find_tighter, note_gone
from swarmscope.onboard.mapping.trail import close_round, note_passed
from swarmscope.onboard.mapping.way import find_way, forget_and_find
from swarmscope.onboard.mapping.words import Spot

HERE, GOAL = Spot(-40.0, 0.5), Spot(40.0, 0.5)
FREELY = Terms(4.8, 4.5, 16.0)


def wall(free):
    """A wall across the way, thick and long, with ``free`` cells left open in its middle."""
    low, high = -(free // 2), free - free // 2
    thick = [(x, y) for x in range(4) for y in range(-50, 51) if not low <= y < high]
    memory = map_of(*thick)
    draw_discs(memory, 3.2, 2.7)
    memory["straight"] = 130.0  # as long as the way round the wall, about: no way has become longer yet
    return memory


def is_through(memory):
    """Whether the way stays near the straight line."""
    return all(abs(v) < 8.0 for _, v in way_of(memory))


def test_a_gap_for_the_guard_alone_is_gone_through_when_that_saves_enough():
    memory = wall(free=5)  # 6 between the middles of cells; 5.4 are wanted by the guard, 6.4 with the margin
    assert find_way(memory, HERE, GOAL)
    assert not is_through(memory)
    before = way_of(memory)
    find_tighter(memory, HERE, GOAL, Terms(1000.0, 0.0, 0.0))
    np.testing.assert_allclose(way_of(memory), before, atol=1e-5)
    assert (memory["way_room"], memory["room"]) == (FULL, FULL)
    find_tighter(memory, HERE, GOAL, FREELY)
    assert is_through(memory)
    assert (memory["way_room"], memory["room"]) == (LEAST, FULL)


def test_a_gap_that_the_guard_closes_is_left_alone():
    memory = wall(free=4)  # 5 between the middles of cells: least room finds a way there, 5.4 do not fit
    assert find_way(memory, HERE, GOAL)
    find_tighter(memory, HERE, GOAL, FREELY)
    assert not is_through(memory)


def test_what_only_the_place_layer_says_of_less_room_is_no_gap():
    memory = wall(free=0)
    for ky in range(-1, 1):
        for kx in range(-1, 2):
            block(memory, kx, ky, True, True)
    ask_for(memory, LESS)
    assert is_open(memory, 2.0, 0.5)
    assert not is_seen_open(memory, 2.0, 0.5)
    ask_for(memory, FULL)
    assert find_way(memory, HERE, GOAL)
    find_tighter(memory, HERE, GOAL, FREELY)
    assert not is_through(memory)


def test_nobody_squeezes_past_somebody_who_stands():
    memory = wall(free=5)
    memory["stand_n"], memory["stand_u"][0], memory["stand_r"][0] = 1, -90.0, 6.0
    assert find_way(memory, HERE, GOAL)
    find_tighter(memory, HERE, GOAL, FREELY)
    assert not is_through(memory)


@pytest.mark.parametrize(("gone", "through"), [(0.0, True), (60.0, False)])
def test_a_robot_whose_ways_have_become_longer_wants_more_for_its_trouble(gone, through):
    memory = wall(free=5)
    memory["gone"] = gone
    assert find_way(memory, HERE, GOAL)
    find_tighter(memory, HERE, GOAL, FREELY)
    assert is_through(memory) == through


def test_how_far_a_robot_has_gone_is_counted():
    memory = map_of()
    for u in (0.0, 0.4, 0.8, 1.2, 3.2):
        note_gone(memory, Spot(u, 0.0), GOAL)
    assert memory["gone"] == pytest.approx(3.2)
    assert memory["straight"] == pytest.approx(40.0, abs=0.01)


def test_where_the_body_has_been_less_room_does_though_the_map_closes_it_later():
    memory = map_of((10, 5), (10, -5))
    draw_discs(memory, 3.2, 2.7)
    for u in range(-40, 41):
        note_passed(memory, float(u), 0.5)
    for y in range(-60, 61):
        set_cell(memory, 10, y)
    move_fine_layer(memory, 400, 0)
    assert is_blocked(memory, 2, 0)
    assert is_slim(memory, 2, 0)
    assert not is_slim(memory, 2, 5)
    assert not is_slim(memory, -10, 0)  # nothing stands there
    ask_for(memory, LESS)
    assert all(is_open(memory, 0.5 * k, 0.5) for k in range(-40, 41))
    close_round(memory, 10.0, 0.5, 4.0)
    assert not is_open(memory, 10.0, 0.5)
    assert is_blocked(memory, 2, 0)


def test_no_node_beside_a_thin_wall_is_taken_for_a_gap():
    """What is seen from one side is at least 2.4 cells deep: nodes either side of that stay apart."""
    memory = map_of(*[(x, y) for x in range(-60, 61) for y in (0, 1, 2)])
    draw_discs(memory, 3.2, 2.7)
    move_fine_layer(memory, 400, 0)
    for kx in range(-12, 13):
        near = [ky for ky in range(-2, 3) if is_blocked(memory, kx, ky) and not is_slim(memory, kx, ky)]
        assert near, kx
    ask_for(memory, LEAST)
    assert not find_way(memory, Spot(2.0, -12.0), Spot(2.0, 12.0)) or any(abs(u) > 50.0 for u, _ in way_of(memory))


def test_a_gap_is_kept_closed_for_twice_as_long_each_time():
    memory = map_of()
    now = 0.0
    for times in range(4):
        find_narrow(memory, Spot(20.0, 0.0), 4.0, now, 60.0)
        now += 60.0 * 2.0**times
        review(memory, now - 0.1)
        assert not is_open(memory, 20.0, 0.0)
        review(memory, now)
        assert is_open(memory, 20.0, 0.0)


def test_only_gaps_that_were_too_narrow_once_are_tried_again():
    memory = map_of()
    keep(memory, Spot(-20.0, 0.0), 4.0, 60.0)
    find_narrow(memory, Spot(0.0, 0.0), 4.0, 0.0, 60.0)
    find_narrow(memory, Spot(20.0, 0.0), 4.0, 0.0, 60.0)
    find_narrow(memory, Spot(20.0, 0.0), 4.0, 1.0, 60.0)
    give_up_once(memory)
    assert [is_open(memory, u, 0.0) for u in (-20.0, 0.0, 20.0)] == [True, True, False]


def test_a_gap_that_was_too_narrow_twice_is_forgotten_with_all_else():
    here, goal = Spot(0.0, 0.0), Spot(100.0, 0.0)
    memory = map_of(*ring(30.0, gap=0.5))
    for now in (0.0, 1.0):
        find_narrow(memory, Spot(-30.0, 0.0), 8.0, now, 60.0)
    assert not find_way(memory, here, goal)
    assert forget_and_find(memory, here, goal) == 3
    assert memory["kept_n"] == 0
