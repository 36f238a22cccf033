"""A 2D lidar in an occupancy grid: beams side by side cross its free slabs together, from portal to portal.

The beams that enter a slab through one portal are a bundle. Corners on the slab's far side part it: some beams meet a
wall, those between two corners go on as the bundle of the next portal (cells and portals; Teller and Sequin,
"Visibility preprocessing for interactive walkthroughs", SIGGRAPH 1991). Every beam of a bundle goes to one of them, so
none slips through where walls join, and no beam is asked about a wall that it does not meet.

Only up and down lead from slab to slab, so half a turn of beams is cast at a time: those that look up the grid's rows,
and those that look down, in a frame turned by 180 degrees. Lengths are in cells, in the frame of the grid; ranges are
those of a walk from border to border, bit for bit, but where a beam passes through a corner.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline
from swarmscope.geometry import ROUGH, rough_angle
from swarmscope.sim.beams import Beams, Ranges
from swarmscope.sim.slabs import ABOVE, BELOW, BOTTOM, LEFT, RIGHT, TOP, Bytes, Indices, Slabs, slab_at
from swarmscope.sim.world import World, bin_index, in_grid

SLACK = 4.0 * ROUGH
"""Beams nearer than this to a corner [rad] are compared with it exactly."""
FEW_BEAMS = 48
"""So few are walked faster one by one."""


class _Sensor(NamedTuple):
    """Where the sensor is in the grid's frame, and how its beams are counted."""

    x: float
    """Along columns [cells]."""
    y: float
    """Along rows [cells]."""
    cos: float
    """Where it looks, from the direction of the columns."""
    sin: float
    per_rad: float
    """Beams in a radian."""
    reach: float
    """The farthest that is within the range [cells]."""
    side: float
    """Side of a cell [m]."""


class _Frame(NamedTuple):
    """The frame, at the sensor, in which half a turn of beams looks up: that of the grid, or turned by 180 degrees.

    ``left``, ``top`` and ``right`` are as seen in this frame.
    """

    sign: float
    """1, or -1 where it is turned."""
    cos: float
    """Where the sensor looks, in this frame."""
    sin: float
    start: float
    """Where beam 0 looks [rad], in this frame."""
    tie: float
    """A beam has passed a corner when their cross product is above this: a walked beam that goes through the corner
    of a cell passes it on the same side, whether it looks up or down."""
    left: int
    """Columns of ``Slabs.table`` in which the borders are."""
    top: int
    right: int
    links: int
    left_edge: int
    """Where the grid ends [cells]."""
    top_edge: int
    right_edge: int


@jit_inline
def cast_grid(world: World, x: float, y: float, cos_yaw: float, sin_yaw: float, beams: Beams, out: Ranges) -> None:
    """Fill ``out`` (M,) with the ranges [m] to the solid cells from x, y [m], heading cos, sin, world frame."""
    sensor = _sensor_in(world, x, y, cos_yaw, sin_yaw, beams)
    rows, columns = world.solid_gap.shape
    col, row = bin_index(sensor.x, 0.0, 1.0, columns), bin_index(sensor.y, 0.0, 1.0, rows)
    within = 0.0 <= sensor.x < columns and 0.0 <= sensor.y < rows and not math.isnan(sensor.cos)
    on_corner = sensor.x == col and sensor.y == row
    few = out.shape[0] <= FEW_BEAMS or world.slabs.table.shape[0] == 0
    if few or not within or on_corner or world.solid_gap[row, col] == 0:
        _walk_beams(world.solid_gap, sensor, beams, out)
        return
    slab = slab_at(world.slabs, row, col)
    start = math.atan2(sensor.sin, sensor.cos) + beams.angle_min
    half = int(math.floor(start / math.pi))
    first = 0
    while first < out.shape[0]:
        up = half % 2 == 0
        stop = _half_turn_end(sensor, beams, first, (half + 1) * math.pi - start, up)
        if stop > first:
            frame = _frame_of(sensor, start, half, rows, columns)
            _cast_half_turn(world.slabs, sensor, frame, beams, slab, first, stop, out)
        first = stop
        half += 1


