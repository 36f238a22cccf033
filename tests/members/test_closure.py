"""Import closures: the same imports as ``ast`` finds, and the files that they mean."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from swarmscope.closure import PACKAGE, Import, closure_of, imports_in, libraries_of, module_of, state_of

ROOT = Path(__file__).resolve().parents[2]
OURS = Path(PACKAGE)
FILES = sorted([*OURS.rglob("*.py"), *(ROOT / "tests").rglob("*.py")])
STRANGE = '''
"""import not_this"""
text = 'from a import b'; import real_1, real_2 as r  # import comment
import typing
if typing.TYPE_CHECKING:
    import only_types

    def f(): import only_types_2
# import none
else:
    import real_3
def g():
    from . import (
        one as two,  # import x
        three,
    )
    if TYPE_CHECKING: import only_types_3
    from ..far import four, \\
        five
    try: import real_4
    except ImportError: from real_5.sub import *
    raise ValueError("x") from None
s = """
from not_that import x
"""
q = "it's" ; import real_6
'''


def of_ast(body):
    """The imports that ``ast`` finds, those for type checkers left out."""
    for node in body:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            yield from of_ast(node.orelse)
        elif isinstance(node, ast.Import):
            yield from (Import(alias.name, 0, ()) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield Import(node.module or "", node.level, tuple(alias.name for alias in node.names))
        else:
            yield from of_ast(ast.iter_child_nodes(node))


@pytest.mark.parametrize("text", [STRANGE, *(file.read_text(encoding="utf-8") for file in FILES)], ids=lambda _: "")
def test_the_imports_are_those_that_ast_finds(text):
    assert sorted(imports_in(text)) == sorted(of_ast(ast.parse(text).body))


def write(folder, **files):
    for name, text in files.items():
        path = folder / (name.replace("__", "/") + ".py")
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


def names(closure, folder):
    return {str(file.relative_to(folder)) for file in closure if file.is_relative_to(folder)}


def test_a_users_file_takes_along_what_it_imports_beside_it(tmp_path):
    text = "import helper, scipy\ndef f():\n    from pack.inner import x"
    write(tmp_path, mine=text, helper="from json import loads")
    write(tmp_path, pack__inner="from . import near", pack__near="", unused="", json="import unused")
    (tmp_path / "pack/__init__.py").write_text("")
    closure = closure_of(tmp_path / "mine.py")
    wanted = {"mine.py", "helper.py", "pack/__init__.py", "pack/inner.py", "pack/near.py"}
    assert names(closure, tmp_path) == wanted  # json is the standard library's
    assert libraries_of(closure) == ("scipy",)


def test_the_state_is_that_of_the_contents_wherever_the_files_lie(tmp_path):
    for folder in ("a", "b"):
        write(tmp_path / folder, mine="import helper", helper="x = 1")
    a, b = (closure_of(tmp_path / folder / "mine.py") for folder in ("a", "b"))
    assert state_of(a) == state_of(b)
    (tmp_path / "b/helper.py").write_text("x = 2")
    assert state_of(closure_of(tmp_path / "b/mine.py")) != state_of(a)


def test_packages_on_the_way_count_and_lazy_names_where_they_are_asked_for(tmp_path):
    init = "from lazy.always import a\ndef __getattr__(name):\n    from lazy.sometimes import b\n"
    (tmp_path / "lazy").mkdir()
    (tmp_path / "lazy/__init__.py").write_text(init + "HOMES = {'c': 'lazy.other'}\n")
    write(tmp_path, lazy__always="", lazy__sometimes="", lazy__other="", lazy__plain="", lazy__odd="")
    for text, more in (
        ("import lazy.plain", {"lazy/plain.py"}),
        ("from lazy import b", {"lazy/sometimes.py"}),
        ("from lazy import c", {"lazy/other.py"}),
        ("import lazy", {"lazy/sometimes.py", "lazy/other.py"}),
    ):
        (tmp_path / "mine.py").write_text(text)
        found = names(closure_of(tmp_path / "mine.py"), tmp_path)
        assert found == {"mine.py", "lazy/__init__.py", "lazy/always.py"} | more, text


def test_public_names_of_ours_bring_what_they_need_and_nothing_else(tmp_path):
    (tmp_path / "mine.py").write_text("from swarmscope import Body")
    found = {module_of(file) for file in closure_of(tmp_path / "mine.py")}
    assert {"swarmscope", "swarmscope.onboard.body", "mine"} <= found
    assert "swarmscope.api" not in found


def test_planners_do_not_hang_together():
    closure = {module_of(file) for file in closure_of(OURS / "onboard/planning/nav_scope.py")}
    assert {"swarmscope.onboard.view", "swarmscope.onboard.planning", "swarmscope._jit"} <= closure
    assert "swarmscope.onboard.planning.dh_bug" not in closure
    assert not any(name.startswith(("swarmscope.sim", "swarmscope.cli", "swarmscope.viewing")) for name in closure)


def test_closures_of_all_kernels_are_found_at_once():
    code = """
import time
from pathlib import Path
from swarmscope.closure import PACKAGE, closure_state
files = [f for f in Path(PACKAGE).rglob("*.py") if b"_jit import" in f.read_bytes()]
begun = time.process_time()
print(len({closure_state(f) for f in files}), time.process_time() - begun)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    count, seconds = done.stdout.split()
    assert int(count) > 40
    assert float(seconds) < 0.5  # 0.1 s on an idle core
