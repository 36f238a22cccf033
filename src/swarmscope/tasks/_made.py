"""A setup as a task makes it; what somebody else's task makes is checked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from swarmscope.closure import PACKAGE
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.tasks._check import check_setup
from swarmscope.tasks._contract import Setup, all_options, load_task, task_file
from swarmscope.user_files import guarded


def setup_of_task(name: str, options: Mapping[str, Any], seed: int, robots: int, radius: float) -> Setup:
    """Return the task's setup for ``robots`` robots of ``radius`` [m]; ``name`` may be a user's FILE.py.

    Errors: InputFileError if the code of a user raises or returns something else, UnsolvableWorldError.
    """
    task, file = load_task(name), task_file(name)
    chosen: dict[str, Any] = all_options(task, options)
    if file.is_relative_to(PACKAGE):
        try:
            return task.make(seed, robots, radius, **chosen)
        except ValidationError as error:  # of an obstacle that no options should make, were it not for extremes
            why = str(error.errors()[0]["msg"]).removeprefix("Value error, ")
            raise ConfigError("task.options", f"{task.NAME} cannot be made of them: {why}") from None
    made = guarded(lambda: task.make(seed, robots, radius, **chosen), file)
    setup = _checked(made, robots, file)
    check_setup(setup, radius)
    return setup


def _checked(made: Any, robots: int, file: Path) -> Setup:
    """Return what a user's ``make`` returned as numbers of the right shapes."""
    if not isinstance(made, Setup):
        raise InputFileError(file, f"make returned {type(made).__name__}, wanted a Setup(world, starts, goals)")
    arrays: dict[str, Any] = {}
    for key, columns in (("starts", 3), ("goals", 2)):
        try:
            arrays[key] = np.array(getattr(made, key), dtype=np.float64)
        except (TypeError, ValueError):
            raise InputFileError(file, f"make returned {key} that are not numbers") from None
        if arrays[key].shape != (robots, columns):
            shape = arrays[key].shape
            raise InputFileError(file, f"make returned {key} of shape {shape}, wanted {(robots, columns)}")
    return replace(made, **arrays)
