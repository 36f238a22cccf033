"""What a run is called, and its folder, so that no other run is written over it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from swarmscope.judging.run import place_name
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import complete
from swarmscope.user_files import short_name

DIGITS = 6


def headline(about: Mapping[str, Any], robots: int) -> str:
    """Return what was run in one line, such as ``T1 · nav-scope · 15 robots · seed 0``."""
    parts = [str(about[key]) for key in ("task", "planner") if about.get(key) is not None]
    if about.get("preset") is not None:
        parts[-1] += f" ({about['preset']})"
    parts.append(f"{robots} robot{'' if robots == 1 else 's'}")
    if about.get("seed") is not None:
        parts.append(f"seed {about['seed']}")
    return " · ".join(parts)


def usual_folder(scenario: Scenario) -> Path:
    """Return ``runs/<place>-<planner>-<seed>``, with a short hash of all other keys that are not the defaults."""
    planner = "-".join(filter(None, (short_name(scenario.planner.name), scenario.planner.preset)))
    name = f"{place_name(scenario)}-{planner}-{scenario.seed}"
    others = other_than_default(scenario)
    if others:
        text = json.dumps(others, sort_keys=True)
        name += f"-{hashlib.sha256(text.encode()).hexdigest()[:DIGITS]}"
    return Path("runs") / name


def other_than_default(scenario: Scenario) -> dict[str, Any]:
    """Return the keys whose values are not those of a scenario that names place, planner and preset only."""
    given = complete(scenario, run_files=False)
    chosen = scenario.planner.model_dump(include={"name", "preset"}, exclude_none=True)
    plain: dict[str, Any] = {"planner": chosen, "seed": scenario.seed}
    if scenario.task is not None:
        plain["task"] = {"name": scenario.task.name}
    elif scenario.map is not None:
        plain["map"] = {"file": scenario.map.file}
    else:
        plain |= {"place": given["place"], "robots": scenario.robots}
    usual = dict(_flat(complete(parse_scenario(plain, "defaults"), run_files=False)))
    others = {key: value for key, value in _flat(given) if key not in usual or usual[key] != value}
    if scenario.place is not None:
        others["place"] = given["place"]  # two places have the same name
    return others


def _flat(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in values.items():
        if isinstance(value, Mapping) and value:
            yield from _flat(value, f"{before}{key}.")
        else:
            yield before + key, value
