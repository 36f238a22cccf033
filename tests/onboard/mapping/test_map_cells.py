"""The two layers of the map: what the disc fits beside, and what is kept when the robot goes away and comes back."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drawn_maps import RADIUS, map_of
from hypothesis import given
from hypothesis import strategies as st

from swarmscope.onboard.mapping.cells import (
    FULL,
    LESS,
    NODE,
    WIDE,
    ask_for,
    block_round,
    clear_cell,
    draw_discs,
    fits,
    forget_all,
    is_near,
    is_open,
    is_set,
    move_fine_layer,
    node_place,
    open_way,
    set_cell,
)
from swarmscope.onboard.mapping.pages import DIRECTORY, PAGES, block, is_blocked, is_slim

CELLS = st.integers(-100, 100)
PLACES = st.floats(-110.0, 110.0)


@given(st.sets(st.tuples(CELLS, CELLS), max_size=30), PLACES, PLACES, st.floats(2.1, 7.5))
def test_a_disc_fits_where_no_cells_middle_is_nearer_than_its_radius(cells, u, v, radius):
    memory = map_of(*cells, radius=radius)
    nearest = min((math.hypot(x + 0.5 - u, y + 0.5 - v) for x, y in cells), default=math.inf)
    if abs(nearest - radius) > 0.18:  # places count to a quarter of a cell
        assert fits(memory, u, v) == (nearest > radius)


@given(st.sets(st.tuples(CELLS, CELLS), min_size=1, max_size=30))
def test_cells_are_set_and_cleared_one_by_one(cells):
    memory = map_of(*cells)
    for cell in cells:
        assert is_set(memory, *cell)
        clear_cell(memory, *cell)
        assert not is_set(memory, *cell)
    assert not memory["fine"].any()


@pytest.mark.parametrize(("ex", "ey"), [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1)])
def test_a_wall_is_still_there_when_the_robot_comes_back(ex, ey):
    wall = [(x, 20) for x in range(-60, 61)]
    memory = map_of(*wall)
    for k in range(1, 600):
        move_fine_layer(memory, k * ex, k * ey)
    assert not is_near(memory, 0, 20)
    assert all(not node_place(memory, kx, 4)[0] or not node_place(memory, kx, 5)[0] for kx in range(-15, 15))
    assert fits(memory, 0.5, 40.0)
    for k in range(600, -1, -1):
        move_fine_layer(memory, k * ex, k * ey)
    assert is_near(memory, 0, 20)
    assert not open_way(memory, 0.0, 0.0, 0.0, 40.0)
    assert open_way(memory, 0.0, 0.0, 0.0, 12.0)


@pytest.mark.parametrize(("ex", "ey"), [(1, 0), (-1, 0), (0, 1), (0, -1)])
@pytest.mark.parametrize("nodes", [20, 32, 51])
def test_an_ablation_forgets_what_is_farther_away(ex, ey, nodes):
    memory = map_of(*((x, y) for x in range(-20, 21, 4) for y in range(-20, 21, 4)))
    memory["forget_n"] = nodes
    reach = max(nodes, 30) * NODE  # never less than the fine layer
    near, far = reach - 2 * WIDE // 8, reach + WIDE // 8
    for k in range(near):
        move_fine_layer(memory, k * ex, k * ey)
    assert not fits(memory, 0.5, 0.5)
    for k in range(near, far):
        move_fine_layer(memory, k * ex, k * ey)
    assert not is_near(memory, 0, 0)
    assert fits(memory, 0.5, 0.5)
    assert not memory["rows"].any()
    block_round(memory, 0.5, 0.5)
    assert fits(memory, 0.5, 0.5)
    block_round(memory, (far - 135) * ex + 0.5, (far - 135) * ey + 0.5)
    assert memory["rows"].any() == (nodes > 34)


def test_what_has_gone_for_good_does_not_come_back():
    memory = map_of(*((x, 20) for x in range(-60, 61)))
    for k in range(300):
        move_fine_layer(memory, 0, -k)
    for k in range(300, -1, -1):
        move_fine_layer(memory, 0, -k)
    for ix in range(-70, 70):
        for iy in range(10, 30):
            clear_cell(memory, ix, iy)
    for k in range(300):
        move_fine_layer(memory, 0, -k)
    assert all(fits(memory, 0.5, float(v)) for v in range(10, 30))


@given(st.floats(-2000.0, 2000.0), st.floats(-2000.0, 2000.0))
def test_a_far_hit_blocks_the_nodes_round_it(u, v):
    memory = map_of()
    block_round(memory, u, v)
    kx, ky = math.floor(u / NODE), math.floor(v / NODE)
    for x in range(kx - 2, kx + 3):
        for y in range(ky - 2, ky + 3):
            near = math.hypot(NODE * x + 2 - u, NODE * y + 2 - v) < RADIUS
            assert is_blocked(memory, x, y) == near


def test_the_farthest_page_makes_room_for_a_new_one():
    memory = map_of()
    nodes = [(64 * (k % 15), 64 * (k // 15)) for k in range(PAGES + 30)]
    for kx, ky in nodes:
        block(memory, kx, ky, True, False)
    assert memory["pages_n"] == PAGES
    assert is_blocked(memory, *nodes[-1])
    assert sum(is_blocked(memory, *node) for node in nodes) == PAGES


def test_what_lies_a_directory_away_takes_the_same_place():
    memory = map_of()
    block(memory, 5, 5, True, False)
    block(memory, 5 + DIRECTORY * 64, 5, True, False)
    assert is_blocked(memory, 5 + DIRECTORY * 64, 5)
    assert not is_blocked(memory, 5, 5)


def test_who_stands_is_in_the_way_but_not_in_the_map():
    memory = map_of()
    memory["stand_n"], memory["stand_u"][0], memory["stand_r"][0] = 1, 20.0, 5.0
    assert fits(memory, 20.0, 0.0)
    assert not is_open(memory, 20.0, 0.0)
    assert not open_way(memory, 0.0, 0.0, 40.0, 0.0)
    assert open_way(memory, 0.0, 6.0, 40.0, 6.0)


def test_a_gap_that_is_hardly_wider_than_the_robot_lies_beside_a_node():
    gap = [(x, y) for x in range(-40, 41) for y in (2, 3) if not 0 <= x <= 5]
    memory = map_of(*gap, radius=3.0)
    ok, u, _ = node_place(memory, 0, 0)
    assert ok
    assert u == 2.75
    assert not fits(memory, 2.0, 2.0)


def test_what_less_room_would_do_for_is_remembered_where_the_fine_layer_has_left():
    """Four things 2.9 cells off a node: the disc of 3.2 does not fit there, that of 2.6 does."""
    memory = map_of((0, -1), (3, -1), (0, 4), (3, 4))
    draw_discs(memory, 3.2, 2.6)
    assert (fits(memory, 2.0, 2.0), is_slim(memory, 0, 0)) == (False, False)
    move_fine_layer(memory, 400, 0)
    assert is_blocked(memory, 0, 0)
    assert is_slim(memory, 0, 0)
    for at in (400, 0):
        move_fine_layer(memory, at, 0)
        ask_for(memory, FULL)
        assert not node_place(memory, 0, 0)[0]
        ask_for(memory, LESS)
        assert node_place(memory, 0, 0)[0]
        ask_for(memory, FULL)


def test_a_wall_is_not_slim():
    memory = map_of(*[(x, y) for x in range(-60, 61) for y in (0, 1)])
    move_fine_layer(memory, 400, 0)
    assert all(is_blocked(memory, kx, 0) or is_blocked(memory, kx, -1) for kx in range(-12, 13))
    ask_for(memory, LESS)
    for kx in range(-12, 13):
        assert not open_way(memory, NODE * kx + 2.0, -20.0, NODE * kx + 2.0, 20.0)


def test_all_is_forgotten():
    memory = map_of((3, 3))
    block(memory, 500, 500, True, False)
    forget_all(memory)
    assert fits(memory, 3.5, 3.5)
    assert not is_blocked(memory, 500, 500)


def test_the_disc_of_the_largest_robot_fits_into_its_rows():
    memory = map_of()
    draw_discs(memory, 50.0, 45.0)
    set_cell(memory, 0, 0)
    assert not fits(memory, 3.0, 3.0)
    assert WIDE == 256
    assert np.all(memory["disc"][..., -1] >= 0)


@pytest.mark.parametrize("slope", [-1, 1])
def test_a_wall_of_nodes_that_touch_at_their_corners_does_not_leak(slope):
    memory = map_of()
    for k in range(300):
        block(memory, 100 + k, 100 + slope * k, True, False)
    side = -slope * 120.0
    for k in range(20, 280):
        u, v = NODE * (100.0 + k), NODE * (100.0 + slope * k)
        assert not open_way(memory, u - 60.0, v - side, u + 60.0, v + side)
        assert open_way(memory, u - 60.0, v - side, u - 30.0, v - 0.5 * side)
