"""The reference world against real time, and the cost of a robot and tick from 15 to 10 000 robots."""

from __future__ import annotations

import argparse
import time

from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.loop import run

NOISE = {
    "noise": {"range_fraction": 0.05, "bearing_deg": 3.0, "compass_deg": 3.0, "dropout": 0.01},
    "radio": {"loss": 0.2, "latency_s": 0.2},
}


def timed(robots: int, limit_s: float, repeats: int, **extra: object) -> tuple[float, float, int]:
    """Return the best (real-time factor, us per robot and tick) over ``repeats`` and the planner's bytes."""
    values = {"task": {"name": "T1"}, "robots": robots, "limit_s": limit_s, "record_scans": "no", **extra}
    scenario = parse_scenario(values, "bench")
    setting = make_setting(scenario, make_setup(scenario))
    best_factor, best_us, memory = 0.0, float("inf"), 0
    for _ in range(repeats):
        start = time.perf_counter()
        trace = run(setting)
        wall = time.perf_counter() - start
        ticks = len(trace.t_s)
        best_factor = max(best_factor, ticks * setting.dt / wall)
        best_us = min(best_us, 1e6 * wall / (ticks * robots))
        memory = trace.memory_bytes
    return best_factor, best_us, memory


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="up to 1 000 robots only")
    quick = parser.parse_args().quick
    timed(15, 2.0, 1)
    print("reference world: T1, 15 robots, 140 trees, 360 beams, 5 Hz, one core")
    for name, extra in (("noise-free", {}), ("all noise on", NOISE), ("scans recorded", {"record_scans": "yes"})):
        factor, us, memory = timed(15, 60.0, 5, **extra)
        print(f"  {name:<16} {factor:8.0f} times real time (goal >= 1000)   {us:6.2f} us per robot and tick")
    print(f"  planner memory per robot {memory} bytes (published 14.9 KB)")
    print("constant density, T1, first 10 s, one core")
    floor = 0.0
    for robots in (15, 100, 1000) if quick else (15, 100, 1000, 10_000):
        _, us, _ = timed(robots, 10.0, 3 if robots < 1000 else 1)
        floor = floor or us
        print(f"  {robots:6d} robots   {us:6.2f} us per robot and tick   ratio to 15 robots {us / floor:.2f}")


if __name__ == "__main__":
    main()
