"""GIWT: DH-Bug drives, and at a key point a network chooses the side from own and neighbours' views (GIWT 4.3).

A robot that comes near an obstacle asks the neighbours in its line of sight what they see in its target direction; each
draws its own scan turned to that direction, encodes it and answers with 128 bytes. At the key point the robot stands
until all have answered or ``answer_s`` is over, and then decides with whom it has heard, alone if nobody.

A tick has three parts: ``prepare_all`` (compiled) takes in packets and finds out who needs the network, ``_think`` runs
it for those robots one by one, ``command_all`` (compiled) turns, follows, avoids. In most ticks nobody needs it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.control.guard import halt
from swarmscope.onboard.percept import MAX_OUTBOX, PEERS, Rig, Row, Scratch
from swarmscope.onboard.perception.local_map import (
    CELL_ANGLE,
    CELL_DISTANCE,
    CELLS,
    CHANNELS,
    draw_map,
    encode_scan,
    hide_robot,
)
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.planning import dh_bug
from swarmscope.onboard.planning._asking import obstacle_ahead
from swarmscope.onboard.planning._contract import DECIDE, R_ALONE, R_ANSWERS, R_FUSED
from swarmscope.onboard.planning._following import turn_to_safe
from swarmscope.onboard.planning._giwt_graph import (
    FEATURES,
    GRID_M,
    OWN_CELL,
    information_gain_series,
    position_cell,
    quantise,
    restore,
)
from swarmscope.onboard.planning._giwt_network import (
    SHIPPED,
    Network,
    check_files,
    check_runtime,
    load_network,
    read_card,
)
from swarmscope.onboard.planning.dh_bug import AT_GOAL, BODY_RULE, KEY_POINT, toss
from swarmscope.onboard.sharing.inbox import answer_directed, ask_direction, start_round, waiting_for_answers
from swarmscope.onboard.sharing.message import direction_of, read_latent
from swarmscope.onboard.tick import begin, finish

DRIVES, WAITS, CHOOSES, FOLLOWS = range(4)
"""What a tick comes to: modes A, B or arrived; stands for answers; a side can be chosen; modes C to F."""


class Params(NamedTuple):
    """What can be set, the first ones as in DH-Bug. Distances in m, times in s, angles in degrees."""

    seed: int = 0
    """Of the side that is tossed for after a loop, together with the robot's address and the number of its choices."""
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
    ask: int = 1
    """0: nobody is asked, every side is chosen from the own scan."""
    ask_ahead_s: float = 0.5
    """Neighbours are asked this long before a key point may follow."""
    ask_every_s: float = 1.0
    """Shortest time between two rounds of requests on the way."""
    answer_s: float = 0.6
    """How long a robot stands at a key point for answers that are still out."""
    turned_deg: float = 10.0
    """Answers are of no use once the target direction has turned by more than this since they were asked for."""


Values = Params
Driving = dh_bug.Params


@jit_inner
def _driving(params: Params) -> Driving:
    """Return what DH-Bug's kernels are told."""
    return Driving(
        dh_bug.TURN_RANDOM, params.seed, 0, 0, 0, params.key_deg, params.face_deg, params.turn_back_deg,
        params.arrive_m, params.creep, params.still_s, params.wait_m, params.wait_s,
    )  # fmt: skip


_OWN = [
    ("stage", np.uint8),
    ("thinks", np.uint8),  # the network is needed in this tick
    ("asked_here", np.uint8),  # a round of requests was sent at this key point
    ("key_s", np.float64),  # since when the robot is at a key point, -1 = it is not
    ("direction", np.float64),  # target direction of the last round, compass frame [rad]
    ("asked_id", np.int64, MAX_OUTBOX),  # who was asked in it, nearest first, -1 = nobody
    ("answered", np.uint8, MAX_OUTBOX),
    ("scale", np.uint8, MAX_OUTBOX),  # their answers
    ("latent", np.uint8, (MAX_OUTBOX, FEATURES)),
    ("heard", np.uint8),  # how many entered the choice made in this tick
    ("p_left", np.float64),  # what the network says, NaN = nothing
]
MEMORY = np.dtype(dh_bug.MEMORY.descr + _OWN)


