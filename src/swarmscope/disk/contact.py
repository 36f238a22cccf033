"""Who touches whom, also between two steps: all robots move on straight lines, all at the same time."""

from __future__ import annotations

import math

from swarmscope._jit import jit_inline


@jit_inline
def nearest_on_the_way(px: float, py: float, qx: float, qy: float) -> float:
    """Return how near to the origin a point comes that moves straight from p to q.

    For two robots p and q are their relative positions before and after the step; for a robot and an obstacle
    the robot's positions seen from its centre. Unit-disk report, section 1: a collision is a distance of at most
    the sum of the radii; here it counts between the steps, too.
    """
    ux, uy = qx - px, qy - py
    length2 = ux * ux + uy * uy
    t = 0.0
    if length2 > 0.0:
        t = min(1.0, max(0.0, -(px * ux + py * uy) / length2))
    dx, dy = px + t * ux, py + t * uy
    return math.sqrt(dx * dx + dy * dy)
