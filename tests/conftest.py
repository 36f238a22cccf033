"""Shared by all tests. Runs before anything imports numba."""

from __future__ import annotations

import os
from pathlib import Path

os.environ.setdefault("SWARMSCOPE_CACHE", str(Path(__file__).resolve().parent.parent / ".numba_cache"))