def new_memory(robots: int) -> np.ndarray:
    """Return the memory of ``robots`` robots that have seen nothing yet."""
    memory = np.zeros(robots, MEMORY)
    memory["wait_s"] = memory["key_s"] = memory["asked_id"] = -1
    return memory


@dataclass(frozen=True)
class Planner:
    """A planner with a network: what a planner's module defines, for the model in ``folder``."""

    NAME: str
    SUMMARY: str
    NEEDS: str
    folder: Path
    networks: frozenset[str]
    """What kinds of network it runs."""
    Params: ClassVar[Any] = Params
    MEMORY: ClassVar[Any] = MEMORY
    KERNELS: ClassVar[Any] = ()
    new_memory: ClassVar[Any] = staticmethod(new_memory)

    @cached_property
    def network(self) -> Network:
        """The model, loaded when it is first used."""
        return load_network(self.folder, self.NAME, self.networks)

    def with_model(self, folder: Path | str) -> Planner:
        """Return the same planner with the model in ``folder``."""
        return replace(self, folder=Path(folder))

    def check_available(self) -> None:
        """Raise a MissingExtraError without ONNX Runtime, an InputFileError unless the model is whole."""
        check_runtime(self.NAME)
        check_files(self.folder, self.networks)

    def model_state(self) -> str:
        """Return a hash of the model: of its card, which holds those of its files."""
        return str(read_card(self.folder, self.networks)["sha256"])

    def step_all(
        self,
        first: int,
        last: int,
        ranges: np.ndarray,
        percepts: np.ndarray,
        shared: np.ndarray,
        memories: np.ndarray,
        decisions: np.ndarray,
        scratch: Scratch,
        rig: Rig,
        params: Values,
    ) -> None:
        """Run one tick of robots ``first`` to ``last - 1``; raises MissingExtraError without ONNX Runtime.

        For no robots at all it loads network and kernels.
        """
        network = self.network
        if network.alone:
            params = params._replace(ask=0)
        rows = (ranges, percepts, shared, memories, decisions)
        if first == last and len(percepts) > 0:
            _rehearse(network, *(array[:1].copy() for array in rows), rig, params)
        prepare_all(first, last, *rows, scratch, rig, params)
        for i in np.flatnonzero(memories["thinks"][first:last]).tolist():
            _think(network, first + i, *rows, rig, params)
        command_all(first, last, *rows, scratch, rig, params)


def shipped(name: str, summary: str, network: str) -> Planner:
    """Return the planner ``name`` with the model that comes with the package."""
    needs = "own scan, goal bearing and distance, relative poses of visible neighbours"
    if network != "cnn":
        needs += ", 128 bytes of features on request"
    return Planner(name, summary, needs, SHIPPED / name.replace("-", "_"), frozenset({network}))


def _rehearse(network: Network, *arguments: Any) -> None:
    """Let a copy of a robot answer and choose, so that all that is needed is loaded."""
    _, _, shared, memories, *_ = arguments
    shared["ask_n"], shared["ask_direction"] = 1, 0
    memories["stage"], memories["toss"] = CHOOSES, 0
    _think(network, 0, *arguments)


def _think(
    network: Network,
    i: int,
    ranges: np.ndarray,
    percepts: np.ndarray,
    shared: np.ndarray,
    memories: np.ndarray,
    decisions: np.ndarray,
    rig: Rig,
    params: Params,
) -> None:
    """Answer those who ask robot ``i``, and let the network choose its side where it has to."""
    codes = np.empty(rig.sensor.beams, np.uint8)
    picture = np.empty((1, CHANNELS, CELLS, CELLS), np.float32)
    look(i, ranges, percepts, rig, codes)
    sent = np.empty(FEATURES, np.uint8)
    for q in range(int(shared["ask_n"][i])):
        code = int(shared["ask_direction"][i, q])
        if code >= 0:
            draw(codes, direction_of(code) - float(percepts["compass"][i]), network.view_m, rig, picture[0])
            put_answer(i, q, network.encode(picture)[0], sent, percepts, shared, decisions)
    if memories["stage"][i] != CHOOSES or memories["toss"][i]:
        return
    draw(codes, float(percepts["goal_bearing"][i]), network.view_m, rig, picture[0])
    own = network.encode(picture)
    features, cells, gains = empty_graph()
    features[0, 0] = own[0]
    seen_m = min(network.view_m, rig.sensor.range_max)
    n = gather(i, percepts, shared, memories, decisions, rig, params, seen_m, features[0], cells[0], gains[0])
    k = n + 1
    p_left = float(network.p_left(features[:, :k], cells[:, :k], gains[:, :k])[0])
    if n > 0:  # what each would say alone, for people to read
        each = np.ascontiguousarray(features[0, :k, None])
        alone = network.p_left(each, np.full((k, 1), OWN_CELL), np.zeros((k, 1), np.float32))
        decisions["p_self"][i] = alone[0]
        decisions["heard_p"][i, :n] = np.nan_to_num(alone[1:], nan=0.5)
    else:
        decisions["p_self"][i] = p_left
    memories["p_left"][i], memories["heard"][i] = p_left, n


