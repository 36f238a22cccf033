"""GIWT: DH-Bug drives, and at a key point a network chooses the side from own and neighbours' views (GIWT 4.3).

A robot that comes near an obstacle asks the neighbours in its line of sight what they see in its target direction; each
draws its own scan turned to that direction, encodes it and answers with 128 bytes. At the key point the robot stands
until all have answered or ``answer_s`` is over, and then decides with whom it has heard, alone if nobody.

A decision has three parts: ``prepare_all`` (compiled) takes in answers and finds out who needs the network, ``_think``
runs it for those robots one by one, ``command_all`` (compiled) turns, follows, avoids. In most ticks nobody needs it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.bounds import Degrees, Flag, Metres, Seconds, Seed, Speed
from swarmscope.onboard.control.wanting import halt
from swarmscope.onboard.deciding import bug
from swarmscope.onboard.deciding.asking import obstacle_ahead
from swarmscope.onboard.deciding.bug import AT_GOAL, KEY_POINT, driving_of, toss
from swarmscope.onboard.deciding.following import turn_to_safe
from swarmscope.onboard.deciding.printed import printed_bug
from swarmscope.onboard.network.answering import draw, empty_graph, gather, look, put_answer
from swarmscope.onboard.network.asking import ask_round, in_grid, take_latents, usable
from swarmscope.onboard.network.graph import FEATURES, OWN_CELL
from swarmscope.onboard.network.local_map import CELLS, CHANNELS
from swarmscope.onboard.network.memory import MEMORY, new_memory
from swarmscope.onboard.network.model import Model, Network, shipped
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.planners import Variant
from swarmscope.onboard.reasons import DECIDE, R_ALONE, R_ANSWERS, R_FUSED
from swarmscope.onboard.rig import FITS
from swarmscope.onboard.sharing.inbox import waiting_for_answers
from swarmscope.onboard.sharing.message import direction_of
from swarmscope.onboard.view import Swarm, View, view_of

__all__ = ["MEMORY", "MODELS", "NAME", "NEEDS", "PRESETS", "SUMMARY", "VARIANTS", "Params", "decide_all", "new_memory"]

NAME = "giwt"
SUMMARY = "GIWT: DH-Bug, and a graph attention network with information gain chooses the side (extra 'giwt')"
ALONE = "own scan, goal bearing and distance, relative poses of visible neighbours"
NEEDS = f"{ALONE}, 128 bytes of features on request"
VARIANTS = {
    "giwt-cnn": Variant("GIWT's planner with a network that looks at the own scan only (extra 'giwt')", ALONE),
    "giwt-gat": Variant("GIWT's planner with plain graph attention (extra 'giwt')", NEEDS),
    "giwt-sage": Variant("GIWT's planner with GraphSAGE (extra 'giwt')", NEEDS),
}
MODELS = {
    "giwt": shipped("giwt", "giwt"),
    "giwt-cnn": shipped("giwt-cnn", "cnn"),
    "giwt-gat": shipped("giwt-gat", "gat"),
    "giwt-sage": shipped("giwt-sage", "graphsage"),
}
PRESETS = {"printed": printed_bug()}
DRIVES, WAITS, CHOOSES, FOLLOWS = range(4)
"""What a tick comes to: modes A, B or arrived; stands for answers; a side can be chosen; modes C to F."""


class Params(NamedTuple):
    """What can be set, the first ones as in DH-Bug."""

    seed: Seed = 0
    """Of the side that is tossed for after a loop, together with the robot's address and the number of its choices."""
    key_deg: Degrees = 60.0
    """pi/2 - theta_1: with no safe direction this close to the goal's there is a key point."""
    face_deg: Degrees = 10.0
    """theta_0: with less than this to turn, mode A becomes B."""
    turn_back_deg: Degrees = 105.0
    """A following looks this far back towards the obstacle from its last direction, or from where the robot faces."""
    arrive_m: Metres = 0.05
    """Distance to the goal at which a robot has arrived."""
    creep: Speed = 0.1
    """Speed [m/s] below which (2) does not slow down."""
    still_s: Seconds = 0.6
    """A neighbour that has not moved for so long is an obstacle."""
    wait_m: Metres = 0.9
    """Safety distance of 4.2.3; 0 = never waits."""
    wait_s: Seconds = 2.0
    """Longest wait; after it nobody is waited for during the same time."""
    in_place: Flag = 0
    """1: in modes A, C and D a robot stands while it turns, as printed; 0: turning and driving overlap."""
    nearer: Flag = 1
    """A following ends only nearer to the goal than it began; 0: where the goal is on the free side, as printed."""
    loops: Flag = 1
    """Loops are noticed and broken; 0: not, as printed."""
    ask: Flag = 1
    """0: nobody is asked, every side is chosen from the own scan."""
    ask_ahead_s: Seconds = 0.5
    """Neighbours are asked this long before a key point may follow."""
    ask_every_s: Seconds = 1.0
    """Shortest time between two rounds of requests on the way."""
    answer_s: Seconds = 0.6
    """How long a robot stands at a key point for answers that are still out."""
    turned_deg: Degrees = 10.0
    """Answers are of no use once the target direction has turned by more than this since they were asked for."""


