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


@contextmanager
def progress_bar(scenario: Scenario, after_s: float = 0.0) -> Iterator[Callable[[float, int], None]]:
    """Show simulated time and robots that are done while the body runs and calls what it is given.

    Nothing is shown in the first ``after_s`` seconds.
    """
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[note]}"), TimeElapsedColumn())
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    job = bar.add_task(f"{place_name(scenario)} {short_name(scenario.planner.name)}", total=scenario.limit_s, note="")
    begun = time.monotonic()

    def show_when_due() -> None:
        if not bar.live.is_started and time.monotonic() - begun >= after_s:
            bar.start()

    def progress(simulated: float, done: int) -> None:
        note = f"{simulated:.0f} s of {scenario.limit_s:.0f} s, {done} of {scenario.robots} robots done"
        bar.update(job, completed=simulated, note=note)
        show_when_due()

    show_when_due()
    try:
        yield progress
    finally:
        if bar.live.is_started:
            bar.stop()
