"""Many runs of a storm, in as many processes as one likes, and its breaches made small."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from typing import Any, NamedTuple

from swarmscope.errors import SwarmscopeError
from swarmscope.experiments.engines.local import Local
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.storm.breach_file import as_text
from swarmscope.storm.draw import Draw, draw
from swarmscope.storm.play import Storm, draw_job, make_job, play_job
from swarmscope.storm.shrink import breach_of, shrink
from swarmscope.storm.watch import Breach

LEFT_OUT = ("oracle", "giwt", "giwt-cnn", "giwt-gat", "giwt-sage", "atlas-scan", "atlas-maps", "atlas-all")
"""Told by a map, networks, or for comparison: only when named."""


class Until(NamedTuple):
    """When a storm is over."""

    minutes: float | None = None
    """No run begins later."""
    runs: int | None = None
    """Not more than these."""
    done: Collection[int] = ()
    """Numbers that need no run any more."""


def usual_planners() -> list[str]:
    """Return the planners that need no training and whose libraries are here."""
    return [name for name in planner_names() if name not in LEFT_OUT and _is_here(name)]


def _is_here(name: str) -> bool:
    try:
        load_planner(name).check_available()
    except SwarmscopeError:
        return False
    return True


def rage(storm: Storm, until: Until, workers: int | None) -> Iterator[dict[str, Any]]:
    """Yield every run as it comes; a run whose process dies again and again is a breach, too."""
    for answer in map(json.loads, _answers(_jobs(storm, until), workers, play_job)):
        yield answer if "error" not in answer else _died(storm, answer)


def _jobs(storm: Storm, until: Until) -> Iterator[str]:
    begun, index, made = time.monotonic(), 0, 0
    while until.runs is None or made < until.runs:
        if until.minutes is not None and time.monotonic() - begun >= 60.0 * until.minutes:
            return
        if index not in until.done:
            made += 1
            yield make_job(storm, index)
        index += 1


def _answers(jobs: Iterator[str], workers: int | None, run: Callable[[str], str]) -> Iterator[str]:
    processes = workers or len(os.sched_getaffinity(0))
    return map(run, jobs) if processes == 1 else Local(processes, run).answers(jobs)


def _died(storm: Storm, answer: dict[str, Any]) -> dict[str, Any]:
    """Return the row of a run that ended its process."""
    index = int(answer["key"].partition(":")[2])
    drawn = draw(storm.seed, index, storm.planners, storm.covered)
    row: dict[str, Any] = {"number": index, "refused": {}}
    if isinstance(drawn, Draw):
        row |= {"robots": drawn.case.values["robots"], "planner": drawn.case.values["planner"]["name"]}
        row |= {"where": drawn.where, "again": drawn.again, "refused": dict(drawn.refused), "reasons": {}}
        row |= dict.fromkeys(("under_way_s", "driving_s", "arrived", "wall_s", "thrown"), 0)
        row["breach"] = Breach("error", 0, 0, answer["error"])._asdict()
    return row


def shrink_all(storm: Storm, rows: Sequence[dict[str, Any]], workers: int | None) -> Iterator[tuple[int, str]]:
    """Yield for each run with a breach its number and the file that replays it, made as small as it can be."""
    jobs = (json.dumps(json.loads(make_job(storm, row["number"])) | {"breach": row["breach"]}) for row in rows)
    for answer in map(json.loads, _answers(jobs, workers, shrink_job)):
        if "text" in answer:
            yield answer["number"], answer["text"]


def shrink_job(job: str) -> str:
    """Draw a run with a breach again and make it small; one that ends its process, or gives other bytes, stays."""
    asked = json.loads(job)
    drawn = draw_job(asked)
    if isinstance(drawn, dict):
        return json.dumps({"key": asked["key"], "number": asked["number"]})
    case, breach = drawn.case, Breach(**asked["breach"])
    if breach.kind != "bytes" and "process died" not in breach.text:
        smaller, found = shrink(case, breach.kind, play=breach_of)
        case, breach = (case, breach) if found is None else (smaller, found)
    return json.dumps({"key": asked["key"], "number": asked["number"], "text": as_text(case, breach, asked["key"])})
