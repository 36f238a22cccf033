"""A 2D lidar: exact ranges to circles, segments, grid cells and discs, found from the obstacle to its beams.

Instead of asking every beam for its nearest obstacle, each obstacle near the robot is turned into the sensor
frame, the few beams it can meet are worked out, and only those are intersected. The ranges are exact; only
the choice of beams is rounded outwards. The sensor sits at the robot's centre and looks along its heading.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline
from swarmscope.geometry import rough_angle
from swarmscope.sim.beams import Beams, Ranges
from swarmscope.sim.lidar_grid import cast_grid
from swarmscope.sim.world import PIECE_M, World, bin_index, bin_run

ANGLE_SLACK = 5e-4
"""Added to each side of an obstacle's angular interval [rad]; larger than the error of `rough_angle`."""


@jit_inline
def cast_static(world: World, x: float, y: float, yaw: float, beams: Beams, out: Ranges) -> None:
    """Fill ``out`` (M,) with the ranges [m] to the static world from pose x, y [m], yaw [rad], world frame.

    ``inf`` where nothing is within ``range_max``. From inside a circle or polygon the range is to its far
    surface; from inside a solid grid cell it is 0. In a wall, where no robot can be, it is to whatever lies beyond.
    """
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    if world.solid.shape[0] > 0:
        cast_grid(world, x, y, cos_yaw, sin_yaw, beams, out)
    else:
        for n in range(out.shape[0]):
            out[n] = math.inf
    if world.circles.shape[0] > 0:
        _cast_circles(world, x, y, cos_yaw, sin_yaw, beams, out)
    if world.segments.shape[0] > 0:
        _cast_segments(world, x, y, cos_yaw, sin_yaw, beams, out)


@jit_inline
def cast_disc(cx: float, cy: float, radius: float, beams: Beams, out: Ranges) -> None:
    """Lower ``out`` (M,) where the disc with centre cx, cy and ``radius`` [m], sensor frame, is nearer.

    From inside the disc the range is to its far side.
    """
    reach = beams.range_max + radius
    distance2 = cx * cx + cy * cy
    if not distance2 <= reach * reach:
        return
    if distance2 <= radius * radius:
        _disc_run(cx, cy, radius, beams, 0, out.shape[0], out)
        return
    ratio = radius / math.sqrt(distance2)
    half = ratio + (0.5 * math.pi - 1.0) * ratio * ratio * ratio + ANGLE_SLACK  # never below asin(ratio)
    low, high = _beam_offsets(rough_angle(cx, cy) - half, 2.0 * half, beams)
    total = out.shape[0]
    _disc_run(cx, cy, radius, beams, int(low), min(int(high) + 2, total), out)
    turn = 2.0 * math.pi / beams.increment
    if high + 1.0 >= turn:
        _disc_run(cx, cy, radius, beams, 0, min(int(high - turn + 1.0) + 1, total), out)


@jit
def cast_segment(ax: float, ay: float, bx: float, by: float, beams: Beams, out: Ranges) -> None:
    """Lower ``out`` (M,) where segment a-b [m], sensor frame, is nearer."""
    total = out.shape[0]
    angle_a, angle_b = rough_angle(ax, ay), rough_angle(bx, by)
    width = angle_b - angle_a
    if width > math.pi:
        width -= 2.0 * math.pi
    elif width < -math.pi:
        width += 2.0 * math.pi
    start = angle_a if width >= 0.0 else angle_b
    width = abs(width)
    if width > math.pi - 0.01:  # the sensor is all but on the segment: either side may be seen
        _segment_run(ax, ay, bx, by, beams, 0, total, out)
        return
    low, high = _beam_offsets(start - ANGLE_SLACK, width + 2.0 * ANGLE_SLACK, beams)
    _segment_run(ax, ay, bx, by, beams, int(low), min(int(high) + 2, total), out)
    turn = 2.0 * math.pi / beams.increment
    if high + 1.0 >= turn:
        _segment_run(ax, ay, bx, by, beams, 0, min(int(high - turn + 1.0) + 1, total), out)


