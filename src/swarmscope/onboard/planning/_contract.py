"""What a planner file defines, the states and reasons that planners share, and how planners are found.

A planner is one file of this folder that defines ``NAME``,
``SUMMARY``, ``NEEDS`` (what it is given), ``Params`` (a NamedTuple with defaults), ``MEMORY`` (a dtype),
``new_memory(robots)`` and ``step_all(first, last, ...)`` (see ``nav_scope``): the compiled loop that calls
``tick.begin``, the planner's own ``decide`` and ``tick.finish`` for each robot.
"""

from __future__ import annotations

from pathlib import Path
from types import ModuleType
from typing import Any

from swarmscope import members
from swarmscope.errors import UnknownNameError
from swarmscope.members import Kind, text

STATE_NAMES = ("advance", "decide", "follow", "yield", "arrived", "escape", "crashed")
ADVANCE, DECIDE, FOLLOW, YIELD, ARRIVED, ESCAPE, CRASHED = range(7)

REASON_NAMES = (
    "target direction is safe",
    "final approach: the way to the goal is free",
    "waits for the answers of neighbours",
    "obstacle ahead: chose a side with the neighbours' features",
    "obstacle ahead: chose a side alone",
    "follows the obstacle on the chosen side",
    "dead end: no safe direction, uses the narrower gaps that its body fits through",
    "loop noticed: follows the border until closer to the goal than ever",
    "no way out in sight: moves away from the nearest obstacle",
    "waits for a neighbour to pass",
    "stands still: no direction is free",
    "arrived at the goal",
    "guard: slowed down to keep its braking distance",
    "collided",
)
(
    R_FREE,
    R_FINAL,
    R_ANSWERS,
    R_FUSED,
    R_ALONE,
    R_FOLLOW,
    R_DEAD_END,
    R_LOOP,
    R_LOST,
    R_YIELD,
    R_BLOCKED_WAIT,
    R_ARRIVED,
    R_GUARD,
    R_COLLIDED,
) = range(14)


NOT_PLANNERS = frozenset({"fields", "fusion"})
"""Modules of this folder that planners share."""
PLANNERS = Kind(
    "planner",
    "swarmscope.onboard.planning",
    "swarmscope.planners",
    needs=(text("NAME"), text("SUMMARY"), text("NEEDS")),
    leave_out=NOT_PLANNERS,
)


def planner_names() -> list[str]:
    """Return the names of all planners that are installed."""
    return members.names_of(PLANNERS)


def planner_file(name: str) -> Path:
    """Return the file of a planner without importing it."""
    return members.find(PLANNERS, name).file


def load_planner(name: str) -> ModuleType:
    """Return the module of planner ``name``, or of a user's FILE.py; UnknownNameError names the nearest.

    Its ``Params`` is named after its file: Numba tells named tuples apart by class name and types of the fields only,
    so two planners' ``Params`` with equally many floats would be one type, and every call of the one loaded later
    would take a detour of 0.7 ms.
    """
    module = members.load(PLANNERS, name)
    kind = module.Params
    kind.__name__ = f"Params_{kind.__module__.rpartition('.')[2]}"
    return module


def make_params(planner: Any, values: dict[str, Any]) -> Any:
    """Return the planner's ``Params`` with ``values`` set, each converted to the declared type."""
    fields = planner.Params._field_defaults
    for key in values:
        if key not in fields:
            raise UnknownNameError("parameter", key, fields, f"planner '{planner.NAME}'")
    return planner.Params(**{k: type(v)(values.get(k, v)) for k, v in fields.items()})
