"""A scan that was taken elsewhere, as seen from here: sensors off the body's centre, and scans that have aged.

What a scan knows is the area between the sensor and its readings. Its border is what a robot elsewhere sees: the
returns, joined ray by ray (between a near and a far one lies the edge of a shadow, and nobody knows what is in it), and
walls along broken rays. Directions in which no border is seen are broken (NaN), and so are those that cross the edge of
a limited field before one: nobody has looked there. Holes that were bridged are holes from elsewhere, too;
what they hide lies along the sensor's rays, and is seen from here under another angle.
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


UNSEEN = np.float32(-1.0)
"""Marks a direction in which nobody has looked from here on."""
UNKNOWN, OPEN, SOLID = range(3)
"""What is between the ends of two rays."""
NEARER = 0.98
"""What is nearer than this share of a hole's border hides the hole."""
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


class Found(NamedTuple):
    """What is seen from where we are, along the rays of a `Grid`."""

    scan: np.ndarray
    """(M,) float32 [m]: +inf for no return, NaN where nobody has looked or a hole was bridged."""
    hidden: np.ndarray
    """(M,) float32: from which range on a hole that was bridged may hide something narrow [m]; inf: nowhere."""


class End(NamedTuple):
    """A point of the border [m] and its bearing [rad], from where we are."""

    x: float
    y: float
    bearing: float


@jit_inline
def move_on(see: View) -> None:
    """Make ``see.scan`` of a moment before what is seen from where the robot is now, and ``see.hidden`` what it hides.

    ``see.filtered`` and ``see.padded`` are scratch.
    """
    percept = see.percept
    if not percept["scan_hides"]:
        see.hidden[:] = np.inf
    far = math.hypot(percept["scan_x"], percept["scan_y"]) > NEAR_M
    if far or abs(percept["scan_yaw"]) > NEAR_STEPS * see.rig.sensor.increment:
        _see_from_here(see)


@jit
def _see_from_here(see: View) -> None:
    """Make ``see.scan`` what is seen from where the robot is now; out of a limited view nothing was measured."""
    percept, rig, sensor = see.percept, see.rig, see.rig.sensor
    first, closed = sensor.first, sensor.wraps and sensor.field == 0
    count = sensor.field if sensor.field > 0 else sensor.beams
    taken, hides = see.filtered[:count], see.padded[:count]
    here = Found(see.scan[first : first + count], see.hidden[first : first + count])
    for n in range(count):
        taken[n] = here.scan[n]
    bridge(taken, closed, rig, hides)
    rays = Rays(sensor.angle_min + first * sensor.increment, sensor.increment, closed, sensor.range_max)
    x, y, yaw = percept["scan_x"], percept["scan_y"], percept["scan_yaw"]
    seat = Seat(x, y, yaw, x, y, rig.body.radius_m + rig.guarding.clearance_m)
    grid = Grid(rays, rig.cos[first : first + count], rig.sin[first : first + count])
    reproject(taken, hides, rays, seat, grid, here)


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
def reproject(scan: np.ndarray, hides: np.ndarray, rays: Rays, seat: Seat, grid: Grid, found: Found) -> None:
    """Fill ``found`` from ``scan (B,)``, taken from ``seat`` along ``rays``.

    It is float32 [m], +inf for no return, NaN for broken readings. A limited field ends with its outermost sound rays.
    Where ``hides (B,)`` is no NaN a hole was bridged: something narrow may stand there from that range on [m], and what
    looks there is broken again.
    """
    out = found.scan
    out[:], found.hidden[:] = np.nan, np.inf
    first, last = sound_part(scan, rays.closed)
    if last < first:
        return
    begin = before = _end(scan[first], first, rays, seat)
    for k in range(first, last + 1):
        end = _end(scan[k], k, rays, seat)
        if k > first:
            _join(border_of(scan, hides, k - 1, k), before, end, grid, out)
        if _beside_unknown(scan, k):
            _wall(rays.start + seat.yaw + k * rays.increment, rays.reach, seat, grid, out)
        if scan[k] < np.inf:
            _dot(end, grid, out)
        before = end
    if rays.closed:
        _join(border_of(scan, hides, last, first), before, begin, grid, out)
    else:
        _leave_out(rays.start + seat.yaw + first * rays.increment, seat, grid, out)
        _leave_out(rays.start + seat.yaw + last * rays.increment, seat, grid, out)
        _end_view(grid, out)
    for k in range(first, last + 1):
        if hides[k] >= 0.0:
            after, prior = k + 1 if k + 1 < scan.size else 0, k - 1 if k > 0 else scan.size - 1
            a, b = _end(scan[prior], prior, rays, seat), _end(scan[after], after, rays, seat)
            _break(a, _end(scan[k], k, rays, seat), b, grid, out)
        stop = end_of_hole(hides, k, last)
        if stop > k:
            right, left = _side(hides[k], scan[k], k - 1, rays, seat), _side(hides[k], scan[k], stop, rays, seat)
            _hide(right, left, grid, found.hidden)


@jit_inline
def sound_part(scan: np.ndarray, closed: bool) -> tuple[int, int]:
    """Return the first and the last ray of a field, broken ones at its edges left out; all of a circle."""
    first, last = 0, scan.size - 1
    if closed:
        return first, last
    while first <= last and not scan[first] >= 0.0:
        first += 1
    while last >= first and not scan[last] >= 0.0:
        last -= 1
    return first, last


@jit_inline
def end_of_hole(hides: np.ndarray, k: int, last: int) -> int:
    """Return the number after the last ray, ``last`` at most, of the hole that begins at ray k; k where none begins."""
    if not hides[k] >= 0.0 or (k > 0 and hides[k - 1] >= 0.0):
        return k
    stop = k + 1
    while stop <= last and hides[stop] >= 0.0:
        stop += 1
    return stop


