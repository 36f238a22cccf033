"""The last check before the wheels, the same for every planner: braking distance along the swept footprint.

A command is let through only if the robot, having executed it until the next tick (plus the age of its scan),
can still brake to a stop without its disc coming closer to a return than the clearance (GIWT 1-2; the braking
distance is Nav-SCOPE's s_b). Other robots move: each may use only its half of the gap between two robots, and
keeps its braking distance twice, so that after both have moved each can still stop in its half (docs/safety.md
has the argument). If nothing passes, the robot brakes straight on, which the previous tick has shown to be free.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import point_segment_distance
from swarmscope.onboard.control.unicycle import ramp
from swarmscope.onboard.percept import PEERS, Row
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.sharing.tracks import neighbour_reach
from swarmscope.onboard.view import View

STEPS = 4
"""Straight pieces that stand for the arc driven until the next tick."""
FRACTIONS = (1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.0)


class Motion(NamedTuple):
    """Where a command leads, body frame: at the next tick, and stopped after it by braking straight on [m]."""

    moved_x: float
    moved_y: float
    stopped_x: float
    stopped_y: float


@jit
def guard(see: View) -> bool:
    """Lower the speed that was decided until it is safe; return whether it had to.

    The raw scan counts: invalid beams (NaN, below range_min) forbid motion towards them. ``see.edges`` is scratch.
    """
    body = see.rig.body
    wanted, w = see.out["v"], see.out["w"]
    if not (math.isfinite(wanted) and math.isfinite(w)):
        wanted, w = 0.0, 0.0
    w = min(body.w_max_radps, max(-body.w_max_radps, w))
    wanted = min(body.v_max_mps, max(0.0, wanted))
    count, nearest = _near_beams(see.scan, see.percept["dt_s"], see.rig, see.edges)
    need = min(body.radius_m + see.rig.guarding.clearance_m, nearest - 1e-6)  # already too close: never closer
    for fraction in FRACTIONS:
        v = wanted * fraction
        if _passes(see, v, w, count, need):
            see.out["v"], see.out["w"] = v, w
            return fraction < 1.0
    see.out["v"], see.out["w"] = 0.0, 0.0 if see.percept["speed"] > 1e-6 else w
    return True


@jit_inner
def _near_beams(ranges: np.ndarray, dt: float, rig: Rig, near: np.ndarray) -> tuple[int, float]:
    """Collect the beams that could matter within this tick's motion and the braking after it.

    Return how many, and the smallest valid range among them [m].
    """
    body = rig.body
    brakes = 2.0 * body.v_max_mps * body.v_max_mps / body.a_max_mps2
    reach = body.v_max_mps * (dt + rig.guarding.latency_s) + brakes
    limit = body.radius_m + 2.0 * rig.guarding.clearance_m + reach
    least = least_range(rig)
    count = 0
    nearest = math.inf
    for n in range(rig.sensor.beams):
        if not ranges[n] >= limit:
            near[count] = n
            count += 1
            if least <= ranges[n] < nearest:
                nearest = ranges[n]
    return count, nearest


@jit_inline
def least_range(rig: Rig) -> float:
    """Return the smallest range that can be a return of something else: others are invalid, or inside the body."""
    return max(rig.sensor.range_min, 0.5 * rig.body.radius_m)


@jit_inner
def _passes(see: View, v: float, w: float, count: int, need: float) -> bool:
    """Tell whether commanding (v, w) keeps ``need`` [m] clear of every near beam, and of every neighbour's half."""
    rig, percept = see.rig, see.percept
    body = rig.body
    v0 = percept["speed"]
    yaw = 0.0
    step = percept["dt_s"] / STEPS
    speed = v0
    x0, y0 = v0 * rig.guarding.latency_s, 0.0
    x1, y1, x2, y2, x3, y3, x4, y4 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    x, y = x0, y0
    for k in range(STEPS):
        speed, way = ramp(speed, v, body.a_max_mps2, step)
        x += way * math.cos(yaw + 0.5 * w * step)
        y += way * math.sin(yaw + 0.5 * w * step)
        yaw += w * step
        if k == 0:
            x1, y1 = x, y
        elif k == 1:
            x2, y2 = x, y
        elif k == 2:
            x3, y3 = x, y
        else:
            x4, y4 = x, y
    brake = speed * speed / (2.0 * body.a_max_mps2)
    x5, y5 = x + brake * math.cos(yaw), y + brake * math.sin(yaw)
    if x5 * x5 + y5 * y5 + brake < 1e-10 and v0 < 1e-6:
        return True
    motion = Motion(x4, y4, x5, y5)
    if not _clear_of_tracks(percept, see.shared, motion, rig):
        return False
    for k in range(count):
        n = see.edges[k]
        s = see.scan[n]
        if not s >= least_range(rig):  # forbid that way
            s = body.radius_m + rig.guarding.clearance_m
        px, py = s * rig.cos[n], s * rig.sin[n]
        gap = _point_gap(percept, see.shared, px, py, rig)
        if gap and not _in_own_half(px, py, s, motion, rig):
            return False
        if (
            point_segment_distance(px, py, 0.0, 0.0, x1, y1) < need
            or point_segment_distance(px, py, x1, y1, x2, y2) < need
            or point_segment_distance(px, py, x2, y2, x3, y3) < need
            or point_segment_distance(px, py, x3, y3, x4, y4) < need
            or point_segment_distance(px, py, x4, y4, x5, y5) < need
        ):
            return False
    return True


