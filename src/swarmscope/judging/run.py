"""From a scenario to its figures and its run folder."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from swarmscope.judging.cases import choices_table, opinions_table
from swarmscope.judging.in_the_way import MOST_ASKED, who_is_in_the_way
from swarmscope.judging.metrics import (
    all_metrics,
    mover_arrival_rate,
    mover_path_m,
    movers,
    path_lengths,
    path_redundancy,
    path_stretch,
    side_accuracy,
    sides_judged,
    spl,
)
from swarmscope.judging.provenance import own_revision, versions
from swarmscope.judging.references import References, reference_ways
from swarmscope.judging.run_folder import check_out, write_run
from swarmscope.judging.sides import judged_by, make_advice
from swarmscope.onboard.planners import Planner
from swarmscope.onboard.reasons import STATE_NAMES
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import user_files_of
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import complete, make_setting
from swarmscope.sim.loop import Between, Sensed, Setting, Trace, run
from swarmscope.tasks import Setup
from swarmscope.tasks._check import ARRIVE_M
from swarmscope.user_files import short_name, text_of

KILO = 1000.0


class Contents(NamedTuple):
    """What a run folder holds, but for its pictures."""

    config: dict[str, Any]
    """``config.yaml``: the complete scenario."""
    world: dict[str, Any]
    """``world.json``."""
    trajectory: dict[str, np.ndarray]
    """``trajectory.npz``."""
    metrics: dict[str, Any]
    """``metrics.json``."""
    files: Mapping[str, str]
    """``planner.py``, ``task.py``: what a user's files said when they were run."""


@dataclass(frozen=True)
class Outcome:
    """A finished run with its references."""

    scenario: Scenario
    setup: Setup
    setting: Setting
    trace: Trace
    references: References


class Watch(NamedTuple):
    """Who looks on while a run is played, without a part in it (``sim/loop.py``)."""

    between: Between | None = None
    sensed: Sensed | None = None


NOBODY = Watch()


def play(
    scenario: Scenario,
    threads: int = 1,
    progress: Callable[[float, int], None] | None = None,
    any_angle: bool = True,
    references: References | None = None,
    watch: Watch = NOBODY,
) -> Outcome:
    """Run the scenario and find the reference ways; ``progress(simulated seconds, robots done)``.

    ``references`` of the same world are taken as they are.
    """
    setup = make_setup(scenario)
    setting = judged_setting(scenario, setup, threads)
    trace = run(setting, progress, *watch)
    if references is None:
        references = reference_ways(setup, scenario.radii_m, any_angle)
    return Outcome(scenario, setup, setting, trace, references)


def judged_setting(scenario: Scenario, setup: Setup, threads: int = 1) -> Setting:
    """Return the run of ``scenario`` in ``setup``, ready for the kernels and for judging.

    The side of the shortest way is found for planners that are oracles, and where the scenario says ``judge_sides``:
    then it is noted beside every choice.
    """
    setting = make_setting(scenario, setup, threads)
    if scenario.judge_sides or setting.planner.told:
        return replace(setting, advice=make_advice(setup, *judged_by(scenario, setting.rig)))
    return setting


def run_scenario(
    scenario: Scenario,
    out: Path,
    threads: int = 1,
    progress: Callable[[float, int], None] | None = None,
    extras: Callable[[Path], None] | None = None,
    watch: Watch = NOBODY,
) -> dict[str, Any]:
    """Run the scenario into the run folder ``out`` and return its metrics; ``extras`` adds pictures to it."""
    check_out(out)
    found = contents(play(scenario, threads, progress, watch=watch))
    write_run(out, *found, extras)
    return found.metrics


def contents(outcome: Outcome) -> Contents:
    """Return what the run folder of a finished run holds."""
    files = {f"{group}.py": text_of(file) for group, file in user_files_of(outcome.scenario).items()}
    return Contents(complete(outcome.scenario), world_table(outcome), trajectory(outcome), figures(outcome), files)


