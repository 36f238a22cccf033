"""SFM-MAS: social forces decide when to stop, on which side to pass and who goes first.

The four states of SFM-MAS IV. The forces are those of the letter; where it leaves things open (how far ahead an
obstacle counts, loops, ends of waits) it shares the machinery of Nav-SCOPE (docs/theory.md, section 12).
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
from swarmscope.onboard.planning._asking import ask_neighbours
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
from swarmscope.onboard.planning.fields import (
    interaction_force,
    obstacle_constant,
    obstacle_force,
    propulsion,
    yields_to,
)
from swarmscope.onboard.planning.fusion import choose_side
from swarmscope.onboard.sharing.inbox import answer_all, waiting_for_answers
from swarmscope.onboard.tick import begin, features, finish

__all__ = ["MEMORY", "NAME", "NEEDS", "SUMMARY", "Params", "new_memory", "step", "step_all"]

NAME = "sfm-mas"
SUMMARY = "SFM-MAS: social forces for stopping, choice of side with the neighbours asked then, and priority"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours, features on request"
P_FREE = 0.5
"""P_s while no obstacle is observed (7); taken in every balance of forces, where it cancels or favours no side."""
LEVEL = 0.1
"""Two robots whose cosines differ by less are equally far ahead; the smaller radio address goes first."""


class Params(NamedTuple):
    """What can be set. Distances in m, times in s."""

    w_i: float = 1.0
    """Weight of the neighbours (14); 0 is SFM-I."""
    prior: float = 3.0
    """Weight of the turn in sight [1/rad] in the bias b_0 of (7); 0 as printed."""
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
    work, safe, edges, narrow = scratch.work[row], scratch.safe[row], scratch.edges[row], scratch.narrow[row]
    angles, distances = scratch.angles[row], scratch.distances[row]
    safe_count = begin(
        ranges, percept, shared, decision, work, edges, safe,
        scratch.header[row], angles, distances, rig, params.still_s,
    )  # fmt: skip
    free = way_is_free(work, percept, safe, rig)
    count = 0
    if shared["ask_n"] > 0 or (not free and memory["mode"] != FOLLOW and memory["mode"] != ARRIVED):
        count = features(
            work, percept, edges, narrow, scratch.padded[row], angles, distances, scratch.filtered[row], rig
        )
    if shared["ask_n"] > 0:
        answer_all(percept, shared, decision, rig, angles[0], distances[0], count)
    goal = percept["goal_distance"]
    if memory["mode"] == ARRIVED or goal <= params.arrive_m:
        memory["mode"] = ARRIVED
        halt(decision)
        say(decision, memory, ARRIVED, R_ARRIVED)
    else:
        memory["travel"] += math.sqrt(percept["odom_x"] ** 2 + percept["odom_y"] ** 2)
        watch_progress(memory, goal, percept["now_s"], params.stuck_s)
        speed = arrival_speed(goal - 0.5 * params.arrive_m, rig.body.v_max_mps, rig.body.a_max_mps2, percept["dt_s"])
        if free and (memory["strict"] == 0 or may_leave(work, percept, memory, rig)):
            advance(percept, memory, decision, rig, speed, R_FINAL if is_final(percept, rig) else R_FREE)
        elif memory["mode"] == FOLLOW or _decide(
            percept, shared, memory, decision, rig, params, work, safe, angles, distances, count
        ):
            if not decision["fused"]:
                reconsider(percept, shared, memory, safe, rig, params.loop_m, params.reopen)
            follow(
                ranges, work, percept, memory, decision, safe, safe_count, narrow, edges, rig,
                params.wide_turn, params.turn_back, speed,
            )  # fmt: skip
        if memory["mode"] != DECIDE:
            _avoid(percept, shared, memory, decision, rig, params)
            memory["heading"] = percept["compass"] + decision["heading"]
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
def is_final(percept: Row, rig: Rig) -> bool:
    """Tell whether the goal is so near that only the way to the goal itself has to be free."""
    return bool(percept["goal_distance"] <= max(rig.protection.l_th + rig.footprint, rig.look_ahead))


@jit
def way_is_free(masked: np.ndarray, percept: Row, safe: np.ndarray, rig: Rig) -> bool:
    """Tell whether no obstacle stops the way to the goal (26) and its direction is safe."""
    sensor = rig.sensor
    bearing, goal = percept["goal_bearing"], percept["goal_distance"]
    if is_final(percept, rig):
        return bool(
            corridor_length(masked, sensor.range_min, rig.cos, rig.sin, bearing, rig.footprint, goal) >= goal
        )
    beam = beam_of(bearing, sensor.angle_min, sensor.increment, sensor.beams, sensor.wraps)
    return bool(beam >= 0 and safe[beam] == 1 and not obstacle_stops(masked, bearing, rig))


@jit
def obstacle_stops(masked: np.ndarray, bearing: float, rig: Rig) -> bool:
    """Tell whether (18) holds along ``bearing`` (body frame): one return's repulsion outweighs the propulsion.

    Forces balance at the look-ahead distance, for returns in the way of the body; without look-ahead at l_th
    on the edge of the safety sector, for returns in the sector, as printed. Every return counts as an obstacle.
    """
    printed = rig.look_ahead <= 0.0
    reach = rig.protection.l_th if printed else max(rig.protection.l_th, rig.look_ahead)
    half = 0.5 * rig.protection.alpha if printed else math.asin(min(1.0, rig.footprint / reach))
    edge = math.cos(half)
    own = propulsion(1.0, P_FREE)
    constant = obstacle_constant(own, reach, half)
    far = reach / math.sqrt(edge)
    c, s = math.cos(bearing), math.sin(bearing)
    for n in range(masked.size):
        d = masked[n]
        if d > far:
            continue
        ahead = rig.cos[n] * c + rig.sin[n] * s
        if ahead <= 0.0:
            continue
        if not d >= rig.sensor.range_min:
            return True
        across = d * abs(rig.sin[n] * c - rig.cos[n] * s)
        seen = ahead >= edge if printed else across < rig.footprint
        if seen and yields_to(own, obstacle_force(d, constant), ahead):
            return True
    return False


@jit_inner
def _decide(
    percept: Row,
    shared: Row,
    memory: Row,
    decision: Row,
    rig: Rig,
    params: Params,
    masked: np.ndarray,
    safe: np.ndarray,
    features: np.ndarray,
    distances: np.ndarray,
    count: int,
) -> bool:
    """Fusion decision (IV-B): ask, wait for the answers, choose the side. Return whether it is chosen."""
    memory["closest"] = min(memory["closest"], nearest_in_sight(masked, percept, rig))
    if resume(percept, memory, params.resume_m):
        return True
    if params.w_i > 0.0 and memory["mode"] != DECIDE:
        ask_neighbours(percept, shared, decision, rig)
    memory["mode"] = DECIDE
    if waiting_for_answers(percept, shared, params.patience_s):
        halt(decision)
        say(decision, memory, DECIDE, R_ANSWERS)
        return False
    bias = side_bias(percept, safe, params.prior, rig)
    side = choose_side(
        percept, shared, decision, rig, params.w_i, bias, True,
        features[0], distances[0], count, features[1], distances[1],
    )  # fmt: skip
    begin_following(percept, memory, break_loop(percept, shared, memory, params.loop_m, side))
    say(decision, memory, DECIDE, R_LOOP if memory["strict"] else (R_FUSED if decision["heard"] else R_ALONE))
    return True


@jit_inner
def _avoid(percept: Row, shared: Row, memory: Row, decision: Row, rig: Rig, params: Params) -> None:
    """Collision avoidance (IV-D): wait for a moving neighbour whose repulsion outweighs the propulsion (27)."""
    now = percept["now_s"]
    travel = percept["compass"] + decision["heading"]
    own = propulsion(1.0, P_FREE)
    must = False
    for t in range(PEERS):
        if shared["track_id"][t] < 0 or now - shared["track_moved_s"][t] >= params.still_s:
            continue
        x, y = shared["track_x"][t], shared["track_y"][t]
        distance = math.sqrt(x * x + y * y)
        if distance >= rig.protection.sigma_a or distance < 1e-6:
            continue
        bearing = math.atan2(y, x)
        force = interaction_force(distance, rig.protection.sigma_a, max(params.w_i, 1.0))
        ours, its = math.cos(bearing - travel), -math.cos(bearing - shared["track_yaw"][t])
        if yields_to(own, force, ours) and goes_first(own, force, ours, its, shared["track_id"][t] < percept["id"]):
            must = True
    wait(memory, decision, must, now, params.wait_s)


@jit
def goes_first(own: float, force: float, ours: float, its: float, smaller: bool) -> bool:
    """Tell whether a neighbour for which (27) makes us yield has the higher priority: it is relatively ahead.

    ``ours`` is the cosine of its direction off our heading, ``its`` that of ours off its heading: it knows the same two
    numbers the other way round. If (27) does not make it yield, too, it is past us and goes. If both would yield,
    the one that has the other less straight before it is ahead; at a tie the one with the ``smaller`` address.
    """
    if not yields_to(own, force, its):
        return True
    if abs(ours - its) >= LEVEL:
        return ours > its
    return smaller
