"""What a task is, and how one is found by its name.

A task is one file of this folder: its name in lower case is the file's name, and it defines ``NAME``,
``SUMMARY`` (one line) and ``make(seed, robots, radius, **options) -> Setup``. A file is imported when it is
asked for.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Protocol, TypeVar, cast, get_args, get_type_hints

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError, UnknownNameError
from swarmscope.sim.world import WorldSpec

Option = float | str
"""What an option can be: a number, or one of a few words."""

Options = TypeVar("Options")


@dataclass(frozen=True)
class Setup:
    """A world and where each robot starts and wants to go, world frame."""

    world: WorldSpec
    starts: NDArray[np.float64]  # (N, 3) x [m], y [m], yaw [rad]
    goals: NDArray[np.float64]  # (N, 2) x, y [m]


class Task(Protocol):
    """The face of a task module."""

    NAME: str
    SUMMARY: str

    def make(self, seed: int, robots: int = ..., radius: float = ..., **options: Option) -> Setup:
        """Return a solvable setup for ``robots`` robots of ``radius`` [m]; the same seed gives the same
        setup."""
        ...


def load_task(name: str) -> Task:
    """Import the task called ``name`` (upper or lower case)."""
    stem = name.lower()
    if stem not in _stems():
        raise UnknownNameError("task", name, task_names())
    return cast("Task", importlib.import_module(f"{__package__}.{stem}"))


def task_names() -> list[str]:
    """Return the names of all tasks, in alphabetical order."""
    return sorted((load_task(stem).NAME for stem in _stems()), key=str.lower)


def read_options(kind: type[Options], options: Mapping[str, Any], task: str) -> Options:
    """Return the dataclass ``kind`` filled with ``options``.

    Every field of it is a number >= 0, or, where it is declared as a ``Literal`` of words, one of these.
    """
    hints, where = get_type_hints(kind), f"task {task}"
    valid = [field.name for field in fields(cast("Any", kind))]
    values: dict[str, Option] = {}
    for name, value in options.items():
        if name not in valid:
            raise UnknownNameError("option", name, valid, where)
        words = [word for word in get_args(hints[name]) if isinstance(word, str)]
        values[name] = _word(name, value, words, where) if words else _number(name, value, where)
    return kind(**values)


def _word(name: str, value: Any, words: list[str], where: str) -> str:
    if value not in words:
        raise UnknownNameError(name, str(value), words, where)
    return str(value)


def _number(name: str, value: Any, where: str) -> float:
    """Return a number >= 0; text that reads as a number is one (YAML 1.1 takes 1e-3 for text)."""
    number = math.nan
    if isinstance(value, int | float | str) and not isinstance(value, bool):
        with suppress(ValueError):
            number = float(value)
    if not (math.isfinite(number) and number >= 0.0):
        raise ConfigError(f"{where}: {name}", f"must be a number >= 0, not {value!r}")
    return number


def check_robots(robots: int, radius: float) -> None:
    """Raise a ConfigError unless there is at least one robot, of a positive radius [m]."""
    if isinstance(robots, bool) or not isinstance(robots, int | np.integer) or robots < 1:
        raise ConfigError("robots", f"must be a whole number >= 1, not {robots!r}")
    if not (np.isfinite(radius) and radius > 0.0):
        raise ConfigError("radius", f"must be a length > 0 m, not {radius!r}")


def _stems() -> list[str]:
    folder = Path(__file__).parent
    return sorted(path.stem for path in folder.glob("*.py") if not path.stem.startswith("_"))
