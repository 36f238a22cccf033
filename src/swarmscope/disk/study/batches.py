"""Runs of the unit disk in several processes; results do not depend on their number."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from swarmscope.disk import controllers
from swarmscope.disk.runs import Controller, Film, Outcome, Problem, no_outcome, play
from swarmscope.disk.user import CALL_S, UserController, check_file
from swarmscope.errors import ConfigError, SwarmscopeError
from swarmscope.experiments.engines.local import start_worker

Report = Callable[[int, float, float], None]
"""Called with the number of runs done, and for a user's controller the seconds of a call and those left (else 0)."""
RUNS_IN_A_BATCH = 20
"""So many runs of ours share the loop over steps; a user's are played one by one."""


@dataclass(frozen=True)
class Choice:
    """A controller as a user names it: one of ours with changed numbers, or a Python file."""

    name: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    call_s: float = CALL_S
    """How long a call of a user's file may take."""

    @property
    def file(self) -> Path | None:
        """The user's file, or None."""
        return Path(self.name) if self.name.endswith(".py") else None

    @property
    def label(self) -> str:
        """What tables call it."""
        name = self.file.stem if self.file else self.name
        return " ".join([name, *(f"{key}={value}" for key, value in self.changes.items())])

    def check(self) -> None:
        """Raise what ``make`` would raise for any runs."""
        if self.file:
            if self.changes:
                raise ConfigError(self.name, "has no parameters to set; edit the file")
            check_file(self.file)
        else:
            controllers.find(self.name, self.changes)

    def kind(self) -> controllers.Kind:
        """Return it as one that can be made for any runs."""
        if not self.file:
            return controllers.find(self.name, self.changes)
        about = "of the user"
        return controllers.Kind(self.label, about, about, about, (), lambda of, _: self.make(of))

    def make(self, of: Problem) -> Controller:
        """Return the controller for some runs."""
        if self.file:
            return UserController(self.file, of, self.call_s)
        kind = controllers.find(self.name, self.changes)
        return kind.create(of, kind.params)


class Result(NamedTuple):
    """Outcome of some runs, and what a call of a user's controller took."""

    outcome: Outcome
    calls: int
    seconds: float


def read_choice(text: str, call_s: float = CALL_S) -> Choice:
    """Return the choice written as 'report', 'report:obstacle_buffer=0.005,robot_buffer=0.03' or 'mine.py'."""
    name, _, rest = text.partition(":")
    changes = {}
    for part in filter(None, rest.split(",")):
        key, equals, value = part.partition("=")
        if not equals:
            raise ConfigError(text, f"'{part}' is not KEY=VALUE")
        changes[key.strip()] = value.strip()
    choice = Choice(name, changes, call_s)
    choice.check()
    return choice


def play_batch(choice: Choice, of: Problem, film: Film | None = None) -> Result:
    """Play some runs here."""
    controller = choice.make(of)
    if not isinstance(controller, UserController):
        return Result(play(of, controller, film), 0, 0.0)
    try:
        return Result(play(of, controller, film), controller.calls, controller.seconds)
    finally:
        controller.close()


def play_all(
    choice: Choice,
    of: Problem,
    workers: int | None = None,
    progress: Report | None = None,
) -> Result:
    """Play all runs in ``workers`` processes (one for each core if None)."""
    runs = len(of.map_of)
    size = 1 if choice.file else RUNS_IN_A_BATCH
    parts = [slice(k, min(k + size, runs)) for k in range(0, runs, size)]
    workers = min(workers or len(os.sched_getaffinity(0)), len(parts))
    whole = no_outcome(runs, of.rules.n)
    calls, seconds, done = 0, 0.0, 0

    def take(part: slice, result: Result) -> None:
        nonlocal calls, seconds, done
        for kept, new in zip(whole, result.outcome, strict=True):
            kept[part] = new
        calls, seconds, done = calls + result.calls, seconds + result.seconds, done + part.stop - part.start
        if progress is not None:
            left = seconds / done * (runs - done) / workers
            progress(done, seconds / calls if calls else 0.0, left)

    if workers == 1:
        for part in parts:
            take(part, play_batch(choice, of.part(part)))
        return Result(whole, calls, seconds)
    others, finished = set(multiprocessing.active_children()), False
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=start_worker)
    try:
        pending = {pool.submit(play_batch, choice, of.part(part)): part for part in parts}
        for future in as_completed(pending):
            take(pending[future], future.result())
        finished = True
    except BrokenProcessPool:
        raise SwarmscopeError(f"{choice.label}: a worker process died (out of memory?); try --workers 1") from None
    finally:
        workers_of_ours = set(multiprocessing.active_children()) - others
        pool.shutdown(wait=False, cancel_futures=True)
        if not finished:
            # A run of a user's controller may take minutes, or never end: nobody waits for those under way.
            for worker in workers_of_ours:
                worker.terminate()
    return Result(whole, calls, seconds)
