"""Returns that were there a moment ago: a beam that says nothing has not shown that their place is free.

What stood within range is kept where it was, moved by odometry, for ``Guarding.lost_s``, where one of the two beams on
either side of the place now says nothing or is broken, and the other one does not show it. A LiDAR that loses too much
is noticed.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.beams import beam_at
from swarmscope.onboard.perception.frames import in_view
from swarmscope.onboard.perception.holes import LOOKED_THROUGH, find_looked_through
from swarmscope.onboard.perception.mend import least_range
from swarmscope.onboard.sharing.tracks import was_near_track
from swarmscope.onboard.view import BROKEN, GUARD_ALONE, View

WITHIN = 0.9
"""Returns beyond this share of the range are not kept: they leave it by themselves."""
SAME_M = 0.1
"""A return that is farther than another by no more than this may be of the same thing."""
THROUGH = 0.1
"""A beam that is off a place by less than this part of the way to the next has looked there."""
MEMORY = 0.9
"""What stays of the share of lost returns from tick to tick."""
SLIPS = 2
MOST_TICKS = BROKEN - 1


@jit
def keep_lost(see: View, broken: int) -> None:
    """Write what was lost since the last scan back into ``see.scan``; keep that scan in ``see.kept``.

    So many beams are ``broken``, 1 in ``see.safe``: where they look, what was seen there stays, however they are
    bridged. ``see.edges``, ``see.filtered`` and ``see.narrow`` are scratch.
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
    if broken > 0:
        find_looked_through(see)
    for n in range(rig.sensor.beams):
        see.unseen[n] = BROKEN if see.safe[n] == 1 else 0
        see.kept[n] = see.scan[n]
        if see.safe[n]:
            see.kept[n] = math.inf if see.safe[n] == LOOKED_THROUGH else 0.0
        if found and see.filtered[n] < see.scan[n]:
            see.scan[n] = see.kept[n] = see.filtered[n]
            see.unseen[n] += see.narrow[n]


@jit_inner
def _find_lost(see: View, most: int) -> tuple[int, bool]:
    """Write ranges of lost returns into ``see.filtered``, for how many ticks into ``see.narrow``.

    Return how many were lost where the scan says nothing, and whether any were, where it is broken included.
    """
    rig = see.rig
    total, least, far = rig.sensor.beams, least_range(rig), WITHIN * rig.sensor.range_max
    turned = int(math.floor(see.percept["odom_yaw"] / rig.sensor.increment + 0.5))
    moved = math.sqrt(see.percept["odom_x"] ** 2 + see.percept["odom_y"] ** 2)
    _count_silent(see)
    lost, found = 0, False
    for n in range(total):
        if not least <= see.kept[n] < far or (see.unseen[n] & MOST_TICKS) >= most:
            continue
        m = (n - turned) % total
        aside = 2 + int(1.6 * moved / (see.kept[n] * rig.sensor.increment))  # 1.6 > asin(x) / x
        low, high = m - aside, m + aside
        if low >= 0 and high < total and see.edges[high + 1] == see.edges[low]:
            continue
        x, y, m = _place_of(see, n)
        if m < 0:
            continue
        if not found:
            for k in range(total):
                see.filtered[k] = math.inf
        found = True
        by_rights = not (see.safe[m] or _alone(see, m))
        lost += not (see.safe[m] or by_rights)
        distance = math.sqrt(x * x + y * y)
        if distance < see.filtered[m]:
            see.filtered[m] = distance
            see.narrow[m] = (see.unseen[n] & MOST_TICKS) + 1 + (GUARD_ALONE if by_rights else 0)
    return lost, found


@jit_inner
def _count_silent(see: View) -> None:
    """Write into ``see.edges`` how many beams before each have no sound return."""
    count = 0
    for n in range(see.rig.sensor.beams):
        see.edges[n] = count
        count += not _sees(see, n)
    see.edges[see.rig.sensor.beams] = count


@jit_inline
def _sees(see: View, k: int) -> bool:
    """Tell whether beam k has a sound return."""
    return bool(see.scan[k] < see.rig.sensor.range_max and not see.safe[k])


@jit_inner
def _place_of(see: View, n: int) -> tuple[float, float, int]:
    """Return where the return of beam n of the last scan is now, body frame [m], and the beam that has lost it.

    -1 instead of the beam when none has: it is seen, hidden or passed, may have been a neighbour, or is out of view.
    """
    rig, percept = see.rig, see.percept
    c, s = math.cos(percept["odom_yaw"]), math.sin(percept["odom_yaw"])
    x, y = see.kept[n] * rig.cos[n] - percept["odom_x"], see.kept[n] * rig.sin[n] - percept["odom_y"]
    x, y = c * x + s * y, c * y - s * x
    distance = math.sqrt(x * x + y * y)
    between = (math.atan2(y, x) - rig.sensor.angle_min) / rig.sensor.increment
    low = int(math.floor(between))
    first = low + 1 if between - low > 0.5 else low  # the nearer of the two goes first
    lost_by = -1
    for beam in (2 * low + 1 - first, first):
        k = beam_at(beam, rig.sensor)
        if k < 0:
            return x, y, -1
        if not _sees(see, k):
            lost_by = k
        elif see.scan[k] < distance + SAME_M or abs(between - beam) < THROUGH:
            return x, y, -1
    if lost_by < 0 or not least_range(rig) <= distance < WITHIN * rig.sensor.range_max:
        return x, y, -1
    if rig.sensor.field > 0 and not in_view(x, y, see):
        return x, y, -1
    if was_near_track(percept, see.shared, x, y, rig):
        return x, y, -1
    return x, y, lost_by


@jit_inner
def _alone(see: View, m: int) -> bool:
    """Tell whether the beams beside beam m say nothing either: at the edge of a thing beams lose it by rights."""
    for beside in (m - 1, m + 1):
        k = beam_at(beside, see.rig.sensor)
        if k < 0 or _sees(see, k):
            return False
    return True


@jit_inner
def _note_losses(percept: Row, shared: Row, seen: int, lost: int) -> None:
    """Keep up how many returns are lost, and since when nothing is seen at all where something was.

    One or two are no sign of a fault: what is narrow slips between two beams.
    """
    lost = max(0, lost - SLIPS)
    if seen > 0:
        shared["blind_s"] = 0.0
    elif lost > 0 or shared["blind_s"] > 0.0:
        shared["blind_s"] += percept["dt_s"]
    shared["losses"] *= MEMORY
    if lost > 0:
        shared["losses"] += (1.0 - MEMORY) * lost / (seen + lost)
