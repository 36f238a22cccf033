"""What runs code of a user says so, and can be told not to."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from pathlib import Path

from swarmscope.errors import ConfigError
from swarmscope.scenarios.read import user_files_of
from swarmscope.scenarios.scenario import Scenario


def files_of(scenarios: Iterable[Scenario]) -> list[Path]:
    """Return the files with code of users in some scenarios, each once."""
    return sorted({file for scenario in scenarios for file in user_files_of(scenario).values()})


def refuse_code(files: list[Path]) -> None:
    """Raise a ConfigError if there is a user's file among what would be run."""
    if files:
        raise ConfigError("--no-code", f"{files[0]} is a user's file, whose code is not run")


def announce(files: list[Path]) -> None:
    """Say which files with code of users are run."""
    for file in files:
        print(f"runs the code in {file}", file=sys.stderr)


def allow_code(scenarios: Iterable[Scenario], code: bool) -> None:
    """Say which files with code of users will be run for some scenarios; refuse them unless ``code``."""
    files = files_of(scenarios)
    if not code:
        refuse_code(files)
    announce(files)