@jit_inner
def _side(near: float, far: float, k: int, rays: Rays, seat: Seat) -> tuple[End, End]:
    """Return where ray k, beside a hole that hides what is between ``near`` and ``far`` [m], begins to and ends."""
    return _outside(rays.start + seat.yaw + k * rays.increment, near, min(far, rays.reach), seat)


@jit_inner
def _hide(right: tuple[End, End], left: tuple[End, End], grid: Grid, hidden: np.ndarray) -> None:
    """Lower ``hidden`` to the border of what lies between the two sides of a hole."""
    for a, b in ((right[0], left[0]), right, left):
        _draw(a, b, True, grid, hidden)
        _dot(a, grid, hidden)
        _dot(b, grid, hidden)


@jit_inner
def _beside_unknown(scan: np.ndarray, k: int) -> bool:
    """Tell whether ray k is the edge of a run of broken rays."""
    before, after = scan[k - 1 if k > 0 else scan.size - 1], scan[k + 1 if k + 1 < scan.size else 0]
    return not scan[k] >= 0.0 and (before >= 0.0 or after >= 0.0)


@jit_inner
def _end(s: float, k: int, rays: Rays, seat: Seat) -> End:
    """Return where ray k of range ``s`` ends."""
    angle = rays.start + seat.yaw + k * rays.increment
    s = min(s, rays.reach)
    x, y = seat.x + s * math.cos(angle), seat.y + s * math.sin(angle)
    return End(x, y, math.atan2(y, x))


@jit_inline
def border_of(scan: np.ndarray, hides: np.ndarray, i: int, k: int) -> int:
    """Return whether there is a border between the ends of two rays: `SOLID`, `OPEN`, or `UNKNOWN`.

    There is none where both saw nothing; nor where one did and the other was bridged: no thing begins there.
    """
    if not (scan[i] >= 0.0 and scan[k] >= 0.0):
        return UNKNOWN
    if scan[i] < np.inf and scan[k] < np.inf:
        return SOLID
    if not (scan[i] < np.inf or scan[k] < np.inf):
        return OPEN
    return OPEN if hides[i] >= 0.0 or hides[k] >= 0.0 else SOLID


@jit_inner
def _join(border: int, a: End, b: End, grid: Grid, out: np.ndarray) -> None:
    """Draw the border between the ends of two rays."""
    if border != UNKNOWN:
        _draw(a, b, border == SOLID, grid, out)


@jit_inner
def _wall(angle: float, reach: float, seat: Seat, grid: Grid, out: np.ndarray) -> None:
    """Draw the ray at ``angle`` from where it leaves the robot, then and now, to its end."""
    a, b = _outside(angle, 0.0, reach, seat)
    _draw(a, b, True, grid, out)
    _dot(a, grid, out)


@jit_inner
def _leave_out(angle: float, seat: Seat, grid: Grid, out: np.ndarray) -> None:
    """Mark every direction that crosses the ray at ``angle``, an edge of the field, before it meets a border."""
    a, b = _outside(angle, 0.0, grid.rays.reach, seat)
    low, high = _between(a, b, grid, out.size)
    turn = int(math.floor(2.0 * math.pi / grid.rays.increment + 0.5))
    for k in range(low, high + 1):
        n = k if k < out.size else k - turn  # it may go on at the other end of a wide field
        n = n if n >= 0 else n + turn
        if 0 <= n < out.size:
            s = ray_segment(grid.cos[n], grid.sin[n], a.x, a.y, b.x, b.y)
            if s < np.inf and not out[n] <= s:
                out[n] = UNSEEN


@jit_inner
def _end_view(grid: Grid, out: np.ndarray) -> None:
    """Make unknown, on either side of straight ahead, all from the first direction on that was left out."""
    ahead = min(out.size - 1, max(0, int(math.floor(_offset(0.0, grid) + 0.5))))
    blind_ahead = out[ahead] == UNSEEN
    for step in (1, -1):
        unknown, n = blind_ahead, ahead
        while 0 <= n < out.size:
            unknown |= out[n] == UNSEEN
            if unknown:
                out[n] = np.nan
            n += step


@jit_inner
def _break(a: End, middle: End, b: End, grid: Grid, out: np.ndarray) -> None:
    """Make the directions nearer to ``middle`` than to a and b, about, broken where they show nothing nearer."""
    width, nearest = wrap_angle(b.bearing - a.bearing), math.inf
    start = _offset(a.bearing if width >= 0.0 else b.bearing, grid)
    low = int(math.ceil(start + 0.5 - 1e-6))
    high = int(math.floor(start + abs(width) / grid.rays.increment - 0.5 + 1e-6))
    for end in (a, middle, b):
        nearest = min(nearest, math.sqrt(end.x * end.x + end.y * end.y))
    if low > high:  # it lies between two directions
        low = high = int(math.floor(_offset(middle.bearing, grid) + 0.5))
    for k in range(low, high + 1):
        n = k % out.size if grid.rays.closed else k
        if 0 <= n < out.size and out[n] >= NEARER * nearest:
            out[n] = np.nan


@jit_inner
def _outside(angle: float, near: float, far: float, seat: Seat) -> tuple[End, End]:
    """Return where the ray at ``angle`` is ``near`` [m] long, or leaves the robot, then and now, and its end."""
    dx, dy = math.cos(angle), math.sin(angle)
    begin = max(_leaves(dx, dy, -seat.x, -seat.y, seat.core), near)
    begin = max(begin, _leaves(dx, dy, seat.body_x - seat.x, seat.body_y - seat.y, seat.core))
    ax, ay = seat.x + begin * dx, seat.y + begin * dy
    bx, by = seat.x + far * dx, seat.y + far * dy
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
