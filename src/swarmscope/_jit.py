"""The only place that configures Numba: every kernel of the project is decorated from here.

No fast math: NaN and infinity carry meaning in scans (REP-117). ``error_model="numpy"`` makes a
division by zero give infinity instead of raising, so that a kernel never raises. ``nogil`` lets the
simulator run chunks of robots on plain threads; results are the same with one thread or many,
because a kernel writes only to its own robots' rows.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar, cast

import numba

F = TypeVar("F", bound=Callable[..., Any])


PACKAGE = Path(__file__).parent
NO_KERNELS = frozenset({"api.py", "cli", "viewing", "scenarios", "judging", "experiments"})
"""Parts without kernels; the few files of theirs that have some import this module and are found by that."""
KEPT_CACHES = 8
"""Kernel caches of earlier states of the sources that are left on disk."""


def kernel_sources() -> list[Path]:
    """Return the files that can change what a kernel does."""
    files = sorted(PACKAGE.rglob("*.py"))
    return [f for f in files if f.relative_to(PACKAGE).parts[0] not in NO_KERNELS or b"_jit import" in f.read_bytes()]


def cache_folder() -> Path:
    """Return the folder for the kernels of this state of the sources, in SWARMSCOPE_CACHE or the user's cache.

    Numba compiles a cached kernel anew when its own file has changed, but not when a function that it calls
    from another file does; a folder for each state of the sources rules out results of mixed versions.
    """
    state = hashlib.sha256()
    for file in kernel_sources():
        state.update(file.relative_to(PACKAGE).as_posix().encode() + file.read_bytes())
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "swarmscope"
    return Path(os.environ.get("SWARMSCOPE_CACHE") or user) / "kernels" / state.hexdigest()[:16]


def use_own_cache() -> None:
    """Keep kernels in ``cache_folder`` unless NUMBA_CACHE_DIR says where; forget the oldest others."""
    if os.environ.get("NUMBA_CACHE_DIR"):
        return
    try:
        folder = cache_folder()
        folder.mkdir(parents=True, exist_ok=True)
        folder.touch()
        others = sorted(folder.parent.iterdir(), key=lambda other: other.stat().st_mtime, reverse=True)
    except (OSError, RuntimeError):
        return  # no home, or no room: Numba finds a place of its own
    for other in others[KEPT_CACHES:]:
        shutil.rmtree(other, ignore_errors=True)
    config: Any = numba.config
    config.CACHE_DIR = str(folder)


use_own_cache()

OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy"}
LEAN = OPTIONS | {"_nrt": False, "no_cfunc_wrapper": True}
"""Without Numba's runtime (``_nrt=False``) arrays are not reference-counted, which costs more than the work in
short kernels, and a kernel that allocates does not compile."""


# giwt's memory begins with that of DH-Bug, so that DH-Bug's kernels can drive it.
warnings.filterwarnings("ignore", "Record.*has been considered a subtype", numba.NumbaExperimentalFeatureWarning)


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


def jit_paste(function: F) -> F:
    """Paste ``function`` into its callers before they are typed; for what returns views of arrays of records."""
    return _compile(function, LEAN | {"inline": "always"})
