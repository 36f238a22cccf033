"""Controllers by name: each file here that does not begin with an underscore is one.

Such a module says what it is in ``SUMMARY``, ``KNOWS`` and ``GUARANTEES``, names its numbers in a class ``Params``
(a NamedTuple) and makes a ``Controller`` for some runs with ``create(problem, params)``. ``LIMITS`` says between
which values a number has to be (both included); those that are not named there are from 0 to ``LARGEST``.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, NamedTuple

from swarmscope.disk.runs import Controller, Problem
from swarmscope.errors import ConfigError, UnknownNameError

LARGEST = 1e6


class Kind(NamedTuple):
    """A controller that can be made for any runs."""

    name: str
    summary: str
    knows: str
    guarantees: str
    params: Any
    create: Callable[[Problem, Any], Controller]


def names() -> list[str]:
    """Return the names of all controllers."""
    return sorted(module.name.replace("_", "-") for module in pkgutil.iter_modules(__path__) if module.name[0] != "_")


def find(name: str, changes: Mapping[str, Any] | None = None) -> Kind:
    """Return the controller of that name with some of its numbers changed. Errors: UnknownNameError, ConfigError."""
    if name not in names():
        raise UnknownNameError("controller", name, [*names(), "FILE.py"])
    module = import_module(f"{__name__}.{name.replace('-', '_')}")
    params = module.Params()
    for key, value in (changes or {}).items():
        if key not in params._fields:
            raise UnknownNameError("parameter", key, params._fields, name)
        params = params._replace(**{key: _number(f"{name}.{key}", value, type(getattr(params, key)))})
        low, high = module.LIMITS.get(key, (0.0, LARGEST))
        if not low <= getattr(params, key) <= high:
            raise ConfigError(f"{name}.{key}", f"{value} is not between {low:g} and {high:g}")
    return Kind(name, module.SUMMARY, module.KNOWS, module.GUARANTEES, params, module.create)


def _number(where: str, value: Any, kind: type) -> Any:
    try:
        return kind(value)
    except (TypeError, ValueError, OverflowError):
        raise ConfigError(where, f"'{value}' is not a {'whole ' if kind is int else ''}number") from None