def decide_all(first: int, last: int, swarm: Swarm, memories: np.ndarray, params: Params, model: Model) -> None:
    """Decide for robots ``first`` to ``last - 1``; raises MissingExtraError without ONNX Runtime.

    For no robots at all it loads network and kernels.
    """
    network = model.network
    if network.alone:
        params = params._replace(ask=0)
    if first == last and len(memories) > 0:
        _rehearse(network, swarm, memories, params)
    prepare_all(first, last, swarm, memories, params)
    for i in np.flatnonzero(memories["thinks"][first:last]).tolist():
        _think(network, first + i, swarm, memories, params)
    command_all(first, last, swarm, memories, params)


def _rehearse(network: Network, swarm: Swarm, memories: np.ndarray, params: Params) -> None:
    """Let a copy of a robot answer and choose, so that all that is needed is loaded."""
    copies = {name: getattr(swarm, name)[:1].copy() for name in ("scans", "percepts", "shared", "decisions")}
    copies["shared"]["ask_n"], copies["shared"]["ask_direction"] = 1, 0
    memory = memories[:1].copy()
    memory["stage"], memory["toss"] = CHOOSES, 0
    _think(network, 0, swarm._replace(**copies), memory, params)


def _think(network: Network, i: int, swarm: Swarm, memories: np.ndarray, params: Params) -> None:
    """Answer those who ask robot ``i``, and let the network choose its side where it has to."""
    rig, percept, shared, decisions = swarm.rig, swarm.percepts[i], swarm.shared[i], swarm.decisions
    codes = np.empty(rig.sensor.beams, np.uint8)
    picture = np.empty((1, CHANNELS, CELLS, CELLS), np.float32)
    look(i, swarm, codes)
    sent = np.empty(FEATURES, np.uint8)
    for q in range(int(shared["ask_n"])):
        code = int(shared["ask_direction"][q])
        if code >= 0:
            draw(codes, direction_of(code) - float(percept["compass"]), network.view_m, rig, picture[0])
            put_answer(i, q, network.encode(picture)[0], sent, swarm)
    if memories["stage"][i] != CHOOSES or memories["toss"][i]:
        return
    draw(codes, float(percept["goal_bearing"]), network.view_m, rig, picture[0])
    graph = empty_graph()
    graph.features[0] = network.encode(picture)[0]
    n = gather(i, swarm, memories, min(network.view_m, rig.sensor.range_max), params.turned_deg, graph)
    k = n + 1
    p_left = float(network.p_left(graph.features[None, :k], graph.cells[None, :k], graph.gains[None, :k])[0])
    decisions["p_self"][i] = p_left
    if n > 0:  # what each would say alone, for people to read
        each = np.ascontiguousarray(graph.features[:k, None])
        alone = network.p_left(each, np.full((k, 1), OWN_CELL), np.zeros((k, 1), np.float32))
        decisions["p_self"][i] = alone[0]
        decisions["heard_p"][i, :n] = np.nan_to_num(alone[1:], nan=0.5)
    memories["p_left"][i], memories["heard"][i] = p_left, n


@jit
def prepare_all(first: int, last: int, swarm: Swarm, memories: np.ndarray, params: Params) -> None:
    """Run the first part of the decisions of robots ``first`` to ``last - 1``."""
    for i in range(first, last):
        _prepare(view_of(swarm, i), memories[i], params)


@jit
def command_all(first: int, last: int, swarm: Swarm, memories: np.ndarray, params: Params) -> None:
    """Run the last part of the decisions of robots ``first`` to ``last - 1``."""
    for i in range(first, last):
        _command(view_of(swarm, i), memories[i], params)


