"""From a file or a mapping to a checked scenario; whatever is wrong names place, problem and the nearest valid key."""

from __future__ import annotations

from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from swarmscope.errors import ConfigError, InputFileError, SwarmscopeError, UnknownNameError, nearest_hint
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.scenarios.costs import check_costs
from swarmscope.scenarios.places import count_trips, is_packaged
from swarmscope.scenarios.presets import with_preset
from swarmscope.scenarios.scenario import Scenario
from swarmscope.tasks import task_names
from swarmscope.texts import read_yaml
from swarmscope.user_files import is_file_name, read_code, whole_path

REMEDIES = {"place.world.map": ": a map from a file is 'map: {file, starts, goals}' instead of 'place'"}
"""What to do about keys that people expect."""
MAPS = (".png", ".pgm", ".ppm", ".bmp", ".jpg", ".jpeg", ".tif", ".tiff", ".map", ".npz", ".world")
"""Ends of names of maps."""
LISTS = {"robot": ", or a list with a data sheet for each robot"}
"""What groups of keys may be instead."""


KINDS = ("alike", "each")
"""Parts of pydantic's places that are no keys."""


def parse_scenario(values: Any, where: str) -> Scenario:
    """Return the scenario in ``values``; a ConfigError names place, problem and the nearest valid key."""
    if not isinstance(values, dict):
        raise ConfigError(where, "a scenario is a mapping of keys to values")
    try:
        scenario = _as_many_as_trips(Scenario.model_validate(with_preset(values, where)))
    except ValidationError as error:
        raise _first_problem(error, where) from None
    check_costs(scenario, where)
    if scenario.task is not None:
        _check_known("task", scenario.task.name, task_names(), where)
    _check_known("planner", scenario.planner.name, planner_names(), where)
    chosen = scenario.planner
    if chosen.model is not None and not is_file_name(chosen.name) and load_planner(chosen.name).model is None:
        raise ConfigError(f"{where}: planner.model", f"planner '{chosen.name}' runs no network")
    return scenario


def _as_many_as_trips(scenario: Scenario) -> Scenario:
    """Return the scenario with no more robots than its map has trips, if nobody says how many there are."""
    place, known = scenario.map, scenario.model_fields_set
    if place is None or place.starts or place.goals or known & {"robots", "robot"}:
        return scenario
    try:
        trips = count_trips(place)
    except SwarmscopeError:  # which is said where the map is needed
        return scenario
    return scenario.model_copy(update={"robots": trips}) if 0 < trips < scenario.robots else scenario


def _check_known(kind: str, name: str, names: list[str], where: str) -> None:
    """Raise an error that names the place unless there is such a member; a user's file is not run."""
    if is_file_name(name):
        read_code(Path(name))
    elif name not in names:
        raise UnknownNameError(kind, name, names, f"{where}: {kind}.name")


def read_scenario_file(path: Path) -> dict[str, Any]:
    """Return the mapping in YAML file ``path``, not validated yet; files are looked for beside it."""
    if path.suffix.lower() in MAPS:
        raise InputFileError(path, f"is no scenario; a map is run with --map {path}")
    values = read_yaml(path)
    if not isinstance(values, dict):
        raise ConfigError(str(path), "a scenario is a mapping of keys to values")
    if {"image", "resolution"} <= values.keys():
        raise InputFileError(path, f"is a map, not a scenario: run it with --map {path}")
    find_user_files(values, path.parent)
    place = values.get("map")
    if isinstance(place, dict) and isinstance(place.get("file"), str):
        place["file"] = _find_map(path, place["file"])
    if isinstance(place, dict) and isinstance(place.get("trips"), str):
        place["trips"] = _find_beside(path, place["trips"])
    planner = values.get("planner")
    if isinstance(planner, dict) and isinstance(planner.get("model"), str):
        planner["model"] = _find_beside(path, planner["model"])
    return values


def user_files_of(scenario: Scenario) -> dict[str, Path]:
    """Return the files with code of a user that running the scenario runs: of its ``planner`` and its ``task``."""
    names = {"planner": scenario.planner.name, "task": "" if scenario.task is None else scenario.task.name}
    return {group: whole_path(name) for group, name in names.items() if is_file_name(name)}


def find_user_files(values: dict[str, Any], folder: Path) -> None:
    """Make the names of users' planners and tasks in the keys of a scenario whole paths; they lie in ``folder``."""
    for group in ("planner", "task"):
        chosen = values.get(group)
        if isinstance(chosen, dict) and isinstance(chosen.get("name"), str) and is_file_name(chosen["name"]):
            chosen["name"] = str(whole_path(folder / chosen["name"]))


def _find_map(scenario: Path, name: str) -> str:
    """Return the map's path: beside the scenario or as it is; names of packaged maps stay names."""
    if is_packaged(name):
        return name
    return _find_beside(scenario, name)


def _find_beside(scenario: Path, name: str) -> str:
    """Return the path beside the scenario if there is something, else as it is."""
    beside = scenario.parent / name
    return str(beside) if beside.exists() else name


def load_scenario(path: Path | str) -> Scenario:
    """Return the scenario in YAML file ``path``."""
    return parse_scenario(read_scenario_file(Path(path)), str(path))


def _first_problem(error: ValidationError, where: str) -> ConfigError:
    """Turn pydantic's first error into ours."""
    problems = error.errors()
    # A key that is misspelt is why another one is missing.
    problem = next((one for one in problems if one["type"] == "extra_forbidden"), problems[0])
    loc = tuple(part for part in problem["loc"] if part not in KINDS)
    place = ".".join(str(p) for p in loc)
    message = str(problem["msg"]).removeprefix("Value error, ")
    if problem["type"] == "extra_forbidden":
        message = f"unknown key{nearest_hint(str(loc[-1]), _valid_keys(loc[:-1]))}"
        message += REMEDIES.get(place, "")
    elif problem["type"] in ("model_type", "model_attributes_type"):
        message = f"must be keys with values{LISTS.get(place, '')}, not {problem['input']!r}"
    elif problem["type"] == "missing":
        message = "is missing"
    return ConfigError(f"{where}: {place}" if place else where, message)


def _valid_keys(loc: tuple[int | str, ...]) -> list[str]:
    """Return the keys that are valid at place ``loc`` of a scenario."""
    models: list[Any] = [Scenario]
    for part in loc:
        if isinstance(part, int):
            continue
        inside = [model.model_fields[part].annotation for model in models if part in model.model_fields]
        if inside:
            models = [model for annotation in inside for model in _models_in(annotation)]
        else:  # what kind of obstacle it is
            models = [model for model in models if getattr(model.model_fields.get("type"), "default", None) == part]
    return list(dict.fromkeys(name for model in models for name in model.model_fields))


def _models_in(annotation: Any) -> list[Any]:
    """Return the groups of keys that a type is made of."""
    if hasattr(annotation, "model_fields"):
        return [annotation]
    return [model for part in get_args(annotation) for model in _models_in(part)]
