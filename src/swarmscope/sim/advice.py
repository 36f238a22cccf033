"""What no robot knows: on which side of the obstacle ahead the shortest way passes. For oracles and for judging.

*The side of a way.* On the straight line from the robot to its goal the first blocked stretch begins at progress
b, within the robot's horizon, and ends at progress e. The shortest way (steepest descent of the cost to go) is
followed until its progress along that line first reaches (b + e) / 2; the sign of its lateral offset there is the
side, +1 left. A way that arrives without ever being so far along has the side of its largest offset. 0: the line is
free so far, or there is no way.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.sim.state import Sim

SNAP_CELLS = 4
"""A robot in a blocked cell, closer to an obstacle than its radius in cells, starts from the cheapest one near."""


class Advice(NamedTuple):
    """Cost to go of each robot's goal on one grid; row 0 at the bottom."""

    cost: np.ndarray
    """(G, H, W) float32: length of the shortest way in cells, inf where blocked or cut off."""
    goal_of: np.ndarray
    """(N,) int64: which of the G fields belongs to a robot."""
    x0: float
    y0: float
    resolution: float
    horizon_m: float
    """How far ahead something must stand in the way to be worth a side."""


@jit
def tell_sides(sim: Sim, advice: Advice) -> None:
    """Write the side of every robot's shortest way into ``sim.told``."""
    for i in range(sim.robots.size):
        robot = sim.robots[i]
        sim.told[i] = side_of_way(
            advice.cost[advice.goal_of[i]],
            (robot["x"] - advice.x0) / advice.resolution,
            (robot["y"] - advice.y0) / advice.resolution,
            (robot["goal_x"] - advice.x0) / advice.resolution,
            (robot["goal_y"] - advice.y0) / advice.resolution,
            advice.horizon_m / advice.resolution,
        )


@jit
def side_of_way(
    cost: np.ndarray, x: float, y: float, goal_x: float, goal_y: float, horizon: float
) -> int:
    """Return the side (+1 left, -1 right, 0 none) of the shortest way from (x, y); all lengths in cells."""
    dx, dy = goal_x - x, goal_y - y
    apart = math.sqrt(dx * dx + dy * dy)
    if apart < 1.0:
        return 0
    ux, uy = dx / apart, dy / apart
    begin, end = blocked_stretch(cost, x, y, ux, uy, apart)
    if begin < 0.0 or begin > horizon:
        return 0
    row, column = start_cell(cost, int(y), int(x))
    if row < 0:
        return 0
    middle = 0.5 * (begin + end)
    extreme = 0.0
    while cost[row, column] > 0.0:
        next_row, next_column = _next_cell(cost, row, column)
        if next_row == row and next_column == column:
            break  # cannot happen on a field without errors
        row, column = next_row, next_column
        ax, ay = column + 0.5 - x, row + 0.5 - y
        offset = ux * ay - uy * ax
        if abs(offset) > abs(extreme):
            extreme = offset
        if ux * ax + uy * ay >= middle and abs(offset) >= 0.5:
            return 1 if offset > 0.0 else -1
    if extreme == 0.0:
        return 0
    return 1 if extreme > 0.0 else -1


@jit_inline
def _is_free(cost: np.ndarray, row: int, column: int) -> bool:
    """Tell whether a cell can be reached."""
    inside = 0 <= row < cost.shape[0] and 0 <= column < cost.shape[1]
    return inside and bool(cost[row, column] < np.inf)


@jit
def blocked_stretch(
    cost: np.ndarray, x: float, y: float, ux: float, uy: float, apart: float
) -> tuple[float, float]:
    """Return where on the line the first blocked stretch begins and ends, (-1, -1) when the line is free."""
    begin = -1.0
    away = _is_free(cost, int(y), int(x))  # a robot that touches the margin of something must leave it first
    for k in range(1, int(apart / 0.5) + 1):
        s = min(apart, 0.5 * k)
        free = _is_free(cost, int(y + s * uy), int(x + s * ux))
        if not away:
            away = free
        elif begin < 0.0 and not free:
            begin = s
        elif begin >= 0.0 and free:
            return begin, s
    return begin, apart if begin >= 0.0 else -1.0


@jit
def start_cell(cost: np.ndarray, row: int, column: int) -> tuple[int, int]:
    """Return the cell, or the cheapest one within SNAP_CELLS of a blocked cell; (-1, -1) when there is none."""
    if _is_free(cost, row, column):
        return row, column
    best_row, best_column, best = -1, -1, math.inf
    for r in range(row - SNAP_CELLS, row + SNAP_CELLS + 1):
        for c in range(column - SNAP_CELLS, column + SNAP_CELLS + 1):
            if _is_free(cost, r, c):
                away = math.sqrt((r - row) ** 2 + (c - column) ** 2)
                if cost[r, c] + away < best:
                    best_row, best_column, best = r, c, cost[r, c] + away
    return best_row, best_column


@jit_inner
def _next_cell(cost: np.ndarray, row: int, column: int) -> tuple[int, int]:
    """Return the neighbour through which the shortest way goes: the one with the least cost and step."""
    best_row, best_column, best = row, column, math.inf
    for dr in range(-1, 2):
        for dc in range(-1, 2):
            r, c = row + dr, column + dc
            if (dr == 0 and dc == 0) or not _is_free(cost, r, c):
                continue
            diagonal = dr != 0 and dc != 0
            if diagonal and not (_is_free(cost, row, c) and _is_free(cost, r, column)):
                continue
            through = cost[r, c] + (math.sqrt(2.0) if diagonal else 1.0)
            if through < best and cost[r, c] < cost[row, column]:
                best_row, best_column, best = r, c, through
    return best_row, best_column
