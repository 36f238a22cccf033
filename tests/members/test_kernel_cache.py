"""Compiled kernels are kept as long as nothing changes in what their file imports, and no longer."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from string import Template

import pytest
from numba.core.event import install_recorder

from swarmscope.api import simulate
from swarmscope.cli.new import PLANNER

CODE = """
import json
from pathlib import Path
from swarmscope.user_files import load_file
found = {}
for name in ("one", "two"):
    kernel = load_file(Path(name + ".py")).kernel
    value = kernel(2.0)
    found[name] = [value, sum(kernel.stats.cache_hits.values())]
print(json.dumps(found))
"""
EDITS = """
from pathlib import Path
from swarmscope.user_files import load_file
one, two = Path("one.py"), Path("two.py")
for k in range(6):
    two.write_text(two.read_text().replace(f"{k}.0", f"{k + 1}.0"))
    print([load_file(file).kernel(2.0) for file in (one, two)])
"""
KERNEL = "from swarmscope._jit import jit\n{0}\n@jit\ndef kernel(x):\n    return {1}\n"


def python(code, folder):
    """What the code prints, with a cache of its own."""
    environment = {k: v for k, v in os.environ.items() if k not in ("NUMBA_CACHE_DIR", "NUMBA_DISABLE_JIT")}
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=folder,
        env=environment | {"SWARMSCOPE_CACHE": str(folder / "cache")},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    return done.stdout


def run(folder):
    """The kernels' values, and which of them came from the disk."""
    found = json.loads(python(CODE, folder))
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
    (tmp_path / "two.py").write_text(KERNEL.format("", "0.0 * x"))
    assert python(EDITS, tmp_path).splitlines() == [f"[2.0, {2.0 * k}]" for k in range(1, 7)]
    states = {place.name.partition("-")[0]: list(place.iterdir()) for place in (tmp_path / "cache/kernels").iterdir()}
    assert (len(states["one"]), len(states["two"])) == (1, 4)


@pytest.mark.slow
@pytest.mark.skipif("NUMBA_DISABLE_JIT" in os.environ, reason="needs compiled kernels")
def test_editing_a_planner_compiles_its_own_kernels_only(tmp_path):
    def run(planner):
        return simulate("swap", planner=str(planner), robots=2, progress=False, limit_s=1.0, lidar__beams=90)

    own = tmp_path / "one.py"
    own.write_text(Template(PLANNER).substitute(name="one", label="one"))
    run(own)
    own.write_text(own.read_text().replace("] = 0.05", "] = 0.06"))
    # What this process compiles: other processes may fill the same cache at the same time.
    with install_recorder("numba:compile") as compiled:
        run(own)
        run("nav-scope")
    kernels = [event.data["dispatcher"].py_func for _, event in compiled.buffer if event.is_start]
    assert {Path(kernel.__code__.co_filename).name for kernel in kernels} == {"one.py"}
    assert {kernel.__name__ for kernel in kernels} <= {"decide", "step_one"}
