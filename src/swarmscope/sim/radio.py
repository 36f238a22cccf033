"""The radio: range, latency, loss and bandwidth for real packets, payload and on-air bytes counted apart."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.held import Held
from swarmscope.onboard.percept import EVERYBODY, MAX_OUTBOX
from swarmscope.onboard.sharing.message import MAX_PACKET_BYTES, is_request
from swarmscope.sim.faults import is_off_air
from swarmscope.sim.state import LINKS, QUEUE, Sim
from swarmscope.sim.streams import RADIO_LOSS, key, mix, uniform

STRANGER = -1
"""Sender of packets that no robot has sent."""


@jit
def exchange(sim: Sim, tick: int) -> None:
    """Put every robot's outbox on the air, in the order of the robots, and into the receivers' queues."""
    for i in range(sim.robots.size):
        decision = sim.decisions[i]
        if sim.robots[i]["crashed"]:
            continue
        sim.robots[i]["fusions"] += decision["fused"]
        if is_off_air(sim.robots[i], tick):
            continue
        for k in range(min(MAX_OUTBOX, decision["n_out"])):
            _send(sim, tick, i, k)


@jit_inner
def _send(sim: Sim, tick: int, i: int, k: int) -> None:
    """Send packet k of robot i, to one or to all: count it, then let it arrive."""
    sender, decision, radio = sim.robots[i], sim.decisions[i], sim.radio
    j, length = decision["out_to"][k], decision["out_length"][k]
    everybody = j == EVERYBODY
    if (not everybody and (j < 0 or j >= sim.robots.size)) or length <= 0 or length > MAX_PACKET_BYTES:
        return
    airtime = 8.0 * (length + radio.overhead_bytes) / radio.bitrate_bps
    now = tick * sim.clock.dt
    begin = max(now, sender["radio_free_s"])
    if not everybody:
        begin = max(begin, sim.robots[j]["radio_free_s"])
    if begin - now > radio.max_wait_s:
        sender["crowded"] += 1
        return
    sender["sent"] += 1
    sender["bytes"] += length
    sender["air_bytes"] += length + radio.overhead_bytes
    if not is_request(decision["out"][k, 0]):
        sender["sent_features"] += 1
        sender["feature_bytes"] += length
    sender["radio_free_s"] = begin + airtime
    if not everybody:
        if _is_reached(sim, tick, i, j):
            _arrive(sim, tick, (i, k, j), begin + airtime)
        else:
            sender["unreachable"] += 1
        return
    for r in range(sim.robots.size):
        if r != i and _is_reached(sim, tick, i, r):
            _arrive(sim, tick, (i, k, r), begin + airtime)


@jit_inner
def _is_reached(sim: Sim, tick: int, i: int, j: int) -> bool:
    """Tell whether robot j is within the radio range of robot i, and listens."""
    sender, receiver = sim.robots[i], sim.robots[j]
    dx, dy = receiver["x"] - sender["x"], receiver["y"] - sender["y"]
    far = math.sqrt(dx * dx + dy * dy) > sim.radio.range_m
    return not (far or receiver["crashed"] or is_off_air(receiver, tick))


@jit_inner
def _arrive(sim: Sim, tick: int, packet: tuple[int, int, int], end_s: float) -> None:
    """Lose, refuse or queue a packet (of robot i, its number k, for robot j) that is on the air until ``end_s``."""
    i, k, j = packet
    sender, decision, radio, receiver = sim.robots[i], sim.decisions[i], sim.radio, sim.robots[j]
    receiver["radio_free_s"] = max(receiver["radio_free_s"], end_s)
    length = decision["out_length"][k]
    if radio.loss > 0.0:
        to_whom = j + 1 if decision["out_to"][k] == EVERYBODY else 0
        chance = uniform(mix(key(sim.clock.seed, i, tick, RADIO_LOSS) + key(to_whom, k, 0, RADIO_LOSS)))
        if chance < radio.loss:
            sender["lost"] += 1
            return
    if not _queue(sim, j, i, end_s + radio.latency_s, decision["out"][k], length):
        sender["crowded"] += 1
        return
    if not is_request(decision["out"][k, 0]) and sim.links_n[0] < LINKS:
        at = sim.links_n[0]
        sim.links[at, 0], sim.links[at, 1], sim.links[at, 2], sim.links[at, 3] = tick, i, j, length
        sim.links_n[0] = at + 1


@jit_inner
def _queue(sim: Sim, j: int, sender: int, due_s: float, data: np.ndarray, length: int) -> bool:
    """Put a packet that arrives at ``due_s`` among those on their way to robot j; return whether there was room."""
    receiver = sim.robots[j]
    q = receiver["queued"]
    if q >= QUEUE:
        return False
    sim.queue_due[j, q] = due_s
    sim.queue_length[j, q] = length
    sim.queue_from[j, q] = sender
    for b in range(length):
        sim.queue_data[j, q, b] = data[b]
    receiver["queued"] = q + 1
    return True


@jit
def throw(sim: Sim, tick: int, j: int, data: np.ndarray, length: int) -> bool:
    """Throw a packet at robot j that no robot has sent, to be heard at the next tick; return whether it hears it.

    It occupies no radio of the swarm, but takes room among the packets that robot j has not taken yet.
    """
    if j < 0 or j >= sim.robots.size or length < 0 or length > min(data.size, MAX_PACKET_BYTES):
        return False
    if sim.robots[j]["crashed"] or is_off_air(sim.robots[j], tick):
        return False
    return _queue(sim, j, STRANGER, tick * sim.clock.dt, data, length)


@jit
def throw_all(held: Held[Sim], tick: int, to: np.ndarray, data: np.ndarray, length: np.ndarray) -> int:
    """Throw packets ``data`` (K, bytes) at robots ``to`` (K,), one after the other; return how many are heard."""
    sim, heard = held.what, 0
    for k in range(to.size):
        heard += throw(sim, tick, to[k], data[k], length[k])
    return heard
