"""GIWT's planner part by part, beside Nav-SCOPE's planning step measured in the same run.

One decision costs the robot that decides its own picture, one encoding and the graph; every neighbour that it asked
spends a picture, an encoding and a packet. ``--model`` takes another folder than the one that comes with the package.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from bench_step import prepared, step_us
from swarmscope.errors import SwarmscopeError
from swarmscope.onboard.percept import DECISION
from swarmscope.onboard.view import new_swarm
from swarmscope.onboard.network.local_map import CELLS, CHANNELS
from swarmscope.onboard.planning import giwt
from swarmscope.onboard.planning._giwt import Params, draw, empty_graph, gather, look, put_answer
from swarmscope.onboard.network.graph import FEATURES
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_rig_of

ROBOTS = 64
REPEATS = 30
HEARD = 4


def best_us(call: Callable[[int], object]) -> float:
    """Return the mean time of ``call`` over the robots [us], best of the repeats."""
    best = np.inf
    for _ in range(REPEATS):
        start = time.perf_counter_ns()
        for i in range(ROBOTS):
            call(i)
        best = min(best, (time.perf_counter_ns() - start) / 1e3 / ROBOTS)
    return best


def scene(planner: Any, blocked: bool) -> tuple[Any, ...]:
    """Return ranges, percepts, shared, memories, decisions of robots with four answers in.

    They are at key points, something 0.5 m ahead and on both sides, or with nothing in the way at all.
    """
    before = prepared(ROBOTS)
    angles = np.arange(before["scans"].shape[1]) * 2.0 * np.pi / before["scans"].shape[1] - np.pi
    off = angles[None] - before["percepts"]["goal_bearing"][:, None]
    ahead = np.abs((off + np.pi) % (2.0 * np.pi) - np.pi) < np.radians(100.0)
    scans = np.where(ahead, np.minimum(before["scans"], 0.5) if blocked else np.inf, before["scans"])
    percepts, shared, memory = before["percepts"], before["shared"], planner.new_memory(ROBOTS)
    rng = np.random.default_rng(4)
    percepts["n_packets"] = 0
    shared["asked_n"] = shared["answers_n"] = HEARD
    memory["direction"] = percepts["goal_bearing"]
    memory["asked_id"][:, :HEARD] = percepts["neighbour_id"][:, :HEARD]
    memory["answered"][:, :HEARD], memory["scale"] = 1, 130
    memory["latent"] = rng.integers(0, 256, memory["latent"].shape)
    return scans.astype(np.float32), percepts, shared, memory, np.zeros(ROBOTS, DECISION)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--model", type=Path, default=None)
    asked = parser.parse_known_args()[0]
    planner = giwt.PLANNER if asked.model is None else giwt.with_model(asked.model)
    try:
        network = planner.network
    except SwarmscopeError as error:
        print(f"left out: {error}")
        return
    rig, params = make_rig_of(parse_scenario({"task": {"name": "T1"}}, "bench")), Params()
    scratch = new_scratch(ROBOTS, rig)
    rows, clear = scene(planner, True), scene(planner, False)
    planner.step_all(0, 0, *rows, scratch, rig, params)
    ticked = [array.copy() for array in rows]
    planner.step_all(0, ROBOTS, *ticked, scratch, rig, params)  # fills the tracks
    decided = int(ticked[4]["fused"].sum())
    ranges, percepts, shared, memory, decisions = (*rows[:2], ticked[2], rows[3], ticked[4])
    shared["ask_n"] = 1

    codes, sent = np.zeros((ROBOTS, rig.sensor.beams), np.uint8), np.zeros(FEATURES, np.uint8)
    pictures = np.zeros((ROBOTS, 1, CHANNELS, CELLS, CELLS), np.float32)
    features, cells, gains = empty_graph()

    known = (decisions, rig, params, network.view_m, features[0], cells[0], gains[0])

    def picture(i: int) -> None:
        look(i, ranges, percepts, rig, codes[i])
        draw(codes[i], float(percepts["goal_bearing"][i]), network.view_m, rig, pictures[i, 0])

    def graph(i: int) -> None:
        n = gather(i, percepts, shared, memory, *known) + 1
        network.p_left(features[:, :n], cells[:, :n], gains[:, :n])

    def answer(i: int) -> None:
        decisions["n_out"][i] = 0
        put_answer(i, 0, features[0, 0], sent, percepts, shared, decisions)

    drawn = best_us(picture)
    encoded = best_us(lambda i: network.encode(pictures[i]))
    features[0, 0] = network.encode(pictures[0])[0]
    fused, packed = best_us(graph), best_us(answer)
    heard = gather(0, percepts, shared, memory, *known)

    def tick(before: tuple[Any, ...]) -> float:
        best = np.inf
        for _ in range(REPEATS):
            again = [array.copy() for array in before]
            start = time.perf_counter_ns()
            planner.step_all(0, ROBOTS, *again, scratch, rig, params)
            best = min(best, (time.perf_counter_ns() - start) / 1e3 / ROBOTS)
        return best

    nav_scope, _ = step_us()
    print(f"GIWT with {planner.folder}; us; the graph with {heard} neighbours' features")
    print(f"  picture: scan to codes, neighbours out, drawn     {drawn:9.1f}")
    print(f"  encoder, one picture                              {encoded:9.1f}")
    print(f"  graph and mapper                                  {fused:9.1f}")
    print(f"  features to bytes to packet                       {packed:9.1f}")
    print(f"  one decision, own share                           {drawn + encoded + fused:9.1f}")
    print(f"  one decision, share of each neighbour asked       {drawn + encoded + packed:9.1f}")
    print(f"  whole tick, nothing in the way                    {tick(clear):9.1f}")
    print(f"  whole tick with a decision                        {tick(rows):9.1f}")
    print(f"  Nav-SCOPE's step with a decision                  {nav_scope:9.1f}")
    if decided != ROBOTS:
        raise SystemExit("the benchmark's robots did not all choose a side")


if __name__ == "__main__":
    main()
