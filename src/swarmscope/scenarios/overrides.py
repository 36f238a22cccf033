"""Changes to a scenario that is not checked yet: by text (``key.path=value``) and by Python values (``key__path``)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from copy import copy
from typing import Any

import yaml

from swarmscope.bounds import number_of
from swarmscope.errors import ConfigError
from swarmscope.scenarios.plain import plain
from swarmscope.texts import load_yaml

PLACES = ("task", "map", "place")
MOST_DIGITS = 9
"""Of a number in a path: no list is as long."""


def choose(values: dict[str, Any], group: str, key: str, value: str) -> None:
    """Set ``group.key``; the group's other keys stay if they were written for the same value."""
    if group in PLACES:
        leave_only(values, group)
    given = values.get(group)
    same = isinstance(given, dict) and given.get(key) == value
    values[group] = given if same else {key: value}


def leave_only(values: dict[str, Any], place: str) -> None:
    """Remove the other places than ``place``."""
    for other in PLACES:
        if other != place:
            values.pop(other, None)


def set_key(values: dict[str, Any], change: str) -> None:
    """Apply one ``key.path=value`` to the nested mapping."""
    path, equals, text = change.partition("=")
    if not equals or not all(path.split(".")):
        raise ConfigError(f"--set {change}", "must look like key.path=value")
    set_path(values, path.split("."), read_value(text, change), f"--set {change}")


def set_path(values: dict[str, Any], path: Sequence[str], value: Any, where: str) -> None:
    """Set the value at ``path`` of the nested mapping; a part of a list goes by its number, from 0 on.

    ``where`` begins the error when there is no such place. What is on the way is copied: parts of a file may be one and
    the same thing, by YAML's aliases.
    """
    at: Any = values
    for depth, part in enumerate(path[:-1]):
        key = _key_in(at, path[:depth], part, where)
        inside = at[key] if isinstance(at, list) else at.get(key, {})
        at[key] = inside = copy(inside)
        at = inside
    at[_key_in(at, path[:-1], path[-1], where)] = value


def _key_in(at: Any, before: Sequence[str], part: str, where: str) -> Any:
    """Return the key or the number that ``part`` is in ``at``, which lies at the path ``before``."""
    name = ".".join(before)
    if isinstance(at, list):
        if not at:
            raise ConfigError(where, f"'{name}' is an empty list")
        if not (part.isascii() and part.isdigit() and len(part) < MOST_DIGITS and int(part) < len(at)):
            raise ConfigError(where, f"'{name}' is a list of {len(at)}: '{name}.0' to '{name}.{len(at) - 1}'")
        return int(part)
    if not isinstance(at, dict):
        raise ConfigError(where, f"'{name}' is not a group of keys")
    if before and part.isdigit():
        raise ConfigError(where, f"'{name}' is not a list: leave '.{part}' out, or make it one in the file")
    return part


def override(values: dict[str, Any], changes: Mapping[str, Any], where: str) -> None:
    """Apply ``{"robot__radius_m": 0.2}`` or ``{"robot": {"radius_m": 0.2}}``: keys that are not named stay."""
    for name, value in changes.items():
        if isinstance(value, Mapping):
            override(values, {f"{name}__{key}": item for key, item in value.items()}, where)
        else:
            path = name.split("__")
            set_path(values, path, plain(value), f"{where}: {'.'.join(path)}")


def read_value(text: str, change: str) -> Any:
    """Return ``text`` as YAML reads it; 1e-3, which YAML 1.1 takes for text, is a number."""
    try:
        value = load_yaml(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        why = getattr(error, "problem", None) or "it is nested too deep, or a date that there is not"
        raise ConfigError(f"--set {change}", f"the value is not valid YAML: {why}") from None
    number = number_of(value) if isinstance(value, str) else math.nan
    return value if math.isnan(number) else number
