"""How DH-Bug drives (GIWT 4.2): modes A to F, key points, one side at each. ``planning/dh_bug.py`` explains them.

``memory`` is a row of ``MEMORY``, or of a dtype that begins with it.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.control.safe_speed import safe_speed
from swarmscope.onboard.control.wanting import halt, head_for
from swarmscope.onboard.deciding.bug_loops import LOG, begin_log, loops
from swarmscope.onboard.deciding.following import away_from_nearest, first_safe, turn_to_safe
from swarmscope.onboard.deciding.progress import goal_is_free, last_speed
from swarmscope.onboard.deciding.waiting import crossed, wait
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.reasons import (
    ADVANCE,
    ARRIVED,
    DECIDE,
    ESCAPE,
    FOLLOW,
    R_ALONE,
    R_ARRIVED,
    R_DEAD_END,
    R_FINAL,
    R_FOLLOW,
    R_FREE,
    R_LOOP,
    R_LOST,
)
from swarmscope.onboard.rig import ESCAPE as ESCAPE_RULE
from swarmscope.onboard.view import View

STANDBY, MODE_A, MODE_B, KEY_POINT, MODE_C, MODE_D, MODE_E, MODE_F, AT_GOAL = range(9)
MODE_NAMES = ("standby", "A", "B", "key point", "C", "D", "E", "F", "at the goal")
STATES = np.array([DECIDE, ADVANCE, ADVANCE, DECIDE, FOLLOW, FOLLOW, FOLLOW, FOLLOW, ARRIVED], np.uint8)
"""What a mode is shown as."""
FREE_FROM, FREE_TO = math.radians(5.0), math.radians(170.0)
"""Where the goal must be, counted from the direction followed away from the obstacle, for a following to end."""


class Driving(NamedTuple):
    """The numbers that planners bring (their ``Params`` explain each)."""

    seed: int
    key_deg: float
    face_deg: float
    turn_back_deg: float
    arrive_m: float
    creep: float
    still_s: float
    wait_m: float
    wait_s: float
    in_place: bool
    nearer: bool
    loops: bool


@jit_inline
def driving_of(params: Any) -> Driving:
    """Return what DH-Bug's kernels are told, of a planner's ``Params``."""
    return Driving(
        params.seed, params.key_deg, params.face_deg, params.turn_back_deg,
        params.arrive_m, params.creep, params.still_s, params.wait_m, params.wait_s,
        params.in_place != 0, params.nearer != 0, params.loops != 0,
    )  # fmt: skip


MEMORY = np.dtype(
    [
        ("mode", np.uint8),
        ("side", np.int8),  # side that the following turned to: +1 left, -1 right, 0 none
        ("edge", np.int8),  # side of the goal on which mode B drives along an obstacle, 0 none
        ("fresh", np.uint8),  # the side was chosen in this tick
        ("looped", np.uint8),  # a loop was noticed and no following has ended properly since
        ("toss", np.uint8),  # the next side is tossed for
        ("told", np.int8),  # side of the shortest way, +1 left, -1 right: oracles only, 0 on a robot
        ("decisions", np.int64),  # choices of a side so far
        ("heading", np.float64),  # direction of travel, compass frame [rad]
        ("closest", np.float64),  # minD: goal distance at the key point [m]
        ("rotated", np.float64),  # turned on the spot without driving [rad]
        ("wait_s", np.float64),  # when the present wait began, -1 = none
        ("push_s", np.float64),  # until when waiting is not allowed
        ("log_n", np.int64),  # poses logged in this following, by own odometry
        ("log_m", np.float64),  # how far apart they are now
        ("key_x", np.float64),  # the key point, own odometry [m]
        ("key_y", np.float64),
        ("log_x", np.int16, LOG),  # from the key point [mm]
        ("log_y", np.int16, LOG),
        ("log_yaw", np.int8, LOG),  # compass frame, in units of pi / 127
    ]
)


def new_memory(robots: int) -> np.ndarray:
    """Return the memory of ``robots`` robots that have seen nothing yet."""
    memory = np.zeros(robots, MEMORY)
    memory["wait_s"] = -1.0
    return memory


@jit
def toss(seed: int, robot: int, count: int) -> int:
    """Return +1 or -1, evenly, the same for the same numbers."""
    h = (robot * 0x9E3779B1 + count * 0x85EBCA77 + seed * 0xC2B2AE3D) & 0xFFFFFFFF
    for _ in range(2):
        h = ((h ^ (h >> 16)) * 0x45D9F3B) & 0xFFFFFFFF
    return 1 if (h ^ (h >> 16)) & 1 else -1


@jit
def advance(see: View, memory: Row, driving: Driving) -> bool:
    """Arrive, or drive in modes A and B; False in a following that goes on and at a key point (mode KEY_POINT)."""
    percept = see.percept
    goal = percept["goal_distance"]
    if memory["mode"] == AT_GOAL or goal <= driving.arrive_m:
        memory["mode"], memory["side"] = AT_GOAL, 0
        halt(see)
        _say(see, memory, R_ARRIVED)
        return True
    final = goal <= see.margins.l_th + see.rig.footprint
    free = goal_is_free(see, final)
    reason = R_FINAL if final and free else R_FREE
    if memory["side"] != 0:
        if driving.loops and loops(percept, see.shared, memory):
            memory["looped"] = memory["toss"] = 1
            memory["edge"] = 0
            reason = R_LOOP
        elif (final and free) or _may_leave(percept, memory, driving.nearer):
            memory["looped"] = 0
            memory["edge"] = memory["side"]
        else:
            return False
        memory["side"] = 0
    if free:
        memory["edge"] = 0
        heading = percept["goal_bearing"]
    else:
        heading = _edge(see, memory, driving)
        if memory["edge"] == 0:
            memory["mode"] = KEY_POINT
            return False
        reason = R_FOLLOW
    memory["mode"] = MODE_A if abs(heading) > math.radians(driving.face_deg) else MODE_B
    memory["heading"] = percept["compass"] + heading
    _drive(see, memory, heading, driving)
    _say(see, memory, reason)
    return True


@jit_inner
def _edge(see: View, memory: Row, driving: Driving) -> float:
    """Return the safe direction beside the goal's (body frame); ``memory["edge"]`` is its side, 0 at a key point."""
    limit = math.radians(driving.key_deg)
    left, right = turn_to_safe(see, see.safe, 1), turn_to_safe(see, see.safe, -1)
    edge = memory["edge"]
    if (edge > 0 and left > limit) or (edge < 0 and right > limit):
        edge = 0
    if edge == 0 and min(left, right) <= limit:
        edge = 1 if left < right else -1
    memory["edge"] = edge
    return wrap_angle(see.percept["goal_bearing"] + (left if edge > 0 else -right))


