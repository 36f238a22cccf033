"""swarmscope: swarm robots that share what they see.

On a robot: ``Robot``, ``Body``, ``Lidar``, ``Seen``, ``Command``. In a script: ``simulate``, ``load_run``, ``Run``,
``load_scenario``. Each is imported when it is asked for, so that ``import swarmscope`` itself costs nothing.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from swarmscope.api import Run, load_run, simulate
    from swarmscope.onboard.body import Body
    from swarmscope.onboard.lidar import Lidar
    from swarmscope.onboard.robot import Command, Robot, Seen
    from swarmscope.scenarios.read import load_scenario

__version__ = "0.1.0"

__all__ = ["Body", "Command", "Lidar", "Robot", "Run", "Seen", "load_run", "load_scenario", "simulate"]

HOMES = {
    "Body": "swarmscope.onboard.body",
    "Command": "swarmscope.onboard.robot",
    "Lidar": "swarmscope.onboard.lidar",
    "Robot": "swarmscope.onboard.robot",
    "Run": "swarmscope.api",
    "Seen": "swarmscope.onboard.robot",
    "load_run": "swarmscope.api",
    "load_scenario": "swarmscope.scenarios.read",
    "simulate": "swarmscope.api",
}
"""Where each public name lives."""


def __getattr__(name: str) -> Any:
    """Import a public name; an AttributeError names the nearest one."""
    if name not in HOMES:
        from swarmscope.errors import nearest_hint

        raise AttributeError(f"swarmscope has no '{name}'{nearest_hint(name, __all__)}")
    from importlib import import_module

    value = getattr(import_module(HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Name what is public."""
    return sorted({*globals(), *__all__} - {"Any", "TYPE_CHECKING", "annotations"})
