"""Returns that were there a moment ago: a beam that says nothing has not shown that their place is free.

What stood within range is kept where it was, moved by odometry, for ``Guarding.lost_s``, where one of the two beams on
either side of the place now says nothing and the other one does not show it, or where it is broken: the end of a wall
is nearer than the hole that hides it is bridged. A LiDAR that loses too much is noticed.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit_inline, jit_inner
from swarmscope.geometry import Pose, rough_angle
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.beams import beam_at
from swarmscope.onboard.perception.frames import in_view
from swarmscope.onboard.perception.holes import find_hidden, has_holes
from swarmscope.onboard.perception.mend import least_range
from swarmscope.onboard.perception.standing import STANDS
from swarmscope.onboard.sharing.tracks import was_near_track
from swarmscope.onboard.view import GUARD_ALONE, View

WITHIN = 0.9
"""Returns beyond this share of the range are not kept: they leave it by themselves."""
SAME_M = 0.1
"""A return that is farther than another by no more than this may be of the same thing."""
THROUGH = 0.1
"""A beam that is off a place by less than this part of the way to the next has looked there."""
MEMORY = 0.9
"""What stays of the share of lost returns from tick to tick."""
PASSED = np.float32(0.3)
"""What was passed by so many times its distance is looked for in earnest, ..."""
ROUGHLY = float(PASSED) ** 5 / 5.0
"""... for the rest two terms of the arc tangent do, which err by less than this [rad]."""
SINGLE = 2e-6
"""What single precision may be wrong by in the number of a beam, as a part of all beams."""
THIRD = np.float32(1.0 / 3.0)
FEWEST_SCANS = 3.0
"""It is kept for so many scans at least, however slowly they come: what one beam sees may be lost twice in a row."""
DROPPED, UNKNOWN = np.float32(-1e9), np.float32(math.nan)
SLIPS = 2
MOST_TICKS = GUARD_ALONE - 1


@jit_inline
def keep_lost(see: View, broken: int) -> None:
    """Write what was lost since the last scan back into ``see.scan``; keep that scan in ``see.kept``.

    So many beams are ``broken``, 1 in ``see.safe``: where they look, what was seen there stays, however they are
    bridged. ``see.edges``, ``see.filtered``, ``see.narrow`` and ``see.padded`` are scratch.
    """
    rig, percept = see.rig, see.percept
    seen = 0
    for n in range(rig.sensor.beams):
        seen += see.scan[n] < rig.sensor.range_max
    lost, found = 0, False
    if (broken > 0 or seen < rig.sensor.beams) and percept["dt_s"] > 0.0:
        scans = FEWEST_SCANS if rig.guarding.lost_s > 0.0 else 0.0
        most = min(float(MOST_TICKS), max(scans, rig.guarding.lost_s / percept["dt_s"]))
        lost, found = _find_lost(see, int(most + 0.5))
    _note_losses(percept, see.shared, seen, lost)
    holes = broken > 0 or has_holes(see)
    if holes:
        find_hidden(see)
    for n in range(rig.sensor.beams):
        see.unseen[n] = 0
        see.kept[n] = see.scan[n]
    if holes:
        _keep_holes(see)
    if found:
        _write_back(see)


@jit_inner
def _keep_holes(see: View) -> None:
    """Keep of beams that are broken, or cross what a hole hides, up to where one has looked."""
    for n in range(see.rig.sensor.beams):
        if see.safe[n] or see.hidden[n] < see.scan[n]:
            see.kept[n] = -min(see.scan[n], see.hidden[n])


@jit_inner
def _write_back(see: View) -> None:
    """Write what was lost into the scan; a bridge just before it stands for it.

    It is kept where nothing may be hidden before it: there the kept scan says up to where one has looked.
    """
    for n in range(see.rig.sensor.beams):
        if see.filtered[n] < see.scan[n] + SAME_M:
            see.scan[n] = min(see.filtered[n], see.scan[n])
            if not see.hidden[n] < see.scan[n]:
                see.kept[n] = see.scan[n]
            see.unseen[n] += see.edges[n]


@jit_inner
def _find_lost(see: View, most: int) -> tuple[int, bool]:
    """Write ranges of lost returns into ``see.filtered``, for how many ticks into ``see.edges``.

    Return how many were lost where the scan says nothing, and whether any were, where it is broken included.
    """
    rig, total = see.rig, see.rig.sensor.beams
    here = see.percept["odom_x"], see.percept["odom_y"], see.percept["odom_yaw"]
    c, s = math.cos(here[2]), math.sin(here[2])
    goes = rig.guarding.strangers_mps > 0.0  # what moves has not been lost
    _mark_silent(see)
    _find_beams(see, here, most)
    lost, found = 0, False
    for n in range(total):
        if _is_seen(see, n) or (goes and see.standing[n] != STANDS):
            continue
        x, y = see.kept[n] * see.rig.cos[n] - here[0], see.kept[n] * see.rig.sin[n] - here[1]
        x, y = c * x + s * y, c * y - s * x
        m = _lost_by(see, x, y)
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
            see.edges[m] = (see.unseen[n] & MOST_TICKS) + 1 + (GUARD_ALONE if by_rights else 0)
    return lost, found


@jit_inner
def _mark_silent(see: View) -> None:
    """Write into ``see.narrow`` whether one of beam n and the next has no sound return."""
    total, far = see.rig.sensor.beams, np.float32(see.rig.sensor.range_max)
    for n in range(total):
        see.narrow[n] = (not see.scan[n] < far) | (see.safe[n] != 0)
    for n in range(total - 1):
        see.narrow[n] |= see.narrow[n + 1]


@jit_inner
def _find_beams(see: View, here: Pose, most: int) -> None:
    """Write into ``see.padded`` by how many beams the returns of the last scan are displaced now, within `ROUGHLY`.

    `DROPPED` where nothing was near enough, or it has been kept for ``most`` ticks; NaN where it has moved on so far
    that this is not good enough. Without branches and in single precision, so that it is done for many beams at a time.
    """
    rig, sensor = see.rig, see.rig.sensor
    x0, y0 = np.float32(here[0]), np.float32(here[1])
    least, far = np.float32(least_range(rig)), np.float32(WITHIN * sensor.range_max)
    turned, per_increment = np.float32(here[2] / sensor.increment), np.float32(1.0 / sensor.increment)
    for n in range(sensor.beams):
        s, c, si = see.kept[n], np.float32(rig.cos[n]), np.float32(rig.sin[n])
        ahead = s - x0 * c - y0 * si
        passed = (x0 * si - y0 * c) / ahead
        near = (ahead > 0.0) & (abs(passed) < PASSED)
        dropped = (not s >= least) | (not s < far) | ((see.unseen[n] & MOST_TICKS) >= most)
        displaced = (passed - passed * passed * passed * THIRD) * per_increment - turned if near else UNKNOWN
        see.padded[n] = DROPPED if dropped else displaced


@jit_inline
def _is_seen(see: View, n: int) -> bool:
    """Tell whether the beams that look past the place of beam n of the last scan surely have sound returns."""
    displaced = see.padded[n]
    if displaced == DROPPED:
        return True
    slack = ROUGHLY / see.rig.sensor.increment + SINGLE * see.rig.sensor.beams
    between = n + displaced
    if not (between >= slack and between < see.rig.sensor.beams - 2):
        return False
    return bool(see.narrow[int(between - slack)] == 0 and see.narrow[int(between + slack)] == 0)


@jit_inline
def _sees(see: View, k: int) -> bool:
    """Tell whether beam k has a sound return."""
    return bool(see.scan[k] < see.rig.sensor.range_max and not see.safe[k])


@jit_inner
def _lost_by(see: View, x: float, y: float) -> int:
    """Return the beam that has lost what the last scan saw at (x, y), body frame [m].

    -1 when none has: it is seen, hidden or passed, may have been a neighbour, or is out of view.
    """
    rig, percept = see.rig, see.percept
    distance = math.sqrt(x * x + y * y)
    between = (rough_angle(x, y) - rig.sensor.angle_min) / rig.sensor.increment
    low = int(math.floor(between))
    first = low + 1 if between - low > 0.5 else low  # the nearer of the two goes first
    lost_by, shown = -1, False
    for beam in (2 * low + 1 - first, first):
        k = beam_at(beam, rig.sensor)
        if k < 0:
            return -1
        if not _sees(see, k):
            lost_by = k
        elif abs(between - beam) < THROUGH:
            return -1
        else:
            shown |= see.scan[k] < distance + SAME_M
    if lost_by < 0 or (shown and not see.safe[lost_by]):
        return -1
    if not least_range(rig) <= distance < WITHIN * rig.sensor.range_max:
        return -1
    gone = (rig.sensor.field > 0 and not in_view(x, y, see)) or was_near_track(percept, see.shared, x, y, rig)
    return -1 if gone else lost_by


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
