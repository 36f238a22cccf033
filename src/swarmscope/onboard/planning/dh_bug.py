"""DH-Bug (GIWT 4.2): straight to the goal, along what is in the way, and one choice of side at every key point.

The distance histogram is the scan cut at l_th; a direction is safe when what the body sweeps is free up to l_th, as
GIWT's safe zone (1) has it: gaps that the body fits through are taken. There is no look-ahead, and nothing is said to
anybody. ``sector`` 1 asks for the lab's sector (60 degrees wide) to be free, too.

A      turns to the goal, or to the edge beside it; B drives there
key    no safe direction within ``key_deg`` of the goal: ``choose_turn`` gives a side; that is all an optimiser replaces
C, D   turn left, right, on the spot until the first safe direction on that side is in front
E, F   drive along it, the obstacle on the right (after C) or on the left (after D), until the leave condition holds
waits  a neighbour that goes first comes near (4.2.3); never longer than ``wait_s``

Where the published rules leave a robot standing or turning for nothing, another reading is taken:

- Directions count from the goal and all beams are used, not those within 90 degrees of the robot's nose, so that nobody
  turns to look. Turning and driving overlap (``unicycle.steer``) instead of standing until the error is 10 degrees.
- In mode B the edge beside the goal is kept on its side while it stays within ``key_deg``: no swinging to and fro.
- E, F take the first safe direction from the wall, not a mean of both edges of the gap, which drifts off the obstacle.
- The leave condition compares with the key point's distance during the whole following: goal nearer than there, and
  5 to 170 degrees on the free side of the direction followed.
- Loop breakers: back at a logged pose, or 390 degrees of turning on the spot. The robot faces the goal anew, chooses
  its next side by a toss, because the same choice has just led in a circle, and needs no sector until a following ends
  properly.
- (2) counts returns within alpha/2 of the heading, like the lab's code: with all of them it is 0 beside every wall. It
  never goes below ``creep``; what is safe is the guard's decision.
- Moving robots are left to 4.2.3 and the guard; one that stands for ``still_s`` is an obstacle.
- Arrival is at ``arrive_m`` like that of the other planners, so that lengths compare (the lab's code: 0.7 m). Hence the
  last l_th of a way are driven as soon as the body fits, whatever stands beside the goal.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.control.guard import halt, head_for
from swarmscope.onboard.control.safe_speed import safe_speed
from swarmscope.onboard.control.unicycle import arrival_speed
from swarmscope.onboard.percept import PEERS, Rig, Row, Scratch
from swarmscope.onboard.perception.safety import beam_of, corridor_length, safe_directions
from swarmscope.onboard.planning._contract import (
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
    R_YIELD,
    YIELD,
)
from swarmscope.onboard.planning._following import away_from_nearest, first_safe, turn_to_safe
from swarmscope.onboard.tick import begin, finish

NAME = "dh-bug"
SUMMARY = "DH-Bug: straight to the goal or along what is in the way, modes A to F; one side at every key point"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours"

STANDBY, MODE_A, MODE_B, KEY_POINT, MODE_C, MODE_D, MODE_E, MODE_F, AT_GOAL = range(9)
MODE_NAMES = ("standby", "A", "B", "key point", "C", "D", "E", "F", "at the goal")
STATES = np.array([DECIDE, ADVANCE, ADVANCE, DECIDE, FOLLOW, FOLLOW, FOLLOW, FOLLOW, ARRIVED], np.uint8)
"""What a mode is shown as."""
TURN_LEFT, TURN_RIGHT, TURN_RANDOM, TURN_NEAREST = range(4)
BODY_RULE, SECTOR_RULE, LONG_GAP_RULE, ESCAPE_RULE = 4, 3, 1, 2
"""Rows of ``Rig.reach``: footprint within l_th; with the sector; footprint within 1.2 m; what is free within r."""
LOG = 184
LOG_M = 0.07
"""Poses of a following are logged this far apart [m]; when ``LOG`` are known, every other one is forgotten."""
MM = 1000.0
YAW_UNIT = math.pi / 127.0
SAME_M = 0.05
SAME_RAD = math.radians(20.0)
"""Closer than this to a logged pose, in place and heading, is the same pose."""
APART = 10
"""The newest poses are not compared: a robot that stands is not in a loop."""
ROTATION = math.radians(390.0)
"""Turning on the spot for longer than this is a loop."""
STANDING_MPS = 0.02
FREE_FROM, FREE_TO = math.radians(5.0), math.radians(170.0)
"""Where the goal must be, counted from the direction followed away from the obstacle, for a following to end."""
WAIT_AHEAD_S = 2.0
"""A collision is possible when two robots come that close within this time, both driving straight on."""


class Params(NamedTuple):
    """What can be set. Distances in m, times in s, angles in degrees."""

    turn: int = 3
    """Side at a key point: 0 left, 1 right, 2 random, 3 the smaller turn."""
    seed: int = 0
    """Of sides that are tossed for, together with the run's seed, the robot's address and the number of its choices."""
    told: int = 0
    """1: an oracle's side is taken where one is given."""
    sector: int = 0
    """1: a direction needs a free sector, not only room for the body."""
    long_gaps: int = 0
    """1: where no sector is asked for, room for the body is needed for ``safety.narrow_m`` (1.2 m) instead of l_th."""
    key_deg: float = 60.0
    """pi/2 - theta_1: with no safe direction this close to the goal's there is a key point."""
    face_deg: float = 10.0
    """theta_0: with less than this to turn, mode A becomes B."""
    turn_back_deg: float = 105.0
    """A following looks this far back towards the obstacle from its last direction, or from where the robot faces."""
    arrive_m: float = 0.05
    """Distance to the goal at which a robot has arrived."""
    creep: float = 0.1
    """Speed [m/s] below which (2) does not slow down."""
    still_s: float = 0.6
    """A neighbour that has not moved for so long is an obstacle."""
    wait_m: float = 0.9
    """Safety distance of 4.2.3; 0 = never waits."""
    wait_s: float = 2.0
    """Longest wait; after it nobody is waited for during the same time."""


