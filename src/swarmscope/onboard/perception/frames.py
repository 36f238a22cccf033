"""What a limited field of view has seen on the way: a few scans, each with where it was taken.

What lies beside a robot that sees only ahead was ahead of it a moment ago. Planners are shown it in a scan of the full
circle, open where nothing is known. The guard asks what is known (docs/safety.md): a place has been seen free if one of
the scans reached beyond it, or if the body has stood there.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import ray_circle, seen_from
from swarmscope.onboard.percept import PEERS, Row
from swarmscope.onboard.perception.beams import lies_between, nearest_beam
from swarmscope.onboard.perception.mend import body_and_clearance, least_range
from swarmscope.onboard.rig import SIGMAS, Rig
from swarmscope.onboard.sharing.tracks import on_track
from swarmscope.onboard.view import POSE, View

STEP_RADII = 0.4
"""After a way of so many radii another scan is kept, ..."""
STEP_SHARE = 0.4
"""... or after a turn by this share of the field of view."""
LOOK_RADII = 0.2
"""After a way of so many radii another look is worth while."""
SAME_RADII, SAME_SHARE = 0.2, 0.15
"""A scan kept from this close by, turned by less than this share of the field, gives way to the new one."""


@jit
def look_back(see: View) -> None:
    """Fill the beams out of view with the nearest of what the kept scans show there.

    The scan as measured goes into ``see.filtered``, scratch, for ``keep_frame``.
    """
    sensor, shared = see.rig.sensor, see.shared
    first, last = sensor.first, sensor.first + sensor.field - 1
    for n in range(first, last + 1):
        see.filtered[n] = see.scan[n]
    while first < last and not see.scan[first] >= 0.0:  # a sensor off the centre leaves some at the edges unknown
        first += 1
    while last > first and not see.scan[last] >= 0.0:
        last -= 1
    shared["was_first"], shared["was_last"] = shared["view_first"], shared["view_last"]
    shared["view_first"], shared["view_last"] = first, last
    for n in range(sensor.beams):
        if not first <= n <= last:
            see.scan[n] = math.inf
    move_poses(see.percept, see.frames.poses)
    for k in range(shared["frames_n"]):
        _draw(see, see.frames.scans[k], see.frames.poses[k])
    for t in range(PEERS):
        if shared["track_id"][t] >= 0:
            _draw_neighbour(see, t)


@jit_inline
def move_poses(percept: Row, poses: np.ndarray) -> None:
    """Express where scans were taken in the body frame of now."""
    here = (percept["odom_x"], percept["odom_y"], percept["odom_yaw"])
    way = math.sqrt(here[0] ** 2 + here[1] ** 2)
    for k in range(len(poses)):
        poses[k, 0], poses[k, 1], poses[k, 2] = seen_from(here, (poses[k, 0], poses[k, 1], poses[k, 2]))
        poses[k, 3] += way
        poses[k, 4] += abs(here[2])


@jit_inline
def _astray(pose: np.ndarray, reach: float, rig: Rig) -> float:
    """Return how far what a kept scan shows ``reach`` [m] from here may be from where odometry puts it [m]."""
    return astray(float(pose[3]), float(pose[4]), reach, rig)


@jit_inline
def _drifted(pose: np.ndarray, reach: float, rig: Rig) -> float:
    """Return the same for the way alone, without the turning."""
    return astray(float(pose[3]), 0.0, reach, rig)


@jit_inline
def astray(way: float, turned: float, reach: float, rig: Rig) -> float:
    """Return how far a place ``reach`` [m] off may be from where odometry puts it after ``way`` [m] and turns [rad]."""
    guarding = rig.guarding
    at_random = guarding.odometry_drift_m + guarding.odometry_turn_rad * reach
    return SIGMAS * (guarding.odometry_scale * (way + turned * reach) + at_random * math.sqrt(way))


@jit
def is_blurred(see: View, n: int) -> bool:
    """Tell whether beam n is out of view and another look may change what it shows.

    Where positioning errs it may have been a neighbour, or the way since then makes things seem nearer than they are.
    """
    if see.shared["view_first"] <= n <= see.shared["view_last"]:
        return False
    radius = see.rig.body.radius_m
    for k in range(see.shared["frames_n"]):
        pose = see.frames.poses[k]
        if see.rig.sensor.position_sigma > 0.0 and pose[3] > LOOK_RADII * radius:
            return True
        if _drifted(pose, radius, see.rig) > see.rig.guarding.clearance_m:
            return True
    return False


@jit_inner
def _draw(see: View, scan: np.ndarray, pose: np.ndarray) -> None:
    """Lower the beams out of view to what a kept scan shows there.

    It may reach to the next beam of that scan, which the clearance may cover.
    """
    sensor, first, last = see.rig.sensor, see.shared["view_first"], see.shared["view_last"]
    c, si = math.cos(pose[2]), math.sin(pose[2])
    least, clearance = least_range(see.rig), see.rig.guarding.clearance_m
    px, py, far = pose[0], pose[1], sensor.range_max
    ax, ay, bx, by = see.rig.cos[first], see.rig.sin[first], see.rig.cos[last], see.rig.sin[last]
    narrow = (last - first) * sensor.increment < math.pi
    for j in range(scan.size):
        s = scan[j]
        if not 0.0 < s < far:
            continue
        ux, uy = see.rig.cos[sensor.first + j], see.rig.sin[sensor.first + j]
        x, y = px + s * (c * ux - si * uy), py + s * (si * ux + c * uy)
        left_of_first, right_of_last = ax * y - ay * x > 0.0, x * by - y * bx > 0.0
        if (left_of_first and right_of_last) if narrow else (left_of_first or right_of_last):
            continue  # in view, by half a beam: no need to ask which one
        n = nearest_beam(x, y, 0.0, sensor)
        if first <= n <= last:
            continue
        distance = math.sqrt(x * x + y * y)
        distance -= _astray(pose, distance, see.rig) + max(0.0, s * sensor.increment - clearance)
        see.scan[n] = min(see.scan[n], max(distance, least))


@jit_inner
def _draw_neighbour(see: View, t: int) -> None:
    """Lower the beams out of view that would meet the neighbour of track ``t``."""
    sensor, shared = see.rig.sensor, see.shared
    radius = shared["track_radius"][t]
    x, y = shared["track_x"][t], shared["track_y"][t]
    d = math.sqrt(x * x + y * y)
    if not radius < d < sensor.range_max:
        return
    middle = (math.atan2(y, x) - see.percept["compass"] - sensor.angle_min) / sensor.increment
    spread = math.asin(radius / d) / sensor.increment
    for k in range(int(math.ceil(middle - spread)), int(math.floor(middle + spread)) + 1):
        n = k % sensor.beams
        if shared["view_first"] <= n <= shared["view_last"]:
            continue
        off = (k - middle) * sensor.increment
        see.scan[n] = min(see.scan[n], ray_circle(math.cos(off), math.sin(off), d, 0.0, radius))


@jit
def keep_frame(see: View) -> int:
    """Keep the scan, which has been mended since ``look_back``, if it shows something new; return where, else -1."""
    at = _slot(see)
    if at < 0:
        return at
    see.shared["frames_n"] = max(see.shared["frames_n"], at + 1)
    see.shared["frame_at"] = at
    for k in range(POSE):
        see.frames.poses[at, k] = 0.0
    _copy(see, see.frames.scans[at])
    return at


@jit
def shorten_frame(see: View, at: int) -> None:
    """Let the scan kept at ``at`` have seen free no more than up to where a hole of it may hide something."""
    scan = see.frames.scans[at]
    for j in range(scan.size):
        hidden = see.hidden[see.rig.sensor.first + j]
        if abs(scan[j]) > hidden:
            scan[j] = -hidden


@jit_inner
def _slot(see: View) -> int:
    """Return where this scan is to be kept, -1 when it shows nothing new."""
    poses, used, last = see.frames.poses, see.shared["frames_n"], see.shared["frame_at"]
    radius, field = see.rig.body.radius_m, see.rig.sensor.increment * see.rig.sensor.field
    if used == 0:
        return 0
    moved = math.sqrt(poses[last, 0] ** 2 + poses[last, 1] ** 2)
    if moved < STEP_RADII * radius and abs(poses[last, 2]) < STEP_SHARE * field:
        return -1
    for k in range(used):
        moved = math.sqrt(poses[k, 0] ** 2 + poses[k, 1] ** 2)
        if moved < SAME_RADII * radius and abs(poses[k, 2]) < SAME_SHARE * field:
            return k
    return (last + 1) % len(poses) if used == len(poses) else int(used)


@jit_inner
def _copy(see: View, out: np.ndarray) -> None:
    """Keep the scan: negative where the return is a neighbour's (free up to there), NaN where nothing is known.

    What was broken counts as seen where it was bridged, but for what the hole may hide (`shorten_frame`), not where it
    was so wide that it blocks.
    """
    rig, touching = see.rig, body_and_clearance(see.rig) + 1e-5
    for j in range(out.size):
        n = rig.sensor.first + j
        s = see.scan[n]
        if not see.shared["view_first"] <= n <= see.shared["view_last"]:
            out[j] = math.nan
        elif not see.filtered[n] >= 0.0:
            out[j] = -s if touching < s < math.inf else math.nan
        elif s < rig.sensor.range_max and on_track(see.percept, see.shared, s * rig.cos[n], s * rig.sin[n], rig):
            out[j] = -s
        else:
            out[j] = min(s, rig.sensor.range_max)  # beyond nobody knows


@jit_inline
def in_view(x: float, y: float, see: View) -> bool:
    """Tell whether the point (x, y), body frame, lies between the first and the last beam."""
    return lies_between(x, y, see.shared["view_first"], see.shared["view_last"], see.rig.sensor)


@jit_inline
def narrow_shows_up_to(see: View) -> float:
    """Return how far from here what is narrow has shown between two beams for sure, however late the scan is [m]."""
    late: float = see.rig.guarding.latency_s * abs(see.percept["speed"])
    return see.rig.horizon.things - late


@jit
def was_free(see: View, x: float, y: float) -> bool:
    """Tell whether the point (x, y), body frame [m], outside the view, has been seen free."""
    sensor, core = see.rig.sensor, see.rig.body.radius_m
    reach, shows = math.sqrt(x * x + y * y), narrow_shows_up_to(see)
    if reach < core:
        return True
    for k in range(see.shared["frames_n"]):
        pose = see.frames.poses[k]
        px, py = x - pose[0], y - pose[1]
        away, off = math.sqrt(px * px + py * py), _astray(pose, reach, see.rig)
        if away + off < core:
            return True
        if away + off > shows:
            continue
        scan, n = see.frames.scans[k], nearest_beam(px, py, pose[2], sensor) - sensor.first
        aside = int(math.ceil(off / max(away, 1e-9) / sensor.increment)) if off > 0.0 else 0
        if not (aside <= n < sensor.field - aside and _all_reach(scan, n - aside, n + aside, away + off)):
            continue
        if _no_hole_at(scan, n - aside - 1, away + off) and _no_hole_at(scan, n + aside + 1, away + off):
            return True
    return False


@jit_inner
def _no_hole_at(scan: np.ndarray, n: int, far: float) -> bool:
    """Tell whether nothing is hidden at beam n of a kept scan nearer than ``far`` [m], where it might reach beside."""
    return bool(not 0 <= n < scan.size or scan[n] >= 0.0 or -scan[n] >= far)


@jit_inner
def _all_reach(scan: np.ndarray, first: int, last: int, far: float) -> bool:
    """Tell whether all beams from ``first`` to ``last`` of a kept scan reach so far [m]: any may have looked there."""
    reaching = True
    for n in range(first, last + 1):
        reaching &= abs(scan[n]) >= far  # NaN does not: nobody knows
    return reaching
