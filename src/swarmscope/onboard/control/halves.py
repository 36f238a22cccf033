"""The rules between a robot and whoever else moves: halves of the gap, or standing in time (docs/safety.md)."""

from __future__ import annotations

from typing import NamedTuple

from swarmscope._jit import jit_inline
from swarmscope.onboard.control.way import Way
from swarmscope.onboard.rig import Rig


class Others(NamedTuple):
    """Who may come, and the rule that holds before them."""

    smallest: float
    """Radius of the smallest of them [m]."""
    keeps: float
    """What the centres of them and of this robot keep off a corner [m]."""
    touch: float
    """From which distance on two bodies do not touch, measured round a corner [m]."""
    yield_: bool
    """Whether they keep to their half."""
    met: float
    """How far one that does not yield comes until this robot stands [m]."""


@jit_inline
def met_by(speed: float, v: float, dt: float, rig: Rig) -> float:
    """Return how far one that does not yield, at ``speed`` [m/s], comes until a robot that drives at ``v`` stands."""
    return speed * (dt + rig.guarding.latency_s + v / rig.body.a_max_mps2)


@jit_inline
def bulge_beyond(way: Way, free: float, clearance: float) -> float:
    """Return how far a way bulges out of its pieces beyond its half of the ``clearance``, which covers it else [m].

    Of a clearance that is not whole, ``free`` below 0, it covers a sixteenth of what is left: so that is never used up.
    """
    covered = 0.5 * clearance if free >= 0.0 else max(0.0, clearance + free) / 16.0
    return max(0.0, way.bulge - covered)


@jit_inline
def leaves_room(px: float, py: float, s: float, way: Way, others: Others, rig: Rig) -> bool:
    """Tell whether a way leaves another its half of the gap to (px, py), or ends before one that does not yield comes.

    (px, py) is the nearest known point of its body at range ``s``.
    """
    if s <= 1e-6:
        return way.x5 * way.x5 + way.y5 * way.y5 < 1e-9
    nx, ny = px / s, py / s
    moved = way.x4 * nx + way.y4 * ny
    stopped = way.x5 * nx + way.y5 * ny
    towards, free = max(moved, stopped), s - rig.body.radius_m - rig.guarding.clearance_m
    if way.turns:
        before = max(way.x1 * nx + way.y1 * ny, way.x2 * nx + way.y2 * ny, way.x3 * nx + way.y3 * ny)
        towards = max(towards, before) + bulge_beyond(way, free, rig.guarding.clearance_m)
    return leaves_half(towards, stopped - moved, free, others)


@jit_inline
def leaves_half(towards: float, braking: float, free: float, others: Others) -> bool:
    """Tell whether a way leaves another robot its half of what is ``free`` between the two [m]; braking counts twice.

    It comes nearer by ``towards`` at most, wherever on it that is: a way that turns may be nearest in its middle. Of
    that ``braking`` is made after the next tick. Before one that does not yield the robot stands before it is reached,
    and a robot that drives away from it would be caught up with.
    """
    if not others.yield_:
        return towards + others.met <= free
    if towards <= 1e-6:
        return True
    return towards + max(0.0, braking) <= 0.5 * free
