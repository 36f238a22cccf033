"""Nav-SCOPE: advance while the target direction is safe; else choose a side with the neighbours' help and follow.

The four states of Nav-SCOPE V-A with what the paper leaves open: a final approach to goals near obstacles,
an end to every wait, and an end to every loop (docs/safety.md).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import TWO_PI, angle_from, wrap_angle
from swarmscope.onboard.control.guard import halt, head_for
from swarmscope.onboard.control.unicycle import FULL_SPEED_WITHIN, arrival_speed
from swarmscope.onboard.percept import PEERS, Rig, Row, Scratch
from swarmscope.onboard.perception.safety import beam_of, corridor_length, safe_directions
from swarmscope.onboard.planning._contract import (
    ADVANCE,
    ARRIVED,
    DECIDE,
    ESCAPE,
    FOLLOW,
    R_ALONE,
    R_ANSWERS,
    R_ARRIVED,
    R_DEAD_END,
    R_FINAL,
    R_FOLLOW,
    R_FREE,
    R_FUSED,
    R_LOOP,
    R_LOST,
    R_YIELD,
    YIELD,
)
from swarmscope.onboard.planning.fields import interaction_force, yields_to
from swarmscope.onboard.planning.fusion import choose_side
from swarmscope.onboard.sharing.inbox import answer_all, ask, start_round, waiting_for_answers
from swarmscope.onboard.tick import begin, features, finish

NAME = "nav-scope"
SUMMARY = "Nav-SCOPE: safe directions, features of neighbours on request, fused choice of side, four states"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours, features on request"
LOG = 16
LEAVE_GAIN = 0.5
"""How much closer than ever before to the goal the free way must lead for a strict following to end [m]."""


class Params(NamedTuple):
    """What can be set. Distances in m, times in s."""

    w_i: float = 1.0
    """Weight of the neighbours (12); 0 is Nav-I."""
    prior: float = 3.0
    """Weight of the turn in sight [1/rad] in the bias b_0 of (9); 0 as printed."""
    ask_ahead_s: float = 0.8
    """Features are asked for this long before the obstacle comes within the horizon."""
    ask_every_s: float = 1.0
    """Shortest time between two rounds of requests; an answer takes two ticks and twice the radio's latency."""
    patience_s: float = 0.6
    """How long a decision waits for answers that are still out."""
    arrive_m: float = 0.05
    """Distance to the goal at which a robot has arrived."""
    still_s: float = 0.6
    """A neighbour that has not moved for so long is an obstacle."""
    wait_s: float = 2.0
    """Longest wait for a neighbour to pass; after it the neighbour is an obstacle for the same time."""
    wide_turn: float = 1.0
    """Turn from the target [rad] beyond which narrower gaps are looked for."""
    stuck_s: float = 20.0
    """A following that gets no closer to the goal for so long is a loop."""
    turn_back: float = 1.75
    """A following turns back towards the target by at most this in one tick [rad]."""
    resume_m: float = 0.5
    """An obstacle met so soon after a following ended is the same one: the side stays."""
    loop_m: float = 1.0
    """A second choice of side this close to an earlier one, without progress, is a loop."""


MEMORY = np.dtype(
    [
        ("mode", np.uint8),
        ("side", np.int8),
        ("strict", np.uint8),  # follows the border until closer to the goal than ever (after a loop)
        ("heading", np.float64),  # direction of travel, compass frame [rad]
        ("turning", np.uint8),  # turns on the spot towards it
        ("wind", np.float64),  # how far the following has turned off the target; may exceed 2 pi [rad]
        ("target", np.float64),  # direction of the target at the last tick, compass frame [rad]
        ("travel", np.float64),  # way made so far, by odometry [m]
        ("left_at", np.float64),  # of it when the last following ended [m]
        ("last_side", np.int8),  # side of the last following
        ("best", np.float64),  # smallest goal distance so far [m]
        ("best_s", np.float64),  # when
        ("closest", np.float64),  # goal distance of the nearest free point ever seen on the way to the goal [m]
        ("stuck_s", np.float64),  # how long without progress is a loop; doubles with every one in a row
        ("wait_s", np.float64),  # when the present wait began, -1 = none
        ("push_s", np.float64),  # until when waiting is not allowed
        ("log_n", np.int64),  # choices of a side so far
        ("log_x", np.float64, LOG),
        ("log_y", np.float64, LOG),
        ("log_goal", np.float64, LOG),
        ("log_travel", np.float64, LOG),
        ("log_side", np.int8, LOG),
    ]
)


