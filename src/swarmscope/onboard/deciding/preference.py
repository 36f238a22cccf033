"""The velocity that ORCA's robots prefer: towards the goal, along a border, or out of a jam.

ORCA alone stops wherever the way to the goal leads into a dead end, for ever; therefore, as its users do, a planner
above it leads a robot that makes no progress along the border. ``memory`` is a row of ``planning.orca.MEMORY``.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.control.wanting import halt
from swarmscope.onboard.deciding.following import Way, first_way, turn_to_safe
from swarmscope.onboard.deciding.progress import LEAVE_GAIN, is_final, last_speed
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.corridor import corridor_length
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.reasons import (
    ADVANCE,
    ARRIVED,
    FOLLOW,
    R_ARRIVED,
    R_FINAL,
    R_FOLLOW,
    R_FREE,
    R_LOOP,
    R_LOST,
    R_YIELD,
    YIELD,
)
from swarmscope.onboard.rig import ESCAPE, NARROW
from swarmscope.onboard.view import View

LOST_BEAMS = 6
"""Every so many beams a way out is tried where no direction is safe."""


class Preferring(NamedTuple):
    """The numbers that the planner brings (its ``Params`` explain each)."""

    margin: float
    deadlock: float
    stall_s: float
    progress: float
    turn_back: float
    evade: float
    loop_s: float
    arrive_m: float


@jit
def prefer(see: View, memory: Row, preferring: Preferring) -> None:
    """Choose the preferred velocity; once the robot has arrived there is none, and ``memory["lines_n"]`` is -1."""
    goal, bearing, now = see.percept["goal_distance"], see.percept["goal_bearing"], see.percept["now_s"]
    memory["lines_n"] = -1
    if memory["arrived"] or goal <= preferring.arrive_m:
        memory["arrived"], memory["side"] = 1, 0
        halt(see)
        see.out["state"], see.out["reason"], see.out["side"] = ARRIVED, R_ARRIVED, 0
        return
    memory["lines_n"] = 0
    limit = min(goal, see.rig.sensor.range_max)
    way = corridor_length(see.masked, see.rig, bearing, see.rig.body.radius_m + preferring.margin, limit)
    memory["free"] = way >= min(goal, see.rig.look_ahead)
    if preferring.deadlock > 0.0:
        _watch(see, memory, way, preferring)
    memory["turn"] = 0.0
    memory["speed"] = last_speed(see, preferring.arrive_m)
    see.out["state"], see.out["reason"] = ADVANCE, R_FINAL if is_final(see) else R_FREE
    if memory["side"] != 0:
        _follow(see, memory, preferring)
    elif now < memory["evade_s"]:
        memory["turn"] = -preferring.evade
        see.out["state"], see.out["reason"] = YIELD, R_YIELD
    see.out["side"] = memory["side"]


@jit_inner
def _watch(see: View, memory: Row, way: float, preferring: Preferring) -> None:
    """Notice progress and its absence: begin and end followings and evasions.

    ``way`` [m] is free towards the goal. A strict following ends where that leads closer to the goal than any before.
    """
    goal, now = see.percept["goal_distance"], see.percept["now_s"]
    free = memory["free"]
    if goal < memory["best"] - preferring.progress * preferring.stall_s * see.rig.body.v_max_mps:
        memory["best"], memory["best_s"] = goal, now
        if memory["side"] == 0:
            memory["last_side"] = 0
    if memory["side"] != 0:
        if free and (memory["strict"] == 0 or way >= goal or goal - way < memory["closest"] - LEAVE_GAIN):
            memory["last_side"], memory["side"], memory["strict"] = memory["side"], 0, 0
            memory["best_s"] = now
        elif now > memory["turn_s"]:
            memory["side"] = -memory["side"]
            memory["strict"] = 1
            memory["wind"] = max(0.0, 2.0 * math.pi - memory["wind"])
            memory["loop_s"] *= 2.0
            memory["turn_s"] = now + memory["loop_s"]
        return
    if now - memory["best_s"] < preferring.stall_s or now < memory["evade_s"]:
        return
    if free:
        if memory["others_n"] > 0:  # seen at the last tick
            memory["evade_s"] = memory["best_s"] = now + preferring.stall_s
        return
    again = memory["last_side"] != 0
    left, right = turn_to_safe(see, see.safe, 1), turn_to_safe(see, see.safe, -1)
    side = 1 if left < right or (left == right and see.percept["goal_bearing"] >= 0.0) else -1
    memory["side"] = memory["last_side"] if again else side
    memory["strict"] = again
    memory["closest"] = min(memory["closest"], goal - way)
    memory["wind"] = 0.0
    memory["target"] = see.percept["compass"] + see.percept["goal_bearing"]
    memory["loop_s"] = preferring.loop_s
    memory["turn_s"] = now + preferring.loop_s


@jit_inner
def _follow(see: View, memory: Row, preferring: Preferring) -> None:
    """Prefer the first direction on the chosen side, counted from the border, that is free for a while."""
    side = memory["side"]
    bearing = see.percept["goal_bearing"]
    target = see.percept["compass"] + bearing
    wind = memory["wind"] - side * wrap_angle(target - memory["target"])
    back = max(0.0, wind - preferring.turn_back)
    see.out["state"], see.out["reason"] = FOLLOW, R_LOOP if memory["strict"] else R_FOLLOW
    way = _narrow_way(see, bearing + side * back, side)
    heading = way.heading
    if way.found:
        memory["wind"] = back + way.turn
        memory["target"] = target
    else:
        if see.percept["now_s"] >= memory["lost_s"]:  # held for a while: two ways out would take turns
            memory["lost_s"] = see.percept["now_s"] + preferring.stall_s
            memory["lost"] = see.percept["compass"] + _longest_way(see)
        heading = memory["lost"] - see.percept["compass"]
        see.out["reason"] = R_LOST
    memory["turn"] = wrap_angle(heading - bearing)
    memory["speed"] = see.rig.body.v_max_mps


@jit_inner
def _narrow_way(see: View, start: float, side: int) -> Way:
    """Return the first direction from ``start`` on ``side`` in which the body fits, for a while, or at first."""
    way = Way(0.0, 0.0, False)
    for rule in range(NARROW, ESCAPE + 1):
        if safe_directions(see.masked, see.rig.sensor, see.reach[rule], see.edges, see.narrow) > 0:
            way = first_way(see.narrow, start, side, see.rig.sensor)
        if way.found:
            break
    return way


@jit_inner
def _longest_way(see: View) -> float:
    """Return the direction (body frame) in which the guard would let the robot drive farthest."""
    rig, sensor = see.rig, see.rig.sensor
    half_width = rig.body.radius_m + rig.guarding.clearance_m
    best, at = -1.0, 0.0
    for n in range(0, sensor.beams, LOST_BEAMS):
        bearing = sensor.angle_min + n * sensor.increment
        way = corridor_length(see.masked, rig, bearing, half_width, sensor.range_max)
        if way > best:
            best, at = way, bearing
    return at
