"""Where the neighbours are: mutual positioning, filtered, with visual persistence (Nav-SCOPE IV-B, readings 13)."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import rough_angle
from swarmscope.onboard.percept import PEERS, Row
from swarmscope.onboard.rig import SIGMAS, Rig
from swarmscope.onboard.view import GUARD_ALONE, View

SMOOTH = 0.03
"""Ranges of neighbouring beams on one surface differ by no more than this share."""
BESIDE_M = 0.06
"""Returns so far outside a neighbour's body may belong to it."""
SKIN_M = 0.01
"""What lies no farther outside a neighbour's body is the body."""
EXACT = (1.0, 0.7)
"""Gains where positioning does not err: what changes is the neighbour's speed."""
SEEN_TWICE = 2
MOST_COUNTED = 255
"""Ticks since the first are counted up to here."""
STILL_RADIUS = 0.08
"""A neighbour that stays within this of one place stands still [m]."""


@jit_inline
def update_odometry(percept: Row, shared: Row) -> tuple[float, float]:
    """Add this tick's odometry to the robot's own displacement; return it (compass frame) [m]."""
    if shared["started"] == 0:
        shared["started"] = 1
        shared["compass"] = percept["compass"]
        return 0.0, 0.0
    shared["started"] = min(MOST_COUNTED, shared["started"] + 1)
    c, s = math.cos(shared["compass"]), math.sin(shared["compass"])
    dx = c * percept["odom_x"] - s * percept["odom_y"]
    dy = s * percept["odom_x"] + c * percept["odom_y"]
    shared["x"] += dx
    shared["y"] += dy
    shared["compass"] = percept["compass"]
    return dx, dy


@jit_inline
def update_tracks(percept: Row, shared: Row, rig: Rig, dx: float, dy: float) -> None:
    """Move every track on by dead reckoning, then correct it with what is observed now.

    An alpha-beta filter in the compass frame, relative to the robot; ``dx, dy`` [m] is its own motion. A
    neighbour that drops out of view is kept for ``rig.guarding.persistence_s``, slowing down.
    """
    now, dt = percept["now_s"], percept["dt_s"]
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            continue
        if now - shared["track_seen_s"][t] > rig.guarding.persistence_s:
            shared["track_id"][t] = -1
            continue
        x, y = shared["track_x"][t] - dx, shared["track_y"][t] - dy
        shared["track_was_x"][t], shared["track_was_y"][t] = x, y
        shared["track_x"][t] = x + shared["track_vx"][t] * dt
        shared["track_y"][t] = y + shared["track_vy"][t] * dt
    c, s = math.cos(percept["compass"]), math.sin(percept["compass"])
    for k in range(percept["n_neighbours"]):
        x = c * percept["neighbour_x"][k] - s * percept["neighbour_y"][k]
        y = s * percept["neighbour_x"][k] + c * percept["neighbour_y"][k]
        t = _find(shared, percept["neighbour_id"][k])
        if t < 0:
            t = _place(shared, x, y)
            if t < 0:
                continue
            shared["track_id"][t] = percept["neighbour_id"][k]
            shared["track_x"][t], shared["track_y"][t] = x, y
            shared["track_was_x"][t], shared["track_was_y"][t] = x, y
            shared["track_vx"][t], shared["track_vy"][t] = 0.0, 0.0
            shared["track_radius"][t] = rig.guarding.others_largest_m
            shared["track_anchor_x"][t] = shared["x"] + x
            shared["track_anchor_y"][t] = shared["y"] + y
            shared["track_moved_s"][t] = now
            shared["track_n"][t] = 1
        else:
            elapsed = max(now - shared["track_seen_s"][t], 1e-6)
            seen = 2 if elapsed > 1.5 * dt else min(255, shared["track_n"][t] + 1)
            error = rig.sensor.position_sigma * math.sqrt(x * x + y * y)
            alpha, beta = gains(seen, error, rig.body.a_max_mps2 * elapsed * elapsed)
            ex, ey = x - shared["track_x"][t], y - shared["track_y"][t]
            shared["track_x"][t] += alpha * ex
            shared["track_y"][t] += alpha * ey
            shared["track_vx"][t] += beta / elapsed * ex
            shared["track_vy"][t] += beta / elapsed * ey
            shared["track_n"][t] = seen
        shared["track_yaw"][t] = percept["compass"] + percept["neighbour_yaw"][k]
        shared["track_seen_s"][t] = now
    _limit_speed_and_anchor(shared, rig, now)


@jit
def gains(seen: int, error: float, swerve: float) -> tuple[float, float]:
    """Return alpha and beta for the observation number ``seen`` of a track.

    ``error`` [m] of the observation, ``swerve`` [m]: how far speeding up leads off in the time between two. In the
    beginning a straight line through what there is, by least squares; then the filter that suits their ratio, the
    tracking index of Kalata (1984).
    """
    if error <= 0.0:
        return EXACT
    index = swerve / (SIGMAS * error)
    root = 4.0 / (4.0 + index + math.sqrt(8.0 * index + index * index))
    alpha = 1.0 - root * root
    beta = 2.0 * (2.0 - alpha) - 4.0 * math.sqrt(1.0 - alpha)
    pairs = seen * (seen + 1.0)
    return max(alpha, (4.0 * seen - 2.0) / pairs), max(beta, 6.0 / pairs)


