"""What each deviation from a document does alone: taken out of our rules, and put into the printed ones, map by map.

python benchmarks/deviations.py --planner nav-scope --seeds 0-99

A row of the table is one thing that `planner.preset=printed` changes (`DEVIATIONS`). "Ours, this as printed" is the
planner as it is by default but for that; "printed, this as ours" is the preset but for that. Differences are γ (24) in
points, map by map, with a 95 % bootstrap interval and the p value of the sign-flip test, corrected for all tests of the
table (Holm).
"""

from __future__ import annotations

import argparse
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numpy as np
from rich.progress import track

from crossings import one
from swarmscope.judging.statistics import PairedDifference, paired_difference
from swarmscope.onboard.planners import load_planner
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import complete
from swarmscope.viewing.report.words import EVIDENCE, holm

TASKS = ("T1", "T2", "T3")
DEVIATIONS = {
    "safe directions by the sector within l_th (3)": ("safety.sector", "safety.look_ahead_m"),
    "filter (6) with M taps": ("features.filter",),
    "b_0 = 0 in (9)": ("planner.params.prior",),
    "asks when it has to choose, not ahead": ("planner.params.ask_ahead_s",),
    "(17) with w_i, no priority, no end": (
        "planner.params.repulsion",
        "planner.params.priority",
        "planner.params.wait_s",
    ),
    "side held until circumnavigated": ("planner.params.reopen",),
    "nearest safe direction to the target (16): no winding, no narrower gap": (
        "planner.params.turn_back",
        "planner.params.wide_turn",
    ),
    "loops not noticed": ("planner.params.loop_m", "planner.params.stuck_s"),
    "every obstacle is a new one": ("planner.params.resume_m",),
    "dead end: turns on the spot": ("planner.params.escape",),
    "turns not finished first": ("planner.params.finish_turns",),
    "stands while it turns": ("planner.params.in_place",),
    "DH-Bug: random side": ("planner.params.turn",),
    "DH-Bug: leaves without being nearer": ("planner.params.nearer",),
    "DH-Bug: loops not noticed": ("planner.params.loops",),
    "DH-Bug: (2) down to 0": ("planner.params.creep",),
    "DH-Bug: waits without end": ("planner.params.wait_s",),
}
"""Things that belong together, with their keys."""

Changes = tuple[str, ...]
Runs = dict[str, list[dict[str, Any]]]
"""By task, in the order of the seeds."""


def changes_of(planner: str) -> dict[str, tuple[Changes, Changes]]:
    """Return, for each thing that the planner's preset changes, its printed values and ours as ``key=value``."""
    preset = load_planner(planner).presets["printed"]
    usual = complete(parse_scenario({"task": {"name": "T1"}, "planner": {"name": planner}}, "usual"))
    found = {}
    for words, keys in DEVIATIONS.items():
        mine = [key for key in keys if key in preset]
        if len(mine) == len(keys) and words.startswith("DH-Bug") <= ("planner.params.nearer" in preset):
            printed = tuple(f"{key}={_text(preset[key])}" for key in mine)
            found[words] = (printed, tuple(f"{key}={_text(_at(usual, key))}" for key in mine))
    return found


def _at(values: Any, key: str) -> Any:
    for part in key.split("."):
        values = values[part]
    return values


def _text(value: Any) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)


def run_all(cases: dict[str, Changes], seeds: range, workers: int) -> dict[str, Runs]:
    """Return the runs of every case and task, in the order of the seeds."""
    jobs = [(task, seed, changes, False) for changes in cases.values() for task in TASKS for seed in seeds]
    one((TASKS[0], seeds[0], (*next(iter(cases.values())), "limit_s=2.0"), False))  # compiles for the others
    with ProcessPoolExecutor(workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        rows = iter(list(track(pool.map(one, jobs, chunksize=4), "runs", total=len(jobs))))
    return {name: {task: [next(rows) for _ in seeds] for task in TASKS} for name in cases}


def gamma(rows: list[dict[str, Any]]) -> str:
    """Return γ with sums over all maps, and arrivals where some are missing."""
    robots, arrived = sum(r["robots"] for r in rows), sum(r["arrived"] for r in rows)
    travelled, shortest = (sum(r[key] for r in rows) for key in ("travelled_m", "shortest_m"))
    share = 1.0 - arrived / robots * shortest / travelled
    return f"{100.0 * share:.1f} %" + (f" ({arrived} of {robots})" if arrived < robots else "")


def difference(rows: list[dict[str, Any]], base: list[dict[str, Any]]) -> PairedDifference:
    """Return by how many points γ is higher, map by map."""
    first, second = (100.0 * np.array([r["path_redundancy"] for r in part], float) for part in (rows, base))
    return paired_difference(first, second)


def print_differences(begin: str, base: Runs, cases: dict[str, Runs]) -> None:
    """Print a table of what each case differs from the base by, task by task."""
    print(f"\n| {begin}: points of γ | " + " | ".join(TASKS) + " |\n|---|---|---|---|")
    tests = {(words, task): difference(runs[task], base[task]) for words, runs in cases.items() for task in TASKS}
    corrected = dict(zip(tests, holm([found.p_value for found in tests.values()]), strict=True))
    for words, runs in cases.items():
        cells = []
        for task in TASKS:
            found, sure = tests[words, task], "*" if corrected[words, task] < EVIDENCE else ""
            cells.append(f"{found.estimate:+.1f} ({found.low:+.1f} to {found.high:+.1f}){sure}{_lost(runs[task])}")
        print(f"| {words} | " + " | ".join(cells) + " |")


def _lost(rows: list[dict[str, Any]]) -> str:
    robots, arrived = sum(r["robots"] for r in rows), sum(r["arrived"] for r in rows)
    return f", {robots - arrived} lost" if arrived < robots else ""


def main() -> None:
    """Parse the options, run, print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--planner", default="nav-scope", help="one with a preset 'printed'")
    parser.add_argument("--seeds", default="0-99", help="first-last")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    ours, printed = (f"planner.name={options.planner}",), (f"planner.name={options.planner}", "planner.preset=printed")
    parts = changes_of(options.planner)
    cases: dict[str, Changes] = {"ours": ours, "printed": printed}
    cases |= {f"ours {words}": (*ours, *as_printed) for words, (as_printed, _) in parts.items()}
    cases |= {f"printed {words}": (*printed, *as_ours) for words, (_, as_ours) in parts.items()}
    runs = run_all(cases, range(int(first), int(last or first) + 1), options.workers)
    print(f"| {options.planner}, γ | " + " | ".join(TASKS) + " |\n|---|---|---|---|")
    for name in ("ours", "printed"):
        print(f"| {name} | " + " | ".join(gamma(runs[name][task]) for task in TASKS) + " |")
    for base, begin in (("ours", "ours, this as printed"), ("printed", "printed, this as ours")):
        print_differences(begin, runs[base], {words: runs[f"{base} {words}"] for words in parts})
    print(f"\n\\* Holm's p below {EVIDENCE}.")


if __name__ == "__main__":
    main()
