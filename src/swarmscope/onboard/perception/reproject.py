"""A scan that was taken elsewhere, as seen from here: sensors off the body's centre, and scans that have aged.

What a scan knows is the area between the sensor and its readings. Its border is what a robot elsewhere sees: the
returns, joined ray by ray (between a near and a far one lies the edge of a shadow, and nobody knows what is in it), and
walls along broken rays and along the edges of a limited field. Directions in which no border is seen are broken (NaN).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import ray_segment, wrap_angle
from swarmscope.onboard.lidar import Rays

ON_BORDER = math.pi - 0.01
"""Seen under a larger angle than this [rad], a piece of border passes through where we are."""


class Seat(NamedTuple):
    """Where a scan was taken, in the body frame of the robot that looks at it now."""

    x: float
    """Of the sensor [m]."""
    y: float
    yaw: float
    """How far the body has to be turned back to where it was [rad]; the rays' start holds the mount's."""
    body_x: float
    """Where the body's centre was [m]."""
    body_y: float
    core: float
    """What lies closer than this to the body's centre, then or now, is the robot itself [m]."""


@jit
def settle(raw: np.ndarray, order: np.ndarray, least: float, most: float, out: np.ndarray) -> int:
    """Write reading ``order[n]`` of ``raw (B,)`` into ``out[n]``, all (M,) float32 [m]; return how many are sound.

    Beyond ``most`` is no return (+inf); NaN, below ``least`` and below 0 is broken (NaN).
    """
    sound = 0
    for n in range(out.size):
        s = raw[order[n]]
        if not (s >= least and s >= 0.0):
            out[n] = np.nan
            continue
        out[n] = s if s <= most else np.inf
        sound += 1
    return sound


@jit
def reproject(scan: np.ndarray, rays: Rays, seat: Seat, grid: Rays, out: np.ndarray) -> None:
    """Write ``scan (B,)``, taken from ``seat`` along ``rays``, into ``out (M,)`` along ``grid`` round where we are.

    Both are float32 [m], +inf for no return, NaN for broken readings.
    """
    for n in range(out.size):
        out[n] = np.nan
    total = scan.size
    for k in range(total if rays.closed else total - 1):
        j = k + 1 if k + 1 < total else 0
        _join(scan, k, j, rays, seat, grid, out)
    for k in range(total):
        at_edge = not rays.closed and k in (0, total - 1)
        if not scan[k] >= 0.0 or at_edge:
            _wall(rays.start + seat.yaw + k * rays.increment, rays.reach, seat, grid, out)
        if scan[k] < np.inf:
            x, y = _end(scan, k, rays, seat)
            _dot(x, y, grid, out)


@jit_inner
def _end(scan: np.ndarray, k: int, rays: Rays, seat: Seat) -> tuple[float, float]:
    """Return where ray k ends [m]."""
    angle = rays.start + seat.yaw + k * rays.increment
    s = min(scan[k], rays.reach)
    return seat.x + s * math.cos(angle), seat.y + s * math.sin(angle)


@jit_inner
def _join(scan: np.ndarray, k: int, j: int, rays: Rays, seat: Seat, grid: Rays, out: np.ndarray) -> None:
    """Draw the border between the ends of rays k and j; where both saw nothing there is none."""
    if not (scan[k] >= 0.0 and scan[j] >= 0.0):
        return
    ax, ay = _end(scan, k, rays, seat)
    bx, by = _end(scan, j, rays, seat)
    _draw(ax, ay, bx, by, scan[k] < np.inf or scan[j] < np.inf, grid, out)


@jit_inner
def _wall(angle: float, reach: float, seat: Seat, grid: Rays, out: np.ndarray) -> None:
    """Draw the ray at ``angle`` from where it leaves the robot, then and now, to its end."""
    dx, dy = math.cos(angle), math.sin(angle)
    begin = max(_leaves(dx, dy, -seat.x, -seat.y, seat.core), 0.0)
    begin = max(begin, _leaves(dx, dy, seat.body_x - seat.x, seat.body_y - seat.y, seat.core))
    ax, ay = seat.x + begin * dx, seat.y + begin * dy
    _draw(ax, ay, seat.x + reach * dx, seat.y + reach * dy, True, grid, out)
    _dot(ax, ay, grid, out)


@jit_inner
def _leaves(dx: float, dy: float, cx: float, cy: float, radius: float) -> float:
    """Return where a ray from the origin along unit direction d leaves a disc [m], at most 0 when it misses it."""
    along, across = cx * dx + cy * dy, cx * dy - cy * dx
    under = radius * radius - across * across
    return along + math.sqrt(under) if under > 0.0 else 0.0


@jit_inner
def _dot(x: float, y: float, grid: Rays, out: np.ndarray) -> None:
    """Lower the ray nearest to (x, y)."""
    n = int(math.floor(_offset(math.atan2(y, x), grid) + 0.5))
    if grid.closed:
        n %= out.size
    if 0 <= n < out.size:
        _lower(out, n, math.sqrt(x * x + y * y))


@jit_inner
def _draw(ax: float, ay: float, bx: float, by: float, solid: bool, grid: Rays, out: np.ndarray) -> None:
    """Lower every ray that meets a-b; one that is not ``solid`` only shows that nothing was seen there."""
    angle_a, angle_b = math.atan2(ay, ax), math.atan2(by, bx)
    width = wrap_angle(angle_b - angle_a)
    if abs(width) > ON_BORDER:
        for n in range(out.size):
            _meet(ax, ay, bx, by, solid, n, grid, out)
        return
    low = _offset(angle_a if width >= 0.0 else angle_b, grid)
    high = low + abs(width) / grid.increment
    for k in range(int(math.ceil(low - 1e-6)), int(math.floor(high + 1e-6)) + 1):
        n = k % out.size if grid.closed else k
        if 0 <= n < out.size:
            _meet(ax, ay, bx, by, solid, n, grid, out)


@jit_inner
def _meet(ax: float, ay: float, bx: float, by: float, solid: bool, n: int, grid: Rays, out: np.ndarray) -> None:
    """Lower ray n where it meets a-b."""
    if not solid:
        _lower(out, n, np.inf)
        return
    angle = grid.start + n * grid.increment
    s = ray_segment(math.cos(angle), math.sin(angle), ax, ay, bx, by)
    if s == np.inf:  # by rounding: it passes an end
        s = min(math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)) if _faces(angle, ax, ay, bx, by) else np.nan
    if s <= grid.reach:
        _lower(out, n, s)
    elif s > grid.reach:
        _lower(out, n, np.inf)


@jit_inner
def _faces(angle: float, ax: float, ay: float, bx: float, by: float) -> bool:
    """Tell whether a-b is not behind a ray."""
    return (ax + bx) * math.cos(angle) + (ay + by) * math.sin(angle) > 0.0


@jit_inner
def _lower(out: np.ndarray, n: int, s: float) -> None:
    """Make ``s`` the range of ray n if it is shorter, or the first."""
    if not out[n] <= s:
        out[n] = s


@jit_inner
def _offset(angle: float, grid: Rays) -> float:
    """Return where a direction (within [-pi, pi]) lies, counted in rays."""
    return (angle - grid.start) / grid.increment
