"""The beams of a 2D lidar: which way they look and how far."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from swarmscope.errors import ConfigError

Ranges = npt.NDArray[np.float32]


class Beams(NamedTuple):
    """The beams of a lidar; beam n looks at ``angle_min + n * increment`` [rad], sensor frame, CCW."""

    cos: npt.NDArray[np.float64]
    """(M,)"""
    sin: npt.NDArray[np.float64]
    """(M,)"""
    angle_min: float
    increment: float
    wraps: bool
    """True for a full circle: the beam after the last is the first."""
    range_max: float
    """Longest range [m]."""


def make_beams(beams: int, fov_rad: float, range_max_m: float) -> Beams:
    """Return ``beams`` directions over ``fov_rad``: a full circle from -pi, or a field with its edges."""
    if beams < 2:
        raise ConfigError("lidar.beams", f"must be at least 2, got {beams}")
    if not 0.0 < fov_rad <= 2.0 * math.pi + 1e-9:
        raise ConfigError("lidar.fov_rad", f"must be above 0 and at most 2 pi, got {fov_rad}")
    if not 0.0 < range_max_m < math.inf:
        raise ConfigError("lidar.range_max_m", f"must be above 0 and finite, got {range_max_m}")
    wraps = fov_rad >= 2.0 * math.pi - 1e-9
    angle_min = -math.pi if wraps else -0.5 * float(fov_rad)
    increment = 2.0 * math.pi / beams if wraps else float(fov_rad) / (beams - 1)
    angles = angle_min + np.arange(beams) * increment
    return Beams(np.cos(angles), np.sin(angles), angle_min, increment, wraps, float(range_max_m))
