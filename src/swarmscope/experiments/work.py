"""One run as a unit of work: text in, text out, the same on every machine.

The *content key* of a unit is a hash of its scenario and of the state of the code that can change its result, so a
finished unit never has to be run again, and a changed program never passes old results off as its own. That code is
what this module, the unit's planner and its task import: another planner, a page or a command is no part of it.
"""

from __future__ import annotations

import hashlib
import json
import math
import traceback
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from swarmscope.closure import closure_of, closure_state, libraries_of, state_of, union_of
from swarmscope.errors import InputFileError, SwarmscopeError
from swarmscope.judging import references
from swarmscope.judging.cases import find_cases
from swarmscope.judging.provenance import installed_version, library_version, own_revision, versions
from swarmscope.judging.references import References
from swarmscope.judging.run import Outcome, figures, play
from swarmscope.onboard.planners import planner_file
from swarmscope.scenarios import places
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import PlannerModel, Scenario
from swarmscope.scenarios.to_kernels import complete, planner_of
from swarmscope.tasks import task_file
from swarmscope.user_files import is_file_name

MEASURED = ("plan_us_p50", "plan_us_p99", "run_wall_s", "reference_s")
"""Figures that are times of this machine: stored, but no part of the digest."""
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


def code_state(config: Mapping[str, Any]) -> str:
    """Return a hash of the code that can change the result of a scenario, and of the versions that it depends on."""
    names = _name_of("planner", config), _name_of("task", config)
    edited = tuple(closure_state(Path(name)) for name in names if name is not None and is_file_name(name))
    return _code_state(*names, edited)


def _name_of(group: str, config: Mapping[str, Any]) -> str | None:
    chosen = config.get(group) or {}
    default = PlannerModel().name if group == "planner" else None
    name: str | None = chosen.get("name", default)
    return name


@cache
def _code_state(planner: str | None, task: str | None, edited: tuple[str, ...]) -> str:
    """``edited`` are the states of users' files, which may change while this runs."""
    members = code_files(planner, task)
    ours = closure_of(Path(__file__))
    libraries = sorted({*libraries_of(union_of(members))} - {*libraries_of(ours)})
    known = {name: version for name, version in versions().items() if name != "swarmscope"}
    known |= {name: library_version(name) for name in libraries}
    return _hash({"code": state_of({*ours, *union_of(members)}), "versions": known})[:16]


def code_files(planner: str | None, task: str | None) -> list[Path]:
    """Return the files of a planner and a task, where they are given."""
    return ([planner_file(planner)] if planner else []) + ([task_file(task)] if task else [])


def model_state(config: dict[str, Any]) -> str | None:
    """Return which network the scenario's planner runs, and by which version of what; None without one.

    Of a planner in a user's file, which is not run for it, it is the folder that the scenario names.
    """
    chosen = PlannerModel.model_validate(config.get("planner", {}))
    if is_file_name(chosen.name):
        return None if chosen.model is None else _folder_state(Path(chosen.model))
    model = planner_of(chosen).model
    return None if model is None else f"{model.state()} onnxruntime {installed_version('onnxruntime')}"


def _folder_state(folder: Path) -> str:
    """Return a hash of the files in a folder. Errors: InputFileError."""
    try:
        files = sorted(file for file in folder.iterdir() if file.is_file())
        return _hash([[file.name, hashlib.sha256(file.read_bytes()).hexdigest()] for file in files])
    except OSError as error:
        raise InputFileError(folder, error.strerror or "cannot be read") from None


def unit_key(scenario: Scenario) -> str:
    """Return the content key of a scenario; no user's file is run for it, and where it lies does not count."""
    config = complete(scenario, run_files=False)
    model = model_state(config)
    values = {"config": _without_folders(config), "code": code_state(config)}
    return _hash(values | ({} if model is None else {"model": model}))


def world_key(scenario: Scenario) -> str:
    """Return the content key of the world, starts and goals of a scenario: what its reference ways depend on."""
    config = scenario.model_dump(mode="json", include=set(PLACE_KEYS), exclude_none=True)
    task = code_files(None, _name_of("task", config))
    code = state_of(union_of([Path(str(places.__file__)), Path(str(references.__file__)), *task]))
    numbers = {name: installed_version(name) for name in ("numpy", "numba")}
    values = {"place": _without_folders(config), "radius": scenario.radii_m, "code": code}
    return _hash(values | {"versions": numbers})


def _without_folders(config: dict[str, Any]) -> dict[str, Any]:
    """Return a scenario in which users' files stand without their folders: what they say is part of the code."""
    short = {}
    for group in ("planner", "task"):
        name = _name_of(group, config)
        if group in config and name is not None and is_file_name(name):
            short[group] = config[group] | {"name": Path(name).name}
    return config | short


def make_job(key: str, world: str, config: dict[str, Any], references: dict[str, Any] | None) -> str:
    """Return a unit as text; ``references`` as an earlier run in the same world returned them."""
    job = {"key": key, "world": world, "config": config, "references": references, "code": code_state(config)}
    job["model"] = model_state(config)
    return json.dumps(job)


def work(job: str) -> str:
    """Run a unit; whatever goes wrong in it becomes its error."""
    asked = json.loads(job)
    try:
        if asked["code"] != code_state(asked["config"]):
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
    about = {"git": own_revision(), "code": code_state(asked["config"])} | versions()
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
        "any_angle_m": _list(outcome.references.any_angle_m),
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


