"""Obstacle following: the border on the chosen side, when it ends, and what ends loops (docs/safety.md).

What Nav-SCOPE (state iii) and SFM-MAS (IV-C) share. ``memory`` is a row of ``_memory.MEMORY``.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import TWO_PI, angle_from, wrap_angle
from swarmscope.onboard.control.guard import head_for
from swarmscope.onboard.control.unicycle import FULL_SPEED_WITHIN
from swarmscope.onboard.percept import Rig, Row
from swarmscope.onboard.perception.safety import beam_of, corridor_length, safe_directions
from swarmscope.onboard.planning._contract import ADVANCE, ESCAPE, FOLLOW, R_DEAD_END, R_FOLLOW, R_LOOP, R_LOST
from swarmscope.onboard.planning._memory import LOG, say

REOPEN_WITHIN = 1.0
"""A following changes sides only for a direction this near to the target [rad]."""
REOPEN_AHEAD = 0.5 * math.pi
"""And only for one this near to where it looks: who turns back along the same border finds nothing new [rad]."""
LEAVE_GAIN = 0.5
"""How much closer than ever before to the goal the free way must lead for a strict following to end [m]."""


@jit
def watch_progress(memory: Row, goal: float, now: float, stuck_s: float) -> None:
    """Notice a following that gets no closer to the goal for long: follow strictly, then on the other side."""
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


@jit
def may_leave(masked: np.ndarray, percept: Row, memory: Row, rig: Rig) -> bool:
    """Tell whether a strict following may end: the way to the goal is seen free until closer than ever before."""
    in_sight = nearest_in_sight(masked, percept, rig)
    return in_sight <= 0.0 or in_sight < memory["closest"] - LEAVE_GAIN


@jit
def nearest_in_sight(masked: np.ndarray, percept: Row, rig: Rig) -> float:
    """Return the goal distance [m] up to which the straight way to the goal is seen to be free."""
    sensor = rig.sensor
    goal = percept["goal_distance"]
    limit = min(goal, sensor.range_max)
    free = corridor_length(
        masked, sensor.range_min, rig.cos, rig.sin, percept["goal_bearing"], rig.footprint, limit
    )
    return float(goal - free)


@jit
def side_bias(percept: Row, safe: np.ndarray, prior: float, rig: Rig) -> float:
    """Return the bias b_0 of (9) and (SFM-MAS 7): ``prior`` [1/rad] times how much shorter the turn to the left is."""
    return prior * (turn_to_safe(percept, safe, -1, rig) - turn_to_safe(percept, safe, 1, rig))


@jit
def break_loop(percept: Row, shared: Row, memory: Row, loop_m: float, side: int) -> int:
    """Log the choice; when it repeats an earlier one without progress, follow strictly on that earlier side."""
    x, y, goal = shared["x"], shared["y"], percept["goal_distance"]
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


@jit
def begin_following(percept: Row, memory: Row, side: int) -> None:
    """Enter state iii on ``side`` (+1 left, -1 right)."""
    memory["side"], memory["mode"], memory["wind"] = side, FOLLOW, 0.0
    memory["target"] = percept["compass"] + percept["goal_bearing"]


@jit
def resume(percept: Row, memory: Row, resume_m: float) -> bool:
    """Follow on the last side again when a following ended less than ``resume_m`` ago; return whether it did."""
    if memory["travel"] - memory["left_at"] >= resume_m:
        return False
    begin_following(percept, memory, memory["last_side"])
    return True


@jit
def reconsider(
    percept: Row, shared: Row, memory: Row, safe: np.ndarray, rig: Rig, loop_m: float, reopen: float
) -> None:
    """Change sides when another obstacle stands in the way now: the way past it on the other side turns off less.

    Less by ``reopen`` [rad] than this following has turned off the target; 0 keeps the side as printed. Changing
    back at the same place is a loop.
    """
    side = memory["side"]
    if reopen <= 0.0 or memory["strict"]:
        return
    other = turn_to_safe(percept, safe, -side, rig)
    if other >= REOPEN_WITHIN or abs(wrap_angle(percept["goal_bearing"] - side * other)) > REOPEN_AHEAD:
        return
    wind = memory["wind"] - side * wrap_angle(percept["compass"] + percept["goal_bearing"] - memory["target"])
    if other + reopen < max(wind, turn_to_safe(percept, safe, side, rig)):
        begin_following(percept, memory, break_loop(percept, shared, memory, loop_m, -side))


@jit
def advance(percept: Row, memory: Row, decision: Row, rig: Rig, speed: float, reason: int) -> None:
    """State i: end a following, if any, and head for the goal."""
    if memory["mode"] == FOLLOW:
        memory["left_at"], memory["last_side"] = memory["travel"], memory["side"]
    memory["side"] = 0
    memory["strict"] = 0
    memory["mode"] = ADVANCE
    head_for(decision, percept, percept["goal_bearing"], speed, rig)
    say(decision, memory, ADVANCE, reason)


@jit
def follow(
    ranges: np.ndarray,
    masked: np.ndarray,
    percept: Row,
    memory: Row,
    decision: Row,
    safe: np.ndarray,
    safe_count: int,
    narrow: np.ndarray,
    edges: np.ndarray,
    rig: Rig,
    wide_turn: float,
    turn_back: float,
    speed: float,
) -> None:
    """State iii: the first safe direction on the chosen side, counted from the target (16), or from the border."""
    sensor = rig.sensor
    side = memory["side"]
    reason = R_FOLLOW
    if decision["fused"]:
        reason = decision["reason"]
    state = FOLLOW
    target = percept["compass"] + percept["goal_bearing"]
    wind = memory["wind"] - side * wrap_angle(target - memory["target"])
    back = max(0.0, wind - turn_back)
    start = percept["goal_bearing"] + side * back
    if memory["strict"]:
        reason = R_LOOP
    heading, found = first_safe(safe, start, side, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
    turn = angle_from(0.0, side * (heading - start))
    for level in range(1, 3):
        if found and (level == 2 or turn <= wide_turn):
            break
        count = safe_directions(
            masked, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[level], edges, narrow
        )
        if count == 0:
            continue
        other, found_other = first_safe(
            narrow, start, side, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps
        )
        if found_other and (not found or angle_from(0.0, side * (other - start)) < turn):
            if not found:
                reason, state = R_DEAD_END, ESCAPE
            heading, found = other, True
            turn = angle_from(0.0, side * (heading - start))
    if not found:
        heading = away_from_nearest(ranges, rig)
        reason = R_LOST
    else:
        memory["wind"], memory["target"] = back + turn, target
    heading = _keep_turning(masked, percept, memory, heading, narrow, edges, rig)
    head_for(decision, percept, heading, speed, rig)
    decision["state"], decision["reason"], decision["side"] = state, reason, side


@jit_inner
def _keep_turning(
    masked: np.ndarray,
    percept: Row,
    memory: Row,
    heading: float,
    narrow: np.ndarray,
    edges: np.ndarray,
    rig: Rig,
) -> float:
    """Return the heading to take: a turn on the spot is finished before another begins, if its end is still free.

    Without this, two directions that take turns at being the best would keep a robot swinging for ever.
    """
    sensor = rig.sensor
    before = wrap_angle(memory["heading"] - percept["compass"])
    if memory["turning"] and abs(before) > FULL_SPEED_WITHIN:
        safe_directions(masked, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[2], edges, narrow)
        n = beam_of(before, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
        if n >= 0 and narrow[n]:
            return before
    memory["turning"] = abs(wrap_angle(heading)) > FULL_SPEED_WITHIN
    return heading


@jit
def first_safe(
    safe: np.ndarray, start: float, side: int, angle_min: float, increment: float, beams: int, wraps: bool
) -> tuple[float, bool]:
    """Return the first safe direction (body frame) from ``start`` on ``side`` (+1 left), and whether any is.

    (Nav-SCOPE 16): the safe direction closest to the target on the chosen side.
    """
    circle = beams if wraps else int(TWO_PI / increment)
    n = int(math.floor((start - angle_min) / increment + 0.5)) % circle
    for _ in range(circle):
        if n < beams and safe[n] == 1:
            return wrap_angle(angle_min + n * increment), True
        n += side
        if n == circle:
            n = 0
        elif n < 0:
            n = circle - 1
    return 0.0, False


@jit_inline
def turn_to_safe(percept: Row, safe: np.ndarray, side: int, rig: Rig) -> float:
    """Return the turn [rad] from the target to the first safe direction on ``side``, pi when there is none."""
    sensor = rig.sensor
    heading, found = first_safe(
        safe, percept["goal_bearing"], side, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps
    )
    if not found:
        return math.pi
    return angle_from(0.0, side * (heading - percept["goal_bearing"]))


@jit
def away_from_nearest(ranges: np.ndarray, rig: Rig) -> float:
    """Return the direction opposite to the nearest valid return (body frame): the one that gains clearance."""
    nearest, at = math.inf, 0
    for n in range(ranges.size):
        if rig.sensor.range_min <= ranges[n] < nearest:
            nearest, at = ranges[n], n
    return wrap_angle(rig.sensor.angle_min + at * rig.sensor.increment + math.pi)
