"""Keys of sensors' errors and of faults: bounds, what is left alone where they are 0, and runs with each of them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from golden_runs import RECORDS, digest
from helpers import circle, place_scenario, run_scenario
from swarmscope.errors import ConfigError
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import FaultsModel, NoiseModel
from swarmscope.scenarios.to_kernels import make_rig_of

T1 = {"task": {"name": "T1"}}
MODERATE = {
    "noise.odometry_scale": 0.02,
    "noise.odometry_drift_m": 0.02,
    "noise.odometry_turn_deg": 1.0,
    "noise.compass_bias_deg": 3.0,
    "noise.nan": 0.02,
    "noise.stuck": 0.02,
    "noise.blind_deg": 2.0,
    "noise.scan_age_s": 0.05,
    "faults.restarts_per_h": 60.0,
    "faults.silences_per_h": 60.0,
    "faults.clock_jumps_per_h": 60.0,
}
"""Each key at a value that robots have to live with; faults come once a minute to each robot."""
ZERO = {
    "noise": dict.fromkeys(NoiseModel.model_fields, 0.0),
    "faults": {name: 0.0 if name.endswith("_per_h") else 3.0 for name in FaultsModel.model_fields},
}
TREES = [circle(x, y, 0.3) for x in (-2.0, 0.0, 2.0) for y in (-2.0, -0.7, 0.6, 1.9)]


def grouped(keys):
    """Nested mappings of keys with dots."""
    groups = {}
    for key, value in keys.items():
        group, _, name = key.partition(".")
        groups.setdefault(group, {})[name] = value
    return groups


def crossing(**more):
    starts = [(-4.0, 1.2 * k - 3.0, 0.0) for k in range(6)]
    goals = [(4.0, 3.0 - 1.2 * k) for k in range(6)]
    return place_scenario(starts, goals, TREES, **({"limit_s": 12.0, "seed": 3} | more))


def digest_of(trace):
    records = [getattr(trace.records, name) for name in RECORDS]
    return digest([*records, trace.robots["arrival_s"], trace.robots["bytes"]])


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("noise.odometry_scale", -0.01),
        ("noise.odometry_scale", 0.11),
        ("noise.odometry_scale", float("nan")),
        ("noise.odometry_drift_m", float("inf")),
        ("noise.odometry_drift_m", float("nan")),
        ("noise.odometry_turn_deg", 46),
        ("noise.compass_bias_deg", -1),
        ("noise.compass_bias_deg", float("nan")),
        ("noise.nan", 1.01),
        ("noise.nan", float("nan")),
        ("noise.stuck", "some"),
        ("noise.stuck", -0.1),
        ("noise.blind_deg", 361),
        ("noise.blind_deg", float("nan")),
        ("noise.scan_age_s", 1.01),
        ("noise.scan_age_s", float("nan")),
        ("faults.restarts_per_h", -1),
        ("faults.restarts_per_h", 3601),
        ("faults.restarts_per_h", float("nan")),
        ("faults.restart_s", float("inf")),
        ("faults.restart_s", float("nan")),
        ("faults.silences_per_h", "often"),
        ("faults.silence_s", -0.1),
        ("faults.silence_s", float("nan")),
        ("faults.clock_jumps_per_h", float("inf")),
        ("faults.clock_jump_s", 86401),
        ("faults.clock_jump_s", float("nan")),
    ],
)
def test_values_out_of_range_are_refused_at_their_place(key, value):
    with pytest.raises(ConfigError, match=f"^test: {key}: "):
        parse_scenario(T1 | grouped({key: value}), "test")


def test_zeros_leave_every_byte_as_it_was():
    assert digest_of(run_scenario(crossing())) == digest_of(run_scenario(crossing() | ZERO))


@pytest.mark.parametrize("key", MODERATE)
def test_every_key_changes_a_run_the_same_way_for_any_number_of_threads(key):
    values = crossing() | grouped({key: MODERATE[key]})
    found = {digest_of(run_scenario(values, threads)) for threads in (1, 2, 3)}
    assert len(found) == 1
    assert (found != {digest_of(run_scenario(crossing()))}) == (key != "faults.clock_jumps_per_h")  # taken out on board


@pytest.mark.parametrize("key", MODERATE)
def test_nobody_is_touched_in_the_forest(key):
    trace = run_scenario(T1 | {"seed": 1, "record_scans": "no", "limit_s": 75.0} | grouped({key: MODERATE[key]}))
    assert not trace.robots["crashed"].any()
    assert trace.robots["arrived"].mean() > 0.8


def test_the_guard_counts_on_the_oldest_scan():
    def latency(noise):
        return make_rig_of(parse_scenario(T1 | {"noise": noise}, "test")).guarding.latency_s

    assert latency({}) == 0.0
    assert latency({"scan_age_s": 0.15}) == 0.15


EVERYTHING = {
    **MODERATE,
    "noise.range_fraction": 0.02,
    "noise.scan_age_s": 0.3,
    "faults.restarts_per_h": 600.0,
    "faults.restart_s": 0.4,
    "faults.silences_per_h": 600.0,
    "faults.clock_jumps_per_h": 600.0,
    "lidar.beams": 90,
    "guard.thinnest_m": 0.0,
}


def everything():
    """A short run with all of it."""
    starts = [(-2.0, 0.0, 0.0), (2.0, 0.3, 3.1), (0.0, -2.0, 1.5)]
    values = place_scenario(starts, [(2.0, 0.0), (-2.0, 0.1), (0.0, 2.0)])
    return run_scenario(values | {"limit_s": 5.0} | grouped(EVERYTHING))


CODE = """
import json
import test_errors_and_faults as t
trace = t.everything()
print(json.dumps([t.digest_of(trace), trace.robots["boots"].tolist(), trace.robots["clock_s"].tolist()]))
"""


def test_all_of_it_is_the_same_without_the_compiler():
    here = Path(__file__).parent
    path = os.pathsep.join([str(here), str(here.parent), *sys.path])
    done = subprocess.run(
        [sys.executable, "-W", "ignore::RuntimeWarning", "-c", CODE],
        env=os.environ | {"PYTHONPATH": path, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    trace = everything()
    assert trace.robots["boots"].any() and trace.robots["clock_s"].any()
    boots, clock_s = trace.robots["boots"].tolist(), trace.robots["clock_s"].tolist()
    assert json.loads(done.stdout) == [digest_of(trace), boots, clock_s]
