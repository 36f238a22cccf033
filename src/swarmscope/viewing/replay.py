"""The replay page: one HTML file that holds the whole run and its player, and asks nothing of a network."""

from __future__ import annotations

import base64
import html
import json
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from swarmscope.sim.world import WALL_M
from swarmscope.viewing.run_data import (
    ONLY_WHERE_THINGS_MOVE,
    Array,
    RunData,
    crash_ticks,
    failure_reasons,
    headline,
    load_run,
    replace_file,
    shown_bounds,
    summary_rows,
)

if TYPE_CHECKING:
    from swarmscope.viewing.memories.again import Memories

SCAN_BUDGET_BYTES = 24_000_000
"""Scans and safe directions above this are thinned in time: every 2nd, 3rd, ... tick is kept."""

_TYPES = {
    "t_s": "<f8",
    "x_m": "<f4",
    "y_m": "<f4",
    "yaw_rad": "<f4",
    "state": "u1",
    "reason": "u1",
    "speed_mps": "<f4",
    "clearance_m": "<f4",
    "p_left": "<f4",
    "side": "i1",
    "bytes_sent": "<i4",
    "neighbours": "u1",
    "beam_angles": "<f4",
    "scan_u8": "u1",
    "safe_bits": "u1",
    "links": "<i4",
    "choices": "<f4",
    "opinions": "<f4",
    "arrival_s": "<f4",
    "collided": "u1",
    "disc_xy_m": "<f4",
    "door_closed": "u1",
}
_MEMORY_TYPES = {"memory_moments": "<i4", "memory_frames": "<f4", "memory_toggled": "<i2", "memory_ways": "<f4"}
"""How each array of the trajectory is stored in the page."""


def write_replay(run_dir: Path, memories: Memories | None = None) -> Path:
    """Write ``replay.html`` into the run folder and return its path."""
    run = load_run(run_dir)
    return replace_file(run.folder / "replay.html", render_page(run, memories).encode("utf-8"))


def render_page(run: RunData, memories: Memories | None = None) -> str:
    """Return the replay page of a run, with what its robots remembered if that is given."""
    template = resources.files("swarmscope.viewing").joinpath("replay_template.html").read_text("utf-8")
    payload = json.dumps(page_data(run, memories), allow_nan=False, separators=(",", ":"), ensure_ascii=False)
    head, tail = template.split("@DATA@")
    head = head.replace("@TITLE@", html.escape(headline(run)))
    return head + payload.replace("<", "\\u003c") + tail


def page_data(run: RunData, memories: Memories | None = None) -> dict[str, Any]:
    """Return what the page is given, ready for JSON: names and the world in clear, arrays as base64."""
    trajectory = run.trajectory
    stride = scan_stride(run)
    links = trajectory.links[np.argsort(trajectory.links[:, 0], kind="stable")]
    arrays = trajectory._asdict() | {
        "links": links,
        "scan_u8": trajectory.scan_u8[::stride],
        "safe_bits": trajectory.safe_bits[::stride],
    }
    return {
        "title": headline(run),
        "summary": summary_rows(run),
        "failures": failure_reasons(run),
        "robots": [robot.model_dump() for robot in run.world.robots],
        "obstacles": [obstacle.model_dump(exclude_none=True) for obstacle in run.world.obstacles],
        "bounds": shown_bounds(run.world),
        "wall_m": WALL_M,
        "state_names": [str(name) for name in trajectory.state_names],
        "reason_names": [str(name) for name in trajectory.reason_names],
        "range_max_m": float(trajectory.range_max_m),
        "scan_stride": stride,
        "crash_ticks": crash_ticks(trajectory).tolist(),
        "memory_cell_m": None if memories is None else memories.cell_m,
        "arrays": _memory_arrays(memories)
        | {
            name: _encode(arrays[name], kind)
            for name, kind in _TYPES.items()
            if name not in ONLY_WHERE_THINGS_MOVE or arrays[name].size
        },
    }


def _memory_arrays(memories: Memories | None) -> dict[str, Any]:
    """Return what robots remembered: for each moment its tick, robot, whether it had searched, how many cells are
    toggled and how many corners its way has; and all these in a row."""
    if memories is None or not memories.moments:
        return {}
    moments = memories.moments
    columns = [(one.tick, one.robot, one.searched, len(one.toggled), len(one.way)) for one in moments]
    found = {
        "memory_moments": np.array(columns),
        "memory_frames": np.array([one.frame for one in moments]),
        "memory_toggled": np.concatenate([one.toggled for one in moments]),
        "memory_ways": np.concatenate([one.way for one in moments]),
    }
    return {name: _encode(found[name], kind) for name, kind in _MEMORY_TYPES.items()}


def scan_stride(run: RunData) -> int:
    """Return every how manieth tick keeps its scan, so that the page stays within `SCAN_BUDGET_BYTES`."""
    size = run.trajectory.scan_u8.size + run.trajectory.safe_bits.size
    return max(1, -(-size // SCAN_BUDGET_BYTES))


def _encode(array: Array, kind: str) -> dict[str, Any]:
    content = np.ascontiguousarray(array, dtype=np.dtype(kind))
    return {
        "type": kind.lstrip("<"),
        "shape": content.shape,
        "base64": base64.b64encode(content.tobytes()).decode("ascii"),
    }
