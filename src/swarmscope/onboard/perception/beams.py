"""Which beam looks at a point: what `math.atan2` says, found without it nearly always, several times faster."""

from __future__ import annotations

import math

from swarmscope._jit import jit_inline
from swarmscope.geometry import ROUGH, rough_angle
from swarmscope.onboard.sensor import Sensor


@jit_inline
def nearest_beam(x: float, y: float, turned: float, sensor: Sensor) -> int:
    """Return the beam of a full circle that looks nearest to the point (x, y), were the robot ``turned`` [rad].

    ``turned`` lies within a turn. Where the rough angle is near the border of two beams `math.atan2` decides.
    """
    beams = sensor.beams
    offset = (rough_angle(x, y) - turned - sensor.angle_min) * (1.0 / sensor.increment) + 0.5
    slack = ROUGH / sensor.increment + 1e-9
    whole = math.floor(offset)
    if not (slack < offset - whole < 1.0 - slack and y != 0.0 and -beams <= whole < 2 * beams):
        return int(math.floor((math.atan2(y, x) - turned - sensor.angle_min) / sensor.increment + 0.5)) % beams
    n = int(whole)
    if n < 0:
        return n + beams
    return n - beams if n >= beams else n


@jit_inline
def beam_at(n: int, sensor: Sensor) -> int:
    """Return the beam of number ``n``, counted on round a closed circle, -1 where there is none."""
    if 0 <= n < sensor.beams:
        return n
    return n % sensor.beams if sensor.wraps else -1


@jit_inline
def lies_between(x: float, y: float, first: int, last: int, sensor: Sensor) -> bool:
    """Tell whether the point (x, y), body frame, lies between beams ``first`` and ``last``."""
    offset = (rough_angle(x, y) - sensor.angle_min) * (1.0 / sensor.increment)
    slack = ROUGH / sensor.increment + 1e-9
    if slack < offset and abs(offset - first) > slack and abs(offset - last) > slack and y != 0.0:
        return first <= offset <= last
    beam = (math.atan2(y, x) - sensor.angle_min) / sensor.increment
    if beam < 0.0:
        beam += 2.0 * math.pi / sensor.increment
    return bool(first <= beam <= last)
