"""The published sets of seeds (``data/seeds.yaml``), and lists of seeds written by hand."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import NamedTuple

from swarmscope.errors import ConfigError, InputFileError, UnknownNameError
from swarmscope.texts import read_yaml

SEED_FILE = Path(__file__).parent.parent / "data" / "seeds.yaml"
VERSION = 1
LARGEST = 2**31 - 1  # a scenario's seed
MOST = 100_000  # seeds of one list: more are taken for a slip

_RANGE = re.compile(r"([0-9]+)(?:\s*-\s*([0-9]+))?")


class SeedSet(NamedTuple):
    """One named set."""

    seeds: list[int]
    purpose: str


def seed_set(name_or_range: str) -> list[int]:
    """Return the seeds of a set's name, a range ``first-last`` (both included), a seed, or several of these
    with commas between.

    They come in the order written; what is named twice comes once.
    """
    named = seed_sets()
    seeds: list[int] = []
    for part in name_or_range.split(","):
        seeds += _part(part.strip(), name_or_range, named)
    return list(dict.fromkeys(seeds))


@cache
def seed_sets() -> dict[str, SeedSet]:
    """Return every published set by its name."""
    return read_seed_file(SEED_FILE)


def read_seed_file(path: Path) -> dict[str, SeedSet]:
    """Return the sets of a seed file."""
    try:
        values = read_yaml(path)
        version, sets = values["version"], values["sets"]
        found = {name: SeedSet(_run(str(one["seeds"]), path), one["purpose"]) for name, one in sets.items()}
    except (ValueError, KeyError, TypeError, AttributeError):
        raise InputFileError(path, "is not a file of seeds: version, sets (name: seeds, purpose)") from None
    if version != VERSION:
        raise InputFileError(path, f"has version {version!r}, this program reads version {VERSION}")
    return found


def _part(part: str, whole: str, named: dict[str, SeedSet]) -> list[int]:
    if part in named:
        return named[part].seeds
    if not part:
        raise ConfigError("seeds", f"nothing between two commas or at an end of '{whole}'")
    if part[0].isdigit() or part[0] in "+-.":
        return _run(part, "seeds")
    raise UnknownNameError("set of seeds", part, named)


def _run(text: str, where: object) -> list[int]:
    """Return the seeds of ``first-last`` or of one number."""
    match = _RANGE.fullmatch(text)
    if match is None:
        raise ConfigError(str(where), f"'{text}' is not a seed, nor a range like 0-19")
    first, last = int(match[1]), int(match[2] or match[1])
    if last < first:
        raise ConfigError(str(where), f"'{text}' ends before it begins")
    if last > LARGEST:
        raise ConfigError(str(where), f"'{text}': the largest seed is {LARGEST}")
    if last - first >= MOST:
        raise ConfigError(str(where), f"'{text}' has more than {MOST} seeds")
    return list(range(first, last + 1))
