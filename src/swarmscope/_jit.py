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


def jit(function: F) -> F:
    """Compile ``function`` in nopython mode, cached on disk; it may not allocate.

    Without Numba's runtime (``_nrt=False``) arrays are not reference-counted, which costs more than the work in
    short kernels, and a kernel that allocates does not compile.
    """
    return cast("F", numba.njit(cache=True, nogil=True, error_model="numpy", _nrt=False, no_cfunc_wrapper=True)(function))


def jit_inner(function: F) -> F:
    """Compile ``function`` like ``jit_inline``, for calls from other kernels only.

    Without the wrapper that unpacks Python arguments it compiles in a fraction of the time, but a call from Python
    crashes the process: for private helpers (``_name``) of a kernel module.
    """
    if not function.__name__.startswith("_"):
        raise ValueError(f"{function.__name__}: only private kernels can do without a Python wrapper")
    options = {"no_cpython_wrapper": True, "no_cfunc_wrapper": True, "forceinline": True}
    return cast("F", numba.njit(cache=True, nogil=True, error_model="numpy", _nrt=False, **options)(function))


def jit_alloc(function: F) -> F:
    """Compile ``function`` in nopython mode, cached on disk; it may allocate (set-up and evaluation, no hot path)."""
    return cast("F", numba.njit(cache=True, nogil=True, error_model="numpy")(function))


def jit_inline(function: F) -> F:
    """Compile a tiny scalar helper so that LLVM always inlines it into its caller."""
    return cast("F", numba.njit(cache=True, nogil=True, error_model="numpy", forceinline=True, _nrt=False, no_cfunc_wrapper=True)(function))
