"""Runs a user's controller in a process of its own, so that nothing in the file can reach who judges the run.

The process is given numbers and gives numbers back, over two pipes; nothing is pickled. First comes a line of JSON: the
file, and of each run goals, obstacles and the robots' radius. Then, for each call, comes a ``CALL`` and the positions,
and back goes ``ANSWER`` and as many numbers, or ``WRONG``, a length, and words. The first thing that goes back is
``READY`` or ``WRONG``.
"""

from __future__ import annotations

import ctypes
import inspect
import json
import os
import signal
import struct
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import CodeType
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import InputFileError, SwarmscopeError
from swarmscope.user_files import RAISED, compiled, one_line, raised

FUNCTION = "compute_gradients"
SIGNATURE = f"{FUNCTION}(state, targets, obstacles, r)"
HUGE = 1e100
CALL = struct.Struct("<q")
"""Number of the run that is asked for; positions (n, 2) follow."""
LENGTH = struct.Struct("<I")
READY, ANSWER, WRONG, FILE_IS_WRONG = b"R", b"A", b"W", b"F"
MOST_WORDS = 2000
DIES_WITH_PARENT = 1
"""PR_SET_PDEATHSIG of Linux: a controller that never returns does not outlive its judge."""

Floats = NDArray[np.float64]


class WrongAnswerError(SwarmscopeError):
    """What a controller returned is no velocity for each robot, or it raised."""


def serve(asked: int, answers: int) -> None:
    """Answer calls on these file descriptors until there are no more."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # who judges decides
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).prctl(DIES_WITH_PARENT, signal.SIGKILL)
    with os.fdopen(asked, "rb") as source, os.fdopen(answers, "wb", buffering=0) as sink:
        try:
            _serve(source, sink)
        except BaseException as error:  # a file may have broken anything here, too
            with suppress(BaseException):
                _say(sink, WRONG, f"its process failed: {type(error).__name__}: {one_line(error)}")
        os._exit(0)  # what a file leaves running, or does at the end, is nobody's business


def _serve(source: BinaryIO, sink: BinaryIO) -> None:
    about = json.loads(source.readline())
    path = Path(about["file"])
    try:
        code = compiled(path)
        functions = [function_of(path, code) for _ in range(max(1, len(about["runs"])))]
    except InputFileError as error:
        _say(sink, FILE_IS_WRONG, error.why)
        return
    sink.write(READY)
    runs = [(np.array(run["goals"], np.float64), _discs(run["obstacles"])) for run in about["runs"]]
    size = 16 * about["robots"]
    while len(head := source.read(CALL.size)) == CALL.size:
        run = CALL.unpack(head)[0]
        state = np.frombuffer(source.read(size), np.float64).reshape(-1, 2).copy()
        goals, obstacles = runs[run]
        try:
            found = velocities_of(functions[run], (state, goals.copy(), obstacles, about["radius"]), path)
        except WrongAnswerError as error:
            _say(sink, WRONG, str(error))
            continue
        sink.write(ANSWER + np.ascontiguousarray(found, np.float64).tobytes())


def _say(sink: BinaryIO, kind: bytes, words: str) -> None:
    text = words.encode("utf-8", "replace")[:MOST_WORDS]
    sink.write(kind + LENGTH.pack(len(text)) + text)


def _discs(obstacles: list[list[float]]) -> list[dict[str, Any]]:
    return [{"center": (x, y), "radius": radius} for x, y, radius in obstacles]


def function_of(path: Path, code: CodeType) -> Callable[..., Any]:
    """Run a file and return its function. Errors: InputFileError."""
    space: dict[str, Any] = {"__name__": path.stem, "__file__": str(path)}
    try:
        exec(code, space)  # noqa: S102 - running the user's own file is what the user asked for
    except (*RAISED, KeyboardInterrupt) as error:
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


def velocities_of(function: Callable[..., Any], given: tuple[Any, ...], path: Path) -> Floats:
    """Call a controller; return its velocities (n, 2). Errors: WrongAnswerError."""
    try:
        answer = function(*given)
    except (*RAISED, KeyboardInterrupt) as error:
        raise WrongAnswerError(raised(error, path)) from None
    return _checked(answer, len(given[1]))


def _checked(answer: Any, robots: int) -> Floats:
    wanted = robots, 2
    try:
        found = np.asarray(answer)
        shape, kind = found.shape, found.dtype.kind
    except ValueError:
        shape, kind = ("ragged",), "O"
    except Exception as error:  # the conversion is code of the library that the answer comes from
        what = f"a {type(answer).__name__}, which is no array: {one_line(error)}"
        raise WrongAnswerError(f"returned {what}") from None
    if shape != wanted:
        shown = "nothing (None)" if answer is None else f"an array of shape {shape}"
        raise WrongAnswerError(f"returned {shown}, wanted {wanted}")
    if kind not in "fiub":
        raise WrongAnswerError(f"returned values of type {found.dtype}, wanted numbers")
    numbers = found.astype(np.float64)
    if not np.isfinite(numbers).all():
        robot = int(np.flatnonzero(~np.isfinite(numbers).all(axis=1))[0])
        raise WrongAnswerError(f"the velocity of robot {robot} is {numbers[robot].tolist()}, wanted finite numbers")
    # Squares of such numbers overflow; the direction is all that counts.
    huge = np.abs(numbers).max(axis=1, keepdims=True)
    return np.where(huge > HUGE, numbers / np.maximum(huge, 1.0), numbers)