@jit_inline
def _sensor_in(world: World, x: float, y: float, cos_yaw: float, sin_yaw: float, beams: Beams) -> _Sensor:
    side = world.solid_resolution
    px, py = in_grid(world, x, y)
    c, s = world.solid_turn[0], world.solid_turn[1]
    cos, sin = c * cos_yaw + s * sin_yaw, c * sin_yaw - s * cos_yaw
    reach = beams.range_max / side
    while side * reach > beams.range_max:
        reach = np.nextafter(reach, 0.0)
    return _Sensor(px / side, py / side, cos, sin, 1.0 / beams.increment, reach, side)


@jit_inline
def _frame_of(sensor: _Sensor, start: float, half: int, rows: int, columns: int) -> _Frame:
    """Return the frame for the beams that look half * pi .. (half + 1) * pi, from the direction of the columns.

    Beam 0 looks to ``start`` [rad] from there.
    """
    start -= half * math.pi
    if half % 2 == 0:
        return _Frame(1.0, sensor.cos, sensor.sin, start, 0.0, LEFT, TOP, RIGHT, ABOVE, 0, rows, columns)
    before_0 = -5e-324  # the number before it: a cross product of 0 is above this
    return _Frame(-1.0, -sensor.cos, -sensor.sin, start, before_0, RIGHT, BOTTOM, LEFT, BELOW, columns, 0, 0)


@jit_inline
def _half_turn_end(sensor: _Sensor, beams: Beams, first: int, angle: float, up: bool) -> int:
    """Return the first beam from ``first`` on that does not look up (or down, if not ``up``) any more.

    It is ``angle`` [rad] from beam 0, to within rounding.
    """
    total = int(beams.cos.shape[0])
    n = max(first, min(int((angle - SLACK) * sensor.per_rad + 1.0), total))
    while n < total and (sensor.sin * beams.cos[n] + sensor.cos * beams.sin[n] >= 0.0) == up:
        n += 1
    return n


@jit
def _cast_half_turn(
    slabs: Slabs, sensor: _Sensor, frame: _Frame, beams: Beams, slab: int, first: int, stop: int, out: Ranges
) -> None:
    """Cast beams first .. stop - 1, which look up in ``frame``, from within ``slab``.

    Bundles that wait for their turn are noted in ``out`` itself, in the places of their beams: - 1 - 2 slab for one
    beam, - 2 - 2 slab for more, followed by where the bundle ends.
    """
    end = stop
    while True:
        slab, first, end = _part_bundle(slabs, sensor, frame, beams, slab, first, end, out)
        if first == end:
            while first < stop and out[first] > -0.5:
                first += 1
            if first == stop:
                return
            note = int(-out[first]) - 1
            slab = note // 2
            end = first + 1 if note % 2 == 0 else int(out[first + 1])


