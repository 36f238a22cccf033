"""The LiDAR and the positioning sensor, as a robot's kernels know them."""

from __future__ import annotations

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
