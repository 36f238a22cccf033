"""What traffic costs: robots that cross a world together against the same robots each alone in it.

python benchmarks/alone.py --tasks hospital warehouse rubble --seeds 0-39 --set planner.name=atlas-mute

Ways over the true shortest ways, means over the robots of a world that arrived both ways; the ratio of both means world
by world, with a 95 % bootstrap interval over worlds; last arrivals in the same way.
"""

from __future__ import annotations

import argparse
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from rich.progress import track

from swarmscope.judging.references import reference_ways
from swarmscope.judging.run import judged_setting
from swarmscope.judging.statistics import bootstrap_mean
from swarmscope.scenarios.overrides import set_key
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.loop import run
from swarmscope.tasks._contract import Setup


class Found(NamedTuple):
    """One world: N robots together, and each alone."""

    together_m: np.ndarray
    alone_m: np.ndarray
    shortest_m: np.ndarray
    together_s: np.ndarray
    alone_s: np.ndarray
    """NaN: did not arrive."""
    touched: int


def one(job: tuple[str, int, tuple[str, ...]]) -> Found:
    """Play a world with all its robots, then with each of them alone."""
    task, seed, changes = job
    values: dict[str, Any] = {"task": {"name": task}, "seed": seed, "record_scans": "no"}
    for change in changes:
        set_key(values, change)
    scenario = parse_scenario(values, "alone")
    if len(np.unique(scenario.radii_m)) > 1:
        raise SystemExit("robots of different sizes cannot be compared with one alone")
    setup = make_setup(scenario)
    references = reference_ways(setup, scenario.radii_m)
    every = run(judged_setting(scenario, setup)).robots
    single = scenario.model_copy(update={"robots": 1})
    alone = np.concatenate([run(judged_setting(single, only(setup, i))).robots for i in range(len(every))])
    touched = int(every["crashed"].sum() + alone["crashed"].sum())
    together_s, alone_s = arrivals(every), arrivals(alone)
    return Found(every["length"], alone["length"], references.any_angle_m, together_s, alone_s, touched)


def arrivals(robots: np.ndarray) -> np.ndarray:
    """Return when each robot arrived [s], NaN for those that did not."""
    return np.where(robots["arrived"], robots["arrival_s"], np.nan)


def only(setup: Setup, i: int) -> Setup:
    """Return a world with one of its robots."""
    return replace(
        setup,
        starts=setup.starts[i : i + 1],
        goals=setup.goals[i : i + 1],
        goal_yaws=None if setup.goal_yaws is None else setup.goal_yaws[i : i + 1],
        start_s=None if setup.start_s is None else setup.start_s[i : i + 1],
    )


def row(task: str, found: list[Found]) -> str:
    """Return a line of the table."""
    ratios, stretches, last = [], [], []
    for world in found:
        both = np.isfinite(world.together_s) & np.isfinite(world.alone_s)
        if both.any():
            sums = [part[both].sum() for part in (world.together_m, world.alone_m, world.shortest_m)]
            stretches.append((sums[0] / sums[2], sums[1] / sums[2]))
            ratios.append(sums[0] / sums[1])
            last.append(world.together_s[both].max() / world.alone_s[both].max())
    if not ratios:
        return f"| {task} ({len(found)}) | nobody arrived both ways |"
    robots = sum(len(world.together_s) for world in found)
    cells = [
        f"{sum(int(np.isfinite(part).sum()) for part in parts)} of {robots}"
        for parts in zip(*((world.together_s, world.alone_s) for world in found), strict=True)
    ]
    cells += [f"{value:.3f}" for value in np.mean(stretches, axis=0)]
    for values in (ratios, last):
        mean = bootstrap_mean(np.array(values))
        cells.append(f"{mean.estimate:.3f} ({mean.low:.3f} to {mean.high:.3f})")
    cells.append(str(sum(world.touched for world in found)))
    return f"| {task} ({len(found)}) | " + " | ".join(cells) + " |"


def main() -> None:
    """Read the options, play, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--tasks", nargs="+", default=["hospital", "warehouse", "rubble"])
    parser.add_argument("--seeds", default="0-39", help="first-last")
    parser.add_argument("--set", dest="changes", action="append", default=[], help="key.path=value, repeatable")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    changes = ("limit_s=900", *options.changes)
    jobs = [(task, seed, changes) for task in options.tasks for seed in seeds]
    one((options.tasks[0], seeds[0], (*changes, "limit_s=2", "robots=2")))  # compiles what the others load
    with ProcessPoolExecutor(options.workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        worlds = list(track(pool.map(one, jobs), "worlds", total=len(jobs)))
    print("| worlds | together | alone | stretch together | alone | ratio | ratio of last arrivals | contacts |")
    print("|---" * 8 + "|")
    for task in options.tasks:
        print(row(task, [world for world, job in zip(worlds, jobs, strict=True) if job[0] == task]))


if __name__ == "__main__":
    main()
