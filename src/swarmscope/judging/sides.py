"""Costs to go on the true map: what an oracle is told, and what choices of a side are judged by."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarmscope._jit import jit_alloc as jit
from swarmscope._jit import jit_inner
from swarmscope.judging.shortest_path import RESOLUTION_M, SNAP_CELLS
from swarmscope.onboard.rig import Rig
from swarmscope.scenarios.scenario import Scenario
from swarmscope.sim.advice import Advice
from swarmscope.sim.world import compile_world
from swarmscope.tasks import Setup
from swarmscope.tasks._occupancy import domain_of, free_cells_near, rasterise
from swarmscope.tasks._search import SQRT2

MOST_FIELDS = 200
"""More robots than this would take gigabytes."""


def judged_by(scenario: Scenario, rig: Rig) -> tuple[float, float]:
    """Return what shortest ways keep off obstacles, and within what distance these must begin to be worth a side [m].

    The first is the robot's radius and margin; the second its own horizon, from its centre on.
    """
    horizon_m = max(rig.look_ahead, rig.protection.l_th) + rig.body.radius_m
    return scenario.widest.radius_m + scenario.safety.margin_m, horizon_m


def make_advice(setup: Setup, radius: float, horizon_m: float = math.inf, resolution: float = RESOLUTION_M) -> Advice:
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
def cost_to_go(
    blocked: NDArray[np.uint8], goal_row: int, goal_column: int, until_row: int = -1, until_column: int = -1
) -> NDArray[np.float32]:
    """Return the length of the shortest 8-connected way to the goal from every cell (H, W), in cells.

    inf where blocked or cut off. Diagonal steps need both cells beside them free, as in the reference search. With
    an ``until`` cell the search ends when that one's cost is known; costs above it are not final then.

    Cells wait in buckets by whole numbers of cells. No step is shorter than a bucket is wide, so what a bucket holds
    is final when its turn comes, in whatever order (Denardo and Fox 1979).
    """
    height, width = blocked.shape
    wide = width + 2  # a blocked rim, so that no step needs to ask whether it leaves the grid
    free = np.zeros((height + 2) * wide, dtype=np.bool_)
    for row in range(height):
        for column in range(width):
            free[(row + 1) * wide + column + 1] = blocked[row, column] == 0
    cost = np.full((height + 2) * wide, math.inf, dtype=np.float32)
    goal = (goal_row + 1) * wide + goal_column + 1
    until = (until_row + 1) * wide + until_column + 1
    if not free[goal]:
        return cost.reshape((height + 2, wide))[1:-1, 1:-1].copy()
    waiting, counts = np.empty((3, 64 * (height + width)), dtype=np.int32), np.zeros(3, dtype=np.int64)
    cost[goal] = 0.0
    waiting[0, 0], counts[0] = goal, 1
    level = 0
    while counts.sum() > 0:
        if until_row >= 0 and cost[until] < level:
            break
        bucket = level % 3
        for k in range(counts[bucket]):
            here = waiting[bucket, k]
            if cost[here] < level:
                continue  # was reached by a shorter way since
            if max(counts) + 8 > waiting.shape[1]:
                longer = np.empty((3, 2 * waiting.shape[1]), dtype=np.int32)
                longer[:, : waiting.shape[1]] = waiting
                waiting = longer
            _spread(here, wide, free, cost, waiting, counts)
        counts[bucket] = 0
        level += 1
    return cost.reshape((height + 2, wide))[1:-1, 1:-1].copy()


@jit_inner
def _spread(
    here: int,
    wide: int,
    free: NDArray[np.bool_],
    cost: NDArray[np.float32],
    waiting: NDArray[np.int32],
    counts: NDArray[np.int64],
) -> None:
    """Note the cost of all neighbours of a cell that are reached by a shorter way through it; rows are ``wide``."""
    reached = cost[here]
    straight, aslant = np.float32(reached + 1.0), np.float32(reached + SQRT2)
    into, into_aslant = int(straight) % 3, int(aslant) % 3
    for across in (-1, 1):
        if free[here + across] and straight < cost[here + across]:
            cost[here + across] = straight
            waiting[into, counts[into]] = here + across
            counts[into] += 1
    for up in (-wide, wide):
        if not free[here + up]:
            continue
        if straight < cost[here + up]:
            cost[here + up] = straight
            waiting[into, counts[into]] = here + up
            counts[into] += 1
        for across in (-1, 1):
            there = here + up + across
            if free[there] and free[here + across] and aslant < cost[there]:
                cost[there] = aslant
                waiting[into_aslant, counts[into_aslant]] = there
                counts[into_aslant] += 1