MEMORY = np.dtype(
    [
        ("mode", np.uint8),
        ("side", np.int8),  # side that the following turned to: +1 left, -1 right, 0 none
        ("edge", np.int8),  # side of the goal on which mode B drives along an obstacle, 0 none
        ("fresh", np.uint8),  # the side was chosen in this tick
        ("looped", np.uint8),  # a loop was noticed and no following has ended properly since
        ("toss", np.uint8),  # the next side is tossed for
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
def choose_turn(percept: Row, memory: Row, decision: Row, safe: np.ndarray, rig: Rig, params: Params) -> int:
    """Return the side to turn to at a key point, +1 left, -1 right. A planner with an optimiser has its own."""
    side = 0
    decision["p_left"] = 0.5
    if params.told and percept["told_side"] != 0:
        side = percept["told_side"]
    elif params.turn == TURN_LEFT:
        side = 1
    elif params.turn == TURN_RIGHT:
        side = -1
    elif params.turn == TURN_NEAREST:
        left, right = turn_to_safe(percept, safe, 1, rig), turn_to_safe(percept, safe, -1, rig)
        if abs(left - right) > 1e-6:
            side = 1 if left < right else -1
            decision["p_left"] = 1.0 if side > 0 else 0.0
    if side == 0:
        side = toss(params.seed, percept["id"], memory["decisions"])
    return side


@jit
def step(
    ranges: np.ndarray,
    percept: Row,
    shared: Row,
    memory: Row,
    decision: Row,
    scratch: Scratch,
    row: int,
    rig: Rig,
    params: Params,
) -> None:
    """Run one tick of one robot."""
    work, safe, edges, narrow = scratch.work[row], scratch.safe[row], scratch.edges[row], scratch.narrow[row]
    angles, distances = scratch.angles[row], scratch.distances[row]
    begin(
        ranges, percept, shared, decision, work, edges, safe,
        scratch.header[row], angles, distances, rig, params.still_s,
    )  # fmt: skip
    sensor = rig.sensor
    rule = LONG_GAP_RULE if params.long_gaps else BODY_RULE
    if params.sector and not memory["looped"]:
        rule = SECTOR_RULE
    safe_directions(work, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[rule], edges, safe)
    if not advance(ranges, work, percept, shared, memory, decision, safe, rig, params):
        if memory["mode"] == KEY_POINT:
            turn(percept, shared, memory, decision, choose_turn(percept, memory, decision, safe, rig, params), params)
        follow(ranges, work, percept, shared, memory, decision, safe, narrow, edges, rig, params)
    avoid(percept, shared, memory, decision, rig, params)
    finish(ranges, percept, shared, decision, edges, rig)


@jit
def advance(
    ranges: np.ndarray,
    work: np.ndarray,
    percept: Row,
    shared: Row,
    memory: Row,
    decision: Row,
    safe: np.ndarray,
    rig: Rig,
    params: Params,
) -> bool:
    """Arrive, or drive in modes A and B; False in a following that goes on and at a key point (mode KEY_POINT).

    ``work (M,)`` is the scan without moving neighbours, ``safe (M,)`` its safe directions.
    """
    goal, bearing = percept["goal_distance"], percept["goal_bearing"]
    if memory["mode"] == AT_GOAL or goal <= params.arrive_m:
        memory["mode"], memory["side"] = AT_GOAL, 0
        halt(decision)
        _say(decision, memory, R_ARRIVED)
        return True
    sensor = rig.sensor
    final = goal <= rig.protection.l_th + rig.footprint
    if final:
        free = (
            corridor_length(work, sensor.range_min, rig.cos, rig.sin, bearing, rig.footprint, goal)
            >= goal
        )
    else:
        beam = beam_of(bearing, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
        free = beam >= 0 and safe[beam] == 1
    reason = R_FINAL if final and free else R_FREE
    if memory["side"] != 0:
        if _loops(percept, shared, memory):
            memory["looped"] = memory["toss"] = 1
            memory["edge"] = 0
            reason = R_LOOP
        elif (final and free) or _may_leave(percept, memory):
            memory["looped"] = 0
            memory["edge"] = memory["side"]
        else:
            return False
        memory["side"] = 0
    if free:
        memory["edge"] = 0
        heading = bearing
    else:
        heading = _edge(percept, memory, safe, rig, params)
        if memory["edge"] == 0:
            memory["mode"] = KEY_POINT
            return False
        reason = R_FOLLOW
    memory["mode"] = MODE_A if abs(heading) > math.radians(params.face_deg) else MODE_B
    memory["heading"] = percept["compass"] + heading
    _drive(ranges, percept, decision, heading, rig, params)
    _say(decision, memory, reason)
    return True


@jit_inner
def _edge(percept: Row, memory: Row, safe: np.ndarray, rig: Rig, params: Params) -> float:
    """Return the safe direction beside the goal's (body frame); ``memory["edge"]`` is its side, 0 at a key point."""
    limit = math.radians(params.key_deg)
    left, right = turn_to_safe(percept, safe, 1, rig), turn_to_safe(percept, safe, -1, rig)
    edge = memory["edge"]
    if (edge > 0 and left > limit) or (edge < 0 and right > limit):
        edge = 0
    if edge == 0 and min(left, right) <= limit:
        edge = 1 if left < right else -1
    memory["edge"] = edge
    return wrap_angle(percept["goal_bearing"] + (left if edge > 0 else -right))


@jit_inner
def _may_leave(percept: Row, memory: Row) -> bool:
    """Tell whether a following may end: nearer to the goal than its key point, the goal on the free side."""
    off = memory["side"] * wrap_angle(percept["compass"] + percept["goal_bearing"] - memory["heading"])
    return bool(percept["goal_distance"] < memory["closest"] and FREE_FROM < off < FREE_TO)


@jit_inner
def _loops(percept: Row, shared: Row, memory: Row) -> bool:
    """Log the pose; tell whether the robot is back at an earlier one, or has turned on the spot for too long."""
    if percept["speed"] < STANDING_MPS:
        memory["rotated"] += abs(percept["odom_yaw"])
        if memory["rotated"] > ROTATION:
            memory["rotated"] = 0.0
            return True
    else:
        memory["rotated"] = 0.0
    x = int(min(32000.0, max(-32000.0, (shared["x"] - memory["key_x"]) * MM)))
    y = int(min(32000.0, max(-32000.0, (shared["y"] - memory["key_y"]) * MM)))
    yaw = percept["compass"]
    n = memory["log_n"]
    if n > 0 and _apart2(memory, n - 1, x, y) <= (memory["log_m"] * MM) ** 2:
        return False
    same = max(SAME_M, 0.6 * memory["log_m"]) * MM
    for j in range(n - APART):
        turned = abs(wrap_angle(yaw - YAW_UNIT * memory["log_yaw"][j]))
        if _apart2(memory, j, x, y) < same * same and turned < SAME_RAD:
            return True
    if n == LOG:
        n = LOG // 2
        memory["log_m"] *= 2.0
        for j in range(n):
            memory["log_x"][j], memory["log_y"][j] = memory["log_x"][2 * j], memory["log_y"][2 * j]
            memory["log_yaw"][j] = memory["log_yaw"][2 * j]
    memory["log_x"][n], memory["log_y"][n] = x, y
    memory["log_yaw"][n] = int(math.floor(wrap_angle(yaw) / YAW_UNIT + 0.5))
    memory["log_n"] = n + 1
    return False


@jit_inner
def _apart2(memory: Row, j: int, x: int, y: int) -> float:
    """Return the squared distance [mm^2] of (x, y) [mm] from logged pose ``j``."""
    dx, dy = float(x - memory["log_x"][j]), float(y - memory["log_y"][j])
    return dx * dx + dy * dy


@jit
def turn(percept: Row, shared: Row, memory: Row, decision: Row, side: int, params: Params) -> None:
    """Begin a following at a key point on ``side``; after a loop the side is tossed for instead."""
    if memory["toss"]:
        memory["toss"] = 0
        decision["p_left"] = 0.5
        side = toss(params.seed, percept["id"], memory["decisions"])
    memory["decisions"] += 1
    decision["fused"], decision["heard"] = 1, 0
    memory["side"] = side
    memory["mode"] = MODE_C if side > 0 else MODE_D
    memory["closest"] = percept["goal_distance"]
    memory["heading"] = percept["compass"] + percept["goal_bearing"]
    memory["fresh"] = 1
    memory["log_n"], memory["log_m"] = 0, LOG_M
    memory["key_x"], memory["key_y"] = shared["x"], shared["y"]
    memory["rotated"] = 0.0


@jit
def follow(
    ranges: np.ndarray,
    work: np.ndarray,
    percept: Row,
    shared: Row,
    memory: Row,
    decision: Row,
    safe: np.ndarray,
    narrow: np.ndarray,
    edges: np.ndarray,
    rig: Rig,
    params: Params,
) -> None:
    """Modes C to F: the first safe direction on the chosen side, from the goal at first, then from the obstacle."""
    sensor = rig.sensor
    side = memory["side"]
    start = wrap_angle(memory["heading"] - percept["compass"])
    if memory["fresh"] == 0:
        start = side * (max(0.0, side * start) - math.radians(params.turn_back_deg))
    memory["fresh"] = 0
    reason = R_ALONE if decision["fused"] else R_FOLLOW
    heading, found = first_safe(safe, start, side, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
    if not found:
        reason = R_DEAD_END
        safe_directions(
            work, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[ESCAPE_RULE], edges, narrow
        )
        heading, found = first_safe(
            narrow, start, side, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps
        )
    if found:
        memory["heading"] = percept["compass"] + heading
    else:
        reason = R_LOST
        heading = away_from_nearest(ranges, rig)
    in_front = abs(heading) <= math.radians(params.key_deg)
    if side > 0:
        memory["mode"] = MODE_E if in_front else MODE_C
    else:
        memory["mode"] = MODE_F if in_front else MODE_D
    _drive(ranges, percept, decision, heading, rig, params)
    _say(decision, memory, reason)
    if decision["fused"]:
        decision["state"] = DECIDE
    elif reason != R_FOLLOW:
        decision["state"] = ESCAPE


@jit_inner
def _drive(ranges: np.ndarray, percept: Row, decision: Row, heading: float, rig: Rig, params: Params) -> None:
    """Ask for driving towards ``heading`` (body frame) as fast as (2) and the way left allow."""
    sensor, body = rig.sensor, rig.body
    dt = percept["dt_s"]
    allowed = safe_speed(
        ranges, sensor.range_min, rig.cos, rig.sin, heading, rig.footprint, body.v_max_mps, body.a_max_mps2, dt,
        0.5 * rig.protection.alpha,
    )  # fmt: skip
    last = arrival_speed(percept["goal_distance"] - 0.5 * params.arrive_m, body.v_max_mps, body.a_max_mps2, dt)
    head_for(decision, percept, heading, min(last, max(allowed, params.creep)), rig)


@jit_inner
def _say(decision: Row, memory: Row, reason: int) -> None:
    """Note mode and reason for people to read."""
    decision["state"], decision["reason"], decision["side"] = STATES[memory["mode"]], reason, memory["side"]


@jit
def avoid(percept: Row, shared: Row, memory: Row, decision: Row, rig: Rig, params: Params) -> None:
    """Wait for a neighbour with priority (GIWT 4.2.3), but not for ever."""
    now = percept["now_s"]
    if memory["mode"] == AT_GOAL:
        return
    if now < memory["push_s"] or not _must_wait(percept, shared, decision, rig, params):
        memory["wait_s"] = -1.0
        return
    if memory["wait_s"] < 0.0:
        memory["wait_s"] = now
    if now - memory["wait_s"] > params.wait_s:
        memory["wait_s"] = -1.0
        memory["push_s"] = now + params.wait_s
        return
    decision["v"] = 0.0
    decision["state"], decision["reason"] = YIELD, R_YIELD


@jit_inner
def _must_wait(percept: Row, shared: Row, decision: Row, rig: Rig, params: Params) -> bool:
    """Tell whether a moving neighbour with a smaller radio address comes near and a collision with it is possible.

    It is when it is ahead, within the safety distance, and both driving straight on, we at full speed, come closer
    than two footprints. It ends once it has passed: then the distance grows.
    """
    travel = percept["compass"] + decision["heading"]
    vx, vy = rig.body.v_max_mps * math.cos(travel), rig.body.v_max_mps * math.sin(travel)
    for t in range(PEERS):
        if shared["track_id"][t] < 0 or shared["track_id"][t] >= percept["id"]:
            continue
        if percept["now_s"] - shared["track_moved_s"][t] >= params.still_s:
            continue
        x, y = shared["track_x"][t], shared["track_y"][t]
        d2 = x * x + y * y
        if d2 >= params.wait_m * params.wait_m or x * vx + y * vy <= 0.0:
            continue
        ux, uy = shared["track_vx"][t] - vx, shared["track_vy"][t] - vy
        u2 = ux * ux + uy * uy
        along = -(x * ux + y * uy)
        if along <= 0.0 or u2 < 1e-6:
            continue
        after = min(WAIT_AHEAD_S, along / u2)
        mx, my = x + after * ux, y + after * uy
        if mx * mx + my * my < (2.0 * rig.footprint) ** 2:
            return True
    return False


@jit
def step_all(
    first: int,
    last: int,
    ranges: np.ndarray,
    percepts: np.ndarray,
    shared: np.ndarray,
    memories: np.ndarray,
    decisions: np.ndarray,
    scratch: Scratch,
    rig: Rig,
    params: Params,
) -> None:
    """Run one tick of robots ``first`` to ``last - 1``."""
    for i in range(first, last):
        step(ranges[i], percepts[i], shared[i], memories[i], decisions[i], scratch, i, rig, params)