def new_memory(robots: int) -> np.ndarray:
    """Return the memory of ``robots`` robots that have seen nothing yet."""
    memory = np.zeros(robots, MEMORY)
    memory["wait_s"] = -1.0
    memory["best"] = np.inf
    memory["closest"] = np.inf
    memory["left_at"] = -np.inf
    return memory


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
    """Run one tick of the robot whose working arrays are row ``row``: scan to command, packets and reason."""
    work, safe, edges = scratch.work[row], scratch.safe[row], scratch.edges[row]
    angles, distances = scratch.angles[row], scratch.distances[row]
    safe_count = begin(
        ranges,
        percept,
        shared,
        decision,
        work,
        edges,
        safe,
        scratch.header[row],
        angles,
        distances,
        rig,
        params.still_s,
    )
    count = -1
    if wants_features(percept, shared, memory, safe, rig):
        count = features(
            work,
            percept,
            edges,
            scratch.narrow[row],
            scratch.padded[row],
            angles,
            distances,
            scratch.filtered[row],
            rig,
        )
    if shared["ask_n"] > 0:
        answer_all(percept, shared, decision, rig, angles[0], distances[0], count)
    decide(
        ranges,
        percept,
        shared,
        memory,
        decision,
        work,
        safe,
        safe_count,
        scratch.narrow[row],
        edges,
        angles,
        distances,
        count,
        rig,
        params,
    )
    finish(ranges, percept, shared, decision, edges, rig)


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


