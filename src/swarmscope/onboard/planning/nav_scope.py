"""Nav-SCOPE: advance while the target direction is safe; else choose a side with the neighbours' help and follow.

The four states of Nav-SCOPE V-A with what the paper leaves open: a final approach to goals near obstacles,
an end to every wait, and an end to every loop (docs/safety.md).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.control.guard import halt
from swarmscope.onboard.control.unicycle import arrival_speed
from swarmscope.onboard.percept import PEERS, Rig, Row, Scratch
from swarmscope.onboard.perception.safety import beam_of, corridor_length
from swarmscope.onboard.planning._asking import ask_neighbours, request_ahead
from swarmscope.onboard.planning._contract import (
    ARRIVED,
    DECIDE,
    FOLLOW,
    R_ALONE,
    R_ANSWERS,
    R_ARRIVED,
    R_FINAL,
    R_FREE,
    R_FUSED,
    R_LOOP,
)
from swarmscope.onboard.planning._following import (
    advance,
    begin_following,
    break_loop,
    follow,
    may_leave,
    nearest_in_sight,
    reconsider,
    resume,
    side_bias,
    watch_progress,
)
from swarmscope.onboard.planning._memory import MEMORY, new_memory, say
from swarmscope.onboard.planning._waiting import wait
from swarmscope.onboard.planning.fields import interaction_force, yields_to
from swarmscope.onboard.planning.fusion import choose_side
from swarmscope.onboard.sharing.inbox import answer_all, waiting_for_answers
from swarmscope.onboard.tick import begin, features, finish

__all__ = ["MEMORY", "NAME", "NEEDS", "SUMMARY", "Params", "new_memory", "step", "step_all"]

NAME = "nav-scope"
SUMMARY = "Nav-SCOPE: safe directions, features of neighbours on request, fused choice of side, four states"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours, features on request"


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
    reopen: float = 0.5
    """A following changes sides when the way on the other side turns off the target by this much less [rad];
    0 as printed."""
    loop_m: float = 1.0
    """A second choice of side this close to an earlier one, without progress, is a loop."""


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
    step_told(ranges, percept, shared, memory, decision, scratch, row, rig, params, 0)


@jit
def step_told(
    ranges: np.ndarray,
    percept: Row,
    shared: Row,
    memory: Row,
    decision: Row,
    scratch: Scratch,
    row: int,
    rig: Rig,
    params: Params,
    told: int,
) -> None:
    """Run one tick; where a side has to be chosen it is ``told`` (+1 left, -1 right) instead, unless that is 0."""
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
        told,
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
    told: int,
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
        say(decision, memory, ARRIVED, R_ARRIVED)
        return
    memory["travel"] += math.sqrt(percept["odom_x"] ** 2 + percept["odom_y"] ** 2)
    watch_progress(memory, goal, now, params.stuck_s)
    sensor = rig.sensor
    bearing = percept["goal_bearing"]
    speed = arrival_speed(goal - 0.5 * params.arrive_m, rig.body.v_max_mps, rig.body.a_max_mps2, percept["dt_s"])
    final = goal <= max(rig.protection.l_th + rig.footprint, rig.look_ahead)
    if final:
        free = corridor_length(masked, sensor.range_min, rig.cos, rig.sin, bearing, rig.footprint, goal) >= goal
    else:
        beam = beam_of(bearing, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
        free = beam >= 0 and safe[beam] == 1
    if free and (memory["strict"] == 0 or may_leave(masked, percept, memory, rig)):
        advance(percept, memory, decision, rig, speed, R_FINAL if final else R_FREE)
        if params.w_i > 0.0:
            request_ahead(masked, percept, shared, decision, rig, params.ask_ahead_s, params.ask_every_s)
    else:
        if memory["mode"] != FOLLOW:
            memory["closest"] = min(memory["closest"], nearest_in_sight(masked, percept, rig))
            if not _decide_side(
                percept, shared, memory, decision, rig, params, safe, features, distances, count, told
            ):
                return
        else:
            reconsider(percept, shared, memory, safe, rig, params.loop_m, params.reopen)
        follow(
            ranges, masked, percept, memory, decision, safe, safe_count, narrow, edges, rig,
            params.wide_turn, params.turn_back, speed,
        )  # fmt: skip
    wait(memory, decision, _must_wait(percept, shared, decision, rig, params), now, params.wait_s)
    memory["heading"] = percept["compass"] + decision["heading"]


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
    told: int,
) -> bool:
    """State ii: choose the side, waiting for answers that are still out. Return whether it is chosen."""
    now = percept["now_s"]
    if resume(percept, memory, params.resume_m):
        return True
    if params.w_i > 0.0 and memory["mode"] != DECIDE and now - shared["asked_s"] >= params.ask_every_s:
        ask_neighbours(percept, shared, decision, rig)
    memory["mode"] = DECIDE
    if waiting_for_answers(percept, shared, params.patience_s):
        halt(decision)
        say(decision, memory, DECIDE, R_ANSWERS)
        return False
    bias = side_bias(percept, safe, params.prior, rig)
    side = choose_side(
        percept, shared, decision, rig, params.w_i, bias, False,
        features[0], distances[0], max(0, count), features[1], distances[1],
    )  # fmt: skip
    if told != 0:
        side = told
        decision["p_left"] = 1.0 if told > 0 else 0.0
    begin_following(percept, memory, break_loop(percept, shared, memory, params.loop_m, side))
    say(decision, memory, DECIDE, R_LOOP if memory["strict"] else (R_FUSED if decision["heard"] else R_ALONE))
    return True


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
