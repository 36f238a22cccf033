"""Jobs whose worker vanished are run again, but not for ever."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

MOST_TRIES = 5


class Attempt(NamedTuple):
    """A job and how often it has been tried."""

    job: str
    tries: int

    @classmethod
    def first(cls, job: str | None) -> Attempt | None:
        """Return the first attempt at ``job``, None without a job."""
        return None if job is None else cls(job, 1)


def lost(attempt: Attempt, again: deque[Attempt], why: str) -> Iterator[str]:
    """Queue the attempt for another try; after the last one return an answer that says what happened."""
    if attempt.tries < MOST_TRIES:
        again.append(Attempt(attempt.job, attempt.tries + 1))
        return
    asked = json.loads(attempt.job)
    yield json.dumps(
        {"key": asked["key"], "world": asked["world"], "error": f"{why}, {attempt.tries} times in a row"}
    )
