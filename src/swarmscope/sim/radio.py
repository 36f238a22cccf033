"""The radio: range, latency, loss and bandwidth for real packets, payload and on-air bytes counted apart."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.percept import MAX_OUTBOX
from swarmscope.onboard.sharing.message import MAX_PACKET_BYTES, is_request
from swarmscope.sim.faults import is_off_air
from swarmscope.sim.state import LINKS, QUEUE, Sim
from swarmscope.sim.streams import RADIO_LOSS, key, mix, uniform


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
    """Send packet k of robot i: count it, then lose it, refuse it or queue it."""
    sender, decision, radio = sim.robots[i], sim.decisions[i], sim.radio
    j, length = decision["out_to"][k], decision["out_length"][k]
    if j < 0 or j >= sim.robots.size or length <= 0 or length > MAX_PACKET_BYTES:
        return
    features = not is_request(decision["out"][k, 0])
    receiver = sim.robots[j]
    airtime = 8.0 * (length + radio.overhead_bytes) / radio.bitrate_bps
    now = tick * sim.clock.dt
    begin = max(now, max(sender["radio_free_s"], receiver["radio_free_s"]))
    if begin - now > radio.max_wait_s:
        sender["crowded"] += 1
        return
    sender["sent"] += 1
    sender["bytes"] += length
    sender["air_bytes"] += length + radio.overhead_bytes
    if features:
        sender["sent_features"] += 1
        sender["feature_bytes"] += length
    sender["radio_free_s"] = begin + airtime
    dx, dy = receiver["x"] - sender["x"], receiver["y"] - sender["y"]
    if math.sqrt(dx * dx + dy * dy) > radio.range_m or receiver["crashed"] or is_off_air(receiver, tick):
        sender["unreachable"] += 1
        return
    receiver["radio_free_s"] = begin + airtime
    if radio.loss > 0.0:
        chance = uniform(mix(key(sim.clock.seed, i, tick, RADIO_LOSS) + key(0, k, 0, RADIO_LOSS)))
        if chance < radio.loss:
            sender["lost"] += 1
            return
    q = receiver["queued"]
    if q >= QUEUE:
        sender["crowded"] += 1
        return
    sim.queue_due[j, q] = begin + airtime + radio.latency_s
    sim.queue_length[j, q] = length
    sim.queue_from[j, q] = i
    for b in range(length):
        sim.queue_data[j, q, b] = decision["out"][k, b]
    receiver["queued"] = q + 1
    if features and sim.links_n[0] < LINKS:
        at = sim.links_n[0]
        sim.links[at, 0], sim.links[at, 1], sim.links[at, 2], sim.links[at, 3] = tick, i, j, length
        sim.links_n[0] = at + 1
