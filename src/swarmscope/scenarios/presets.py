"""A planner's preset: keys of a scenario that hold where the scenario itself says nothing."""

from __future__ import annotations

from typing import Any

from swarmscope.errors import ConfigError, UnknownNameError
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.scenarios.scenario import PlannerModel
from swarmscope.user_files import is_file_name


def with_preset(values: dict[str, Any], where: str) -> dict[str, Any]:
    """Return the keys of a scenario, which is not checked yet, above those of the preset that it names.

    Whatever is no scenario's key or value stays as it is: checking says so.
    """
    planner = values.get("planner")
    preset = planner.get("preset") if isinstance(planner, dict) else None
    if not isinstance(planner, dict) or not isinstance(preset, str):
        return values
    name = planner.get("name", PlannerModel().name)
    if not isinstance(name, str):
        return values
    keys = _preset_of(name, preset, f"{where}: planner.preset")
    for key, value in keys.items():
        values = _below(values, key.split("."), value)
    return values


def _preset_of(name: str, preset: str, where: str) -> dict[str, Any]:
    if is_file_name(name):  # which is not run before the scenario is known to be one
        raise ConfigError(where, "only planners known by their name have presets, not a file of your own")
    if name not in planner_names():
        return {}
    presets = load_planner(name).presets
    if not presets:
        raise ConfigError(where, f"planner '{name}' has no presets")
    if preset not in presets:
        raise UnknownNameError("preset", preset, presets, where)
    return presets[preset]


def _below(values: Any, path: list[str], value: Any) -> Any:
    """Return the nested mapping with ``value`` at ``path``, unless something is there already."""
    first, *rest = path
    if not isinstance(values, dict) or (not rest and first in values):
        return values
    return values | {first: _below(values.get(first, {}), rest, value) if rest else value}
