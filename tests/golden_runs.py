"""The golden runs: every planner on every task, a few robots for a few seconds, with noise and lost packets.

    python tests/golden_runs.py            # say which runs differ from tests/golden/digests.json
    python tests/golden_runs.py --renew    # write that file anew

Of each run the file keeps a digest of what all robots did, which is the same to the last bit on machines that are
alike (``machine``), and a few figures for all others.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import math
import platform
import sys
from pathlib import Path

import numpy as np
from llvmlite import binding

from swarmscope.judging.metrics import average_path_length_m, path_lengths
from swarmscope.judging.provenance import installed_version
from swarmscope.judging.run import References, play
from swarmscope.onboard.planners import planner_names
from swarmscope.scenarios.read import parse_scenario
from swarmscope.tasks._contract import task_names

FILE = Path(__file__).resolve().parent / "golden" / "digests.json"
ROBOTS, LIMIT_S, SEED = 5, 20.0, 7
OPTIONS = {"swap": {"size_m": 8.0}}
"""Of tasks in which robots would not meet in that time."""
ERRORS = {
    "noise": {"range_fraction": 0.02, "dropout": 0.02, "bearing_deg": 2.0, "compass_deg": 2.0},
    "radio": {"loss": 0.2},
}
RECORDS = ("x", "y", "yaw", "speed", "state", "reason", "side", "p_left", "bytes_sent")
"""What a digest is of, in this order; the times of arrival follow."""


def planners() -> list[str]:
    """The names of all planners."""
    return planner_names()


def machine() -> dict[str, str]:
    """What the last bits of a run depend on."""
    features = binding.get_host_cpu_features().flatten()
    versions = {name: installed_version(name) for name in ("numpy", "numba", "llvmlite", "onnxruntime", "navground")}
    return {
        "python": platform.python_version(),
        **versions,
        "libc": " ".join(platform.libc_ver()),
        "cpu": binding.get_host_cpu_name(),
        "cpu_features": hashlib.sha256(features.encode()).hexdigest()[:16],
    }


def golden_runs(planner):
    """{task: {'digest', 'figures'}} of a planner. Errors: MissingExtraError."""
    return {task: golden_run(planner, task) for task in task_names()}


def golden_run(planner, task):
    """The digest and the figures of one run."""
    trace = play(scenario_of(planner, task), references=nobody_asks()).trace
    records, robots = trace.records, trace.robots
    arrival_s = robots["arrival_s"].astype(float)
    travelled = path_lengths(records.x, records.y, trace.t_s, arrival_s)
    arrived = np.isfinite(arrival_s)
    figures = {
        "arrival_rate": float(arrived.mean()),
        "mean_path_m": float(travelled.mean()),
        "arrived_path_m": average_path_length_m(travelled, arrival_s),
        "last_arrival_s": float(arrival_s[arrived].max()) if arrived.any() else math.nan,
        "bytes_sent": int(robots["bytes"].sum()),
        "fusions": int(robots["fusions"].sum()),
        "min_clearance_m": float(robots["min_clearance"].min()),
    }
    return {
        "digest": digest([*(getattr(records, name) for name in RECORDS), arrival_s]),
        "figures": {name: None if math.isnan(value) else value for name, value in figures.items()},
    }


def scenario_of(planner, task):
    """The scenario of a planner on a task."""
    what = {"task": {"name": task, "options": OPTIONS.get(task, {})}, "planner": {"name": planner}}
    size = {"robots": ROBOTS, "seed": SEED, "limit_s": LIMIT_S, "record_scans": "no"}
    return parse_scenario(what | size | ERRORS, "golden")


def nobody_asks():
    """No reference ways: they take longer than the runs and are tested elsewhere."""
    nothing = np.full(ROBOTS, np.nan)
    return References(nothing, nothing, 0.0)


def digest(arrays):
    """The SHA-256 of the numbers in arrays, whatever type holds them; every NaN counts as the same."""
    sha = hashlib.sha256()
    for array in arrays:
        numbers = np.asarray(array, dtype="<f8")
        sha.update(repr(numbers.shape).encode())
        sha.update(np.where(np.isnan(numbers), np.nan, numbers).tobytes())
    return sha.hexdigest()


def read():
    """The golden file."""
    return json.loads(FILE.read_text(encoding="utf-8"))


def differences(found, wanted, bits):
    """What is wrong with a planner's runs, a line for each task; their last bits count only if ``bits``."""
    lines = []
    for task in sorted(found.keys() | wanted.keys()):
        if task not in found or task not in wanted:
            lines.append(f"{task}: {'no longer run' if task in wanted else 'not in the file'}")
            continue
        ours, theirs = found[task], wanted[task]
        moved = [
            f"{name} {theirs['figures'].get(name)} -> {value}"
            for name, value in ours["figures"].items()
            if not same(value, theirs["figures"].get(name))
        ]
        if moved or (bits and ours["digest"] != theirs["digest"]):
            lines.append(f"{task}: {', '.join(moved) or 'same figures, other bits'}")
    return lines


def same(one, other):
    """Whether two figures are the same to six digits."""
    if one is None or other is None:
        return one is other
    return math.isclose(one, other, rel_tol=1e-6, abs_tol=1e-9)


def main():
    """Read the command line, make the runs, compare or write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--renew", action="store_true", help="write the golden file anew")
    renew = parser.parse_args().renew
    found = {planner: golden_runs(planner) for planner in planners()}
    known = read() if FILE.exists() else {"machine": machine(), "runs": {}}
    lines = [
        f"{planner} on {line}"
        for planner in sorted(found.keys() | known["runs"].keys())
        for line in differences(found.get(planner, {}), known["runs"].get(planner, {}), known["machine"] == machine())
    ]
    print("\n".join(lines) or "no run differs")
    if renew:
        FILE.parent.mkdir(exist_ok=True)
        content = {"machine": machine(), "runs": found}
        FILE.write_text(json.dumps(content, indent=1, sort_keys=True, allow_nan=False) + "\n", encoding="utf-8")
        return 0
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main())
