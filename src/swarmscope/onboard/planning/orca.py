"""ORCA: optimal reciprocal collision avoidance by the library navground (RVO2 inside), a baseline.

Each tick: the scan becomes line segments, the tracks become moving discs, the library finds the velocity nearest to
the preferred one that avoids all of them for a time horizon (van den Berg et al. 2011), and the wheels follow it.
The preferred velocity points at the goal. ORCA alone stops wherever that leads into a dead end, for ever; therefore,
as its users do, a planner above it leads a robot that makes no progress along the border (``deadlock = 0``: plain
ORCA). Nothing is sent: the robots only see each other.

All that the library is given is in the *goal frame*: origin at the robot, x towards the goal.
"""

from __future__ import annotations

import math
import threading
from typing import Any, NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.errors import MissingExtraError
from swarmscope.geometry import angle_from, point_segment_distance, wrap_angle
from swarmscope.onboard.control.guard import halt, head_for
from swarmscope.onboard.control.unicycle import arrival_speed
from swarmscope.onboard.percept import PEERS, Rig, Row, Scratch
from swarmscope.onboard.perception.safety import corridor_length, safe_directions
from swarmscope.onboard.planning._contract import (
    ADVANCE,
    ARRIVED,
    FOLLOW,
    R_ARRIVED,
    R_BLOCKED_WAIT,
    R_FINAL,
    R_FOLLOW,
    R_FREE,
    R_LOOP,
    R_LOST,
    R_YIELD,
    YIELD,
)
from swarmscope.onboard.planning._following import first_safe, turn_to_safe
from swarmscope.onboard.tick import begin, finish

NAME = "orca"
SUMMARY = "ORCA by the library navground (extra 'orca'), with a rule against dead ends; a baseline"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours"
MAX_LINES = 40
"""Segments that the library is given for one robot; with more, all are made coarser."""
LINE_ERROR = 0.015
"""Returns lie within this of their segment [m]."""
LOST_BEAMS = 6
"""Every so many beams a way out is tried where no direction is safe."""
LEAVE_GAIN = 0.5
"""How much closer to the goal than ever before the free way must lead for a strict following to end [m]."""


class Params(NamedTuple):
    """What can be set. Distances in m, times in s."""

    horizon_s: float = 3.0
    """Collisions with robots are avoided this far ahead."""
    obstacle_horizon_s: float = 1.5
    """The same for obstacles."""
    margin: float = 0.035
    """Kept free around the body, what the wheels cannot follow exactly included."""
    creep: float = 0.2
    """Slower than this share of the preferred speed nobody drives at an obstacle between it and its goal."""
    deadlock: float = 1.0
    """1: without progress follow the border; 0: plain ORCA."""
    stall_s: float = 2.0
    """No progress for so long is a dead end."""
    progress: float = 0.3
    """Progress is to get closer to the goal than ever at this share of the top speed, or faster."""
    turn_back: float = 2.5
    """A following turns back towards the target by at most this in one tick [rad]."""
    evade: float = 1.0
    """Turn to the right [rad] of the preferred velocity in a jam of robots, for ``stall_s``."""
    loop_s: float = 30.0
    """A following that lasts longer changes its side; the time doubles with every change."""
    arrive_m: float = 0.05
    """Distance to the goal at which a robot has arrived."""
    still_s: float = 1.0
    """A neighbour that has not moved for so long is an obstacle."""


MEMORY = np.dtype(
    [
        ("arrived", np.uint8),
        ("free", np.uint8),  # the straight way to the goal is, as far as we look ahead
        ("side", np.int8),  # of the border that is followed: +1 left, -1 right, 0 none
        ("strict", np.uint8),  # the following ends only where the way leads closer to the goal than ever
        ("last_side", np.int8),  # side of the last following without progress since
        ("best", np.float64),  # smallest goal distance so far [m]
        ("best_s", np.float64),  # when the last progress, following or evading ended
        ("closest", np.float64),  # goal distance of the nearest point seen free on the way, where followings began [m]
        ("wind", np.float64),  # how far the following has turned off the target; may exceed 2 pi [rad]
        ("target", np.float64),  # direction of the target at the last tick, compass frame [rad]
        ("turn_s", np.float64),  # when the following changes its side
        ("loop_s", np.float64),  # after how long it does
        ("evade_s", np.float64),  # until when a jam is evaded
        ("lost", np.float64),  # direction that is taken where no direction is safe, compass frame [rad]
        ("lost_s", np.float64),  # until when
        ("speed", np.float64),  # preferred speed [m/s]
        ("turn", np.float64),  # direction of the preferred velocity, goal frame [rad]
        ("vx", np.float32),  # own velocity, goal frame [m/s]
        ("vy", np.float32),
        ("ux", np.float32),  # what the library answered, goal frame [m/s]
        ("uy", np.float32),
        ("lines_n", np.int32),  # -1: the library is not asked
        ("others_n", np.int32),
        ("lines", np.float32, (MAX_LINES, 2, 2)),  # both ends of each segment, goal frame [m]
        ("others", np.float32, (PEERS, 2, 2)),  # positions [m] and velocities [m/s] of neighbours, goal frame
        ("radii", np.float32, PEERS),  # theirs [m]
    ]
)

