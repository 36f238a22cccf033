"""Obstacle following: the border on the chosen side, and when it is taken up again or changed (docs/safety.md).

What Nav-SCOPE (state iii) and SFM-MAS (IV-C) share. ``memory`` is a row of ``deciding.memory.MEMORY``.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner, jit_paste
from swarmscope.geometry import TWO_PI, angle_from, wrap_angle
from swarmscope.onboard.control.unicycle import FULL_SPEED_WITHIN
from swarmscope.onboard.control.wanting import head_for
from swarmscope.onboard.deciding.memory import say
from swarmscope.onboard.deciding.progress import break_loop
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.safety import beam_of, safe_directions
from swarmscope.onboard.reasons import ADVANCE, ESCAPE, FOLLOW, R_DEAD_END, R_FOLLOW, R_LOOP, R_LOST
from swarmscope.onboard.rig import ESCAPE as ESCAPE_RULE
from swarmscope.onboard.rig import NARROW
from swarmscope.onboard.sensor import Sensor
from swarmscope.onboard.view import View

QUARTER = 0.5 * math.pi
REOPEN_WITHIN = 1.0
"""A following changes sides only for a direction this near to the target [rad]."""
REOPEN_AHEAD = QUARTER
"""And only for one this near to where it looks: who turns back along the same border finds nothing new [rad]."""


@jit_paste
def side_bias(see: View, prior: float) -> float:
    """Return the bias b_0 of (9) and (SFM-MAS 7): ``prior`` [1/rad] times how much shorter the turn to the left is."""
    return prior * (turn_to_safe(see, see.safe, -1) - turn_to_safe(see, see.safe, 1))


@jit_paste
def begin_following(see: View, memory: Row, side: int) -> None:
    """Enter state iii on ``side`` (+1 left, -1 right)."""
    memory["side"], memory["mode"], memory["wind"] = side, FOLLOW, 0.0
    memory["target"] = see.percept["compass"] + see.percept["goal_bearing"]


@jit_paste
def resume(see: View, memory: Row, resume_m: float) -> bool:
    """Follow on the last side again when a following ended less than ``resume_m`` ago; return whether it did."""
    if memory["travel"] - memory["left_at"] >= resume_m:
        return False
    begin_following(see, memory, int(memory["last_side"]))
    return True


@jit_inline
def reconsider(see: View, memory: Row, loop_m: float, reopen: float) -> None:
    """Change sides when another obstacle stands in the way now: the way past it on the other side turns off less.

    Less by ``reopen`` [rad] than this following has turned off the target; 0 keeps the side as printed. Changing
    back at the same place is a loop.
    """
    side = int(memory["side"])
    if reopen <= 0.0 or memory["strict"]:
        return
    other = turn_to_safe(see, see.safe, -side)
    if other >= REOPEN_WITHIN or abs(wrap_angle(see.percept["goal_bearing"] - side * other)) > REOPEN_AHEAD:
        return
    target = see.percept["compass"] + see.percept["goal_bearing"]
    wind = memory["wind"] - side * wrap_angle(target - memory["target"])
    if other + reopen < max(wind, turn_to_safe(see, see.safe, side)):
        begin_following(see, memory, break_loop(see, memory, loop_m, -side))


@jit_paste
def advance(see: View, memory: Row, speed: float, reason: int) -> None:
    """State i: end a following, if any, and head for the goal."""
    if memory["mode"] == FOLLOW:
        memory["left_at"], memory["last_side"] = memory["travel"], memory["side"]
    memory["side"] = 0
    memory["strict"] = 0
    memory["mode"] = ADVANCE
    head_for(see, see.percept["goal_bearing"], speed)
    say(see, memory, ADVANCE, reason)


class Bordering(NamedTuple):
    """How a border is followed: the numbers that planners bring (their ``Params`` explain each)."""

    wide_turn: float
    turn_back: float
    escape: bool
    finish_turns: bool


@jit_inline
def bordering_of(params: Any) -> Bordering:
    """Return how a planner's ``Params`` have a border followed."""
    return Bordering(params.wide_turn, params.turn_back, params.escape != 0, params.finish_turns != 0)


class Way(NamedTuple):
    """A direction that is open (body frame, rad), its turn from where the search began, and whether there is one."""

    heading: float
    turn: float
    found: bool


