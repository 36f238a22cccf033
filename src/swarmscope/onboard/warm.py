"""Compiling and loading before the first tick, so that no tick has to."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

from swarmscope.onboard.edge import Seen
from swarmscope.onboard.lidar import LONGEST_SWEEP_S
from swarmscope.onboard.perception.reproject import reproject, settle
from swarmscope.onboard.perception.straighten import straighten
from swarmscope.onboard.planners import Planner
from swarmscope.onboard.rows import Rows
from swarmscope.onboard.scans import Scans
from swarmscope.onboard.trail import Trail


class WarmUp(NamedTuple):
    """What ``Robot.warm_up`` did."""

    seconds: float
    compiled: tuple[str, ...]
    """Kernels that were compiled; they are on disk now, and the next start loads them."""
    loaded: tuple[str, ...]
    """Kernels that were there, on disk or in this process."""


def warm_up(planner: Planner, scans: Scans, rows: Rows) -> WarmUp:
    """Compile or load what ticks of ``planner`` need, on scans and rows that nobody else uses."""
    begun = time.perf_counter()
    kernels = (*planner.kernels, settle, reproject, straighten)
    before = [_compiled(kernel) for kernel in kernels]
    _rehearse(scans, rows)
    names = [getattr(kernel, "__name__", str(kernel)) for kernel in kernels]
    fresh = {name for name, kernel, n in zip(names, kernels, before, strict=True) if _compiled(kernel) > n}
    return WarmUp(
        seconds=time.perf_counter() - begun,
        compiled=tuple(name for name in names if name in fresh),
        loaded=tuple(name for name in names if name not in fresh),
    )


def _compiled(kernel: Any) -> int:
    """Return how many versions of a kernel were compiled, not loaded, in this process."""
    misses = getattr(getattr(kernel, "stats", None), "cache_misses", None)
    return sum(misses.values()) if misses else 0


def _rehearse(scans: Scans, rows: Rows) -> None:
    """Let a robot that nobody will drive live through a few ticks of every kind."""
    trail = Trail(1e9, LONGEST_SWEEP_S)
    rows.load()
    for k in range(4):
        now = float(k)
        trail.add(now, (0.01 * k, 0.0, 0.01))
        if k == 0:
            scans.rehearse(now)
        scans.write(trail, 0.0, rows.found)
        if k == 1:
            scans.rehearse_moving(trail, rows.found)
        rows.scan[: rows.scan.size // 2 if k == 2 else 0] = 1.0
        rows.fill(now_s=now, dt_s=0.2, goal_distance=5.0, goal_bearing=0.1 * k)
        rows.see([Seen(1, 1.0, 0.5)] if k > 1 else [])
        rows.step()
