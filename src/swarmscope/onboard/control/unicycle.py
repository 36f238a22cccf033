"""From a wanted heading to a speed and a turn rate."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline
from swarmscope.geometry import wrap_angle

FULL_SPEED_WITHIN = math.radians(20.0)
"""Heading error up to which a robot drives at full speed."""
TURN_IN_PLACE_BEYOND = math.radians(70.0)
"""Heading error from which it only turns."""


@jit
def steer(heading: float, speed: float, w_max: float, dt: float) -> tuple[float, float]:
    """Return (v [m/s], w [rad/s]) that turns towards ``heading`` (body frame, rad) by the next tick if possible.

    The speed falls linearly from ``speed`` to 0 between the two heading errors above.
    """
    error = wrap_angle(heading)
    w = min(w_max, max(-w_max, error / dt))
    slack = (TURN_IN_PLACE_BEYOND - abs(error)) / (TURN_IN_PLACE_BEYOND - FULL_SPEED_WITHIN)
    return speed * min(1.0, max(0.0, slack)), w


@jit
def arrival_speed(distance: float, v_max: float, a_max: float, dt: float) -> float:
    """Return the largest speed [m/s] from which a robot still stops within ``distance`` after one more tick."""
    if distance <= 0.0:
        return 0.0
    reach = a_max * dt
    return min(v_max, math.sqrt(reach * reach + 2.0 * a_max * distance) - reach)


@jit_inline
def ramp(speed: float, wanted: float, a_max: float, dt: float) -> tuple[float, float]:
    """Return (speed after ``dt`` [m/s], way made [m]) of a speed that goes to ``wanted`` as ``a_max`` lets it."""
    change = wanted - speed
    t = min(dt, abs(change) / a_max)
    after = speed + (t * a_max if change > 0.0 else -t * a_max)
    return after, 0.5 * (speed + after) * t + after * (dt - t)
