"""Data sheets from one end to the other, drawn at random: who touches something, who arrives, which sheets are refused.

python benchmarks/sweep.py --runs 0-19999 --out sweep.json
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from swarmscope.errors import ConfigError, SwarmscopeError
from swarmscope.judging.provenance import own_revision, versions
from swarmscope.judging.references import reference_ways
from swarmscope.judging.run import figures, play
from swarmscope.judging.statistics import wilson
from swarmscope.onboard.control.guard import speed_of_horizon
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_rig_of
from swarmscope.storm.runs import usual_planners

TASKS = ("T1", "T2", "T3", "corridor", "swap", "doorway", "intersection", "u_trap", "GIWT_1", "GIWT_2", "long_wall")
SPANS = {
    "robot.v_max_mps": (0.2, 3.0),
    "robot.a_max_mps2": (0.25, 4.0),
    "lidar.range_m": (1.0, 20.0),
    "lidar.rate_hz": (1.0, 20.0),
}
"""Each factor is as likely as the next."""
ROBOTS = (2, 12)
STREAM = 77
"""Nothing was tuned on worlds and sheets of it."""
TIMES = 4.0
"""So many times the way at the speed that the horizon allows may a robot take, ..."""
START_S = 10.0
"""... and so long to get going."""


def drawn(index: int, planners: list[str]) -> dict[str, Any]:
    """Return the scenario of a run without its limit."""
    rng = np.random.default_rng([STREAM, index])
    values: dict[str, Any] = {"seed": index, "record_scans": "no", "robot": {}, "lidar": {}}
    for name, span in SPANS.items():
        group, _, key = name.partition(".")
        values[group][key] = float(f"{np.exp(rng.uniform(*np.log(span))):.4g}")
    view = round(rng.uniform(60.0, 360.0), 1)
    values["lidar"]["fov_deg"] = 360.0 if rng.random() < 0.5 else view
    values["guard"] = {"clearance_m": 0.0} if rng.random() < 0.5 else {}
    values["task"] = {"name": TASKS[rng.integers(len(TASKS))]}
    values["planner"] = {"name": planners[rng.integers(len(planners))]}
    values["robots"] = int(rng.integers(ROBOTS[0], ROBOTS[1] + 1))
    return values


def one(job: tuple[int, list[str]]) -> dict[str, Any]:
    """Play a run and return what came of it."""
    index, planners = job
    values = drawn(index, planners)
    row = {"run": index, "planner": values["planner"]["name"], "task": values["task"]["name"]}
    try:
        scenario = parse_scenario(values, "sweep")
        setup = make_setup(scenario)
        ways = reference_ways(setup, scenario.robot.radius_m, False)
        speed = speed_of_horizon(make_rig_of(scenario), 1.0 / scenario.lidar.rate_hz)
        longest = float(np.nanmax(ways.shortest_m, initial=0.0))
        values["limit_s"] = round(START_S + TIMES * longest / min(speed, scenario.robot.v_max_mps), 1)
        outcome = play(parse_scenario(values, "sweep"), any_angle=False, references=ways)
    except ConfigError as error:
        return row | {"refused": error.where.removeprefix("sweep: "), "words": str(error)}
    except SwarmscopeError as error:
        return row | {"refused": "world", "words": str(error)}
    robots = outcome.trace.robots
    late = [f["why"].split(";")[0] for f in figures(outcome)["failures"]]
    row |= {"robots": len(robots), "arrived": int(robots["arrived"].sum()), "contacts": int(robots["crashed"].sum())}
    return row | {"why": late, "scenario": values if robots["crashed"].any() or late else None}


def share(rows: list[dict[str, Any]]) -> str:
    """Return how many robots arrived, in words."""
    robots, arrived = sum(r["robots"] for r in rows), sum(r["arrived"] for r in rows)
    found = wilson(arrived, robots)
    return f"{arrived} of {robots} robots arrived, {found.estimate:.2%} ({found.low:.2%} to {found.high:.2%})"


def summarise(rows: list[dict[str, Any]]) -> None:
    """Print what came of all."""
    played = [r for r in rows if "robots" in r]
    refused = [r for r in rows if "refused" in r]
    print(f"{len(rows)} runs, {len(played)} played, {sum(r['contacts'] for r in played)} robots touched something")
    if played:
        print(share(played))
    for key in ("planner", "task"):
        for name in sorted({r[key] for r in played}):
            print(f"  {name:12s} {share([r for r in played if r[key] == name])}")
    reasons = Counter(why for row in played for why in row["why"])
    print("why not: " + ", ".join(f"{count} {why}" for why, count in reasons.most_common(8)))
    for key, count in Counter(r["refused"] for r in refused).most_common():
        example = next(r["words"] for r in refused if r["refused"] == key)
        print(f"  refused {count} times by {key}, as in: {example}")
    for row in played:
        if row["contacts"]:
            print(f"CONTACT in run {row['run']}: {json.dumps(row['scenario'])}")


def main() -> None:
    """Parse the options, run, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--runs", default="0-199", help="first-last")
    parser.add_argument("--planner", nargs="+", help="else all that need no training")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, help="write every run as JSON")
    options = parser.parse_args()
    first, _, last = options.runs.partition("-")
    planners = options.planner or usual_planners()
    jobs = [(index, planners) for index in range(int(first), int(last or first) + 1)]
    with ProcessPoolExecutor(options.workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        rows = list(track(pool.map(one, jobs, chunksize=4), "sweep", total=len(jobs)))
    summarise(rows)
    if options.out:
        about = {"runs": options.runs, "planners": planners, "versions": versions(), "git": own_revision()}
        options.out.write_text(json.dumps({"about": about, "runs": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
