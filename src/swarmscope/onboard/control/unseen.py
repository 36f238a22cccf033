"""What a robot does about places that it has not seen: it keeps off them, and turns to look at them."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.control.way import Way, closer, corner_of
from swarmscope.onboard.perception.beams import beam_at, nearest_beam
from swarmscope.onboard.perception.frames import in_view, was_free
from swarmscope.onboard.reasons import R_HELD_HOLE, R_HELD_UNSEEN
from swarmscope.onboard.view import View

LOOK_SHARE = 0.4
"""Of what it sees of its field of view, by which a robot that looks round turns in a tick."""
ASIDE_RAD = 0.2
"""By so much a robot that sees all round turns in a tick to look where a hole of its scan is."""
FIRST_BEAMS = 5.0
"""By so many beams a robot turns between its first scans: where one is stuck, those beside it may be, too."""
AGAIN_S, WARY_S = 2.0, 10.0
"""A hole that holds a robot again within so long is shown to its planner as a thing, for so long."""
FRONT_RAD = 1.8
"""The front of the body is looked at up to this angle to either side [rad], ..."""
GRAIN_M = 0.02
"""... in places so far apart."""
ROUND_M = 0.01
"""Radius of the narrowest round thing that must not reach between two of them."""


@jit
def out_of_sight(see: View, way: Way, need: float) -> tuple[float, float]:
    """Return a place that the body would sweep and that nobody has seen free [m], (0, 0) when there is none."""
    x0, y0 = 0.0, 0.0
    for piece in range(5):
        x1, y1 = corner_of(way, piece)
        length = math.sqrt((x1 - x0) ** 2 + (y1 - y0) ** 2)
        if length > 1e-9:
            fx, fy = need * (x1 - x0) / length, need * (y1 - y0) / length
            stops = int(math.ceil(length / GRAIN_M))
            for k in range(1, stops + 1):
                part = k / stops
                x, y = _unseen_front(see, way, x0 + part * (x1 - x0), y0 + part * (y1 - y0), fx, fy)
                if x != 0.0 or y != 0.0:
                    return x, y
        x0, y0 = x1, y1
    return 0.0, 0.0


@jit_inline
def reaches_between(radius: float) -> float:
    """Return how far a round thing of `ROUND_M` gets between two places on the front of a body of ``radius`` [m]."""
    return 0.125 * GRAIN_M * GRAIN_M * (1.0 / radius + 1.0 / ROUND_M)


@jit
def look_round(see: View, v: float, w: float, why: int) -> tuple[float, float, int]:
    """Return the command of a robot that stands, and why: it turns to look at what keeps it from driving.

    With a limited view it turns once round where it has not seen what is beside its way, so slowly that scans overlap.
    Where a hole of the scan may hide something it turns until the hole has moved on by its own width; if it is there
    again soon, it may be a thing that gives no sound reading, and planners are to go round it.
    """
    shared, field = see.shared, see.rig.sensor.increment * see.rig.sensor.field
    if shared["look_rad"] > 0.0:
        shared["look_rad"] -= abs(see.percept["odom_yaw"])
    elif why == R_HELD_UNSEEN and v == 0.0:
        shared["look_rad"] = 2.0 * math.pi - 0.5 * field
    elif why == R_HELD_HOLE and v == 0.0:
        shared["look_rad"], shared["unseen_left"] = _hidden_rad(see), w >= 0.0
        if see.percept["now_s"] - shared["looked_s"] < AGAIN_S:
            shared["wary_s"] = see.percept["now_s"] + WARY_S
        shared["looked_s"] = see.percept["now_s"]
    if not shared["look_rad"] > 0.0:
        return v, w, why
    seen = see.rig.sensor.increment * (shared["view_last"] - shared["view_first"] + 1)  # less while late scans turn
    turn = min(see.rig.body.w_max_radps, (LOOK_SHARE * seen if field > 0.0 else ASIDE_RAD) / see.percept["dt_s"])
    return 0.0, turn if shared["unseen_left"] else -turn, R_HELD_UNSEEN if field > 0.0 else R_HELD_HOLE


@jit_inline
def look_first(see: View, w: float) -> float:
    """Return the turn rate of a robot that was just switched on: other beams are to look where a stuck one has looked.

    As its planner has it, or by `FIRST_BEAMS` in a tick if that is more; straight on where it is not at rest.
    """
    if see.percept["speed"] > 0.0:
        return 0.0
    least: float = min(see.rig.body.w_max_radps, FIRST_BEAMS * see.rig.sensor.increment / see.percept["dt_s"])
    return max(w, least) if w >= 0.0 else min(w, -least)


@jit_inner
def _hidden_rad(see: View) -> float:
    """Return under which angle, all in all, something may be hidden, at most half a turn [rad]."""
    beams = 0
    for n in range(see.rig.sensor.beams):
        beams += see.hidden[n] < see.scan[n]
    return min(math.pi, beams * see.rig.sensor.increment)


@jit_inner
def _unseen_front(see: View, way: Way, x: float, y: float, fx: float, fy: float) -> tuple[float, float]:
    """Return a place on the front of the body at (x, y), which looks along f [m], that nobody has seen free."""
    need = math.sqrt(fx * fx + fy * fy)
    places = int(math.ceil(FRONT_RAD * need / GRAIN_M))
    for k in range(-places, places + 1):
        a = k * FRONT_RAD / places
        px, py = x + fx * math.cos(a) - fy * math.sin(a), y + fx * math.sin(a) + fy * math.cos(a)
        if not (in_view(px, py, see) or was_free(see, px, py) or _is_shut(see, way, px, py, need)):
            return px, py
    return 0.0, 0.0


@jit_inner
def _is_shut(see: View, way: Way, px: float, py: float, need: float) -> bool:
    """Tell whether the body never gets to (px, py) for something known before it that is nearer than ``need`` already.

    Such a place is needed for clearance alone, and the guard lets the body come no closer to what is known
    (``guard._meets``). What a return is of reaches to the next place.
    """
    sensor, reach = see.rig.sensor, math.sqrt(px * px + py * py)
    middle = nearest_beam(px, py, 0.0, sensor)
    beside = int(math.ceil(0.5 * GRAIN_M / need / sensor.increment))
    s = math.inf
    for n in range(middle - beside, middle + beside + 1):
        k = beam_at(n, sensor)
        if k >= 0:
            s = min(s, see.scan[k])
    return bool(s < min(reach, need) and not closer(px, py, way, see.rig.body.radius_m))
