"""The error tree: one root, children carry what was wrong and where."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

LONGEST = 400
"""Characters that a message repeats of a name, a place or a path."""


class SwarmscopeError(Exception):
    """Root of all errors that a user can cause or meet; the command line prints it without a traceback."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel between processes as message and fields: exceptions are else made anew by ``__init__``."""
        return _made_anew, (type(self), self.args), self.__dict__


def _made_anew(kind: type[SwarmscopeError], args: tuple[object, ...]) -> SwarmscopeError:
    return kind.__new__(kind, *args)


class UnknownNameError(SwarmscopeError):
    """A name that is not among the valid ones; names the nearest."""

    def __init__(self, kind: str, name: str, valid: Iterable[str], where: str = "") -> None:
        self.kind, self.name, self.valid, self.where = kind, name, sorted(valid), where
        place = f"{where}: " if where else ""
        super().__init__(f"{place}unknown {kind} '{clipped(name)}'{nearest_hint(name, self.valid)}")


class ConfigError(SwarmscopeError):
    """A configuration value that is wrong; says at which place and why."""

    def __init__(self, where: str, why: str) -> None:
        self.where, self.why = where, why
        super().__init__(f"{clipped(where)}: {why}")


class InputFileError(SwarmscopeError):
    """A file that is missing, torn or of the wrong kind."""

    def __init__(self, path: object, why: str) -> None:
        self.path, self.why = str(path), why
        super().__init__(f"{clipped(self.path)}: {why}")


class MissingExtraError(SwarmscopeError):
    """An optional part whose packages are not installed."""

    def __init__(self, feature: str, extra: str) -> None:
        self.feature, self.extra = feature, extra
        super().__init__(f"{feature} needs an optional part: pip install 'swarmscope[{extra}]'")


class MissingPackageError(SwarmscopeError):
    """A package of others that one function needs and that is not installed."""

    def __init__(self, feature: str, package: str) -> None:
        self.feature, self.package = feature, package
        super().__init__(f"{feature} needs {package}: pip install {package}")


class UnsolvableWorldError(SwarmscopeError):
    """A world in which a robot has no way from its start to its goal, or cannot stand where it is put."""


def nearest_hint(name: str, valid: Iterable[str]) -> str:
    """Return '; did you mean ...?' and the list of valid names, for the end of an error message."""
    names = list(valid)
    close = difflib.get_close_matches(name, names, n=1, cutoff=0.5)
    hint = f"; did you mean '{close[0]}'?" if close else ""
    return f"{hint} (valid: {', '.join(names)})"


def clipped(name: str) -> str:
    """Return a name as a message repeats it: a very long one without its middle."""
    half = LONGEST // 2
    return name if len(name) <= LONGEST else f"{name[:half]} ... {name[-half:]}"