@jit_inner
def _point_gap(percept: Row, shared: Row, px: float, py: float, rig: Rig) -> bool:
    """Tell whether the return at (px, py), body frame, may belong to a neighbour."""
    c, s = math.cos(percept["compass"]), math.sin(percept["compass"])
    gx, gy = c * px - s * py, s * px + c * py
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            continue
        ex, ey = gx - shared["track_x"][t], gy - shared["track_y"][t]
        reach = neighbour_reach(math.sqrt(shared["track_x"][t] ** 2 + shared["track_y"][t] ** 2), rig)
        if ex * ex + ey * ey <= reach * reach:
            return True
    return False


@jit_inner
def _in_own_half(px: float, py: float, s: float, motion: Motion, rig: Rig) -> bool:
    """Tell whether a motion keeps to its half of the way to (px, py); its braking counts twice.

    (px, py) is the nearest known point of a neighbour's body at range ``s``.
    """
    if s <= 1e-6:
        return motion.stopped_x * motion.stopped_x + motion.stopped_y * motion.stopped_y < 1e-9
    nx, ny = px / s, py / s
    moved = motion.moved_x * nx + motion.moved_y * ny
    stopped = motion.stopped_x * nx + motion.stopped_y * ny
    towards = max(moved, stopped)
    if towards <= 1e-6:
        return True
    free = s - rig.body.radius_m - rig.guarding.clearance_m
    return towards + max(0.0, stopped - moved) <= 0.5 * free


@jit_inner
def _clear_of_tracks(percept: Row, shared: Row, motion: Motion, rig: Rig) -> bool:
    """Apply the half-gap rule to every tracked neighbour, seen now or remembered."""
    c, s = math.cos(percept["compass"]), math.sin(percept["compass"])
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            continue
        x = c * shared["track_x"][t] + s * shared["track_y"][t]
        y = c * shared["track_y"][t] - s * shared["track_x"][t]
        d = math.sqrt(x * x + y * y)
        error = rig.sensor.position_sigma * d
        surface = d - rig.body.radius_m - error
        if surface > 4.0 * rig.body.radius_m + 1.0 or d < 1e-6:
            continue
        scale = surface / d
        if not _in_own_half(x * scale, y * scale, max(surface, 1e-6), motion, rig):
            return False
    return True
