"""Shared by all tests. Runs before anything imports numba."""

from __future__ import annotations

import hashlib
import os
import shutil
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
CACHES = ROOT / ".numba_cache"
KEPT_CACHES = 8


def _source_state(src: Path) -> str:
    """Return a name for the content of all sources, the same as the Makefile's."""
    names = sorted("./" + path.relative_to(src).as_posix() for path in src.rglob("*.py"))
    lines = (f"{hashlib.sha256((src / name).read_bytes()).hexdigest()}  {name}\n" for name in names)
    return hashlib.sha256("".join(lines).encode()).hexdigest()[:16]


def _remove_old_caches(current: Path) -> None:
    """Keep the newest few cache folders."""
    others = [folder for folder in CACHES.iterdir() if folder != current]
    others.sort(key=lambda folder: folder.stat().st_mtime, reverse=True)
    for folder in others[KEPT_CACHES - 1 :]:
        shutil.rmtree(folder, ignore_errors=True)


def _choose_kernel_cache() -> None:
    """Compiled kernels are reused for this state of ``src/`` only.

    Numba renews a cached kernel when the kernel's own file changes, but not when a function that it
    calls from another file does, so a test could pass or fail on code that is no longer there.
    """
    current = CACHES / _source_state(ROOT / "src")
    current.mkdir(parents=True, exist_ok=True)
    os.environ["NUMBA_CACHE_DIR"] = str(current)
    if "PYTEST_XDIST_WORKER" not in os.environ:
        os.utime(current)
        _remove_old_caches(current)


_choose_kernel_cache()
