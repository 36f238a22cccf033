"""Where sharing could pay with the printed rules: tree radius x density x range of the LiDAR x threshold w_n.

python benchmarks/surroundings.py --seeds 0-29

Task T1, planner nav-scope, preset printed, guard on. For each: how often P_a (9) and P_ni (14) are on the wrong side of
the shortest way on the true map, how often neighbours turn a choice round, how often such a choice goes away from the
neighbour that turned it (divergence), and γ against the same planner mute (nav-i with the same repulsion), map by map.
"""

from __future__ import annotations

import argparse
import multiprocessing
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from typing import Any

import numpy as np
from rich.progress import track

from swarmscope.experiments.weight import count_errors
from swarmscope.judging.cases import find_cases
from swarmscope.judging.run import figures, play
from swarmscope.judging.statistics import paired_difference, wilson
from swarmscope.onboard.deciding.waiting import AT_LEAST_1
from swarmscope.scenarios.read import parse_scenario

RADII = ((0.05, 0.15), (0.15, 0.35), (0.35, 0.7))
TREES = 140.0 * (0.15**2 + 0.15 * 0.35 + 0.35**2) / 400.0
"""Times pi / 3: the share of the ground that the default's trees cover."""
SHARES = (0.5, 1.0)
"""Of that share."""
RANGES = (2.5, 5.0, 10.0)
THRESHOLDS = (0.0, 3.8)
"""0 is (20), 1.95 m; 3.8 m is the middle of what neighbours see."""

HEAD = ("radii [m]", "covered", "range [m]", "w_n [m]", "P_a wrong", "P_ni wrong", "turned", "divergences", "γ, points")
Case = tuple[tuple[float, float], float, float, float]


def one(job: tuple[Case, bool, int]) -> dict[str, Any]:
    """Run one scenario and return what is counted."""
    (radii, share, range_m, threshold), shares, seed = job
    low, high = radii
    density = share * TREES / (low * low + low * high + high * high)
    params = {"threshold_m": threshold} if shares else {"repulsion": AT_LEAST_1}
    values = {
        "task": {"name": "T1", "options": {"radius_min": low, "radius_max": high, "density": density}},
        "planner": {"name": "nav-scope" if shares else "nav-i", "preset": "printed", "params": params},
        "lidar": {"range_m": range_m},
        "seed": seed,
        "record_scans": "no",
        "judge_sides": True,
    }
    outcome = play(parse_scenario(values, "surroundings"), any_angle=False)
    choices = outcome.trace.choices
    turned = (choices["heard"] > 0) & ((choices["p_self"] >= 0.5) != (choices["p_left"] >= 0.5))
    kinds = [case["kind"] for case in find_cases(choices, outcome.setting.dt)]
    return {
        "errors": count_errors(choices),
        "choices": len(choices),
        "turned": int(turned.sum()),
        "divergences": kinds.count("divergence"),
        "gamma": figures(outcome)["path_redundancy"],
    }


def share_of(wrong: int, of: int) -> str:
    """Return an error rate with its interval."""
    found = wilson(wrong, of)
    return f"{found.estimate:.3f} ({found.low:.3f} to {found.high:.3f})" if of else "none"


def row(case: Case, rows: list[dict[str, Any]], mute: list[dict[str, Any]]) -> str:
    """Return a line of the table."""
    (low, high), share, range_m, threshold = case
    own, choices, neighbours, opinions = np.array([r["errors"] for r in rows]).sum(axis=0).tolist()
    made, turned = (sum(r[key] for r in rows) for key in ("choices", "turned"))
    first, second = (100.0 * np.array([r["gamma"] for r in part], float) for part in (rows, mute))
    gain = paired_difference(first, second)
    covered = f"{100.0 * share * np.pi / 3.0 * TREES:.1f} %"
    cells = [
        f"{low:g} to {high:g}", covered, f"{range_m:g}", f"{threshold or 1.95:g}",
        share_of(own, choices), share_of(neighbours, opinions), f"{turned} of {made}",
        str(sum(r["divergences"] for r in rows)), f"{gain.estimate:+.1f} ({gain.low:+.1f} to {gain.high:+.1f})",
    ]  # fmt: skip
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    """Parse the options, run, print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", default="0-29", help="first-last")
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    first, _, last = options.seeds.partition("-")
    seeds = range(int(first), int(last or first) + 1)
    cases: list[Case] = list(product(RADII, SHARES, RANGES, THRESHOLDS))
    jobs = [(case, shares, seed) for case in cases for shares in (True, False) for seed in seeds]
    one(jobs[0])  # compiles for the others
    one((cases[0], False, seeds[0]))
    with ProcessPoolExecutor(options.workers, mp_context=multiprocessing.get_context("spawn")) as pool:
        rows = iter(list(track(pool.map(one, jobs, chunksize=4), "runs", total=len(jobs))))
    print("| " + " | ".join(HEAD) + " |\n" + "|---" * len(HEAD) + "|")
    for case in cases:
        print(row(case, [next(rows) for _ in seeds], [next(rows) for _ in seeds]))


if __name__ == "__main__":
    main()
