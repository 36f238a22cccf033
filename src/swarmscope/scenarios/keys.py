"""Every key of a scenario: what it takes, default, unit, meaning; read off the models, tasks and planners."""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import is_dataclass
from typing import Any, NamedTuple, get_args

from swarmscope.bounds import Field, about
from swarmscope.onboard.planners import load_planner
from swarmscope.scenarios.scenario import RobotModel, RobotOfMany, Scenario
from swarmscope.sim.world import WorldSpec
from swarmscope.tasks import load_task
from swarmscope.tasks._contract import option_fields

UNITS = {
    "mps2": "m/s²", "radps": "rad/s", "mps": "m/s", "bps": "bit/s", "m": "m", "s": "s", "deg": "°", "rad": "rad",
    "hz": "Hz",
}  # fmt: skip
"""Units by the ends of names."""
BRACKETS = re.compile(r"\s*\[((?:1/)?(?:m|s|h|rad|°|Hz|bit/s|bytes)[^\]]*)\]")
MUST = "must be given"
KINDS = {"number": "number", "integer": "whole number", "boolean": "true or false", "string": "text", "array": "list"}
LIMITS = {"exclusiveMinimum": ">", "minimum": "≥", "exclusiveMaximum": "<", "maximum": "≤"}


class Key(NamedTuple):
    """One thing that can be set."""

    name: str
    """With all groups: ``robot.radius_m``."""
    takes: str
    """Type and bounds."""
    default: Any
    """``MUST`` where there is none."""
    unit: str
    meaning: str


def scenario_keys() -> list[Key]:
    """Return every key of a scenario in the order of the models; groups are no keys."""
    schema = Scenario.model_json_schema()
    return list(_keys(schema, schema["$defs"], ""))


def robot_keys() -> list[Key]:
    """Return the keys of one robot's data sheet in a list of them that a data sheet for all has not."""
    schema = RobotOfMany.model_json_schema()
    return [key for key in _keys(schema, {}, "robot.N.") if key.name.rpartition(".")[2] not in RobotModel.model_fields]


def obstacle_keys() -> dict[str, list[Key]]:
    """Return the keys of each type of obstacle."""
    groups = WorldSpec.model_json_schema()["$defs"]
    kinds = {field["properties"]["type"]["const"]: field for field in groups.values()}
    return {kind: [key for key in _keys(kinds[kind], groups, "") if key.name != "type"] for kind in sorted(kinds)}


def meanings() -> dict[str, str]:
    """Return the text of every key and every group by its full name."""
    return dict(_texts(Scenario.model_fields, ""))


def task_keys(name: str) -> list[Key]:
    """Return the options of a task."""
    task = load_task(name)
    docs: dict[str, str] = {}
    for kind in vars(task).values():
        if isinstance(kind, type) and is_dataclass(kind):
            docs |= docs_of(kind)
    return [_member_key("task.options", field, docs) for field in option_fields(task).values()]


def planner_keys(name: str) -> list[Key]:
    """Return the parameters of a planner."""
    planner = load_planner(name)
    docs = docs_of(planner.params_type)
    return [_member_key("planner.params", field, docs) for field in planner.fields.values()]


def docs_of(kind: type) -> dict[str, str]:
    """Return the text of each field of a class and of its bases: what stands after it, or behind it as a comment."""
    docs: dict[str, str] = {}
    for base in reversed(kind.__mro__):
        module = sys.modules.get(base.__module__)
        if module is not None and getattr(module, "__file__", None) and base.__module__ != "typing":
            docs |= _docs_in(inspect.getsource(module), base.__qualname__)
    return docs


def _docs_in(source: str, name: str) -> dict[str, str]:
    """Return the texts of the fields of class ``name`` in the source of its module."""
    lines, docs = source.splitlines(), {}
    found = [node for node in ast.parse(source).body if isinstance(node, ast.ClassDef) and node.name == name]
    for node in found:
        for field, after in zip(node.body, [*node.body[1:], None], strict=True):
            if not (isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)):
                continue
            behind = lines[(field.end_lineno or field.lineno) - 1].partition("  # ")[2]
            docs[field.target.id] = _text(after) or behind.removeprefix("fmt: skip").strip()
    return {field: text for field, text in docs.items() if text}


def _text(node: ast.stmt | None) -> str:
    """Return the text that a statement consists of, nothing of any other."""
    if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
        return " ".join(str(node.value.value).split())
    return ""


def _keys(schema: Mapping[str, Any], groups: Mapping[str, Any], prefix: str) -> Iterator[Key]:
    for name, field in schema["properties"].items():
        group = _group(field, groups)
        if group is not None:
            yield from _keys(group, groups, f"{prefix}{name}.")
            continue
        default = field.get("default", MUST if name in schema.get("required", ()) else [])
        yield _key(prefix + name, _takes(field), default, field.get("description", ""))


def _group(field: Mapping[str, Any], groups: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Return the schema of the group that a field is, None for a field with a value."""
    for part in (field, *field.get("anyOf", ()), *field.get("oneOf", ())):
        if "$ref" in part:
            found: Mapping[str, Any] = groups[part["$ref"].rpartition("/")[2]]
            return found
    return None


def _takes(field: Mapping[str, Any]) -> str:
    """Return type and bounds of a field in words."""
    if "enum" in field:
        return ", ".join(field["enum"])
    if "anyOf" in field:
        return " or ".join(_takes(part) for part in field["anyOf"] if part.get("type") != "null")
    if field.get("type") == "object":
        return f"names and values ({_takes(field['additionalProperties'])})"
    bounds = [f"{sign} {_short(field[limit])}" for limit, sign in LIMITS.items() if limit in field]
    return " ".join([KINDS[field["type"]], ", ".join(bounds)]).strip()


def _member_key(group: str, field: Field, docs: Mapping[str, str]) -> Key:
    """Return what can be set of a task or a planner."""
    unit = field.bounds.unit
    takes = about(field._replace(bounds=field.bounds._replace(unit="")))
    key = _key(f"{group}.{field.name}", takes, field.default, docs.get(field.name, ""))
    return key._replace(unit=UNITS.get(unit, unit) or key.unit)


def _key(name: str, takes: str, default: Any, text: str) -> Key:
    """Return the key with its unit, from the brackets in its text or from the end of its name."""
    inside = BRACKETS.search(text)
    unit = inside[1] if inside else UNITS.get(name.rpartition(".")[2].rpartition("_")[2], "")
    words = " ".join(BRACKETS.sub("", text, count=1).split())
    first = words[:1] if words[1:2] == "," else words[:1].upper()  # x, y stay small
    return Key(name, takes, default, unit, first + words[1:].rstrip("."))


def _texts(fields: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, str]]:
    for name, field in fields.items():
        yield prefix + name, " ".join((field.description or "").split()).rstrip(".")
        kinds = [kind for kind in (field.annotation, *get_args(field.annotation)) if hasattr(kind, "model_fields")]
        for kind in kinds:
            yield from _texts(kind.model_fields, f"{prefix}{name}.")


def _short(value: float) -> str:
    return f"{value:g}" if abs(value) < 1e6 else f"{int(value)}"
