"""Controllers by name: each file here that does not begin with an underscore is one.

Such a module says what it is in ``SUMMARY``, ``KNOWS`` and ``GUARANTEES``, names its numbers in a class ``Params``
(a NamedTuple) and makes a ``Controller`` for some runs with ``create(problem, params)``.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any, NamedTuple

from swarmscope.disk.runs import Controller, Problem
from swarmscope.errors import ConfigError, UnknownNameError


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
        kind = type(getattr(params, key))
        try:
            params = params._replace(**{key: kind(value)})
        except (TypeError, ValueError):
            raise ConfigError(f"{name}.{key}", f"'{value}' is not a {kind.__name__}") from None
    return Kind(name, module.SUMMARY, module.KNOWS, module.GUARANTEES, params, module.create)
