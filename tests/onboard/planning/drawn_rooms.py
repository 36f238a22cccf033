"""A map with a door in it, as a robot has it."""

from __future__ import annotations

import math

from swarmscope.onboard.mapping.cells import draw_discs, move_fine_layer, set_cell
from swarmscope.onboard.mapping.memory import new_memory

CELL = 0.0625


def door_map(ahead, wide, corridor=math.inf):
    """A map of a robot at the origin with a wall across x = ``ahead`` [m], a door in it, and its way through that; a
    ``corridor`` so wide leads there."""
    memory = new_memory(1)[0]
    draw_discs(memory, 0.2 / CELL, 0.18 / CELL)
    move_fine_layer(memory, 0, 0)
    for j in range(-64, 64):
        if abs((j + 0.5) * CELL) > 0.5 * wide:
            set_cell(memory, math.floor(ahead / CELL), j)
    if math.isfinite(corridor):
        for i in range(-64, math.floor(ahead / CELL)):
            for side in (-0.5, 0.5):
                set_cell(memory, i, math.floor(side * corridor / CELL))
    memory["way_n"], memory["way_u"][0], memory["way_v"][0] = 1, 2.0 * ahead / CELL, 0.0
    return memory