def empty_graph() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return features (1, K, 128), cells (1, K) and gains (1, K) with room for all who can be asked."""
    k = MAX_OUTBOX + 1
    return np.zeros((1, k, FEATURES), np.float32), np.full((1, k), OWN_CELL), np.zeros((1, k), np.float32)


@jit
def look(i: int, ranges: np.ndarray, percepts: np.ndarray, rig: Rig, codes: np.ndarray) -> None:
    """Write robot ``i``'s scan as range codes (M,), without the neighbours that it sees."""
    percept, sensor = percepts[i], rig.sensor
    encode_scan(ranges[i], codes)
    for k in range(percept["n_neighbours"]):
        hide_robot(
            codes, sensor.angle_min, sensor.increment, sensor.wraps,
            percept["neighbour_x"][k], percept["neighbour_y"][k], rig.body.radius_m,
        )  # fmt: skip


@jit
def draw(codes: np.ndarray, target: float, view_m: float, rig: Rig, picture: np.ndarray) -> None:
    """Draw what range codes (M,) show within ``view_m`` [m], x along ``target`` [rad, body frame].

    ``picture`` is (2, 101, 101) float32.
    """
    sensor = rig.sensor
    seen_m = sensor.range_max
    draw_map(codes, sensor.angle_min, sensor.increment, target, view_m, seen_m, CELL_ANGLE, CELL_DISTANCE, picture)


@jit
def put_answer(
    i: int,
    q: int,
    features: np.ndarray,
    codes: np.ndarray,
    percepts: np.ndarray,
    shared: np.ndarray,
    decisions: np.ndarray,
) -> None:
    """Send ``features (128,)`` as bytes to the ``q``-th of those who ask robot ``i``; ``codes (128,)`` is scratch."""
    scale = quantise(features, codes)
    answer_directed(percepts[i], shared[i], decisions[i], q, codes, scale)


@jit
def gather(
    i: int,
    percepts: np.ndarray,
    shared: np.ndarray,
    memories: np.ndarray,
    decisions: np.ndarray,
    rig: Rig,
    params: Params,
    view_m: float,
    features: np.ndarray,
    cells: np.ndarray,
    gains: np.ndarray,
) -> int:
    """Write what robot ``i`` heard into rows 1 on of ``features``, ``cells`` (4) and ``gains`` (8); return how many.

    Where a neighbour is now comes from its track; who has none is left out.
    """
    percept, memory, decision = percepts[i], memories[i], decisions[i]
    if not _usable(percept, shared[i], memory, rig, params):
        return 0
    target = percept["compass"] + percept["goal_bearing"]
    c, s = math.cos(target), math.sin(target)
    n = 0
    for a in range(MAX_OUTBOX):
        if memory["asked_id"][a] < 0 or not memory["answered"][a]:
            continue
        t = _track(shared[i], memory["asked_id"][a])
        if t < 0:
            continue
        east, north = shared[i]["track_x"][t], shared[i]["track_y"][t]
        x, y = c * east + s * north, c * north - s * east
        gain = information_gain_series(math.sqrt(x * x + y * y), view_m)
        decision["heard_id"][n], decision["heard_f"][n] = memory["asked_id"][a], gain
        decision["heard_side"][n] = 1 if y >= 0.0 else -1
        n += 1
        restore(memory["latent"][a], memory["scale"][a], features[n])
        cells[n], gains[n] = position_cell(x, y), gain
    return n


