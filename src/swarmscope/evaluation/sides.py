"""Costs to go on the true map: what an oracle is told, and what choices of a side are judged by."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarmscope._jit import jit_alloc as jit
from swarmscope.evaluation.shortest_path import RESOLUTION_M, SNAP_CELLS
from swarmscope.sim.advice import Advice
from swarmscope.sim.world import compile_world
from swarmscope.tasks import Setup
from swarmscope.tasks._occupancy import domain_of, free_cells_near, rasterise
from swarmscope.tasks._search import SQRT2, sift_down, sift_up

MOST_FIELDS = 200
"""More robots than this would take gigabytes."""


def make_advice(
    setup: Setup, radius: float, horizon_m: float = math.inf, resolution: float = RESOLUTION_M
) -> Advice:
    """Return the cost to go of every robot's goal, on a grid like that of the reference ways.

    ``radius`` [m] is what the ways keep off obstacles: a planner's own margin included, so that what blocks it
    blocks them. Other robots are not obstacles. Sides are told of what stands within ``horizon_m``. Raises
    ValueError for more than MOST_FIELDS robots.
    """
    if len(setup.goals) > MOST_FIELDS:
        raise ValueError(f"costs to go of {len(setup.goals)} robots; at most {MOST_FIELDS} fit into memory")
    spec = setup.world
    raster = rasterise(compile_world(spec), radius, domain_of(spec, [setup.starts, setup.goals]), resolution)
    cells = free_cells_near(raster, setup.goals, SNAP_CELLS)
    fields = [cost_to_go(raster.blocked, int(row), int(column)) for row, column in cells]
    return Advice(np.stack(fields), np.arange(len(cells)), raster.x0, raster.y0, raster.resolution, horizon_m)


@jit
def cost_to_go(blocked: NDArray[np.uint8], goal_row: int, goal_column: int) -> NDArray[np.float32]:
    """Return the length of the shortest 8-connected way to the goal from every cell (H, W), in cells.

    inf where blocked or cut off. Diagonal steps need both cells beside them free, as in the reference search.
    """
    height, width = blocked.shape
    cost = np.full((height, width), math.inf, dtype=np.float32)
    if blocked[goal_row, goal_column] == 1:
        return cost
    key, cell = np.empty(4 * (height + width)), np.empty(4 * (height + width), dtype=np.int32)
    cost[goal_row, goal_column] = 0.0
    key[0], cell[0] = 0.0, goal_row * width + goal_column
    count = 1
    while count > 0:
        reached, here = key[0], int(cell[0])
        count -= 1
        key[0], cell[0] = key[count], cell[count]
        sift_down(key, cell, count)
        row, column = here // width, here % width
        if reached > cost[row, column]:
            continue
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                r, c = row + dr, column + dc
                if (dr == 0 and dc == 0) or r < 0 or c < 0 or r >= height or c >= width or blocked[r, c] == 1:
                    continue
                step = 1.0
                if dr != 0 and dc != 0:
                    if blocked[row, c] == 1 or blocked[r, column] == 1:
                        continue
                    step = SQRT2
                through = np.float32(cost[row, column] + step)
                if through < cost[r, c]:
                    cost[r, c] = through
                    if count == key.shape[0]:
                        longer_key, longer_cell = np.empty(2 * count), np.empty(2 * count, dtype=np.int32)
                        longer_key[:count], longer_cell[:count] = key, cell
                        key, cell = longer_key, longer_cell
                    key[count], cell[count] = through, r * width + c
                    sift_up(key, cell, count)
                    count += 1
    return cost
