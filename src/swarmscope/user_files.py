"""A user's ``FILE.py``: read, run once and kept as a module, whatever is wrong with it said in one line.

The files of a folder are loaded into a package that is named after the folder. So their functions have a module that
Numba can cache kernels for and that names can be looked up in, and two users' ``helper.py`` do not meet: ``import
helper`` in such a file means the file beside it (the import is rewritten), if there is one and it is not called like a
module of the standard library. Nothing is added to ``sys.path``. A file is run again when it, or one that it imports
beside it, was edited.
"""

from __future__ import annotations

import ast
import hashlib
import importlib
import importlib.abc
import importlib.machinery
import importlib.util
import os
import re
import stat
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from textwrap import shorten
from types import CodeType, ModuleType
from typing import Any, TypeVar, cast

from swarmscope.closure import NAME, OF_A_USER, closure_state
from swarmscope.errors import InputFileError, SwarmscopeError

Result = TypeVar("Result")
COLOUR = re.compile(r"\x1b\[\d*m")
"""What makes words of the compiler coloured on a terminal."""
RAISED = (Exception, SystemExit, GeneratorExit)
"""What a user's code can raise and should not end the program with."""


def is_file_name(name: str) -> bool:
    """Tell whether this is a Python file's name, not the name of a member."""
    return name.endswith(".py")


def short_name(name: str) -> str:
    """Return what a member is called in titles and folders: its name, or that of its file."""
    return Path(name).stem if is_file_name(name) else name


def whole_path(path: Path | str) -> Path:
    """Return the absolute path, links followed as far as they lead. Errors: InputFileError."""
    try:
        return Path(os.path.realpath(path))
    except ValueError:  # a null character
        raise InputFileError(repr(str(path)), "is not a file's name") from None


def read_code(path: Path) -> bytes:
    """Return the bytes of a regular file; nothing else is opened. Errors: InputFileError."""
    try:
        about = path.stat()
        if stat.S_ISDIR(about.st_mode):
            raise InputFileError(path, "is a folder, not a Python file")
        if not stat.S_ISREG(about.st_mode):
            raise InputFileError(path, "is not a regular file")
        return path.read_bytes()
    except OSError as error:
        raise InputFileError(path, error.strerror or "cannot be read") from None
    except ValueError:
        raise InputFileError(repr(str(path)), "is not a file's name") from None


def compiled(path: Path, change: Callable[[ast.Module], ast.Module] | None = None) -> CodeType:
    """Return the code of a file, its syntax tree changed before. Errors: InputFileError."""
    return _compiled(path, read_code(path), change)


def text_of(path: Path) -> str:
    """Return the text of a user's file as it was when it was loaded, or as it is. Errors: InputFileError."""
    place = Path(os.path.realpath(path))
    loader = getattr(sys.modules.get(_name_of(place)), "__loader__", None)
    text = loader.text if isinstance(loader, _Loader) else read_code(path)
    return text.decode("utf-8", errors="replace")


def _compiled(path: Path, text: bytes, change: Callable[[ast.Module], ast.Module] | None) -> CodeType:
    try:
        if change is None:
            return compile(text, str(path), "exec", dont_inherit=True)
        return compile(change(ast.parse(text, str(path))), str(path), "exec", dont_inherit=True)
    except SyntaxError as error:
        raise InputFileError(path, _not_python(error)) from None
    except (ValueError, RecursionError, MemoryError) as error:
        raise InputFileError(path, f"is not Python: {one_line(error)}") from None


def load_file(path: Path) -> ModuleType:
    """Return the module in a user's file, which is run when this file is new. Errors: InputFileError."""
    if not is_file_name(path.name):
        raise InputFileError(path, "is not called like a Python file (.py)")
    read_code(path)
    place = Path(os.path.realpath(path))
    name = _name_of(place)
    package = name.partition(".")[0]
    _forget_edited(package)
    if name not in sys.modules:
        around = sys.modules.setdefault(package, ModuleType(package, f"What lies in {place.parent}."))
        around.__path__ = [str(place.parent)]
        before = set(sys.modules)
        try:
            guarded(lambda: _run(name, place), place)
        except BaseException:
            for loaded in _loaded(package) - before:
                del sys.modules[loaded]
            raise
    return sys.modules[name]


def _identifier(stem: str) -> str:
    """Return what the module of a file is called: as the file if that is possible."""
    return stem if stem.isidentifier() else f"{re.sub(r'[^a-zA-Z0-9]', '_', stem)}_{_short_hash(stem)}"


def _short_hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:12]


def _name_of(place: Path) -> str:
    return f"{OF_A_USER}{_short_hash(str(place.parent))}.{_identifier(place.stem)}"


def _loaded(package: str) -> set[str]:
    return {name for name in sys.modules if name.startswith(f"{package}.")}


def _forget_edited(package: str) -> None:
    """Forget the modules that are no longer as they were when they were loaded."""
    for name in _loaded(package):
        module = sys.modules[name]
        loader = getattr(module, "__loader__", None)
        if isinstance(loader, _Loader) and loader.state != loader.present_state():
            around, _, last = name.rpartition(".")
            del sys.modules[name]
            if getattr(sys.modules.get(around), last, None) is module:
                delattr(sys.modules[around], last)


def guarded(call: Callable[[], Result], path: Path) -> Result:
    """Call what runs a user's code; what it raises becomes an InputFileError with file and line."""
    try:
        return call()
    except SwarmscopeError:
        raise
    except RAISED as error:
        raise InputFileError(*_where(error, path)) from error


