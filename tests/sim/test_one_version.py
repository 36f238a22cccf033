"""Whatever a scenario says, its run uses the kernels that are compiled already: a minute is waited for once."""

from __future__ import annotations

import numba
import pytest

from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.loop import begin

PLAIN = {"task": {"name": "T1"}, "robots": 2}
OTHERS = [
    {"noise": {"scan_age_s": 0.1}},
    {"noise": {"range_fraction": 0.02, "bearing_deg": 3, "stuck": 0.01, "blind_deg": 5, "nan": 0.01, "dropout": 0.01}},
    {"radio": {"loss": 0.2, "latency_s": 0.2}},
    {"faults": {"restarts_per_h": 1, "silences_per_h": 1, "clock_jumps_per_h": 1}},
    {"lidar": {"fov_deg": 90}},
    {"lidar": {"beams": 90}},
    {"robot": {"v_max_mps": 1}},
    {"guard": {"others_yield": False, "thinnest_m": 0}},
    {"task": {"name": "corridor"}},
    {"task": {"name": "GIWT_1"}},
    {"robots": 1},
    {"limit_s": 5},
    {"radio": {"loss": 1}},
]


def kinds(values):
    """The types that kernels are compiled for."""
    scenario = parse_scenario(values, "test")
    sim, swarm = begin(make_setting(scenario, make_setup(scenario)))
    return numba.typeof(sim), numba.typeof(swarm)


@pytest.mark.parametrize("other", OTHERS, ids=str)
def test_no_key_needs_kernels_of_its_own(other):
    assert kinds(PLAIN | other) == kinds(PLAIN)
