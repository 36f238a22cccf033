"""What a planner asks the wheels for; the guard has the last word on it."""

from __future__ import annotations

import math

from swarmscope._jit import jit_paste
from swarmscope.onboard.control.unicycle import steer
from swarmscope.onboard.view import View

FACES_WITHIN = math.radians(10.0)
"""A robot that does not drive while it turns has turned when its heading is off by less."""


@jit_paste
def halt(see: View) -> None:
    """Ask for standing still, headed as we are."""
    see.out["heading"], see.out["v"], see.out["w"] = 0.0, 0.0, 0.0


@jit_paste
def head_for(see: View, heading: float, speed: float) -> None:
    """Ask for driving towards ``heading`` (body frame, rad) at ``speed`` [m/s] once turned."""
    see.out["heading"] = heading
    see.out["v"], see.out["w"] = steer(heading, speed, see.rig.body.w_max_radps, see.percept["dt_s"])


@jit_paste
def turn_first(see: View) -> None:
    """Ask for standing as long as the robot has not turned to where it is to drive."""
    if abs(see.out["heading"]) > FACES_WITHIN:
        see.out["v"] = 0.0
