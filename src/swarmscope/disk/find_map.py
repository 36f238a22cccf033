"""Maps of the unit disk by what users call them: a name, 'random:SEED' or a file."""

from __future__ import annotations

from pathlib import Path

from swarmscope.disk.maps import NAMED, DiskMap, read_map
from swarmscope.disk.random_maps import random_map
from swarmscope.disk.rules import Rules
from swarmscope.errors import ConfigError, UnknownNameError


def find_map(name: str, rules: Rules) -> DiskMap:
    """Return the map of that name, 'random:SEED' for robots of these rules, or the one in that YAML file.

    Errors: UnknownNameError, InputFileError, ConfigError.
    """
    if name in NAMED:
        return NAMED[name]
    if name.startswith("random:"):
        return random_map(seed_of(name), rules).map
    if Path(name).suffix in {".yaml", ".yml", ".json"}:
        return read_map(Path(name))
    raise UnknownNameError("map", name, [*NAMED, "random:SEED", "FILE.yaml"])


def seed_of(name: str) -> int:
    """Return the seed in 'random:SEED'."""
    text = name.partition(":")[2]
    if not text.isdecimal():
        raise ConfigError(name, "the seed of a random map is a whole number, as in random:7")
    return int(text)
