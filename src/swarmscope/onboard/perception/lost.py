"""Returns that were there a moment ago: a beam that says nothing has not shown that their place is free.

What stood within range and gives no return now, though nothing nearer hides it and no beam has passed its place, is
kept where it was, moved by odometry, for ``Guarding.lost_s``. A LiDAR that loses too much is noticed.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.frames import in_view
from swarmscope.onboard.perception.mend import least_range
from swarmscope.onboard.sharing.tracks import near_track
from swarmscope.onboard.view import View

WITHIN = 0.9
"""Returns beyond this share of the range are not kept: they leave it by themselves."""
MEMORY = 0.9
"""What stays of the share of lost returns from tick to tick."""
MOST_TICKS = 255


@jit
def keep_lost(see: View, broken: int) -> None:
    """Write what was lost since the last scan back into ``see.scan``; keep that scan in ``see.kept``.

    So many beams are ``broken``, 1 in ``see.safe``: where they look, what was seen there stays, however they are
    bridged. ``see.filtered`` and ``see.narrow`` are scratch.
    """
    rig, percept = see.rig, see.percept
    seen = 0
    for n in range(rig.sensor.beams):
        seen += see.scan[n] < rig.sensor.range_max
    lost, found = 0, False
    if (broken > 0 or seen < rig.sensor.beams) and percept["dt_s"] > 0.0:
        most = min(float(MOST_TICKS), rig.guarding.lost_s / percept["dt_s"])
        lost, found = _find_lost(see, int(most + 0.5))
    _note_losses(percept, see.shared, seen, lost)
    for n in range(rig.sensor.beams):
        see.unseen[n] = 0
        see.kept[n] = 0.0 if see.safe[n] else see.scan[n]
        if found and see.filtered[n] < see.scan[n]:
            see.scan[n] = see.kept[n] = see.filtered[n]
            see.unseen[n] = see.narrow[n]


@jit_inner
def _find_lost(see: View, most: int) -> tuple[int, bool]:
    """Write ranges of lost returns into ``see.filtered``, for how many ticks into ``see.narrow``.

    Return how many were lost where the scan says nothing, and whether any were, where it is broken included.
    """
    rig = see.rig
    total, least, far = rig.sensor.beams, least_range(rig), WITHIN * rig.sensor.range_max
    turned = int(math.floor(see.percept["odom_yaw"] / rig.sensor.increment + 0.5))
    lost, found = 0, False
    for n in range(total):
        if not least <= see.kept[n] < far or see.unseen[n] >= most:
            continue
        m = n - turned
        if rig.sensor.wraps:
            m %= total
        if 0 <= m < total and see.scan[m] < rig.sensor.range_max and not see.safe[m]:
            continue
        x, y, m = _now_at(see, n)
        if not _is_lost(see, x, y, m):
            continue
        if not found:
            for k in range(total):
                see.filtered[k] = math.inf
        found = True
        m %= total
        lost += not see.safe[m]
        distance = math.sqrt(x * x + y * y)
        if distance < see.filtered[m]:
            see.filtered[m], see.narrow[m] = distance, see.unseen[n] + 1
    return lost, found


@jit_inner
def _now_at(see: View, n: int) -> tuple[float, float, int]:
    """Return where the return of beam n of the last scan is now, body frame [m], and the beam that looks there."""
    rig, percept = see.rig, see.percept
    c, s = math.cos(percept["odom_yaw"]), math.sin(percept["odom_yaw"])
    x, y = see.kept[n] * rig.cos[n] - percept["odom_x"], see.kept[n] * rig.sin[n] - percept["odom_y"]
    px, py = c * x + s * y, c * y - s * x
    return px, py, int(math.floor((math.atan2(py, px) - rig.sensor.angle_min) / rig.sensor.increment + 0.5))


@jit_inner
def _is_lost(see: View, x: float, y: float, m: int) -> bool:
    """Tell whether a return at (x, y), at which beam m looks, is lost: beam m is broken, or it and both beside it say
    that nothing is there."""
    rig, total = see.rig, see.rig.sensor.beams
    if not rig.sensor.wraps and not 0 <= m < total:
        return False
    if not see.safe[m % total]:
        for beside in range(m - 1, m + 2):
            k = beside % total if rig.sensor.wraps else beside
            if not 0 <= k < total or (see.scan[k] < rig.sensor.range_max and not see.safe[k]):
                return False
    if rig.sensor.field > 0 and not in_view(x, y, see):
        return False
    far_enough = x * x + y * y >= least_range(rig) ** 2
    return bool(far_enough and not near_track(see.percept, see.shared, x, y, rig))


@jit_inner
def _note_losses(percept: Row, shared: Row, seen: int, lost: int) -> None:
    """Keep up how many returns are lost, and since when nothing is seen at all where something was."""
    if seen > 0:
        shared["blind_s"] = 0.0
    elif lost > 0 or shared["blind_s"] > 0.0:
        shared["blind_s"] += percept["dt_s"]
    if seen + lost > 0:
        shared["losses"] = MEMORY * shared["losses"] + (1.0 - MEMORY) * lost / (seen + lost)
