"""How near a robot's path comes to the static world, exactly, at a cost that depends only on what is near."""

from __future__ import annotations

import math

from swarmscope._jit import jit_inline
from swarmscope.geometry import point_segment_distance, segments_distance
from swarmscope.sim.world import PIECE_M, World, bin_index, in_grid


@jit_inline
def static_clearance(world: World, ax: float, ay: float, bx: float, by: float, limit: float) -> float:
    """Return the smallest distance [m] between the path a-b of a point and any static surface.

    0 where the path touches, crosses or lies in a solid; never more than ``limit`` [m], which also bounds the
    search. A disc of radius r that moves from a to b touches something exactly where the result is at most r
    (ask with ``limit`` above r). NaN in, NaN out.
    """
    if not ax + ay + bx + by + limit < math.inf:
        return math.nan
    best = max(limit, 0.0)
    if world.circles.shape[0] > 0:
        best = _circle_clearance(world, ax, ay, bx, by, best)
    if world.segments.shape[0] > 0:
        best = _segment_clearance(world, ax, ay, bx, by, best)
    if world.vertex_start.shape[0] > 1 and best > 0.0 and _inside_polygon(world, ax, ay):
        best = 0.0
    if world.solid.shape[0] > 0 and best > 0.0:
        best = _grid_clearance(world, ax, ay, bx, by, best)
    return best


@jit_inline
def _circle_clearance(world: World, ax: float, ay: float, bx: float, by: float, best: float) -> float:
    bins, circles = world.bins, world.circles
    reach = best + world.radius_max
    first_col = bin_index(min(ax, bx) - reach, bins.x0, bins.size, bins.columns)
    last_col = bin_index(max(ax, bx) + reach, bins.x0, bins.size, bins.columns)
    first_row = bin_index(min(ay, by) - reach, bins.y0, bins.size, bins.rows)
    last_row = bin_index(max(ay, by) + reach, bins.y0, bins.size, bins.rows)
    for row in range(first_row, last_row + 1):
        base = row * bins.columns
        for i in range(bins.circle_start[base + first_col], bins.circle_start[base + last_col + 1]):
            distance = point_segment_distance(circles[i, 0], circles[i, 1], ax, ay, bx, by) - circles[i, 2]
            best = min(best, max(distance, 0.0))
    return best


@jit_inline
def _segment_clearance(world: World, ax: float, ay: float, bx: float, by: float, best: float) -> float:
    bins, segments = world.bins, world.segments
    reach = best + 0.5 * PIECE_M
    first_col = bin_index(min(ax, bx) - reach, bins.x0, bins.size, bins.columns)
    last_col = bin_index(max(ax, bx) + reach, bins.x0, bins.size, bins.columns)
    first_row = bin_index(min(ay, by) - reach, bins.y0, bins.size, bins.rows)
    last_row = bin_index(max(ay, by) + reach, bins.y0, bins.size, bins.rows)
    for row in range(first_row, last_row + 1):
        base = row * bins.columns
        for i in range(bins.segment_start[base + first_col], bins.segment_start[base + last_col + 1]):
            cx, cy, dx, dy = segments[i, 0], segments[i, 1], segments[i, 2], segments[i, 3]
            best = min(best, segments_distance(ax, ay, bx, by, cx, cy, dx, dy))
    return best


@jit_inline
def _inside_polygon(world: World, x: float, y: float) -> bool:
    """Return whether the point lies in a polygon; the far end need not be asked, edges in between are."""
    bins, vertices = world.bins, world.vertices
    column = bin_index(x, bins.x0, bins.size, bins.columns)
    cell = bin_index(y, bins.y0, bins.size, bins.rows) * bins.columns + column
    for k in range(bins.polygon_start[cell], bins.polygon_start[cell + 1]):
        polygon = bins.polygon_items[k]
        first, stop = world.vertex_start[polygon], world.vertex_start[polygon + 1]
        before = stop - 1
        inside = True
        for i in range(first, stop):
            ex, ey = vertices[i, 0] - vertices[before, 0], vertices[i, 1] - vertices[before, 1]
            if ex * (y - vertices[before, 1]) - ey * (x - vertices[before, 0]) < 0.0:
                inside = False
                break
            before = i
        if inside:
            return True
    return False


@jit_inline
def _grid_clearance(world: World, ax: float, ay: float, bx: float, by: float, best: float) -> float:
    """Lower ``best`` by the solid cells near the path, in cells; free ones are skipped by ``solid_gap``."""
    scale = 1.0 / world.solid_resolution
    rows, columns = world.solid.shape
    (ax, ay), (bx, by) = in_grid(world, ax, ay), in_grid(world, bx, by)
    ax, ay, bx, by = ax * scale, ay * scale, bx * scale, by * scale
    reach = best * scale
    left, right = min(ax, bx) - reach, max(ax, bx) + reach
    low, high = min(ay, by) - reach, max(ay, by) + reach
    if right < 0.0 or left > columns or high < 0.0 or low > rows:
        return best
    gap = world.solid_gap
    if 0.0 <= ax < columns and 0.0 <= ay < rows:
        length = math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay))
        if gap[int(ay), int(ax)] - 1.0 >= length + reach:
            return best
    first_col, last_col = bin_index(left, 0.0, 1.0, columns), bin_index(right, 0.0, 1.0, columns)
    for row in range(bin_index(low, 0.0, 1.0, rows), bin_index(high, 0.0, 1.0, rows) + 1):
        col = first_col
        while col <= last_col:
            if gap[row, col] == 0:
                reach = min(reach, _cell_distance(ax, ay, bx, by, float(col), float(row)))
                col += 1
            else:
                col += int(gap[row, col])
    return min(best, reach * world.solid_resolution)


@jit_inline
def _cell_distance(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> float:
    """Return the distance between path a-b and the unit square whose lower left corner is x, y."""
    if _meets_square(ax, ay, bx, by, x, y):
        return 0.0
    return min(
        math.hypot(_outside(ax, x), _outside(ay, y)),
        math.hypot(_outside(bx, x), _outside(by, y)),
        point_segment_distance(x, y, ax, ay, bx, by),
        point_segment_distance(x + 1.0, y, ax, ay, bx, by),
        point_segment_distance(x, y + 1.0, ax, ay, bx, by),
        point_segment_distance(x + 1.0, y + 1.0, ax, ay, bx, by),
    )


@jit_inline
def _outside(value: float, low: float) -> float:
    """Return how far ``value`` lies outside low .. low + 1."""
    return max(0.0, low - value, value - low - 1.0)


@jit_inline
def _meets_square(ax: float, ay: float, bx: float, by: float, x: float, y: float) -> bool:
    """Return whether path a-b meets the unit square at x, y (separating axes: x, y and the path's normal)."""
    if max(ax, bx) < x or min(ax, bx) > x + 1.0 or max(ay, by) < y or min(ay, by) > y + 1.0:
        return False
    ux, uy = bx - ax, by - ay
    middle = ux * (y + 0.5 - ay) - uy * (x + 0.5 - ax)
    return abs(middle) <= 0.5 * (abs(ux) + abs(uy))