@jit_inline
def _disc_run(cx: float, cy: float, radius: float, beams: Beams, first: int, stop: int, out: Ranges) -> None:
    """Intersect beams first .. stop - 1 with a disc; from inside it, the exit counts."""
    radius2 = radius * radius
    cosines, sines, ranges = beams.cos[first:stop], beams.sin[first:stop], out[first:stop]
    for n in range(ranges.size):  # without branches: several beams at a time
        dx, dy = cosines[n], sines[n]
        across = cx * dy - cy * dx
        under = radius2 - across * across
        along = cx * dx + cy * dy
        half = math.sqrt(max(0.0, under))
        distance = along - half if along >= half else along + half
        nearer = (under >= 0.0) & (distance >= 0.0) & (distance <= beams.range_max) & (distance < ranges[n])
        ranges[n] = distance if nearer else ranges[n]


@jit_inline
def _segment_run(
    ax: float, ay: float, bx: float, by: float, beams: Beams, first: int, stop: int, out: Ranges
) -> None:
    """Intersect beams first .. stop - 1 with segment a-b.

    A beam meets it when the ends lie on different sides of the beam. Neighbouring pieces share their ends
    exactly, so no beam slips through the joint.
    """
    area = ax * by - ay * bx
    for n in range(first, stop):
        dx, dy = beams.cos[n], beams.sin[n]
        side_a = ax * dy - ay * dx
        side_b = bx * dy - by * dx
        if side_a * side_b <= 0.0:
            distance = area / (side_a - side_b)
            if 0.0 <= distance <= beams.range_max and distance < out[n]:
                out[n] = distance


@jit_inline
def _beam_offsets(start: float, width: float, beams: Beams) -> tuple[float, float]:
    """Return where directions start .. start + width [rad] lie, counted in beams; the first in one turn."""
    offset = start - beams.angle_min
    if offset < 0.0:
        offset += 2.0 * math.pi
    elif offset >= 2.0 * math.pi:
        offset -= 2.0 * math.pi
    return offset / beams.increment, (offset + width) / beams.increment


@jit
def _cast_circles(
    world: World, x: float, y: float, cos_yaw: float, sin_yaw: float, beams: Beams, out: Ranges
) -> None:
    """Cast the circles whose centres lie within reach."""
    bins, circles = world.bins, world.circles
    reach = beams.range_max + world.radius_max
    first_row = bin_index(y - reach, bins.y0, bins.size, bins.rows)
    last_row = bin_index(y + reach, bins.y0, bins.size, bins.rows)
    for row in range(first_row, last_row + 1):
        first, stop = bin_run(bins, bins.circle_start, row, x, y, reach)
        for i in range(first, stop):
            dx, dy = circles[i, 0] - x, circles[i, 1] - y
            cast_disc(cos_yaw * dx + sin_yaw * dy, cos_yaw * dy - sin_yaw * dx, circles[i, 2], beams, out)


@jit
def _cast_segments(
    world: World, x: float, y: float, cos_yaw: float, sin_yaw: float, beams: Beams, out: Ranges
) -> None:
    """Cast the segments whose midpoints lie within reach."""
    bins, segments = world.bins, world.segments
    reach = beams.range_max + 0.5 * PIECE_M
    first_row = bin_index(y - reach, bins.y0, bins.size, bins.rows)
    last_row = bin_index(y + reach, bins.y0, bins.size, bins.rows)
    for row in range(first_row, last_row + 1):
        first, stop = bin_run(bins, bins.segment_start, row, x, y, reach)
        for i in range(first, stop):
            dx, dy = segments[i, 0] - x, segments[i, 1] - y
            ax, ay = cos_yaw * dx + sin_yaw * dy, cos_yaw * dy - sin_yaw * dx
            dx, dy = segments[i, 2] - x, segments[i, 3] - y
            bx, by = cos_yaw * dx + sin_yaw * dy, cos_yaw * dy - sin_yaw * dx
            if world.one_sided[i] and ax * by - ay * bx >= 0.0:
                continue
            if 0.25 * ((ax + bx) * (ax + bx) + (ay + by) * (ay + by)) <= reach * reach:
                cast_segment(ax, ay, bx, by, beams, out)
