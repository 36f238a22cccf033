"""``swarmscope config``."""

from __future__ import annotations

import json

from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.written import written_out


def config_command(task: str, planner: str | None, schema: bool, preset: str | None = None) -> None:
    """Print a complete scenario, or what a scenario may hold."""
    if schema:
        print(json.dumps(Scenario.model_json_schema(), indent=1, ensure_ascii=False))
        return
    chosen = {key: value for key, value in (("name", planner), ("preset", preset)) if value is not None}
    values = {"task": {"name": task}, "planner": chosen}
    print(written_out(parse_scenario(values, "command line")), end="")