@jit_inline
def _part_bundle(
    slabs: Slabs, sensor: _Sensor, frame: _Frame, beams: Beams, slab: int, first: int, end: int, out: Ranges
) -> tuple[int, int, int]:
    """Give beams first .. end - 1 in ``slab``, counter-clockwise, to the walls and portals that they leave it by.

    Return the first bundle that goes on, as slab, first and end, and note the others; first is end if none goes on.
    """
    table = slabs.table
    left, right = _across(table, sensor, frame, slab)
    top = frame.sign * (table[slab, frame.top] - sensor.y)
    ends = _direction(frame, beams, first), _direction(frame, beams, end - 1)
    onward, n, portal_left = (slab, end, end), first, right
    if right >= 0.0:
        n = _beam_past(right, top, frame, sensor, beams, ends, first, end)
        wall = right if table[slab, frame.right] != frame.right_edge else math.inf
        _cast_wall(wall, frame.cos, frame.sin, sensor, beams, first, n, out)
    ceiling = top if table[slab, frame.top] != frame.top_edge else math.inf
    for k in range(table[slab, frame.links], table[slab, frame.links + 1]):
        if n == end:
            break
        next_left, next_right = _across(table, sensor, frame, slabs.links[k])
        portal_left = next_left if next_left > left else left
        if next_right < right:
            stop = _beam_past(next_right, top, frame, sensor, beams, ends, n, end)
            _cast_wall(ceiling, frame.sin, -frame.cos, sensor, beams, n, stop, out)
            n = stop
        stop = _beam_past(portal_left, top, frame, sensor, beams, ends, n, end)
        if stop > n:
            aside = max(portal_left, -min(next_right, right), 0.0)
            if top * top + aside * aside > sensor.reach * sensor.reach * (1.0 + 1e-9):
                out[n:stop] = math.inf
            elif onward[1] == end:
                onward = (slabs.links[k], n, stop)
            else:
                _note_bundle(slabs.links[k], n, stop, out)
        n = stop
    if n < end:
        stop = n
        if left > 0.0:
            stop = end
        elif portal_left > left:
            stop = _beam_past(left, top, frame, sensor, beams, ends, n, end)
        _cast_wall(ceiling, frame.sin, -frame.cos, sensor, beams, n, stop, out)
        wall = left if table[slab, frame.left] != frame.left_edge else -math.inf
        _cast_wall(wall, frame.cos, frame.sin, sensor, beams, stop, end, out)
    return (onward[0], onward[1], onward[2]) if onward[1] < end else (slab, end, end)


@jit_inline
def _across(table: Indices, sensor: _Sensor, frame: _Frame, slab: int) -> tuple[float, float]:
    """Return where left and right of ``slab`` are [cells], in ``frame``."""
    left, right = table[slab, frame.left] - sensor.x, table[slab, frame.right] - sensor.x
    return frame.sign * left, frame.sign * right


@jit_inline
def _direction(frame: _Frame, beams: Beams, n: int) -> tuple[float, float]:
    """Return the direction of beam ``n`` in ``frame``."""
    cos, sin = beams.cos[n], beams.sin[n]
    return frame.cos * cos - frame.sin * sin, frame.sin * cos + frame.cos * sin


@jit_inline
def _has_passed(direction: tuple[float, float], u: float, v: float, tie: float) -> bool:
    """Tell whether a beam looks farther counter-clockwise than to the corner u, v."""
    return u * direction[1] - v * direction[0] > tie


@jit_inline
def _beam_past(
    u: float,
    v: float,
    frame: _Frame,
    sensor: _Sensor,
    beams: Beams,
    ends: tuple[tuple[float, float], tuple[float, float]],
    low: int,
    high: int,
) -> int:
    """Return the first beam of low .. high - 1 that has passed the corner u, v [cells], ``high`` if none has.

    ``ends`` are the directions of two beams, one before or at ``low`` and that of high - 1: most corners need no angle.
    """
    if _has_passed(ends[0], u, v, frame.tie):
        return low
    if not _has_passed(ends[1], u, v, frame.tie):
        return high
    offset = (rough_angle(u, v) - frame.start) * sensor.per_rad
    slack = SLACK * sensor.per_rad
    n = int(offset - slack + 1.0)
    n = low if n < low else n
    n = high if n > high else n
    if n - offset <= slack:
        while n < high and not _has_passed(_direction(frame, beams, n), u, v, frame.tie):
            n += 1
    return n


@jit_inline
def _cast_wall(
    wall: float, cos: float, sin: float, sensor: _Sensor, beams: Beams, first: int, stop: int, out: Ranges
) -> None:
    """Set the ranges of beams first .. stop - 1 to where they meet a line at ``wall`` [cells] along one axis.

    ``cos`` and ``sin`` are those of the sensor's heading from that axis.
    """
    if first < stop:  # more often there are none: a call would take longer than the rest
        _meet_line(wall, cos, sin, sensor, beams, first, stop, out)


