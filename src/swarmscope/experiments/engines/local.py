"""Processes on this machine. A worker that dies takes nothing along: what it was at is run again by another."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool

from swarmscope.experiments.engines._retry import Attempt, lost
from swarmscope.experiments.work import work

AHEAD = 2
"""Jobs that are handed out for each worker: one to run, one to go on with."""


class Local:
    """Runs jobs in ``workers`` processes, by default one for each core; ``run`` is what it does with a job."""

    def __init__(self, workers: int | None = None, run: Callable[[str], str] = work) -> None:
        self.workers = workers or len(os.sched_getaffinity(0))
        self.run = run

    def answers(self, jobs: Iterator[str]) -> Iterator[str]:
        """Run the jobs and return their answers."""
        pool = self._pool()
        again: deque[Attempt] = deque()
        under_way: dict[Future[str], Attempt] = {}
        try:
            while True:
                while len(under_way) < AHEAD * self.workers:
                    attempt = again.popleft() if again else Attempt.first(next(jobs, None))
                    if attempt is None:
                        break
                    try:
                        under_way[pool.submit(self.run, attempt.job)] = attempt
                    except BrokenProcessPool:
                        again.append(attempt)
                        break
                if not under_way and not again:
                    return
                broken = not under_way
                for future in wait(under_way, return_when=FIRST_COMPLETED).done if under_way else ():
                    attempt = under_way.pop(future)
                    try:
                        yield future.result()
                    except BrokenProcessPool:
                        broken = True
                        yield from lost(attempt, again, "the worker process died")
                if broken:
                    for attempt in under_way.values():  # they all share the fate of the pool
                        again.append(attempt)
                    under_way.clear()
                    pool.shutdown(wait=False, cancel_futures=True)
                    pool = self._pool()
        finally:
            pool.shutdown(wait=False, cancel_futures=True)

    def _pool(self) -> ProcessPoolExecutor:
        return ProcessPoolExecutor(self.workers, multiprocessing.get_context("spawn"), initializer=start_worker)


def start_worker() -> None:
    """Leave Ctrl-C to the parent, and do not outlive it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_follow_parent, daemon=True).start()


def _follow_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
