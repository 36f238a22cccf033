"""Errors as people want them: one or two plain lines and an exit code, no traceback."""

from __future__ import annotations

import os
import sys
from typing import Any

import typer
from typer.core import TyperGroup

from swarmscope.errors import SwarmscopeError

FAILED, INTERRUPTED = 2, 130


class PlainErrors(TyperGroup):
    """The group of all commands; turns what goes wrong in them into a message and an exit code."""

    def invoke(self, ctx: Any) -> Any:
        """Run the command."""
        try:
            result = super().invoke(ctx)
            sys.stdout.flush()
        except SwarmscopeError as error:
            typer.echo(f"swarmscope: {error}", err=True)
            raise typer.Exit(FAILED) from None
        except KeyboardInterrupt as stop:
            words = stop.args[0] if stop.args else "stopped; nothing of the unfinished run was kept"
            typer.echo(f"swarmscope: {words}", err=True)
            raise typer.Exit(INTERRUPTED) from None
        except BrokenPipeError:
            _drop_output()
            typer.echo("swarmscope: whoever read the output has gone", err=True)
            raise typer.Exit(FAILED) from None
        return result


def _drop_output() -> None:
    """Send what is still to be printed nowhere, so that closing stdout does not fail once more."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
