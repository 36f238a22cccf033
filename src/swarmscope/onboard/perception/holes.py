"""Holes of the scan: from which range on something narrow may stand there unseen.

Nearer, it would show beside the hole. Where the last scan has looked nothing stands: it has not come there since.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import then
from swarmscope.onboard.perception.beams import beam_at
from swarmscope.onboard.perception.frames import astray, narrow_shows_up_to
from swarmscope.onboard.perception.mend import shows_beside
from swarmscope.onboard.view import View

BROKEN, LOOKED_THROUGH = 1, 2
"""In ``View.safe`` while it says which beams are broken; the last scan has looked where the second kind does."""
FARTHER = 2.0
"""Places along a beam at which the last scan must have looked by are so many times as far as the one before."""
FINER = 6
"""How often the way from the last of them where it has to the first where it has not is halved."""
ROUNDING = 1e-5


@jit_inline
def has_holes(see: View) -> bool:
    """Tell whether ``see.hidden`` says that something may be hidden anywhere."""
    hides = False
    for n in range(see.rig.sensor.beams):
        hides |= see.hidden[n] < math.inf
    return hides


@jit
def find_hidden(see: View) -> None:
    """Write into ``see.hidden`` what broken beams, 1 in ``see.safe``, hide; take out what the last scan has looked at.

    Where it has looked along all of a broken beam, that is `LOOKED_THROUGH`.
    """
    radius, elsewhere = see.rig.body.radius_m, has_holes(see)
    for n in range(see.rig.sensor.beams):
        reach = see.hidden[n]
        if see.safe[n]:
            reach = min(reach, _nothing_up_to(see, n, LOOKED_THROUGH))
        see.hidden[n] = _looked_up_to(see, n, max(radius, reach)) if reach < math.inf else math.inf
        if see.safe[n] and see.hidden[n] == math.inf:
            see.safe[n] = LOOKED_THROUGH
    if elsewhere:
        return
    for n in range(see.rig.sensor.beams):  # what is left of a hole is narrower
        if see.safe[n] == BROKEN:
            see.hidden[n] = max(see.hidden[n], _nothing_up_to(see, n, BROKEN))


@jit_inner
def _nothing_up_to(see: View, n: int, most: int) -> float:
    """Return up to which range nothing stands in the hole that beam n is in [m], made of beams marked ``most`` or less.

    inf where nothing is narrow (`Guarding.thinnest_m` 0).
    """
    sensor, radius, width = see.rig.sensor, see.rig.body.radius_m, 1
    for step in (1, -1):
        k = beam_at(n + step, sensor)
        while k >= 0 and BROKEN <= see.safe[k] <= most and radius < shows_beside(width, see.rig) < math.inf:
            width += 1
            k = beam_at(k + step, sensor)
    return shows_beside(width, see.rig)


@jit_inner
def _looked_up_to(see: View, n: int, reach: float) -> float:
    """Return up to which range the last scan has looked along beam n, from ``reach`` on [m]; inf: as far as counts.

    That is up to where what is narrow would show between two beams, farther than which no robot relies on its eyes.
    """
    far, known, before = min(float(see.scan[n]), narrow_shows_up_to(see)), 0.0, math.nan
    if reach >= far:
        return math.inf
    at = _looked_at(see, n, reach, before)
    if math.isnan(at):
        return reach
    while not math.isnan(at):
        if reach >= far:
            return math.inf
        known, before = reach, at
        reach = min(FARTHER * reach, far)
        at = _looked_at(see, n, reach, before)
    for _ in range(FINER):
        place = 0.5 * (known + reach)
        at = _looked_at(see, n, place, before)
        if math.isnan(at):
            reach = place
        else:
            known, before = place, at
    return known


@jit_inner
def _looked_at(see: View, n: int, reach: float, before: float) -> float:
    """Return where among the last scan's beams the place ``reach`` [m] along beam n was, NaN unless they looked there.

    Both beams beside the place must have reached as far, since what is narrow may be met by one of them alone; where
    wheels err all that may be beside it, and those from ``before`` on if that is no NaN; and what is narrow must show.
    """
    rig, percept, sensor = see.rig, see.percept, see.rig.sensor
    here = (percept["odom_x"], percept["odom_y"], percept["odom_yaw"])
    x, y, _ = then(here, (reach * rig.cos[n], reach * rig.sin[n], 0.0))
    distance = math.sqrt(x * x + y * y)
    off = astray(math.sqrt(here[0] ** 2 + here[1] ** 2), abs(here[2]), distance, rig)
    at = (math.atan2(y, x) - sensor.angle_min) / sensor.increment
    since = 0.0 if math.isnan(before) else before - at
    if sensor.wraps and abs(since) > 0.5 * sensor.beams:
        since -= math.copysign(sensor.beams, since)
    aside = off / max(distance, 1e-9) / sensor.increment
    first = int(math.floor(at + min(0.0, since) - aside + ROUNDING))
    last = int(math.ceil(at + max(0.0, since) + aside - ROUNDING))
    far = (distance + off) * (1.0 - ROUNDING)
    looked = far <= narrow_shows_up_to(see) and _was_in_view(see, first, last)
    for m in range(first, last + 1):
        k = beam_at(m, sensor)
        looked &= k >= 0 and abs(see.kept[k]) >= far
    return at if looked else math.nan


@jit_inline
def _was_in_view(see: View, first: int, last: int) -> bool:
    """Tell whether the last scan has measured with all these beams; out of view it only remembers."""
    shared = see.shared
    return bool(see.rig.sensor.field == 0 or (shared["was_first"] <= first and last <= shared["was_last"]))
