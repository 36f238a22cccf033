"""How fast a robot may be for what it can see at most: beyond its horizon anything may stand or come."""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inline
from swarmscope.onboard.sensor import Sensor

WIDER = 1.001
"""A gap that is no wider than so many increments is one."""


class Horizon(NamedTuple):
    """How near things can be without having been seen [m], from the robot's centre to their surface."""

    things: float
    """Standing ones that are as narrow as ``Guarding.thinnest_m``."""
    robots: float
    """Other robots, the smallest of them."""
    strangers: float
    """Those that do not yield, the smallest of them."""


def horizon_of(
    smallest_m: float, strangers_m: float, sensor: Sensor, thinnest_m: float, gap: float = 0.0
) -> Horizon:
    """Return the horizon of a sensor: its range, or nearer where something fits between two beams.

    The first and the last of a circle may be farther apart than the others, ``gap`` [rad] if it says more than the
    sensor. ``smallest_m`` and ``strangers_m`` are the radii of the smallest other robot, and of the smallest that does
    not yield [m].
    """
    apart = sensor.increment
    if sensor.wraps and sensor.field == 0:
        gap = max(gap, 2.0 * math.pi - (sensor.beams - 1) * sensor.increment)
    if gap > WIDER * apart:
        apart = gap
    if apart >= math.pi:
        return Horizon(0.0, 0.0, 0.0)
    between = 2.0 * math.sin(0.5 * apart)
    things = thinnest_m / between - 0.5 * thinnest_m if thinnest_m > 0.0 else math.inf
    robots = 2.0 * smallest_m / between - smallest_m
    strangers = 2.0 * strangers_m / between - strangers_m
    return Horizon(*(min(sensor.range_max, reach) for reach in (things, robots, strangers)))


@jit_inline
def speed_within(way: float, delay: float, per_v2: float) -> float:
    """Return the largest v [m/s] with ``delay`` v + ``per_v2`` v^2 <= ``way`` [m]; 0 where there is no way."""
    if not way > 0.0:
        return 0.0
    return (math.sqrt(delay * delay + 4.0 * per_v2 * way) - delay) / (2.0 * per_v2)


@jit
def horizon_speed(free_things: float, free_robots: float, delay: float, a_max: float, stranger: float) -> float:
    """Return the largest speed [m/s] at which a robot stops within what it sees at most.

    ``free_things`` and ``free_robots`` [m] are the horizon less radius and clearance, ``delay`` [s] is what passes
    until the next command works. x + b <= free of things. Of robots x + 2 b <= half of what is free when they yield;
    from ``stranger`` [m/s] > 0 that does not, the robot stands before it is there: x + b + stranger t <= free.
    An infinite ``free_robots`` means that nothing else moves.
    """
    speed = speed_within(free_things, delay, 0.5 / a_max)
    if free_robots == math.inf:
        return speed
    if stranger > 0.0:
        left = free_robots - stranger * delay
        return min(speed, speed_within(left, delay + stranger / a_max, 0.5 / a_max))
    return min(speed, speed_within(0.5 * free_robots, delay, 1.0 / a_max))
