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

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.control.corners import apart_round, matters_up_to, other_robots, out_of_hidden_halves, strangers
from swarmscope.onboard.control.halves import Others, leaves_room, met_by
from swarmscope.onboard.control.horizon import horizon_speed
from swarmscope.onboard.control.strangers import held_by_strangers
from swarmscope.onboard.control.unseen import look_first, look_round, out_of_sight, reaches_between
from swarmscope.onboard.control.way import STEPS, Way, bulge_of, closer, shadowed, way_of
from swarmscope.onboard.percept import MAX_NEIGHBOURS, PEERS, Row
from swarmscope.onboard.perception.frames import is_blurred
from swarmscope.onboard.perception.mend import body_and_clearance, least_range
from swarmscope.onboard.reasons import (
    R_HELD_BLIND,
    R_HELD_CORNER,
    R_HELD_HOLE,
    R_HELD_NO_NUMBER,
    R_HELD_ROBOT,
    R_HELD_STRANGER,
    R_HELD_THING,
    R_HELD_UNSEEN,
)
from swarmscope.onboard.rig import ROUNDING_M, SIGMAS, Rig
from swarmscope.onboard.sharing.tracks import near_track, returns_of
from swarmscope.onboard.view import View

FRACTIONS = (1.0, 0.8, 0.6, 0.4, 0.2, 0.1, 0.05, 0.0)
CREEP = 0.4
"""Where somebody may come who does not yield the slowest speed but 0 is slower by this: it may be all that passes."""
LEAST_MPS = 1e-3
"""There what is slower than this stands."""
HARDLY = 0.5
"""A robot that a hole of its scan lets drive no faster than this share of what it wants rather stands, and looks."""
FREE = -1
STANDS_MPS = 1e-6
SOME_LOSSES, MOST_LOSSES = 0.2, 0.35
"""Shares of returns lost from scan to scan from which on a robot slows down, and at which it stands. Of beams lost by
chance with probability p a share p^3 is lost together with both beams beside them."""


@jit_inline
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
    if not rig.guarding.enabled:
        out["v"], out["w"] = asked, w
        return False
    if see.shared["started"] < rig.guarding.first_scans:
        out["v"], out["w"], out["reason"] = 0.0, look_first(see, w), R_HELD_UNSEEN
        return True
    v, w, why = _allowed(see, asked, w)
    if why == R_HELD_HOLE and max(v, percept["speed"]) <= HARDLY * asked:
        v, w = 0.0, w if percept["speed"] <= STANDS_MPS else 0.0
    if percept["speed"] <= STANDS_MPS:
        v, w, why = look_round(see, v, w, why)
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
    dt, speed = percept["dt_s"], _speed_at_most(see)
    wanted = min(asked, speed_of_horizon(see.rig, dt))
    if see.shared["losses"] > SOME_LOSSES:
        wanted *= (MOST_LOSSES - see.shared["losses"]) / (MOST_LOSSES - SOME_LOSSES)
    near = _near(see, max(speed, min(wanted, speed + body.a_max_mps2 * dt)))
    _measure_gaps(see)
    why = FREE
    strange = see.rig.guarding.strangers_mps > 0.0
    for fraction in FRACTIONS:
        v = wanted * fraction
        if strange and fraction == FRACTIONS[-2]:
            v *= CREEP
        if strange and v < LEAST_MPS:
            v = 0.0
        held = _held_by(see, v, w, near)
        if held == FREE:
            return v, w, why
        why = held
    return 0.0, w if speed <= STANDS_MPS else 0.0, why


@jit_inline
def _speed_at_most(see: View) -> float:
    """Return how fast the robot may be, wheels err [m/s]."""
    speed: float = see.percept["speed"]
    return speed * (1.0 + SIGMAS * see.rig.guarding.odometry_scale)


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
        surface = d - shared["track_radius"][t]
        least = surface - sigma * d
        if sigma > 0.0:
            shown = returns_of(see, t, False)
            if shown < math.inf:
                least = max(least, min(surface, shown))
        see.other.distances[t] = least


