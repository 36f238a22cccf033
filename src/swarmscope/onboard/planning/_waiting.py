"""Waiting for a neighbour to pass (Nav-SCOPE state iv, SFM-MAS IV-D), and what ends every wait."""

from __future__ import annotations

from swarmscope._jit import jit
from swarmscope.onboard.percept import Row
from swarmscope.onboard.planning._contract import R_YIELD, YIELD


@jit
def wait(memory: Row, decision: Row, must: bool, now: float, longest_s: float) -> None:
    """Stand still while ``must`` holds, at most ``longest_s``; then do not wait again for the same time."""
    if now < memory["push_s"] or not must:
        memory["wait_s"] = -1.0
        return
    if memory["wait_s"] < 0.0:
        memory["wait_s"] = now
    if now - memory["wait_s"] > longest_s:
        memory["wait_s"] = -1.0
        memory["push_s"] = now + longest_s
        return
    decision["v"] = 0.0
    decision["state"], decision["reason"] = YIELD, R_YIELD
