"""Where tables go."""

from __future__ import annotations

from rich.console import Console


class PlainConsole(Console):
    """A console that leaves a closed pipe to ``PlainErrors`` instead of ending the process itself."""

    def on_broken_pipe(self) -> None:
        """Raise again."""
        raise BrokenPipeError
