"""The expert's answer: on which side the shortest way on the true map passes what stands ahead (GIWT 4.4.1).

A side is read off the way as ``sim.advice`` describes it: by the sign of the way's offset where its progress along the
straight line to the goal first reaches the middle of the first blocked stretch. How much longer the best way on the
*other* side is follows from a second search in which a wall stands from that middle outwards on the side taken.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope._jit import jit, jit_alloc
from swarmscope.judging.sides import cost_to_go
from swarmscope.sim.advice import blocked_stretch, side_of_way, start_cell
from swarmscope.tasks._occupancy import Raster, free_cells_near

SNAP_CELLS = 4
"""A goal in a blocked cell counts as in the free one nearest to it, at most so many cells away."""
TIE_M = 0.1
"""With less than this between the best ways on both sides there is no label."""
FARTHEST_M = 20.0
"""A detour is counted up to here."""
UNREACHABLE, NOTHING_AHEAD, TIE, LABELLED = range(4)
OUTCOMES = ("unreachable", "nothing_ahead", "tie", "labelled")


class Label(NamedTuple):
    """The expert's answer for one robot."""

    outcome: int
    """One of OUTCOMES; without LABELLED the rest means nothing."""
    side: int
    """+1 left, -1 right."""
    detour_m: float
    """How much longer the best way on the other side is, at most FARTHEST_M."""
    way_m: float
    """Length of the shortest way."""


def label(raster: Raster, start: NDArray[np.float64], goal: NDArray[np.float64], horizon_m: float) -> Label:
    """Return the label of a robot at ``start (2,)`` on its way to ``goal (2,)`` [m, world frame].

    What blocks the straight line must begin within ``horizon_m``.
    """
    row, column = free_cells_near(raster, goal[None], SNAP_CELLS)[0]
    x, y = (start - (raster.x0, raster.y0)) / raster.resolution
    gx, gy = (goal - (raster.x0, raster.y0)) / raster.resolution
    found = _label(raster.blocked, x, y, gx, gy, int(row), int(column), horizon_m / raster.resolution)
    outcome, side = int(found[0]), int(found[1])
    detour, way = found[2] * raster.resolution, found[3] * raster.resolution
    if outcome == LABELLED and detour < TIE_M:
        outcome = TIE
    return Label(outcome, side, min(float(detour), FARTHEST_M), float(way))


@jit_alloc
def _label(
    blocked: NDArray[np.uint8], x: float, y: float, gx: float, gy: float, row: int, column: int, horizon: float
) -> tuple[int, int, float, float]:
    """Return outcome, side, detour and way, lengths in cells."""
    cost = cost_to_go(blocked, row, column)
    start_row, start_column = start_cell(cost, int(y), int(x))
    if start_row < 0:
        return UNREACHABLE, 0, 0.0, 0.0
    way = float(cost[start_row, start_column])
    side = side_of_way(cost, x, y, gx, gy, horizon)
    if side == 0:
        return NOTHING_AHEAD, 0, 0.0, way
    apart = math.hypot(gx - x, gy - y)
    ux, uy = (gx - x) / apart, (gy - y) / apart
    begin, end = blocked_stretch(cost, x, y, ux, uy, apart)
    walled = blocked.copy()
    middle = 0.5 * (begin + end)
    build_wall(walled, x + middle * ux, y + middle * uy, -side * uy, side * ux)
    if walled[start_row, start_column] or walled[row, column]:
        return TIE, side, 0.0, way
    other = cost_to_go(walled, row, column, start_row, start_column)
    return LABELLED, side, float(other[start_row, start_column]) - way, way


@jit
def build_wall(blocked: NDArray[np.uint8], x: float, y: float, dx: float, dy: float) -> None:
    """Block the cells of a ray from (x, y) along the unit vector (dx, dy) to the rim of the grid [cells]."""
    height, width = blocked.shape
    for k in range(4 * (height + width)):
        column, row = int(math.floor(x + 0.25 * k * dx)), int(math.floor(y + 0.25 * k * dy))
        if not (0 <= row < height and 0 <= column < width):
            return
        blocked[row, column] = 1
