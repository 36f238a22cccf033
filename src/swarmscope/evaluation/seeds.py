"""Seeds."""

from __future__ import annotations

SETS = {"evaluation": range(100), "tuning": range(1000, 1060), "playground": range(2000, 2009)}


def seed_set(text: str) -> list[int]:
    """Return the seeds of a set or of 'first-last'."""
    if text in SETS:
        return list(SETS[text])
    first, _, last = text.partition("-")
    return list(range(int(first), int(last or first) + 1))
