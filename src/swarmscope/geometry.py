"""Angles and plane geometry: scalars in, scalars out, radians, metres, REP-103 (x forward, y left, CCW)."""

from __future__ import annotations

import math
from typing import TypeAlias

from swarmscope._jit import jit_inline

TWO_PI = 2.0 * math.pi
ROUGH = 1e-6
"""`rough_angle` is nearer than this to the angle [rad]."""
Pose: TypeAlias = tuple[float, float, float]
"""x [m], y [m], yaw [rad]."""


@jit_inline
def wrap_angle(angle: float) -> float:
    """Return ``angle`` [rad] wrapped to (-pi, pi]."""
    wrapped = angle - TWO_PI * math.floor((angle + math.pi) / TWO_PI)
    if wrapped <= -math.pi:
        wrapped += TWO_PI
    return wrapped


@jit_inline
def rough_angle(x: float, y: float) -> float:
    """Return atan2(y, x) [rad] to within `ROUGH`, several times faster, where y is not 0."""
    wide, high = abs(x), abs(y)
    ratio = min(wide, high) / max(wide, high, 1e-300)
    s = ratio * ratio
    series = ((0.0068117791795 * s - 0.0336041791392) * s + 0.0796236263468) * s - 0.132333397004
    angle = (((series * s + 0.198078149831) * s - 0.333173679991) * s + 0.999996111538) * ratio
    if high > wide:
        angle = 0.5 * math.pi - angle
    if x < 0.0:
        angle = math.pi - angle
    return -angle if y < 0.0 else angle


@jit_inline
def positive_angle(angle: float) -> float:
    """Return ``angle`` [rad] wrapped to [0, 2 pi); fast when it is within a turn of that."""
    if angle < 0.0:
        angle += TWO_PI
    elif angle >= TWO_PI:
        angle -= TWO_PI
    if 0.0 <= angle < TWO_PI:
        return angle
    angle -= TWO_PI * math.floor(angle / TWO_PI)
    return angle if angle < TWO_PI else 0.0


@jit_inline
def angle_from(start: float, angle: float) -> float:
    """Return how far one turns counter-clockwise from ``start`` to ``angle`` [rad], in [0, 2 pi)."""
    return positive_angle(angle - start)


@jit_inline
def then(a: Pose, b: Pose) -> Pose:
    """Return pose ``b``, given in the frame of ``a``, in the frame that ``a`` is given in."""
    c, s = math.cos(a[2]), math.sin(a[2])
    return a[0] + c * b[0] - s * b[1], a[1] + s * b[0] + c * b[1], wrap_angle(a[2] + b[2])


@jit_inline
def seen_from(here: Pose, there: Pose) -> Pose:
    """Return pose ``there`` in the frame of ``here``."""
    dx, dy = there[0] - here[0], there[1] - here[1]
    c, s = math.cos(here[2]), math.sin(here[2])
    return c * dx + s * dy, c * dy - s * dx, wrap_angle(there[2] - here[2])


@jit_inline
def point_segment_distance(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the distance [m] from point p to segment a-b."""
    ux, uy = bx - ax, by - ay
    length2 = ux * ux + uy * uy
    t = 0.0
    if length2 > 0.0:
        t = min(1.0, max(0.0, ((px - ax) * ux + (py - ay) * uy) / length2))
    dx, dy = px - (ax + t * ux), py - (ay + t * uy)
    return math.sqrt(dx * dx + dy * dy)


@jit_inline
def ray_circle(dx: float, dy: float, cx: float, cy: float, radius: float) -> float:
    """Return the range [m] along unit direction d at which a ray from the origin meets a circle, else inf.

    From inside the circle the exit point is returned.
    """
    along = cx * dx + cy * dy
    across = cx * dy - cy * dx
    under = radius * radius - across * across
    if under < 0.0:
        return math.inf
    half = math.sqrt(under)
    if along - half >= 0.0:
        return along - half
    return along + half if along + half >= 0.0 else math.inf


@jit_inline
def ray_segment(dx: float, dy: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Return the range [m] along unit direction d at which a ray from the origin meets segment a-b, or inf."""
    ux, uy = bx - ax, by - ay
    denominator = dx * uy - dy * ux
    if denominator == 0.0:
        return math.inf
    t = (ax * uy - ay * ux) / denominator
    s = (ax * dy - ay * dx) / denominator
    return t if t >= 0.0 and 0.0 <= s <= 1.0 else math.inf


@jit_inline
def segments_distance(
    ax: float, ay: float, bx: float, by: float, cx: float, cy: float, dx: float, dy: float
) -> float:
    """Return the smallest distance [m] between segments a-b and c-d (0 where they cross)."""
    o1 = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    o2 = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    o3 = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    o4 = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    if o1 * o2 < 0.0 and o3 * o4 < 0.0:
        return 0.0
    ab_c = point_segment_distance(cx, cy, ax, ay, bx, by)
    ab_d = point_segment_distance(dx, dy, ax, ay, bx, by)
    cd_a = point_segment_distance(ax, ay, cx, cy, dx, dy)
    cd_b = point_segment_distance(bx, by, cx, cy, dx, dy)
    return min(ab_c, ab_d, cd_a, cd_b)
