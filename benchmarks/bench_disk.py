"""The 600 runs of the unit disk with each controller, and how many steps of robots a second that is.

The peer is the report's controller in plain NumPy (``examples/disk/report_numpy.py``), measured in the same process.

python benchmarks/bench_disk.py --controllers report reactive
"""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

import numpy as np

from swarmscope.disk import bounds, maps, rules, runs
from swarmscope.disk.study.batches import Choice, play_all, play_batch, read_choice

PEER = Path(__file__).parents[1] / "examples" / "disk" / "report_numpy.py"
PEER_STEPS = 4000


def peer_rate() -> float:
    """Return the robot-steps a second of the plain NumPy controller."""
    of = runs.problem(rules.Rules(max_steps=PEER_STEPS), [maps.NAMED["minima"]], [(0, 1, 2, 4, 3)])
    start = time.perf_counter()
    result = play_batch(Choice(str(PEER)), of)
    return float(result.outcome.steps.sum()) * of.rules.n / (time.perf_counter() - start)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--controllers", nargs="+", default=["report", "reactive"])
    parser.add_argument("--workers", type=int, default=len(os.sched_getaffinity(0)))
    arguments = parser.parse_args()
    of = runs.problem(rules.Rules(), list(maps.REPORT_MAPS.values()), list(rules.all_permutations(5)))
    least = bounds.bound(of)
    plain = peer_rate()
    print(f"plain NumPy, one process: {plain:,.0f} robot-steps/s")
    for name in arguments.controllers:
        choice = read_choice(name)
        play_batch(choice, of.part(slice(0, 1)))  # compiled before it is timed
        start = time.perf_counter()
        outcome = play_all(choice, of, arguments.workers).outcome
        seconds = time.perf_counter() - start
        rate = float(outcome.steps.sum()) * of.rules.n / seconds
        arrived = int((outcome.status == runs.ARRIVED).sum())
        hits = int(np.isin(outcome.status, runs.COLLISIONS).sum())
        print(
            f"{choice.label}: 600 runs in {seconds:.1f} s with {arguments.workers} processes, "
            f"{rate:,.0f} robot-steps/s ({rate / plain:,.0f} x plain NumPy); {arrived} arrive, {hits} collide, "
            f"mean {outcome.steps.mean():.1f} steps, {outcome.steps.mean() / least.mean():.4f} of the bound"
        )


if __name__ == "__main__":
    main()
