"""GIWT's planner part by part, beside Nav-SCOPE's planning step measured in the same run.

One decision costs the robot that decides its own picture, one encoding and the graph; every neighbour that it asked
spends a picture, an encoding and a packet. ``--model`` takes another folder than the one that comes with the package.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench_step import prepared, step_us
from swarmscope.errors import SwarmscopeError
from swarmscope.held import Held
from swarmscope.onboard.network.answering import draw, empty_graph, gather, look, put_answer
from swarmscope.onboard.network.graph import FEATURES
from swarmscope.onboard.network.local_map import CELLS, CHANNELS
from swarmscope.onboard.planners import Planner, load_planner
from swarmscope.onboard.view import Swarm
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_rig_of

ROBOTS = 64
REPEATS = 30
HEARD = 4


class Rows(NamedTuple):
    """Robots just before a tick."""

    swarm: Swarm
    memory: np.ndarray

    def again(self) -> Rows:
        """Return a copy."""
        names = ("percepts", "shared", "decisions")
        return Rows(self.swarm._replace(**{n: getattr(self.swarm, n).copy() for n in names}), self.memory.copy())


def best_us(call: Callable[[int], object]) -> float:
    """Return the mean time of ``call`` over the robots [us], best of the repeats."""
    best = np.inf
    for _ in range(REPEATS):
        start = time.perf_counter_ns()
        for i in range(ROBOTS):
            call(i)
        best = min(best, (time.perf_counter_ns() - start) / 1e3 / ROBOTS)
    return best


def scene(planner: Planner, blocked: bool) -> Rows:
    """Return robots with four answers in, and their memories.

    They are at key points, something 0.5 m ahead and on both sides, or with nothing in the way at all.
    """
    swarm = prepared(ROBOTS, make_rig_of(parse_scenario({"task": {"name": "T1"}}, "bench")))
    memory = planner.new_memory(ROBOTS)
    beams = swarm.scans.shape[1]
    off = np.arange(beams)[None] * 2.0 * np.pi / beams - np.pi - swarm.percepts["goal_bearing"][:, None]
    ahead = np.abs((off + np.pi) % (2.0 * np.pi) - np.pi) < np.radians(100.0)
    swarm.scans[:] = np.where(ahead, np.minimum(swarm.scans, 0.5) if blocked else np.inf, swarm.scans)
    rng = np.random.default_rng(4)
    swarm.percepts["n_packets"] = 0
    swarm.shared["asked_n"] = swarm.shared["answers_n"] = HEARD
    memory["direction"] = swarm.percepts["goal_bearing"]
    memory["asked_id"][:, :HEARD] = swarm.percepts["neighbour_id"][:, :HEARD]
    memory["answered"][:, :HEARD], memory["scale"] = 1, 130
    memory["latent"] = rng.integers(0, 256, memory["latent"].shape)
    return Rows(swarm, memory)


def tick_us(planner: Planner, rows: Rows) -> float:
    """Return the time of a whole tick [us], best of the repeats."""
    best = np.inf
    for _ in range(REPEATS):
        swarm, memory = rows.again()
        held = Held(swarm)
        start = time.perf_counter_ns()
        planner.step_all(0, ROBOTS, held, memory, planner.params())
        best = min(best, (time.perf_counter_ns() - start) / 1e3 / ROBOTS)
    return best


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, default=None)
    asked = parser.parse_known_args()[0]
    planner = load_planner("giwt")
    planner = planner if asked.model is None else planner.with_model(asked.model)
    try:
        network = planner.model.network
    except SwarmscopeError as error:
        print(f"left out: {error}")
        return
    params, rows, clear = planner.params(), scene(planner, True), scene(planner, False)
    planner.step_all(0, 0, Held(rows.swarm), rows.memory, params)
    swarm, memory = rows.again()
    planner.step_all(0, ROBOTS, Held(swarm), memory, params)  # fills the tracks
    decided = int(swarm.decisions["fused"].sum())
    memory = rows.memory
    swarm.shared["ask_n"] = 1

    codes, sent = np.zeros((ROBOTS, swarm.scans.shape[1]), np.uint8), np.zeros(FEATURES, np.uint8)
    pictures = np.zeros((ROBOTS, 1, CHANNELS, CELLS, CELLS), np.float32)
    graph = empty_graph()

    def picture(i: int) -> None:
        look(i, swarm, codes[i])
        draw(codes[i], float(swarm.percepts["goal_bearing"][i]), network.view_m, swarm.rig, pictures[i, 0])

    def heard_by(i: int) -> int:
        return gather(i, swarm, memory, network.view_m, params.turned_deg, graph)

    def decide(i: int) -> None:
        n = heard_by(i) + 1
        network.p_left(graph.features[None, :n], graph.cells[None, :n], graph.gains[None, :n])

    def answer(i: int) -> None:
        swarm.decisions["n_out"][i] = 0
        put_answer(i, 0, graph.features[0], sent, swarm)

    drawn = best_us(picture)
    encoded = best_us(lambda i: network.encode(pictures[i]))
    graph.features[0] = network.encode(pictures[0])[0]
    fused, packed = best_us(decide), best_us(answer)
    nav_scope, _ = step_us()
    print(f"GIWT with {planner.model.folder}; us; the graph with {heard_by(0)} neighbours' features")
    print(f"  picture: scan to codes, neighbours out, drawn     {drawn:9.1f}")
    print(f"  encoder, one picture                              {encoded:9.1f}")
    print(f"  graph and mapper                                  {fused:9.1f}")
    print(f"  features to bytes to packet                       {packed:9.1f}")
    print(f"  one decision, own share                           {drawn + encoded + fused:9.1f}")
    print(f"  one decision, share of each neighbour asked       {drawn + encoded + packed:9.1f}")
    print(f"  whole tick, nothing in the way                    {tick_us(planner, clear):9.1f}")
    print(f"  whole tick with a decision                        {tick_us(planner, rows):9.1f}")
    print(f"  Nav-SCOPE's step with a decision                  {nav_scope:9.1f}")
    if decided != ROBOTS:
        raise SystemExit("the benchmark's robots did not all choose a side")


if __name__ == "__main__":
    main()
