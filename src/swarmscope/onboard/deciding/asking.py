"""Whom to ask for features, and when (Nav-SCOPE IV-B, SFM-MAS IV-B)."""

from __future__ import annotations

import math

from swarmscope._jit import jit_inline, jit_paste
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.percept import MAX_NEIGHBOURS
from swarmscope.onboard.perception.safety import beam_of
from swarmscope.onboard.sharing.inbox import ask, start_round
from swarmscope.onboard.view import View


@jit_paste
def request_ahead(see: View, ahead_s: float, every_s: float) -> None:
    """Ask the neighbours in the pass band for features when an obstacle nears the planning distance."""
    if see.percept["now_s"] - see.shared["asked_s"] < every_s:
        return
    rig = see.rig
    horizon = max(see.margins.l_th, rig.look_ahead) + ahead_s * rig.body.v_max_mps
    if obstacle_ahead(see, horizon):
        ask_neighbours(see)


@jit_inline
def obstacle_ahead(see: View, horizon: float) -> bool:
    """Tell whether on the way to a goal beyond ``horizon`` [m] something stands nearer than that."""
    if see.percept["goal_distance"] <= horizon:
        return False
    sensor, masked = see.rig.sensor, see.masked
    centre = beam_of(see.percept["goal_bearing"], sensor)
    for k in range(-see.rig.half, see.rig.half + 1):
        n = (centre + k) % sensor.beams if sensor.wraps else centre + k
        if 0 <= n < sensor.beams and masked[n] < horizon and masked[n] * abs(
            math.sin(k * sensor.increment)
        ) < see.rig.footprint:
            return True
    return False


@jit_inline
def ask_neighbours(see: View) -> None:
    """Start a round of requests to every neighbour seen now in the pass band (sigma_a, 3 sigma_a]."""
    start_round(see)
    percept, sigma = see.percept, see.rig.protection.sigma_a
    for k in range(min(MAX_NEIGHBOURS, percept["n_neighbours"])):
        x, y = percept["neighbour_x"][k], percept["neighbour_y"][k]
        distance = math.sqrt(x * x + y * y)
        ahead = abs(wrap_angle(math.atan2(y, x) - percept["goal_bearing"])) <= 0.5 * math.pi
        if ahead and sigma - 0.2 < distance <= 3.0 * sigma + 0.2:
            ask(see, percept["neighbour_id"][k])
