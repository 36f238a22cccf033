"""SFM-MAS: social forces decide when to stop, on which side to pass and who goes first.

The four states of SFM-MAS IV. The forces are those of the letter; where it leaves things open (how far ahead an
obstacle counts, loops, ends of waits) it shares the machinery of Nav-SCOPE (docs/theory.md, section 12).
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from swarmscope._jit import jit_inline
from swarmscope.bounds import Bounds, Flag, Metres, Radians, Seconds, Weight
from swarmscope.onboard.control.wanting import turn_first
from swarmscope.onboard.deciding.choosing import Manner, decide_side
from swarmscope.onboard.deciding.fields import P_FREE, obstacle_constant, obstacle_force, propulsion, yields_to
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
from swarmscope.onboard.deciding.waiting import behind, repulsion_of, wait
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.features import UNMASKED
from swarmscope.onboard.planners import Variant
from swarmscope.onboard.reasons import ARRIVED, DECIDE, FOLLOW, R_FINAL, R_FREE
from swarmscope.onboard.tick import share
from swarmscope.onboard.view import View

__all__ = [
    "FEATURE_MASK", "MEMORY", "NAME", "NEEDS", "PRESETS", "SUMMARY", "VARIANTS", "Params", "decide", "new_memory",
]  # fmt: skip

NAME = "sfm-mas"
SUMMARY = "SFM-MAS: social forces for stopping, choice of side with the neighbours asked then, and priority"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours, features on request"
FEATURE_MASK = UNMASKED
"""(21) prints no mask."""
VARIANTS = {
    "sfm-i": Variant(
        "SFM-MAS alone: the same forces and states, every side chosen from the robot's own scan",
        "own scan, goal bearing and distance, relative poses of visible neighbours",
        {"w_i": 0.0, "patience_s": 0.0, "answers": 0},
    ),
}
PRESETS = {"printed": printed_rules()}


class Params(NamedTuple):
    """What can be set."""

    w_i: Weight = 1.0
    """Weight of the neighbours (14); 0 is SFM-I."""
    prior: Weight = 3.0
    """Weight of the turn in sight [1/rad] in the bias b_0 of (7); 0 as printed."""
    patience_s: Seconds = 0.6
    """How long a decision waits for answers that are still out."""
    answers: Flag = 1
    """0: nobody is answered."""
    arrive_m: Metres = 0.05
    """Distance to the goal at which a robot has arrived."""
    still_s: Seconds = 0.6
    """A neighbour that has not moved for so long is an obstacle."""
    wait_s: Seconds = 2.0
    """Longest wait (27) for a neighbour to pass; after it the neighbour is an obstacle for the same time."""
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
    """Weight of a neighbour in (27): 0 none, nobody is waited for, 1 w_i and at least 1, 2 w_i as printed."""
    priority: Flag = 1
    """(27) holds only for who is relatively ahead (theory.md, 12); 0: for both of a pair."""
    escape: Flag = 1
    """At a dead end narrower gaps are looked for; 0: the robot turns on the spot, as printed."""
    finish_turns: Flag = 1
    """A turn on the spot is finished before another begins; 0: as printed, the present direction counts."""
    in_place: Flag = 0
    """1: a robot stands while it turns, as printed; 0: turning and driving overlap."""
    threshold_m: Metres = 0.0
    """Threshold w_n of (15); 0: by (23)."""


@jit_inline
def decide(see: View, memory: Row, params: Params) -> None:
    """Choose state, heading and speed; ask, and answer who asks."""
    free = way_is_free(see)
    count = share(see, not free and memory["mode"] != FOLLOW and memory["mode"] != ARRIVED)
    if params.answers == 0:
        see.out["n_out"] = 0
    if arrive(see, memory, params.arrive_m):
        return
    watch_progress(see, memory, params.stuck_s)
    speed = last_speed(see, params.arrive_m)
    if free and may_leave(see, memory):
        advance(see, memory, speed, R_FINAL if is_final(see) else R_FREE)
    elif memory["mode"] == FOLLOW or decide_side(see, memory, count, _manner(params)):
        if not see.out["fused"]:
            reconsider(see, memory, params.loop_m, params.reopen)
        follow(see, memory, bordering_of(params), speed)
    if params.in_place:
        turn_first(see)
    if memory["mode"] != DECIDE:
        wait(see, memory, behind(see, repulsion_of(params)), params.wait_s)
        memory["heading"] = see.percept["compass"] + see.out["heading"]


@jit_inline
def _manner(params: Params) -> Manner:
    """Return how a side is chosen: neighbours are asked at once."""
    return Manner(
        params.w_i, params.prior, 0.0, params.patience_s, params.resume_m, params.loop_m, True, params.threshold_m
    )


@jit_inline
def way_is_free(see: View) -> bool:
    """Tell whether no obstacle stops the way to the goal (26) and its direction is safe."""
    final = is_final(see)
    return bool(goal_is_free(see, final) and (final or not obstacle_stops(see)))


@jit_inline
def obstacle_stops(see: View) -> bool:
    """Tell whether (18) holds towards the goal: one return's repulsion outweighs the propulsion.

    Forces balance at the look-ahead distance, for returns in the way of the body; without look-ahead at l_th
    on the edge of the safety sector, for returns in the sector, as printed. Every return counts as an obstacle.
    """
    rig, masked, bearing = see.rig, see.masked, see.percept["goal_bearing"]
    printed = rig.look_ahead <= 0.0
    reach = see.margins.l_th if printed else max(see.margins.l_th, rig.look_ahead)
    half = 0.5 * see.margins.alpha if printed else math.asin(min(1.0, rig.footprint / reach))
    edge = math.cos(half)
    own = propulsion(1.0, P_FREE)
    constant = obstacle_constant(own, reach, half)
    far = reach / math.sqrt(edge)
    c, s = math.cos(bearing), math.sin(bearing)
    for n in range(masked.size):
        d = masked[n]
        if d > far:
            continue
        ahead = rig.cos[n] * c + rig.sin[n] * s
        if ahead <= 0.0:
            continue
        if not d >= rig.sensor.range_min:
            return True
        across = d * abs(rig.sin[n] * c - rig.cos[n] * s)
        seen = ahead >= edge if printed else across < rig.footprint
        if seen and yields_to(own, obstacle_force(d, constant), ahead):
            return True
    return False
