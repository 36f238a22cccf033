"""Runs for report tests: made by hand, or played."""

from __future__ import annotations

from typing import Any

import numpy as np

from swarmscope.experiments.experiment import Experiment, Unit, parse_experiment, units
from swarmscope.experiments.results import Run
from swarmscope.judging.cases import find_cases
from swarmscope.judging.metrics import path_lengths, path_redundancy, path_stretch, spl
from swarmscope.judging.run import figures, play
from swarmscope.scenarios.to_kernels import complete

BASE: dict[str, Any] = {
    "name": "hand-made",
    "title": "A & B <in> one table",
    "about": "Robots in \"two\" places & <one> 'forest'.",
    "seeds": "0-1",
    "places": {"P": {"task": {"name": "T1"}}, "Q": {"task": {"name": "T2"}}},
    "planners": {"Bug": {"planner": {"params": {"w_i": 0}}}, "Ours": {"planner": {"params": {"w_i": 1}}}},
    "ours": "Ours",
    "order": ["Bug", "Ours"],
    "metrics": ["path_redundancy", "arrival_rate", "duration_s"],
    "published": [
        {
            "source": "Somebody, Table I",
            "metric": "path_redundancy",
            "values": {"P": {"Bug": 0.3, "Ours": 0.05, "Ghost": 0.1}, "Q": {"Ours": 0.5}},
        }
    ],
    "targets": [
        {"planner": "Ours", "place": "P", "metric": "path_redundancy", "at_most": 0.05},
        {"planner": "Ours", "place": "P", "metric": "arrival_rate", "at_least": 0.7},
    ],
    "figures": [],
    "notes": ["Trees are <b>not</b> printed | at all."],
}


def experiment(**changes: Any) -> Experiment:
    return parse_experiment(BASE | changes, "test")


def hand_made(
    place: str, planner: str, seed: int, travelled: list[float], late: tuple[int, ...] = (), **more: Any
) -> Run:
    """Return a run whose shortest ways are 10 m each; robots ``late`` did not arrive."""
    lengths, shortest = np.array(travelled, float), np.full(len(travelled), 10.0)
    arrival = np.array([np.nan if i in late else 20.0 + i for i in range(len(travelled))])
    values: dict[str, float | None] = {
        "path_redundancy": path_redundancy(lengths, shortest, arrival),
        "path_stretch": path_stretch(lengths, shortest, arrival),
        "spl": spl(lengths, shortest, arrival),
        "arrival_rate": float(np.isfinite(arrival).mean()),
        "duration_s": float(np.nanmax(arrival)) if len(late) < len(travelled) else None,
        "collisions": 0.0,
        "fusions": 4.0,
    }
    values = {name: None if value is not None and np.isnan(value) else value for name, value in values.items()}
    return Run(
        place=place,
        planner=planner,
        seed=seed,
        key=f"{place}-{planner}-{seed}",
        config={"task": {"name": "T1"}, "planner": {"name": "nav-scope", "params": {"w_i": 1.0}}, "seed": seed},
        figures=values | more,
        travelled_m=lengths,
        shortest_m=shortest,
        any_angle_m=0.96 * shortest,
        arrival_s=arrival,
        failures=[{"robot": i, "why": "lost <in> the wood"} for i in late],
        cases=[],
    )


SMALL: dict[str, Any] = {
    "scenario": {"robots": 4, "limit_s": 80.0, "lidar": {"beams": 90}},
    "sweeps": [{"name": "w_i", "planner": "Ours", "key": "planner.params.w_i", "values": [0, 1]}],
    "figures": ["boxes", "paths", "sweeps", "field", "cases", "weight", "resources"],
}
"""An experiment that is quick to play, with every figure."""


def played(unit: Unit) -> Run:
    """Return the run of ``unit``, played."""
    outcome = play(unit.scenario, any_angle=False)
    found, robots, records = figures(outcome), outcome.trace.robots, outcome.trace.records
    return Run(
        place=unit.place,
        planner=unit.planner,
        seed=unit.seed,
        key="",
        config=complete(unit.scenario),
        figures={k: v for k, v in found.items() if isinstance(v, (int, float)) and np.isfinite(v)},
        travelled_m=path_lengths(records.x, records.y, outcome.trace.t_s, robots["arrival_s"]),
        shortest_m=outcome.references.shortest_m,
        any_angle_m=outcome.references.any_angle_m,
        arrival_s=robots["arrival_s"].copy(),
        failures=found["failures"],
        cases=find_cases(outcome.trace.choices, outcome.setting.dt),
    )


def all_played(what: Experiment) -> list[Run]:
    return [played(unit) for unit in units(what)]
