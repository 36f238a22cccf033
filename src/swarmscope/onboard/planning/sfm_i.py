"""SFM-I: SFM-MAS without neighbours, w_i = 0. It neither asks nor answers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit
from swarmscope.onboard.percept import Rig, Scratch
from swarmscope.onboard.planning import sfm_mas
from swarmscope.onboard.planning._memory import MEMORY, new_memory

__all__ = ["MEMORY", "NAME", "NEEDS", "SUMMARY", "Params", "new_memory", "step_all"]

NAME = "sfm-i"
SUMMARY = "SFM-MAS alone: the same forces and states, every side chosen from the robot's own scan"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours"
sfm_mas_all = sfm_mas.step_all
WithNeighbours = sfm_mas.Params


class Params(NamedTuple):
    """What can be set, as in SFM-MAS. Distances in m, times in s."""

    prior: float = 3.0
    """Weight of the turn in sight [1/rad] in the bias b_0 of (7); 0 as printed."""
    arrive_m: float = 0.05
    """Distance to the goal at which a robot has arrived."""
    still_s: float = 0.6
    """A neighbour that has not moved for so long is an obstacle."""
    wait_s: float = 2.0
    """Longest wait for a neighbour to pass; after it the neighbour is an obstacle for the same time."""
    wide_turn: float = 1.0
    """Turn from the target [rad] beyond which narrower gaps are looked for."""
    stuck_s: float = 20.0
    """A following that gets no closer to the goal for so long is a loop."""
    turn_back: float = 1.75
    """A following turns back towards the target by at most this in one tick [rad]."""
    resume_m: float = 0.5
    """An obstacle met so soon after a following ended is the same one: the side stays."""
    reopen: float = 0.5
    """A following changes sides when the way on the other side turns off the target by this much less [rad];
    0 as printed."""
    loop_m: float = 1.0
    """A second choice of side this close to an earlier one, without progress, is a loop."""


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
    """Run one tick of robots ``first`` to ``last - 1``."""
    full = WithNeighbours(
        w_i=0.0,
        prior=params.prior,
        patience_s=0.0,
        arrive_m=params.arrive_m,
        still_s=params.still_s,
        wait_s=params.wait_s,
        wide_turn=params.wide_turn,
        stuck_s=params.stuck_s,
        turn_back=params.turn_back,
        resume_m=params.resume_m,
        reopen=params.reopen,
        loop_m=params.loop_m,
    )
    sfm_mas_all(first, last, ranges, percepts, shared, memories, decisions, scratch, rig, full)
    for i in range(first, last):
        decisions[i]["n_out"] = 0  # answers to others