def figures(outcome: Outcome) -> dict[str, Any]:
    """Return everything that goes into ``metrics.json``; only ``plan_us_*`` and ``measured`` are times."""
    robots, trace, scenario = outcome.trace.robots, outcome.trace, outcome.scenario
    t_s, x, y = _with_end(outcome)
    records = trace.records
    values: dict[str, Any] = dict(
        all_metrics(
            t_s,
            x,
            y,
            _pad(records.speed),
            _pad(records.bytes_sent),
            robots["arrival_s"],
            robots["crashed"],
            outcome.references.shortest_m,
        )
    )
    travelled = path_lengths(x, y, t_s, robots["arrival_s"])
    exact = travelled, outcome.references.any_angle_m, robots["arrival_s"]
    arrive_m = float(getattr(outcome.setting.params, "arrive_m", ARRIVE_M))
    moved = movers(outcome.setup.starts, outcome.setup.goals, arrive_m)
    sides, told = trace.choices["side"], trace.choices["told_side"]
    simulated = len(trace.t_s) * outcome.setting.dt
    features = int(robots["sent_features"].sum())
    values |= {
        "path_stretch_any_angle": path_stretch(*exact),
        "path_redundancy_any_angle": path_redundancy(*exact),
        "spl_any_angle": spl(*exact),
        "mover_path_m": mover_path_m(travelled, robots["arrival_s"], moved),
        "mover_arrival_rate": mover_arrival_rate(robots["arrival_s"], moved),
        "movers": int(moved.sum()),
        "side_accuracy": side_accuracy(sides, told) if told.any() else None,
        "sides_judged": sides_judged(told),
        "reference_robots": int(np.isfinite(outcome.references.shortest_m).sum()),
        "planning_failures": int((~np.isfinite(robots["arrival_s"])).sum()),
        "collisions": int(robots["crashed"].sum()),
        **({"walked_into": int(robots["touched"].sum())} if outcome.setting.moving.radius.size else {}),
        "min_clearance_m": float(robots["min_clearance"].min()),
        "fusions": int(robots["fusions"].sum()),
        "messages": int(robots["sent"].sum()),
        "requests": int(robots["sent"].sum()) - features,
        "bytes_sent": int(robots["bytes"].sum()),
        "bytes_on_air": int(robots["air_bytes"].sum()),
        "air_bps": float(8.0 * robots["air_bytes"].mean() / simulated),
        "mean_package_bytes": float(robots["feature_bytes"].sum() / features) if features else None,
        "bandwidth_kbps": float(8.0 * robots["bytes"].sum() / simulated / KILO),
        "packets_lost": int(robots["lost"].sum()),
        "packets_out_of_range": int(robots["unreachable"].sum()),
        "packets_crowded_out": int(robots["crowded"].sum()),
        "packets_dropped_bad": int(trace.shared["dropped_bad"].sum()),
        "packets_dropped_stale": int(trace.shared["dropped_stale"].sum()),
        "planner_memory_bytes": trace.memory_bytes,
        "simulated_s": simulated,
        "failures": failures(outcome),
        "run": {
            "task": place_name(scenario),
            "planner": short_name(scenario.planner.name),
            **scenario.planner.model_dump(include={"preset"}, exclude_none=True),
            "robots": scenario.robots,
            "seed": scenario.seed,
        },
        **_model(outcome.setting.planner),
        "config_sha256": hashlib.sha256(json.dumps(complete(scenario), sort_keys=True).encode()).hexdigest(),
        "versions": versions(),
        "git_revision": own_revision(),
        "plan_us_p50": _percentile(trace.plan_us, 50),
        "plan_us_p99": _percentile(trace.plan_us, 99),
        "measured": {
            "run_wall_s": trace.wall_s,
            "reference_s": outcome.references.wall_s,
            "real_time_factor": max(0.0, simulated - outcome.setting.dt) / trace.wall_s,
        },
    }
    return values


def _model(planner: Planner) -> dict[str, str]:
    """Return which network the planner runs, nothing without one."""
    return {} if planner.model is None else {"model_sha256": planner.model.state()}


def place_name(scenario: Scenario) -> str:
    """Return what the scenario is run in, for titles."""
    if scenario.task is not None:
        return short_name(scenario.task.name)
    return Path(scenario.map.file).stem if scenario.map is not None else "place"


