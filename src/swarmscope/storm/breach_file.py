"""The file that a breach is written to, and how it is read back."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from swarmscope.errors import ConfigError
from swarmscope.scenarios.overrides import PLACES
from swarmscope.scenarios.read import parse_scenario
from swarmscope.storm.draw import Case
from swarmscope.storm.forger import KINDS, Forger
from swarmscope.storm.watch import Breach
from swarmscope.texts import read_yaml

FIELDS = ("seed", "per_tick", "kinds")


def as_text(case: Case, breach: Breach, drawn_as: str) -> str:
    """Return a breach as YAML: a scenario that ``swarmscope run`` takes, or with an adversary one inside a storm."""
    said = f"# {breach.kind} in tick {breach.tick}: {breach.text}\n# Drawn as {drawn_as} (seed:number)\n"
    if case.forger is None:
        head = "# Replay: swarmscope run FILE, or swarmscope storm --replay FILE\n"
        return head + said + _dump(case.values)
    head = "# Replay: swarmscope storm --replay FILE (packets of an adversary are part of it)\n"
    return head + said + _dump({"adversary": case.forger.as_dict(), "scenario": case.values})


def read_case(file: Path) -> Case:
    """Return the run in a file. Errors: InputFileError, ConfigError, those of scenarios."""
    values = read_yaml(file)
    if not isinstance(values, dict):
        raise ConfigError(str(file), "a run is a mapping of keys to values")
    forger = None
    if "adversary" in values or not any(place in values for place in PLACES):
        for key in values:
            if key not in ("adversary", "scenario"):
                raise ConfigError(f"{file}: {key}", "unknown key (valid: adversary, scenario)")
        forger = _forger(values.get("adversary"), f"{file}: adversary")
        values = values.get("scenario", {})
    parse_scenario(values, str(file))
    return Case(values, forger)


def _forger(values: Any, where: str) -> Forger | None:
    if values is None:
        return None
    if not isinstance(values, dict) or set(values) != set(FIELDS):
        raise ConfigError(where, f"needs the keys {', '.join(FIELDS)} and no others")
    seed, per_tick, kinds = (values[name] for name in FIELDS)
    if isinstance(seed, bool) or not isinstance(seed, int) or seed < 0:
        raise ConfigError(f"{where}.seed", f"must be a whole number >= 0, not {seed!r}")
    if isinstance(per_tick, bool) or not isinstance(per_tick, int | float) or not 0.0 <= per_tick <= 1000.0:
        raise ConfigError(f"{where}.per_tick", f"must be a number from 0 to 1000, not {per_tick!r}")
    if not isinstance(kinds, list) or not kinds or not set(map(str, kinds)) <= set(KINDS):
        raise ConfigError(f"{where}.kinds", f"must be a list of some of {', '.join(KINDS)}")
    return Forger(seed, float(per_tick), tuple(kinds))


def _dump(values: Mapping[str, Any]) -> str:
    text: str = yaml.safe_dump(dict(values), sort_keys=False, default_flow_style=None, width=120)
    return text
