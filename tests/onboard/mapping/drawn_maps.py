"""Maps for tests: drawn from cells, asked like a robot's own."""

from __future__ import annotations

import heapq
import math

import numpy as np

from swarmscope.onboard.mapping.cells import NODE, draw_discs, move_fine_layer, node_place, set_cell
from swarmscope.onboard.mapping.memory import new_memory

RADIUS = 3.2
"""Of the disc in cells."""


def map_of(*cells, radius=RADIUS):
    """The map of a robot at the origin that has seen these cells."""
    memory = new_memory(1)[0]
    draw_discs(memory, radius, 0.9 * radius)
    move_fine_layer(memory, 0, 0)
    for ix, iy in cells:
        set_cell(memory, int(ix), int(iy))
    return memory


def ring(radius, gap=0.0):
    """The cells of a ring round the origin, open by ``gap`` [rad] to the left."""
    angles = np.arange(math.pi + 0.5 * gap, 3.0 * math.pi - 0.5 * gap, 0.5 / radius)
    return {(math.floor(radius * math.cos(a)), math.floor(radius * math.sin(a))) for a in angles}


def way_of(memory):
    """The corners of its way, the goal last."""
    n = int(memory["way_n"])
    return list(zip(memory["way_u"][:n].tolist(), memory["way_v"][:n].tolist(), strict=True))


def length_of(start, corners):
    """How long a way is."""
    return sum(math.dist(a, b) for a, b in zip([start, *corners], corners, strict=False))


def over_nodes(memory, start, reach=40):
    """How far it is from a node to every other, by the book: to eight neighbours, between no two that are shut."""
    far, queue = {start: 0.0}, [(0.0, start)]
    while queue:
        d, (x, y) = heapq.heappop(queue)
        if d > far[x, y]:
            continue
        free = {(ex, ey): node_place(memory, x + ex, y + ey)[0] for ex in (-1, 0, 1) for ey in (-1, 0, 1)}
        for (ex, ey), is_free in free.items():
            node, step = (x + ex, y + ey), NODE * math.hypot(ex, ey)
            passes = is_free and (free[ex, 0] or free[0, ey]) and max(map(abs, node)) <= reach
            if passes and d + step < far.get(node, math.inf):
                far[node] = d + step
                heapq.heappush(queue, (d + step, node))
    return far
