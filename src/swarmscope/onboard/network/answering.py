"""What goes into the network and out of it: pictures of own scans, answers to others, the graph of who was heard."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.network.asking import usable
from swarmscope.onboard.network.graph import (
    FEATURES,
    OWN_CELL,
    information_gain_series,
    position_cell,
    quantise,
    restore,
)
from swarmscope.onboard.network.local_map import (
    CELL_ANGLE,
    CELL_DISTANCE,
    Drawing,
    draw_map,
    encode_scan,
    hide_robot,
)
from swarmscope.onboard.percept import MAX_OUTBOX, PEERS, Row
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.sharing.inbox import answer_directed
from swarmscope.onboard.view import Swarm, view_of


class Graph(NamedTuple):
    """A robot in row 0 and those whom it heard: features (K, 128), cells (K,) (4) and gains (K,) (8)."""

    features: np.ndarray
    cells: np.ndarray
    gains: np.ndarray


def empty_graph() -> Graph:
    """Return a graph with room for all who can be asked."""
    k = MAX_OUTBOX + 1
    return Graph(np.zeros((k, FEATURES), np.float32), np.full(k, OWN_CELL), np.zeros(k, np.float32))


@jit
def look(i: int, swarm: Swarm, codes: np.ndarray) -> None:
    """Write robot ``i``'s scan as range codes (M,), without the neighbours that it sees."""
    percept, rig = swarm.percepts[i], swarm.rig
    encode_scan(swarm.scans[i], codes)
    for k in range(percept["n_neighbours"]):
        x, y = percept["neighbour_x"][k], percept["neighbour_y"][k]
        hide_robot(codes, rig.sensor, x, y, rig.guarding.others_largest_m)


@jit
def draw(codes: np.ndarray, target: float, view_m: float, rig: Rig, picture: np.ndarray) -> None:
    """Draw what range codes (M,) show within ``view_m`` [m], x along ``target`` [rad, body frame].

    ``picture`` is (2, 101, 101) float32.
    """
    sensor = rig.sensor
    drawing = Drawing(sensor.angle_min, sensor.increment, target, view_m, sensor.range_max)
    draw_map(codes, drawing, CELL_ANGLE, CELL_DISTANCE, picture)


@jit
def put_answer(i: int, q: int, features: np.ndarray, codes: np.ndarray, swarm: Swarm) -> None:
    """Send ``features (128,)`` as bytes to the ``q``-th of those who ask robot ``i``; ``codes (128,)`` is scratch."""
    scale = quantise(features, codes)
    answer_directed(view_of(swarm, i), q, codes, scale)


@jit
def gather(i: int, swarm: Swarm, memories: np.ndarray, view_m: float, turned_deg: float, graph: Graph) -> int:
    """Write what robot ``i`` heard into rows 1 on of ``graph``; return how many.

    Where a neighbour is now comes from its track; who has none is left out. Answers are of no use once the target
    direction has turned by more than ``turned_deg`` since they were asked for.
    """
    see, memory = view_of(swarm, i), memories[i]
    if not usable(see, memory, turned_deg):
        return 0
    target = see.percept["compass"] + see.percept["goal_bearing"]
    c, s = math.cos(target), math.sin(target)
    n = 0
    for a in range(MAX_OUTBOX):
        if memory["asked_id"][a] < 0 or not memory["answered"][a]:
            continue
        t = _track(see.shared, memory["asked_id"][a])
        if t < 0:
            continue
        east, north = see.shared["track_x"][t], see.shared["track_y"][t]
        x, y = c * east + s * north, c * north - s * east
        gain = information_gain_series(math.sqrt(x * x + y * y), view_m)
        see.out["heard_id"][n], see.out["heard_f"][n] = memory["asked_id"][a], gain
        see.out["heard_side"][n] = 1 if y >= 0.0 else -1
        n += 1
        restore(memory["latent"][a], memory["scale"][a], graph.features[n])
        graph.cells[n], graph.gains[n] = position_cell(x, y), gain
    return n


@jit_inner
def _track(shared: Row, peer: int) -> int:
    """Return the track of ``peer``, or -1."""
    for t in range(PEERS):
        if shared["track_id"][t] == peer:
            return t
    return -1