@jit_inner
def _limit_speed_and_anchor(shared: Row, rig: Rig, now: float) -> None:
    """Clip estimated speeds to what the robots can do, slow unseen ones down, notice who stands still."""
    fastest = max(rig.guarding.others_mps, rig.body.v_max_mps)
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            continue
        vx, vy = shared["track_vx"][t], shared["track_vy"][t]
        speed = math.sqrt(vx * vx + vy * vy)
        factor = 0.8 if shared["track_seen_s"][t] < now else 1.0
        if speed > fastest:
            factor *= fastest / speed
        shared["track_vx"][t] *= factor
        shared["track_vy"][t] *= factor
        x, y = shared["track_x"][t], shared["track_y"][t]
        ex = shared["x"] + x - shared["track_anchor_x"][t]
        ey = shared["y"] + y - shared["track_anchor_y"][t]
        limit = STILL_RADIUS + 2.0 * rig.sensor.position_sigma * math.sqrt(x * x + y * y)
        if ex * ex + ey * ey > limit * limit:
            shared["track_anchor_x"][t] = shared["x"] + x
            shared["track_anchor_y"][t] = shared["y"] + y
            shared["track_moved_s"][t] = now


@jit_inner
def _find(shared: Row, peer: int) -> int:
    """Return the track of ``peer``, or -1."""
    for t in range(PEERS):
        if shared["track_id"][t] == peer:
            return t
    return -1


@jit_inner
def _place(shared: Row, x: float, y: float) -> int:
    """Return a free track, else the farthest one if it is farther than (x, y), else -1."""
    worst, worst_d2 = -1, x * x + y * y
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            return t
        d2 = shared["track_x"][t] ** 2 + shared["track_y"][t] ** 2
        if d2 > worst_d2:
            worst, worst_d2 = t, d2
    return worst


@jit_inline
def measure_bodies(see: View) -> None:
    """Learn how large neighbours are where robots differ: no return lies inside a body.

    Each counts as large as the largest, until returns have shown less. Only what is seen in this tick tells, and no
    more exactly than ranges and positions are known; scans that were moved on show places that nobody has measured.
    """
    shared, rig = see.shared, see.rig
    smallest, largest = rig.guarding.others_smallest_m, rig.guarding.others_largest_m
    if not smallest < largest or rig.guarding.latency_s > 0.0:
        return
    c, s = math.cos(see.percept["compass"]), math.sin(see.percept["compass"])
    for t in range(PEERS):
        if shared["track_id"][t] < 0 or shared["track_seen_s"][t] < see.percept["now_s"]:
            continue
        x = c * shared["track_x"][t] + s * shared["track_y"][t]
        y = c * shared["track_y"][t] - s * shared["track_x"][t]
        sigma = rig.sensor.position_sigma + rig.sensor.range_sigma
        shows = _nearest_to(see, x, y) + SKIN_M + 2.0 * SIGMAS * sigma * math.sqrt(x * x + y * y)
        shared["track_radius"][t] = max(smallest, min(shared["track_radius"][t], shows))


@jit_inner
def _nearest_to(see: View, x: float, y: float) -> float:
    """Return how near a return of now, on a surface, comes to the point (x, y), body frame [m]."""
    rig, best = see.rig, math.inf
    for n in range(1, rig.sensor.beams - 1):
        s = see.scan[n]
        out_of_view = rig.sensor.field > 0 and not see.shared["view_first"] < n < see.shared["view_last"]
        if see.unseen[n] != 0 or out_of_view or not s < rig.sensor.range_max:
            continue
        if abs(see.scan[n - 1] - s) > SMOOTH * s or abs(see.scan[n + 1] - s) > SMOOTH * s:
            continue
        ex, ey = s * rig.cos[n] - x, s * rig.sin[n] - y
        best = min(best, ex * ex + ey * ey)
    return math.sqrt(best)


@jit_inline
def mask_moving_neighbours(see: View, still_s: float) -> None:
    """Copy the scan into ``see.masked`` without the returns of neighbours that move (no return instead), nor those that
    are kept for the guard alone; where the robot is wary with what holes may hide.

    Moving neighbours are kept apart from by the yield rule and the guard; taken for obstacles they would
    make every robot turn off behind every other. One that has stood for ``still_s`` stays in: it is an obstacle.
    """
    for n in range(see.rig.sensor.beams):
        see.masked[n] = np.inf if see.unseen[n] >= GUARD_ALONE else see.scan[n]
    if see.percept["now_s"] < see.shared["wary_s"]:
        for n in range(see.rig.sensor.beams):
            see.masked[n] = min(see.masked[n], see.hidden[n])
    for t in range(PEERS):
        if moves(see.percept, see.shared, t, still_s):
            returns_of(see, t, True)


