"""DH-Bug draft."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import TWO_PI, angle_from, wrap_angle
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
from swarmscope.onboard.planning.nav_scope import away_from_nearest, first_safe, turn_to_safe
from swarmscope.onboard.tick import begin, finish

NAME = "dh-bug"
SUMMARY = "DH-Bug: straight to the goal or along what is in the way, modes A to F; one side at every key point"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours"

STANDBY, MODE_A, MODE_B, KEY_POINT, MODE_C, MODE_D, MODE_E, MODE_F, AT_GOAL = range(9)
MODE_NAMES = ("standby", "A", "B", "key point", "C", "D", "E", "F", "at the goal")
STATES = np.array([DECIDE, ADVANCE, ADVANCE, DECIDE, FOLLOW, FOLLOW, FOLLOW, FOLLOW, ARRIVED], np.uint8)
TURN_LEFT, TURN_RIGHT, TURN_RANDOM, TURN_NEAREST = range(4)
LOG = 512
LOG_M = 0.07
SAME_M = 0.05
SAME_RAD = math.radians(20.0)
APART = 10
ROTATION = math.radians(390.0)
FREE_FROM, FREE_TO = math.radians(5.0), math.radians(170.0)


class Params(NamedTuple):
    turn: int = 3
    seed: int = 0
    told: int = 0
    key_deg: float = 80.0
    face_deg: float = 10.0
    arrive_m: float = 0.05
    creep: float = 0.1
    still_s: float = 0.6
    wait_s: float = 2.0
    wait_m: float = 0.9
    wait_ahead_s: float = 2.0
    x_rule: int = 3
    x_back: float = 90.0
    x_away: float = 0.0
    x_mind: int = 1
    x_free: int = 0
    x_resume: float = 0.0
    x_side: int = 1
    x_narrow: int = 2
    x_hp: int = 1
    x_flip: int = 1
    x_view: float = 30.0


MEMORY = np.dtype(
    [
        ("mode", np.uint8),
        ("side", np.int8),
        ("edge", np.int8),
        ("fresh", np.uint8),
        ("decisions", np.int64),
        ("heading", np.float64),
        ("closest", np.float64),
        ("rotated", np.float64),
        ("travel", np.float64),
        ("left_at", np.float64),
        ("last_side", np.int8),
        ("wait_s", np.float64),
        ("push_s", np.float64),
        ("log_n", np.int64),
        ("log_x", np.float32, LOG),
        ("log_y", np.float32, LOG),
        ("log_yaw", np.float32, LOG),
        ("loops", np.int64),
    ]
)


def new_memory(robots: int) -> np.ndarray:
    memory = np.zeros(robots, MEMORY)
    memory["wait_s"] = -1.0
    memory["left_at"] = -np.inf
    return memory


@jit
def toss(seed: int, robot: int, count: int) -> int:
    """Return +1 or -1."""
    h = (robot * 0x9E3779B1 + count * 0x85EBCA77 + seed * 0xC2B2AE3D) & 0xFFFFFFFF
    for _ in range(2):
        h = ((h ^ (h >> 16)) * 0x45D9F3B) & 0xFFFFFFFF
    return 1 if (h ^ (h >> 16)) & 1 else -1


@jit
def choose_turn(percept: Row, memory: Row, decision: Row, safe: np.ndarray, rig: Rig, params: Params) -> int:
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
    work, safe, edges, narrow = scratch.work[row], scratch.safe[row], scratch.edges[row], scratch.narrow[row]
    angles, distances = scratch.angles[row], scratch.distances[row]
    begin(
        ranges, percept, shared, decision, work, edges, safe,
        scratch.header[row], angles, distances, rig, params.still_s,
    )  # fmt: skip
    sensor = rig.sensor
    safe_directions(
        work, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[params.x_rule], edges, safe
    )
    if not advance(ranges, work, percept, shared, memory, decision, safe, rig, params):
        if memory["mode"] == KEY_POINT:
            turn(percept, memory, decision, choose_turn(percept, memory, decision, safe, rig, params), params)
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
    goal, bearing = percept["goal_distance"], percept["goal_bearing"]
    if memory["mode"] == AT_GOAL or goal <= params.arrive_m:
        memory["mode"], memory["side"] = AT_GOAL, 0
        halt(decision)
        _say(decision, memory, R_ARRIVED)
        return True
    memory["travel"] += math.sqrt(percept["odom_x"] ** 2 + percept["odom_y"] ** 2)
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
        if _loops(percept, shared, memory) and params.x_hp:
            memory["loops"] = memory["side"]
            reason = R_LOOP
            memory["edge"] = 0
            memory["left_at"] = -np.inf
        elif _may_leave(percept, memory, free, final, params):
            memory["edge"] = memory["side"]
            memory["left_at"], memory["last_side"] = memory["travel"], memory["side"]
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
    limit = math.radians(params.key_deg)
    left, right = turn_to_safe(percept, safe, 1, rig), turn_to_safe(percept, safe, -1, rig)
    edge = memory["edge"]
    if (edge > 0 and left > limit) or (edge < 0 and right > limit):
        edge = 0
    if edge == 0:
        if min(left, right) <= limit:
            edge = 1 if left < right else -1
    memory["edge"] = edge
    return wrap_angle(percept["goal_bearing"] + (left if edge > 0 else -right))


@jit_inner
def _may_leave(percept: Row, memory: Row, free: bool, final: bool, params: Params) -> bool:
    if final and free:
        return True
    goal = percept["goal_distance"]
    if goal >= memory["closest"]:
        return False
    if params.x_mind:
        memory["closest"] = goal
    if params.x_free == 2:
        return free
    off = memory["side"] * wrap_angle(percept["compass"] + percept["goal_bearing"] - memory["heading"])
    return FREE_FROM < off < FREE_TO and (free or not params.x_free)


@jit_inner
def _loops(percept: Row, shared: Row, memory: Row) -> bool:
    if percept["speed"] < 0.02:
        memory["rotated"] += abs(percept["odom_yaw"])
        if memory["rotated"] > ROTATION:
            memory["rotated"] = 0.0
            return True
    else:
        memory["rotated"] = 0.0
    x, y, yaw = shared["x"], shared["y"], percept["compass"]
    n = memory["log_n"]
    if n > 0:
        j = (n - 1) % LOG
        if (x - memory["log_x"][j]) ** 2 + (y - memory["log_y"][j]) ** 2 <= LOG_M * LOG_M:
            return False
    for k in range(APART, min(n, LOG)):
        j = (n - 1 - k) % LOG
        if (x - memory["log_x"][j]) ** 2 + (y - memory["log_y"][j]) ** 2 < SAME_M * SAME_M:
            if abs(wrap_angle(yaw - memory["log_yaw"][j])) < SAME_RAD:
                return True
    j = n % LOG
    memory["log_x"][j], memory["log_y"][j], memory["log_yaw"][j] = x, y, yaw
    memory["log_n"] = n + 1
    return False


@jit
def turn(percept: Row, memory: Row, decision: Row, side: int, params: Params) -> None:
    memory["decisions"] += 1
    if memory["loops"] != 0 and params.x_flip:
        side = -memory["loops"]
        memory["loops"] = 0
    decision["fused"], decision["heard"] = 1, 0
    memory["side"] = side
    memory["mode"] = MODE_C if side > 0 else MODE_D
    memory["closest"] = percept["goal_distance"]
    memory["heading"] = percept["compass"] + percept["goal_bearing"]
    memory["fresh"] = 1
    memory["log_n"] = 0
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
    sensor = rig.sensor
    side = memory["side"]
    start = wrap_angle(memory["heading"] - percept["compass"])
    if memory["fresh"] == 0:
        start -= side * math.radians(params.x_back)
    memory["fresh"] = 0
    reason = R_ALONE if decision["fused"] else R_FOLLOW
    heading, found = first_safe(safe, start, side, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
    state = FOLLOW
    if not found:
        safe_directions(
            work, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[params.x_narrow], edges, narrow
        )
        heading, found = first_safe(
            narrow, start, side, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps
        )
        reason, state = R_DEAD_END, ESCAPE
        if not found:
            heading = away_from_nearest(ranges, rig)
            reason = R_LOST
    else:
        heading = wrap_angle(heading + side * params.x_away * _width(safe, heading, side, rig))
    if reason != R_LOST:
        memory["heading"] = percept["compass"] + heading
    turning = abs(heading) > math.radians(params.key_deg)
    if side > 0:
        memory["mode"] = MODE_C if turning else MODE_E
    else:
        memory["mode"] = MODE_D if turning else MODE_F
    _drive(ranges, percept, decision, heading, rig, params)
    _say(decision, memory, reason)
    if decision["fused"]:
        decision["state"] = DECIDE
    elif state == ESCAPE:
        decision["state"] = ESCAPE


@jit_inner
def _width(safe: np.ndarray, heading: float, side: int, rig: Rig) -> float:
    sensor = rig.sensor
    n = beam_of(heading, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
    count = 0
    limit = int(0.5 * math.pi / sensor.increment)
    while count < limit and n >= 0 and safe[n]:
        count += 1
        n += side
        if sensor.wraps:
            n %= sensor.beams
        elif n >= sensor.beams:
            n = -1
    return count * sensor.increment


@jit_inner
def _drive(ranges: np.ndarray, percept: Row, decision: Row, heading: float, rig: Rig, params: Params) -> None:
    sensor, body = rig.sensor, rig.body
    dt = percept["dt_s"]
    allowed = safe_speed(
        ranges, sensor.range_min, rig.cos, rig.sin, heading, rig.footprint, body.v_max, body.a_max, dt,
        math.radians(params.x_view),
    )
    last = arrival_speed(percept["goal_distance"] - 0.5 * params.arrive_m, body.v_max, body.a_max, dt)
    head_for(decision, percept, heading, min(last, max(allowed, params.creep)), rig)


@jit_inner
def _say(decision: Row, memory: Row, reason: int) -> None:
    decision["state"], decision["reason"], decision["side"] = STATES[memory["mode"]], reason, memory["side"]


@jit
def avoid(percept: Row, shared: Row, memory: Row, decision: Row, rig: Rig, params: Params) -> None:
    now = percept["now_s"]
    if memory["mode"] == AT_GOAL:
        return
    if now < memory["push_s"] or not _must_wait(percept, shared, memory, decision, rig, params):
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
def _must_wait(percept: Row, shared: Row, memory: Row, decision: Row, rig: Rig, params: Params) -> bool:
    travel = percept["compass"] + decision["heading"]
    vx, vy = rig.body.v_max * math.cos(travel), rig.body.v_max * math.sin(travel)
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
        after = min(params.wait_ahead_s, along / u2)
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
