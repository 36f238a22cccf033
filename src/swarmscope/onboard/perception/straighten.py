"""A scan that was taken while the robot moved, every ray from a place of its own, as seen from here.

The border is that of ``reproject``, whose pieces these are.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.perception.rays import Rays
from swarmscope.onboard.perception.reproject import (  # the same border, drawn in the same way
    Found,
    Grid,
    Seat,
    _beside_unknown,
    _break,
    _dot,
    _end,
    _end_view,
    _hide,
    _join,
    _leave_out,
    _side,
    _wall,
    border_of,
    end_of_hole,
    sound_part,
)

ON_LINE_M = 0.005
"""A return this near to the line between its neighbours is part of a surface: where rays meet that is known exactly."""


@jit
def straighten(scan: np.ndarray, hides: np.ndarray, rays: Rays, seats: np.ndarray, grid: Grid, found: Found) -> None:
    """Fill ``found`` as ``reproject`` does, where ray k was taken from ``seats[k]``.

    ``seats (B, 6)`` holds the fields of a Seat each; yaw is by how much the ray is turned.
    """
    out = found.scan
    out[:], found.hidden[:] = np.nan, np.inf
    first, last = sound_part(scan, rays.closed)
    if last < first:
        return
    before = _end(scan[last], last, rays, _seat(seats, last))
    for k in range(first, last + 1):
        seat = _seat(seats, k)
        end = _end(scan[k], k, rays, seat)
        if (k > first or rays.closed) and _is_next(seats, k, rays):
            _join(border_of(scan, hides, k - 1 if k > 0 else last, k), before, end, grid, out)
        if _beside_unknown(scan, k):
            _wall(rays.start + seat.yaw + k * rays.increment, rays.reach, seat, grid, out)
        if scan[k] < np.inf and not _is_in_line(scan, k, rays, seats):
            _dot(end, grid, out)
        before = end
    if not rays.closed:
        for k in (first, last):
            seat = _seat(seats, k)
            _leave_out(rays.start + seat.yaw + k * rays.increment, seat, grid, out)
        _end_view(grid, out)
    for k in range(first, last + 1):
        if hides[k] >= 0.0:
            _break_at(scan, k, rays, seats, grid, out)
        stop = end_of_hole(hides, k, last)
        if stop > k:
            right = _side(hides[k], scan[k], k - 1, rays, _seat(seats, k - 1))
            left = _side(hides[k], scan[k], stop, rays, _seat(seats, stop % len(seats)))
            _hide(right, left, grid, found.hidden)


@jit_inner
def _break_at(scan: np.ndarray, k: int, rays: Rays, seats: np.ndarray, grid: Grid, out: np.ndarray) -> None:
    """Make broken again what looks where ray k was bridged."""
    right, left = k - 1 if k > 0 else scan.size - 1, k + 1 if k + 1 < scan.size else 0
    a = _end(scan[right], right, rays, _seat(seats, right))
    b = _end(scan[left], left, rays, _seat(seats, left))
    _break(a, _end(scan[k], k, rays, _seat(seats, k)), b, grid, out)


@jit_inner
def _seat(seats: np.ndarray, k: int) -> Seat:
    """Return where ray k was taken."""
    return Seat(seats[k, 0], seats[k, 1], seats[k, 2], seats[k, 3], seats[k, 4], seats[k, 5])


@jit_inner
def _is_next(seats: np.ndarray, k: int, rays: Rays) -> bool:
    """Tell whether ray k looks to the left of the one before; a robot that turns with the beams looks twice."""
    apart, total = rays.increment, len(seats)
    if k == 0:
        apart = 2.0 * math.pi - (total - 1) * rays.increment
    return bool(apart + seats[k, 2] - seats[k - 1 if k > 0 else total - 1, 2] > 0.0)


@jit_inner
def _is_in_line(scan: np.ndarray, k: int, rays: Rays, seats: np.ndarray) -> bool:
    """Tell whether the return of ray k lies between those of its neighbours, on the line that joins them."""
    total = scan.size
    if not rays.closed and k in (0, total - 1):
        return False
    i, j = k - 1 if k > 0 else total - 1, k + 1 if k + 1 < total else 0
    if not (scan[i] < np.inf and scan[j] < np.inf):
        return False
    a = _end(scan[i], i, rays, _seat(seats, i))
    b = _end(scan[k], k, rays, _seat(seats, k))
    c = _end(scan[j], j, rays, _seat(seats, j))
    ux, uy, vx, vy = c.x - a.x, c.y - a.y, b.x - a.x, b.y - a.y
    length2, along, across = ux * ux + uy * uy, ux * vx + uy * vy, ux * vy - uy * vx
    return bool(0.0 < along < length2 and across * across < ON_LINE_M * ON_LINE_M * length2)
