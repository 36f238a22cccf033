"""Where a command leads until the next tick and while braking after it, and what it comes close to."""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inline
from swarmscope.geometry import point_segment_distance
from swarmscope.onboard.control.unicycle import ramp
from swarmscope.onboard.view import View

STEPS = 4
"""Straight pieces that stand for the arc driven until the next tick."""


class Way(NamedTuple):
    """Where a command leads, body frame [m]: four points until the next tick, the stop after it, and the braking."""

    x1: float
    y1: float
    x2: float
    y2: float
    x3: float
    y3: float
    x4: float
    y4: float
    x5: float
    y5: float
    brake: float
    turns: bool
    """Whether it is not straight."""
    reach: float
    """Nothing of it is farther from where the robot is now."""
    bulge: float
    """How far the arc that is driven bulges out of the straight pieces."""


@jit_inline
def bulge_of(speed: float, v: float, w: float, step: float) -> float:
    """Return how far an arc of ``step`` [s] between ``speed`` and ``v`` bulges out of the straight piece for it [m]."""
    return 0.125 * max(v, speed) * abs(w) * step * step


@jit_inline
def way_of(speed: float, v: float, w: float, late: float, see: View) -> Way:
    """Return the way of commanding (v, w) at ``speed``; for ``late`` [s] the robot goes on straight before that."""
    a_max = see.rig.body.a_max_mps2
    step = see.percept["dt_s"] / STEPS
    bulge = bulge_of(speed, v, w, step)
    x0 = speed * late
    driven = abs(x0)
    speed, way = ramp(speed, v, a_max, step)
    driven += abs(way)
    x1, y1 = x0 + way * math.cos(0.5 * w * step), way * math.sin(0.5 * w * step)
    speed, way = ramp(speed, v, a_max, step)
    driven += abs(way)
    x2, y2 = x1 + way * math.cos(1.5 * w * step), y1 + way * math.sin(1.5 * w * step)
    speed, way = ramp(speed, v, a_max, step)
    driven += abs(way)
    x3, y3 = x2 + way * math.cos(2.5 * w * step), y2 + way * math.sin(2.5 * w * step)
    speed, way = ramp(speed, v, a_max, step)
    driven += abs(way)
    x4, y4 = x3 + way * math.cos(3.5 * w * step), y3 + way * math.sin(3.5 * w * step)
    brake = speed * speed / (2.0 * a_max)
    x5, y5 = x4 + brake * math.cos(4.0 * w * step), y4 + brake * math.sin(4.0 * w * step)
    return Way(x1, y1, x2, y2, x3, y3, x4, y4, x5, y5, brake, w != 0.0, driven + brake, bulge)


@jit_inline
def corner_of(way: Way, piece: int) -> tuple[float, float]:
    """Return where piece 0 to 4 of a way ends."""
    if piece == 0:
        return way.x1, way.y1
    if piece == 1:
        return way.x2, way.y2
    if piece == 2:
        return way.x3, way.y3
    if piece == 3:
        return way.x4, way.y4
    return way.x5, way.y5


@jit_inline
def closer(px: float, py: float, way: Way, need: float) -> bool:
    """Tell whether the way comes closer than ``need`` [m] to the return at (px, py)."""
    return bool(
        point_segment_distance(px, py, 0.0, 0.0, way.x1, way.y1) < need
        or point_segment_distance(px, py, way.x1, way.y1, way.x2, way.y2) < need
        or point_segment_distance(px, py, way.x2, way.y2, way.x3, way.y3) < need
        or point_segment_distance(px, py, way.x3, way.y3, way.x4, way.y4) < need
        or point_segment_distance(px, py, way.x4, way.y4, way.x5, way.y5) < need
    )


@jit
def shadowed(px: float, py: float, ux: float, uy: float, way: Way, need: float) -> bool:
    """Tell whether a way that turns comes closer than ``need`` [m] to what the return at (px, py) hides.

    That is the ray from there on along unit direction u. All of a straight way lies this side of its returns.
    """
    off4 = _off_ray(way.x4 - px, way.y4 - py, ux, uy)
    off5 = _off_ray(way.x5 - px, way.y5 - py, ux, uy)
    if abs(off4) < need or abs(off5) < need:
        return True
    return bool(off4 * off5 < 0.0 and off4 * off5 > -math.inf)


@jit_inline
def _off_ray(x: float, y: float, ux: float, uy: float) -> float:
    """Return how far (x, y) lies beside the ray from the origin along u, left positive; inf behind its start."""
    return ux * y - uy * x if ux * x + uy * y > 0.0 else math.inf
