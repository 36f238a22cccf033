"""From a robot's data sheet to its protection model (Nav-SCOPE 2 and 18-20; SFM-MAS 1, 2, 16, 17, 23)."""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit
from swarmscope.errors import ConfigError


class Body(NamedTuple):
    """A robot's data sheet. Lengths in m, speeds in m/s and rad/s, times in s."""

    radius_m: float = 0.15
    """Radius of the circumcircle (r_c in Nav-SCOPE 18, r_e in SFM-MAS 16)."""
    half_width_m: float = 0.15
    """Lateral half width r_0."""
    v_max_mps: float = 0.5
    a_max_mps2: float = 2.0
    w_max_radps: float = 2.0
    """Largest turn rate; not published for these robots, ours (common small platforms: 1.8 to 2.8 rad/s)."""
    sensor_delay_s: float = 0.175
    """t_d; 0.175 s reproduces the published r = 0.30 m and sigma_a = 0.90 m."""


class Protection(NamedTuple):
    """The protection model around a robot. Lengths in m, angles in rad."""

    r: float
    l_th: float
    alpha: float
    sigma_a: float
    w_n: float
    s_d: float
    s_b: float


@jit
def delay_distance(v: float, sensor_delay: float) -> float:
    """Return s_d [m], the way made at speed ``v`` during the sensor delay (second term of Nav-SCOPE 18)."""
    return v * sensor_delay


@jit
def braking_distance(v: float, a_max: float) -> float:
    """Return s_b [m], the way made while braking from ``v`` with ``a_max`` (third term of Nav-SCOPE 18)."""
    return v * v / (2.0 * a_max)


@jit
def safety_margin(radius: float, s_d: float, s_b: float) -> float:
    """Return the safety margin r [m] (Nav-SCOPE 18)."""
    return radius + s_d + s_b


@jit
def scope_angle(half_width: float, r: float) -> float:
    """Return the scope angle alpha [rad] (Nav-SCOPE 2)."""
    return math.pi - 2.0 * math.acos(half_width / r)


@jit
def planning_distance(half_width: float, r: float) -> float:
    """Return the planning distance l_th [m] (Nav-SCOPE 2)."""
    return r * r / half_width


@jit
def reference_distance(r: float, s_d: float, s_b: float) -> float:
    """Return sigma_a [m], where repulsion between robots turns into attraction (Nav-SCOPE 19)."""
    return 2.0 * (r + s_d + s_b)


@jit
def following_threshold(r: float, l_th: float, s_d: float, s_b: float) -> float:
    """Return the distance threshold w_n [m] of following, one per scope quadrant (Nav-SCOPE 20)."""
    return 2.0 * (r + l_th) + s_d + s_b


def protection_model(body: Body) -> Protection:
    """Return the protection model of ``body``; raises ConfigError when the data sheet is impossible."""
    for name, value in body._asdict().items():
        if not (math.isfinite(value) and value >= 0.0) or (value == 0.0 and name != "sensor_delay_s"):
            raise ConfigError(f"robot.{name}", f"must be a positive finite number, not {value!r}")
    s_d = delay_distance(body.v_max_mps, body.sensor_delay_s)
    s_b = braking_distance(body.v_max_mps, body.a_max_mps2)
    r = safety_margin(body.radius_m, s_d, s_b)
    if body.half_width_m > r:
        raise ConfigError("robot.half_width_m", f"{body.half_width_m} m is more than the safety margin r = {r:.3f} m")
    l_th = planning_distance(body.half_width_m, r)
    return Protection(
        r=r,
        l_th=l_th,
        alpha=scope_angle(body.half_width_m, r),
        sigma_a=reference_distance(r, s_d, s_b),
        w_n=following_threshold(r, l_th, s_d, s_b),
        s_d=s_d,
        s_b=s_b,
    )
