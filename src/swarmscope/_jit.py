"""The only place that configures Numba: every kernel of the project is decorated from here.

No fast math: NaN and infinity carry meaning in scans (REP-117). ``error_model="numpy"`` makes a
division by zero give infinity instead of raising, so that a kernel never raises. ``nogil`` lets the
simulator run chunks of robots on plain threads; results are the same with one thread or many,
because a kernel writes only to its own robots' rows.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}
LEAN = OPTIONS | {"_nrt": False, "no_cfunc_wrapper": True}
"""Without Numba's runtime (``_nrt=False``) arrays are not reference-counted, which costs more than the work in
short kernels, and a kernel that allocates does not compile."""


def _compile(function: F, options: dict[str, Any]) -> F:
    njit: Any = numba.njit
    return cast("F", njit(**options)(function))


def jit(function: F) -> F:
    """Compile ``function`` in nopython mode, cached on disk; it may not allocate."""
    return _compile(function, LEAN)


def jit_inline(function: F) -> F:
    """Compile a tiny scalar helper so that LLVM always inlines it into its caller."""
    return _compile(function, LEAN | {"forceinline": True})


def jit_inner(function: F) -> F:
    """Compile ``function`` like ``jit_inline``, for calls from other kernels only.

    Without the wrapper that unpacks Python arguments it compiles in a fraction of the time, but a call from
    Python crashes the process: for private helpers (``_name``) of a kernel module.
    """
    if not function.__name__.startswith("_"):
        raise ValueError(f"{function.__name__}: only private kernels can do without a Python wrapper")
    return _compile(function, LEAN | {"forceinline": True, "no_cpython_wrapper": True})


def jit_alloc(function: F) -> F:
    """Compile ``function`` in nopython mode, cached on disk; it may allocate (set-up and evaluation only)."""
    return _compile(function, OPTIONS)
