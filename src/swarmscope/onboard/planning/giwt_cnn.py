"""GIWT's planner with a network that sees the own scan only, a baseline of the paper; nobody is asked."""

from __future__ import annotations

from swarmscope.onboard.planning._giwt import MEMORY, Params, new_memory, shipped

__all__ = ["MEMORY", "NAME", "NEEDS", "SUMMARY", "Params", "new_memory", "step_all", "with_model"]

NAME = "giwt-cnn"
SUMMARY = "GIWT's planner with a network that sees the own scan only (extra 'giwt')"
PLANNER = shipped(NAME, SUMMARY, "cnn")
NEEDS = PLANNER.NEEDS
KERNELS = PLANNER.KERNELS
step_all = PLANNER.step_all
with_model = PLANNER.with_model
model_state = PLANNER.model_state
check_available = PLANNER.check_available
