"""What a task is, and how one is found.

A task is a Python file (see ``members``) that defines ``NAME``, ``SUMMARY`` (one line) and
``make(seed, robots, radius, ...) -> Setup``. What can be set are the fields of the dataclass ``OPTIONS``, or without
one the parameters of ``make`` after these three. The files of this folder are called like their tasks in lower case.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import dataclass, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Protocol, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from swarmscope import members
from swarmscope.bounds import Bounds, Field, Value, converted, fields_of, fields_of_function
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.members import Kind, Need, text
from swarmscope.sim.world import WorldSpec
from swarmscope.user_files import is_file_name

Option = float | str
"""What an option can be: a number, or one of a few words."""

Amount = Annotated[float, Bounds(0.0, 1000.0)]
Density = Annotated[float, Bounds(0.0, 1000.0, "1/m^2")]
Length = Annotated[float, Bounds(0.0, 1000.0, "m")]

Options = TypeVar("Options")


@dataclass(frozen=True)
class Setup:
    """A world and where each robot starts and wants to go, world frame."""

    world: WorldSpec
    starts: NDArray[np.float64]  # (N, 3) x [m], y [m], yaw [rad]
    goals: NDArray[np.float64]  # (N, 2) x, y [m]
    goal_yaws: NDArray[np.float64] | None = None  # (N,) headings wanted there [rad], NaN where any will do
    start_s: NDArray[np.float64] | None = None  # (N,) when each robot is switched on [s]; None: at once


class Task(Protocol):
    """The face of a task module."""

    NAME: str
    SUMMARY: str

    def make(self, seed: int, robots: int = ..., radius: float = ..., **options: Option) -> Setup:
        """Return a solvable setup for ``robots`` robots of ``radius`` [m]; the same seed gives the same
        setup."""
        ...


TASKS = Kind(
    "task",
    "swarmscope.tasks",
    "swarmscope.tasks",
    needs=(text("NAME"), text("SUMMARY"), Need("make", "a function make(seed, robots, radius, ...)", callable)),
)


def load_task(name: str) -> Task:
    """Import the task called ``name`` (upper or lower case), or the one in a user's FILE.py."""
    known = {} if is_file_name(name) else {one.lower(): one for one in task_names()}
    return cast("Task", members.load(TASKS, known.get(name.lower(), name)))


def task_names() -> list[str]:
    """Return the names of all tasks that are installed, in alphabetical order."""
    return members.names_of(TASKS)


def task_file(name: str) -> Path:
    """Return the file of a task without importing it."""
    return members.find(TASKS, name).file


def option_fields(task: Task) -> dict[str, Field]:
    """Return the options of a task. Errors: an InputFileError names what is wrong with how they are declared."""
    file, kind = Path(str(getattr(task, "__file__", task.NAME))), getattr(task, "OPTIONS", None)
    try:
        if kind is not None:
            if not (isinstance(kind, type) and is_dataclass(kind)):
                raise ConfigError("OPTIONS", "is not a dataclass")
            return fields_of(kind, "OPTIONS")
        if any(p.kind == p.VAR_KEYWORD for p in inspect.signature(task.make).parameters.values()):
            raise ConfigError("make", "takes any options (**): declare them in a dataclass OPTIONS")
        return fields_of_function(task.make, 3, "make")
    except ConfigError as error:
        raise InputFileError(file, str(error)) from None


def all_options(task: Task, options: Mapping[str, Any]) -> dict[str, Value]:
    """Return every option of a task, converted and checked. Errors: ConfigError, UnknownNameError."""
    return converted(option_fields(task), options, f"task {task.NAME}", "option")


def read_options(kind: type[Options], options: Mapping[str, Any], task: str) -> Options:
    """Return the dataclass ``kind`` filled with ``options``, converted and checked."""
    where = f"task {task}"
    return kind(**converted(fields_of(kind, where), options, where, "option"))


def check_robots(robots: int, radius: float) -> None:
    """Raise a ConfigError unless there is at least one robot, of a positive radius [m]."""
    if isinstance(robots, bool) or not isinstance(robots, int | np.integer) or robots < 1:
        raise ConfigError("robots", f"must be a whole number >= 1, not {robots!r}")
    if not (np.isfinite(radius) and radius > 0.0):
        raise ConfigError("radius", f"must be a length > 0 m, not {radius!r}")