@jit
def speed_of_horizon(rig: Rig, dt: float) -> float:
    """Return the largest speed [m/s] that the longest view allows with a decision every ``dt`` [s]."""
    guarding, taken = rig.guarding, rig.body.radius_m + rig.guarding.clearance_m
    robots = rig.horizon.robots - taken if guarding.others_mps > 0.0 else math.inf
    stranger, things, delay = 0.0 if guarding.others_yield else guarding.others_mps, rig.horizon.things - taken, dt
    delay += guarding.latency_s
    speed = horizon_speed(things, robots, delay, rig.body.a_max_mps2, stranger)
    if not guarding.strangers_mps > 0.0:
        return speed
    free = rig.horizon.strangers - taken
    return min(speed, horizon_speed(things, free, delay, rig.body.a_max_mps2, guarding.strangers_mps))


@jit_inner
def _near(see: View, speed: float) -> int:
    """List in ``see.edges`` the beams that could matter for a robot that is at most so fast until the next tick.

    Return how many there are.
    """
    rig, ranges, near = see.rig, see.scan, see.edges
    body, guarding = rig.body, rig.guarding
    delay = see.percept["dt_s"] + guarding.latency_s
    way, brake = speed * delay, speed * speed / (2.0 * body.a_max_mps2)
    limit = body.radius_m + guarding.clearance_m + _bulge(speed, body.w_max_radps, see) + way + brake
    if guarding.others_mps > 0.0:
        stranger = 0.0 if guarding.others_yield else met_by(guarding.others_mps, speed, see.percept["dt_s"], rig)
        hidden = apart_round(rig) - guarding.others_smallest_m + way + brake
        limit = max(limit, hidden) + max(way + 3.0 * brake, stranger)
    if guarding.strangers_mps > 0.0:
        others = strangers(speed, see.percept["dt_s"], rig)
        limit = max(limit, max(others.touch, body.radius_m + guarding.clearance_m) + way + brake + others.met)
    limit /= max(0.5, 1.0 - SIGMAS * rig.sensor.range_sigma - rig.sensor.increment)
    far = np.float32(limit + ROUNDING_M)
    count = 0
    for n in range(rig.sensor.beams):
        if (not ranges[n] >= far) | (see.hidden[n] < far):
            near[count] = n
            count += 1
    return count


@jit_inner
def _held_by(see: View, v: float, w: float, near: int) -> int:
    """Return what holds a robot back from the command (v, w): FREE, or the reason.

    The way keeps clear of every return, out of others' halves, and within what was seen.
    """
    rig, percept = see.rig, see.percept
    speed = _speed_at_most(see)
    way = way_of(speed, v, w, rig.guarding.latency_s, see)
    if way.x5 * way.x5 + way.y5 * way.y5 + way.brake < 1e-10 and speed < STANDS_MPS:
        return FREE
    others, bulge = other_robots(v, percept["dt_s"], rig), _bulge(v, w, see)
    held = _held_by_seen(see, way, others, bulge, near)
    if held != FREE:
        return held
    held = _held_by_unseen(see, way, bulge)
    if rig.guarding.strangers_mps > 0.0 and held_by_strangers(see, v, way, near):
        held = R_HELD_STRANGER
    if held == FREE and way.turns and rig.guarding.latency_s > 0.0:
        # heeded at once, not as late as it may be: a way that turns later is another one, not just a longer one
        at_once = way_of(speed, v, w, 0.0, see)
        held = _held_by_seen(see, at_once, others, bulge, near)
        if held == FREE:
            held = _held_by_unseen(see, at_once, bulge)
    return held


@jit_inner
def _held_by_seen(see: View, way: Way, others: Others, bulge: float, near: int) -> int:
    """Return whether a way comes too near to what is seen, or leaves others less than their half: FREE, or why not."""
    if see.rig.guarding.others_mps > 0.0 and not _clear_of_tracks(see, way, others):
        return R_HELD_ROBOT
    enough = matters_up_to(way, others)
    for k in range(near):
        n = int(see.edges[k])
        held = _held_by_beam(see, n, way, others, bulge, enough)
        if held == R_HELD_THING:
            return _what_is_at(see, n)
        if held != FREE:
            return held
    return FREE


@jit_inner
def _what_is_at(see: View, n: int) -> int:
    """Return the reason of a robot that keeps off what beam n sees: it may be no thing, but that nobody has looked."""
    if see.hidden[n] < see.scan[n]:
        return R_HELD_HOLE
    if see.rig.sensor.field > 0 and is_blurred(see, n):
        see.shared["unseen_left"] = see.rig.sin[n] > 0.0
        return R_HELD_UNSEEN
    return R_HELD_THING


