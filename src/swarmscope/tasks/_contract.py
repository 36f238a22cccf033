"""What a task is, and how one is found by its name.

A task is one file of this folder: its name in lower case is the file's name, and it defines ``NAME``,
``SUMMARY`` (one line) and ``make(seed, robots, radius, **options) -> Setup``. A file is imported when it is
asked for.
"""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError, UnknownNameError
from swarmscope.sim.world import WorldSpec

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

    def make(self, seed: int, robots: int = ..., radius: float = ..., **options: float) -> Setup:
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
    """Return the dataclass ``kind`` filled with ``options``; every field of it is a positive number."""
    valid = [field.name for field in fields(cast("Any", kind))]
    values: dict[str, float] = {}
    for name, value in options.items():
        where = f"task {task}"
        if name not in valid:
            raise UnknownNameError("option", name, valid, where)
        if (
            isinstance(value, bool)
            or not isinstance(value, int | float)
            or not np.isfinite(value)
            or value < 0.0
        ):
            raise ConfigError(f"{where}: {name}", f"must be a number >= 0, not {value!r}")
        values[name] = float(value)
    return kind(**values)


def check_robots(robots: int, radius: float) -> None:
    """Raise a ConfigError unless there is at least one robot, of a positive radius [m]."""
    if isinstance(robots, bool) or not isinstance(robots, int | np.integer) or robots < 1:
        raise ConfigError("robots", f"must be a whole number >= 1, not {robots!r}")
    if not (np.isfinite(radius) and radius > 0.0):
        raise ConfigError("radius", f"must be a length > 0 m, not {radius!r}")


def _stems() -> list[str]:
    folder = Path(__file__).parent
    return sorted(path.stem for path in folder.glob("*.py") if not path.stem.startswith("_"))