@jit
def _meet_line(
    wall: float, cos: float, sin: float, sensor: _Sensor, beams: Beams, first: int, stop: int, out: Ranges
) -> None:
    cosines, sines, reach, side = beams.cos, beams.sin, sensor.reach, sensor.side
    for n in range(np.uint64(first), np.uint64(stop)):  # no negative numbers: the compiler casts several at once
        t = wall * (1.0 / (cos * cosines[n] - sin * sines[n]))
        out[n] = side * t if t <= reach else math.inf


@jit_inline
def _note_bundle(slab: int, first: int, end: int, out: Ranges) -> None:
    if end - first == 1:
        out[first] = -1.0 - 2.0 * slab
    else:
        out[first] = -2.0 - 2.0 * slab
        out[first + 1] = end


@jit
def _walk_beams(gap: Bytes, sensor: _Sensor, beams: Beams, out: Ranges) -> None:
    """Cast the beams one by one."""
    for n in range(out.shape[0]):
        dx = sensor.cos * beams.cos[n] - sensor.sin * beams.sin[n]
        dy = sensor.sin * beams.cos[n] + sensor.cos * beams.sin[n]
        t = _walk(gap, sensor.x, sensor.y, dx, dy, sensor.reach)
        out[n] = sensor.side * t if t <= sensor.reach else math.inf


@jit
def _walk(gap: Bytes, px: float, py: float, dx: float, dy: float, far: float) -> float:
    """Return how far a ray from p along unit direction d goes to a solid cell's border [cells], else inf.

    Amanatides and Woo's walk from border to border, except that where ``gap`` says that the nearest solid
    cell is k cells away, the ray crosses the whole free square of 2 k - 1 cells at once.
    """
    rows, columns = gap.shape
    inverse_x = 1.0 / dx if dx != 0.0 else math.inf
    inverse_y = 1.0 / dy if dy != 0.0 else math.inf
    t, end = _clip_to_grid(px, dx, inverse_x, columns, 0.0, far)
    t, end = _clip_to_grid(py, dy, inverse_y, rows, t, end)
    col, row = bin_index(px + t * dx, 0.0, 1.0, columns), bin_index(py + t * dy, 0.0, 1.0, rows)
    while t <= end and 0 <= col < columns and 0 <= row < rows:
        k = int(gap[row, col])
        if k == 0:
            return t
        border_x, border_y = (col + k if dx >= 0.0 else col - k + 1), (row + k if dy >= 0.0 else row - k + 1)
        t_x, t_y = (border_x - px) * inverse_x, (border_y - py) * inverse_y
        if t_x <= t_y:
            t = t_x if t_x >= t else t  # along a border it may be less, by rounding
            col = border_x if dx >= 0.0 else border_x - 1
            row = _cell_after(py + t * dy, row, k, dy)
        else:
            t = t_y if t_y >= t else t
            row = border_y if dy >= 0.0 else border_y - 1
            col = _cell_after(px + t * dx, col, k, dx)
    return math.inf


@jit_inline
def _clip_to_grid(
    p: float, d: float, inverse: float, count: int, t: float, end: float
) -> tuple[float, float]:
    """Return the part of a ray's stretch t .. end between borders 0 and ``count`` of one axis."""
    if d == 0.0:
        return (t, end) if 0.0 <= p < count else (math.inf, end)
    enter, leave = -p * inverse, (count - p) * inverse
    return max(t, min(enter, leave)), min(end, max(enter, leave))


@jit_inline
def _cell_after(position: float, cell: int, k: int, d: float) -> int:
    """Return the cell of ``position`` along one axis, in the free square and never against direction d."""
    if d >= 0.0:
        return cell + int(min(max(position - cell, 0.0), k - 1.0))
    return cell - int(min(max(math.ceil(cell - position), 0.0), k - 1.0))
