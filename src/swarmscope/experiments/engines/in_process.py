"""One unit after the other in this process: for debugging, and where processes cannot be started."""

from __future__ import annotations

from collections.abc import Iterator

from swarmscope.experiments.work import work


class InProcess:
    """Runs jobs right here."""

    def answers(self, jobs: Iterator[str]) -> Iterator[str]:
        """Run the jobs and return their answers."""
        return map(work, jobs)
