"""Text files of users: regular ones only, of bounded size, and YAML that says what it seems to say."""

from __future__ import annotations

import codecs
import stat
from pathlib import Path
from typing import Any

import yaml

from swarmscope.errors import InputFileError

MOST_BYTES = 64 << 20


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
    text = read_text(path)
    try:
        return load_yaml(text)
    except RecursionError:
        raise InputFileError(path, "is not YAML (brackets in brackets in brackets)") from None
    except (yaml.YAMLError, ValueError, OverflowError) as error:  # a date or a number that there is not
        raise InputFileError(path, f"is not YAML ({' '.join(str(error).split())})") from None


def load_yaml(text: str) -> Any:
    """Return what YAML says; a key that is given twice, 1_0 and 1:30 (ten and ninety in YAML 1.1) are errors.

    Raises yaml.YAMLError, ValueError, RecursionError.
    """
    return yaml.load(text, Loader=_Loader)  # noqa: S506  a SafeLoader


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
