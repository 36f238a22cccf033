"""Broken beams: up to where nothing can stand in the hole that they make, for it would show beside it.

A hole through which the last scan has looked is none: what stands has not come there since.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import then
from swarmscope.onboard.perception.beams import beam_at, nearest_beam
from swarmscope.onboard.perception.frames import astray, in_view
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.view import BROKEN, View

LOOKED_THROUGH = 2
"""In ``View.safe`` while it says which beams are broken: the last scan has looked there."""
PLACES = 4
"""Places along a broken beam at which the last scan must have looked by, each twice as far as the one before."""


@jit
def find_looked_through(see: View) -> None:
    """Mark the broken beams, 1 in ``see.safe``, through which the last scan has looked; `BROKEN` are all of them."""
    for n in range(see.rig.sensor.beams):
        see.unseen[n] = BROKEN if see.safe[n] else 0
    for n in range(see.rig.sensor.beams):
        if see.safe[n] and _looked_through(see, n):
            see.safe[n] = LOOKED_THROUGH


@jit
def nothing_up_to(see: View, n: int) -> float:
    """Return up to which range, the body's surface at least, nothing can stand in the hole that beam n is in [m].

    inf where nothing is narrow (`Guarding.thinnest_m` 0).
    """
    if not see.rig.guarding.thinnest_m > 0.0:
        return math.inf
    sensor, radius, width = see.rig.sensor, see.rig.body.radius_m, 1
    for step in (1, -1):
        k = beam_at(n + step, sensor)
        while k >= 0 and see.unseen[k] & BROKEN and shows_beside(width, see.rig) > radius:
            width += 1
            k = beam_at(k + step, sensor)
    return max(radius, shows_beside(width, see.rig))


@jit
def shows_beside(width: int, rig: Rig) -> float:
    """Return up to which range the narrowest thing shows beside ``width`` broken beams [m]."""
    half = 0.5 * (width + 1) * rig.sensor.increment
    return 0.5 * rig.guarding.thinnest_m / math.sin(half) if half < 0.5 * math.pi else 0.0


@jit_inner
def _looked_through(see: View, n: int) -> bool:
    """Tell whether the last scan reached beyond the places along beam n from which on something may stand there."""
    rig, percept, reach = see.rig, see.percept, nothing_up_to(see, n)
    if reach == math.inf:
        return True
    here = (percept["odom_x"], percept["odom_y"], percept["odom_yaw"])
    for _ in range(PLACES):
        x, y, _yaw = then(here, (reach * rig.cos[n], reach * rig.sin[n], 0.0))
        if rig.sensor.field > 0 and not in_view(x, y, see):
            return False
        if not _reached_beyond(see, x, y):
            return False
        reach *= 2.0
        if reach >= see.scan[n]:
            break
    return True


@jit_inner
def _reached_beyond(see: View, x: float, y: float) -> bool:
    """Tell whether every beam of the last scan that may have looked at (x, y) [m] from there reached beyond it."""
    rig, way = see.rig, math.sqrt(see.percept["odom_x"] ** 2 + see.percept["odom_y"] ** 2)
    distance, middle = math.sqrt(x * x + y * y), nearest_beam(x, y, 0.0, rig.sensor)
    off = astray(way, abs(see.percept["odom_yaw"]), distance, rig)
    aside = int(math.ceil(off / max(distance, 1e-9) / rig.sensor.increment))
    for m in range(middle - aside, middle + aside + 1):
        k = beam_at(m, rig.sensor)
        if k >= 0 and not abs(see.kept[k]) > distance + off:
            return False
    return True
