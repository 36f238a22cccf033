"""Shared by all tests. Runs before anything imports numba."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from hypothesis import settings

os.environ.setdefault("SWARMSCOPE_CACHE", str(Path(__file__).resolve().parent.parent / ".numba_cache"))

# One thread for numpy's, SciPy's and scikit-learn's own work: where tests run beside each other, several would spend
# most of their time waiting for each other.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# Many tests start processes. Without byte code, which some machines are set not to write, each of them would spend
# several seconds on compiling the same libraries.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# No deadlines: the first call of a kernel compiles it. No database: what is drawn depends on nothing but the tests.
settings.register_profile("fixed", derandomize=True, deadline=None, database=None)
settings.register_profile("fuzz", derandomize=False, deadline=None, database=None, max_examples=500, print_blob=True)
settings.load_profile("fixed")
