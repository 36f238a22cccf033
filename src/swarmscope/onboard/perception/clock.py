"""The robot's own time: a clock that is set anew while it runs is no time that has passed."""

from __future__ import annotations

from swarmscope._jit import jit
from swarmscope.onboard.percept import Row

JUMP_PERIODS = 5.0
"""A tick that comes later than this is a jump of the clock, or of a robot that was asleep."""


@jit
def keep_time(percept: Row, shared: Row) -> None:
    """Take jumps out of ``percept["now_s"]``: whatever is remembered or waited for counts time that has passed.

    A clock cannot go back, nor ``JUMP_PERIODS`` forward in a tick; when it does, ``dt_s`` has passed. By how much
    it has jumped so far stays in ``shared["ahead_s"]``.
    """
    said = percept["now_s"]
    if shared["started"] != 0:
        passed, dt = said - shared["clock_s"], percept["dt_s"]
        if not 0.0 <= passed <= JUMP_PERIODS * dt:
            shared["ahead_s"] += passed - dt
    shared["clock_s"] = said
    percept["now_s"] = said - shared["ahead_s"]
