"""The grid of cells against sorting by hand."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import BOUNDS, place_sim
from swarmscope.sim.cells import column_of, index_robots, row_of
from swarmscope.sim.state import CELL_M

places = st.lists(st.tuples(st.floats(-14.0, 14.0), st.floats(-14.0, 14.0)), min_size=1, max_size=60)


def indexed(points):
    sim, _ = place_sim([(x, y, 0.0) for x, y in points])
    index_robots(sim)
    return sim


def cell_by_hand(x, y):
    side = int(np.ceil((BOUNDS[2] - BOUNDS[0]) / CELL_M))
    column = int(np.clip(np.floor((x - BOUNDS[0]) / CELL_M), 0, side - 1))
    row = int(np.clip(np.floor((y - BOUNDS[1]) / CELL_M), 0, side - 1))
    return row * side + column


@settings(max_examples=60)
@given(places)
def test_every_robot_is_in_its_cell_once_in_ascending_order(points):
    sim = indexed(points)
    cells = [cell_by_hand(x, y) for x, y in points]
    assert sorted(sim.cell_items) == list(range(len(points)))
    assert sim.cell_start[0] == 0
    assert sim.cell_start[-1] == len(points)
    for c in range(sim.cell_start.size - 1):
        members = sim.cell_items[sim.cell_start[c] : sim.cell_start[c + 1]].tolist()
        assert members == [i for i, cell in enumerate(cells) if cell == c]


@settings(max_examples=60)
@given(places, st.floats(-12.0, 12.0), st.floats(-12.0, 12.0), st.floats(0.1, 6.0))
def test_a_look_up_misses_nobody_within_reach(points, x, y, reach):
    """The search that the sensors use, against all pairs; also beyond the border."""
    sim = indexed(points)
    columns = int(sim.cell_layout[2])
    found = []
    for row in range(row_of(sim, y - reach), row_of(sim, y + reach) + 1):
        first = sim.cell_start[row * columns + column_of(sim, x - reach)]
        last = sim.cell_start[row * columns + column_of(sim, x + reach) + 1]
        found += sim.cell_items[first:last].tolist()
    near = [i for i, (px, py) in enumerate(points) if np.hypot(px - x, py - y) <= reach]
    assert set(near) <= set(found)
    assert len(found) == len(set(found))


def test_indexing_again_after_moving_forgets_the_old_places():
    sim = indexed([(0.0, 0.0), (5.0, 5.0)])
    sim.robots["x"] = [-9.0, -9.0]
    sim.robots["y"] = [-9.0, -9.0]
    index_robots(sim)
    assert sim.cell_items[sim.cell_start[0] : sim.cell_start[1]].tolist() == [0, 1]
