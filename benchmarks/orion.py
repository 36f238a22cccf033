"""A planner in all of ORION's mazes of some files: who arrives, over how long a way, in how much time.

python benchmarks/orion.py ../shared/data/orion/*_even.npz --planner atlas-mute nav-scope

Cells of 1.5 m, a LiDAR of 5 m, nothing known of the maze beforehand; each robot has its own goal.
"""

from __future__ import annotations

import argparse
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from rich.progress import track

from swarmscope.judging.run import figures, play
from swarmscope.judging.statistics import bootstrap_mean
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.maps.orion import load_maze
from swarmscope.sim.scan_files import read_npz


class Job(NamedTuple):
    """A maze of a file, and who is to cross it."""

    file: Path
    number: int
    planner: str
    cell_m: float
    limit_s: float


def one(job: Job) -> dict[str, Any]:
    """Play a maze; return its figures."""
    robots = len(load_maze(job.file, job.number, job.cell_m).trips)
    values = {
        "map": {"file": str(job.file), "number": job.number, "resolution_m": job.cell_m},
        "robots": robots, "planner": {"name": job.planner}, "limit_s": job.limit_s, "record_scans": "no",
    }  # fmt: skip
    metrics = figures(play(parse_scenario(values, f"maze {job.number}"), any_angle=True))
    return metrics | {"job": job, "robots": robots}


def row(name: str, found: list[dict[str, Any]]) -> str:
    """Return a line of the table."""
    robots = sum(run["robots"] for run in found)
    arrived = sum(round(run["arrival_rate"] * run["robots"]) for run in found)
    cells = [f"{arrived} of {robots}", f"{sum(run['collisions'] for run in found):.0f}"]
    for key in ("path_stretch_any_angle", "duration_s", "plan_us_p50", "plan_us_p99"):
        values = np.array([np.nan if run[key] is None else run[key] for run in found], float)
        mean = bootstrap_mean(values[np.isfinite(values)])
        cells.append(f"{mean.estimate:.4g} ({mean.low:.4g} to {mean.high:.4g})")
    return f"| {name} | {found[0]['job'].planner} | " + " | ".join(cells) + " |"


def main() -> None:
    """Read the options, play, print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="+", type=Path)
    parser.add_argument("--planner", nargs="+", default=["atlas-mute"])
    parser.add_argument("--mazes", type=int, help="only the first so many of each file")
    parser.add_argument("--cell", type=float, default=1.5, help="side of a cell [m]")
    parser.add_argument("--limit", type=float, default=1800.0, help="of a run [s]")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    groups = [(file, planner) for file in options.files for planner in options.planner]
    jobs = [
        Job(file, int(number), planner, options.cell, options.limit)
        for file, planner in groups
        for number in read_npz(file)["map"][: options.mazes]
    ]
    one(jobs[0]._replace(limit_s=2.0))  # compiles what the others load
    with ProcessPoolExecutor(options.workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        runs = list(track(pool.map(one, jobs), "mazes", total=len(jobs)))
    print("| mazes | planner | arrived | contacts | stretch | last arrival [s] | step, median [us] | 99 % [us] |")
    print("|---" * 8 + "|")
    for file, planner in groups:
        found = [run for run in runs if (run["job"].file, run["job"].planner) == (file, planner)]
        print(row(f"{file.stem} ({len(found)})", found))
        for run in found:
            for failure in run["failures"]:
                print(f"  {run['job'].number} robot {failure['robot']}: {failure['why']}")


if __name__ == "__main__":
    main()
