"""GIWT with the network that comes with the package; ``with_model`` gives the same planner with another (``_giwt``)."""

from __future__ import annotations

from swarmscope.onboard.planning._giwt import MEMORY, Params, new_memory, shipped

__all__ = ["MEMORY", "NAME", "NEEDS", "SUMMARY", "Params", "new_memory", "step_all", "with_model"]

NAME = "giwt"
SUMMARY = "GIWT: DH-Bug, and a graph attention network with information gain chooses the side (extra 'giwt')"
PLANNER = shipped(NAME, SUMMARY, "giwt")
NEEDS = PLANNER.NEEDS
KERNELS = PLANNER.KERNELS
step_all = PLANNER.step_all
with_model = PLANNER.with_model
model_state = PLANNER.model_state
check_available = PLANNER.check_available
