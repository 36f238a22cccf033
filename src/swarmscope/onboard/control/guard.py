"""The last check before the wheels, the same for every planner: braking distance along the swept footprint.

A command is let through only if the robot, having executed it until the next tick (plus the age of its scan), can still
brake to a stop within what it has seen to be free, its disc no closer to a return than the clearance (GIWT 1-2; the
braking distance is Nav-SCOPE's s_b). What lies behind a return, between two beams or beyond the range is not seen.
Other robots move: each may use only its half of the gap between two, and keeps its braking distance twice, so that
after both have moved each can still stop in its half. docs/safety.md has the argument. If nothing passes, the robot
brakes straight on, which the previous tick has shown to be free.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import point_segment_distance
from swarmscope.onboard.control.horizon import horizon_speed
from swarmscope.onboard.control.unicycle import ramp
from swarmscope.onboard.percept import MAX_NEIGHBOURS, PEERS, Row
from swarmscope.onboard.perception.frames import in_view, was_free
from swarmscope.onboard.perception.mend import body_and_clearance, least_range
from swarmscope.onboard.reasons import (
    R_HELD_BLIND,
    R_HELD_CORNER,
    R_HELD_NO_NUMBER,
    R_HELD_ROBOT,
    R_HELD_THING,
    R_HELD_UNSEEN,
)
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.sharing.tracks import near_track, returns_of
from swarmscope.onboard.view import View

STEPS = 4
"""Straight pieces that stand for the arc driven until the next tick."""
FRACTIONS = (1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05, 0.0)
FREE = -1
ROUNDING_M = 0.0005
"""Of ranges and of motion."""
STANDS_MPS = 1e-6
SOME_LOSSES, MOST_LOSSES = 0.2, 0.35
"""Shares of returns lost from scan to scan from which on a robot slows down, and at which it stands. Of beams lost by
chance with probability p a share p^3 is lost together with both beams beside them."""
LOOK_SHARE = 0.4
"""Of the field of view, by which a robot that looks round turns in a tick."""
FRONT, FRONT_RAD = 5, 1.8
"""The front of the body is looked at in so many places to either side, up to this angle [rad]."""


class Way(NamedTuple):
    """Where a command leads, body frame [m]: four points until the next tick, the stop after it, and the braking."""

    x1: float
    y1: float
    x2: float
    y2: float
    x3: float
    y3: float
    x4: float
    y4: float
    x5: float
    y5: float
    brake: float
    turns: bool
    """Whether it is not straight."""


class Near(NamedTuple):
    """What could matter in this tick."""

    beams: int
    """How many, listed in ``View.edges``."""
    nearest: float
    """The smallest range among them [m]."""


@jit
def guard(see: View) -> bool:
    """Lower the speed that was decided until it is safe; return whether it had to.

    A robot that it lets stand says why. What is no number, time that does not pass, and a LiDAR that has gone blind
    brake. ``see.edges`` and ``see.other`` are scratch.
    """
    percept, rig, out = see.percept, see.rig, see.out
    asked, w = out["v"], out["w"]
    why = _unfit(see)
    if why != FREE:
        out["v"], out["w"] = 0.0, 0.0
        out["reason"] = why
        return True
    w = min(rig.body.w_max_radps, max(-rig.body.w_max_radps, w))
    asked = min(rig.body.v_max_mps, max(0.0, asked))
    v, w, why = _allowed(see, asked, w)
    if rig.sensor.field > 0 and percept["speed"] <= STANDS_MPS:
        v, w, why = _look_round(see, v, w, why)
    out["v"], out["w"] = v, w
    if why != FREE and v == 0.0 and percept["speed"] <= STANDS_MPS:
        out["reason"] = why
    return bool(v < asked)


@jit_inner
def _unfit(see: View) -> int:
    """Return why no command can be trusted, FREE when it can."""
    percept, shared, dt, speed = see.percept, see.shared, see.percept["dt_s"], see.percept["speed"]
    if not (0.0 < dt < math.inf and abs(speed) < math.inf and abs(percept["compass"]) < math.inf):
        return R_HELD_NO_NUMBER
    if not (abs(see.out["v"]) < math.inf and abs(see.out["w"]) < math.inf):
        return R_HELD_NO_NUMBER
    if shared["blind_s"] >= see.rig.guarding.blind_s or shared["losses"] >= MOST_LOSSES:
        return R_HELD_BLIND
    return FREE


@jit_inner
def _allowed(see: View, asked: float, w: float) -> tuple[float, float, int]:
    """Return the fastest command up to ``asked`` [m/s] that passes, its turn rate, and why it is not faster."""
    percept, body = see.percept, see.rig.body
    dt, speed = percept["dt_s"], percept["speed"]
    wanted = min(asked, _horizon_speed(see.rig, dt))
    if see.shared["losses"] > SOME_LOSSES:
        wanted *= (MOST_LOSSES - see.shared["losses"]) / (MOST_LOSSES - SOME_LOSSES)
    near = _near(see, max(speed, min(wanted, speed + body.a_max_mps2 * dt)))
    _measure_gaps(see)
    why = FREE
    for fraction in FRACTIONS:
        v = wanted * fraction
        held = _held_by(see, v, w, near)
        if held == FREE:
            return v, w, why
        why = held
    return 0.0, w if speed <= STANDS_MPS else 0.0, why


@jit_inner
def _look_round(see: View, v: float, w: float, why: int) -> tuple[float, float, int]:
    """Return the command of a robot of limited view that stands, and why: it turns once round where it has not seen
    what is beside its way, so slowly that scans overlap."""
    shared, field = see.shared, see.rig.sensor.increment * see.rig.sensor.field
    if shared["look_rad"] > 0.0:
        shared["look_rad"] -= abs(see.percept["odom_yaw"])
    elif why == R_HELD_UNSEEN and v == 0.0:
        shared["look_rad"] = 2.0 * math.pi - 0.5 * field
    if not shared["look_rad"] > 0.0:
        return v, w, why
    turn = min(see.rig.body.w_max_radps, LOOK_SHARE * field / see.percept["dt_s"])
    return 0.0, turn if shared["unseen_left"] else -turn, R_HELD_UNSEEN


@jit_inner
def _measure_gaps(see: View) -> None:
    """Write how far the body of each track's neighbour is at least [m] into ``see.other.distances``.

    Positioning errs, in the bearing most of all; where the scan shows the body, it is as near as its nearest return, or
    as positioning says if that is nearer. Only what the scan does not show may be nearer by the error.
    """
    shared, rig = see.shared, see.rig
    sigma = rig.sensor.position_sigma
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            continue
        d = math.sqrt(shared["track_x"][t] ** 2 + shared["track_y"][t] ** 2)
        surface = d - rig.body.radius_m
        least = surface - sigma * d
        if sigma > 0.0:
            shown = returns_of(see, t, False)
            if shown < math.inf:
                least = max(least, min(surface, shown))
        see.other.distances[t] = least


@jit_inner
def _horizon_speed(rig: Rig, dt: float) -> float:
    """Return the speed that the longest view allows."""
    guarding, taken = rig.guarding, rig.body.radius_m + rig.guarding.clearance_m
    robots = rig.horizon.robots - taken if guarding.others_mps > 0.0 else math.inf
    stranger = 0.0 if guarding.others_yield else guarding.others_mps
    return horizon_speed(rig.horizon.things - taken, robots, dt + guarding.latency_s, rig.body.a_max_mps2, stranger)


@jit_inner
def _near(see: View, speed: float) -> Near:
    """Collect what could matter for a robot that is at most so fast until the next tick."""
    rig, ranges, near = see.rig, see.scan, see.edges
    body, guarding = rig.body, rig.guarding
    delay = see.percept["dt_s"] + guarding.latency_s
    way, brake = speed * delay, speed * speed / (2.0 * body.a_max_mps2)
    limit = body.radius_m + guarding.clearance_m + way + brake
    if guarding.others_mps > 0.0:
        stranger = 0.0 if guarding.others_yield else guarding.others_mps * (delay + speed / body.a_max_mps2)
        limit += max(way + 3.0 * brake, stranger)
    least = least_range(rig)
    count = 0
    nearest = math.inf
    for n in range(rig.sensor.beams):
        if not ranges[n] >= limit:
            near[count] = n
            count += 1
            if least <= ranges[n] < nearest:
                nearest = ranges[n]
    return Near(count, nearest)


@jit_inner
def _way(speed: float, v: float, w: float, see: View) -> Way:
    """Return the way of commanding (v, w) at ``speed``."""
    a_max = see.rig.body.a_max_mps2
    step = see.percept["dt_s"] / STEPS
    x0 = speed * see.rig.guarding.latency_s
    speed, way = ramp(speed, v, a_max, step)
    x1, y1 = x0 + way * math.cos(0.5 * w * step), way * math.sin(0.5 * w * step)
    speed, way = ramp(speed, v, a_max, step)
    x2, y2 = x1 + way * math.cos(1.5 * w * step), y1 + way * math.sin(1.5 * w * step)
    speed, way = ramp(speed, v, a_max, step)
    x3, y3 = x2 + way * math.cos(2.5 * w * step), y2 + way * math.sin(2.5 * w * step)
    speed, way = ramp(speed, v, a_max, step)
    x4, y4 = x3 + way * math.cos(3.5 * w * step), y3 + way * math.sin(3.5 * w * step)
    brake = speed * speed / (2.0 * a_max)
    x5, y5 = x4 + brake * math.cos(4.0 * w * step), y4 + brake * math.sin(4.0 * w * step)
    return Way(x1, y1, x2, y2, x3, y3, x4, y4, x5, y5, brake, w != 0.0)


@jit_inner
def _held_by(see: View, v: float, w: float, near: Near) -> int:
    """Return what holds a robot back from the command (v, w): FREE, or the reason.

    The way keeps clear of every return, out of others' halves, and within what was seen.
    """
    rig, percept = see.rig, see.percept
    speed = percept["speed"]
    way = _way(speed, v, w, see)
    if way.x5 * way.x5 + way.y5 * way.y5 + way.brake < 1e-10 and speed < STANDS_MPS:
        return FREE
    alone = not rig.guarding.others_mps > 0.0
    met = _met_by(v, percept["dt_s"], rig)
    if not alone and not _clear_of_tracks(see, way, met):
        return R_HELD_ROBOT
    need = min(_distance_kept(v, w, see), near.nearest - 1e-6)  # already too close: never closer
    for k in range(near.beams):
        held = _held_by_beam(see, see.edges[k], way, met, need)
        if held != FREE:
            return held
    if rig.sensor.field > 0:
        x, y = _out_of_sight(see, way, need)
        if x != 0.0 or y != 0.0:
            see.shared["unseen_left"] = y > 0.0
            return R_HELD_UNSEEN
    return FREE


@jit_inline
def _distance_kept(v: float, w: float, see: View) -> float:
    """Return how far the centre keeps off returns [m].

    The clearance, or more where it does not cover what shows between two beams beside the body, and how far an arc
    bulges out of the straight pieces that stand for it.
    """
    body, step = see.rig.body, see.percept["dt_s"] / STEPS
    hidden = 0.5 * see.rig.sensor.increment * body.radius_m + ROUNDING_M
    bulge = 0.125 * max(v, see.percept["speed"]) * abs(w) * step * step
    kept: float = body.radius_m + max(see.rig.guarding.clearance_m, hidden + bulge)
    return kept


@jit_inner
def _held_by_beam(see: View, n: int, way: Way, met: float, need: float) -> int:
    """Return how the return of beam n, or who may come out from behind it, forbids a way: FREE, or the reason."""
    rig, percept, s = see.rig, see.percept, see.scan[n]
    if not s >= least_range(rig):
        s = body_and_clearance(rig)
    px, py = s * rig.cos[n], s * rig.sin[n]
    if _closer(px, py, way, need) or (way.turns and _shadowed(px, py, rig.cos[n], rig.sin[n], way, need)):
        return R_HELD_THING
    if not rig.guarding.others_mps > 0.0:
        return FREE
    if s > _listed_up_to(percept, rig) or near_track(percept, see.shared, px, py, rig):
        return FREE if _in_own_half(px, py, s, way, met, rig) else R_HELD_ROBOT
    if _is_corner(see.scan, n, rig) and not _stops_before(px, py, s, way, met, rig):
        return R_HELD_CORNER
    return FREE


@jit_inner
def _out_of_sight(see: View, way: Way, need: float) -> tuple[float, float]:
    """Return a place that the body would sweep and that nobody has seen free [m], (0, 0) when there is none."""
    x0, y0 = 0.0, 0.0
    for piece in range(5):
        x1, y1 = _corner_of(way, piece)
        length = math.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
        if length > 1e-9:
            fx, fy = need * (x1 - x0) / length, need * (y1 - y0) / length
            stops = int(math.ceil(length / (0.5 * need)))
            for k in range(1, stops + 1):
                part = k / stops
                x, y = _unseen_front(see, x0 + part * (x1 - x0), y0 + part * (y1 - y0), fx, fy)
                if x != 0.0 or y != 0.0:
                    return x, y
        x0, y0 = x1, y1
    return 0.0, 0.0


@jit_inner
def _unseen_front(see: View, x: float, y: float, fx: float, fy: float) -> tuple[float, float]:
    """Return a place on the front of the body at (x, y), which looks along f [m], that nobody has seen free."""
    for k in range(-FRONT, FRONT + 1):
        a = k * FRONT_RAD / FRONT
        px, py = x + fx * math.cos(a) - fy * math.sin(a), y + fx * math.sin(a) + fy * math.cos(a)
        if not in_view(px, py, see) and not was_free(see, px, py):
            return px, py
    return 0.0, 0.0


@jit_inline
def _corner_of(way: Way, piece: int) -> tuple[float, float]:
    """Return where piece 0 to 4 of a way ends."""
    if piece == 0:
        return way.x1, way.y1
    if piece == 1:
        return way.x2, way.y2
    if piece == 2:
        return way.x3, way.y3
    if piece == 3:
        return way.x4, way.y4
    return way.x5, way.y5


@jit_inline
def _closer(px: float, py: float, way: Way, need: float) -> bool:
    """Tell whether the way comes closer than ``need`` [m] to the return at (px, py)."""
    return bool(
        point_segment_distance(px, py, 0.0, 0.0, way.x1, way.y1) < need
        or point_segment_distance(px, py, way.x1, way.y1, way.x2, way.y2) < need
        or point_segment_distance(px, py, way.x2, way.y2, way.x3, way.y3) < need
        or point_segment_distance(px, py, way.x3, way.y3, way.x4, way.y4) < need
        or point_segment_distance(px, py, way.x4, way.y4, way.x5, way.y5) < need
    )


@jit_inner
def _shadowed(px: float, py: float, ux: float, uy: float, way: Way, need: float) -> bool:
    """Tell whether a way that turns comes closer than ``need`` [m] to what the return at (px, py) hides.

    That is the ray from there on along unit direction u. All of a straight way lies this side of its returns.
    """
    off4 = _off_ray(way.x4 - px, way.y4 - py, ux, uy)
    off5 = _off_ray(way.x5 - px, way.y5 - py, ux, uy)
    if abs(off4) < need or abs(off5) < need:
        return True
    return bool(off4 * off5 < 0.0 and off4 * off5 > -math.inf)


@jit_inline
def _off_ray(x: float, y: float, ux: float, uy: float) -> float:
    """Return how far (x, y) lies beside the ray from the origin along u, left positive; inf behind its start."""
    return ux * y - uy * x if ux * x + uy * y > 0.0 else math.inf


@jit_inline
def _listed_up_to(percept: Row, rig: Rig) -> float:
    """Return up to which range every robot in sight is listed [m]: inf unless the list is full."""
    k = MAX_NEIGHBOURS - 1
    if percept["n_neighbours"] < MAX_NEIGHBOURS:
        return math.inf
    return math.sqrt(percept["neighbour_x"][k] ** 2 + percept["neighbour_y"][k] ** 2) - 1.5 * rig.body.radius_m


@jit_inner
def _is_corner(ranges: np.ndarray, n: int, rig: Rig) -> bool:
    """Tell whether a robot can come into view past the return of beam n: beside it there is room for one behind it."""
    room = ranges[n] + 2.0 * (rig.body.radius_m + rig.guarding.clearance_m)
    after, before = n + 1, n - 1
    if after == ranges.size:
        after = 0 if rig.sensor.wraps else n
    if before < 0:
        before = ranges.size - 1 if rig.sensor.wraps else n
    return bool(ranges[after] > room or ranges[before] > room)


@jit_inner
def _stops_before(px: float, py: float, s: float, way: Way, met: float, rig: Rig) -> bool:
    """Tell whether the robot can stop before it meets one that comes into view past the corner at (px, py).

    Both keep out of the circle round it that their body fills: x + b <= s - radius - half the clearance.
    """
    towards = max(way.x4 * px + way.y4 * py, way.x5 * px + way.y5 * py) / s
    return bool(towards <= 1e-6 or towards + met <= s - rig.body.radius_m - 0.5 * rig.guarding.clearance_m)


@jit_inline
def _met_by(v: float, dt: float, rig: Rig) -> float:
    """Return how far one that does not yield comes until a robot that drives at ``v`` [m/s] stands [m]; others 0."""
    if rig.guarding.others_yield:
        return 0.0
    return rig.guarding.others_mps * (dt + rig.guarding.latency_s + v / rig.body.a_max_mps2)


@jit_inner
def _in_own_half(px: float, py: float, s: float, way: Way, met: float, rig: Rig) -> bool:
    """Tell whether a way keeps to its half of the gap to (px, py); its braking counts twice.

    (px, py) is the nearest known point of a neighbour's body at range ``s``. Before one that does not yield the robot
    stands before it is reached.
    """
    if s <= 1e-6:
        return way.x5 * way.x5 + way.y5 * way.y5 < 1e-9
    nx, ny = px / s, py / s
    moved = way.x4 * nx + way.y4 * ny
    stopped = way.x5 * nx + way.y5 * ny
    towards = max(moved, stopped)
    if towards <= 1e-6:
        return True
    free = s - rig.body.radius_m - rig.guarding.clearance_m
    if rig.guarding.others_yield:
        return towards + max(0.0, stopped - moved) <= 0.5 * free
    return towards + met <= free


@jit_inner
def _clear_of_tracks(see: View, way: Way, met: float) -> bool:
    """Apply the half-gap rule to every tracked neighbour, seen now or remembered."""
    percept, shared, rig = see.percept, see.shared, see.rig
    c, s = math.cos(percept["compass"]), math.sin(percept["compass"])
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            continue
        x = c * shared["track_x"][t] + s * shared["track_y"][t]
        y = c * shared["track_y"][t] - s * shared["track_x"][t]
        d = math.sqrt(x * x + y * y)
        if d < 1e-6:
            return False
        surface = max(see.other.distances[t], 1e-6)
        scale = surface / d
        if not _in_own_half(x * scale, y * scale, surface, way, met, rig):
            return False
    return True
