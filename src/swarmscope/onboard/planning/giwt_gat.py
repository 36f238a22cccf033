"""GIWT's planner with a plain graph attention network, a baseline of the paper."""

from __future__ import annotations

from swarmscope.onboard.planning._giwt import MEMORY, Params, new_memory, shipped

__all__ = ["MEMORY", "NAME", "NEEDS", "SUMMARY", "Params", "new_memory", "step_all", "with_model"]

NAME = "giwt-gat"
SUMMARY = "GIWT's planner with a graph attention network, without positions and gains (extra 'giwt')"
PLANNER = shipped(NAME, SUMMARY, "gat")
NEEDS = PLANNER.NEEDS
KERNELS = PLANNER.KERNELS
step_all = PLANNER.step_all
with_model = PLANNER.with_model
model_state = PLANNER.model_state
check_available = PLANNER.check_available
