"""What the documents print where this project does otherwise: presets of planners (docs/theory.md)."""

from __future__ import annotations

import math

from swarmscope.bounds import LONGEST_S
from swarmscope.onboard.deciding.waiting import AS_PRINTED

WHOLE_TURN = 2.0 * math.pi


def printed_rules() -> dict[str, float | bool | str]:
    """Return the keys of a scenario that undo what Nav-SCOPE and SFM-MAS do otherwise than their documents."""
    return {
        "safety.sector": True,
        "safety.look_ahead_m": 0.0,
        "safety.speed_step_mps": 0.0,
        "features.filter": "printed",
        "planner.params.prior": 0.0,
        "planner.params.wait_s": LONGEST_S,
        "planner.params.wide_turn": WHOLE_TURN,
        "planner.params.stuck_s": LONGEST_S,
        "planner.params.turn_back": WHOLE_TURN,
        "planner.params.resume_m": 0.0,
        "planner.params.reopen": 0.0,
        "planner.params.loop_m": 0.0,
        "planner.params.repulsion": AS_PRINTED,
        "planner.params.priority": 0,
        "planner.params.escape": 0,
        "planner.params.finish_turns": 0,
        "planner.params.in_place": 1,
    }


def printed_bug() -> dict[str, float | bool | str]:
    """Return the keys of a scenario that undo what DH-Bug's driving does otherwise than GIWT 4.2."""
    return {
        "planner.params.creep": 0.0,
        "planner.params.wait_s": LONGEST_S,
        "planner.params.in_place": 1,
        "planner.params.nearer": 0,
        "planner.params.loops": 0,
    }