@jit_inline
def follow(see: View, memory: Row, manner: Bordering, speed: float) -> None:
    """State iii: the first safe direction on the chosen side, counted from the target (16), or from the border.

    At a dead end narrower gaps are looked for, or as printed the robot turns on the spot towards the side.
    """
    side = int(memory["side"])
    reason, state = R_FOLLOW, FOLLOW
    if see.out["fused"]:
        reason = see.out["reason"]
    if memory["strict"]:
        reason = R_LOOP
    target = see.percept["compass"] + see.percept["goal_bearing"]
    wind = memory["wind"] - side * wrap_angle(target - memory["target"])
    back = max(0.0, wind - manner.turn_back)
    start = see.percept["goal_bearing"] + side * back
    safe = first_way(see.safe, start, side, see.rig.sensor)
    way = _narrower(see, safe, start, side, manner.wide_turn) if manner.escape else safe
    heading = way.heading
    if not way.found and not manner.escape:
        heading, speed = side * QUARTER, 0.0
        reason, state = R_DEAD_END, ESCAPE
    elif not way.found:
        heading = away_from_nearest(see)
        reason = R_LOST
    else:
        if not safe.found:
            reason, state = R_DEAD_END, ESCAPE
        memory["wind"], memory["target"] = back + way.turn, target
    head_for(see, _keep_turning(see, memory, heading) if manner.finish_turns else heading, speed)
    see.out["state"], see.out["reason"], see.out["side"] = state, reason, side


@jit_inner
def _narrower(see: View, way: Way, start: float, side: int, wide_turn: float) -> Way:
    """Return a way that turns less than ``way`` through the narrower gaps that the body fits through, else ``way``."""
    sensor = see.rig.sensor
    for rule in range(NARROW, ESCAPE_RULE + 1):
        if way.found and (rule == ESCAPE_RULE or way.turn <= wide_turn):
            break
        if safe_directions(see.masked, sensor, see.reach[rule], see.edges, see.narrow) == 0:
            continue
        other = first_way(see.narrow, start, side, sensor)
        if other.found and (not way.found or other.turn < way.turn):
            way = other
    return way


@jit_inner
def _keep_turning(see: View, memory: Row, heading: float) -> float:
    """Return the heading to take: a turn on the spot is finished before another begins, if its end is still free.

    Without this, two directions that take turns at being the best would keep a robot swinging for ever.
    """
    sensor = see.rig.sensor
    before = wrap_angle(memory["heading"] - see.percept["compass"])
    if memory["turning"] and abs(before) > FULL_SPEED_WITHIN:
        safe_directions(see.masked, sensor, see.reach[ESCAPE_RULE], see.edges, see.narrow)
        n = beam_of(before, sensor)
        if n >= 0 and see.narrow[n]:
            return before
    memory["turning"] = abs(wrap_angle(heading)) > FULL_SPEED_WITHIN
    return heading


@jit_inline
def first_way(safe: np.ndarray, start: float, side: int, sensor: Sensor) -> Way:
    """Return the first safe direction from ``start`` on ``side`` with the turn to it."""
    heading, found = first_safe(safe, start, side, sensor)
    return Way(heading, angle_from(0.0, side * (heading - start)), found)


@jit
def first_safe(safe: np.ndarray, start: float, side: int, sensor: Sensor) -> tuple[float, bool]:
    """Return the first safe direction (body frame) from ``start`` on ``side`` (+1 left), and whether any is.

    (Nav-SCOPE 16): the safe direction closest to the target on the chosen side.
    """
    beams = sensor.beams
    circle = beams if sensor.wraps else int(TWO_PI / sensor.increment)
    n = int(math.floor((start - sensor.angle_min) / sensor.increment + 0.5)) % circle
    step = int(side)  # without the compiler an int8 would overflow
    for _ in range(circle):
        if n < beams and safe[n] == 1:
            return wrap_angle(sensor.angle_min + n * sensor.increment), True
        n += step
        if n == circle:
            n = 0
        elif n < 0:
            n = circle - 1
    return 0.0, False


@jit_inline
def turn_to_safe(see: View, safe: np.ndarray, side: int) -> float:
    """Return the turn [rad] from the target to the first safe direction on ``side``, pi when there is none."""
    start = see.percept["goal_bearing"]
    heading, found = first_safe(safe, start, side, see.rig.sensor)
    if not found:
        return math.pi
    return angle_from(0.0, side * (heading - start))


@jit_inline
def away_from_nearest(see: View) -> float:
    """Return the direction opposite to the nearest valid return (body frame): the one that gains clearance."""
    sensor = see.rig.sensor
    nearest, at = math.inf, 0
    for n in range(see.scan.size):
        if sensor.range_min <= see.scan[n] < nearest:
            nearest, at = see.scan[n], n
    return wrap_angle(sensor.angle_min + at * sensor.increment + math.pi)
