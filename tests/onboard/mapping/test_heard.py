"""What others have told: closes ways, is believed least, and goes when it is wrong, old or too much."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from drawn_maps import map_of, way_of

from swarmscope.onboard.mapping.cells import FULL, LEAST, LESS, PHASES, ask_for, is_open, set_cell
from swarmscope.onboard.mapping.flood import flood
from swarmscope.onboard.mapping.heard import (
    ANSWERS,
    HEARD,
    distrusts,
    forget_heard,
    hear,
    note_wrong,
    review_heard,
    told_cell,
)
from swarmscope.onboard.mapping.way import find_way, forget_and_find
from swarmscope.onboard.mapping.words import Spot

WALL = [(20.5, 3.0 * k + 0.5) for k in range(-12, 13)]
HERE, GOAL = Spot(0.5, 0.5), Spot(40.5, 0.5)


def told(memory, cells, now_s=0.0, sender=3):
    cells = np.array(cells, np.float64)
    return hear(memory, cells, len(cells), now_s, sender)


def length(memory):
    n = int(memory["way_n"])
    corners = [tuple(HERE), *zip(memory["way_u"][:n].tolist(), memory["way_v"][:n].tolist(), strict=True)]
    return sum(np.hypot(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(corners))


def test_what_is_told_closes_the_way_and_a_way_round_it_is_found():
    memory = map_of()
    assert find_way(memory, HERE, GOAL)
    assert length(memory) == pytest.approx(40.0)
    assert told(memory, WALL)
    assert not is_open(memory, 20.5, 0.5)
    assert find_way(memory, HERE, GOAL)
    assert length(memory) > 75.0


@pytest.mark.parametrize("room", [FULL, LESS, LEAST])
def test_told_cells_keep_the_least_room_free_whatever_is_asked_for(room):
    memory = map_of()
    told(memory, [(20.5, 0.5)])
    ask_for(memory, room)
    r = float(memory["disc_r"][LEAST])
    assert not is_open(memory, 20.5 + r - 0.01, 0.5)
    assert is_open(memory, 20.5 + r + 0.01, 0.5)


def test_what_is_told_is_dropped_before_any_cell_when_nothing_is_open():
    memory = map_of()
    angles = np.linspace(0.0, 2.0 * np.pi, 60, endpoint=False)
    told(memory, [(20.0 * np.cos(a), 20.0 * np.sin(a)) for a in angles])
    memory["kept_n"], memory["kept_u"][0], memory["kept_r"][0], memory["kept_s"][0] = 1, -30.0, 2.0, 100.0
    memory["stand_n"], memory["stand_u"][0], memory["stand_v"][0], memory["stand_r"][0] = 1, -30.0, 20.0, 2.0
    assert forget_and_find(memory, HERE, GOAL) == 1
    assert memory["answers_n"] == memory["heard_n"] == 0
    assert memory["kept_n"] == memory["stand_n"] == 1
    assert memory["room"] == FULL
    assert length(memory) == pytest.approx(40.0)


def test_less_room_is_asked_for_before_what_is_told_is_dropped():
    """A ring with a gap that the guard lets pass, and a wide one of which somebody has told that it is none."""
    memory = map_of()
    assert 2.0 * memory["disc_r"][LESS] < 6.0 < 2.0 * memory["disc_r"][FULL]
    for k in range(-30, 31):
        for ix, iy in ((-30, k), (30, k), (k, -30), (k, 30)):
            in_gap = iy == 30 and -3 <= ix <= 1  # 6 cells between the middles of its jambs
            if not (in_gap or (ix == 30 and abs(iy) < 8)):
                set_cell(memory, ix, iy)
    assert find_way(memory, HERE, GOAL)
    told(memory, [(30.5, 2.0 * k + 0.5) for k in range(-4, 5)])
    assert forget_and_find(memory, HERE, GOAL) == 2
    assert memory["answers_n"] == 1
    assert max(memory["way_v"][: int(memory["way_n"])]) > 28.0


def test_enough_cells_that_are_seen_free_make_the_whole_answer_wrong():
    memory = map_of()
    told(memory, WALL)
    told(memory, [(100.5, 0.5)])
    for k in (0, 1, 1, 0, 1):  # the same cells again do not count
        note_wrong(memory, k, 1.0)
        assert memory["answers_n"] == 2
    assert not distrusts(memory, 3, 1.0, 60.0)
    note_wrong(memory, 5, 1.0)
    assert distrusts(memory, 3, 60.0, 60.0)
    assert not distrusts(memory, 3, 61.5, 60.0)
    assert not distrusts(memory, 4, 1.0, 60.0)
    assert memory["answers_n"] == memory["heard_n"] == 1
    assert memory["opened"] == 1
    assert told_cell(memory, 0)[0] == 100.5
    assert not is_open(memory, 100.5, 0.5)
    note_wrong(memory, 0, 3.0)
    assert memory["answers_n"] == 0
    assert not distrusts(memory, 3, 62.0, 60.0)  # one cell of a whole answer that was free is no lie


def test_old_answers_go():
    memory = map_of()
    told(memory, WALL, now_s=1.0)
    told(memory, [(100.5, 0.5)], now_s=5.0)
    review_heard(memory, 11.5, 10.0)
    assert memory["answers_n"] == memory["heard_n"] == 1
    assert memory["answer_s"][0] == 5.0


def test_the_oldest_give_way_to_new_ones():
    memory = map_of()
    for k in range(ANSWERS + 3):
        assert told(memory, [(30.0 * k, 0.5), (30.0 * k + 3.0, 0.5)], now_s=float(k))
    assert memory["answers_n"] == ANSWERS
    assert memory["answer_s"][:ANSWERS].tolist() == [float(k) for k in range(3, ANSWERS + 3)]
    assert told_cell(memory, 0)[0] == 90.0
    assert memory["answer_box"][0].tolist() == [90.0, 93.0, 0.5, 0.5]
    far = [(2000.0 + k, 0.5) for k in range(HEARD)]
    assert told(memory, far)
    assert memory["answers_n"] == 1
    assert not told(memory, [(2000.0 + k, 0.5) for k in range(HEARD + 1)])


@pytest.mark.parametrize("half", [4.0, 6.0])
@pytest.mark.parametrize("x", [18.5, 19.5, 20.5, 21.5])
@pytest.mark.parametrize("y", [1.5, 3.5])
def test_a_flood_goes_through_gaps_between_told_walls_and_not_through_the_walls(half, x, y):
    side = [3.0 * k for k in range(20)]
    walls = [(x, y + half + d) for d in side], [(x, y - half - d) for d in side]
    memory = map_of()
    for wall in walls:
        told(memory, wall)
    reached = False
    for phase in range(PHASES):
        memory["phase"] = phase
        if flood(memory, 0.5, 0.5, 40.5, 0.5):
            reached = reached or length(memory) < 60.0
    assert reached
    told(memory, [(x, y + k) for k in (-3.0, 0.0, 3.0)])
    for phase in range(PHASES):
        memory["phase"] = phase
        assert not flood(memory, 0.5, 0.5, 40.5, 0.5) or length(memory) > 80.0


def test_forgetting_says_whether_there_was_anything():
    memory = map_of()
    assert not forget_heard(memory)
    told(memory, WALL)
    assert forget_heard(memory)
    assert is_open(memory, 20.5, 0.5)


def test_ways_go_round_what_was_told_of_places_beyond_all_that_is_known():
    """A flood looks at what is known; a wall that somebody has told of may end where nobody here has been."""
    memory = map_of()
    wall = [(60.5, -402.5 + 4.0 * k) for k in range(180)]
    assert told(memory, wall)
    assert flood(memory, *HERE, 120.5, 0.5)
    assert max(v for _, v in way_of(memory)) > wall[-1][1]


def test_what_is_told_of_places_too_far_to_note_is_left():
    memory = map_of()
    assert not told(memory, [(20.5, 0.5), (4096.0, 0.5)])
    assert not told(memory, [(20.5, float("nan"))])
    assert memory["answers_n"] == memory["heard_n"] == 0
