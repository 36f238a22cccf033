"""Many seeded runs of the tasks, counted and compared: the command behind the tables in the docs.

python benchmarks/crossings.py --tasks T1 T2 T3 --seeds 0-99 --against planner.params.w_i=0
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from swarmscope.judging.provenance import own_revision, versions
from swarmscope.judging.run import figures, play
from swarmscope.judging.statistics import bootstrap_mean, paired_difference, wilson
from swarmscope.scenarios.overrides import set_key
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.maps import packaged_map
from swarmscope.tasks import task_names

NOISY = (
    "noise.range_fraction=0.05",
    "noise.bearing_deg=3",
    "noise.compass_deg=3",
    "radio.loss=0.2",
    "radio.latency_s=0.2",
)
PUBLISHED = {"T1": 0.051, "T2": 0.044, "T3": 0.071}
KEPT = (
    "arrival_rate",
    "path_redundancy",
    "path_stretch",
    "path_stretch_any_angle",
    "spl",
    "duration_s",
    "waiting_s",
    "collisions",
    "min_clearance_m",
    "fusions",
    "messages",
    "mean_package_bytes",
    "failures",
)


def one(job: tuple[str, int, tuple[str, ...], bool]) -> dict[str, Any]:
    """Run one scenario and return its figures."""
    task, seed, changes, any_angle = job
    values: dict[str, Any] = {"seed": seed, "record_scans": "no"}
    if task in task_names():
        values["task"] = {"name": task}
    else:
        values |= {"map": {"file": str(packaged_map(task))}, "robots": 5, "limit_s": 600.0}
    for change in changes:
        set_key(values, change)
    outcome = play(parse_scenario(values, "crossings"), any_angle=any_angle)
    metrics = figures(outcome)
    robots = outcome.trace.robots
    arrived = np.isfinite(robots["arrival_s"])
    compared = arrived & np.isfinite(outcome.references.shortest_m)
    row = {key: metrics.get(key) for key in KEPT}
    return row | {
        "task": task,
        "seed": seed,
        "robots": len(robots),
        "arrived": int(arrived.sum()),
        "travelled_m": float(robots["length"][compared].sum()),
        "shortest_m": float(outcome.references.shortest_m[compared].sum()),
    }


def run_all(
    tasks: list[str], seeds: range, changes: tuple[str, ...], any_angle: bool, workers: int, words: str
) -> list[dict[str, Any]]:
    """Run every task with every seed, in processes; the first run compiles what the others load."""
    jobs = [(task, seed, changes, any_angle) for task in tasks for seed in seeds]
    one((tasks[0], seeds[0], (*changes, "limit_s=2.0"), any_angle))
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        return list(track(pool.map(one, jobs, chunksize=4), words, total=len(jobs)))


def summarise(task: str, rows: list[dict[str, Any]]) -> None:
    """Print the figures of one task."""
    robots, arrived = sum(r["robots"] for r in rows), sum(r["arrived"] for r in rows)
    share = wilson(arrived, robots)
    travelled, shortest = (sum(r[k] for r in rows) for k in ("travelled_m", "shortest_m"))
    gamma = 1.0 - arrived / robots * shortest / travelled if travelled > 0.0 else float("nan")
    per_map = bootstrap_mean(values(rows, "path_redundancy"))
    print(f"{task}: {len(rows)} runs, {arrived} of {robots} robots arrived", end=" ")
    print(f"({share.estimate:.2%}, 95 % {share.low:.2%} to {share.high:.2%})")
    print(f"  path redundancy {gamma:.2%} (published {PUBLISHED.get(task, float('nan')):.1%})", end=" ")
    print(f"per map {per_map.estimate:.2%} ({per_map.low:.2%} to {per_map.high:.2%})")
    print(f"  stretch over A* {travelled / shortest if shortest > 0.0 else float('nan'):.4f}", end=" ")
    true = values(rows, "path_stretch_any_angle")
    if np.isfinite(true).any():
        print(f"over the true shortest way {np.nanmean(true):.4f}", end=" ")
    print(f"SPL {values(rows, 'spl').mean():.2%} last arrival {np.nanmean(values(rows, 'duration_s')):.1f} s")
    print(f"  collisions {sum(r['collisions'] for r in rows)}", end=" ")
    print(f"smallest clearance {values(rows, 'min_clearance_m').min():.4f} m", end=" ")
    print(f"waiting {values(rows, 'waiting_s').mean():.2f} s per robot")
    print(f"  sides chosen {values(rows, 'fusions').mean():.1f}", end=" ")
    print(f"packets {values(rows, 'messages').mean():.0f} per run", end=" ")
    sizes = values(rows, "mean_package_bytes")
    print(f"features {np.nanmean(sizes):.1f} bytes" if np.isfinite(sizes).any() else "no features sent")
    for row in rows:
        for failure in row["failures"]:
            print(f"  seed {row['seed']} robot {failure['robot']}: {failure['why']}")


def values(rows: list[dict[str, Any]], key: str) -> np.ndarray:
    """Return one figure of every run, NaN where it has none."""
    return np.array([np.nan if r[key] is None else r[key] for r in rows], float)


def compare(task: str, ours: list[dict[str, Any]], others: list[dict[str, Any]], words: str) -> None:
    """Print the paired differences, seed by seed."""
    for key, unit in (("path_redundancy", 100.0), ("duration_s", 1.0), ("arrival_rate", 100.0)):
        first, second = values(ours, key) * unit, values(others, key) * unit
        both = np.isfinite(first) & np.isfinite(second)
        d = paired_difference(first[both], second[both])
        name = f"{key} [{'%' if unit > 1.0 else 's'}]"
        interval = f"{d.estimate:+.3f} ({d.low:+.3f} to {d.high:+.3f}), p {d.p_value:.3f}"
        print(f"  {task} ours - ({words}): {name:22s} {interval}")


def main() -> None:
    """Parse the options, run, print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tasks", nargs="+", default=["T1", "T2", "T3"], help="tasks, or packaged maps")
    parser.add_argument("--seeds", default="0-99", help="first-last")
    parser.add_argument(
        "--set", dest="changes", action="append", default=[], help="key.path=value, repeatable"
    )
    parser.add_argument("--noise", action="store_true", help=f"the noisy setting: {', '.join(NOISY)}")
    parser.add_argument("--against", help="key.path=value of a second set of runs, compared seed by seed")
    parser.add_argument("--any-angle", action="store_true", help="also the true shortest ways (slower)")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, help="write every run's figures as JSON")
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    changes = (*(NOISY if options.noise else ()), *options.changes)
    rows = run_all(options.tasks, seeds, changes, options.any_angle, options.workers, "ours")
    for task in options.tasks:
        summarise(task, [r for r in rows if r["task"] == task])
    others: list[dict[str, Any]] = []
    if options.against:
        others = run_all(options.tasks, seeds, (*changes, options.against), False, options.workers, "other")
        print(f"with {options.against}")
        for task in options.tasks:
            mine, theirs = ([r for r in part if r["task"] == task] for part in (rows, others))
            summarise(task, theirs)
            compare(task, mine, theirs, options.against)
    if options.out:
        about = {"changes": changes, "seeds": options.seeds, "versions": versions(), "git": own_revision()}
        table = {"about": about, "runs": rows, "against": {"change": options.against, "runs": others}}
        options.out.write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
