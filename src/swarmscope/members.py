"""How members are found: planners, tasks. One rule for all kinds.

A member is a Python file that defines a few names. It is one of the files of a folder of this package, or the module
of an installed package that an entry point names, or a user's ``FILE.py``. Its own file is read only to learn what
members are called; it is imported when one of them is asked for.
"""

from __future__ import annotations

import ast
import importlib
import importlib.util
import inspect
import re
from collections.abc import Callable
from functools import cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from swarmscope.errors import ConfigError, InputFileError, UnknownNameError
from swarmscope.user_files import guarded, is_file_name, line_of, load_file, read_code, whole_path

NAMED = re.compile(rb"""^NAME[ ]*=[ ]*(["'])([^"'\n]+)\1""", re.MULTILINE)


class Need(NamedTuple):
    """A name that the file of a member must define."""

    name: str
    what: str
    """For error messages: 'a line of text'."""
    fits: Callable[[Any], bool]


class Kind(NamedTuple):
    """A kind of members."""

    word: str
    """'task'"""
    package: str
    """The package whose files are members: those whose names do not begin with '_'."""
    group: str
    """The group of entry points that name further ones."""
    needs: tuple[Need, ...] = ()
    leave_out: frozenset[str] = frozenset()
    """Files of the folder that are no members."""


class Found(NamedTuple):
    """Where a member is."""

    name: str
    """What it was asked for by: a name, or a file as it was written."""
    module: str | None
    """To be imported; None: a user's file."""
    file: Path


def is_text(value: Any) -> bool:
    """Tell whether this is text with something in it."""
    return isinstance(value, str) and bool(value.strip())


def text(name: str) -> Need:
    """Return the need for a line of text."""
    return Need(name, "a line of text", is_text)


def names_of(kind: Kind) -> list[str]:
    """Return the names of all members that are installed, in alphabetical order."""
    return sorted({*_shipped(kind), *_installed(kind)}, key=lambda name: (name.lower(), name))


def find(kind: Kind, name: str) -> Found:
    """Return where a member is, without importing it. Errors: UnknownNameError, InputFileError, ConfigError."""
    if is_file_name(name):
        read_code(Path(name))
        return Found(name, None, whole_path(name))
    if name in _shipped(kind):
        module = _shipped(kind)[name]
        return Found(name, module, _folder(kind) / f"{module.rpartition('.')[2]}.py")
    if name not in _installed(kind):
        raise UnknownNameError(kind.word, name, names_of(kind))
    point = _only(kind, _installed(kind)[name])
    return Found(name, point.module, _source(kind, point))


def load(kind: Kind, name: str) -> ModuleType:
    """Return the module of a member. Errors: those of ``find``; InputFileError for whatever is wrong with its file."""
    found = find(kind, name)
    module = load_file(found.file) if found.module is None else _imported(found.module, found.file)
    check(module, kind, found.file)
    return module


def _shown(value: Any) -> str:
    """Return a value in a few words: a function as what it is called with."""
    function = getattr(value, "py_func", value)
    text = str(inspect.signature(function)) if inspect.isfunction(function) else repr(value)
    return " ".join(text.split())[:60]


def check(module: ModuleType, kind: Kind, file: Path) -> None:
    """Raise an InputFileError if a module lacks something that members of its kind define."""
    for need in kind.needs:
        if not hasattr(module, need.name):
            raise InputFileError(file, f"has no {need.name} ({need.what}), which every {kind.word} defines")
        value = getattr(module, need.name)
        if not need.fits(value):
            shown = _shown(value)
            raise InputFileError(file, f"{line_of(file, need.name)}{need.name} is {shown}, wanted {need.what}")


def told_by(file: Path, name: str) -> str:
    """Return the text that a file assigns to ``name`` at its top, '' if there is none; nothing is imported."""
    for node in _assignments(read_code(file)):
        if _target(node) == name and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            return node.value.value
    return ""


def _imported(module: str, file: Path) -> ModuleType:
    return guarded(lambda: importlib.import_module(module), file)


@cache
def _shipped(kind: Kind) -> dict[str, str]:
    """Return the module of every member in the folder of this package."""
    files = sorted(_folder(kind).glob("*.py"))
    members = [file for file in files if not file.stem.startswith("_") and file.stem not in kind.leave_out]
    return {name: f"{kind.package}.{file.stem}" for file in members for name in _names_in(file)}


def _folder(kind: Kind) -> Path:
    spec = importlib.util.find_spec(kind.package)
    assert spec is not None and spec.submodule_search_locations  # noqa: S101  a package of ours
    return Path(next(iter(spec.submodule_search_locations)))


def _names_in(file: Path) -> list[str]:
    """Return what the members of a file are called: its NAME and the keys of VARIANTS, if it has some."""
    code = file.read_bytes()
    names = [named.decode() for _, named in NAMED.findall(code)]
    for node in _assignments(code) if b"\nVARIANTS" in code else ():
        if _target(node) == "VARIANTS" and isinstance(node.value, ast.Dict):
            names += [str(key.value) for key in node.value.keys if isinstance(key, ast.Constant)]
    return list(dict.fromkeys(names))


def _assignments(code: bytes) -> list[ast.Assign | ast.AnnAssign]:
    """Return the assignments at the top of a file; none if it is not Python."""
    try:
        return [node for node in ast.parse(code).body if isinstance(node, ast.Assign | ast.AnnAssign)]
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return []


def _target(node: ast.Assign | ast.AnnAssign) -> str:
    target = node.targets[0] if isinstance(node, ast.Assign) else node.target
    return target.id if isinstance(target, ast.Name) else ""


@cache
def _installed(kind: Kind) -> dict[str, tuple[EntryPoint, ...]]:
    """Return the entry points of a kind by name; those called like a member of ours do not count."""
    found: dict[str, list[EntryPoint]] = {}
    for point in entry_points(group=kind.group):
        if point.name not in _shipped(kind):
            found.setdefault(point.name, []).append(point)
    return {name: tuple(points) for name, points in found.items()}


def _only(kind: Kind, points: tuple[EntryPoint, ...]) -> EntryPoint:
    if len({point.value for point in points}) > 1:
        which = " and ".join(sorted(point.value for point in points))
        raise ConfigError(f"{kind.word} '{points[0].name}'", f"is in several installed packages: {which}")
    return points[0]


def _source(kind: Kind, point: EntryPoint) -> Path:
    """Return the file of an entry point's module."""
    where = Path(f"{kind.word} '{point.name}' ({point.value}, entry point of {kind.group})")
    spec = guarded(lambda: importlib.util.find_spec(point.module), where)
    if spec is None or not spec.origin or not spec.origin.endswith(".py"):
        raise InputFileError(where, "is not installed as a Python file")
    return Path(spec.origin)
