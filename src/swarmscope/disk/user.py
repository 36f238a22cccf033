"""A user's own controller: a Python file with the function of the unit-disk report.

``compute_gradients(state, targets, obstacles, r)`` takes the positions and goals (n, 2), the obstacles as dicts with
``center`` and ``radius``, and the radius of the robots, and returns the velocities (n, 2). The file is run as it is,
with all the rights of the one who runs it, but in a process of its own (``host.py``): it can change nothing of what
judges it. Each run begins with a fresh process, so what it keeps does not leak from one run into the next.
"""

from __future__ import annotations

import json
import os
import select
import subprocess
import sys
import time
import weakref
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from swarmscope.disk import host
from swarmscope.disk.host import FUNCTION, SIGNATURE
from swarmscope.disk.rules import Floats, Ints
from swarmscope.disk.runs import Problem
from swarmscope.errors import InputFileError, SwarmscopeError
from swarmscope.user_files import compiled

__all__ = ["SIGNATURE", "UserController", "UserControllerError", "check_file", "write_starter"]

CALL_S = 10.0
"""How long a call may take; the first one may compile something."""
AT_ONCE = 65536
"""Bytes that are read at once from the process."""
LOAD_S = 60.0
"""How long loading the file may take."""

STARTER = '''"""A controller for the unit disk. Try it: swarmscope disk run {name} --map c0 --permutation 0,3,1,4,2"""

import numpy as np

NEAR = 0.03  # what is nearer than this is gone round, and never approached


def compute_gradients(state, targets, obstacles, r):
    """Return the velocity of each robot, shape (n, 2); longer than 1 is cut to length 1 (full speed).

    state:     (n, 2) array, where the robots are
    targets:   (n, 2) array, where they have to go
    obstacles: list of {{"center": (x, y), "radius": R}}
    r:         radius of the robots; closer than 2 r is a collision, and so is closer than R + r to an obstacle
    """
    velocity = targets - state  # straight to the goal
    for i, robot in enumerate(state):
        discs = [(np.array(disc["center"]), disc["radius"]) for disc in obstacles]
        discs += [(other, r) for j, other in enumerate(state) if j != i]
        walls = []  # directions away from what is near
        for center, radius in discs:
            away = robot - center
            distance = np.linalg.norm(away)
            if distance - radius - r < NEAR:
                walls.append(away / distance)
        if np.linalg.norm(robot) > 0.996:
            walls.append(-robot / np.linalg.norm(robot))  # the rim
        for away in walls:
            toward = velocity[i] @ away
            if toward < 0:  # along the wall instead of into it, to the right, and a bit away
                velocity[i] += -toward * (1.01 * away + np.array([away[1], -away[0]]))
        if any(velocity[i] @ away < 0 for away in walls):
            velocity[i] = 0  # between two walls: wait
    length = np.linalg.norm(velocity, axis=1, keepdims=True)
    return velocity / np.maximum(length, 1e-9)
'''


class UserControllerError(SwarmscopeError):
    """A user's controller that raised, or returned something that is not a velocity for each robot."""


class _EndedError(Exception):
    """The controller's process is gone, or says nothing; the words say which."""


class UserController:
    """A user's controller for some runs, in a process of its own."""

    def __init__(self, path: Path, problem: Problem, call_s: float = CALL_S) -> None:
        self._path, self._problem, self._call_s = path, problem, call_s
        self._process = _Process(path, problem)
        self.calls, self.seconds = 0, 0.0

    def velocities(self, step: int, alive: Ints, state: Floats, velocity: Floats, out: Floats) -> None:
        """Write the velocities (see ``Controller``). Errors: UserControllerError."""
        for b in alive:
            begun = time.perf_counter()
            try:
                out[b] = self._process.velocities(int(b), state[b], self._call_s)
            except _EndedError as end:
                raise UserControllerError(f"{self._where(b, step)}: {end}") from None
            self.calls += 1
            self.seconds += time.perf_counter() - begun

    def close(self) -> None:
        """End the process; what it was given is not asked for any more."""
        self._process.end()

    def _where(self, b: int, step: int) -> str:
        permutation = ",".join(str(k) for k in self._problem.permutation[b])
        name = self._problem.maps[self._problem.map_of[b]].name
        return f"{self._path}: {FUNCTION} in step {step} of map {name}, permutation {permutation}"


