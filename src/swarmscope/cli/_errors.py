"""Errors as people want them: one or two plain lines and an exit code, no traceback."""

from __future__ import annotations

import errno
import os
import signal
import sys
import threading
import traceback
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, NoReturn

import typer
from typer.core import TyperGroup

from swarmscope.errors import SwarmscopeError

FAILED, FAULT, INTERRUPTED = 2, 70, 130
"""What a user can mend, what only we can (EX_SOFTWARE), and Ctrl-C."""
AGAIN_S = 0.02
"""After this a Ctrl-C that was dropped is sent again."""
TRACEBACK = "SWARMSCOPE_TRACEBACK"
"""Environment variable: set, an error that nobody thought of is shown in full."""


class PlainErrors(TyperGroup):
    """The group of all commands; turns what goes wrong in them into a message and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        words = [*ctx._protected_args, *ctx.args]
        _open_what_is_closed()
        _never_fail_to_print()
        try:
            with ctrl_c_is_never_lost():
                result = super().invoke(ctx)
            if sys.stdout is not None:
                sys.stdout.flush()
        except KeyboardInterrupt as stop:
            said = stop.args[0] if stop.args else "stopped; nothing of the unfinished run was kept"
            _end(str(said), INTERRUPTED)
        except BrokenPipeError:
            _drop_output()
            _end("whoever read the output has gone", FAILED)
        except Exception as error:
            if isinstance(error, typer.Abort) or hasattr(error, "exit_code"):
                raise  # an end, or a wrong option, that the command line's library prints itself
            _end(*_words(error, words))
        return result


@contextmanager
def ctrl_c_is_never_lost() -> Iterator[None]:
    """Ask again for the end where Python drops a Ctrl-C: while a finaliser or a weak reference's callback runs."""
    before = sys.unraisablehook
    timers: list[threading.Timer] = []

    def again(dropped: Any) -> None:
        if dropped.exc_type is KeyboardInterrupt:  # later, since it would be dropped here, too
            timers.append(threading.Timer(AGAIN_S, os.kill, (os.getpid(), signal.SIGINT)))
            timers[-1].start()
        else:
            before(dropped)

    sys.unraisablehook = again
    try:
        yield
    finally:
        sys.unraisablehook = before
        for timer in timers:
            timer.cancel()


def _words(error: Exception, words: list[str]) -> tuple[str, int]:
    """Return what to say of an error of the command line ``words``, and the exit code."""
    if isinstance(error, SwarmscopeError):
        return str(error), FAILED
    if isinstance(error, MemoryError):
        why = "there is not enough memory for it; lower robots, limit_s, lidar.beams or the size of the world"
        return f"{_what_was_read(words)}: {why}", FAILED
    if isinstance(error, OSError) and error.errno is not None:
        return _of_the_system(error, words), FAILED
    if os.environ.get(TRACEBACK):
        traceback.print_exception(error)
    place = traceback.extract_tb(error.__traceback__)[-1]
    what = " ".join(f"{type(error).__name__}: {error}".split())[:300]
    return (
        f"{_what_was_read(words)}: a fault of swarmscope itself: {what} ({Path(place.filename).name}, line "
        f"{place.lineno}); please report it with the command and its files ({TRACEBACK}=1 shows more)"
    ), FAULT


def _of_the_system(error: OSError, words: list[str]) -> str:
    """Return what the system said, with the file that it said it of."""
    why = "the disk is full" if error.errno == errno.ENOSPC else error.strerror or str(error)
    if error.filename is not None:
        return f"{_shown(error.filename)}: {why}"
    _drop_output()
    return f"{_what_was_read(words)}: the output cannot be written: {why}"


def _shown(name: Any) -> str:
    return os.fsdecode(name) if isinstance(name, str | bytes | os.PathLike) else repr(name)


def _what_was_read(words: list[str]) -> str:
    """Return the command and the files that it was given."""
    files = [word for word in words if "/" in word or Path(word).suffix]
    return " ".join([*words[:1], *files]) or "swarmscope"


def _end(words: str, code: int) -> NoReturn:
    """Print words on the error stream, if it is there, and end the command."""
    with suppress(OSError, ValueError):
        typer.echo(f"swarmscope: {words}", err=True)
    raise typer.Exit(code) from None


def _open_what_is_closed() -> None:
    """Let closed standard streams lead nowhere; a file or a pipe that is opened later would else take their place."""
    for stream in range(3):
        try:
            os.fstat(stream)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free


def _never_fail_to_print() -> None:
    """Print what the terminal's encoding lacks, and names of files that are no text, as question marks."""
    for stream in (sys.stdout, sys.stderr):
        with suppress(AttributeError, ValueError, OSError):
            stream.reconfigure(errors="replace" if stream is sys.stdout else "backslashreplace")  # type: ignore[union-attr]


def _drop_output() -> None:
    """Send what is still to be printed nowhere, so that closing stdout does not fail once more."""
    with suppress(OSError, ValueError, AttributeError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
