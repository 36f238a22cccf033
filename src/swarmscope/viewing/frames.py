"""A run as tables: one row for each robot, or for each robot and tick; pandas only makes frames of them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from swarmscope.errors import MissingPackageError, UnknownNameError
from swarmscope.judging.metrics import path_lengths
from swarmscope.viewing.trace import Array, Trace

FRAMES = ("robots", "ticks")
PER_TICK = ("x_m", "y_m", "yaw_rad", "speed_mps", "clearance_m", "side", "p_left", "bytes_sent", "neighbours")


def check_frame(name: str) -> None:
    """Raise an UnknownNameError unless there is such a table."""
    if name not in FRAMES:
        raise UnknownNameError("frame", name, FRAMES)


def as_frame(columns: Mapping[str, Array]) -> Any:
    """Return the columns as a pandas DataFrame; raises MissingPackageError without pandas."""
    try:
        import pandas as pd  # type: ignore[import-untyped, import-not-found, unused-ignore]
    except ImportError:
        raise MissingPackageError("a frame", "pandas") from None
    return pd.DataFrame(dict(columns))


def robot_columns(trace: Trace, world: Mapping[str, Any], shortest_m: Array) -> dict[str, Array]:
    """Return one row for each robot, which had ``shortest_m (N,)`` to go at least: where, how far, how it ended."""
    starts = np.array([robot["start"] for robot in world["robots"]], float).reshape(-1, 3)
    goals = np.array([robot["goal"] for robot in world["robots"]], float).reshape(-1, 2)
    travelled = travelled_m(trace, goals)
    with np.errstate(divide="ignore", invalid="ignore"):
        stretch = np.where(np.isfinite(trace["arrival_s"]), travelled / shortest_m, np.nan)
    return {
        "robot": np.arange(len(starts)),
        "start_x_m": starts[:, 0],
        "start_y_m": starts[:, 1],
        "start_yaw_rad": starts[:, 2],
        "goal_x_m": goals[:, 0],
        "goal_y_m": goals[:, 1],
        "shortest_m": shortest_m,
        "travelled_m": travelled,
        "stretch": stretch,
        "arrival_s": trace["arrival_s"],
        "collided": trace["collided"].astype(bool),
        "bytes_sent": trace["bytes_sent"][-1],
        "state": trace.states[-1],
        "reason": trace.reasons[-1],
    }


def tick_columns(trace: Trace) -> dict[str, Array]:
    """Return one row for each tick and robot, in the order of time."""
    ticks, robots = trace["x_m"].shape
    columns = {"t_s": np.repeat(trace["t_s"], robots), "robot": np.tile(np.arange(robots), ticks)}
    columns |= {name: trace[name].ravel() for name in PER_TICK}
    return columns | {"state": trace.states.ravel(), "reason": trace.reasons.ravel()}


def travelled_m(trace: Trace, goals: Array) -> Array:
    """Return the length (N,) [m] that each robot travelled: to its goal, or until the last tick."""
    t_s, arrival_s = trace["t_s"], trace["arrival_s"]
    there = t_s[:, None] >= arrival_s - 1e-9  # the way left to the goal counts as travelled
    x, y = (np.where(there, goals[:, k], trace[name]) for k, name in enumerate(("x_m", "y_m")))
    arrived = np.isfinite(arrival_s)
    x = np.vstack([x, np.where(arrived, goals[:, 0], x[-1])])
    y = np.vstack([y, np.where(arrived, goals[:, 1], y[-1])])
    return path_lengths(x, y, np.append(t_s, np.inf), arrival_s)
