"""One run as a unit of work: text in, text out, the same on every machine.

The *content key* of a unit is a hash of its complete scenario and of the state of the code that can change a
result, so a finished unit never has to be run again, and a changed program never passes old results off as its own.
"""

from __future__ import annotations

import hashlib
import json
import math
import traceback
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from swarmscope.errors import SwarmscopeError
from swarmscope.judging.cases import find_cases
from swarmscope.judging.provenance import PACKAGE, git_revision, installed_version, versions
from swarmscope.judging.run import Outcome, References, figures, play
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import PlannerModel, Scenario
from swarmscope.scenarios.to_kernels import planner_of

MEASURED = ("plan_us_p50", "plan_us_p99", "run_wall_s", "reference_s")
"""Figures that are times of this machine: stored, but no part of the digest."""
NO_RESULT = frozenset({"api.py", "cli", "viewing", "experiments"})
LENGTHS = ("shortest_m", "any_angle_m")
PLACE_KEYS = ("task", "map", "place", "robots", "seed")


class Finished(NamedTuple):
    """A unit that was run."""

    key: str
    world: str
    config: dict[str, Any]
    figures: dict[str, float | None]
    measured: dict[str, float | None]
    robots: dict[str, list[float | None]]
    failures: list[dict[str, Any]]
    cases: list[dict[str, Any]]
    references: dict[str, Any]
    digest: str
    about: dict[str, str]
    error: str | None
    """Why there is no result; then everything but key, world and config is empty."""


@lru_cache(maxsize=1)
def code_state() -> str:
    """Return a hash of the sources that can change a result, and of the versions of numpy and numba."""
    state = hashlib.sha256(json.dumps({k: v for k, v in versions().items() if k != "swarmscope"}).encode())
    for file in sorted(PACKAGE.rglob("*.py")):
        part, *_ = file.relative_to(PACKAGE).parts
        if part not in NO_RESULT:
            state.update(file.relative_to(PACKAGE).as_posix().encode() + file.read_bytes())
    return state.hexdigest()[:16]


@lru_cache(maxsize=1)
def revision() -> str:
    """Return the git revision, asked once."""
    return git_revision()


def model_state(config: dict[str, Any]) -> str | None:
    """Return which network the scenario's planner runs, and by which version of what; None without one."""
    model = planner_of(PlannerModel.model_validate(config.get("planner", {}))).model
    return None if model is None else f"{model.state()} onnxruntime {installed_version('onnxruntime')}"


def unit_key(config: dict[str, Any]) -> str:
    """Return the content key of a complete scenario."""
    model = model_state(config)
    return _hash({"config": config, "code": code_state()} | ({} if model is None else {"model": model}))


def world_key(scenario: Scenario) -> str:
    """Return the content key of the world, starts and goals of a scenario: what its reference ways depend on."""
    config = scenario.model_dump(mode="json", include=set(PLACE_KEYS), exclude_none=True)
    return _hash({"place": config, "radius": scenario.robot.radius_m, "code": code_state()})


def make_job(key: str, world: str, config: dict[str, Any], references: dict[str, Any] | None) -> str:
    """Return a unit as text; ``references`` as an earlier run in the same world returned them."""
    job = {"key": key, "world": world, "config": config, "references": references, "code": code_state()}
    job["model"] = model_state(config)
    return json.dumps(job)


def work(job: str) -> str:
    """Run a unit; whatever goes wrong in it becomes its error."""
    asked = json.loads(job)
    try:
        if asked["code"] != code_state():
            raise SwarmscopeError("this machine has another version of swarmscope, numpy or numba than the one asking")
        if asked.get("model") != model_state(asked["config"]):
            raise SwarmscopeError("the planner's network is another one here than where the run was asked for")
        result = _run(asked)
    except SwarmscopeError as error:
        result = {"error": str(error)}
    except Exception as error:  # a bug in one run must not end a sweep; it is stored with its place
        where = traceback.extract_tb(error.__traceback__)[-1]
        result = {"error": f"{type(error).__name__}: {error} ({where.name}, line {where.lineno})"}
    return json.dumps({"key": asked["key"], "world": asked["world"]} | result, allow_nan=False)


def finished(config: dict[str, Any], answer: str) -> Finished:
    """Return the answer of ``work`` to a unit of ``config``."""
    empty: dict[str, Any] = {
        "figures": {}, "measured": {}, "robots": {}, "failures": [], "cases": [], "references": {},
        "digest": "", "about": {}, "error": None,
    }  # fmt: skip
    return Finished(**(empty | json.loads(answer) | {"config": config}))


def _run(asked: dict[str, Any]) -> dict[str, Any]:
    scenario = parse_scenario(asked["config"], "unit")
    outcome = play(scenario, references=_references(asked["references"]))
    values = figures(outcome)
    flat = values | values["measured"]
    measured = {name: _number(flat.get(name)) for name in MEASURED}
    numbers = {k: _number(v) for k, v in values.items() if _is_figure(v) and k not in MEASURED}
    result = {
        "figures": numbers,
        "robots": _per_robot(outcome),
        "failures": values["failures"],
        "cases": find_cases(outcome.trace.choices, outcome.setting.dt),
    }
    about = {"git": revision(), "code": code_state()} | versions()
    references = {
        "shortest_m": _list(outcome.references.shortest_m),
        "any_angle_m": _list(outcome.references.any_angle_m),
        "wall_s": outcome.references.wall_s,
    }
    digest = {"digest": _hash(result), "about": about, "measured": measured, "references": references}
    return result | digest


def _per_robot(outcome: Outcome) -> dict[str, list[float | None]]:
    robots = outcome.trace.robots
    return {
        "travelled_m": _list(robots["length"]),
        "shortest_m": _list(outcome.references.shortest_m),
        "arrival_s": _list(robots["arrival_s"]),
    }


def _references(values: dict[str, Any] | None) -> References | None:
    if values is None:
        return None
    grid, any_angle = (np.array([np.nan if v is None else v for v in values[k]], float) for k in LENGTHS)
    return References(grid, any_angle, float(values["wall_s"]))


def _is_figure(value: Any) -> bool:
    return value is None or (isinstance(value, int | float | np.number) and not isinstance(value, bool))


def _number(value: Any) -> float | None:
    return None if value is None or not math.isfinite(value) else float(value)


def _list(values: np.ndarray) -> list[float | None]:
    return [_number(value) for value in values.tolist()]


def _hash(value: Any) -> str:
    return hashlib.sha256(json.dumps(value, sort_keys=True, default=str).encode()).hexdigest()[:32]


