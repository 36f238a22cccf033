"""What can be set and within which bounds: parameters of planners, options of tasks.

They are the fields of a NamedTuple or a dataclass with defaults, or the keyword parameters of a function. A number may
carry bounds and a unit: ``gain: Annotated[float, Bounds(0.0, 10.0, "1/s")] = 1.0``, or ``width: Metres = 1.2``. Without
them any finite number is taken; a ``Literal`` takes its words.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import MISSING, fields, is_dataclass
from typing import Annotated, Any, Literal, NamedTuple, get_args, get_origin, get_type_hints

from swarmscope.errors import ConfigError, UnknownNameError

Value = float | int | bool | str
KINDS = (float, int, bool, str)


class Bounds(NamedTuple):
    """The least and the greatest value of a number, both allowed, and its unit."""

    low: float = -math.inf
    high: float = math.inf
    unit: str = ""


LONGEST_S = 100_000.0
Metres = Annotated[float, Bounds(0.0, 1000.0, "m")]
Seconds = Annotated[float, Bounds(0.0, LONGEST_S, "s")]
Speed = Annotated[float, Bounds(0.0, 100.0, "m/s")]
Radians = Annotated[float, Bounds(0.0, 2.0 * math.pi, "rad")]
Degrees = Annotated[float, Bounds(0.0, 360.0, "deg")]
Weight = Annotated[float, Bounds(0.0, 1000.0)]
Share = Annotated[float, Bounds(0.0, 1.0)]
Flag = Annotated[int, Bounds(0, 1)]
Seed = Annotated[int, Bounds(0, 2**31 - 1)]


class Field(NamedTuple):
    """One thing that can be set."""

    name: str
    kind: type
    """float, int, bool or str."""
    default: Value
    bounds: Bounds
    words: tuple[str, ...]
    """The words that a Literal takes."""


def fields_of(kind: Any, where: str) -> dict[str, Field]:
    """Return the fields of a NamedTuple or a dataclass. Errors: ConfigError for a field without a default."""
    if is_dataclass(kind):
        defaults = {f.name: f.default for f in fields(kind)}
    else:
        known = kind._field_defaults
        defaults = {name: known.get(name, MISSING) for name in kind._fields}
    return _fields(defaults, _hints(kind, where), where)


def fields_of_function(function: Callable[..., Any], leave_out: int, where: str) -> dict[str, Field]:
    """Return the parameters of a function after the first ``leave_out`` as fields. Errors: ConfigError."""
    known = list(inspect.signature(function).parameters.values())[leave_out:]
    named = [p for p in known if p.kind in (p.POSITIONAL_OR_KEYWORD, p.KEYWORD_ONLY)]
    defaults = {p.name: MISSING if p.default is p.empty else p.default for p in named}
    return _fields(defaults, _hints(function, where), where)


def converted(fields: Mapping[str, Field], values: Mapping[str, Any], where: str, word: str) -> dict[str, Value]:
    """Return every field with its value, those that ``values`` leaves out with their defaults.

    Errors name place, key, value, bounds and unit: UnknownNameError for a key (a ``word``) that there is not,
    ConfigError for a value.
    """
    for key in values:
        if key not in fields:
            raise UnknownNameError(word, key, fields, where)
    return {name: _value(field, values[name], where) if name in values else field.default
            for name, field in fields.items()}  # fmt: skip


def about(field: Field) -> str:
    """Return what a field takes, in words: 'a number from 0 to 10 m'."""
    if field.words:
        return f"one of {', '.join(field.words)}"
    if field.kind in (bool, str):
        return "true or false" if field.kind is bool else "text"
    low, high, unit = field.bounds
    what = "a whole number" if field.kind is int else "a number"
    if math.isfinite(low) and math.isfinite(high):
        what += f" from {low:.10g} to {high:.10g}"
    elif math.isfinite(low):
        what += f" >= {low:.10g}"
    elif math.isfinite(high):
        what += f" <= {high:.10g}"
    return f"{what} {unit}" if unit else what


def _hints(kind: Any, where: str) -> dict[str, Any]:
    try:
        return get_type_hints(kind, include_extras=True)
    except Exception as error:  # annotations are a user's code
        raise ConfigError(where, f"has an annotation that cannot be read: {' '.join(str(error).split())}") from None


def _fields(defaults: Mapping[str, Any], hints: Mapping[str, Any], where: str) -> dict[str, Field]:
    return {name: _field(name, default, hints.get(name), where) for name, default in defaults.items()}


def _field(name: str, default: Any, hint: Any, where: str) -> Field:
    if default is MISSING:
        raise ConfigError(where, f"'{name}' has no default")
    bounds = Bounds()
    if get_origin(hint) is Annotated:
        hint, *notes = get_args(hint)
        bounds = next((note for note in notes if isinstance(note, Bounds)), bounds)
    words = tuple(get_args(hint)) if get_origin(hint) is Literal else ()
    kind = str if words else (type(default) if hint is None else hint)
    if kind not in KINDS or not all(isinstance(word, str) for word in words):
        raise ConfigError(where, f"'{name}' is neither a float, int, bool or str nor a Literal of words")
    field = Field(name, kind, default, bounds, words)
    return field._replace(default=_value(field, default, where))


def _value(field: Field, value: Any, where: str) -> Value:
    """Return a value as the field's kind; text that reads as a number is one (YAML 1.1 takes 1e-3 for text)."""
    if field.words:
        if value not in field.words:
            raise UnknownNameError(field.name, str(value), field.words, where)
        return str(value)
    if field.kind is str and isinstance(value, str):
        return value
    if field.kind is bool and value in (True, False):
        return bool(value)
    number = number_of(value) if field.kind in (float, int) else math.nan
    whole = field.kind is float or (math.isfinite(number) and number == int(number))
    if math.isfinite(number) and whole and field.bounds.low <= number <= field.bounds.high:
        return int(number) if field.kind is int else number
    raise ConfigError(f"{where}: {field.name}", f"must be {about(field)}, not {value!r}")


def number_of(value: Any) -> float:
    """Return a number, or what text says in plain digits, minus zero as zero; NaN for anything else."""
    if isinstance(value, str) and ("_" in value or not value.isascii()):
        return math.nan
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        with suppress(ValueError, OverflowError):
            return float(value) + 0.0
    return math.nan
