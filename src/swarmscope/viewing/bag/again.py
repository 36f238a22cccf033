"""A finished run played again, for what its folder holds in bytes only; it must come out the same."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from swarmscope.errors import InputFileError
from swarmscope.judging.run import judged_setting
from swarmscope.judging.run_folder import CONFIG, TRAJECTORY
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.scenario import Scenario
from swarmscope.sim.loop import Trace, run
from swarmscope.viewing.bag.exact import Exact
from swarmscope.viewing.run_data import RunData

SAME = {"x_m": "x", "y_m": "y", "yaw_rad": "yaw", "speed_mps": "speed", "state": "state", "bytes_sent": "bytes_sent"}
"""Arrays of ``trajectory.npz`` that must come out again, and the records that hold them."""


def play_again(
    found: RunData, scenario: Scenario, threads: int = 1, progress: Callable[[float, int], None] | None = None
) -> Exact:
    """Return what the robots of a finished run of ``scenario`` measured and commanded.

    An InputFileError says that the run no longer comes out as it did.
    """
    setting = judged_setting(scenario, make_setup(scenario), threads)
    exact = Exact()
    check_same(found, run(replace(setting, record_scans=False), progress, *exact.watch))
    return exact


def check_same(found: RunData, trace: Trace) -> None:
    """Raise an InputFileError when a run that was played again did not come out as it did."""
    for name, record in SAME.items():
        there, here = getattr(found.trajectory, name), getattr(trace.records, record)
        if not np.array_equal(there, here):
            config = found.folder / CONFIG
            raise InputFileError(
                found.folder / TRAJECTORY,
                f"the run no longer comes out the same ({name} differs): the program, the machine, a map or a planner "
                f"is another one; make it anew: swarmscope run {config} --mcap --out FOLDER",
            )
