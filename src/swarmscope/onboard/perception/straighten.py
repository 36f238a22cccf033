"""A scan that was taken while the robot moved, every ray from a place of its own, as seen from here.

The border is that of ``reproject``, whose pieces these are.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.perception.rays import Rays
from swarmscope.onboard.perception.reproject import (  # the same border, drawn in the same way
    Grid,
    Seat,
    _beside_unknown,
    _dot,
    _end,
    _join,
    _leave_out,
    _wall,
)

ON_LINE_M = 0.005
"""A return this near to the line between its neighbours is part of a surface: where rays meet that is known exactly."""


@jit
def straighten(scan: np.ndarray, rays: Rays, seats: np.ndarray, core: float, grid: Grid, out: np.ndarray) -> None:
    """Write ``scan (B,)`` into ``out (M,)`` along ``grid`` round where we are; ray k was taken from ``seats[k]``.

    ``seats (B, 5)`` holds the fields of a Seat but the last, ``core``; yaw is by how much the ray is turned. Ranges are
    float32 [m], +inf for no return, NaN for broken ones.
    """
    for n in range(out.size):
        out[n] = np.nan
    total = scan.size
    before = _end(scan[total - 1], total - 1, rays, _seat(seats, total - 1, core))
    for k in range(total):
        seat = _seat(seats, k, core)
        end = _end(scan[k], k, rays, seat)
        if (k > 0 or rays.closed) and _is_next(seats, k, rays):
            _join(scan[k - 1 if k > 0 else total - 1], scan[k], before, end, grid, out)
        if _beside_unknown(scan, k, rays.closed):
            _wall(rays.start + seat.yaw + k * rays.increment, rays.reach, seat, grid, out)
        if scan[k] < np.inf and not _is_in_line(scan, k, rays, seats, core):
            _dot(end, grid, out)
        before = end
    if rays.closed:
        return
    right, left = _seat(seats, 0, core), _seat(seats, total - 1, core)  # the outermost rays themselves were free
    _leave_out(True, rays.start + right.yaw - rays.increment, right, grid, out)
    _leave_out(False, rays.start + left.yaw + total * rays.increment, left, grid, out)


@jit_inner
def _seat(seats: np.ndarray, k: int, core: float) -> Seat:
    """Return where ray k was taken."""
    return Seat(seats[k, 0], seats[k, 1], seats[k, 2], seats[k, 3], seats[k, 4], core)


@jit_inner
def _is_next(seats: np.ndarray, k: int, rays: Rays) -> bool:
    """Tell whether ray k looks to the left of the one before; a robot that turns with the beams looks twice."""
    apart, total = rays.increment, len(seats)
    if k == 0:
        apart = 2.0 * math.pi - (total - 1) * rays.increment
    return bool(apart + seats[k, 2] - seats[k - 1 if k > 0 else total - 1, 2] > 0.0)


@jit_inner
def _is_in_line(scan: np.ndarray, k: int, rays: Rays, seats: np.ndarray, core: float) -> bool:
    """Tell whether the return of ray k lies between those of its neighbours, on the line that joins them."""
    total = scan.size
    if not rays.closed and k in (0, total - 1):
        return False
    i, j = k - 1 if k > 0 else total - 1, k + 1 if k + 1 < total else 0
    if not (scan[i] < np.inf and scan[j] < np.inf):
        return False
    a = _end(scan[i], i, rays, _seat(seats, i, core))
    b = _end(scan[k], k, rays, _seat(seats, k, core))
    c = _end(scan[j], j, rays, _seat(seats, j, core))
    ux, uy, vx, vy = c.x - a.x, c.y - a.y, b.x - a.x, b.y - a.y
    length2, along, across = ux * ux + uy * uy, ux * vx + uy * vy, ux * vy - uy * vx
    return bool(0.0 < along < length2 and across * across < ON_LINE_M * ON_LINE_M * length2)