@jit_inner
def _track(shared: Row, peer: int) -> int:
    """Return the track of ``peer``, or -1."""
    for t in range(PEERS):
        if shared["track_id"][t] == peer:
            return t
    return -1


@jit_inner
def _usable(percept: Row, shared: Row, memory: Row, rig: Rig, params: Params) -> bool:
    """Tell whether the last round is recent and was about the present target direction."""
    if shared["asked_seq"] < 0 or percept["now_s"] - shared["asked_s"] > rig.max_feature_age:
        return False
    turned = wrap_angle(percept["compass"] + percept["goal_bearing"] - memory["direction"])
    return bool(abs(turned) <= math.radians(params.turned_deg))


@jit
def take_latents(percept: Row, shared: Row, memory: Row) -> None:
    """Keep this tick's answers of those who were asked and have not answered yet; drop and count others."""
    for j in range(shared["latent_n"]):
        at = shared["latent_at"][j]
        sender = int(percept["packet"][at, 1]) | (int(percept["packet"][at, 2]) << 8)
        slot = -1
        for a in range(MAX_OUTBOX):
            if memory["asked_id"][a] == sender and memory["answered"][a] == 0:
                slot = a
        if slot < 0:
            shared["dropped_stale"] += 1
            continue
        memory["scale"][slot] = read_latent(
            percept["packet"][at], percept["packet_length"][at], memory["latent"][slot]
        )
        memory["answered"][slot] = 1
        shared["answers_n"] += 1


@jit_inner
def _ask_round(percept: Row, shared: Row, memory: Row, decision: Row) -> bool:
    """Ask the neighbours in sight within GRID_M, nearest first, keeping room for the answers that we owe.

    Return whether anybody was asked; without room or neighbours the last round stays as it is.
    """
    room = MAX_OUTBOX - decision["n_out"]
    for q in range(shared["ask_n"]):
        if shared["ask_direction"][q] >= 0:
            room -= 1
    n = 0
    for k in range(percept["n_neighbours"]):
        x, y = percept["neighbour_x"][k], percept["neighbour_y"][k]
        if n >= room or x * x + y * y > GRID_M * GRID_M:
            break
        if n == 0:
            start_round(percept, shared)
            memory["direction"] = percept["compass"] + percept["goal_bearing"]
            for a in range(MAX_OUTBOX):
                memory["asked_id"][a] = -1
                memory["answered"][a] = 0
        memory["asked_id"][n] = percept["neighbour_id"][k]
        ask_direction(percept, shared, decision, percept["neighbour_id"][k], memory["direction"])
        n += 1
    return n > 0


@jit
def key_point_near(
    work: np.ndarray,
    percept: Row,
    nearer: np.ndarray,
    edges: np.ndarray,
    safe: np.ndarray,
    rig: Rig,
    params: Params,
) -> bool:
    """Tell whether there may be a key point ``ask_ahead_s`` from here: there is one if everything comes nearer.

    ``work (M,)`` is the scan without moving neighbours; ``nearer``, ``edges``, ``safe`` are scratch.
    """
    sensor = rig.sensor
    way = params.ask_ahead_s * rig.body.v_max_mps
    for n in range(sensor.beams):
        nearer[n] = max(sensor.range_min, work[n] - way) if work[n] >= sensor.range_min else work[n]
    safe_directions(
        nearer, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[BODY_RULE], edges, safe
    )
    turn = min(turn_to_safe(percept, safe, 1, rig), turn_to_safe(percept, safe, -1, rig))
    return bool(turn > math.radians(params.key_deg))


@jit_inner
def _may_choose(percept: Row, shared: Row, memory: Row, decision: Row, rig: Rig, params: Params) -> bool:
    """At a key point: tell whether all has been heard that will be, else ask and wait."""
    now = percept["now_s"]
    if memory["key_s"] < 0.0:
        memory["key_s"] = now
    if params.ask == 0:
        return True
    usable = _usable(percept, shared, memory, rig, params)
    if usable and waiting_for_answers(percept, shared, params.answer_s):
        return False
    if usable and shared["answers_n"] > 0:
        return True
    if memory["asked_here"] or now - memory["key_s"] >= params.answer_s or percept["n_neighbours"] == 0:
        return True
    x, y = percept["neighbour_x"][0], percept["neighbour_y"][0]
    if x * x + y * y > GRID_M * GRID_M:
        return True
    if _ask_round(percept, shared, memory, decision):
        memory["asked_here"] = 1
    return False


