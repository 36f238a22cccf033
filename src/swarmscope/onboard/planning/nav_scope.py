"""Nav-SCOPE: advance while the target direction is safe; else choose a side with the neighbours' help and follow.

The four states of Nav-SCOPE V-A with what the paper leaves open: a final approach to goals near obstacles,
an end to every wait, and an end to every loop (docs/safety.md).
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from swarmscope._jit import jit_inline
from swarmscope.bounds import Bounds, Flag, Metres, Radians, Seconds, Weight
from swarmscope.onboard.control.wanting import turn_first
from swarmscope.onboard.deciding.asking import request_ahead
from swarmscope.onboard.deciding.choosing import Manner, decide_side
from swarmscope.onboard.deciding.following import advance, bordering_of, follow, reconsider
from swarmscope.onboard.deciding.memory import MEMORY, new_memory
from swarmscope.onboard.deciding.printed import printed_rules
from swarmscope.onboard.deciding.progress import (
    arrive,
    goal_is_free,
    is_final,
    last_speed,
    may_leave,
    watch_progress,
)
from swarmscope.onboard.deciding.waiting import gives_way, repulsion_of, wait
from swarmscope.onboard.percept import Row
from swarmscope.onboard.planners import Variant
from swarmscope.onboard.reasons import ARRIVED, FOLLOW, R_FINAL, R_FREE
from swarmscope.onboard.tick import share
from swarmscope.onboard.view import View

__all__ = ["MEMORY", "NAME", "NEEDS", "PRESETS", "SUMMARY", "VARIANTS", "Params", "decide", "new_memory"]

NAME = "nav-scope"
SUMMARY = "Nav-SCOPE: safe directions, features of neighbours on request, fused choice of side, four states"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours, features on request"
ALONE = "own scan, goal bearing and distance, relative poses of visible neighbours"
MUTE = {"w_i": 0.0, "ask_ahead_s": 0.0, "ask_every_s": 0.0, "patience_s": 0.0, "answers": 0}
VARIANTS = {
    "nav-i": Variant("Nav-SCOPE alone: the same four states, every side chosen from the robot's own scan", ALONE, MUTE),
    "oracle": Variant(
        "upper reference: the states of Nav-SCOPE, but told the right side by somebody who knows the map",
        f"{ALONE}, the side of the shortest way",
        MUTE,
        told=True,
    ),
}
PRESETS = {"printed": printed_rules() | {"planner.params.ask_ahead_s": 0.0}}


class Params(NamedTuple):
    """What can be set."""

    w_i: Weight = 1.0
    """Weight of the neighbours (12); 0 is Nav-I."""
    prior: Weight = 3.0
    """Weight of the turn in sight [1/rad] in the bias b_0 of (9); 0 as printed."""
    ask_ahead_s: Seconds = 0.8
    """Features are asked for this long before the obstacle comes within the horizon."""
    ask_every_s: Seconds = 1.0
    """Shortest time between two rounds of requests; an answer takes two ticks and twice the radio's latency."""
    patience_s: Seconds = 0.6
    """How long a decision waits for answers that are still out."""
    answers: Flag = 1
    """0: nobody is answered."""
    arrive_m: Metres = 0.05
    """Distance to the goal at which a robot has arrived."""
    still_s: Seconds = 0.6
    """A neighbour that has not moved for so long is an obstacle."""
    wait_s: Seconds = 2.0
    """Longest wait (17) for a neighbour to pass; after it the neighbour is an obstacle for the same time."""
    wide_turn: Radians = 1.0
    """Turn from the target beyond which narrower gaps are looked for."""
    stuck_s: Seconds = 20.0
    """A following that gets no closer to the goal for so long is a loop."""
    turn_back: Radians = 1.75
    """A following turns back towards the target by at most this in one tick."""
    resume_m: Metres = 0.5
    """An obstacle met so soon after a following ended is the same one: the side stays."""
    reopen: Radians = 0.5
    """A following changes sides when the way on the other side turns off the target by this much less; 0 as printed."""
    loop_m: Metres = 1.0
    """A second choice of side this close to an earlier one, without progress, is a loop."""
    repulsion: Annotated[int, Bounds(0, 2)] = 1
    """Weight of a neighbour in (17): 0 none, nobody is waited for, 1 w_i and at least 1, 2 w_i as printed."""
    priority: Flag = 1
    """(17) holds only for who drives ahead of us or has the smaller address; 0: for both of a pair, as printed."""
    escape: Flag = 1
    """At a dead end narrower gaps are looked for; 0: the robot turns on the spot, as printed."""
    finish_turns: Flag = 1
    """A turn on the spot is finished before another begins; 0: as printed, the present direction counts."""
    in_place: Flag = 0
    """1: a robot stands while it turns, as printed; 0: turning and driving overlap."""
    threshold_m: Metres = 0.0
    """Threshold w_n of (14); 0: by (20)."""


@jit_inline
def decide(see: View, memory: Row, params: Params) -> None:
    """Choose state, heading and speed; ask, and answer who asks."""
    count = share(see, wants_features(see, memory))
    if params.answers == 0:
        see.out["n_out"] = 0
    if arrive(see, memory, params.arrive_m):
        return
    watch_progress(see, memory, params.stuck_s)
    speed, final = last_speed(see, params.arrive_m), is_final(see)
    if goal_is_free(see, final) and may_leave(see, memory):
        advance(see, memory, speed, R_FINAL if final else R_FREE)
        if params.w_i > 0.0:
            request_ahead(see, params.ask_ahead_s, params.ask_every_s)
    else:
        if memory["mode"] == FOLLOW:
            reconsider(see, memory, params.loop_m, params.reopen)
        elif not decide_side(see, memory, count, _manner(params)):
            return
        follow(see, memory, bordering_of(params), speed)
    if params.in_place:
        turn_first(see)
    wait(see, memory, gives_way(see, repulsion_of(params)), params.wait_s)
    memory["heading"] = see.percept["compass"] + see.out["heading"]


@jit_inline
def _manner(params: Params) -> Manner:
    """Return how a side is chosen."""
    return Manner(
        params.w_i, params.prior, params.ask_every_s, params.patience_s, params.resume_m, params.loop_m, False,
        params.threshold_m,
    )  # fmt: skip


@jit_inline
def wants_features(see: View, memory: Row) -> bool:
    """Tell whether our own features are needed in this tick because a side may have to be chosen."""
    if memory["mode"] == ARRIVED or memory["mode"] == FOLLOW:
        return False
    return not goal_is_free(see, False)
