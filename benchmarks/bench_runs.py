"""What one run of each planner costs, and what that makes of a million runs.

python benchmarks/bench_runs.py --seeds 10
"""

from __future__ import annotations

import argparse
import time
from typing import Any

import numpy as np

from swarmscope.errors import SwarmscopeError
from swarmscope.experiments.work import make_job, unit_key, work, world_key
from swarmscope.judging.references import reference_ways
from swarmscope.judging.run import play
from swarmscope.judging.sides import make_advice
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import complete

MILLION = 1e6
HOUR = 3600.0


def costs(planner: str, seed: int) -> dict[str, float]:
    """Return the seconds of each part of one run."""
    values: dict[str, Any] = {
        "task": {"name": "T1"},
        "planner": {"name": planner},
        "seed": seed,
        "record_scans": "no",
    }
    scenario = parse_scenario(values, "bench")
    times = [time.perf_counter()]
    setup = make_setup(scenario)
    times.append(time.perf_counter())
    references = reference_ways(setup, scenario.robot.radius_m)
    times.append(time.perf_counter())
    if load_planner(planner).told:
        make_advice(setup, scenario.robot.radius_m + scenario.safety.margin_m)
    times.append(time.perf_counter())
    run_s = play(scenario, references=references).trace.wall_s
    config = complete(scenario)
    known = {
        "shortest_m": references.shortest_m.tolist(),
        "any_angle_m": references.any_angle_m.tolist(),
        "wall_s": 0.0,
    }
    job = make_job(unit_key(scenario), world_key(scenario), config, known)
    times.append(time.perf_counter())
    work(job)
    whole = time.perf_counter() - times[-1]
    world, reference, sides = np.diff(times[:4])
    return {
        "world": world,
        "references": reference,
        "sides": sides,
        "grid": references.wall_s,
        "run": run_s,
        "unit": whole,
    }


def main() -> None:
    """Measure every planner and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=10)
    seeds = range(parser.parse_args().seeds)
    print(
        "T1, 15 robots; ms, mean over seeds; 'unit': all but the references, which are found once a world"
    )
    print(
        f"{'planner':10s} {'world':>7s} {'A* 0.05 m':>10s} {'any angle':>10s} {'sides':>7s} {'run':>7s} {'unit':>7s}",
        end=" ",
    )
    print("a million units on 1, 16, 1000 cores")
    for planner in planner_names():
        try:
            load_planner(planner).check_available()
        except SwarmscopeError as error:
            print(f"{planner:10s} left out: {error}")
            continue
        costs(planner, 0)  # loads the kernels
        rows = [costs(planner, seed) for seed in seeds]
        mean = {key: 1e3 * float(np.mean([row[key] for row in rows])) for key in rows[0]}
        hours = mean["unit"] / 1e3 * MILLION / HOUR
        print(
            f"{planner:10s} {mean['world']:7.1f} {mean['grid']:10.1f} {mean['references'] - mean['grid']:10.1f}",
            end=" ",
        )
        print(f"{mean['sides']:7.1f} {mean['run']:7.1f} {mean['unit']:7.1f}", end=" ")
        print(f"{hours:.0f} h, {hours / 16:.1f} h, {hours / 1000 * 60:.0f} min")


if __name__ == "__main__":
    main()
