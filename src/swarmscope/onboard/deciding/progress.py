"""Whether a robot gets on: arriving, loops and how they are noticed, when a strict following may end (docs/safety.md).

``memory`` is a row of ``deciding.memory.MEMORY``.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline, jit_paste
from swarmscope.geometry import TWO_PI
from swarmscope.onboard.control.unicycle import arrival_speed
from swarmscope.onboard.control.wanting import halt
from swarmscope.onboard.deciding.memory import LOG, say
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.corridor import corridor_length
from swarmscope.onboard.perception.safety import beam_of
from swarmscope.onboard.reasons import ARRIVED, FOLLOW, R_ARRIVED
from swarmscope.onboard.view import View

LEAVE_GAIN = 0.5
"""How much closer than ever before to the goal the free way must lead for a strict following to end [m]."""


@jit_paste
def arrive(see: View, memory: Row, arrive_m: float) -> bool:
    """Stand at the goal for good once it is within ``arrive_m`` [m]; return whether the robot does."""
    if memory["mode"] != ARRIVED and see.percept["goal_distance"] > arrive_m:
        return False
    memory["mode"] = ARRIVED
    halt(see)
    say(see, memory, ARRIVED, R_ARRIVED)
    return True


@jit_paste
def last_speed(see: View, arrive_m: float) -> float:
    """Return the largest speed [m/s] from which the robot still stops at its goal."""
    body = see.rig.body
    way = see.percept["goal_distance"] - 0.5 * arrive_m
    return arrival_speed(way, body.v_max_mps, body.a_max_mps2, see.percept["dt_s"])


@jit_paste
def is_final(see: View) -> bool:
    """Tell whether the goal is so near that only the way to the goal itself has to be free."""
    rig = see.rig
    return bool(see.percept["goal_distance"] <= max(see.margins.l_th + rig.footprint, rig.look_ahead))


@jit_inline
def goal_is_free(see: View, final: bool) -> bool:
    """Tell whether the goal's direction is safe; in the ``final`` approach: whether the body fits through to it."""
    bearing, goal = see.percept["goal_bearing"], see.percept["goal_distance"]
    if final:
        return bool(corridor_length(see.masked, see.rig, bearing, see.rig.footprint, goal) >= goal)
    beam = beam_of(bearing, see.rig.sensor)
    return bool(beam >= 0 and see.safe[beam] == 1)


@jit_inline
def watch_progress(see: View, memory: Row, stuck_s: float) -> None:
    """Count the way made. Notice a following that gets no closer to the goal for long.

    It goes on strictly, and when that does not help either, on the other side.
    """
    memory["travel"] += math.sqrt(see.percept["odom_x"] ** 2 + see.percept["odom_y"] ** 2)
    goal, now = see.percept["goal_distance"], see.percept["now_s"]
    if goal < memory["best"] - 0.3:
        memory["best"], memory["best_s"], memory["stuck_s"] = goal, now, stuck_s
    if memory["mode"] != FOLLOW or now - memory["best_s"] < memory["stuck_s"]:
        return
    memory["best_s"] = now
    memory["stuck_s"] = 2.0 * memory["stuck_s"]
    if memory["strict"]:
        memory["side"] = -memory["side"]
        memory["wind"] = max(0.0, TWO_PI - memory["wind"])
    memory["strict"] = 1


@jit_inline
def may_leave(see: View, memory: Row) -> bool:
    """Tell whether a following may end: a strict one when the way is seen free until closer to the goal than ever."""
    if memory["strict"] == 0:
        return True
    in_sight = nearest_in_sight(see)
    return bool(in_sight <= 0.0 or in_sight < memory["closest"] - LEAVE_GAIN)


@jit_inline
def nearest_in_sight(see: View) -> float:
    """Return the goal distance [m] up to which the straight way to the goal is seen to be free."""
    goal = see.percept["goal_distance"]
    limit = min(goal, see.rig.sensor.range_max)
    return float(goal - corridor_length(see.masked, see.rig, see.percept["goal_bearing"], see.rig.footprint, limit))


@jit
def break_loop(see: View, memory: Row, loop_m: float, side: int) -> int:
    """Log the choice; when it repeats an earlier one without progress, follow strictly on that earlier side."""
    x, y, goal = see.shared["x"], see.shared["y"], see.percept["goal_distance"]
    known = min(LOG, memory["log_n"])
    for k in range(known):
        j = (memory["log_n"] - 1 - k) % LOG
        d = math.sqrt((x - memory["log_x"][j]) ** 2 + (y - memory["log_y"][j]) ** 2)
        if memory["travel"] - memory["log_travel"][j] < 2.0 * loop_m:
            continue
        if d < loop_m and goal > memory["log_goal"][j] - 0.2:
            memory["strict"] = 1
            side = memory["log_side"][j]
            break
    j = memory["log_n"] % LOG
    memory["log_x"][j], memory["log_y"][j], memory["log_goal"][j] = x, y, goal
    memory["log_side"][j], memory["log_travel"][j] = side, memory["travel"]
    memory["log_n"] += 1
    return side
