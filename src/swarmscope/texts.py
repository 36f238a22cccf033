"""Text files of users: regular ones only, of bounded size, and YAML that says what it seems to say."""

from __future__ import annotations

import codecs
import stat
from pathlib import Path
from typing import Any

import yaml

from swarmscope.errors import InputFileError

MOST_BYTES = 64 << 20
MOST_YAML_BYTES = 4 << 20
"""Of YAML, which takes four seconds a megabyte to read (the faster reader in C crashes on deep nesting)."""
IN_TEXT = ' in "<unicode string>",'
"""How the reader of YAML calls what is not a file of its own."""
MOST_REPEATED, MOST_NODES = 20, 10_000
"""Aliases may make so many times as many values of a text as it has, and so many more."""


def check_regular(path: Path, most_bytes: int | None = MOST_BYTES) -> None:
    """Raise an InputFileError for what is no regular file (a pipe or a device may never end), or too large a one.

    With ``most_bytes`` None it may be of any size.
    """
    try:
        found = path.stat()
    except (OSError, ValueError) as error:
        raise InputFileError(path, f"cannot be read ({getattr(error, 'strerror', None) or error})") from None
    if stat.S_ISDIR(found.st_mode):
        raise InputFileError(path, "is a folder")
    if not stat.S_ISREG(found.st_mode):
        raise InputFileError(path, "is no regular file")
    if most_bytes is not None and found.st_size > most_bytes:
        raise InputFileError(path, f"is larger than {most_bytes >> 20} MiB")


def read_text(path: Path, most_bytes: int = MOST_BYTES) -> str:
    """Return the text of a regular file, without a byte order mark; UTF-16 has one. Errors: InputFileError."""
    check_regular(path, most_bytes)
    try:
        with path.open("rb") as file:
            wide = file.read(2) in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
        return path.read_text(encoding="utf-16" if wide else "utf-8-sig")
    except UnicodeError:
        raise InputFileError(path, "is not text") from None
    except OSError as error:
        raise InputFileError(path, f"cannot be read ({error.strerror})") from None


def read_yaml(path: Path) -> Any:
    """Return what a YAML file holds. Errors: InputFileError."""
    text = read_text(path, MOST_YAML_BYTES)
    try:
        return load_yaml(text)
    except RecursionError:
        raise InputFileError(path, "is not YAML (brackets in brackets in brackets)") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # a date or a number that there is not
        raise InputFileError(path, f"is not YAML ({' '.join(str(error).split()).replace(IN_TEXT, '')})") from None


def load_yaml(text: str) -> Any:
    """Return what YAML says; a key that is given twice, 1_0 and 1:30 (ten and ninety in YAML 1.1) are errors.

    Raises yaml.YAMLError, ValueError, RecursionError.
    """
    loader = _Loader(text)
    try:
        node = loader.get_single_node()
        if node is None:
            return None
        _check_aliases(node)
        return loader.construct_document(node)
    finally:
        loader.dispose()


def _check_aliases(root: yaml.Node) -> None:
    """Raise a yaml.YAMLError for aliases that stand for far more than the text says, or for what contains them."""
    sizes: dict[int, int | None] = {}
    whole = _size(root, sizes)
    if whole > MOST_REPEATED * len(sizes) + MOST_NODES:
        raise _error(f"its aliases stand for {whole:.3g} values", root)


def _size(node: yaml.Node, sizes: dict[int, int | None]) -> int:
    """Return how many nodes there are in a node, those of aliases each time that they stand somewhere."""
    if id(node) in sizes:
        known = sizes[id(node)]
        if known is None:
            raise _error("an alias stands within what it stands for", node)
        return known
    sizes[id(node)] = None
    size = 1
    if isinstance(node, yaml.SequenceNode):
        size += sum(_size(part, sizes) for part in node.value)
    elif isinstance(node, yaml.MappingNode):
        size += sum(_size(key, sizes) + _size(value, sizes) for key, value in node.value)
    sizes[id(node)] = size
    return size


class _Loader(yaml.SafeLoader):
    """The safe loader, without surprises."""

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Any, Any]:
        """Return a mapping; refuse a key that is given twice."""
        if isinstance(node, yaml.MappingNode):
            seen = set()
            for key, _ in node.value:
                if isinstance(key, yaml.ScalarNode) and key.tag != "tag:yaml.org,2002:merge":
                    if key.value in seen:
                        raise _error(f"'{key.value}' is given twice", key)
                    seen.add(key.value)
        found: dict[Any, Any] = super().construct_mapping(node, deep)
        return found

    def construct_number(self, node: Any) -> int | float:
        """Return a number; refuse spellings that few expect to be one."""
        text = node.value
        if "_" in text or ":" in text:
            raise _error(f"{text} is {self._value_of(node)} in YAML 1.1: write that, or quote it as text", node)
        return self._value_of(node)

    def _value_of(self, node: Any) -> int | float:
        kind = node.tag.rpartition(":")[2]
        value: int | float = self.construct_yaml_int(node) if kind == "int" else self.construct_yaml_float(node)
        return value


for _kind in ("int", "float"):
    _Loader.add_constructor(f"tag:yaml.org,2002:{_kind}", _Loader.construct_number)


def _error(what: str, node: Any) -> yaml.YAMLError:
    return yaml.constructor.ConstructorError(None, None, what, node.start_mark)
