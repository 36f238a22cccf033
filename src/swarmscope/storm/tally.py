"""What many runs of storms add up to, and the file in which they do."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from swarmscope.errors import InputFileError
from swarmscope.judging.statistics import poisson_upper
from swarmscope.texts import read_text

FORMAT = 1
HOUR = 3600.0
MOST_BYTES = 1 << 30
NUMBERS = ("number", "robots", "under_way_s", "driving_s", "arrived", "wall_s", "thrown")
"""What is kept of every run, beside its planner, place, reasons, refused draws and breach."""
KEPT = (*NUMBERS, "planner", "where", "again", "reasons", "refused", "breach")

Row = dict[str, Any]


class Piece(NamedTuple):
    """Within a piece a number stands for one run."""

    code: str
    planners: str
    covered: bool
    seed: int



class Sum(NamedTuple):
    """What runs add up to."""

    runs: int
    robots: int
    arrived: int
    under_way_h: float
    """Hours of all robots while they were under way: the T of the bound."""
    driving_h: float
    contacts: int
    breaches: int
    """Contacts included."""
    bound_per_h: float
    """Contacts in an hour of a robot under way: the rate is lower, at 95 %."""
    repeated: int
    reasons: dict[str, int]
    refused: dict[str, int]
    slowest: Row | None


class Tally:
    """Runs of any pieces, each once."""

    def __init__(self) -> None:
        self.pieces: dict[Piece, dict[int, Row]] = {}
        self.revisions: dict[str, str] = {}

    def add(self, piece: Piece, revision: str, row: Mapping[str, Any]) -> bool:
        """Add a run; return whether it was not there yet."""
        rows = self.pieces.setdefault(piece, {})
        self.revisions[piece.code] = revision
        if row["number"] in rows:
            return False
        rows[row["number"]] = {key: row[key] for key in KEPT if key in row}
        return True

    def merge(self, other: Tally) -> None:
        """Add all runs of another one."""
        for piece, rows in other.pieces.items():
            for row in rows.values():
                self.add(piece, other.revisions[piece.code], row)

    def rows(self) -> list[Row]:
        """Return all runs."""
        return [row for rows in self.pieces.values() for row in rows.values()]

    def numbers(self, piece: Piece) -> set[int]:
        """Return which runs of a piece are there."""
        return set(self.pieces.get(piece, {}))

    def as_text(self) -> str:
        """Return it as JSON, a run on each line; the same runs give the same text."""
        pieces = []
        for piece, rows in sorted(self.pieces.items()):
            about = {"revision": self.revisions[piece.code]} | piece._asdict()
            lines = ",\n".join(json.dumps(rows[number], sort_keys=True) for number in sorted(rows))
            pieces.append(json.dumps(about)[:-1] + f', "runs": [\n{lines}\n]}}')
        return f'{{"storms": {FORMAT}, "pieces": [\n' + ",\n".join(pieces) + "\n]}\n"


def read_tally(file: Path) -> Tally:
    """Return what a file holds, nothing where there is none yet. Errors: InputFileError."""
    found = Tally()
    try:
        if not file.exists():
            return found
        values = json.loads(read_text(file, MOST_BYTES))
        if values["storms"] != FORMAT:
            raise InputFileError(file, f"is of format {values['storms']!r}, not {FORMAT}")
        for piece in values["pieces"]:
            kinds = zip(Piece._fields, (str, str, bool, int), strict=True)
            key = Piece(**{name: kind(piece[name]) for name, kind in kinds})
            for row in piece["runs"]:
                _check(row)
                found.add(key, str(piece["revision"]), row)
    except OSError as error:
        raise InputFileError(file, error.strerror or "cannot be read") from None
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        what = f"{type(error).__name__}: {error}"
        raise InputFileError(file, f"is torn, or not a storm's file; nothing was changed ({what[:120]})") from None
    return found


def _check(row: Mapping[str, Any]) -> None:
    """Raise an error unless a run has all that is added up."""
    if "robots" in row:
        missing = [name for name in KEPT if name not in row]
        if missing:
            raise KeyError(missing[0])
        for name in NUMBERS:
            float(row[name])
    for counts in (row.get("reasons", {}), row["refused"]):
        sum(counts.values())
    int(row["number"])


def add_up(rows: Iterable[Row]) -> Sum:
    """Return what runs add up to; a number without a possible draw counts only with what was refused."""
    every = list(rows)
    runs = [row for row in every if "robots" in row]
    breaches = [row["breach"] for row in runs if row["breach"] is not None]
    contacts = sum(breach["kind"] == "contact" for breach in breaches)
    hours = sum(float(row["under_way_s"]) for row in runs) / HOUR
    return Sum(
        runs=len(runs),
        robots=sum(row["robots"] for row in runs),
        arrived=sum(row["arrived"] for row in runs),
        under_way_h=hours,
        driving_h=sum(float(row["driving_s"]) for row in runs) / HOUR,
        contacts=contacts,
        breaches=len(breaches),
        bound_per_h=poisson_upper(contacts) / hours if hours > 0.0 else float("inf"),
        repeated=sum(bool(row["again"]) for row in runs),
        reasons=_counted(row["reasons"] for row in runs),
        refused=_counted(row["refused"] for row in every),
        slowest=max(runs, key=lambda row: float(row["wall_s"]), default=None),
    )


def _counted(parts: Iterable[Mapping[str, int]]) -> dict[str, int]:
    """Return the sums of counts, the largest first."""
    found: dict[str, int] = {}
    for part in parts:
        for key, count in part.items():
            found[key] = found.get(key, 0) + count
    return dict(sorted(found.items(), key=lambda item: (-item[1], item[0])))
