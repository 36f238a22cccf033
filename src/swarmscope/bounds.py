"""Bounds of what people set: ``width_m: Metres = 1.2`` in a planner's ``Params`` or a task's options."""

from __future__ import annotations

import math
from functools import cache
from typing import Annotated, Any, NamedTuple, get_type_hints

from swarmscope.errors import ConfigError


class Bounds(NamedTuple):
    """Smallest and largest value, and the unit."""

    low: float
    high: float
    unit: str = ""


Metres = Annotated[float, Bounds(0.0, 1000.0, "m")]
Seconds = Annotated[float, Bounds(0.0, 100_000.0, "s")]
Speed = Annotated[float, Bounds(0.0, 100.0, "m/s")]
Radians = Annotated[float, Bounds(0.0, 2.0 * math.pi, "rad")]
Degrees = Annotated[float, Bounds(0.0, 360.0, "deg")]
Weight = Annotated[float, Bounds(0.0, 1000.0)]
Share = Annotated[float, Bounds(0.0, 1.0)]
Flag = Annotated[int, Bounds(0, 1)]
Seed = Annotated[int, Bounds(0, 2**31 - 1)]


@cache
def bounds_of(kind: type) -> dict[str, Bounds]:
    """Return the bounds of the fields of ``kind`` that have any."""
    found = {}
    for name, hint in get_type_hints(kind, include_extras=True).items():
        for extra in getattr(hint, "__metadata__", ()):
            if isinstance(extra, Bounds):
                found[name] = extra
    return found


def words(bounds: Bounds | None) -> str:
    """Return bounds for people to read."""
    if bounds is None:
        return ""
    return f"{bounds.low:g} to {bounds.high:g} {bounds.unit}".strip()


def checked(value: Any, default: Any, bounds: Bounds | None, where: str) -> Any:
    """Return ``value`` as a number like ``default``; a ConfigError says what is wrong with it ``where``."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ConfigError(where, f"must be a number, not {value!r}")
    if isinstance(default, int) and value != int(value):
        raise ConfigError(where, f"must be a whole number, not {value!r}")
    if bounds is not None and not bounds.low <= value <= bounds.high:
        raise ConfigError(where, f"must be {words(bounds)}, not {value!r}")
    return type(default)(value)
