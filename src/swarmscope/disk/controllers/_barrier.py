"""The last word before a robot moves: the admissible velocity that is nearest to the one it wishes for.

A control-barrier-function program in discrete time. Its constraints are half planes ``n u <= room``:

* another robot at distance d: n points to it, ``room = gain (d - 2 r) / 2``: each of the two may use up less than
  half of the gap, so that together they leave a part of it whatever the other does within its own constraint;
* an obstacle: n points to its centre, ``room = gain (d - R - r)``; n u bounds how much nearer one can get on a
  straight line, because a disc is convex;
* the rim, which is not convex seen from inside: ``room = sqrt(1 - s^2) - |x|`` for steps of length s.

All in lengths per step. Standing still obeys the first two always, so the program is never infeasible for them; where
the rim's constraint makes it so, or leaves only what is too fast, the robot stands, which cannot collide either. So
from a start without contact there is no contact in any step nor between steps, whatever the wishes, if all robots obey
this.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit
from swarmscope.disk.rules import Floats

KEPT = 1e-6
"""Gaps are used up to this, so that rounding cannot close them."""
SLACK = 1e-12
MOST = 32
"""Half planes that fit the scratch; who is within a step of more things (obstacles drawn many times over) stands."""


@jit
def nearest_admissible(
    i: int, ux: float, uy: float, state: Floats, disc: Floats, r: float, stride: float, gain: float, planes: Floats
) -> tuple[float, float]:
    """Return the admissible velocity of robot i that is nearest to u, in units of v_max.

    Args:
        i: the robot.
        ux, uy: the wish, at most 1 long.
        state: (n, 2) positions of all robots now.
        disc: (m, 3) obstacles: x, y, R.
        r: radius of robots.
        stride: way in a step at full speed.
        gain: part of the room that one step may use, below 1.
        planes: (MOST, 3) scratch.
    """
    count = _half_planes(i, state, disc, r, stride, gain, planes)
    if count > MOST:
        return 0.0, 0.0
    if _worst(ux, uy, planes, count) <= SLACK:
        return ux, uy
    least, bx, by = math.inf, 0.0, 0.0
    for k in range(count):
        nx, ny, room = planes[k, 0], planes[k, 1], planes[k, 2]
        over = ux * nx + uy * ny - room
        if over <= 0.0:
            continue
        px, py = ux - over * nx, uy - over * ny
        if over * over < least and _worst(px, py, planes, count) <= SLACK:
            least, bx, by = over * over, px, py
    if least < math.inf:
        return _cut(bx, by, state[i, 0], state[i, 1], stride)
    for k in range(count):
        for m in range(k):
            turn = planes[k, 0] * planes[m, 1] - planes[k, 1] * planes[m, 0]
            if abs(turn) < 1e-9:
                continue
            px = (planes[k, 2] * planes[m, 1] - planes[m, 2] * planes[k, 1]) / turn
            py = (planes[m, 2] * planes[k, 0] - planes[k, 2] * planes[m, 0]) / turn
            away = (px - ux) * (px - ux) + (py - uy) * (py - uy)
            if away < least and _worst(px, py, planes, count) <= SLACK:
                least, bx, by = away, px, py
    return _cut(bx, by, state[i, 0], state[i, 1], stride)


@jit
def _cut(ux: float, uy: float, x: float, y: float, stride: float) -> tuple[float, float]:
    """Return u cut to length 1, or 0 where that would leave the disk.

    At the rim 0 is not admissible and what is can be longer than 1; a part of it obeys all but the rim.
    """
    size = math.sqrt(ux * ux + uy * uy)
    if size <= 1.0:
        return ux, uy
    ux, uy = ux / size, uy / size
    if math.hypot(x + stride * ux, y + stride * uy) > 1.0 + SLACK:
        return 0.0, 0.0
    return ux, uy


@jit
def _half_planes(i: int, state: Floats, disc: Floats, r: float, stride: float, gain: float, planes: Floats) -> int:
    """Write the half planes that can matter in this step; return their number, MOST + 1 for too many."""
    x, y = state[i, 0], state[i, 1]
    count = 0
    for j in range(len(state)):
        px, py = state[j, 0] - x, state[j, 1] - y
        near = 2.0 * r + 2.0 * stride / gain + KEPT
        if j == i or abs(px) > near or abs(py) > near:
            continue
        apart = math.sqrt(px * px + py * py)
        room = 0.5 * gain * max(0.0, apart - 2.0 * r - KEPT) / stride
        if room < 1.0:
            if count >= MOST - 1:
                return MOST + 1
            planes[count, 0], planes[count, 1], planes[count, 2] = px / apart, py / apart, room
            count += 1
    for m in range(len(disc)):
        px, py = disc[m, 0] - x, disc[m, 1] - y
        near = disc[m, 2] + r + stride / gain + KEPT
        if abs(px) > near or abs(py) > near:
            continue
        apart = math.sqrt(px * px + py * py)
        room = gain * max(0.0, apart - disc[m, 2] - r - KEPT) / stride
        if room < 1.0:
            if count >= MOST - 1:
                return MOST + 1
            planes[count, 0], planes[count, 1], planes[count, 2] = px / apart, py / apart, room
            count += 1
    apart = math.sqrt(x * x + y * y)
    if apart + stride > math.sqrt(1.0 - stride * stride):
        room = (math.sqrt(1.0 - stride * stride) - apart) / stride
        planes[count, 0], planes[count, 1], planes[count, 2] = x / apart, y / apart, room
        count += 1
    return count


@jit
def _worst(ux: float, uy: float, planes: Floats, count: int) -> float:
    worst = 0.0
    for k in range(count):
        worst = max(worst, ux * planes[k, 0] + uy * planes[k, 1] - planes[k, 2])
    return worst
