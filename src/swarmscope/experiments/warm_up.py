"""Compiled kernels: are they on disk, and how to put them there once instead of in every worker at the same time."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

from swarmscope.experiments.work import make_job
from swarmscope.onboard.planners import load_planner
from swarmscope.scenarios.read import parse_scenario

COMPILING = "compiling the kernels for the first time (a minute or two, kept on disk) ..."
"""What is said meanwhile."""


def kernels_are_cold(planner: str) -> bool:
    """Tell whether the compiled kernels of the simulator or of the planner are not on disk yet."""
    from swarmscope.sim import loop

    return any(map(_is_cold, (loop.world_phase, *load_planner(planner).kernels)))


def warm_up_jobs(planners: Iterable[str]) -> list[str]:
    """Return a short run for each planner whose kernels have to be compiled first."""
    return [_short_run(name) for name in dict.fromkeys(planners) if kernels_are_cold(name)]


def _short_run(planner: str) -> str:
    values = {"task": {"name": "T1"}, "robots": 2, "limit_s": 2.0, "planner": {"name": planner}, "record_scans": "no"}
    config = parse_scenario(values, "warm-up").model_dump(mode="json", exclude_none=True)
    return make_job("warm-up", "warm-up", config, None)


def _is_cold(kernel: Any) -> bool:
    folder = getattr(getattr(kernel, "_cache", None), "cache_path", None)
    if folder is None:
        return False  # not a kernel
    stem = Path(kernel.py_func.__code__.co_filename).stem  # the folder is one for each state of the source
    return not any(Path(folder).glob(f"{stem}.{kernel.py_func.__name__}-*.nbi"))
