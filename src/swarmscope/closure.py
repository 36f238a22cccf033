"""The import closure of a file: the files that can change what it does, found from the imports in them.

Content keys and the cache of compiled kernels cover closures: what a file does not import cannot change it. Every
import counts, those inside functions, too; imports that only a type checker sees do not. The ``__init__.py`` of every
package on the way belongs to a closure, with what it imports when it is loaded; names that it offers lazily
(``__getattr__``) count where they are asked for.

Texts are searched for imports with regular expressions, which takes a fiftieth of the time that ``ast`` takes: closures
are computed while kernels are being imported. ``tests/architecture/test_closure.py`` compares the two.
"""

from __future__ import annotations

import ast
import hashlib
import os
import re
import sys
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

PACKAGE = os.path.dirname(os.path.realpath(__file__))
NAME = os.path.basename(PACKAGE)
OF_A_USER = "swarmscope_file_"
"""What the packages are called into which files of a user are loaded (see ``user_files``)."""
INSTALLED = frozenset({"site-packages", "dist-packages"})
"""Folders in which files that lie side by side have nothing to do with each other."""

# Every branch begins with a plain character: the search skips what begins with no other one.
TOKEN = re.compile(
    r"""
      \"{3} [^"\\]* (?: (?: \\. | "(?!"") ) [^"\\]* )* \"{3} | "[^"\\\n]* (?: \\. [^"\\\n]* )* "
    | '{3} [^'\\]* (?: (?: \\. | '(?!'') ) [^'\\]* )* '{3} | '[^'\\\n]* (?: \\. [^'\\\n]* )* '
    | \#[^\n]*
    | \n(?P<indent>[ \t]*) (?: (?P<line>(?:from|import)\b) | if[ \t]+(?:\w+\.)?(?P<typing>TYPE_CHECKING)[ \t]*: )
    | ;[ \t]*(?P<after>(?:from|import)\b)
    | :[ \t]*(?P<behind>(?:from|import)\b)
    """,
    re.VERBOSE | re.DOTALL,
)
IMPORT = re.compile(
    r"import\b(?P<modules>(?:[^\n;#\\]|\\\n)+)"
    r"|from[ \t]*(?P<module>[.\w \t]+?)(?<=[. \t])import\b(?P<names>[ \t]*\([^)]*\)|(?:[^\n;#\\(]|\\\n)+)"
)
CANDIDATE = re.compile(r"[\n;:][ \t]*(?:from|import)\b")
NOTHING = re.compile(r"#[^\n]*|[\\()]")


class Import(NamedTuple):
    """``import module`` (no names), or ``from module import names``."""

    module: str
    level: int
    """Number of leading dots."""
    names: tuple[str, ...]


class _Place(NamedTuple):
    """Where a file lies: ``root/<parts of its module's name>``."""

    root: str
    parts: tuple[str, ...]
    package: bool
    """The file is an ``__init__.py``."""


Stamp = tuple[int, int] | None


def closure_of(file: Path, folder: Path | None = None) -> tuple[Path, ...]:
    """Return ``file`` and every file that it imports, directly or through others, sorted.

    ``folder`` is where plain imports of a file that is no part of an installed package are looked for: beside it, by
    default. What is found neither there nor in the file's own package nor in this one belongs to a library.
    """
    return tuple(map(Path, _closure(os.path.realpath(file), None if folder is None else os.path.realpath(folder))))


def union_of(files: Iterable[Path]) -> tuple[Path, ...]:
    """Return the closures of several files as one, sorted."""
    return tuple(sorted({found for file in files for found in closure_of(file)}))


def state_of(files: Iterable[Path]) -> str:
    """Return a hash of names and contents of the files; folders in which packages lie do not count."""
    return _state(tuple(map(str, files)))


def closure_state(file: Path, folder: Path | None = None) -> str:
    """Return ``state_of(closure_of(file, folder))``, faster."""
    place = os.path.realpath(file)
    if _is_ours(place):
        return _own_state(place)
    return _state(_closure(place, None if folder is None else os.path.realpath(folder)))


def libraries_of(files: Iterable[Path]) -> tuple[str, ...]:
    """Return the top-level names that the files import from neither the standard library nor one another, sorted."""
    listed = list(map(str, files))
    own = {_place(file).parts[0] for file in listed} | {NAME}
    asked = {
        item.module.partition(".")[0]
        for file in listed
        for item in _imports(file, _stamp(file))
        if item.level == 0
    }
    return tuple(sorted(asked - own - sys.stdlib_module_names))


