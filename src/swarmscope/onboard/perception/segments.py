"""A scan as line segments, for libraries that want obstacles so; written into a planner's memory (see ``orca``).

*Goal frame*: origin at the robot, x towards the goal.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import point_segment_distance
from swarmscope.onboard.percept import Row
from swarmscope.onboard.view import View

MAX_LINES = 40
"""Segments for one robot; with more, all are made coarser."""
LINE_ERROR = 0.015
"""Returns lie within this of their segment [m]."""


class Ring(NamedTuple):
    """The returns in reach: their beams in ``see.edges``, how many, and which comes after the widest gap."""

    returns: int
    first: int


@jit
def write_segments(see: View, memory: Row, reach: float, closed: float) -> None:
    """Write the border within ``reach`` [m] as segments into ``memory``. ``see.narrow``, ``see.edges`` are scratch.

    Neighbouring returns are joined when they are nearer than ``closed`` [m], so that what is too narrow is closed;
    then every chain is divided where it is farthest from its chord (Douglas and Peucker) until ``LINE_ERROR`` holds.
    Where that makes more than ``MAX_LINES``, the error is larger; with more chains than that, wider gaps are closed.
    """
    sensor, hits = see.rig.sensor, see.edges
    count = 0
    for n in range(sensor.beams):
        if sensor.range_min <= see.masked[n] < reach and see.masked[n] > 0.0:
            hits[count] = n
            count += 1
    if count == 0:
        return
    widest, last = -1.0, 0  # the ring of returns is cut at its widest gap, wherever the scan begins
    for k in range(count):
        gap = _gap(see, hits[k], hits[(k + 1) % count])
        if gap > widest:
            widest, last = gap, k
    ring = Ring(count, (last + 1) % count)
    error = LINE_ERROR
    while not _divide(see, memory, ring, closed, error):
        if _chains(see, ring, closed) > MAX_LINES:  # each takes a segment, however coarse
            closed *= 1.5
        else:
            error *= 1.5
    _sort(memory["lines"], memory["lines_n"])


@jit_inner
def _sort(lines: np.ndarray, count: int) -> None:
    """Order segments by the distance of their middle: where two touch, the library's answer depends on the order."""
    for k in range(1, count):
        ax, ay, bx, by = lines[k, 0, 0], lines[k, 0, 1], lines[k, 1, 0], lines[k, 1, 1]
        middle = (ax + bx) * (ax + bx) + (ay + by) * (ay + by)
        j = k
        while j > 0 and middle < (lines[j - 1, 0, 0] + lines[j - 1, 1, 0]) ** 2 + (
            lines[j - 1, 0, 1] + lines[j - 1, 1, 1]
        ) ** 2:
            for end in range(2):
                lines[j, end, 0], lines[j, end, 1] = lines[j - 1, end, 0], lines[j - 1, end, 1]
            j -= 1
        lines[j, 0, 0], lines[j, 0, 1], lines[j, 1, 0], lines[j, 1, 1] = ax, ay, bx, by


@jit_inner
def _gap(see: View, a: int, b: int) -> float:
    """Return the distance [m] between the returns of two beams."""
    rig, work = see.rig, see.masked
    dx = work[a] * rig.cos[a] - work[b] * rig.cos[b]
    dy = work[a] * rig.sin[a] - work[b] * rig.sin[b]
    return math.sqrt(dx * dx + dy * dy)


@jit_inner
def _chains(see: View, ring: Ring, closed: float) -> int:
    """Return how many chains the returns make."""
    hits, count, chains = see.edges, ring.returns, 1
    for k in range(1, count):
        chains += _gap(see, hits[(ring.first + k - 1) % count], hits[(ring.first + k) % count]) > closed
    return chains


@jit_inner
def _divide(see: View, memory: Row, ring: Ring, closed: float, error: float) -> bool:
    """Write chains of returns as segments with at most ``error`` [m]; return whether there was room for all."""
    keep, hits, count, begin_at = see.narrow, see.edges, ring.returns, ring.first
    for k in range(count):
        keep[k] = 0
    keep[0] = keep[count - 1] = 1  # by place after ``begin_at``
    for k in range(1, count):
        if _gap(see, hits[(begin_at + k - 1) % count], hits[(begin_at + k) % count]) > closed:
            keep[k - 1] |= 1
            keep[k] |= 3  # a chain begins here
    memory["lines_n"] = 0
    a = 0
    while a < count:
        b = a + 1
        while b < count and keep[b] == 0:
            b += 1
        if b == count or keep[b] & 2:  # the end of a chain
            if a == 0 or keep[a] & 2:
                if memory["lines_n"] == MAX_LINES:
                    return False
                _put_dot(see, memory, hits[(begin_at + a) % count])
            a = b
            continue
        na, nb = hits[(begin_at + a) % count], hits[(begin_at + b) % count]
        ax, ay = see.masked[na] * see.rig.cos[na], see.masked[na] * see.rig.sin[na]
        bx, by = see.masked[nb] * see.rig.cos[nb], see.masked[nb] * see.rig.sin[nb]
        worst, at = error, -1
        for k in range(a + 1, b):
            n = hits[(begin_at + k) % count]
            far = point_segment_distance(see.masked[n] * see.rig.cos[n], see.masked[n] * see.rig.sin[n], ax, ay, bx, by)
            if far > worst:
                worst, at = far, k
        if at >= 0:
            keep[at] |= 1
            continue
        if memory["lines_n"] == MAX_LINES:
            return False
        _put(see, memory, ax, ay, bx, by)
        a = b
    return True


@jit_inner
def _put_dot(see: View, memory: Row, n: int) -> None:
    """Add a segment as wide as its beam for a return that stands alone."""
    rig, work = see.rig, see.masked
    half = max(0.005, 0.5 * work[n] * rig.sensor.increment)
    x, y = work[n] * rig.cos[n], work[n] * rig.sin[n]
    dx, dy = half * rig.sin[n], -half * rig.cos[n]
    _put(see, memory, x + dx, y + dy, x - dx, y - dy)


@jit_inner
def _put(see: View, memory: Row, ax: float, ay: float, bx: float, by: float) -> None:
    """Add segment a-b (body frame) to the robot's, unless it has no length."""
    if (bx - ax) * (bx - ax) + (by - ay) * (by - ay) < 1e-8:
        return
    bearing = see.percept["goal_bearing"]
    c, s = math.cos(bearing), math.sin(bearing)
    n = memory["lines_n"]
    memory["lines"][n, 0, 0], memory["lines"][n, 0, 1] = c * ax + s * ay, c * ay - s * ax
    memory["lines"][n, 1, 0], memory["lines"][n, 1, 1] = c * bx + s * by, c * by - s * bx
    memory["lines_n"] = n + 1