_local = threading.local()


def new_memory(robots: int) -> np.ndarray:
    """Return the memory of ``robots`` robots that have seen nothing yet."""
    memory = np.zeros(robots, MEMORY)
    memory["best"] = memory["closest"] = np.inf
    memory["evade_s"] = -1.0
    return memory


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
    """Run one tick of robots ``first`` to ``last - 1``; raises MissingExtraError without the library."""
    library = _library()
    prepare_all(first, last, ranges, percepts, shared, memories, decisions, scratch, rig, params)
    _ask_library(library, memories[first:last], percepts[first:last], rig, params)
    command_all(first, last, ranges, percepts, shared, memories, decisions, scratch, rig, params)


def check_available() -> None:
    """Raise a MissingExtraError when the library is not installed."""
    _library()


def _library() -> Any:
    """Return this thread's (segment, neighbour, behaviour) of the library."""
    found = getattr(_local, "library", None)
    if found is None:
        try:
            from navground.core import LineSegment, Neighbor
            from navground.core.behaviors import ORCABehavior
        except ImportError:
            raise MissingExtraError(f"planner '{NAME}'", "orca") from None
        found = _local.library = (LineSegment, Neighbor, ORCABehavior())
    return found


def _ask_library(library: Any, memories: np.ndarray, percepts: np.ndarray, rig: Rig, params: Params) -> None:
    """Write the library's answer to every robot that has a preferred velocity into its memory."""
    segment, neighbour, orca = library
    orca.radius = rig.body.radius_m
    orca.safety_margin = params.margin
    orca.time_horizon = params.horizon_s
    orca.static_time_horizon = params.obstacle_horizon_s
    orca.horizon = 2.0 * params.horizon_s * rig.body.v_max_mps + 2.0
    state = orca.environment_state
    lines, others, radii = memories["lines"], memories["others"], memories["radii"].tolist()
    asked = memories["lines_n"].tolist()
    others_n = memories["others_n"].tolist()
    own = np.stack([memories["vx"], memories["vy"]], axis=1)
    speed, turn = memories["speed"], memories["turn"]
    wanted = np.stack([speed * np.cos(turn), speed * np.sin(turn)], axis=1).astype(np.float32)
    dt = percepts["dt_s"].tolist()
    for i, n in enumerate(asked):
        if n < 0:
            continue
        ends, seen = lines[i], others[i]
        state.line_obstacles = [segment(a, b) for a, b in zip(ends[:n, 0], ends[:n, 1], strict=True)]
        m = others_n[i]
        state.neighbors = [neighbour(seen[k, 0], radii[i][k], seen[k, 1]) for k in range(m)]
        orca.velocity = own[i]
        x, y = orca.desired_velocity_towards_velocity(wanted[i], dt[i]).tolist()
        memories["ux"][i], memories["uy"][i] = x, y


