"""One planning step, scan to command, against the FFTs that the papers spend on the two filters alone.

The step is the whole compiled call: four packets of features decoded, four neighbours tracked, safe directions,
the feature filter and its extrema, areas, four neighbours fused, the side chosen, the guard passed.
"""

from __future__ import annotations

import time

import numpy as np

from swarmscope.held import Held
from swarmscope.onboard.perception.filters import filter_padded, prepare_scan
from swarmscope.onboard.planners import load_planner
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.sharing.message import Head, encode_features
from swarmscope.onboard.view import Swarm, new_swarm
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_rig_of
from swarmscope.sim.beams import make_beams
from swarmscope.sim.lidar import cast_static
from swarmscope.sim.world import compile_world

ROBOTS = 64
REPEATS = 300
PUBLISHED_US = 15.9
REMEMBERED = ("percepts", "shared", "scans", "kept", "unseen", "misses")
"""What a step changes and the next one would find."""


def blocked_scans(robots: int) -> tuple[np.ndarray, np.ndarray]:
    """Return scans (N, 360) in the reference forest and a bearing (N,) in each that is blocked 1.5 m ahead."""
    scenario = parse_scenario({"task": {"name": "T1"}, "seed": 0}, "bench")
    world = compile_world(make_setup(scenario).world)
    beams = make_beams(360, 2.0 * np.pi, 5.0)
    rng = np.random.default_rng(1)
    scans, bearings = [], []
    scan = np.empty(360, np.float32)
    while len(scans) < robots:
        x, y = rng.uniform(1.0, 19.0, 2)
        cast_static(world, x, y, 0.0, beams, scan)
        ahead = np.flatnonzero((scan > 0.7) & (scan < 1.5))
        if scan.min() > 0.4 and len(ahead):
            scans.append(scan.copy())
            bearings.append(beams.angle_min + beams.increment * rng.choice(ahead))
    return np.array(scans), np.array(bearings)


def prepared(robots: int, rig: Rig) -> Swarm:
    """Return robots just before a choice of side with four answers in the inbox."""
    swarm = new_swarm(robots, rig)
    percepts, shared = swarm.percepts, swarm.shared
    swarm.scans[:], bearings = blocked_scans(robots)
    rng = np.random.default_rng(2)
    percepts["dt_s"], percepts["speed"] = 0.2, 0.5
    percepts["goal_bearing"], percepts["goal_distance"] = bearings, 12.0
    shared["asked_seq"], shared["asked_s"], shared["asked_n"], shared["seq"] = 7, -0.4, 4, 7
    shared["asked_id"][:, :4] = range(100, 104)
    for i in range(robots):
        percepts["n_neighbours"][i] = percepts["n_packets"][i] = 4
        for k in range(4):
            distance, turn = rng.uniform(1.1, 2.6), rng.uniform(-1.2, 1.2)
            percepts["neighbour_id"][i, k] = 100 + k
            percepts["neighbour_x"][i, k] = distance * np.cos(bearings[i] + turn)
            percepts["neighbour_y"][i, k] = distance * np.sin(bearings[i] + turn)
            angles = np.sort(rng.uniform(0.0, 2.0 * np.pi, 10))
            distances = rng.uniform(0.8, 5.0, 10)
            percepts["packet_length"][i, k] = encode_features(
                Head(100 + k, 0, 1, 7), angles, distances, 10, 5.0, percepts["packet"][i, k]
            )
    return swarm


def step_us() -> tuple[float, float]:
    """Return the time of one step [us] (best of the repeats) and the mean number of neighbours fused."""
    scenario = parse_scenario({"task": {"name": "T1"}}, "bench")
    planner = load_planner("nav-scope")
    params, before = planner.params(), prepared(ROBOTS, make_rig_of(scenario))
    decisions = before.decisions
    best = np.inf
    for _ in range(REPEATS):
        swarm = before._replace(**{name: getattr(before, name).copy() for name in REMEMBERED})
        held, memory = Held(swarm), planner.new_memory(ROBOTS)
        start = time.perf_counter_ns()
        planner.step_all(0, ROBOTS, held, memory, params)
        best = min(best, (time.perf_counter_ns() - start) / 1e3 / ROBOTS)
    if not decisions["fused"].all():
        raise SystemExit("the benchmark's robots did not all choose a side")
    return best, float(decisions["heard"].mean())


def fft_pairs_us(dtype: type[np.floating]) -> float:
    """Return the time [us] of two compiled 512-point real FFT + inverse pairs (numpy's pocketfft, batched)."""
    rows = np.random.default_rng(3).random((256, 512)).astype(dtype)
    best = np.inf
    for _ in range(100):
        start = time.perf_counter_ns()
        np.fft.irfft(np.fft.rfft(rows), 512)
        best = min(best, (time.perf_counter_ns() - start) / 1e3 / len(rows))
    return 2.0 * best


def filter_us() -> float:
    """Return the time of the 61-tap direct filter on one 360-beam scan, padding included [us]."""
    rig = make_rig_of(parse_scenario({"task": {"name": "T1"}}, "bench"))
    scans, _ = blocked_scans(ROBOTS)
    scratch = new_swarm(1, rig)
    best = np.inf
    for _ in range(REPEATS):
        start = time.perf_counter_ns()
        for scan in scans:
            prepare_scan(scan, 0.0, 5.0, True, rig.taps.size // 2, scratch.padded[0])
            filter_padded(scratch.padded[0], rig.taps, 5.0, scratch.filtered[0])
        best = min(best, (time.perf_counter_ns() - start) / 1e3 / ROBOTS)
    return best


def main() -> None:
    """Print the figures."""
    step, heard = step_us()
    print("planning step, scan to command, both filters, side chosen")
    print(f"  neighbours' features fused (of 4 heard)   {heard:8.2f}")
    print(f"  one step                                  {step:8.2f} us")
    for dtype in (np.float64, np.float32):
        floor = fft_pairs_us(dtype)
        print(f"  two 512-point FFT + inverse, {dtype.__name__}      {floor:8.2f} us   ratio {step / floor:.2f}")
    print(f"  published (another machine)               {PUBLISHED_US:8.2f} us   ratio {step / PUBLISHED_US:.2f}")
    print(f"  feature filter, called from Python        {filter_us():8.2f} us")


if __name__ == "__main__":
    main()
