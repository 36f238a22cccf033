"""The oracle: Nav-I that is told on which side the shortest way passes. It shows what any choice of side could give.

It is no planner for a robot: ``told_side`` comes from somebody who knows the map.
"""

from __future__ import annotations

import numpy as np

from swarmscope._jit import jit
from swarmscope.onboard.percept import Rig, Scratch
from swarmscope.onboard.planning._memory import MEMORY, new_memory
from swarmscope.onboard.planning.nav_i import Params, step

__all__ = ["MEMORY", "NAME", "NEEDS", "SUMMARY", "TOLD_SIDE", "Params", "new_memory", "step_all"]

NAME = "oracle"
SUMMARY = "upper reference: the states of Nav-SCOPE, but told the right side by somebody who knows the map"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours, the side of the shortest way"
TOLD_SIDE = True
"""Asks the simulator to fill ``percept["told_side"]``."""


@jit
def step_all(
    first: int,
    last: int,
    ranges: np.ndarray,
    percepts: np.ndarray,
    shared: np.ndarray,
    memories: np.ndarray,
    decisions: np.ndarray,
    scratch: Scratch,
    rig: Rig,
    params: Params,
) -> None:
    """Run one tick of robots ``first`` to ``last - 1``; a side of 0 leaves the choice to the robot."""
    for i in range(first, last):
        told = percepts[i]["told_side"]
        step(ranges[i], percepts[i], shared[i], memories[i], decisions[i], scratch, i, rig, params, told)
