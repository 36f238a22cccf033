"""The loop over robots round a planner's decision: perceive, decide, guard. No planner can leave the guard out."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import FunctionType, ModuleType
from typing import Any

import numpy as np

from swarmscope._jit import jit_for
from swarmscope.held import Held
from swarmscope.onboard.control.arriving import turn_at_goal
from swarmscope.onboard.control.guard import guard
from swarmscope.onboard.tick import guard_all, perceive, perceive_all
from swarmscope.onboard.view import Swarm, python_view, view_of

Step = Callable[[int, int, Held[Swarm], np.ndarray, Any, float], None]
"""(first, last, held, memories, params, still_s): one tick of robots ``first`` to ``last - 1``."""


def is_compiled(function: Callable[..., Any]) -> bool:
    """Tell whether a function is a kernel."""
    return hasattr(function, "py_func")


@cache
def compiled_step(decide: Callable[..., None], module: ModuleType) -> Step:
    """Return the compiled loop round the kernel ``decide`` of ``module``.

    It is ``_each`` with that ``decide`` among its globals, under a name of its own: so Numba keeps it on disk, which it
    does not for functions that are given a kernel as an argument or a closure. To Numba it stands in the planner's
    file, so that it is compiled anew when that file has changed.
    """
    name = f"step_{module.__name__.rpartition('.')[2]}"
    names: dict[str, Any] = {"view_of": view_of, "perceive": perceive, "decide": decide}
    names |= {"turn_at_goal": turn_at_goal, "guard": guard, "range": range}
    place = decide.py_func.__code__  # type: ignore[attr-defined]
    code = _each.__code__.replace(co_name=name, co_filename=place.co_filename, co_firstlineno=place.co_firstlineno)
    loop = FunctionType(code, names, name)
    loop.__qualname__, loop.__module__ = name, module.__name__
    step: Step = jit_for(loop, also=Path(__file__))
    return step


def _each(first: int, last: int, held: Held[Swarm], memories: np.ndarray, params: Any, still_s: float) -> None:
    swarm = held.what
    for i in range(first, last):
        see = view_of(swarm, i)
        perceive(see, still_s)
        decide(see, memories[i], params)  # type: ignore[name-defined]  # noqa: F821
        turn_at_goal(see)
        guard(see)


def plain_step(decide: Callable[..., None]) -> Step:
    """Return the loop round a plain Python ``decide``: a thousand times slower, easy to write and to look into."""

    def step(first: int, last: int, held: Held[Swarm], memories: np.ndarray, params: Any, still_s: float) -> None:
        perceive_all(first, last, held, still_s)
        for i in range(first, last):
            decide(python_view(held.what, i), memories[i], params)
        guard_all(first, last, held)

    return step


def batch_step(decide_all: Callable[..., None], *more: Any) -> Step:
    """Return the loop round a decision that is made for all robots at once, as libraries want it."""

    def step(first: int, last: int, held: Held[Swarm], memories: np.ndarray, params: Any, still_s: float) -> None:
        perceive_all(first, last, held, still_s)
        decide_all(first, last, held.what, memories, params, *more)
        guard_all(first, last, held)

    return step
