"""Which robots are near: a uniform grid by counting sort, so that a look-up costs what is near, not the swarm."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline
from swarmscope.sim.state import CELL_M, Sim


@jit_inline
def column_of(sim: Sim, x: float) -> int:
    """Return the cell column of ``x``; beyond the border, the border's."""
    return min(int(sim.cell_layout[2]) - 1, max(0, int(math.floor((x - sim.cell_layout[0]) / CELL_M))))


@jit_inline
def row_of(sim: Sim, y: float) -> int:
    """Return the cell row of ``y``; beyond the border, the border's."""
    return min(int(sim.cell_layout[3]) - 1, max(0, int(math.floor((y - sim.cell_layout[1]) / CELL_M))))


@jit
def index_robots(sim: Sim) -> None:
    """Sort the robots into cells by where they are now; within a cell by number."""
    columns = int(sim.cell_layout[2])
    for c in range(sim.cell_start.size):
        sim.cell_start[c] = 0
    for i in range(sim.robots.size):
        cell = row_of(sim, sim.robots[i]["y"]) * columns + column_of(sim, sim.robots[i]["x"])
        sim.cell_of[i] = cell
        sim.cell_start[cell + 1] += 1
    for c in range(1, sim.cell_start.size):
        sim.cell_start[c] += sim.cell_start[c - 1]
    for i in range(sim.robots.size - 1, -1, -1):
        cell = sim.cell_of[i]
        sim.cell_start[cell + 1] -= 1
        sim.cell_items[sim.cell_start[cell + 1]] = i
    # every start[c + 1] now holds the start of cell c: shift back
    for c in range(sim.cell_start.size - 1):
        sim.cell_start[c] = sim.cell_start[c + 1]
    sim.cell_start[sim.cell_start.size - 1] = sim.robots.size
