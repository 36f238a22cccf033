"""A scenario written out as YAML: every default, and behind each key what it means."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import yaml

from swarmscope.scenarios.keys import Key, meanings, planner_keys, task_keys
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import complete

INDENT = "  "


def written_out(scenario: Scenario) -> str:
    """Return the complete scenario as YAML with comments; it reads back as the same scenario."""
    values, texts = complete(scenario), meanings()
    if scenario.task is not None:
        texts |= _texts(task_keys(scenario.task.name))
    texts |= _texts(planner_keys(scenario.planner.name))
    head = "# A complete scenario; what you leave out has its default. Run it: swarmscope run FILE\n"
    return head + "\n".join(_lines(values, texts, "", 0)) + "\n"


def _lines(values: Mapping[str, Any], texts: Mapping[str, str], prefix: str, depth: int) -> Iterator[str]:
    for name, value in values.items():
        text = texts.get(prefix + name, "").replace("``", "")
        comment = f"  # {text}" if text else ""
        if isinstance(value, Mapping) and value:
            yield f"{INDENT * depth}{name}:{comment}"
            yield from _lines(value, texts, f"{prefix}{name}.", depth + 1)
        else:
            yield f"{INDENT * depth}{name}: {_flow(value)}{comment}"


def _flow(value: Any) -> str:
    """Return a value on one line."""
    text: str = yaml.safe_dump(value, default_flow_style=True, allow_unicode=True, width=10**6)
    return text.removesuffix("...\n").strip()


def _texts(keys: list[Key]) -> dict[str, str]:
    return {key.name: f"{key.meaning} [{key.unit}]" if key.unit else key.meaning for key in keys}