@jit
def prepare(
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
    """First part of a tick of one robot: up to the key point, asking on the way."""
    work, safe, edges = scratch.work[row], scratch.safe[row], scratch.edges[row]
    begin(
        ranges, percept, shared, decision, work, edges, safe,
        scratch.header[row], scratch.angles[row], scratch.distances[row], rig, params.still_s,
    )  # fmt: skip
    take_latents(percept, shared, memory)
    memory["thinks"], memory["heard"], memory["p_left"] = 0, 0, math.nan
    for q in range(shared["ask_n"]):
        if shared["ask_direction"][q] >= 0:
            memory["thinks"] = 1
    sensor = rig.sensor
    safe_directions(work, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[BODY_RULE], edges, safe)
    if dh_bug.advance(ranges, work, percept, shared, memory, decision, safe, rig, _driving(params)):
        memory["stage"] = DRIVES
        horizon = max(rig.look_ahead, rig.protection.l_th) + params.ask_ahead_s * rig.body.v_max_mps
        if (
            params.ask
            and memory["mode"] != AT_GOAL
            and memory["edge"] == 0
            and percept["now_s"] - shared["asked_s"] >= params.ask_every_s
            and obstacle_ahead(work, percept, rig, horizon)
            and key_point_near(
                work, percept, scratch.filtered[row], edges, scratch.narrow[row], rig, params
            )
        ):
            _ask_round(percept, shared, memory, decision)
    elif memory["mode"] != KEY_POINT:
        memory["stage"] = FOLLOWS
    elif memory["toss"]:
        memory["stage"] = CHOOSES
    elif _may_choose(percept, shared, memory, decision, rig, params):
        memory["stage"], memory["thinks"] = CHOOSES, 1
    else:
        memory["stage"] = WAITS
    if memory["stage"] != WAITS:
        memory["key_s"], memory["asked_here"] = -1.0, 0


@jit
def command(
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
    """Last part of a tick of one robot: turns to the side that the network chose, follows, avoids."""
    work, safe, edges, narrow = scratch.work[row], scratch.safe[row], scratch.edges[row], scratch.narrow[row]
    driving = _driving(params)
    stage = memory["stage"]
    if stage == WAITS:
        halt(decision)
        decision["state"], decision["reason"], decision["side"] = DECIDE, R_ANSWERS, 0
    elif stage == CHOOSES:
        choose(percept, shared, memory, decision, params)
    if stage in (CHOOSES, FOLLOWS):
        dh_bug.follow(ranges, work, percept, shared, memory, decision, safe, narrow, edges, rig, driving)
        if decision["fused"] and decision["heard"] > 0 and decision["reason"] == R_ALONE:
            decision["reason"] = R_FUSED
    dh_bug.avoid(percept, shared, memory, decision, rig, driving)
    finish(ranges, percept, shared, decision, edges, rig)


@jit
def choose(percept: Row, shared: Row, memory: Row, decision: Row, params: Params) -> None:
    """Take the side that the network finds likelier; where it cannot tell, and after a loop, the side is tossed for."""
    p_left = memory["p_left"]
    if p_left > 0.5:
        side = 1
    elif p_left < 0.5:
        side = -1
    else:
        side = toss(params.seed, percept["id"], memory["decisions"])
        p_left = 0.5
    decision["p_left"] = p_left
    heard = memory["heard"]
    dh_bug.turn(percept, shared, memory, decision, side, _driving(params))
    decision["heard"] = heard


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
    """Run the first part of a tick of robots ``first`` to ``last - 1``."""
    for i in range(first, last):
        prepare(ranges[i], percepts[i], shared[i], memories[i], decisions[i], scratch, i, rig, params)


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
    """Run the last part of a tick of robots ``first`` to ``last - 1``."""
    for i in range(first, last):
        command(ranges[i], percepts[i], shared[i], memories[i], decisions[i], scratch, i, rig, params)


Planner.KERNELS = (prepare_all, command_all)