@jit_inline
def moves(percept: Row, shared: Row, t: int, still_s: float) -> bool:
    """Tell whether track ``t`` is that of a neighbour that has moved within the last ``still_s`` [s]."""
    return bool(shared["track_id"][t] >= 0 and percept["now_s"] - shared["track_moved_s"][t] < still_s)


@jit_inline
def returns_of(see: View, t: int, hide: bool) -> float:
    """Return the smallest range [m] among the returns that may belong to the neighbour of track ``t``, inf for none.

    ``hide`` takes them out of the masked scan.
    """
    percept, shared, rig, ranges = see.percept, see.shared, see.rig, see.scan
    sensor = rig.sensor
    c, s = math.cos(percept["compass"]), math.sin(percept["compass"])
    x = c * shared["track_x"][t] + s * shared["track_y"][t]
    y = c * shared["track_y"][t] - s * shared["track_x"][t]
    d = math.sqrt(x * x + y * y)
    reach = neighbour_reach(shared["track_radius"][t], d, rig)
    nearest = math.inf
    if d - reach > sensor.range_max:
        return nearest
    half_angle = math.pi
    if d > reach:
        half_angle = reach / d + (0.5 * math.pi - 1.0) * (reach / d) ** 3  # asin, or a little more
    spread = int(math.ceil(half_angle / sensor.increment)) + 1
    centre = int(math.floor((rough_angle(x, y) - sensor.angle_min) / sensor.increment + 0.5))
    if 2 * spread + 1 > sensor.beams:
        spread = (sensor.beams - 1) // 2
    for k in range(centre - spread, centre + spread + 1):
        n = k
        if sensor.wraps and k < 0:
            n = k + sensor.beams
        elif sensor.wraps and k >= sensor.beams:
            n = k - sensor.beams
        if n < 0 or n >= sensor.beams or not ranges[n] >= sensor.range_min:
            continue
        ex, ey = ranges[n] * rig.cos[n] - x, ranges[n] * rig.sin[n] - y
        if ex * ex + ey * ey <= reach * reach:
            nearest = min(nearest, float(ranges[n]))
            if hide:
                see.masked[n] = np.inf
    return nearest


@jit_inline
def neighbour_reach(radius: float, distance: float, rig: Rig) -> float:
    """Return how far from a neighbour's estimated centre its returns may lie [m], errors included."""
    noise = rig.sensor.position_sigma + rig.sensor.range_sigma
    return radius + BESIDE_M + 2.0 * noise * distance


@jit_inline
def near_track(percept: Row, shared: Row, px: float, py: float, rig: Rig) -> bool:
    """Tell whether the return at (px, py), body frame, may belong to a neighbour: to where it is seen, or its track."""
    for k in range(percept["n_neighbours"]):
        x, y = percept["neighbour_x"][k], percept["neighbour_y"][k]
        reach = neighbour_reach(rig.guarding.others_largest_m, math.sqrt(x * x + y * y), rig)
        if (px - x) ** 2 + (py - y) ** 2 <= reach * reach:
            return True
    gx, gy = _by_compass(percept, px, py)
    for t in range(PEERS):
        x, y = shared["track_x"][t], shared["track_y"][t]
        reach = neighbour_reach(shared["track_radius"][t], math.sqrt(x * x + y * y), rig)
        if shared["track_id"][t] >= 0 and (gx - x) ** 2 + (gy - y) ** 2 <= reach * reach:
            return True
    return False


@jit
def on_track(percept: Row, shared: Row, px: float, py: float, rig: Rig) -> bool:
    """Tell whether the return at (px, py), body frame, lies where a neighbour's body is, errors left aside."""
    gx, gy = _by_compass(percept, px, py)
    for t in range(PEERS):
        x, y = shared["track_x"][t], shared["track_y"][t]
        reach = shared["track_radius"][t] + SKIN_M
        if shared["track_id"][t] >= 0 and (gx - x) ** 2 + (gy - y) ** 2 <= reach * reach:
            return True
    return False


@jit_inline
def was_near_track(percept: Row, shared: Row, px: float, py: float, rig: Rig) -> bool:
    """Tell whether what was at (px, py), body frame of now, a tick ago may have belonged to a neighbour.

    Where it was then is known of one that was seen then and is now; others may have come as far as they can.
    """
    gx, gy = _by_compass(percept, px, py)
    way = max(rig.guarding.others_mps, rig.body.v_max_mps) * percept["dt_s"]
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            continue
        x, y = shared["track_was_x"][t], shared["track_was_y"][t]
        reach = neighbour_reach(shared["track_radius"][t], math.sqrt(x * x + y * y), rig)
        if shared["track_n"][t] < SEEN_TWICE or shared["track_seen_s"][t] < percept["now_s"]:
            reach += way
        if (gx - x) ** 2 + (gy - y) ** 2 <= reach * reach:
            return True
    return False


@jit_inline
def _by_compass(percept: Row, px: float, py: float) -> tuple[float, float]:
    """Return (px, py) of the body frame in the compass frame [m]."""
    c, s = math.cos(percept["compass"]), math.sin(percept["compass"])
    return c * px - s * py, s * px + c * py
