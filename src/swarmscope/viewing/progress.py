"""How far a run is, on stderr."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from swarmscope.judging.run import place_name
from swarmscope.scenarios.scenario import Scenario
from swarmscope.user_files import short_name


class Bar(Progress):
    """A bar that leaves nothing behind, no empty line either where nobody looks at a terminal."""

    def stop(self) -> None:
        """Take it off the screen."""
        self.live.stop()


_shown: list[Bar] = []
QUIET_S = 2.0
"""What takes longer shows how far it is."""


@contextmanager
def progress_bar(scenario: Scenario, after_s: float = 0.0) -> Iterator[Callable[[float, int], None]]:
    """Show simulated time and robots that are done while the body runs and calls what it is given.

    Nothing is shown in the first ``after_s`` seconds.
    """
    words = f"{place_name(scenario)} {short_name(scenario.planner.name)}"
    with _bar(words, scenario.limit_s, after_s) as show:

        def progress(simulated: float, done: int) -> None:
            show(simulated, f"{simulated:.0f} s of {scenario.limit_s:.0f} s, {done} of {scenario.robots} robots done")

        yield progress


@contextmanager
def steps_bar(words: str, after_s: float = QUIET_S) -> Iterator[Callable[[int, int], None]]:
    """Show how many steps of how many are done while the body runs and calls what it is given, if it takes long."""
    with _bar(words, None, after_s) as show:
        yield lambda done, total: show(done, f"{done} of {total}", total)


@contextmanager
def _bar(words: str, total: float | None, after_s: float) -> Iterator[Callable[..., None]]:
    """Show a bar from ``after_s`` on; the body calls what it is given with (done, note) or (done, note, total)."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"), TimeElapsedColumn())
    bar = Bar(*columns, console=Console(stderr=True), transient=True)
    job = bar.add_task(words, total=total, note="")
    begun = time.monotonic()

    def show_when_due() -> None:
        if not bar.live.is_started and time.monotonic() - begun >= after_s:
            _stop_all()
            _shown.append(bar)
            bar.start()

    def show(done: float, note: str, of: float | None = total) -> None:
        bar.update(job, completed=done, note=note, total=of)
        show_when_due()

    show_when_due()
    try:
        yield show
    finally:
        if bar in _shown:
            _stop_all()


def _stop_all() -> None:
    """Take what is shown off the screen: a bar within another's time takes its place (rich before 14.1 shows one)."""
    while _shown:
        _shown.pop().stop()
