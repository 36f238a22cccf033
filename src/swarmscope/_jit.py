"""The only place that configures Numba: every kernel of the project is decorated from here.

No fast math: NaN and infinity carry meaning in scans (REP-117). ``error_model="numpy"`` makes a
division by zero give infinity instead of raising, so that a kernel never raises. ``nogil`` lets the
simulator run chunks of robots on plain threads; results are the same with one thread or many,
because a kernel writes only to its own robots' rows.
"""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any, TypeVar, cast

import numba
from numba import types

from swarmscope.closure import OF_A_USER, PACKAGE, closure_state, module_of

F = TypeVar("F", bound=Callable[..., Any])

KEPT_STATES = 4
"""Kernel caches of earlier states of one module that are left on disk."""
FORMER = re.compile(r"[0-9a-f]{16}")
"""Folders as they were called when one of them held the kernels of all modules."""
FORMER_S = 7 * 24 * 3600.0


def kernel_folder() -> Path:
    """Return the folder with the compiled kernels of all modules: in SWARMSCOPE_CACHE or the user's cache."""
    user = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "swarmscope"
    return Path(os.environ.get("SWARMSCOPE_CACHE") or user) / "kernels"


def cache_folder(file: Path, state: str) -> Path | None:
    """Return the folder for the kernels of one file in one state; None if there cannot be one.

    Numba compiles a cached kernel anew when its own file has changed, but not when a function that it calls from
    another file does; a folder for each state of everything that the file imports (see ``closure``) rules out results
    of mixed versions, and leaves alone what does not import a file that was edited.
    """
    try:
        return _made(file, state)
    except (OSError, RuntimeError):
        return None  # no home, or no room: Numba finds a place of its own


@cache
def _made(file: Path, state: str) -> Path:
    place = kernel_folder() / _label(file) / state
    place.mkdir(parents=True, exist_ok=True)
    place.touch()
    _forget(place.parent)
    return place


def _label(file: Path) -> str:
    """Return the module's name; files of a user that are called alike are told apart by where they lie."""
    name = module_of(file)
    if file.is_relative_to(PACKAGE):
        return name
    return f"{name}-{hashlib.sha256(str(file).encode()).hexdigest()[:8]}"


def _forget(folder: Path) -> None:
    """Remove the caches of a module's oldest states."""
    states = sorted(folder.iterdir(), key=lambda state: state.stat().st_mtime, reverse=True)
    for state in states[KEPT_STATES:]:
        shutil.rmtree(state, ignore_errors=True)


def _forget_former() -> None:
    """Remove the caches that earlier versions left, a week after their last use."""
    try:
        for folder in kernel_folder().iterdir():
            if FORMER.fullmatch(folder.name) and time.time() - folder.stat().st_mtime > FORMER_S:
                shutil.rmtree(folder, ignore_errors=True)
    except (OSError, RuntimeError):
        return


_forget_former()


@contextmanager
def _cached_in(folder: Path | None) -> Iterator[None]:
    """Let Numba keep the kernels that are decorated meanwhile in ``folder``; NUMBA_CACHE_DIR goes before.

    Numba asks for the folder when a function is decorated, and never again.
    """
    config: Any = numba.config
    if folder is None or os.environ.get("NUMBA_CACHE_DIR"):
        yield
        return
    before = config.CACHE_DIR
    config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        config.CACHE_DIR = before


OPTIONS = {"cache": True, "nogil": True, "error_model": "numpy", "forceinline": False}
"""``forceinline`` is said because a kernel that is compiled for another one takes from it what is not: whatever an
inlined kernel calls would be inlined, too, with all that it calls, and that takes minutes."""
LEAN = OPTIONS | {"_nrt": False, "no_cfunc_wrapper": True}
"""Without Numba's runtime (``_nrt=False``) arrays are not reference-counted, which costs more than the work in
short kernels, and a kernel that allocates does not compile."""


# giwt's memory begins with that of DH-Bug, so that DH-Bug's kernels can drive it.
warnings.filterwarnings("ignore", "Record.*has been considered a subtype", numba.NumbaExperimentalFeatureWarning)


def jit_for(function: F, also: Path | None = None, options: dict[str, Any] = LEAN) -> F:
    """Compile ``function``; its cached code is valid as long as nothing changes in what its file imports.

    What ``also`` imports counts, too: a loop that is made from one file's code with functions of another one depends on
    both.
    """
    njit: Any = numba.njit
    with _cached_in(_cache_of(function, also)):
        kernel = njit(**options)(function)
    if not cast("Any", numba.config).DISABLE_JIT:
        _take_plain_types(kernel)
    return cast("F", kernel)


def _take_plain_types(kernel: Any) -> None:
    """Let calls from other kernels compile one version for all numbers written out, not one for each of them.

    ``turn(see, 1)`` and ``turn(see, -1)`` would be two, each with all that it calls.
    """
    find, plain = kernel.get_call_template, cast("Any", types).unliteral

    def get_call_template(args: Any, kws: Mapping[str, Any]) -> Any:
        return find(tuple(map(plain, args)), {name: plain(kind) for name, kind in kws.items()})

    kernel.get_call_template = get_call_template


def _cache_of(function: Callable[..., Any], also: Path | None) -> Path | None:
    config: Any = numba.config
    if config.DISABLE_JIT:
        return None
    own = Path(os.path.realpath(function.__code__.co_filename))
    more = () if also is None else (Path(os.path.realpath(also)),)
    package = function.__module__.partition(".")[0]
    folder = Path(sys.modules[package].__path__[0]) if package.startswith(OF_A_USER) else None
    try:
        states = [closure_state(own, folder), *map(closure_state, more)]
    except OSError:
        return None  # made from text: there is no such file
    return cache_folder(own, hashlib.sha256("".join(states).encode()).hexdigest()[:16])


def jit(function: F) -> F:
    """Compile ``function`` in nopython mode, cached on disk; it may not allocate."""
    return jit_for(function)


def jit_inline(function: F) -> F:
    """Compile ``function`` so that LLVM always inlines it into its caller.

    For tiny scalar helpers, and for what is called for every robot or beam with a `View`, a `Rig`, a `Sim`: such a
    tuple is handed over value by value, three hundred of them, which takes 0.3 us, longer than most of what is called.
    What is rarely reached (a fault, a limited view) stays a call.
    """
    return jit_for(function, options=LEAN | {"forceinline": True})


def jit_inner(function: F) -> F:
    """Compile ``function`` like ``jit_inline``, for calls from other kernels only.

    Without the wrapper that unpacks Python arguments it compiles in a fraction of the time, but a call from
    Python crashes the process: for private helpers (``_name``) of a kernel module.
    """
    if not function.__name__.startswith("_"):
        raise ValueError(f"{function.__name__}: only private kernels can do without a Python wrapper")
    return jit_for(function, options=LEAN | {"forceinline": True, "no_cpython_wrapper": True})


def jit_alloc(function: F) -> F:
    """Compile ``function`` in nopython mode, cached on disk; it may allocate (set-up and evaluation only)."""
    return jit_for(function, options=OPTIONS)


def jit_paste(function: F) -> F:
    """Paste ``function`` into its callers before they are typed.

    For what returns views of arrays of records, and for what few call with so many arrays that the handing over takes
    time.
    """
    return jit_for(function, options=LEAN | {"inline": "always"})
