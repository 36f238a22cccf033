"""Of an answer only what is news is remembered, without gaps where the news begins."""

from __future__ import annotations

import numpy as np
import pytest
from drawn_maps import map_of
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.onboard.mapping.heard import hear, is_told_closed
from swarmscope.onboard.mapping.news import keep_news

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


@pytest.mark.parametrize("aside", [-1, 0, 1])
def test_what_the_robot_has_seen_itself_is_none(aside):
    seen = [(int(u) + aside, int(np.floor(v))) for u, v in WALL]
    assert kept(map_of(*seen), WALL) == []


def test_what_is_two_cells_beside_what_it_has_seen_is_news():
    assert kept(map_of(*[(22, int(np.floor(v))) for _, v in WALL]), WALL) == WALL


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
