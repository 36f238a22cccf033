"""Compiled kernels are kept as long as nothing changes in what their file imports, and no longer."""

from __future__ import annotations

import json
import os
import subprocess
import sys

CODE = """
import json, sys
from pathlib import Path
from swarmscope.user_files import load_file
found = {}
for name in ("one", "two"):
    kernel = load_file(Path(name + ".py")).kernel
    value = kernel(2.0)
    found[name] = [value, sum(kernel.stats.cache_hits.values())]
print(json.dumps(found))
"""
KERNEL = "from swarmscope._jit import jit\n{0}\n@jit\ndef kernel(x):\n    return {1}\n"


def run(folder):
    """The kernels' values, and which of them came from the disk."""
    environment = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT")}
    done = subprocess.run(
        [sys.executable, "-c", CODE],
        cwd=folder,
        env=environment | {"SWARMSCOPE_CACHE": str(folder / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found = json.loads(done.stdout)
    return {name: value for name, (value, _) in found.items()}, {name for name, (_, hits) in found.items() if hits}


def test_editing_a_file_compiles_what_imports_it_and_nothing_else(tmp_path):
    (tmp_path / "shared.py").write_text(KERNEL.format("", "x + 1.0").replace("kernel", "shared"))
    (tmp_path / "one.py").write_text(KERNEL.format("from shared import shared", "10.0 * shared(x)"))
    (tmp_path / "two.py").write_text(KERNEL.format("", "3.0 * x"))
    assert run(tmp_path) == ({"one": 30.0, "two": 6.0}, set())
    assert run(tmp_path) == ({"one": 30.0, "two": 6.0}, {"one", "two"})
    (tmp_path / "two.py").write_text(KERNEL.format("", "4.0 * x"))
    assert run(tmp_path) == ({"one": 30.0, "two": 8.0}, {"one"})
    (tmp_path / "shared.py").write_text(KERNEL.format("", "x + 2.0").replace("kernel", "shared"))
    assert run(tmp_path) == ({"one": 40.0, "two": 8.0}, {"two"})
    assert run(tmp_path) == ({"one": 40.0, "two": 8.0}, {"one", "two"})


def test_few_states_of_a_file_are_kept(tmp_path):
    (tmp_path / "one.py").write_text(KERNEL.format("", "x"))
    for k in range(6):
        (tmp_path / "two.py").write_text(KERNEL.format("", f"{k}.0 * x"))
        run(tmp_path)
    states = {place.name.partition("-")[0]: list(place.iterdir()) for place in (tmp_path / "cache/kernels").iterdir()}
    assert (len(states["one"]), len(states["two"])) == (1, 4)