@jit_inner
def _held_by_unseen(see: View, way: Way, bulge: float) -> int:
    """Return whether a way leads where nobody has looked: FREE, or the reason."""
    rig = see.rig
    if rig.sensor.field == 0:
        return FREE
    kept, _ = _kept_from(rig.body.radius_m, bulge, rig)
    x, y = out_of_sight(see, way, kept + reaches_between(rig.body.radius_m))
    if x == 0.0 and y == 0.0:
        return FREE
    see.shared["unseen_left"] = y > 0.0
    return R_HELD_UNSEEN


@jit_inline
def _bulge(v: float, w: float, see: View) -> float:
    """Return how far an arc bulges out of the straight pieces drawn for it, ranges and motion rounded [m]."""
    step: float = see.percept["dt_s"] / STEPS
    speed: float = see.percept["speed"]
    return ROUNDING_M + bulge_of(speed, v, w, step)


@jit_inline
def _kept_from(s: float, bulge: float, rig: Rig) -> tuple[float, float]:
    """Return how far the centre keeps off what the return of range ``s`` belongs to, and how near that may be [m].

    The clearance covers what is not exact, or it is more than that: the thing may reach as far as the next beam, where
    it does not show, and the range may err.
    """
    spare = rig.guarding.clearance_m - rig.sensor.increment * s - bulge
    nearest = s - max(0.0, SIGMAS * rig.sensor.range_sigma * s - max(0.0, spare))
    return rig.body.radius_m + rig.guarding.clearance_m + max(0.0, -spare), nearest


@jit_inner
def _nearest_of(see: View, n: int, bulge: float) -> tuple[float, float]:
    """Return at which range what beam n sees may be, and what the centre keeps off there [m]."""
    rig, s = see.rig, see.scan[n]
    if not s >= least_range(rig):
        s = body_and_clearance(rig)
    kept, s = _kept_from(s, bulge, rig)
    if see.hidden[n] < s:
        s = see.hidden[n]
        kept, _ = _kept_from(s, bulge, rig)
    return s, min(kept, s - 1e-6)  # already too close: never closer


@jit_inner
def _meets(see: View, n: int, s: float, need: float, way: Way) -> bool:
    """Tell whether a way comes closer than ``need`` to the return of beam n at range ``s``, or to what it hides."""
    c, si = see.rig.cos[n], see.rig.sin[n]
    if not s - need < way.reach + ROUNDING_M:
        return False
    px, py = s * c, s * si
    return bool(closer(px, py, way, need) or (way.turns and shadowed(px, py, c, si, way, need)))


@jit_inner
def _held_by_beam(see: View, n: int, way: Way, others: Others, bulge: float, enough: float) -> int:
    """Return how the return of beam n, or who may come out from behind it, forbids a way: FREE, or the reason."""
    rig, percept = see.rig, see.percept
    s, need = _nearest_of(see, n, bulge)
    if _meets(see, n, s, need, way):
        return R_HELD_THING
    if not rig.guarding.others_mps > 0.0:
        return FREE
    px, py = s * rig.cos[n], s * rig.sin[n]
    if not leaves_room(px, py, s, way, others, rig) and (
        s > _listed_up_to(percept, rig) or near_track(percept, see.shared, px, py, rig)
    ):
        return R_HELD_ROBOT
    return FREE if out_of_hidden_halves(see, n, way, others, enough) else R_HELD_CORNER


@jit_inline
def _listed_up_to(percept: Row, rig: Rig) -> float:
    """Return up to which range every robot in sight is listed [m]: inf unless the list is full."""
    k = MAX_NEIGHBOURS - 1
    if percept["n_neighbours"] < MAX_NEIGHBOURS:
        return math.inf
    farthest = math.sqrt(percept["neighbour_x"][k] ** 2 + percept["neighbour_y"][k] ** 2)
    return farthest - 1.5 * rig.guarding.others_largest_m


@jit_inner
def _clear_of_tracks(see: View, way: Way, others: Others) -> bool:
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
        if not leaves_room(x * scale, y * scale, surface, way, others, rig):
            return False
    return True