@jit_inner
def _prepare(see: View, memory: Row, params: Params) -> None:
    """First part of a decision: up to the key point, asking on the way."""
    take_latents(see.percept, see.shared, memory)
    memory["thinks"], memory["heard"], memory["p_left"] = 0, 0, math.nan
    for q in range(see.shared["ask_n"]):
        if see.shared["ask_direction"][q] >= 0:
            memory["thinks"] = 1
    safe_directions(see.masked, see.rig.sensor, see.reach[FITS], see.edges, see.safe)
    if bug.advance(see, memory, driving_of(params)):
        memory["stage"] = DRIVES
        if _should_ask(see, memory, params):
            ask_round(see, memory)
    elif memory["mode"] != KEY_POINT:
        memory["stage"] = FOLLOWS
    elif memory["toss"]:
        memory["stage"] = CHOOSES
    elif _may_choose(see, memory, params):
        memory["stage"], memory["thinks"] = CHOOSES, 1
    else:
        memory["stage"] = WAITS
    if memory["stage"] != WAITS:
        memory["key_s"], memory["asked_here"] = -1.0, 0


@jit_inner
def _should_ask(see: View, memory: Row, params: Params) -> bool:
    """Tell whether a robot on its way asks now, because a key point may be near."""
    rig = see.rig
    horizon = max(rig.look_ahead, see.margins.l_th) + params.ask_ahead_s * rig.body.v_max_mps
    return bool(
        params.ask
        and memory["mode"] != AT_GOAL
        and memory["edge"] == 0
        and see.percept["now_s"] - see.shared["asked_s"] >= params.ask_every_s
        and obstacle_ahead(see, horizon)
        and key_point_near(see, params.ask_ahead_s, params.key_deg)
    )


@jit
def key_point_near(see: View, ahead_s: float, key_deg: float) -> bool:
    """Tell whether there may be a key point ``ahead_s`` from here: there is one if everything comes nearer.

    ``see.filtered`` and ``see.narrow`` are scratch.
    """
    sensor, masked, nearer = see.rig.sensor, see.masked, see.filtered
    way = ahead_s * see.rig.body.v_max_mps
    for n in range(sensor.beams):
        nearer[n] = max(sensor.range_min, masked[n] - way) if masked[n] >= sensor.range_min else masked[n]
    safe_directions(nearer, sensor, see.reach[FITS], see.edges, see.narrow)
    return bool(min(turn_to_safe(see, see.narrow, 1), turn_to_safe(see, see.narrow, -1)) > math.radians(key_deg))


@jit_inner
def _may_choose(see: View, memory: Row, params: Params) -> bool:
    """At a key point: tell whether all has been heard that will be, else ask and wait."""
    percept, shared = see.percept, see.shared
    now = percept["now_s"]
    if memory["key_s"] < 0.0:
        memory["key_s"] = now
    if params.ask == 0:
        return True
    fresh = usable(see, memory, params.turned_deg)
    if fresh and waiting_for_answers(percept, shared, params.answer_s):
        return False
    if fresh and shared["answers_n"] > 0:
        return True
    if memory["asked_here"] or now - memory["key_s"] >= params.answer_s:
        return True
    if percept["n_neighbours"] == 0 or not in_grid(percept, 0):
        return True
    if ask_round(see, memory):
        memory["asked_here"] = 1
    return False


@jit_inner
def _command(see: View, memory: Row, params: Params) -> None:
    """Last part of a decision: turn to the side that the network chose, follow, avoid."""
    driving = driving_of(params)
    stage = memory["stage"]
    if stage == WAITS:
        halt(see)
        see.out["state"], see.out["reason"], see.out["side"] = DECIDE, R_ANSWERS, 0
    elif stage == CHOOSES:
        choose(see, memory, params)
    if stage in (CHOOSES, FOLLOWS):
        bug.follow(see, memory, driving)
        if see.out["fused"] and see.out["heard"] > 0 and see.out["reason"] == R_ALONE:
            see.out["reason"] = R_FUSED
    bug.avoid(see, memory, driving)


@jit
def choose(see: View, memory: Row, params: Params) -> None:
    """Take the side that the network finds likelier; where it cannot tell, and after a loop, the side is tossed for."""
    p_left = memory["p_left"]
    if p_left > 0.5:
        side = 1
    elif p_left < 0.5:
        side = -1
    else:
        side = toss(params.seed, see.percept["id"], memory["decisions"])
        p_left = 0.5
    see.out["p_left"] = p_left
    heard = memory["heard"]
    bug.turn(see, memory, side, params.seed)
    see.out["heard"] = heard
