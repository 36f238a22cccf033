"""The robot's own time: a clock that is set anew while it runs is no time that has passed."""

from __future__ import annotations

import math

from swarmscope._jit import jit_inline
from swarmscope.onboard.percept import Row

JUMP_PERIODS = 5.0
"""A tick that comes later than this is a jump of the clock, or of a robot that was asleep."""
EVEN_S = 1e-6
"""A tick that comes this close to when it should is on time [s]; a clock that shows 1.7e9 s rounds less than that."""


@jit_inline
def keep_time(percept: Row, shared: Row) -> None:
    """Make ``percept["now_s"]`` the time since the robot's first tick: all that is waited for counts time that passed.

    A clock cannot go back, nor ``JUMP_PERIODS`` forward in a tick; when it does, ``dt_s`` has passed. Ticks on time are
    counted, so that neither a jump nor where the clock stands changes a bit of when a wait is over.
    """
    said, dt = percept["now_s"], percept["dt_s"]
    if 0.0 < dt < math.inf:
        if dt != shared["even_s"]:
            _count_from(shared, own_time(shared), dt)
        if shared["started"] != 0:
            passed = said - shared["clock_s"]
            if abs(passed - dt) < EVEN_S or not 0.0 <= passed <= JUMP_PERIODS * dt:
                shared["even_n"] += 1
            else:
                _count_from(shared, own_time(shared) + passed, dt)
    shared["clock_s"] = said
    percept["now_s"] = own_time(shared)


@jit_inline
def own_time(shared: Row) -> float:
    """Return the time of the last tick since the first [s]."""
    return float(shared["base_s"] + shared["even_n"] * shared["even_s"])


@jit_inline
def _count_from(shared: Row, base: float, dt: float) -> None:
    """Count ticks of ``dt`` from the time ``base`` on [s]."""
    shared["base_s"], shared["even_n"], shared["even_s"] = base, 0, dt


def skip_to(shared: Row, now_s: float) -> None:
    """Let time go on to ``now_s`` [s] since the first tick, where the kernels were not run meanwhile."""
    if shared["started"] != 0 and abs(now_s - _own_time(shared)) > EVEN_S:
        shared["base_s"], shared["even_n"] = now_s, 0
    shared["clock_s"] = now_s


_own_time = getattr(own_time, "py_func", own_time)
