"""The LiDAR and the positioning sensor, as a robot's kernels know them."""

from __future__ import annotations

import math
from typing import NamedTuple


class Sensor(NamedTuple):
    """Beam n looks at ``angle_min + n * increment`` [rad], body frame, counter-clockwise."""

    beams: int
    angle_min: float
    increment: float
    wraps: bool
    """Whether the last beam is the first one's neighbour (full circle)."""
    range_min: float
    range_max: float
    range_sigma: float
    """Standard deviation of a LiDAR range as a fraction of it."""
    position_sigma: float
    """Standard deviation of a neighbour's measured position as a fraction of its distance."""
    first: int = 0
    """The first beam that the LiDAR itself fills, ..."""
    field: int = 0
    """... and how many it fills; the rest is remembered (``perception/frames.py``). 0: all, nothing is."""


def all_round(sensor: Sensor) -> Sensor:
    """Return a sensor of the full circle, with ``sensor``, of a limited field of view, as a part of it.

    The circle ends opposite to the field's middle; there two beams may lie up to two increments apart.
    """
    if sensor.wraps:
        return sensor
    beams = int(2.0 * math.pi / sensor.increment + 1e-6)
    if beams <= sensor.beams:  # nothing fits between the last and the first
        return sensor._replace(wraps=True)
    first = (beams - sensor.beams) // 2
    return sensor._replace(
        beams=beams,
        angle_min=sensor.angle_min - first * sensor.increment,
        wraps=True,
        first=first,
        field=sensor.beams,
    )