def check_file(path: Path) -> None:
    """Raise InputFileError unless a file can be a controller; it is run, in a process of its own."""
    _Process(path, None).end()


class _Process:
    """The process that runs a file, and its two pipes."""

    def __init__(self, path: Path, of: Problem | None) -> None:
        compiled(path)  # what is no file, or no Python, needs no process
        self._read = b""
        asked, self._ask = os.pipe()
        self._answers, answers = os.pipe()
        start = f"import sys; sys.path[:] = {sys.path!r}; from swarmscope.disk.host import serve; "
        start += f"serve({asked}, {answers})"
        self._popen = subprocess.Popen(
            [sys.executable, "-c", start], pass_fds=(asked, answers), stdin=subprocess.DEVNULL
        )
        os.close(asked)
        os.close(answers)
        self.end = weakref.finalize(self, _end, self._popen, self._ask, self._answers)
        self._shape = (0, 2) if of is None else (of.rules.n, 2)
        try:
            self._send(json.dumps(_about(path, of)).encode() + b"\n")
            kind = self._receive(1, LOAD_S, "loading it")
            why = "" if kind == host.READY else self._words(LOAD_S)
        except _EndedError as end:
            why = str(end)
        if why:
            self.end()
            raise InputFileError(path, why)

    def velocities(self, run: int, state: Floats, seconds: float) -> Floats:
        """Return the answer (n, 2) to a call."""
        self._send(host.CALL.pack(run) + np.ascontiguousarray(state, np.float64).tobytes())
        what = "a call"
        kind = self._receive(1, seconds, what)
        if kind != host.ANSWER:
            raise _EndedError(self._words(seconds) if kind == host.WRONG else "its answer is none")
        found = np.frombuffer(self._receive(16 * self._shape[0], seconds, what), np.float64).reshape(self._shape)
        if not (np.abs(found) <= host.HUGE).all():
            raise _EndedError("its answer holds numbers that are not finite")
        return found

    def _words(self, seconds: float) -> str:
        (size,) = host.LENGTH.unpack(self._receive(host.LENGTH.size, seconds, "an answer"))
        text = self._receive(min(size, host.MOST_WORDS), seconds, "an answer").decode("utf-8", "replace")
        return "".join(c if c.isprintable() else " " for c in text) or "it failed without a word"

    def _send(self, data: bytes) -> None:
        with suppress(BrokenPipeError):  # reading what it says tells why
            while data:
                data = data[os.write(self._ask, data) :]

    def _receive(self, size: int, seconds: float, what: str) -> bytes:
        """Return so many bytes. Errors: _EndedError after ``seconds``, or at the end of the process."""
        until = time.monotonic() + seconds
        while len(self._read) < size:
            ready, _, _ = select.select([self._answers], [], [], max(0.0, until - time.monotonic()))
            if not ready:
                raise _EndedError(f"{what} takes longer than {seconds:g} s (--call-limit)")
            part = os.read(self._answers, AT_ONCE)
            if not part:
                raise _EndedError(self._gone())
            self._read += part
        found, self._read = self._read[:size], self._read[size:]
        return found

    def _gone(self) -> str:
        """Say how the process ended."""
        try:
            code = self._popen.wait(1.0)
        except subprocess.TimeoutExpired:
            return "it closed its pipe to the harness"
        return f"it ended its process ({f'exit code {code}' if code >= 0 else f'signal {-code}'})"


def _about(path: Path, of: Problem | None) -> dict[str, Any]:
    """Return what the process has to know."""
    if of is None:
        return {"file": str(path), "runs": [], "robots": 0, "radius": 0.0}
    runs = [
        {"goals": of.goal[b].tolist(), "obstacles": of.maps[which].obstacles.tolist()}
        for b, which in enumerate(of.map_of.tolist())
    ]
    return {"file": str(path), "runs": runs, "robots": of.rules.n, "radius": of.rules.r}


def _end(popen: subprocess.Popen[bytes], *pipes: int) -> None:
    """Kill a process and close the pipes to it."""
    popen.kill()
    popen.wait()
    for pipe in pipes:
        os.close(pipe)


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
