"""What a planner asks the wheels for; the guard has the last word on it."""

from __future__ import annotations

from swarmscope._jit import jit_paste
from swarmscope.onboard.control.unicycle import steer
from swarmscope.onboard.view import View


@jit_paste
def halt(see: View) -> None:
    """Ask for standing still, headed as we are."""
    see.out["heading"], see.out["v"], see.out["w"] = 0.0, 0.0, 0.0


@jit_paste
def head_for(see: View, heading: float, speed: float) -> None:
    """Ask for driving towards ``heading`` (body frame, rad) at ``speed`` [m/s] once turned."""
    see.out["heading"] = heading
    see.out["v"], see.out["w"] = steer(heading, speed, see.rig.body.w_max_radps, see.percept["dt_s"])
