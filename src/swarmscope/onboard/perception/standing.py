"""Which returns are of things that stand: before all others a robot has to fear that they come (docs/safety.md).

Three scans of the last second are kept, moved on by odometry. A return stands where they show a surface at its place.
It moves where one of them has looked through its place, or has seen something before it that is gone. What was hidden
then stands if it joins on to what stands: as a robot drives, it sees more of the same wall. All else may move.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import point_segment_distance, rough_angle
from swarmscope.onboard.perception.beams import beam_at
from swarmscope.onboard.perception.frames import astray, move_poses
from swarmscope.onboard.rig import SIGMAS, Rig
from swarmscope.onboard.view import View

EVERY_S = 0.25
"""A scan is kept so long after the last one that was kept, ..."""
OLD_S = 0.2
"""... and says something about motion when it is as old as this."""
WITHIN_M = 0.03
"""A surface that was no farther away than this is the same."""
JOINS_M = 0.1
"""Returns of neighbouring beams that are no farther apart than this, and one step of the beams, are of one thing."""
SPAN_M = 0.5
"""Between two returns of one kept scan that are no farther apart than this there was a surface."""
Point = tuple[float, float]
MAY_MOVE, STANDS, MOVES = 0, 1, 2
HIDDEN, MATCHES, PASSED, BARED = range(4)
"""What a kept scan says of a place: hidden from it; a surface; it looked through; what hid the place is gone."""


@jit
def tell_standing(see: View) -> None:
    """Write into ``see.standing`` what each return may do; keep the scan if it is time."""
    past, rig, now = see.past, see.rig, see.percept["now_s"]
    move_poses(see.percept, past.poses)
    used = int(see.shared["past_n"])
    far = rig.sensor.range_max
    for n in range(rig.sensor.beams):
        see.standing[n] = MAY_MOVE
        if see.scan[n] < far:
            see.standing[n] = _told_by(see, n, used, now)
    _join(see, far)
    last = int(see.shared["past_at"])
    if used == 0 or now - past.at_s[last] >= EVERY_S - 1e-9 or now < past.at_s[last]:
        _keep(see, used, last, now)


@jit_inner
def _told_by(see: View, n: int, used: int, now: float) -> int:
    """Return what the kept scans say of the return of beam n."""
    s, matched = float(see.scan[n]), False
    px, py = s * see.rig.cos[n], s * see.rig.sin[n]
    for k in range(used):
        if now - see.past.at_s[k] < OLD_S - 1e-9:
            continue
        says = _place_in(see, k, px, py)
        if says in (PASSED, BARED):
            return MOVES
        matched |= says == MATCHES
    return STANDS if matched else MAY_MOVE


@jit_inner
def _place_in(see: View, k: int, px: float, py: float) -> int:
    """Return what kept scan k says of the place (px, py), body frame of now [m]."""
    rig, pose, scan = see.rig, see.past.poses[k], see.past.scans[k]
    sensor, dx, dy = rig.sensor, px - pose[0], py - pose[1]
    c, si = math.cos(pose[2]), math.sin(pose[2])
    qx, qy = c * dx + si * dy, c * dy - si * dx
    reach = math.sqrt(qx * qx + qy * qy)
    between = (rough_angle(qx, qy) - sensor.angle_min) / sensor.increment
    low = int(math.floor(between))
    a, b = beam_at(low, sensor), beam_at(low + 1, sensor)
    if a < 0 or b < 0 or reach >= sensor.range_max:
        return HIDDEN
    within = WITHIN_M + SIGMAS * sensor.range_sigma * reach + astray(float(pose[3]), float(pose[4]), reach, rig)
    ra, rb = float(scan[a]), float(scan[b])
    one, other = (ra * rig.cos[a], ra * rig.sin[a]), (rb * rig.cos[b], rb * rig.sin[b])
    if _off_surface(one, other, (qx, qy), rig) <= within:
        return MATCHES
    if reach < min(ra, rb) - within:
        return PASSED
    hides = a if ra <= rb else b
    if min(ra, rb) < reach - within and _is_gone(see, pose, float(scan[hides]), hides, within):
        return BARED
    return HIDDEN


@jit_inner
def _off_surface(one: Point, other: Point, place: Point, rig: Rig) -> float:
    """Return how far a place is from what the returns of two neighbouring beams show [m].

    Between them there was a surface if they are near each other; else each may reach half a beam farther.
    """
    ra, rb = _length(one[0], one[1]), _length(other[0], other[1])
    seen_a, seen_b = ra < rig.sensor.range_max, rb < rig.sensor.range_max
    if seen_a and seen_b and _length(other[0] - one[0], other[1] - one[1]) <= SPAN_M:
        return point_segment_distance(place[0], place[1], one[0], one[1], other[0], other[1])
    off_a = _length(place[0] - one[0], place[1] - one[1]) - 0.5 * ra * rig.sensor.increment
    off_b = _length(place[0] - other[0], place[1] - other[1]) - 0.5 * rb * rig.sensor.increment
    return min(off_a if seen_a else math.inf, off_b if seen_b else math.inf)


@jit_inner
def _length(x: float, y: float) -> float:
    return math.sqrt(x * x + y * y)


@jit_inner
def _is_gone(see: View, pose: np.ndarray, reach: float, beam: int, within: float) -> bool:
    """Tell whether one looks through the place now where a kept scan had a return."""
    rig, sensor = see.rig, see.rig.sensor
    c, si = math.cos(pose[2]), math.sin(pose[2])
    qx, qy = reach * rig.cos[beam], reach * rig.sin[beam]
    x, y = pose[0] + c * qx - si * qy, pose[1] + si * qx + c * qy
    distance = math.sqrt(x * x + y * y)
    low = int(math.floor((rough_angle(x, y) - sensor.angle_min) / sensor.increment))
    a, b = beam_at(low, sensor), beam_at(low + 1, sensor)
    return bool(a >= 0 and b >= 0 and min(see.scan[a], see.scan[b]) > distance + within)


@jit_inner
def _join(see: View, far: float) -> None:
    """Let what may move stand where it joins on to what stands: twice round, one way and the other."""
    total = see.rig.sensor.beams
    for k in range(2 * total):
        _join_on(see, k % total, beam_at(k % total - 1, see.rig.sensor), far)
    for k in range(2 * total - 1, -1, -1):
        _join_on(see, k % total, beam_at(k % total + 1, see.rig.sensor), far)


@jit_inner
def _join_on(see: View, n: int, m: int, far: float) -> None:
    """Let beam n stand if beam m does and joins on to it."""
    if m < 0 or see.standing[n] != MAY_MOVE or see.standing[m] != STANDS or not see.scan[n] < far:
        return
    near = min(see.scan[n], see.scan[m])
    if abs(see.scan[n] - see.scan[m]) <= JOINS_M + near * see.rig.sensor.increment:
        see.standing[n] = STANDS


@jit_inner
def _keep(see: View, used: int, last: int, now: float) -> None:
    """Keep the scan in the place of the oldest one."""
    past = see.past
    at = used if used < len(past.scans) else (last + 1) % len(past.scans)
    for n in range(see.rig.sensor.beams):
        past.scans[at, n] = see.scan[n]
    for k in range(past.poses.shape[1]):
        past.poses[at, k] = 0.0
    past.at_s[at] = now
    see.shared["past_n"], see.shared["past_at"] = max(used, at + 1), at