@jit
def decide(
    ranges: np.ndarray,
    percept: Row,
    shared: Row,
    memory: Row,
    decision: Row,
    masked: np.ndarray,
    safe: np.ndarray,
    safe_count: int,
    narrow: np.ndarray,
    edges: np.ndarray,
    features: np.ndarray,
    distances: np.ndarray,
    count: int,
    rig: Rig,
    params: Params,
) -> None:
    """Choose state, heading and speed. ``features``, ``distances (2, K)``: ours in row 0 (compass frame), scratch 1.

    ``masked`` is the scan without moving neighbours, ``safe`` its safe directions; ``count`` is -1 when our
    features were not computed in this tick (see ``wants_features``).
    """
    goal = percept["goal_distance"]
    now = percept["now_s"]
    if memory["mode"] == ARRIVED or goal <= params.arrive_m:
        memory["mode"] = ARRIVED
        halt(decision)
        _say(decision, memory, ARRIVED, R_ARRIVED)
        return
    memory["travel"] += math.sqrt(percept["odom_x"] ** 2 + percept["odom_y"] ** 2)
    _watch_progress(memory, goal, now, params)
    sensor = rig.sensor
    bearing = percept["goal_bearing"]
    speed = arrival_speed(goal - 0.5 * params.arrive_m, rig.body.v_max, rig.body.a_max, percept["dt_s"])
    final = goal <= max(rig.protection.l_th + rig.footprint, rig.look_ahead)
    if final:
        free = (
            corridor_length(
                masked, sensor.range_min, rig.cos, rig.sin, bearing, rig.footprint, goal
            )
            >= goal
        )
    else:
        beam = beam_of(bearing, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
        free = beam >= 0 and safe[beam] == 1
    if free and (memory["strict"] == 0 or _may_leave(masked, percept, memory, rig)):
        if memory["mode"] == FOLLOW:
            memory["left_at"], memory["last_side"] = memory["travel"], memory["side"]
        memory["side"] = 0
        memory["strict"] = 0
        memory["mode"] = ADVANCE
        head_for(decision, percept, bearing, speed, rig)
        _say(decision, memory, ADVANCE, R_FINAL if final else R_FREE)
        _request_ahead(masked, percept, shared, decision, rig, params)
    else:
        if memory["mode"] != FOLLOW:
            memory["closest"] = min(memory["closest"], _nearest_in_sight(masked, percept, rig))
            if not _decide_side(percept, shared, memory, decision, rig, params, safe, features, distances, count):
                return
        _follow(ranges, masked, percept, memory, decision, safe, safe_count, narrow, edges, rig, params, speed)
    _yield(percept, shared, memory, decision, rig, params)
    memory["heading"] = percept["compass"] + decision["heading"]


@jit_inner
def _watch_progress(memory: Row, goal: float, now: float, params: Params) -> None:
    """Notice a following that gets no closer to the goal for long: follow strictly, then on the other side."""
    if goal < memory["best"] - 0.3:
        memory["best"], memory["best_s"], memory["stuck_s"] = goal, now, params.stuck_s
    if memory["mode"] != FOLLOW or now - memory["best_s"] < memory["stuck_s"]:
        return
    memory["best_s"] = now
    memory["stuck_s"] = 2.0 * memory["stuck_s"]
    if memory["strict"]:
        memory["side"] = -memory["side"]
        memory["wind"] = max(0.0, TWO_PI - memory["wind"])
    memory["strict"] = 1


@jit
def wants_features(percept: Row, shared: Row, memory: Row, safe: np.ndarray, rig: Rig) -> bool:
    """Tell whether our own features are needed in this tick: somebody asked, or a side may have to be chosen."""
    if shared["ask_n"] > 0:
        return True
    if memory["mode"] == ARRIVED or memory["mode"] == FOLLOW:
        return False
    sensor = rig.sensor
    beam = beam_of(percept["goal_bearing"], sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
    return beam < 0 or safe[beam] == 0


@jit_inner
def _say(decision: Row, memory: Row, state: int, reason: int) -> None:
    """Note state and reason for people to read."""
    decision["state"], decision["reason"], decision["side"] = state, reason, memory["side"]


@jit_inner
def _may_leave(masked: np.ndarray, percept: Row, memory: Row, rig: Rig) -> bool:
    """Tell whether a strict following may end: the way to the goal is seen free until closer than ever before."""
    in_sight = _nearest_in_sight(masked, percept, rig)
    return in_sight <= 0.0 or in_sight < memory["closest"] - LEAVE_GAIN


@jit_inner
def _nearest_in_sight(masked: np.ndarray, percept: Row, rig: Rig) -> float:
    """Return the goal distance [m] up to which the straight way to the goal is seen to be free."""
    sensor = rig.sensor
    goal = percept["goal_distance"]
    limit = min(goal, sensor.range_max)
    free = corridor_length(
        masked, sensor.range_min, rig.cos, rig.sin, percept["goal_bearing"], rig.footprint, limit
    )
    return float(goal - free)


@jit_inner
def _request_ahead(
    masked: np.ndarray, percept: Row, shared: Row, decision: Row, rig: Rig, params: Params
) -> None:
    """Ask the neighbours in the pass band for features when an obstacle nears the planning distance."""
    now = percept["now_s"]
    if params.w_i <= 0.0 or now - shared["asked_s"] < params.ask_every_s:
        return
    sensor = rig.sensor
    horizon = max(rig.protection.l_th, rig.look_ahead) + params.ask_ahead_s * rig.body.v_max
    if percept["goal_distance"] <= horizon:
        return
    centre = beam_of(percept["goal_bearing"], sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
    for k in range(-rig.half, rig.half + 1):
        n = (centre + k) % sensor.beams if sensor.wraps else centre + k
        if 0 <= n < sensor.beams and masked[n] < horizon and masked[n] * abs(
            math.sin(k * sensor.increment)
        ) < rig.footprint:
            _ask_neighbours(percept, shared, decision, rig)
            return


@jit_inner
def _ask_neighbours(percept: Row, shared: Row, decision: Row, rig: Rig) -> None:
    """Start a round of requests to every neighbour seen now in the pass band (sigma_a, 3 sigma_a]."""
    start_round(percept, shared)
    sigma = rig.protection.sigma_a
    for k in range(percept["n_neighbours"]):
        x, y = percept["neighbour_x"][k], percept["neighbour_y"][k]
        distance = math.sqrt(x * x + y * y)
        ahead = abs(wrap_angle(math.atan2(y, x) - percept["goal_bearing"])) <= 0.5 * math.pi
        if ahead and sigma - 0.2 < distance <= 3.0 * sigma + 0.2:
            ask(percept, shared, decision, percept["neighbour_id"][k])


@jit_inner
def _decide_side(
    percept: Row,
    shared: Row,
    memory: Row,
    decision: Row,
    rig: Rig,
    params: Params,
    safe: np.ndarray,
    features: np.ndarray,
    distances: np.ndarray,
    count: int,
) -> bool:
    """State ii: choose the side, waiting for answers that are still out. Return whether it is chosen."""
    now = percept["now_s"]
    if memory["travel"] - memory["left_at"] < params.resume_m:
        memory["side"], memory["mode"], memory["wind"] = memory["last_side"], FOLLOW, 0.0
        memory["target"] = percept["compass"] + percept["goal_bearing"]
        return True
    if params.w_i > 0.0 and memory["mode"] != DECIDE and now - shared["asked_s"] >= params.ask_every_s:
        _ask_neighbours(percept, shared, decision, rig)
    memory["mode"] = DECIDE
    if waiting_for_answers(percept, shared, params.patience_s):
        halt(decision)
        _say(decision, memory, DECIDE, R_ANSWERS)
        return False
    bias = params.prior * (turn_to_safe(percept, safe, -1, rig) - turn_to_safe(percept, safe, 1, rig))
    side = choose_side(
        percept,
        shared,
        decision,
        rig,
        params.w_i,
        bias,
        features[0],
        distances[0],
        max(0, count),
        features[1],
        distances[1],
    )
    memory["side"] = _break_loop(percept, shared, memory, params, side)
    _say(decision, memory, DECIDE, R_LOOP if memory["strict"] else (R_FUSED if decision["heard"] else R_ALONE))
    memory["mode"], memory["wind"] = FOLLOW, 0.0
    memory["target"] = percept["compass"] + percept["goal_bearing"]
    return True


@jit_inner
def _break_loop(percept: Row, shared: Row, memory: Row, params: Params, side: int) -> int:
    """Log the choice; when it repeats an earlier one without progress, follow strictly on that earlier side."""
    x, y, goal = shared["x"], shared["y"], percept["goal_distance"]
    known = min(LOG, memory["log_n"])
    for k in range(known):
        j = (memory["log_n"] - 1 - k) % LOG
        d = math.sqrt((x - memory["log_x"][j]) ** 2 + (y - memory["log_y"][j]) ** 2)
        if memory["travel"] - memory["log_travel"][j] < 2.0 * params.loop_m:
            continue
        if d < params.loop_m and goal > memory["log_goal"][j] - 0.2:
            memory["strict"] = 1
            side = memory["log_side"][j]
            break
    j = memory["log_n"] % LOG
    memory["log_x"][j], memory["log_y"][j], memory["log_goal"][j] = x, y, goal
    memory["log_side"][j], memory["log_travel"][j] = side, memory["travel"]
    memory["log_n"] += 1
    return side


@jit_inner
def _follow(
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
    params: Params,
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
    back = max(0.0, wind - params.turn_back)
    start = percept["goal_bearing"] + side * back
    if memory["strict"]:
        reason = R_LOOP
    heading, found = first_safe(safe, start, side, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
    turn = angle_from(0.0, side * (heading - start))
    for level in range(1, 3):
        if found and (level == 2 or turn <= params.wide_turn):
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


@jit_inner
def _yield(
    percept: Row, shared: Row, memory: Row, decision: Row, rig: Rig, params: Params
) -> None:
    """State iv: wait for a neighbour whose repulsion outweighs our own propulsion (17), but not for ever."""
    now = percept["now_s"]
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
def _must_wait(
    percept: Row, shared: Row, decision: Row, rig: Rig, params: Params
) -> bool:
    """Tell whether (17) holds for a moving neighbour that goes before us.

    It does when it drives away from us (we follow it) or, heads-on or crossing, has the smaller radio address.
    """
    travel = percept["compass"] + decision["heading"]
    for t in range(PEERS):
        if shared["track_id"][t] < 0 or percept["now_s"] - shared["track_moved_s"][t] >= params.still_s:
            continue
        x, y = shared["track_x"][t], shared["track_y"][t]
        distance = math.sqrt(x * x + y * y)
        if distance >= rig.protection.sigma_a or distance < 1e-6:
            continue
        force = interaction_force(distance, rig.protection.sigma_a, max(params.w_i, 1.0))
        bearing = math.atan2(y, x)
        if not yields_to(0.5, force, math.cos(bearing - travel)):
            continue
        faces_us = math.cos(shared["track_yaw"][t] - bearing - math.pi) > 0.3
        if not faces_us or shared["track_id"][t] < percept["id"]:
            return True
    return False
