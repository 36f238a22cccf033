"""A scan that was taken elsewhere, as seen from here: sensors off the body's centre, and scans that have aged.

What a scan knows is the area between the sensor and its readings. Its border is what a robot elsewhere sees: the
returns, joined ray by ray (between a near and a far one lies the edge of a shadow, and nobody knows what is in it), and
walls along broken rays. Directions in which no border is seen are broken (NaN), and so are those that cross the edge of
a limited field before one: nobody has looked there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import ray_segment, wrap_angle
from swarmscope.onboard.perception.mend import bridge
from swarmscope.onboard.perception.rays import Rays
from swarmscope.onboard.view import View

ON_BORDER = math.pi - 0.01
"""Seen under a larger angle than this [rad], a piece of border passes through where we are."""


NEAR_M, NEAR_STEPS = 0.002, 0.25
"""A scan taken this close by [m], turned by this share of an increment, is used as it is."""


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


class Grid(NamedTuple):
    """The rays that are wanted."""

    rays: Rays
    cos: np.ndarray
    """(M,) of their directions."""
    sin: np.ndarray


class End(NamedTuple):
    """A point of the border [m] and its bearing [rad], from where we are."""

    x: float
    y: float
    bearing: float


@jit_inline
def move_on(see: View) -> None:
    """Make ``see.scan`` of a moment before what is seen from where the robot is now.

    ``see.filtered`` and ``see.safe`` are scratch.
    """
    percept = see.percept
    far = math.hypot(percept["scan_x"], percept["scan_y"]) > NEAR_M
    if far or abs(percept["scan_yaw"]) > NEAR_STEPS * see.rig.sensor.increment:
        _see_from_here(see)


@jit
def _see_from_here(see: View) -> None:
    """Make ``see.scan`` what is seen from where the robot is now."""
    percept, sensor = see.percept, see.rig.sensor
    x, y, yaw = percept["scan_x"], percept["scan_y"], percept["scan_yaw"]
    for n in range(sensor.beams):  # out of a limited view nothing was measured
        measured = sensor.field == 0 or sensor.first <= n < sensor.first + sensor.field
        see.filtered[n] = see.scan[n] if measured else math.inf
    bridge(see.filtered, see.rig, see.safe)
    rays = Rays(sensor.angle_min, sensor.increment, sensor.wraps, sensor.range_max)
    seat = Seat(x, y, yaw, x, y, see.rig.body.radius_m + see.rig.guarding.clearance_m)
    reproject(see.filtered, rays, seat, Grid(rays, see.rig.cos, see.rig.sin), see.scan)


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
def reproject(scan: np.ndarray, rays: Rays, seat: Seat, grid: Grid, out: np.ndarray) -> None:
    """Write ``scan (B,)``, taken from ``seat`` along ``rays``, into ``out (M,)`` along ``grid`` round where we are.

    Both are float32 [m], +inf for no return, NaN for broken readings.
    """
    for n in range(out.size):
        out[n] = np.nan
    total = scan.size
    first = before = _end(scan[0], 0, rays, seat)
    for k in range(total):
        end = _end(scan[k], k, rays, seat)
        if k > 0:
            _join(scan[k - 1], scan[k], before, end, grid, out)
        if _beside_unknown(scan, k, rays.closed):
            _wall(rays.start + seat.yaw + k * rays.increment, rays.reach, seat, grid, out)
        if scan[k] < np.inf:
            _dot(end, grid, out)
        before = end
    if rays.closed:
        _join(scan[total - 1], scan[0], before, first, grid, out)
        return
    first_angle = rays.start + seat.yaw
    _leave_out(True, first_angle, seat, grid, out)
    _leave_out(False, first_angle + (total - 1) * rays.increment, seat, grid, out)


@jit_inner
def _beside_unknown(scan: np.ndarray, k: int, closed: bool) -> bool:
    """Tell whether ray k is the edge of a run of broken rays."""
    total = scan.size
    before, after = scan[k - 1 if k > 0 else total - 1], scan[k + 1 if k + 1 < total else 0]
    before_is_sound, after_is_sound = before >= 0.0 and (closed or k > 0), after >= 0.0 and (closed or k + 1 < total)
    return not scan[k] >= 0.0 and (before_is_sound or after_is_sound)


@jit_inner
def _end(s: float, k: int, rays: Rays, seat: Seat) -> End:
    """Return where ray k of range ``s`` ends."""
    angle = rays.start + seat.yaw + k * rays.increment
    s = min(s, rays.reach)
    x, y = seat.x + s * math.cos(angle), seat.y + s * math.sin(angle)
    return End(x, y, math.atan2(y, x))


@jit_inner
def _join(range_a: float, range_b: float, a: End, b: End, grid: Grid, out: np.ndarray) -> None:
    """Draw the border between the ends of two rays; where both saw nothing there is none."""
    if range_a >= 0.0 and range_b >= 0.0:
        _draw(a, b, range_a < np.inf or range_b < np.inf, grid, out)


@jit_inner
def _wall(angle: float, reach: float, seat: Seat, grid: Grid, out: np.ndarray) -> None:
    """Draw the ray at ``angle`` from where it leaves the robot, then and now, to its end."""
    a, b = _outside(angle, reach, seat)
    _draw(a, b, True, grid, out)
    _dot(a, grid, out)


@jit_inner
def _leave_out(right: bool, angle: float, seat: Seat, grid: Grid, out: np.ndarray) -> None:
    """Make directions unknown that cross the ray at ``angle``, an edge of the field, before they meet a border.

    With them goes whatever lies farther out on that side: what is left is a field without holes.
    """
    a, b = _outside(angle, grid.rays.reach, seat)
    low, high = _between(a, b, grid, out.size)
    inner = -1 if right else out.size
    for n in range(max(low, 0), min(high, out.size - 1) + 1):
        s = ray_segment(grid.cos[n], grid.sin[n], a.x, a.y, b.x, b.y)
        if s < np.inf and not out[n] <= s:
            inner = max(inner, n) if right else min(inner, n)
    for n in range(inner + 1 if right else out.size - inner):
        out[n if right else inner + n] = np.nan


@jit_inner
def _outside(angle: float, reach: float, seat: Seat) -> tuple[End, End]:
    """Return where the ray at ``angle`` leaves the robot, then and now, and where it ends."""
    dx, dy = math.cos(angle), math.sin(angle)
    begin = max(_leaves(dx, dy, -seat.x, -seat.y, seat.core), 0.0)
    begin = max(begin, _leaves(dx, dy, seat.body_x - seat.x, seat.body_y - seat.y, seat.core))
    ax, ay = seat.x + begin * dx, seat.y + begin * dy
    bx, by = seat.x + reach * dx, seat.y + reach * dy
    return End(ax, ay, math.atan2(ay, ax)), End(bx, by, math.atan2(by, bx))


@jit_inner
def _leaves(dx: float, dy: float, cx: float, cy: float, radius: float) -> float:
    """Return where a ray from the origin along unit direction d leaves a disc [m], at most 0 when it misses it."""
    along, across = cx * dx + cy * dy, cx * dy - cy * dx
    under = radius * radius - across * across
    return along + math.sqrt(under) if under > 0.0 else 0.0


@jit_inner
def _dot(a: End, grid: Grid, out: np.ndarray) -> None:
    """Lower the ray nearest to a point."""
    n = int(math.floor(_offset(a.bearing, grid) + 0.5))
    if grid.rays.closed:
        n %= out.size
    if 0 <= n < out.size:
        _lower(out, n, math.sqrt(a.x * a.x + a.y * a.y))


@jit_inner
def _draw(a: End, b: End, solid: bool, grid: Grid, out: np.ndarray) -> None:
    """Lower every ray that meets a-b; one that is not ``solid`` only shows that nothing was seen there."""
    low, high = _between(a, b, grid, out.size)
    for k in range(low, high + 1):
        n = k % out.size if grid.rays.closed else k
        if 0 <= n < out.size:
            _lower(out, n, _meet(a, b, n, grid) if solid else np.inf)


@jit_inner
def _between(a: End, b: End, grid: Grid, total: int) -> tuple[int, int]:
    """Return the first and the last ray between a and b, counted on round a circle; all where a-b passes through us."""
    width = wrap_angle(b.bearing - a.bearing)
    low, high = 0.0, total - 1.0
    if abs(width) <= ON_BORDER:
        low = _offset(a.bearing if width >= 0.0 else b.bearing, grid)
        high = low + abs(width) / grid.rays.increment
    return int(math.ceil(low - 1e-6)), int(math.floor(high + 1e-6))


@jit_inner
def _meet(a: End, b: End, n: int, grid: Grid) -> float:
    """Return the range of ray n to a-b, inf beyond the longest range, NaN when a-b is behind it."""
    dx, dy = grid.cos[n], grid.sin[n]
    s = ray_segment(dx, dy, a.x, a.y, b.x, b.y)
    if s == np.inf:  # by rounding: it passes an end
        s = _passed(a, b, dx, dy)
    return s if not s > grid.rays.reach - 1e-6 else np.inf


@jit_inner
def _passed(a: End, b: End, dx: float, dy: float) -> float:
    """Return the range to the end of a-b that a ray along unit direction d passes, NaN when a-b is behind it."""
    if (a.x + b.x) * dx + (a.y + b.y) * dy <= 0.0:
        return np.nan
    far_a, far_b = math.sqrt(a.x * a.x + a.y * a.y), math.sqrt(b.x * b.x + b.y * b.y)
    off_a, off_b = abs(a.x * dy - a.y * dx) * far_b, abs(b.x * dy - b.y * dx) * far_a
    if abs(off_a - off_b) < 1e-5 * far_a * far_b:
        return min(far_a, far_b)
    return far_a if off_a < off_b else far_b


@jit_inner
def _lower(out: np.ndarray, n: int, s: float) -> None:
    """Make ``s`` the range of ray n if it is shorter, or the first; NaN says nothing."""
    if s >= 0.0 and not out[n] <= s:
        out[n] = s


@jit_inner
def _offset(angle: float, grid: Grid) -> float:
    """Return where a direction (within [-pi, pi]) lies, counted in rays."""
    return (angle - grid.rays.start) / grid.rays.increment
