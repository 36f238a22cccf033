"""A user's own controller: a Python file with the function of the unit-disk report.

``compute_gradients(state, targets, obstacles, r)`` takes the positions and goals (n, 2), the obstacles as dicts with
``center`` and ``radius``, and the radius of the robots, and returns the velocities (n, 2). The file is run as it is,
with all the rights of the one who runs it. Each run begins with a fresh copy of the file, so what it keeps in global
variables does not leak from one run into the next.
"""

from __future__ import annotations

import inspect
import time
from collections.abc import Callable
from pathlib import Path
from types import CodeType
from typing import Any

import numpy as np

from swarmscope.disk.rules import Floats, Ints
from swarmscope.disk.runs import Problem
from swarmscope.errors import InputFileError, SwarmscopeError
from swarmscope.user_files import RAISED, compiled, one_line, raised

FUNCTION = "compute_gradients"
HUGE = 1e100
SIGNATURE = f"{FUNCTION}(state, targets, obstacles, r)"

STARTER = '''"""A controller for the unit disk. Try it: swarmscope disk run {name} --map c0 --permutation 0,3,1,4,2"""

import numpy as np


def compute_gradients(state, targets, obstacles, r):
    """Return the velocity of each robot, shape (n, 2); longer than 1 is cut to length 1 (full speed).

    state:     (n, 2) array, where the robots are
    targets:   (n, 2) array, where they have to go
    obstacles: list of {{"center": (x, y), "radius": R}}
    r:         radius of the robots; closer than 2 r is a collision, and so is closer than R + r to an obstacle
    """
    velocity = targets - state  # straight to the goal
    for i, robot in enumerate(state):
        for obstacle in obstacles:
            away = robot - np.array(obstacle["center"])
            distance = np.linalg.norm(away)
            gap = distance - obstacle["radius"] - r
            if gap < 0.05:
                # Pushed away from what is near, and a bit to one side of it, so that one gets round.
                push = 0.01 / max(gap, 1e-4) * away / distance
                velocity[i] += push + np.array([-push[1], push[0]])
    length = np.linalg.norm(velocity, axis=1, keepdims=True)
    return velocity / np.maximum(length, 1e-9)
'''


class UserControllerError(SwarmscopeError):
    """A user's controller that raised, or returned something that is not a velocity for each robot."""


class UserController:
    """A user's controller for some runs, one copy of the file for each."""

    def __init__(self, path: Path, problem: Problem) -> None:
        code = compiled(path)
        self._path, self._problem = path, problem
        self._functions = [function_of(path, code) for _ in problem.map_of]
        self._obstacles = [problem.maps[which].as_dicts() for which in problem.map_of]
        self.calls, self.seconds = 0, 0.0

    def velocities(self, step: int, alive: Ints, state: Floats, velocity: Floats, out: Floats) -> None:
        """Write the velocities (see ``Controller``). Errors: UserControllerError."""
        r = self._problem.rules.r
        for b in alive:
            given = state[b].copy(), self._problem.goal[b].copy(), self._obstacles[b], r
            begun = time.perf_counter()
            try:
                answer = self._functions[b](*given)
            except RAISED as error:
                raise UserControllerError(f"{self._where(b, step)}: {raised(error, self._path)}") from None
            self.calls += 1
            self.seconds += time.perf_counter() - begun
            out[b] = self._checked(answer, b, step)

    def _checked(self, answer: Any, b: int, step: int) -> Floats:
        wanted = state_shape = (self._problem.rules.n, 2)
        try:
            found = np.asarray(answer)
            shape = found.shape
            kind = found.dtype.kind
        except ValueError:
            shape, kind = ("ragged",), "O"
        except Exception as error:  # the conversion is code of the library that the answer comes from
            what = f"a {type(answer).__name__}, which is no array: {one_line(error)}"
            raise UserControllerError(f"{self._where(b, step)}: returned {what}") from None
        if shape != wanted:
            shown = "nothing (None)" if answer is None else f"an array of shape {shape}"
            raise UserControllerError(f"{self._where(b, step)}: returned {shown}, wanted {state_shape}")
        if kind not in "fiub":
            raise UserControllerError(f"{self._where(b, step)}: returned values of type {found.dtype}, wanted numbers")
        numbers = found.astype(np.float64)
        if not np.isfinite(numbers).all():
            robot = int(np.flatnonzero(~np.isfinite(numbers).all(axis=1))[0])
            raise UserControllerError(
                f"{self._where(b, step)}: the velocity of robot {robot} is {numbers[robot].tolist()}, "
                "wanted finite numbers"
            )
        # Squares of such numbers overflow; the direction is all that counts.
        huge = np.abs(numbers).max(axis=1, keepdims=True)
        return np.where(huge > HUGE, numbers / np.maximum(huge, 1.0), numbers)

    def _where(self, b: int, step: int) -> str:
        permutation = ",".join(str(k) for k in self._problem.permutation[b])
        name = self._problem.maps[self._problem.map_of[b]].name
        return f"{self._path}: {FUNCTION} in step {step} of map {name}, permutation {permutation}"


def function_of(path: Path, code: CodeType) -> Callable[..., Any]:
    """Run a file and return its function. Errors: InputFileError."""
    space: dict[str, Any] = {"__name__": path.stem, "__file__": str(path)}
    try:
        exec(code, space)  # noqa: S102 - running the user's own file is what the user asked for
    except RAISED as error:
        raise InputFileError(path, raised(error, path)) from None
    function: Callable[..., Any] | None = space.get(FUNCTION)
    if function is None or not callable(function):
        raise InputFileError(path, f"has no function {SIGNATURE}")
    try:
        inspect.signature(function).bind(None, None, None, None)
    except TypeError:
        found = inspect.signature(function)
        raise InputFileError(path, f"{FUNCTION}{found} cannot be called as {SIGNATURE}") from None
    except ValueError:
        pass  # built-in functions may have no signature
    return function


def write_starter(path: Path) -> Path:
    """Write a controller to begin with. Errors: InputFileError if the file is there already or is not named .py."""
    if path.suffix != ".py":
        raise InputFileError(path, "a controller is a file whose name ends in .py")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(STARTER.format(name=path.name))
    except FileExistsError:
        raise InputFileError(path, "is there already; name another file") from None
    except OSError as error:
        raise InputFileError(path, error.strerror or "cannot be written") from None
    return path