@jit
def prepare_all(
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
    """Take in what robots ``first`` to ``last - 1`` are given; write what the library needs into their memory."""
    for i in range(first, last):
        begin(
            ranges[i],
            percepts[i],
            shared[i],
            decisions[i],
            scratch.work[i],
            scratch.edges[i],
            scratch.safe[i],
            scratch.header[i],
            scratch.angles[i],
            scratch.distances[i],
            rig,
            params.still_s,
        )
        _prefer(percepts[i], memories[i], decisions[i], scratch.work[i], scratch.safe[i], scratch.narrow[i],
                scratch.edges[i], rig, params)  # fmt: skip
        if memories[i]["lines_n"] < 0:
            continue
        _own_velocity(percepts[i], memories[i])
        _neighbours(percepts[i], shared[i], memories[i], rig, params)
        _segments(percepts[i], memories[i], scratch.work[i], scratch.narrow[i], scratch.edges[i], rig, params)


@jit
def command_all(
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
    """Turn the library's answers into commands, and let the guard have the last word."""
    for i in range(first, last):
        if memories[i]["lines_n"] >= 0:
            _command(percepts[i], memories[i], decisions[i], rig, params)
        finish(ranges[i], percepts[i], shared[i], decisions[i], scratch.edges[i], rig)


@jit_inner
def _prefer(
    percept: Row,
    memory: Row,
    decision: Row,
    work: np.ndarray,
    safe: np.ndarray,
    narrow: np.ndarray,
    edges: np.ndarray,
    rig: Rig,
    params: Params,
) -> None:
    """Choose the preferred velocity: towards the goal, along a border, or out of a jam."""
    goal, bearing, now = percept["goal_distance"], percept["goal_bearing"], percept["now_s"]
    memory["lines_n"] = -1
    if memory["arrived"] or goal <= params.arrive_m:
        memory["arrived"], memory["side"] = 1, 0
        halt(decision)
        decision["state"], decision["reason"], decision["side"] = ARRIVED, R_ARRIVED, 0
        return
    memory["lines_n"] = 0
    sensor = rig.sensor
    final = goal <= max(rig.protection.l_th + rig.footprint, rig.look_ahead)
    limit = min(goal, sensor.range_max)
    half_width = rig.body.radius_m + params.margin
    way = corridor_length(work, sensor.range_min, rig.cos, rig.sin, bearing, half_width, limit)
    memory["free"] = way >= min(goal, rig.look_ahead)
    if params.deadlock > 0.0:
        _watch(percept, memory, safe, way, rig, params)
    memory["turn"] = 0.0
    way_left = goal - 0.5 * params.arrive_m
    memory["speed"] = arrival_speed(way_left, rig.body.v_max_mps, rig.body.a_max_mps2, percept["dt_s"])
    decision["state"], decision["reason"] = ADVANCE, R_FINAL if final else R_FREE
    if memory["side"] != 0:
        _follow(percept, memory, decision, work, safe, narrow, edges, rig, params)
    elif now < memory["evade_s"]:
        memory["turn"] = -params.evade
        decision["state"], decision["reason"] = YIELD, R_YIELD
    decision["side"] = memory["side"]


@jit_inner
def _watch(percept: Row, memory: Row, safe: np.ndarray, way: float, rig: Rig, params: Params) -> None:
    """Notice progress and its absence: begin and end followings and evasions.

    ``way`` [m] is free towards the goal. A strict following ends where that leads closer to the goal than any before.
    """
    goal, now = percept["goal_distance"], percept["now_s"]
    free = memory["free"]
    if goal < memory["best"] - params.progress * params.stall_s * rig.body.v_max_mps:
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
    if now - memory["best_s"] < params.stall_s or now < memory["evade_s"]:
        return
    if free:
        if memory["others_n"] > 0:  # seen at the last tick
            memory["evade_s"] = memory["best_s"] = now + params.stall_s
        return
    again = memory["last_side"] != 0
    left, right = turn_to_safe(percept, safe, 1, rig), turn_to_safe(percept, safe, -1, rig)
    side = 1 if left < right or (left == right and percept["goal_bearing"] >= 0.0) else -1
    memory["side"] = memory["last_side"] if again else side
    memory["strict"] = again
    memory["closest"] = min(memory["closest"], goal - way)
    memory["wind"] = 0.0
    memory["target"] = percept["compass"] + percept["goal_bearing"]
    memory["loop_s"] = params.loop_s
    memory["turn_s"] = now + params.loop_s


@jit_inner
def _follow(
    percept: Row,
    memory: Row,
    decision: Row,
    work: np.ndarray,
    safe: np.ndarray,
    narrow: np.ndarray,
    edges: np.ndarray,
    rig: Rig,
    params: Params,
) -> None:
    """Prefer the first direction on the chosen side, counted from the border, that is free for a while."""
    sensor = rig.sensor
    side = memory["side"]
    bearing = percept["goal_bearing"]
    target = percept["compass"] + bearing
    wind = memory["wind"] - side * wrap_angle(target - memory["target"])
    back = max(0.0, wind - params.turn_back)
    start = bearing + side * back
    decision["state"], decision["reason"] = FOLLOW, R_LOOP if memory["strict"] else R_FOLLOW
    heading, found = 0.0, False
    for level in range(1, 3):
        count = safe_directions(
            work, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[level], edges, narrow
        )
        if count > 0:
            heading, found = first_safe(
                narrow, start, side, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps
            )
        if found:
            break
    if found:
        memory["wind"] = back + angle_from(0.0, side * (heading - start))
        memory["target"] = target
    else:
        if percept["now_s"] >= memory["lost_s"]:  # held for a while: two ways out would take turns
            memory["lost_s"] = percept["now_s"] + params.stall_s
            memory["lost"] = percept["compass"] + _longest_way(work, rig)
        heading = memory["lost"] - percept["compass"]
        decision["reason"] = R_LOST
    memory["turn"] = wrap_angle(heading - bearing)
    memory["speed"] = rig.body.v_max_mps


@jit_inner
def _longest_way(work: np.ndarray, rig: Rig) -> float:
    """Return the direction (body frame) in which the guard would let the robot drive farthest."""
    sensor = rig.sensor
    best, at = -1.0, 0.0
    for n in range(0, sensor.beams, LOST_BEAMS):
        bearing = sensor.angle_min + n * sensor.increment
        way = corridor_length(
            work, sensor.range_min, rig.cos, rig.sin, bearing, rig.body.radius_m + rig.clearance, sensor.range_max
        )
        if way > best:
            best, at = way, bearing
    return at


@jit_inner
def _own_velocity(percept: Row, memory: Row) -> None:
    """Write our own velocity, ahead at the measured speed."""
    bearing = percept["goal_bearing"]
    memory["vx"], memory["vy"] = math.cos(bearing) * percept["speed"], -math.sin(bearing) * percept["speed"]


@jit_inner
def _neighbours(percept: Row, shared: Row, memory: Row, rig: Rig, params: Params) -> None:
    """Write the neighbours that move; those that stand are in the scan, as obstacles."""
    turn = percept["compass"] + percept["goal_bearing"]
    c, s = math.cos(turn), math.sin(turn)
    count = 0
    for t in range(PEERS):
        if shared["track_id"][t] < 0 or percept["now_s"] - shared["track_moved_s"][t] >= params.still_s:
            continue
        x, y = shared["track_x"][t], shared["track_y"][t]
        memory["others"][count, 0, 0], memory["others"][count, 0, 1] = c * x + s * y, c * y - s * x
        memory["radii"][count] = rig.body.radius_m + rig.sensor.position_sigma * math.sqrt(x * x + y * y)
        x, y = shared["track_vx"][t], shared["track_vy"][t]
        memory["others"][count, 1, 0], memory["others"][count, 1, 1] = c * x + s * y, c * y - s * x
        count += 1
    memory["others_n"] = count


@jit_inner
def _segments(
    percept: Row, memory: Row, work: np.ndarray, keep: np.ndarray, hits: np.ndarray, rig: Rig, params: Params
) -> None:
    """Write the border in reach as segments. ``keep (M,) uint8``, ``hits (M + 1,) int16`` are scratch.

    Neighbouring returns are joined when the body does not fit between them, so that what is too narrow is closed;
    then every chain is divided where it is farthest from its chord (Douglas and Peucker) until ``LINE_ERROR`` holds.
    """
    sensor = rig.sensor
    reach = rig.body.v_max_mps * params.obstacle_horizon_s + rig.body.radius_m + params.margin
    count = 0
    for n in range(sensor.beams):
        if sensor.range_min <= work[n] < reach and work[n] > 0.0:
            hits[count] = n
            count += 1
    if count == 0:
        return
    widest, last = -1.0, 0  # the ring of returns is cut at its widest gap, wherever the scan begins
    for k in range(count):
        gap = _gap(work, hits[k], hits[(k + 1) % count], rig)
        if gap > widest:
            widest, last = gap, k
    closed = 2.0 * (rig.body.radius_m + params.margin)
    error = LINE_ERROR
    while True:
        if _divide(percept, memory, work, keep, hits, count, (last + 1) % count, closed, error, rig):
            break
        error *= 1.5
    _sort(memory["lines"], memory["lines_n"])


@jit_inner
def _sort(lines: np.ndarray, count: int) -> None:
    """Order segments by the distance of their middle: where two touch, the library's answer depends on the order."""
    for k in range(1, count):
        ax, ay, bx, by = lines[k, 0, 0], lines[k, 0, 1], lines[k, 1, 0], lines[k, 1, 1]
        middle = (ax + bx) * (ax + bx) + (ay + by) * (ay + by)
        j = k
        while j > 0 and middle < (lines[j - 1, 0, 0] + lines[j - 1, 1, 0]) ** 2 + (
            lines[j - 1, 0, 1] + lines[j - 1, 1, 1]
        ) ** 2:
            for end in range(2):
                lines[j, end, 0], lines[j, end, 1] = lines[j - 1, end, 0], lines[j - 1, end, 1]
            j -= 1
        lines[j, 0, 0], lines[j, 0, 1], lines[j, 1, 0], lines[j, 1, 1] = ax, ay, bx, by


@jit_inner
def _gap(work: np.ndarray, a: int, b: int, rig: Rig) -> float:
    """Return the distance [m] between the returns of two beams."""
    dx = work[a] * rig.cos[a] - work[b] * rig.cos[b]
    dy = work[a] * rig.sin[a] - work[b] * rig.sin[b]
    return math.sqrt(dx * dx + dy * dy)


@jit_inner
def _divide(
    percept: Row,
    memory: Row,
    work: np.ndarray,
    keep: np.ndarray,
    hits: np.ndarray,
    count: int,
    begin_at: int,
    closed: float,
    error: float,
    rig: Rig,
) -> bool:
    """Write chains of returns as segments with at most ``error`` [m]; return whether there was room for all."""
    for k in range(count):
        keep[k] = 0
    keep[0] = keep[count - 1] = 1  # by place after ``begin_at``
    for k in range(1, count):
        if _gap(work, hits[(begin_at + k - 1) % count], hits[(begin_at + k) % count], rig) > closed:
            keep[k - 1] |= 1
            keep[k] |= 3  # a chain begins here
    memory["lines_n"] = 0
    a = 0
    while a < count:
        b = a + 1
        while b < count and keep[b] == 0:
            b += 1
        if b == count or keep[b] & 2:  # the end of a chain
            if a == 0 or keep[a] & 2:
                if memory["lines_n"] == MAX_LINES:
                    return False
                _put_dot(percept, memory, work, hits[(begin_at + a) % count], rig)
            a = b
            continue
        na, nb = hits[(begin_at + a) % count], hits[(begin_at + b) % count]
        ax, ay = work[na] * rig.cos[na], work[na] * rig.sin[na]
        bx, by = work[nb] * rig.cos[nb], work[nb] * rig.sin[nb]
        worst, at = error, -1
        for k in range(a + 1, b):
            n = hits[(begin_at + k) % count]
            far = point_segment_distance(work[n] * rig.cos[n], work[n] * rig.sin[n], ax, ay, bx, by)
            if far > worst:
                worst, at = far, k
        if at >= 0:
            keep[at] |= 1
            continue
        if memory["lines_n"] == MAX_LINES:
            return False
        _put(percept, memory, ax, ay, bx, by)
        a = b
    return True


@jit_inner
def _put_dot(percept: Row, memory: Row, work: np.ndarray, n: int, rig: Rig) -> None:
    """Add a segment as wide as its beam for a return that stands alone."""
    half = max(0.005, 0.5 * work[n] * rig.sensor.increment)
    x, y = work[n] * rig.cos[n], work[n] * rig.sin[n]
    dx, dy = half * rig.sin[n], -half * rig.cos[n]
    _put(percept, memory, x + dx, y + dy, x - dx, y - dy)


@jit_inner
def _put(percept: Row, memory: Row, ax: float, ay: float, bx: float, by: float) -> None:
    """Add segment a-b (body frame) to the robot's, unless it has no length."""
    if (bx - ax) * (bx - ax) + (by - ay) * (by - ay) < 1e-8:
        return
    c, s = math.cos(percept["goal_bearing"]), math.sin(percept["goal_bearing"])
    n = memory["lines_n"]
    memory["lines"][n, 0, 0], memory["lines"][n, 0, 1] = c * ax + s * ay, c * ay - s * ax
    memory["lines"][n, 1, 0], memory["lines"][n, 1, 1] = c * bx + s * by, c * by - s * bx
    memory["lines_n"] = n + 1


@jit_inner
def _command(percept: Row, memory: Row, decision: Row, rig: Rig, params: Params) -> None:
    """Ask for the velocity that the library answered, as far as the wheels can."""
    bearing = percept["goal_bearing"]
    c, s = math.cos(bearing), math.sin(bearing)
    x, y = c * memory["ux"] - s * memory["uy"], s * memory["ux"] + c * memory["uy"]
    speed = min(rig.body.v_max_mps, math.sqrt(x * x + y * y))
    heading = math.atan2(y, x) if speed > 1e-6 else 0.0
    if not speed >= params.creep * memory["speed"] and memory["free"] == 0 and memory["side"] == 0:
        speed = 0.0
        if decision["state"] == ADVANCE:
            decision["state"], decision["reason"] = YIELD, R_BLOCKED_WAIT
    head_for(decision, percept, heading, speed, rig)
