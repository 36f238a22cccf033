"""Robots that nobody sees yet: whether a way leaves room for one at every place from which it could come.

Behind the edge of a thing there may be a robot, where its whole body is hidden. The nearest such place at an edge is
looked for in the scan; the rule between two robots (docs/safety.md) then holds for a body there as for one in view.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit_inline, jit_inner
from swarmscope.onboard.control.halves import Others, bulge_beyond, leaves_half, met_by
from swarmscope.onboard.control.way import Way, corner_of
from swarmscope.onboard.perception.beams import beam_at
from swarmscope.onboard.rig import SIGMAS, Rig
from swarmscope.onboard.view import View


class Corner(NamedTuple):
    """A return past which it opens, in the frame of the first line of sight past it: along, and into the shadow."""

    c: float
    """Direction of that line, body frame."""
    s: float
    side: float
    """1: it opens to the left of the return."""
    x: float
    y: float
    keeps: float
    """What centres keep off the corner [m]."""


class Round(NamedTuple):
    """The shortest way round a corner, in the frame of that corner."""

    length: float
    first: float
    """Length of what leads straight up to the arc; of a way that is straight, to where it passes the corner."""
    arc: float
    """How far it turns round the corner [rad]."""
    near: float
    """Radius of the arc; 0: the way is straight."""
    c: float
    """Direction from the corner to where the arc begins, or the way passes."""
    s: float


@jit_inline
def other_robots(v: float, dt: float, rig: Rig) -> Others:
    """Return what there is to know of other robots for one that is to drive at ``v`` [m/s]."""
    guarding = rig.guarding
    met = 0.0 if guarding.others_yield else met_by(guarding.others_mps, v, dt, rig)
    return Others(guarding.others_smallest_m, _kept_off(rig), apart_round(rig), guarding.others_yield, met)


@jit_inline
def strangers(v: float, dt: float, rig: Rig) -> Others:
    """Return the same of those that are no robots and do not yield: they may rub against a corner."""
    radius, own = rig.guarding.strangers_m, rig.body.radius_m + rig.guarding.clearance_m
    near = min(own, radius)
    touch = touch_round(own, radius, rig.body.radius_m + radius, near)
    return Others(radius, near, touch, False, met_by(rig.guarding.strangers_mps, v, dt, rig))


@jit_inline
def matters_up_to(way: Way, others: Others) -> float:
    """Return from how far along a line of sight on others do not matter for a way [m], measured from this robot."""
    most = math.sqrt(way.x5 * way.x5 + way.y5 * way.y5) + way.brake
    if way.turns:
        most = way.reach + way.brake + way.bulge
    return others.touch + max(2.0 * most, most + others.met)


@jit_inline
def out_of_hidden_halves(see: View, n: int, way: Way, others: Others, enough: float) -> bool:
    """Tell whether a way leaves room for all who may be hidden past the return of beam n, as they matter.

    ``enough`` [m] as in `matters_up_to`.
    """
    if _nearer(see.rig) * see.scan[n] >= enough:
        return True
    return _clear_past(see, n, 1, way, others, enough) and _clear_past(see, n, -1, way, others, enough)


@jit_inline
def _kept_off(rig: Rig) -> float:
    """Return what the centres of all robots keep off a corner [m]: those that do not yield may rub against it."""
    return rig.guarding.others_smallest_m + (rig.guarding.clearance_m if rig.guarding.others_yield else 0.0)


@jit_inline
def apart_round(rig: Rig) -> float:
    """Return from which distance on two robots do not touch, measured round a corner that both keep off [m].

    Bodies that touch lie at the ends of a chord of the circle that both keep off. Where radii differ each keeps
    off what suits its own, and lengths are those round what suits the smallest.
    """
    keeps, own, smallest = _kept_off(rig), rig.body.radius_m, rig.guarding.others_smallest_m
    if smallest == own and smallest == rig.guarding.others_largest_m:
        return 2.0 * keeps * math.asin(own / keeps)
    spare = keeps - smallest
    small, large = smallest + spare, rig.guarding.others_largest_m + spare
    nearest = touch_round(own + spare, small, own + smallest, keeps)
    return max(nearest, touch_round(own + spare, large, own + rig.guarding.others_largest_m, keeps))


@jit_inline
def touch_round(p: float, q: float, apart: float, near: float) -> float:
    """Return the way round a disc of radius ``near`` between points ``p`` and ``q`` off its middle, ``apart`` [m]."""
    turn = math.acos(min(1.0, max(-1.0, (p * p + q * q - apart * apart) / (2.0 * p * q))))
    arc = turn - math.acos(near / p) - math.acos(near / q)
    if arc <= 0.0:
        return apart
    return math.sqrt(p * p - near * near) + math.sqrt(q * q - near * near) + near * arc


@jit_inline
def _nearer(rig: Rig) -> float:
    """Return at which share of its range a return may be."""
    return max(0.5, 1.0 - SIGMAS * rig.sensor.range_sigma)


@jit_inner
def _opens(ranges: np.ndarray, n: int, side: int, width: float, rig: Rig) -> bool:
    """Tell whether what is so wide [m] has room between beam n's return and that of the next beam, farther away."""
    m = beam_at(n + side, rig.sensor)
    if m < 0 or not ranges[m] > ranges[n]:
        return False
    far = (1.0 + SIGMAS * rig.sensor.range_sigma) * ranges[m]
    if not far < rig.sensor.range_max:
        return True
    near = ranges[n] * (1.0 - SIGMAS * rig.sensor.range_sigma)
    if far - near + near * rig.sensor.increment < width:
        return False  # nearly always
    gap2 = near * near + far * far - 2.0 * near * far * math.cos(rig.sensor.increment)
    return bool(gap2 >= width * width)