@jit_inner
def _may_leave(percept: Row, memory: Row, nearer: bool) -> bool:
    """Tell whether a following may end: the goal on the free side and, if asked, ``nearer`` than at its key point."""
    off = memory["side"] * wrap_angle(percept["compass"] + percept["goal_bearing"] - memory["heading"])
    return bool((not nearer or percept["goal_distance"] < memory["closest"]) and FREE_FROM < off < FREE_TO)


@jit
def turn(see: View, memory: Row, side: int, seed: int) -> None:
    """Begin a following at a key point on ``side``; after a loop the side is tossed for instead."""
    percept = see.percept
    if memory["toss"]:
        memory["toss"] = 0
        see.out["p_left"] = 0.5
        side = toss(seed, percept["id"], memory["decisions"])
    memory["decisions"] += 1
    see.out["fused"], see.out["heard"] = 1, 0
    memory["side"] = side
    memory["mode"] = MODE_C if side > 0 else MODE_D
    memory["closest"] = percept["goal_distance"]
    memory["heading"] = percept["compass"] + percept["goal_bearing"]
    memory["fresh"] = 1
    begin_log(see.shared, memory)


@jit
def follow(see: View, memory: Row, driving: Driving) -> None:
    """Modes C to F: the first safe direction on the chosen side, from the goal at first, then from the obstacle."""
    sensor = see.rig.sensor
    side = memory["side"]
    start = wrap_angle(memory["heading"] - see.percept["compass"])
    if memory["fresh"] == 0:
        start = side * (max(0.0, side * start) - math.radians(driving.turn_back_deg))
    memory["fresh"] = 0
    reason = R_ALONE if see.out["fused"] else R_FOLLOW
    heading, found = first_safe(see.safe, start, side, sensor)
    if not found:
        reason = R_DEAD_END
        safe_directions(see.masked, sensor, see.reach[ESCAPE_RULE], see.edges, see.narrow)
        heading, found = first_safe(see.narrow, start, side, sensor)
    if found:
        memory["heading"] = see.percept["compass"] + heading
    else:
        reason = R_LOST
        heading = away_from_nearest(see)
    in_front = abs(heading) <= math.radians(driving.key_deg)
    if side > 0:
        memory["mode"] = MODE_E if in_front else MODE_C
    else:
        memory["mode"] = MODE_F if in_front else MODE_D
    _drive(see, memory, heading, driving)
    _say(see, memory, reason)
    if see.out["fused"]:
        see.out["state"] = DECIDE
    elif reason != R_FOLLOW:
        see.out["state"] = ESCAPE


@jit_inner
def _drive(see: View, memory: Row, heading: float, driving: Driving) -> None:
    """Ask for driving towards ``heading`` (body frame) as fast as (2) and the way left allow."""
    view = 0.5 * see.rig.protection.alpha
    allowed = safe_speed(see.scan, see.rig, heading, see.percept["dt_s"], view)
    speed = min(last_speed(see, driving.arrive_m), max(allowed, driving.creep))
    if driving.in_place and memory["mode"] in (MODE_A, MODE_C, MODE_D):
        speed = 0.0
    head_for(see, heading, speed)


@jit_inner
def _say(see: View, memory: Row, reason: int) -> None:
    """Note mode and reason for people to read."""
    see.out["state"], see.out["reason"], see.out["side"] = STATES[memory["mode"]], reason, memory["side"]


@jit
def avoid(see: View, memory: Row, driving: Driving) -> None:
    """Wait for a neighbour with priority (4.2.3), but not for ever."""
    if memory["mode"] != AT_GOAL:
        wait(see, memory, crossed(see, driving.still_s, driving.wait_m), driving.wait_s)
