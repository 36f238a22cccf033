"""Getting past others that move: a heading and a speed near the wanted ones that lead into nobody for a while.

Reciprocal velocity obstacles (van den Berg, Lin, Manocha 2008), sampled: a velocity is judged as if the other did as
much to get past as we do. The guard is beneath; this keeps its stops rare.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.percept import PEERS
from swarmscope.onboard.perception.safety import beam_of, safe_directions
from swarmscope.onboard.rig import ESCAPE
from swarmscope.onboard.sharing.tracks import moves
from swarmscope.onboard.view import View

STEP_RAD = math.pi / 12.0
STEPS = 7
"""To either side, of `STEP_RAD`."""


class Evading(NamedTuple):
    """How others that move are got past."""

    ahead_s: float
    """Collisions are looked for so far ahead; 0: nobody is got past."""
    apart_m: float
    """Kept between bodies."""
    weight: float
    """Of a collision at once, against a turn by a radian."""
    slow: float
    """Of standing, against a turn by a radian."""
    right: float
    """Weight of meeting somebody who comes towards us on the right; 0: either side will do."""
    lane_s: float
    """For meetings so far ahead."""
    lane_m: float
    """And who passes so near."""


@jit_inline
def time_to_meet(x: float, y: float, vx: float, vy: float, apart: float) -> float:
    """Return when something at (x, y) [m] with relative velocity (vx, vy) comes nearer than ``apart``, inf: never.

    Who is nearer already meets at once unless the distance grows.
    """
    closing = x * vx + y * vy
    if closing >= 0.0:
        return math.inf
    c = x * x + y * y - apart * apart
    if c <= 0.0:
        return 0.0
    a = vx * vx + vy * vy
    root = closing * closing - a * c
    if root <= 0.0:
        return math.inf
    return c / (-closing + math.sqrt(root))


@jit
def evade(see: View, heading: float, speed: float, still_s: float, manner: Evading) -> tuple[float, float]:
    """Return the heading (body frame, rad) and speed [m/s] to take where (heading, speed) is wanted."""
    if manner.ahead_s <= 0.0 or _cost(see, heading, speed, still_s, manner) <= 0.0:
        return heading, speed
    best, best_heading, best_speed = math.inf, heading, speed
    safe_directions(see.masked, see.rig.sensor, see.reach[ESCAPE], see.edges, see.narrow)
    for k in range(-STEPS, STEPS + 1):
        h = heading + k * STEP_RAD
        n = beam_of(h, see.rig.sensor)
        if k != 0 and (n < 0 or see.narrow[n] == 0):
            continue
        for part in range(3):
            s = speed * (1.0 - 0.5 * part)
            if part == 2 and k != 0:
                continue
            turn = abs(k) * STEP_RAD - (0.02 if k < 0 else 0.0)
            cost = turn + manner.slow * 0.5 * part + manner.weight * _cost(see, h, s, still_s, manner)
            if cost < best:
                best, best_heading, best_speed = cost, h, s
    return best_heading, best_speed


@jit_inner
def _cost(see: View, heading: float, speed: float, still_s: float, manner: Evading) -> float:
    """Return 1 for a collision at once to 0 for none within ``ahead_s``; more where somebody is met on the right."""
    shared = see.shared
    own = see.percept["speed"]
    # twice the new velocity less today's: the other does the other half
    c, s = math.cos(see.percept["compass"]), math.sin(see.percept["compass"])
    dx, dy = math.cos(heading), math.sin(heading)
    bx, by = 2.0 * speed * dx - own, 2.0 * speed * dy
    vx, vy = c * bx - s * by, s * bx + c * by
    hx, hy = c * dx - s * dy, s * dx + c * dy
    soonest, wrong = manner.ahead_s, 0.0
    for t in range(PEERS):
        if not moves(see.percept, shared, t, still_s):
            continue
        x, y = shared["track_x"][t], shared["track_y"][t]
        ux, uy = shared["track_vx"][t], shared["track_vy"][t]
        apart = see.rig.body.radius_m + shared["track_radius"][t] + manner.apart_m
        soonest = min(soonest, time_to_meet(x, y, ux - vx, uy - vy, apart))
        if manner.right > 0.0:
            # in a frame with our course along x
            ahead, aside = x * hx + y * hy, hx * y - hy * x
            along, across = ux * hx + uy * hy, hx * uy - hy * ux
            wrong = max(wrong, _on_the_wrong_side((ahead, aside), (along, across), speed, manner))
    return 1.0 - soonest / manner.ahead_s + manner.right * wrong


@jit_inline
def _on_the_wrong_side(
    place: tuple[float, float], velocity: tuple[float, float], speed: float, manner: Evading
) -> float:
    """Return how much it matters (0 to 1) that somebody who comes towards us is met on the right.

    ``place`` [m] and ``velocity`` [m/s] of the other, x along our course, y to its left.
    """
    (x, y), (ux, uy) = place, velocity
    fast = math.sqrt(ux * ux + uy * uy)
    if fast < SLOWEST_MPS or ux > -TOWARDS * fast or x < 0.0:
        return 0.0
    wx = ux - speed
    t = -(x * wx + y * uy) / (wx * wx + uy * uy)
    if t <= 0.0 or t > manner.lane_s:
        return 0.0
    left = y + t * uy
    if abs(left) > manner.lane_m:
        return 0.0
    return (1.0 - t / manner.lane_s) * (1.0 - left / manner.lane_m) * 0.5


SLOWEST_MPS, TOWARDS = 0.05, 0.7
"""Who is slower, or whose course is off ours by more than an angle with this cosine, does not come towards us."""
AGAINST = 0.95
"""Cosine of how far off one's own course somebody still comes towards one, negative."""
NARROW_M = 2.6
"""Free width from which on nobody keeps to a side."""
BESIDE_M, AHEAD_M, BEHIND_M = 0.08, 1.2, 0.2
LOOK_M = 0.8
"""A robot reaches its lane so far ahead."""


