"""Broken beams: up to where nothing can stand in the hole that they make, for it would show beside it.

A hole through which the last scan has looked is none: what stands has not come there since.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.perception.beams import lies_between, nearest_beam
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.view import BROKEN, View

LOOKED_THROUGH = 2
"""In ``View.safe`` while it says which beams are broken: the last scan has looked there."""
PLACES = 4
"""Places along a broken beam at which the last scan must have looked by, each twice as far as the one before."""


@jit
def find_looked_through(see: View) -> None:
    """Mark the broken beams, 1 in ``see.safe``, through which the last scan has looked."""
    total, wraps = see.rig.sensor.beams, see.rig.sensor.wraps
    n = 0
    while n < total:
        if not see.safe[n]:
            n += 1
            continue
        stop = n
        while stop < total and see.safe[stop]:
            stop += 1
        width = stop - n
        if wraps and n == 0:
            width += _run_at_the_end(see, stop)
        nearest = shows_beside(width, see.rig)
        for k in range(n, stop):
            if _looked_through(see, k, nearest):
                see.safe[k] = LOOKED_THROUGH
        n = stop


@jit
def nothing_up_to(see: View, n: int) -> float:
    """Return up to which range nothing can stand in the hole that beam n is in [m]."""
    total, wraps = see.rig.sensor.beams, see.rig.sensor.wraps
    width = 1
    for step in (1, -1):
        k = n + step
        while (wraps or 0 <= k < total) and width < total and see.unseen[k % total] & BROKEN:
            width += 1
            k += step
    return shows_beside(width, see.rig)


@jit
def shows_beside(width: int, rig: Rig) -> float:
    """Return up to which range the narrowest thing shows beside ``width`` broken beams [m]."""
    half = 0.5 * (width + 1) * rig.sensor.increment
    return 0.5 * rig.guarding.thinnest_m / math.sin(half) if half < 0.5 * math.pi else 0.0


@jit_inner
def _run_at_the_end(see: View, stop: int) -> int:
    """Return how many broken beams there are before the first one, on the other side of where the circle closes."""
    total, count = see.rig.sensor.beams, 0
    while count < total - stop and see.safe[total - 1 - count]:
        count += 1
    return count


@jit_inner
def _looked_through(see: View, n: int, nearest: float) -> bool:
    """Tell whether the last scan reached beyond places along beam n, from ``nearest`` [m] on."""
    rig, percept = see.rig, see.percept
    c, s = math.cos(percept["odom_yaw"]), math.sin(percept["odom_yaw"])
    reach = max(nearest, rig.body.radius_m)
    for _ in range(PLACES):
        x, y = reach * rig.cos[n], reach * rig.sin[n]
        x, y = percept["odom_x"] + c * x - s * y, percept["odom_y"] + s * x + c * y
        if rig.sensor.field > 0 and not lies_between(
            x, y, see.shared["view_first"], see.shared["view_last"], rig.sensor
        ):
            return False
        if not see.kept[nearest_beam(x, y, 0.0, rig.sensor)] > math.sqrt(x * x + y * y):
            return False
        reach *= 2.0
        if reach >= see.scan[n]:
            break
    return True