@jit_inner
def _clear_past(see: View, n: int, side: int, way: Way, others: Others, enough: float) -> bool:
    """Apply the rule before others to a body hidden past the return of beam n on a side, if it opens there.

    Both have to go round the corner, so lengths are those of ways round it.
    """
    rig, radius = see.rig, others.smallest
    if not _opens(see.scan, n, side, 2.0 * (radius + (rig.guarding.clearance_m if others.yield_ else 0.0)), rig):
        return True
    along = hidden_at(see, n, side, radius, enough)
    if along >= enough:
        return True
    m, near, turned = beam_at(n + side, rig.sensor), _nearer(rig) * see.scan[n], rig.sensor.increment
    corner = Corner(rig.cos[m], rig.sin[m], float(side), near * math.cos(turned), near * math.sin(turned), others.keeps)
    along = max(along, corner.x + others.keeps)  # there it is the shortest way
    past = way_round(along, radius, corner)
    moved, stopped = come_along(way.x4, way.y4, past, corner), come_along(way.x5, way.y5, past, corner)
    towards, free = max(moved, stopped), past.length - others.touch
    if way.turns:
        for piece in range(3):
            x, y = corner_of(way, piece)
            towards = max(towards, come_along(x, y, past, corner))
        towards += bulge_beyond(way, free, rig.guarding.clearance_m)
    return leaves_half(towards, stopped - moved, free, others)


@jit_inline
def way_round(along: float, beside: float, corner: Corner) -> Round:
    """Return the shortest way from here to (along, beside) behind a corner: tangent, arc, tangent, or straight."""
    x, y = -corner.x, -corner.y
    far = along - corner.x, beside - corner.y
    d, e = math.sqrt(x * x + y * y), math.sqrt(far[0] * far[0] + far[1] * far[1])
    near = min(corner.keeps, d, e)
    if near > 1e-9:
        begin, end = math.atan2(y, x), math.atan2(far[1], far[0])
        if begin > 0.5 * math.pi:
            begin -= 2.0 * math.pi
        begin += math.acos(min(1.0, near / d))
        arc = end - math.acos(min(1.0, near / e)) - begin
        if arc > 0.0:
            first, last = math.sqrt(d * d - near * near), math.sqrt(e * e - near * near)
            return Round(first + near * arc + last, first, arc, near, math.cos(begin), math.sin(begin))
    length = math.sqrt((far[0] - x) ** 2 + (far[1] - y) ** 2)
    if length < 1e-9:
        return Round(0.0, 0.0, 0.0, 0.0, 0.0, -1.0)
    c, s = (far[1] - y) / length, (x - far[0]) / length  # its left: the way turns to the right of the corner's frame
    return Round(length, x * s - y * c, 0.0, 0.0, c, s)


@jit_inline
def come_along(qx: float, qy: float, way: Round, corner: Corner) -> float:
    """Return how far along a way round a corner its place nearest to (qx, qy), body frame, is [m]."""
    x = qx * corner.c + qy * corner.s - corner.x
    y = corner.side * (qx * corner.s - qy * corner.c) - corner.y
    off, on = x * way.c + y * way.s, y * way.c - x * way.s
    hidden = x > 0.0 and y > 0.0
    if way.near == 0.0 or (on <= 0.0 and not hidden):
        return way.first + on
    turned = math.atan2(on, off)
    if turned < 0.0:
        turned += 2.0 * math.pi
    if turned <= way.arc:
        return way.first + way.near * turned
    return way.first + way.near * way.arc + math.sqrt(x * x + y * y) * math.sin(turned - way.arc)


@jit_inline
def hidden_at(see: View, n: int, side: int, radius: float, enough: float) -> float:
    """Return how far along the line of sight past an edge the centre of a body is that touches it and is hidden [m].

    ``radius`` is the body's [m].

    Beams that the body would cross have to end before it, those at least that show where they end. Beyond ``enough``
    [m] it does not matter.
    """
    rig, ranges = see.rig, see.scan
    increment = rig.sensor.increment
    nearer = _nearer(rig)
    along: float = nearer * ranges[n]
    c1, s1 = math.cos(increment), math.sin(increment)
    c, s = 1.0, 0.0
    k = 1
    while along < enough and k < rig.sensor.beams:
        c, s = c * c1 - s * s1, s * c1 + c * s1  # of k increments
        off = along * s - radius * c
        if off >= radius:
            break
        m = beam_at(n + side - side * k, rig.sensor)
        if m >= 0 and _shows_its_end(see, m):
            along = max(along, _before(nearer * ranges[m], c, s, radius))
        k += 1
    return along


@jit_inline
def _shows_its_end(see: View, m: int) -> bool:
    """Tell whether beam m says how far one sees: not past what may be hidden, nor open out of view: nobody looks."""
    if see.hidden[m] < see.scan[m]:
        return False
    in_view = see.rig.sensor.field == 0 or see.shared["view_first"] <= m <= see.shared["view_last"]
    return bool(in_view or see.scan[m] < see.rig.sensor.range_max)


@jit_inline
def _before(end: float, c: float, s: float, radius: float) -> float:
    """Return the least way along at which a body does not reach into a beam (c, s) that ends at range ``end``."""
    misses = radius * (1.0 + c) / s  # as far along the beam as along the line of sight: both are tangents
    off = end * s - radius
    if not end < misses or off >= radius:
        return misses
    return min(misses, end * c + math.sqrt(radius * radius - off * off))