@jit_inline
def comes(see: View, heading: float, still_s: float, within_m: float) -> bool:
    """Tell whether somebody comes towards us: moves against ``heading`` (body frame), ahead of us."""
    shared = see.shared
    course = see.percept["compass"] + heading
    hx, hy = math.cos(course), math.sin(course)
    for t in range(PEERS):
        if not moves(see.percept, shared, t, still_s):
            continue
        x, y = shared["track_x"][t], shared["track_y"][t]
        ahead, aside = x * hx + y * hy, hx * y - hy * x
        against = shared["track_vx"][t] * hx + shared["track_vy"][t] * hy
        fast = math.sqrt(shared["track_vx"][t] ** 2 + shared["track_vy"][t] ** 2)
        if 0.0 < ahead < within_m and abs(aside) < 0.5 * NARROW_M and against < -max(0.1, AGAINST * fast):
            return True
    return False


@jit
def keep_right(see: View, heading: float) -> float:
    """Return the heading that leads into the right half of a narrow place, where two robots have room side by side."""
    c, s = math.cos(heading), math.sin(heading)
    left, right = math.inf, math.inf
    for n in range(see.rig.sensor.beams):
        r = see.masked[n]
        if not r < NARROW_M:
            continue
        ahead = r * (see.rig.cos[n] * c + see.rig.sin[n] * s)
        aside = r * (see.rig.sin[n] * c - see.rig.cos[n] * s)
        if -BEHIND_M < ahead < AHEAD_M:
            if aside > 0.0:
                left = min(left, aside)
            else:
                right = min(right, -aside)
    wide = left + right
    if wide > NARROW_M or wide < 4.0 * see.rig.body.radius_m + 3.0 * BESIDE_M:
        return heading
    off = right - 0.25 * wide
    return heading - math.atan2(off, LOOK_M)