def module_of(file: Path) -> str:
    """Return the name of the module that a file holds, with the packages round it."""
    return ".".join(_place(os.path.realpath(file)).parts)


def imports_in(text: str) -> list[Import]:
    """Return the imports in the text of a file, in their order, without those for type checkers only."""
    text = "\n" + text
    found: list[Import] = []
    skip_to = 0
    last = max((candidate.end() for candidate in CANDIDATE.finditer(text)), default=0)
    for token in TOKEN.finditer(text):
        if token.start() >= last:
            break
        if token.lastgroup is None or token.start() < skip_to:
            continue
        if token["typing"]:
            skip_to = _end_of_block(text, token)
            continue
        asked = IMPORT.match(text, token.start(token.lastgroup))
        if asked is not None and asked["modules"]:
            found += [Import(name, 0, ()) for name in _names(asked["modules"])]
        elif asked is not None:
            module = asked["module"].replace(" ", "").replace("\t", "")
            bare = module.lstrip(".")
            found.append(Import(bare, len(module) - len(bare), tuple(_names(asked["names"]))))
    return found


def _names(text: str) -> list[str]:
    """Return the names in ``a.b, c as d``, without what they are called here."""
    parts = (part.split() for part in NOTHING.sub(" ", text).split(","))
    return [part[0] for part in parts if part]


def _end_of_block(text: str, head: re.Match[str]) -> int:
    """Return where the block that begins with ``head`` ends: at the next line that is indented as little."""
    line_end = text.find("\n", head.end())
    if line_end < 0 or text[head.end() : line_end].split("#", maxsplit=1)[0].strip():
        return max(line_end, head.end())  # all on one line
    end = re.compile(rf"\n[ \t]{{0,{len(head['indent'])}}}(?![ \t#\n])").search(text, line_end)
    return end.start() if end else len(text)


def _closure(first: str, folder: str | None) -> tuple[str, ...]:
    beside = None
    if not _is_ours(first):
        beside = folder or os.path.dirname(first)
        beside = None if os.path.basename(beside) in INSTALLED else beside
    found, waiting = {first}, [first]
    while waiting:
        file = waiting.pop()
        for other in _direct(file, _stamp(file), None if _is_ours(file) else beside):
            if other not in found:
                found.add(other)
                waiting.append(other)
    return tuple(sorted(found))


def _state(files: tuple[str, ...]) -> str:
    lines = sorted(f"{'.'.join(_place(file).parts)} {_digest(file, _stamp(file))}" for file in files)
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()


@cache
def _own_state(file: str) -> str:
    return _state(_closure(file, None))


def _is_ours(file: str) -> bool:
    return file.startswith(PACKAGE + os.sep)


def _stamp(file: str) -> Stamp:
    """Return what changes when a file does; the files of this package count as they were when first read."""
    if _is_ours(file):
        return None
    about = os.stat(file)
    return about.st_mtime_ns, about.st_size


@cache
def _content(file: str, stamp: Stamp) -> bytes:
    with open(file, "rb") as opened:
        return opened.read()


@cache
def _digest(file: str, stamp: Stamp) -> str:
    return hashlib.sha256(_content(file, stamp)).hexdigest()


@cache
def _imports(file: str, stamp: Stamp) -> tuple[Import, ...]:
    return tuple(imports_in(_content(file, stamp).decode(errors="replace")))


@cache
def _direct(file: str, stamp: Stamp, beside: str | None) -> tuple[str, ...]:
    """Return the files that ``file`` imports."""
    place = _place(file)
    found = set(_packages(place.root, place.parts[: len(place.parts) - (not place.package)]))
    for asked in _when_loaded(file, stamp) if place.package else _imports(file, stamp):
        found.update(_files_of(asked, place, beside))
    return tuple(found - {file})


def _files_of(asked: Import, place: _Place, beside: str | None) -> Iterator[str]:
    """Yield the files of one import in the file at ``place``."""
    parts = tuple(filter(None, asked.module.split(".")))
    if asked.level:
        kept = len(place.parts) + place.package - asked.level
        yield from _module(place.root, place.parts[: max(kept, 0)] + parts, asked.names)
        return
    for root in _roots(parts[0], place, beside):
        if _file(root, parts[:1]):
            yield from _module(root, parts, asked.names)
            return


def _roots(top: str, place: _Place, beside: str | None) -> Iterator[str]:
    """Yield the folders in which the module or package ``top`` would be one of ours or of the user's."""
    if top == place.parts[0] and len(place.parts) > 1:
        yield place.root
    elif top == NAME:
        yield os.path.dirname(PACKAGE)
    if beside is not None and top not in sys.stdlib_module_names:
        yield beside


