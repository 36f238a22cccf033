"""Of an answer only what is news is remembered, without gaps where the news begins."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_maps import map_of
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.onboard.mapping.cells import NODE, set_cell
from swarmscope.onboard.mapping.heard import drop_cell, hear, is_told_closed, told_cell
from swarmscope.onboard.mapping.news import EVERY, is_seen, keep_news, trust_own_eyes
from swarmscope.onboard.mapping.pages import block

WALL = [(20.5, 3.0 * k + 0.5) for k in range(-12, 13)]


def kept(memory, cells):
    cells = np.array(cells, np.float64).reshape(-1, 2)
    return [tuple(cell) for cell in cells[: keep_news(memory, cells, len(cells))].tolist()]


def told(memory, cells):
    cells = np.array(cells, np.float64)
    assert hear(memory, cells, len(cells), 0.0, 3)


def test_what_nobody_knows_is_all_news():
    assert kept(map_of(), WALL) == WALL
    assert kept(map_of(), []) == []


def test_what_was_told_before_is_none():
    memory = map_of()
    told(memory, WALL)
    assert kept(memory, WALL[3:9]) == []
    assert kept(memory, [(u + 0.7, v) for u, v in WALL]) == []


def test_of_what_is_partly_known_the_next_known_cell_stays():
    memory = map_of()
    told(memory, WALL[:10])
    assert kept(memory, WALL) == WALL[9:]
    told(memory, WALL[20:])
    assert kept(memory, WALL) == WALL[9:21]


@pytest.mark.parametrize("aside", [-3, 0, 3])
def test_what_the_robot_has_seen_itself_is_none(aside):
    seen = [(int(u) + aside, int(np.floor(v))) for u, v in WALL]
    assert kept(map_of(*seen), WALL) == []


def test_what_is_four_cells_beside_what_it_has_seen_is_news():
    assert kept(map_of(*[(24, int(np.floor(v))) for _, v in WALL]), WALL) == WALL


def told_cells(memory):
    return [told_cell(memory, k) for k in range(int(memory["heard_n"]))]


def answer_of(answers, k):
    """Which answer the k-th told cell belongs to."""
    return int(np.searchsorted(np.cumsum([len(cells) for cells in answers]), k, side="right"))


def trust(memory):
    """As often as it takes until all told cells had their turn."""
    for _ in range(EVERY):
        trust_own_eyes(memory)
        memory["ticks"] += 1


def test_what_the_robot_has_seen_by_now_it_knows_better():
    """A told wall 0.1 m aside would close a gap between its end and another wall to the robot's least disc."""
    memory = map_of()
    told(memory, [(40.5, 3.5), (43.5, 3.5)])
    told(memory, WALL)
    for _, v in WALL[:20]:
        set_cell(memory, 18, int(np.floor(v)))
    trust(memory)
    assert told_cells(memory) == [(40.5, 3.5), (43.5, 3.5), *WALL[20:]]
    assert memory["answer_n"][:2].tolist() == [2, len(WALL[20:])]
    for _, v in WALL[20:]:
        set_cell(memory, 18, int(np.floor(v)))
    trust(memory)
    assert told_cells(memory) == [(40.5, 3.5), (43.5, 3.5)]
    assert memory["answers_n"] == 1
    assert memory["opened"] == 1


def test_a_row_ends_where_the_next_cell_is_far_away():
    """A seen end is dropped though the next thing of the same answer is not seen, and says nothing about that one."""
    memory = map_of()
    other = [(u + 30.0, v) for u, v in WALL]
    told(memory, WALL + other)
    for _, v in WALL:
        set_cell(memory, 20, int(np.floor(v)))
    trust(memory)
    assert told_cells(memory) == other
    assert kept(memory, WALL + [(u + 60.0, v) for u, v in WALL]) == [(u + 60.0, v) for u, v in WALL]


def test_where_a_body_may_fit_the_own_map_does_not_know_better():
    memory = map_of()
    ix, iy = NODE * 5 + NODE // 2, NODE // 2
    block(memory, 5, 0, True, True)
    set_cell(memory, ix, iy)
    assert not is_seen(memory, ix + 0.5, iy + 0.5)
    set_cell(memory, ix + 1, iy)
    assert is_seen(memory, ix + 0.5, iy + 0.5)


@settings(deadline=None, max_examples=60)
@given(st.lists(st.integers(1, 9), min_size=1, max_size=8), st.data())
def test_a_told_cell_that_is_dropped_leaves_all_others_as_they_are(sizes, data):
    memory, left, seen_free = map_of(), [], set()
    for a, n in enumerate(sizes):
        cells = [(float(a), float(k)) for k in range(n)]
        told(memory, cells)
        left.append(cells)
    while left:
        for cell in data.draw(st.lists(st.integers(0, int(memory["heard_n"]) - 1), max_size=1)):
            seen_free.add(told_cell(memory, cell))
            memory["answer_wrong"][answer_of(left, cell)] += 1 - memory["heard_free"][cell]
            memory["heard_free"][cell] = 1
        a = data.draw(st.integers(0, len(left) - 1))
        k = data.draw(st.integers(0, len(left[a]) - 1))
        drop_cell(memory, a, sum(map(len, left[:a])) + k)
        del left[a][k]
        left = [cells for cells in left if cells]
        assert told_cells(memory) == [cell for cells in left for cell in cells]
        n = int(memory["answers_n"])
        assert memory["answer_n"][:n].tolist() == list(map(len, left))
        assert memory["answer_wrong"][:n].tolist() == [len(seen_free & set(cells)) for cells in left]


LISTS = st.lists(st.tuples(st.integers(-60, 60), st.integers(-60, 60)), min_size=1, max_size=60)


@settings(deadline=None, max_examples=60)
@given(LISTS, LISTS)
def test_what_is_left_out_is_closed_all_the_same(before, now):
    memory = map_of()
    told(memory, np.array(before) + 0.5)
    news = kept(memory, np.array(now) + 0.5)
    if news:
        told(memory, news)
    for u, v in now:
        assert is_told_closed(memory, u + 0.5, v + 0.5)
