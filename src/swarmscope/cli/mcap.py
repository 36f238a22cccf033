"""``swarmscope mcap``."""

from __future__ import annotations

import sys
from pathlib import Path

from swarmscope.cli._code import allow_code
from swarmscope.experiments.warm_up import COMPILING, kernels_are_cold
from swarmscope.viewing.bag.make import check_packages, make_mcap, scenario_of


def mcap_command(run_dir: Path, out: Path | None, threads: int, code: bool) -> None:
    """Play the run again and write its MCAP file."""
    check_packages()
    scenario = scenario_of(run_dir)
    allow_code([scenario], code)
    if kernels_are_cold(scenario.planner.name):
        print(COMPILING, file=sys.stderr)
    print(make_mcap(run_dir, scenario, out, threads))