def _module(root: str, parts: tuple[str, ...], names: tuple[str, ...]) -> Iterator[str]:
    """Yield the files that importing a module, or names from it, loads."""
    yield from _packages(root, parts[:-1])
    file = _file(root, parts)
    if file is not None:
        yield file
        lazy = _lazy(file, _stamp(file)) if file.endswith("__init__.py") else {}
        for name in names or lazy:
            for target in lazy.get(name, ()):
                yield from _module(root, tuple(target.split(".")), ())
    for name in names:
        found = _file(root, (*parts, name))
        if found is not None:
            yield found


def _packages(root: str, parts: tuple[str, ...]) -> Iterator[str]:
    """Yield the ``__init__.py`` of a package and of those round it."""
    for k in range(1, len(parts) + 1):
        file = os.sep.join((root, *parts[:k], "__init__.py"))
        if _exists(file):
            yield file


def _file(root: str, parts: tuple[str, ...]) -> str | None:
    """Return the file of a module, if there is one."""
    name = os.sep.join((root, *parts))
    for file in (f"{name}{os.sep}__init__.py", f"{name}.py") if parts else ():
        if _exists(file):
            return file
    return None


def _exists(file: str) -> bool:
    return _is_file(file) if _is_ours(file) else os.path.isfile(file)


@cache
def _is_file(file: str) -> bool:
    return os.path.isfile(file)


def _place(file: str) -> _Place:
    return _own_place(file) if _is_ours(file) else _find_place(file)


def _find_place(file: str) -> _Place:
    root, name = os.path.split(file)
    parts = [] if name == "__init__.py" else [name.removesuffix(".py")]
    while os.path.basename(root) and os.path.isfile(os.path.join(root, "__init__.py")):
        root, name = os.path.split(root)
        parts.insert(0, name)
    return _Place(root, tuple(parts), file.endswith("__init__.py"))


@cache
def _own_place(file: str) -> _Place:
    return _find_place(file)


@cache
def _when_loaded(file: str, stamp: Stamp) -> tuple[Import, ...]:
    """Return the imports that a package carries out when it is loaded."""
    return tuple(_shallow(_tree(file, stamp).body)) if _imports(file, stamp) else ()


def _tree(file: str, stamp: Stamp) -> ast.Module:
    try:
        return ast.parse(_content(file, stamp))
    except (SyntaxError, ValueError):
        return ast.Module([], [])


def _shallow(body: Iterable[ast.AST]) -> Iterator[Import]:
    """Yield the imports of a block, those inside functions and for type checkers left out."""
    for node in body:
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield from _of_node(node)
        elif isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            yield from _shallow(node.orelse)
        elif not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.expr):
            yield from _shallow(ast.iter_child_nodes(node))


def _of_node(node: ast.Import | ast.ImportFrom) -> Iterator[Import]:
    if isinstance(node, ast.Import):
        yield from (Import(alias.name, 0, ()) for alias in node.names)
    else:
        yield Import(node.module or "", node.level, tuple(alias.name for alias in node.names))


@cache
def _lazy(file: str, stamp: Stamp) -> dict[str, tuple[str, ...]]:
    """Return the modules of the names that a package with a ``__getattr__`` offers lazily.

    They are found from the imports that it shows to type checkers or carries out inside functions, and from tables
    ``{"name": "package.module"}``.
    """
    if b"def __getattr__" not in _content(file, stamp):
        return {}
    package = ".".join(_place(file).parts)
    found: dict[str, list[str]] = {}
    for node in ast.walk(_tree(file, stamp)):
        if isinstance(node, ast.ImportFrom):
            module = _absolute("." * node.level + (node.module or ""), package)
            for alias in node.names:
                found.setdefault(alias.asname or alias.name, []).extend([module, f"{module}.{alias.name}"])
        elif isinstance(node, ast.Dict):
            for key, value in zip(node.keys, node.values, strict=True):
                if isinstance(key, ast.Constant) and isinstance(key.value, str):
                    texts = [c.value for c in ast.walk(value) if isinstance(c, ast.Constant)]
                    found.setdefault(key.value, []).extend(_absolute(t, package) for t in texts if isinstance(t, str))
    return {name: tuple(targets) for name, targets in found.items()}


def _absolute(module: str, package: str) -> str:
    """Return a module's whole name; leading dots count from ``package``."""
    bare = module.lstrip(".")
    level = len(module) - len(bare)
    if not level:
        return bare
    kept = package.split(".")[: len(package.split(".")) + 1 - level]
    return ".".join([*kept, bare] if bare else kept)
