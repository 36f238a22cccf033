"""The speed that a scan allows in one direction: GIWT (1) and (2)."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline
from swarmscope.onboard.rig import Rig


@jit
def safe_sector(r_protect: float, v_max: float, dt: float) -> tuple[float, float]:
    """Return (r_safe [m], theta_sec / 2 [rad]): the sector that a disc of ``r_protect`` [m] sweeps within ``dt`` [s].

    r_safe = r_protect + v_max dt; theta_sec = 2 arctan(r_protect / (v_max dt)), pi when it does not move.
    """
    way = v_max * dt
    return r_protect + way, math.atan2(r_protect, way)


@jit_inline
def safe_distance(theta: float, r_safe: float, half_sector: float) -> float:
    """Return l(theta) [m] (1): how far the safe zone reaches at ``theta`` [rad] from the direction of travel.

    The arc of radius ``r_safe`` within the sector; beside it the line parallel to the direction of travel
    through the end of the arc. For |theta| up to pi / 2: (2) looks no further back.
    """
    off = abs(theta)
    if off <= half_sector:
        return r_safe
    return r_safe * math.sin(half_sector) / math.sin(off)


@jit_inline
def safe_speed(ranges: np.ndarray, rig: Rig, heading: float, dt: float, view: float = 0.5 * math.pi) -> float:
    """Return the largest speed [m/s] towards ``heading`` [rad, body frame] by (2).

    min over |theta| < pi / 2 of sqrt(2 a_max (d(theta) - l(theta))) / cos(theta), at most v_max; 0 as soon as a return
    is inside the safe zone of the footprint. ``ranges (M,)`` [m]. An invalid beam counts as range 0. ``view`` [rad]:
    only returns up to so far from ``heading`` count; pi / 2 as printed.
    """
    v_max, a_max = rig.body.v_max_mps, rig.body.a_max_mps2
    r_safe, half = safe_sector(rig.footprint, v_max, dt)
    far = r_safe + v_max * v_max / (2.0 * a_max)  # from here on a beam straight ahead allows v_max
    c, s = math.cos(heading), math.sin(heading)
    least = max(1e-9, math.cos(view))
    speed = v_max
    for n in range(ranges.size):
        ahead = rig.cos[n] * c + rig.sin[n] * s
        if ahead <= least or ranges[n] >= far:
            continue
        if not ranges[n] >= rig.sensor.range_min:
            return 0.0
        theta = math.acos(min(1.0, ahead))
        slack = ranges[n] - safe_distance(theta, r_safe, half)
        if slack <= 0.0:
            return 0.0
        speed = min(speed, math.sqrt(2.0 * a_max * slack) / ahead)
    return speed
