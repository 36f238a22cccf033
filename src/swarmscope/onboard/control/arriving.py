"""The last turn: a robot that has arrived turns to the heading that is wanted at its goal, whatever its planner."""

from __future__ import annotations

from swarmscope._jit import jit_inline
from swarmscope.onboard.reasons import ADVANCE, ARRIVED, R_TURNS
from swarmscope.onboard.view import View

TURNED_RAD = 0.035
"""So near to the heading is near enough, 2 degrees."""


@jit_inline
def turn_at_goal(see: View) -> None:
    """Let a robot that says that it has arrived turn to ``goal_turn`` before it has."""
    turn = see.percept["goal_turn"]
    if see.out["state"] == ARRIVED and abs(turn) > TURNED_RAD:  # not where it is NaN: any heading will do
        fastest, dt = see.rig.body.w_max_radps, see.percept["dt_s"]
        see.out["v"], see.out["w"] = 0.0, min(fastest, max(-fastest, turn / dt))
        see.out["state"], see.out["reason"] = ADVANCE, R_TURNS
