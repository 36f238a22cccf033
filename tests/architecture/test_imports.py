"""The on-board part needs numpy and numba and nothing else; sources keep the kernel rules."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

SRC = Path(__file__).resolve().parents[2] / "src" / "swarmscope"
BLOCKED = (
    "scipy",
    "matplotlib",
    "pydantic",
    "typer",
    "rich",
    "yaml",
    "PIL",
    "navground",
    "onnxruntime",
    "swarmscope.sim",
    "swarmscope.tasks",
)
ONBOARD = sorted(SRC.glob("onboard/**/*.py"))
LIBRARIES = {"planning/orca.py": "navground", "network/model.py": "onnxruntime"}
"""Planners that a library helps; the library is loaded when the planner is used."""
SOURCES = sorted(SRC.glob("**/*.py"))


def module_of(path):
    parts = path.relative_to(SRC.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports_of(path):
    """The modules that a file imports, anywhere in it."""
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and not node.level:
            yield from [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]


def test_the_on_board_part_imports_without_everything_else():
    code = f"""
import importlib, sys
class Block:
    def find_spec(self, name, path=None, target=None):
        if any(name == b or name.startswith(b + ".") for b in {BLOCKED!r}):
            raise ImportError("blocked: " + name)
sys.meta_path.insert(0, Block())
for name in {[module_of(p) for p in ONBOARD]!r}:
    importlib.import_module(name)
try:
    import pydantic
except ImportError:
    print("ok")
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    assert done.stdout == "ok\n"
    assert len(ONBOARD) > 15


@pytest.mark.parametrize("path", ONBOARD, ids=module_of)
def test_on_board_modules_import_only_what_a_robot_has(path):
    ours = ("onboard", "_jit", "held", "geometry", "errors", "members", "bounds", "user_files", "closure")
    allowed = ("numpy", *(f"swarmscope.{name}" for name in ours))
    library = LIBRARIES.get(path.relative_to(SRC / "onboard").as_posix())
    for name in set(imports_of(path)) - {"swarmscope"}:
        root = name.split(".")[0]
        assert name.startswith(allowed) or root in sys.stdlib_module_names or root == library, name


@pytest.mark.parametrize("path", [p for p in SOURCES if p.name not in ("_jit.py", "held.py")], ids=module_of)
def test_numba_is_configured_in_one_place(path):
    names = {name.split(".")[0] for name in imports_of(path)}
    assert not names & {"numba", "llvmlite"} or path.parts[-2:] == ("judging", "provenance.py")


JITS = {
    f.name
    for f in ast.parse((SRC / "_jit.py").read_text(encoding="utf-8")).body
    if isinstance(f, ast.FunctionDef)
}
KERNEL_PARTS = [p for p in SOURCES if p.relative_to(SRC).parts[0] in ("onboard", "sim")]


@pytest.mark.parametrize("path", KERNEL_PARTS, ids=module_of)
def test_robots_and_world_draw_no_unkeyed_random_numbers(path):
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert not any(name.split(".")[0] in ("random", "secrets") for name in imports_of(path))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and node.attr == "random":
            assert not (isinstance(node.value, ast.Name) and node.value.id in ("np", "numpy")), node.lineno


def decorated(path):
    """(function, decorator names) of every function at the top of a file."""
    for node in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.FunctionDef):
            yield node, [d.id if isinstance(d, ast.Name) else ast.unparse(d) for d in node.decorator_list]


@pytest.mark.parametrize("path", KERNEL_PARTS, ids=module_of)
def test_kernels_are_decorated_plainly_and_neither_print_nor_raise(path):
    for function, decorators in decorated(path):
        if not JITS & set(decorators):
            assert not any("jit" in d or "vectorize" in d for d in decorators), (function.name, decorators)
            continue
        assert len(decorators) == 1, function.name
        for node in ast.walk(function):
            assert not isinstance(node, (ast.Raise, ast.Try, ast.Assert, ast.With)), (
                function.name,
                node.lineno,
            )
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
                assert node.func.id not in ("print", "open", "eval", "exec"), (function.name, node.lineno)


def test_the_source_tree_is_read_at_all():
    kernels = [f.name for p in KERNEL_PARTS for f, d in decorated(p) if "jit" in d]
    assert {"jit", "jit_inline"} <= JITS
    assert len(kernels) > 40
    everything = {f.name for p in KERNEL_PARTS for f, d in decorated(p) if JITS & set(d)}
    assert {"guard", "safe_directions", "sense", "move"} <= everything


def code_at_run_time(node):
    """A node and all below it but what stands under ``if TYPE_CHECKING:``."""
    yield node
    checked_only = isinstance(node, ast.If) and ast.unparse(node.test) in ("TYPE_CHECKING", "typing.TYPE_CHECKING")
    for child in node.orelse if checked_only else ast.iter_child_nodes(node):
        yield from code_at_run_time(child)


def import_graph(sources):
    """{module: modules of these sources that its code imports, anywhere in it}; a name counts for its module."""
    graph = {}
    for module, text in sources.items():
        names = set()
        for node in code_at_run_time(ast.parse(text)):
            if isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                assert not node.level, f"{module} imports relatively"
                whole = {f"{node.module}.{alias.name}" for alias in node.names}
                names |= whole if whole <= set(sources) else {node.module} | whole
        graph[module] = names & set(sources) - {module}
    return graph


def circles(graph):
    """The sets of two and more modules that all reach one another."""
    reached = {}
    for module in graph:
        reached[module], ahead = set(), [module]
        while ahead:
            new = graph[ahead.pop()] - reached[module]
            reached[module] |= new
            ahead += new
    together = {frozenset(m for m in reached[module] if module in reached[m]) for module in graph}
    return sorted(sorted(members) for members in together if members)


def test_no_modules_import_one_another():
    graph = import_graph({module_of(path): path.read_text(encoding="utf-8") for path in SOURCES})
    assert "swarmscope.disk.rules" in graph["swarmscope.disk.geodesic"]
    assert circles(graph) == []


def test_circles_are_found_also_through_functions_but_not_through_types():
    sources = {
        "p.a": "from p import b",
        "p.b": "def f():\n    if f:\n        import p.c",
        "p.c": "from p.a import name",
        "p.d": "import p.a\nif TYPE_CHECKING:\n    import p.e",
        "p.e": "from p.d import name",
        "p": "",
    }
    assert circles(import_graph(sources)) == [["p.a", "p.b", "p.c"]]
