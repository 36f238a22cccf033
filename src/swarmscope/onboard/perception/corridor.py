"""How far the body gets along one direction."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit_inline
from swarmscope.onboard.rig import Rig


@jit_inline
def corridor_length(ranges: np.ndarray, rig: Rig, bearing: float, half_width: float, limit: float) -> float:
    """Return how far [m] a disc of radius ``half_width`` gets along ``bearing`` before it touches a return.

    At most ``limit``; an invalid beam within 90 degrees of the bearing stops it at once.
    """
    free = limit
    c, s = math.cos(bearing), math.sin(bearing)
    for n in range(ranges.size):
        r = ranges[n]
        ahead = rig.cos[n] * c + rig.sin[n] * s
        if not ahead > 0.0 or r == np.inf:
            continue
        if not r >= rig.sensor.range_min:
            return 0.0
        across = r * (rig.sin[n] * c - rig.cos[n] * s)
        if abs(across) < half_width:
            free = min(free, r * ahead - math.sqrt(half_width * half_width - across * across))
    return max(0.0, free)
