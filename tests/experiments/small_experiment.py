"""A small experiment for the tests of stores, engines and commands."""

from __future__ import annotations

from swarmscope.experiments.experiment import parse_experiment

VALUES = {
    "name": "small",
    "title": "A small experiment",
    "seeds": "1000-1003",
    "scenario": {"robots": 3, "limit_s": 20.0},
    "places": {
        "near": {"task": {"name": "T1", "options": {"size_m": 5.0}}},
        "ring": {"task": {"name": "T3", "options": {"size_m": 5.0}}},
    },
    "planners": {
        "alone": {"planner": {"name": "nav-scope", "params": {"w_i": 0.0}}},
        "Nav-SCOPE": {"planner": {"name": "nav-scope"}},
    },
    "sweeps": [{"name": "w_i", "planner": "Nav-SCOPE", "key": "planner.params.w_i", "values": [0.0, 2.0]}],
    "ours": "Nav-SCOPE",
}
LABELS = ["alone", "Nav-SCOPE", "Nav-SCOPE w_i=0", "Nav-SCOPE w_i=2"]
CELLS = 2 * 4 * len(LABELS)
RUNS = 2 * 4 * 3  # w_i=0 is the same run as alone


def small(**changes):
    return parse_experiment(VALUES | changes, "test")