def _where(error: BaseException, path: Path) -> tuple[Path, str]:
    """Return the file in which something was raised, the user's own rather than a library's, and what."""
    if isinstance(error, SyntaxError) and error.filename:
        return Path(error.filename), _not_python(error)
    frames = [Path(frame.filename) for frame in traceback.extract_tb(error.__traceback__)]
    beside = [file for file in frames if file == path or (file.parent == path.parent and file.suffix == ".py")]
    file = beside[-1] if beside else path
    return file, raised(error, file)


def _not_python(error: SyntaxError) -> str:
    place = f"line {error.lineno}: " if error.lineno else ""
    return f"is not Python: {place}{' '.join(str(error.msg).split())}"


def raised(error: BaseException, path: Path) -> str:
    """Return what was raised, and in which line of the user's file."""
    if type(error).__module__.startswith("numba."):
        return _not_compiled(error, path)
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    place = f" in line {lines[-1]}" if lines else ""
    message = one_line(error)
    return f"raised {type(error).__name__}{place}{': ' if message else ''}{message}"


def _not_compiled(error: BaseException, path: Path) -> str:
    """Return what the compiler says of a user's kernel: its own words without the frames, and the line in the file."""
    text = COLOUR.sub("", str(error))
    lines = re.findall(rf'File "(?:[^"]*[/\\])?{re.escape(path.name)}", line (\d+)', text)
    place = f" in line {lines[0]}" if lines else ""  # the innermost comes first
    said = [line.strip() for line in text.splitlines() if line.strip() and not line.startswith("Failed in ")]
    what = shorten(said[0] if said else type(error).__name__, 200, placeholder=" ...")
    return f"does not compile{place}: {what} (without jit it runs as plain Python, slower)"


def one_line(error: BaseException) -> str:
    """Return the message of an error in one line."""
    return " ".join(str(error).split())


def line_of(path: Path, name: str) -> str:
    """Return ``line N: `` for the line at the top of a file in which ``name`` is defined, nothing if there is none."""
    for node in ast.parse(path.read_bytes()).body:
        targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
        names = {target.id for target in targets if isinstance(target, ast.Name)} | {getattr(node, "name", None)}
        if name in names:
            return f"line {node.lineno}: "
    return ""


def _run(name: str, path: Path) -> None:
    _install_finder()
    spec = _spec(name, str(path))
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    cast("importlib.abc.Loader", spec.loader).exec_module(module)
    setattr(sys.modules[name.partition(".")[0]], name.rpartition(".")[2], module)


class _Loader(importlib.machinery.SourceFileLoader):
    """Loads a file whose plain imports mean files beside the user's; no byte code is kept."""

    state = ""
    """Of all that the file imports, when it was loaded."""
    text = b""
    """Of the file, then."""

    def get_code(self, fullname: str) -> CodeType:
        """Return the code of the file."""
        self.state, self.text = self.present_state(), read_code(Path(self.path))
        package = self.name.partition(".")[0]
        beside = _Beside(package, sys.modules[package].__path__[0])
        change = lambda tree: ast.fix_missing_locations(beside.visit(tree))  # noqa: E731
        return _compiled(Path(self.path), self.text, change)

    def present_state(self) -> str:
        """Return the state of all that the file imports; '' if it is gone."""
        try:
            return closure_state(Path(self.path), Path(sys.modules[self.name.partition(".")[0]].__path__[0]))
        except OSError:
            return ""


class _Beside(ast.NodeTransformer):
    """Makes ``import helper`` mean the file in ``folder``."""

    def __init__(self, package: str, folder: str) -> None:
        self.package, self.folder = package, folder

    def visit_Import(self, node: ast.Import) -> list[ast.stmt]:
        """Change those of its names that lie beside the file."""
        steps = [step for alias in node.names for step in self._steps(alias)]
        return [ast.copy_location(ast.Import([step]), node) for step in steps]

    def visit_ImportFrom(self, node: ast.ImportFrom) -> ast.stmt:
        """Change the module if it lies beside the file."""
        if node.level or not node.module or not self._is_here(node.module):
            return node
        return ast.copy_location(ast.ImportFrom(f"{self.package}.{node.module}", node.names, 0), node)

    def _steps(self, alias: ast.alias) -> list[ast.alias]:
        if not self._is_here(alias.name):
            return [alias]
        top, dot, _ = alias.name.partition(".")
        whole = f"{self.package}.{alias.name}"
        if alias.asname or not dot:
            return [ast.alias(whole, alias.asname or alias.name)]
        return [ast.alias(whole, None), ast.alias(f"{self.package}.{top}", top)]  # ``a.b`` is loaded, ``a`` is named

    def _is_here(self, module: str) -> bool:
        top = module.partition(".")[0]
        if top == NAME or top in sys.stdlib_module_names:
            return False
        return _file_in(self.folder, top) is not None


class _Finder(importlib.abc.MetaPathFinder):
    """Finds the files beside a user's file, in the package that it was loaded into."""

    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> importlib.machinery.ModuleSpec | None:
        """Return how to load a module of such a package."""
        if not fullname.startswith(OF_A_USER) or path is None:
            return None
        file = next(filter(None, (_file_in(folder, fullname.rpartition(".")[2]) for folder in path)), None)
        return None if file is None else _spec(fullname, file)


def _spec(name: str, file: str) -> importlib.machinery.ModuleSpec:
    inside = [os.path.dirname(file)] if os.path.basename(file) == "__init__.py" else None
    spec: Any = importlib.util.spec_from_file_location(
        name, file, loader=_Loader(name, file), submodule_search_locations=inside
    )
    return cast("importlib.machinery.ModuleSpec", spec)


def _file_in(folder: str, name: str) -> str | None:
    for file in (os.path.join(folder, name, "__init__.py"), os.path.join(folder, f"{name}.py")):
        if os.path.isfile(file):
            return file
    return None


def _install_finder() -> None:
    if not any(isinstance(finder, _Finder) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Finder())
