"""Where units are run: in this process, in processes on this machine, or on a Ray cluster; the results are the same.

An engine turns an iterator of jobs (text, see ``work.py``) into an iterator of answers, in whatever order they come.
It takes a job from the iterator only when somebody is about to be free for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

from swarmscope.errors import ConfigError, UnknownNameError

ENGINES = ("in-process", "local", "ray")


class Engine(Protocol):
    """What runs units."""

    def answers(self, jobs: Iterator[str]) -> Iterator[str]:
        """Run the jobs and return their answers."""
        ...


def make_engine(name: str, workers: int | None = None, address: str | None = None) -> Engine:
    """Return the engine ``name``; raises MissingExtraError for ray when it is not installed."""
    if name not in ENGINES:
        raise UnknownNameError("engine", name, ENGINES)
    if address is not None and name != "ray":
        raise ConfigError("--address", "is for --engine ray only")
    if workers is not None and workers < 1:
        raise ConfigError("--workers", f"must be at least 1, not {workers}")
    if name == "in-process":
        from swarmscope.experiments.engines.in_process import InProcess

        return InProcess()
    if name == "local":
        from swarmscope.experiments.engines.local import Local

        return Local(workers)
    from swarmscope.experiments.engines.on_ray import OnRay

    return OnRay(address, workers)
