"""Runs played again from their scenarios, for pictures of what happened; the same to the bit as the measured ones."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import InputFileError
from swarmscope.experiments.results import Run
from swarmscope.judging.run import play
from swarmscope.scenarios.read import parse_scenario, user_files_of
from swarmscope.sim.world import WorldSpec

Floats = NDArray[np.float64]


class Played(NamedTuple):
    """What pictures need of a run; T ticks, N robots, world frame [m]."""

    world: WorldSpec
    radius: float
    dt: float
    x: Floats
    """(T, N)"""
    y: Floats
    yaw: Floats
    starts: Floats
    goals: Floats
    arrived: NDArray[np.bool_]
    crashed: NDArray[np.bool_]


class Again:
    """Plays runs again, each once; unless ``run_files``, none that a user's file has a part in."""

    def __init__(self, run_files: bool = True) -> None:
        self._run_files = run_files
        self._played: dict[tuple[str, str, int], Played] = {}

    def of(self, run: Run) -> Played:
        """Return the run's paths; a SwarmscopeError when its scenario no longer runs (a map file that is gone)."""
        key = (run.place, run.planner, run.seed)
        if key not in self._played:
            self._played[key] = _play(run, self._run_files)
        return self._played[key]


def _play(run: Run, run_files: bool) -> Played:
    scenario = parse_scenario(run.config, f"run of seed {run.seed}")
    for file in user_files_of(scenario).values() if not run_files else ():
        raise InputFileError(file, "is not run for a report; 'swarmscope experiment run' draws it, too")
    scenario = scenario.model_copy(update={"record_scans": "no"})
    outcome = play(scenario, any_angle=False)
    records, robots = outcome.trace.records, outcome.trace.robots
    return Played(
        world=outcome.setup.world,
        radius=scenario.widest.radius_m,
        dt=outcome.setting.dt,
        x=np.vstack([records.x, robots["x"]]),
        y=np.vstack([records.y, robots["y"]]),
        yaw=np.vstack([records.yaw, robots["yaw"]]),
        starts=outcome.setup.starts,
        goals=outcome.setup.goals,
        arrived=np.isfinite(robots["arrival_s"]),
        crashed=robots["crashed"].astype(bool),
    )
