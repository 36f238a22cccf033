"""Ray: the cores of many machines. A machine that vanishes takes nothing along: its jobs are run by others.

Jobs and answers are JSON text; Ray moves them, and our function, in its own way between machines of one cluster that
trust each other. The machines need the same version of swarmscope (``work`` refuses another one).
"""

from __future__ import annotations

import os
import socket
from collections import deque
from collections.abc import Iterator
from typing import Any

from swarmscope.errors import MissingExtraError, SwarmscopeError
from swarmscope.experiments.engines._retry import Attempt, lost
from swarmscope.experiments.work import work
from swarmscope.judging.provenance import PACKAGE

AHEAD = 2
"""Jobs that are handed out for each core of the cluster."""
REACH_S = 5.0
"""How long the head of a cluster may take to answer."""
POLL_S = 5.0
"""How often the size of the cluster is looked at, which may grow and shrink."""


class OnRay:
    """Runs jobs on the cluster at ``address``, or on one that it starts on this machine."""

    def __init__(self, address: str | None = None, workers: int | None = None) -> None:
        self.ray = _load_ray()
        self.address, self.workers = address, workers

    def answers(self, jobs: Iterator[str]) -> Iterator[str]:
        """Run the jobs and return their answers."""
        ray = self.ray
        mine = not ray.is_initialized()
        if mine:
            self._connect()
        # Our own retries (``lost``) tell a vanished machine from a job that kills its worker; Ray's cannot.
        task = ray.remote(num_cpus=1, max_retries=0)(work)
        again: deque[Attempt] = deque()
        under_way: dict[Any, Attempt] = {}
        try:
            while True:
                while len(under_way) < AHEAD * self._cores():
                    attempt = again.popleft() if again else Attempt.first(next(jobs, None))
                    if attempt is None:
                        break
                    under_way[task.remote(attempt.job)] = attempt
                if not under_way:
                    return
                done, _ = ray.wait(list(under_way), num_returns=1, timeout=POLL_S)
                for reference in done:
                    attempt = under_way.pop(reference)
                    try:
                        yield ray.get(reference)
                    except (ray.exceptions.RayError, ray.exceptions.RayTaskError) as error:
                        yield from lost(attempt, again, f"its worker was lost ({type(error).__name__})")
        finally:
            for reference in under_way:
                ray.cancel(reference, force=True)
            if mine:
                ray.shutdown()

    def _cores(self) -> int:
        cores = max(1, int(self.ray.cluster_resources().get("CPU", 1)))
        return min(cores, self.workers) if self.workers else cores

    def _connect(self) -> None:
        """Join the cluster, or start one here; quietly."""
        os.environ.setdefault("RAY_ACCEL_ENV_VAR_OVERRIDE_ON_ZERO", "0")
        options: dict[str, Any] = {"log_to_driver": False, "logging_level": "ERROR", "include_dashboard": False}
        _check_reachable(self.address)
        if self.address is None:
            options["num_cpus"] = self.workers
        else:
            options = {"address": self.address} | {k: v for k, v in options.items() if k != "include_dashboard"}
        path = os.pathsep.join(filter(None, [str(PACKAGE.parent), os.environ.get("PYTHONPATH", "")]))
        keep = {k: v for k, v in os.environ.items() if k in ("SWARMSCOPE_CACHE", "NUMBA_CACHE_DIR")}
        if self.address is None:
            options["runtime_env"] = {"env_vars": {"PYTHONPATH": path} | keep}
        try:
            self.ray.init(**options)
        except (ConnectionError, RuntimeError, ValueError, OSError) as error:
            where = self.address or "this machine"
            raise SwarmscopeError(f"no Ray cluster at {where}: {' '.join(str(error).split())[:300]}") from error


def _check_reachable(address: str | None) -> None:
    """Raise a SwarmscopeError at once when nobody listens at ``host:port``; Ray would wait for minutes."""
    host, colon, port = (address or "").removeprefix("ray://").rpartition(":")
    if not colon or not port.isdigit():
        return  # none, or 'auto'
    try:
        socket.create_connection((host, int(port)), REACH_S).close()
    except (OSError, OverflowError) as error:
        raise SwarmscopeError(f"no Ray cluster at {address}: {error}") from None


def _load_ray() -> Any:
    try:
        import ray
    except ImportError:
        raise MissingExtraError("the engine 'ray'", "ray") from None
    return ray
