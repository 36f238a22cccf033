"""Whom to ask for features, and when (Nav-SCOPE IV-B, SFM-MAS IV-B)."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.percept import Rig, Row
from swarmscope.onboard.perception.safety import beam_of
from swarmscope.onboard.sharing.inbox import ask, start_round


@jit
def request_ahead(
    masked: np.ndarray, percept: Row, shared: Row, decision: Row, rig: Rig, ahead_s: float, every_s: float
) -> None:
    """Ask the neighbours in the pass band for features when an obstacle nears the planning distance."""
    now = percept["now_s"]
    if now - shared["asked_s"] < every_s:
        return
    horizon = max(rig.protection.l_th, rig.look_ahead) + ahead_s * rig.body.v_max_mps
    if obstacle_ahead(masked, percept, rig, horizon):
        ask_neighbours(percept, shared, decision, rig)


@jit
def obstacle_ahead(masked: np.ndarray, percept: Row, rig: Rig, horizon: float) -> bool:
    """Tell whether on the way to a goal beyond ``horizon`` [m] something stands nearer than that."""
    if percept["goal_distance"] <= horizon:
        return False
    sensor = rig.sensor
    centre = beam_of(percept["goal_bearing"], sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
    for k in range(-rig.half, rig.half + 1):
        n = (centre + k) % sensor.beams if sensor.wraps else centre + k
        if 0 <= n < sensor.beams and masked[n] < horizon and masked[n] * abs(
            math.sin(k * sensor.increment)
        ) < rig.footprint:
            return True
    return False


@jit
def ask_neighbours(percept: Row, shared: Row, decision: Row, rig: Rig) -> None:
    """Start a round of requests to every neighbour seen now in the pass band (sigma_a, 3 sigma_a]."""
    start_round(percept, shared)
    sigma = rig.protection.sigma_a
    for k in range(percept["n_neighbours"]):
        x, y = percept["neighbour_x"][k], percept["neighbour_y"][k]
        distance = math.sqrt(x * x + y * y)
        ahead = abs(wrap_angle(math.atan2(y, x) - percept["goal_bearing"])) <= 0.5 * math.pi
        if ahead and sigma - 0.2 < distance <= 3.0 * sigma + 0.2:
            ask(percept, shared, decision, percept["neighbour_id"][k])
