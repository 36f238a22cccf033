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
def keep_lost(see: View) -> None:
    """Write what was lost since the last scan back into ``see.scan``; keep that scan in ``see.kept``.

    ``see.filtered`` and ``see.narrow`` are scratch.
    """
    rig, percept = see.rig, see.percept
    seen = 0
    for n in range(rig.sensor.beams):
        seen += see.scan[n] < rig.sensor.range_max
    lost = 0
    if seen < rig.sensor.beams and percept["dt_s"] > 0.0:
        most = min(float(MOST_TICKS), rig.guarding.lost_s / percept["dt_s"])
        lost = _find_lost(see, int(most + 0.5))
    _note_losses(percept, see.shared, seen, lost)
    for n in range(rig.sensor.beams):
        see.unseen[n] = 0
        if lost > 0 and see.filtered[n] < math.inf:
            see.scan[n], see.unseen[n] = see.filtered[n], see.narrow[n]
        see.kept[n] = see.scan[n]


@jit_inner
def _find_lost(see: View, most: int) -> int:
    """Write ranges of lost returns into ``see.filtered``, for how many ticks into ``see.narrow``; return how many."""
    rig = see.rig
    total, least, far = rig.sensor.beams, least_range(rig), WITHIN * rig.sensor.range_max
    turned = int(math.floor(see.percept["odom_yaw"] / rig.sensor.increment + 0.5))
    if rig.sensor.wraps:
        turned %= total
    lost = 0
    for n in range(total):
        if not least <= see.kept[n] < far or see.unseen[n] >= most:
            continue
        m = n - turned
        if rig.sensor.wraps and m < 0:
            m += total
        if 0 <= m < total and see.scan[m] < rig.sensor.range_max:
            continue
        if lost == 0:
            for k in range(total):
                see.filtered[k] = math.inf
        lost += _keep(see, n)
    return lost


@jit_inner
def _keep(see: View, n: int) -> int:
    """Keep the return of beam n of the last scan if it is lost; return 1 then, else 0."""
    rig, percept, total = see.rig, see.percept, see.rig.sensor.beams
    c, s = math.cos(percept["odom_yaw"]), math.sin(percept["odom_yaw"])
    x, y = see.kept[n] * rig.cos[n] - percept["odom_x"], see.kept[n] * rig.sin[n] - percept["odom_y"]
    px, py = c * x + s * y, c * y - s * x
    m = int(math.floor((math.atan2(py, px) - rig.sensor.angle_min) / rig.sensor.increment + 0.5))
    for beside in range(m - 1, m + 2):
        k = beside % total if rig.sensor.wraps else beside
        if not 0 <= k < total or see.scan[k] < rig.sensor.range_max:
            return 0
    if rig.sensor.field > 0 and not in_view(px, py, see):
        return 0
    distance = math.sqrt(px * px + py * py)
    if not least_range(rig) <= distance or near_track(percept, see.shared, px, py, rig):
        return 0
    m %= total
    if distance < see.filtered[m]:
        see.filtered[m], see.narrow[m] = distance, see.unseen[n] + 1
    return 1


@jit_inner
def _note_losses(percept: Row, shared: Row, seen: int, lost: int) -> None:
    """Keep up how many returns are lost, and since when nothing is seen at all where something was."""
    if seen > 0:
        shared["blind_s"] = 0.0
    elif lost > 0 or shared["blind_s"] > 0.0:
        shared["blind_s"] += percept["dt_s"]
    if seen + lost > 0:
        shared["losses"] = MEMORY * shared["losses"] + (1.0 - MEMORY) * lost / (seen + lost)
