"""A world as a grid of blocked cells: where the centre of a robot of a given radius cannot be.

A cell is blocked when its *centre* is closer than ``inflate`` to an obstacle (exact distances; only cells
near an obstacle are touched). Two free cells are neighbours along rows and columns; a diagonal step needs
both cells beside it to be free (no corner is cut), so "4-connected" decides what can be reached by
8-connected paths too.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope._jit import jit_alloc as jit
from swarmscope.geometry import point_segment_distance
from swarmscope.sim.world import World, WorldSpec, in_grid

Floats = NDArray[np.float64]
Bytes = NDArray[np.uint8]
Ints = NDArray[np.int64]


class Raster(NamedTuple):
    """Cells of the plane; row 0 at the bottom, cell (row, column) centred at x0 + (column + 0.5)
    resolution."""

    blocked: Bytes  # (H, W), 1 = blocked
    x0: float
    y0: float
    resolution: float


class Components(NamedTuple):
    """Free cells as horizontal runs; runs with the same label can reach one another."""

    row_first: Ints  # (H + 1,) first run of each row
    run_start: Ints  # (R,) first column
    run_end: Ints  # (R,) one past the last column
    label: Ints  # (R,)


def rasterise(
    world: World, inflate: float, domain: tuple[float, float, float, float], resolution: float = 0.05
) -> Raster:
    """Return the cells of ``domain`` (x0, y0, x1, y1) [m] with those closer than ``inflate`` to an obstacle
    blocked.

    The grid is aligned to whole multiples of the resolution, so that two domains give the same cells.
    """
    first_column, first_row = math.floor(domain[0] / resolution), math.floor(domain[1] / resolution)
    columns = max(1, math.ceil(domain[2] / resolution) - first_column)
    rows = max(1, math.ceil(domain[3] / resolution) - first_row)
    x0, y0 = first_column * resolution, first_row * resolution
    blocked = np.zeros((rows, columns), dtype=np.uint8)
    _paint_circles(blocked, x0, y0, resolution, world.circles, inflate)
    _paint_segments(blocked, x0, y0, resolution, world.segments, inflate)
    for first, last in pairwise(world.vertex_start):
        _paint_polygon(blocked, x0, y0, resolution, world.vertices[first:last])
    _paint_solid(blocked, x0, y0, resolution, world, inflate)
    return Raster(blocked, x0, y0, resolution)


def with_circles(raster: Raster, circles: Floats, inflate: float) -> Raster:
    """Return the raster with the cells blocked, too, that are closer than ``inflate`` to circles (N, 3) x, y, radius
    [m]."""
    blocked = raster.blocked.copy()
    _paint_circles(blocked, raster.x0, raster.y0, raster.resolution, circles, inflate)
    return raster._replace(blocked=blocked)


def domain_of(
    spec: WorldSpec, points: Iterable[Floats], margin: float = 2.0
) -> tuple[float, float, float, float]:
    """Return the box (x0, y0, x1, y1) [m] round the world's bounds and the points (N, 2), grown by
    ``margin``."""
    bounds = np.array(spec.bounds, dtype=np.float64).reshape(2, 2)
    corners = np.vstack([bounds, *[np.asarray(p, dtype=np.float64)[:, :2] for p in points]])
    low, high = corners.min(axis=0) - margin, corners.max(axis=0) + margin
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def cells_of(raster: Raster, points: Floats) -> Ints:
    """Return (row, column) (N, 2) of the cells that hold the points (N, 2+) [m]."""
    column = np.floor((points[:, 0] - raster.x0) / raster.resolution)
    row = np.floor((points[:, 1] - raster.y0) / raster.resolution)
    height, width = raster.blocked.shape
    cells = np.stack([np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)], axis=1)
    return cells.astype(np.int64)


def free_cells_near(raster: Raster, points: Floats, steps: int) -> Ints:
    """Return the cells (N, 2) of the points, or the free cell with the nearest centre at most ``steps``
    cells away.

    Where no such cell is free, the point's own (blocked) cell is returned.
    """
    cells = cells_of(raster, points)
    around = np.stack(np.meshgrid(*[np.arange(-steps, steps + 1)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)
    for k in np.flatnonzero(raster.blocked[cells[:, 0], cells[:, 1]]):
        near = np.clip(cells[k] + around, 0, np.array(raster.blocked.shape) - 1)
        away = centres_of(raster, near) - points[k, :2]
        distance = np.where(
            raster.blocked[near[:, 0], near[:, 1]] == 0, np.hypot(away[:, 0], away[:, 1]), np.inf
        )
        if np.isfinite(distance.min()):
            cells[k] = near[np.argmin(distance)]
    return cells


def centres_of(raster: Raster, cells: Ints) -> Floats:
    """Return the centres x, y (N, 2) [m] of the cells (N, 2) row, column."""
    x = raster.x0 + (cells[:, 1] + 0.5) * raster.resolution
    y = raster.y0 + (cells[:, 0] + 0.5) * raster.resolution
    return np.stack([x, y], axis=1)


def components(raster: Raster) -> Components:
    """Label the free cells: two have the same label when one can be reached from the other."""
    counts = _count_runs(raster.blocked)
    row_first = np.concatenate([np.zeros(1, dtype=np.int64), np.cumsum(counts)])
    runs = np.empty((2, int(row_first[-1])), dtype=np.int64)
    label = _join_runs(raster.blocked, row_first, runs[0], runs[1])
    return Components(row_first, runs[0], runs[1], label)


def labels_at(found: Components, cells: Ints) -> Ints:
    """Return the labels (N,) of the cells (N, 2), -1 where a cell is blocked."""
    return _labels_at(found.row_first, found.run_start, found.run_end, found.label, cells)


def largest_label(found: Components) -> int:
    """Return the label of the component with most cells, -1 when no cell is free."""
    if found.label.size == 0:
        return -1
    sizes = np.bincount(found.label, weights=(found.run_end - found.run_start).astype(np.float64))
    return int(np.argmax(sizes))


@jit
def _span(low: float, high: float, start: float, resolution: float, count: int) -> tuple[int, int]:
    """Return first and one past the last index of the cells that may have centres between low and high."""
    first = max(0, math.floor((low - start) / resolution - 0.5))
    last = min(count, math.ceil((high - start) / resolution - 0.5) + 1)
    return first, last


@jit
def _paint_circles(
    blocked: Bytes, x0: float, y0: float, resolution: float, circles: Floats, inflate: float
) -> None:
    for k in range(circles.shape[0]):
        x, y, reach = circles[k, 0], circles[k, 1], circles[k, 2] + inflate
        row0, row1 = _span(y - reach, y + reach, y0, resolution, blocked.shape[0])
        column0, column1 = _span(x - reach, x + reach, x0, resolution, blocked.shape[1])
        for row in range(row0, row1):
            dy = y0 + (row + 0.5) * resolution - y
            for column in range(column0, column1):
                dx = x0 + (column + 0.5) * resolution - x
                if dx * dx + dy * dy < reach * reach:
                    blocked[row, column] = 1


@jit
def _paint_segments(
    blocked: Bytes, x0: float, y0: float, resolution: float, segments: Floats, inflate: float
) -> None:
    for k in range(segments.shape[0]):
        ax, ay, bx, by = segments[k, 0], segments[k, 1], segments[k, 2], segments[k, 3]
        row0, row1 = _span(min(ay, by) - inflate, max(ay, by) + inflate, y0, resolution, blocked.shape[0])
        column0, column1 = _span(
            min(ax, bx) - inflate, max(ax, bx) + inflate, x0, resolution, blocked.shape[1]
        )
        for row in range(row0, row1):
            y = y0 + (row + 0.5) * resolution
            for column in range(column0, column1):
                x = x0 + (column + 0.5) * resolution
                if point_segment_distance(x, y, ax, ay, bx, by) < inflate:
                    blocked[row, column] = 1


@jit
def _paint_polygon(blocked: Bytes, x0: float, y0: float, resolution: float, points: Floats) -> None:
    """Block the cells whose centres are inside (even-odd rule)."""
    count = points.shape[0]
    row0, row1 = _span(points[:, 1].min(), points[:, 1].max(), y0, resolution, blocked.shape[0])
    column0, column1 = _span(points[:, 0].min(), points[:, 0].max(), x0, resolution, blocked.shape[1])
    for row in range(row0, row1):
        y = y0 + (row + 0.5) * resolution
        for column in range(column0, column1):
            x = x0 + (column + 0.5) * resolution
            inside = False
            for k in range(count):
                ax, ay = points[k, 0], points[k, 1]
                bx, by = points[(k + 1) % count, 0], points[(k + 1) % count, 1]
                if (ay > y) != (by > y) and x < ax + (y - ay) * (bx - ax) / (by - ay):
                    inside = not inside
            if inside:
                blocked[row, column] = 1


@jit
def _is_inner(solid: Bytes, row: int, column: int) -> bool:
    """Say whether the eight cells around a solid cell are solid."""
    if row == 0 or column == 0 or row == solid.shape[0] - 1 or column == solid.shape[1] - 1:
        return False
    for i in range(row - 1, row + 2):
        for j in range(column - 1, column + 2):
            if solid[i, j] == 0:
                return False
    return True


@jit
def _paint_solid(
    blocked: Bytes, x0: float, y0: float, resolution: float, world: World, inflate: float
) -> None:
    """Paint the solid cells of the grid, rounded by ``inflate`` where they are at the rim of something solid."""
    solid, cell = world.solid, world.solid_resolution
    c, s = world.solid_turn[0], world.solid_turn[1]
    half = 0.5 * cell * (abs(c) + abs(s))
    for i in range(solid.shape[0]):
        for j in range(solid.shape[1]):
            if solid[i, j] == 0:
                continue
            reach = 0.0 if _is_inner(solid, i, j) else inflate
            low_x, low_y = j * cell, i * cell
            u, v = low_x + 0.5 * cell, low_y + 0.5 * cell
            middle_x, middle_y = world.solid_origin[0] + c * u - s * v, world.solid_origin[1] + s * u + c * v
            row0, row1 = _span(middle_y - half - reach, middle_y + half + reach, y0, resolution, blocked.shape[0])
            column0, column1 = _span(middle_x - half - reach, middle_x + half + reach, x0, resolution, blocked.shape[1])
            for row in range(row0, row1):
                for column in range(column0, column1):
                    u, v = in_grid(world, x0 + (column + 0.5) * resolution, y0 + (row + 0.5) * resolution)
                    dx, dy = max(0.0, low_x - u, u - low_x - cell), max(0.0, low_y - v, v - low_y - cell)
                    if (dx == 0.0 and dy == 0.0) or dx * dx + dy * dy < reach * reach:
                        blocked[row, column] = 1


@jit
def _count_runs(blocked: Bytes) -> Ints:
    counts = np.zeros(blocked.shape[0], dtype=np.int64)
    for row in range(blocked.shape[0]):
        before = 1
        for column in range(blocked.shape[1]):
            if blocked[row, column] == 0 and before == 1:
                counts[row] += 1
            before = blocked[row, column]
    return counts


@jit
def _root(parent: Ints, k: int) -> int:
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return k


@jit
def _join_runs(blocked: Bytes, row_first: Ints, run_start: Ints, run_end: Ints) -> Ints:
    """Fill the runs and return their labels 0, 1, ... (union-find over runs of rows that touch)."""
    width = blocked.shape[1]
    parent = np.arange(run_start.shape[0])
    run = 0
    for row in range(blocked.shape[0]):
        above = row_first[row - 1] if row > 0 else 0
        column = 0
        while column < width:
            if blocked[row, column] == 1:
                column += 1
                continue
            start = column
            while column < width and blocked[row, column] == 0:
                column += 1
            run_start[run], run_end[run] = start, column
            if row > 0:
                while above < row_first[row] and run_end[above] <= start:
                    above += 1
                other = above
                while other < row_first[row] and run_start[other] < column:
                    parent[_root(parent, other)] = _root(parent, run)
                    other += 1
            run += 1
    label = np.full(run_start.shape[0], -1, dtype=np.int64)
    found = 0
    for k in range(run_start.shape[0]):
        root = _root(parent, k)
        if label[root] < 0:
            label[root] = found
            found += 1
        label[k] = label[root]
    return label


@jit
def _labels_at(row_first: Ints, run_start: Ints, run_end: Ints, label: Ints, cells: Ints) -> Ints:
    labels = np.full(cells.shape[0], -1, dtype=np.int64)
    for k in range(cells.shape[0]):
        row, column = cells[k, 0], cells[k, 1]
        low, high = row_first[row], row_first[row + 1]
        while low < high:  # the first run that ends beyond the column
            middle = (low + high) // 2
            if run_end[middle] <= column:
                low = middle + 1
            else:
                high = middle
        if low < row_first[row + 1] and run_start[low] <= column:
            labels[k] = label[low]
    return labels
