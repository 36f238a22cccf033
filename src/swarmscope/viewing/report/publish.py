"""Files put into their place: all of them complete, or the earlier ones as they were."""

from __future__ import annotations

import errno
import os
import re
import shutil
from contextlib import suppress
from pathlib import Path

from swarmscope.errors import SwarmscopeError

PARTIAL = re.compile(r"\.report\.partial-(\d+)")


def put_in_place(out: Path, contents: dict[str, bytes]) -> None:
    """Write ``contents`` (path below ``out`` -> bytes); nothing is replaced before everything is on the disk.

    The last entry is renamed last. Raises SwarmscopeError with the place when it cannot be written.
    """
    partial = out / f".report.partial-{os.getpid()}"
    try:
        out.mkdir(parents=True, exist_ok=True)
        _tidy(out)
        partial.mkdir()
        try:
            for name, content in contents.items():
                _write(partial / name, content)
            for name in contents:
                (out / name).parent.mkdir(parents=True, exist_ok=True)
                (partial / name).replace(out / name)
        finally:
            shutil.rmtree(partial, ignore_errors=True)
    except OSError as error:
        reason = "the disk is full" if error.errno == errno.ENOSPC else error.strerror or str(error)
        raise SwarmscopeError(f"{out}: cannot write the report: {reason}") from error


def _write(path: Path, content: bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _tidy(out: Path) -> None:
    """Remove what killed writers left."""
    for entry in out.iterdir():
        match = PARTIAL.fullmatch(entry.name)
        if match and not _is_alive(int(match[1])):
            shutil.rmtree(entry, ignore_errors=True)


def _is_alive(pid: int) -> bool:
    if pid == os.getpid():
        return False
    with suppress(PermissionError):
        try:
            os.kill(pid, 0)
        except (ProcessLookupError, OverflowError):
            return False
    return True
