"""The shortest 8-connected path over a `Raster` (A*).

Steps cost 1 or sqrt(2) cells; a diagonal step needs both cells beside it to be free (no corner is cut). The
heuristic is the octile distance, which is consistent, so a cell is final when it leaves the heap. Equal
costs are taken in a fixed order, so the same grid gives the same path. The heap and the costs are plain
arrays, reused between searches: a stamp says which search a cell's cost belongs to, so that nothing is
cleared.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from swarmscope._jit import jit_alloc as jit
from swarmscope._jit import jit_inner
from swarmscope.tasks._occupancy import Raster

SQRT2 = math.sqrt(2.0)

Bytes = NDArray[np.uint8]
Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shorts = NDArray[np.int32]


class Searcher:
    """Searches on one grid, one after another, that share their working memory."""

    def __init__(self, raster: Raster) -> None:
        cells = raster.blocked.size
        self.raster = raster
        self._cost = np.empty(cells)  # cells travelled so far
        self._parent = np.empty(cells, dtype=np.int32)  # cell before
        self._stamp = np.zeros(cells, dtype=np.int32)  # search that wrote the two; negative = final
        self._key = np.empty(max(64, cells))
        self._cell = np.empty(max(64, cells), dtype=np.int32)
        self._number = 0

    def path(self, start: Ints, goal: Ints) -> Ints:
        """Return the cells (P, 2) row, column of a shortest path; (0, 2) when there is none."""
        self._number += 1
        width = self.raster.blocked.shape[1]
        found = _search(
            self.raster.blocked, int(start[0]), int(start[1]), int(goal[0]), int(goal[1]),
            self._cost, self._parent, self._stamp, self._key, self._cell, self._number,
        )  # fmt: skip
        return np.stack([found // width, found % width], axis=1)

    def length_m(self, start: Ints, goal: Ints) -> float:
        """Return the length [m] of a shortest path between cell centres, infinity when there is none."""
        cells = self.path(start, goal)
        if len(cells) == 0:
            return math.inf
        steps = np.abs(np.diff(cells, axis=0)).sum(axis=1)
        return self.raster.resolution * float(np.sum(np.where(steps == 2, SQRT2, 1.0)))


@jit
def sift_up(key: Floats, cell: Shorts, k: int) -> None:
    """Move entry ``k`` of a binary heap up to its place."""
    while k > 0:
        up = (k - 1) // 2
        if key[up] <= key[k]:
            break
        key[up], key[k] = key[k], key[up]
        cell[up], cell[k] = cell[k], cell[up]
        k = up


@jit
def sift_down(key: Floats, cell: Shorts, count: int) -> None:
    """Move the first of ``count`` entries of a binary heap down to its place."""
    k = 0
    while True:
        child = 2 * k + 1
        if child >= count:
            break
        if child + 1 < count and key[child + 1] < key[child]:
            child += 1
        if key[k] <= key[child]:
            break
        key[child], key[k] = key[k], key[child]
        cell[child], cell[k] = cell[k], cell[child]
        k = child


@jit
def _search(
    blocked: Bytes, row: int, column: int, goal_row: int, goal_column: int,
    cost: Floats, parent: Shorts, stamp: Shorts, key: Floats, cell: Shorts, number: int,
) -> Ints:  # fmt: skip
    width = blocked.shape[1]
    if blocked[row, column] == 1 or blocked[goal_row, goal_column] == 1:
        return np.zeros(0, dtype=np.int64)
    start, goal = row * width + column, goal_row * width + goal_column
    cost[start], parent[start], stamp[start] = 0.0, start, number
    key[0], cell[0] = 0.0, start
    count = 1
    while count > 0:
        here = int(cell[0])
        count -= 1
        key[0], cell[0] = key[count], cell[count]
        sift_down(key, cell, count)
        if here == goal:
            break
        if stamp[here] == -number:
            continue
        stamp[here] = -number
        row, column = here // width, here % width
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                step = _step(blocked, row, column, dr, dc)
                if step == 0.0:
                    continue
                r, c = row + dr, column + dc
                there = r * width + c
                if stamp[there] == -number:
                    continue
                through = cost[here] + step
                if stamp[there] == number and cost[there] <= through:
                    continue
                cost[there], parent[there], stamp[there] = through, here, number
                dy, dx = abs(goal_row - r), abs(goal_column - c)
                ahead = max(dx, dy) + (SQRT2 - 1.0) * min(dx, dy)
                if count == key.shape[0]:  # the same cell may wait several times
                    key, cell = _twice_as_long(key, cell)
                key[count], cell[count] = through + ahead, there
                sift_up(key, cell, count)
                count += 1
    if abs(stamp[goal]) != number:
        return np.zeros(0, dtype=np.int64)
    return _way_back(parent, start, goal)


@jit_inner
def _step(blocked: Bytes, row: int, column: int, dr: int, dc: int) -> float:
    """Return the length [cells] of the step by (dr, dc) from a cell, 0 if it is none or not free."""
    r, c = row + dr, column + dc
    if r < 0 or c < 0 or r >= blocked.shape[0] or c >= blocked.shape[1] or blocked[r, c] == 1:
        return 0.0
    if dr == 0 or dc == 0:
        return 0.0 if dr == dc else 1.0
    return 0.0 if blocked[row, c] == 1 or blocked[r, column] == 1 else SQRT2


@jit
def _twice_as_long(key: Floats, cell: Shorts) -> tuple[Floats, Shorts]:
    """Return the two arrays of a heap with room for as many entries again."""
    count = key.shape[0]
    longer_key, longer_cell = np.empty(2 * count), np.empty(2 * count, dtype=np.int32)
    longer_key[:count], longer_cell[:count] = key, cell
    return longer_key, longer_cell


@jit
def _way_back(parent: Shorts, start: int, goal: int) -> Ints:
    """Return the cells from start to goal, of which each knows the one before it."""
    length = 1
    here = goal
    while here != start:
        here = int(parent[here])
        length += 1
    path = np.empty(length, dtype=np.int64)
    here = goal
    for k in range(length - 1, -1, -1):
        path[k] = here
        here = int(parent[here])
    return path