def failures(outcome: Outcome) -> list[dict[str, Any]]:
    """Name each robot that did not arrive, and why."""
    robots, records, reasons = outcome.trace.robots, outcome.trace.records, outcome.setting.planner.reasons
    found: list[dict[str, Any]] = []
    places = np.column_stack([robots["x"], robots["y"]])
    for i in np.flatnonzero(~np.isfinite(robots["arrival_s"])):
        state, reason = STATE_NAMES[records.state[-1, i]], reasons[records.reason[-1, i]]
        to_go = float(np.hypot(robots["goal_x"][i] - robots["x"][i], robots["goal_y"][i] - robots["y"][i]))
        late = f"time limit in state '{state}': {reason}; {to_go:.1f} m from its goal"
        why = "collided" if robots["crashed"][i] else late
        if len(found) < MOST_ASKED and not robots["crashed"][i]:
            ways = who_is_in_the_way(outcome.setup, places, robots["radius"], int(i))
            why += f"; robot {ways[0]} stands in its only way" if ways else ""
        found.append({"robot": int(i), "why": why})
    return found


def world_table(outcome: Outcome) -> dict[str, Any]:
    """Return ``world.json``: robots, starts, goals and every obstacle."""
    spec = outcome.setup.world.model_dump(mode="json", exclude_none=True)
    setup, sheets = outcome.setup, outcome.scenario.sheets
    robots: list[dict[str, Any]] = [
        {"id": i, "radius": sheet.radius_m, "start": start.tolist(), "goal": goal.tolist()}
        for i, (sheet, start, goal) in enumerate(zip(sheets, setup.starts, setup.goals, strict=True))
    ]
    for robot, yaw in zip(robots, [] if setup.goal_yaws is None else setup.goal_yaws.tolist(), strict=False):
        robot |= {"goal_yaw": yaw} if math.isfinite(yaw) else {}
    return {"frame": "map, x east, y north, m and rad (REP-103)", "robots": robots, **spec}


def trajectory(outcome: Outcome) -> dict[str, np.ndarray]:
    """Return the arrays of ``trajectory.npz`` (docs/architecture.md)."""
    trace, beams = outcome.trace, outcome.setting.beams
    records = trace.records
    angles = beams.angle_min + beams.increment * np.arange(beams.cos.size)
    return {
        "t_s": trace.t_s,
        "x_m": records.x,
        "y_m": records.y,
        "yaw_rad": records.yaw,
        "state": records.state,
        "reason": records.reason,
        "speed_mps": records.speed,
        "clearance_m": records.clearance,
        "p_left": records.p_left,
        "side": records.side,
        "bytes_sent": records.bytes_sent,
        "neighbours": records.neighbours,
        "state_names": np.array(STATE_NAMES),
        "reason_names": np.array(outcome.setting.planner.reasons),
        "beam_angles": angles,
        "scan_u8": records.scan,
        "safe_bits": records.safe,
        "links": trace.links,
        "choices": choices_table(trace.choices),
        "opinions": opinions_table(trace.choices),
        "arrival_s": trace.robots["arrival_s"].copy(),
        "collided": trace.robots["crashed"].copy(),
        "range_max_m": np.array(beams.range_max),
        **({"disc_xy_m": trace.discs} if trace.discs.size else {}),
        **({"door_closed": trace.doors} if trace.doors.size else {}),
    }


def _with_end(outcome: Outcome) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times and positions, with those at the end of the run (the goal of who arrived) added."""
    trace, robots = outcome.trace, outcome.trace.robots
    arrived = np.isfinite(robots["arrival_s"])
    end_x = np.where(arrived, outcome.setup.goals[:, 0], robots["x"])
    end_y = np.where(arrived, outcome.setup.goals[:, 1], robots["y"])
    x, y = trace.records.x.copy(), trace.records.y.copy()
    for i in np.flatnonzero(arrived):  # the way left to the goal counts as travelled
        after = trace.t_s >= robots["arrival_s"][i] - 1e-9
        x[after, i], y[after, i] = end_x[i], end_y[i]
    t_s = np.append(trace.t_s, len(trace.t_s) * outcome.setting.dt)
    return t_s, np.vstack([x, end_x]), np.vstack([y, end_y])


def _pad(values: np.ndarray) -> np.ndarray:
    """Repeat the last row once."""
    padded: np.ndarray = np.vstack([values, values[-1:]])
    return padded


def _percentile(values: np.ndarray, q: float) -> float | None:
    """Return a percentile, None without values."""
    return float(np.percentile(values, q)) if len(values) else None
