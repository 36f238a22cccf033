"""One run of a storm, as a job: text in, text out, the same on every machine."""

from __future__ import annotations

import hashlib
import json
import time
import traceback
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from swarmscope.closure import state_of, union_of
from swarmscope.errors import SwarmscopeError
from swarmscope.onboard.planners import planner_file
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_setting
from swarmscope.sim.loop import Trace, run
from swarmscope.storm.draw import Case, Draw, draw
from swarmscope.storm.forger import Attack
from swarmscope.storm.watch import Breach, Watch, reasons_of
from swarmscope.tasks import Setup, task_file, task_names

DIGESTED = ("x", "y", "yaw", "speed", "clearance", "state", "reason", "side", "bytes_sent")
"""Records that must be the same when a run is run again."""


class Played(NamedTuple):
    """How a run ended."""

    breach: Breach | None
    simulated_s: float
    under_way_s: float
    driving_s: float
    arrived: int
    reasons: Mapping[str, int]
    thrown: int
    digest: str


def play_case(case: Case, threads: int = 1, setup: Setup | None = None) -> Played:
    """Play a run, in its ``setup`` if that is known, and watch it. Errors: those of scenarios and of worlds."""
    scenario = parse_scenario(case.values, "storm")
    setting = make_setting(scenario, make_setup(scenario) if setup is None else setup, threads)
    attack = None if case.forger is None else Attack(case.forger)
    watch = Watch(setting, attack)
    trace = run(setting, between=watch)
    watch.finish(trace)
    return Played(
        breach=watch.breach,
        simulated_s=len(trace.t_s) * setting.dt,
        under_way_s=watch.under_way_s,
        driving_s=watch.driving_s,
        arrived=int(trace.robots["arrived"].sum()),
        reasons=reasons_of(setting, trace),
        thrown=0 if attack is None else attack.thrown,
        digest=_digest(trace),
    )


def watched(case: Case, again: bool = False, setup: Setup | None = None) -> Played:
    """Play a run, twice if ``again``; an exception in it is a breach, too, but for errors of scenarios and worlds."""
    try:
        played = play_case(case, setup=setup)
        if again and play_case(case, 2, setup).digest != played.digest:
            return played._replace(breach=Breach("bytes", 0, 0, "the same run gave other bytes with two threads"))
    except SwarmscopeError:
        raise
    except Exception as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        text = f"{type(error).__name__}: {error} ({where.name}, line {where.lineno})"
        return Played(Breach("error", 0, 0, text), 0.0, 0.0, 0.0, 0, {}, 0, "")
    return played


def code_of(planners: Sequence[str]) -> str:
    """Return a hash of the code that can change what a storm finds."""
    files = [*map(planner_file, planners), *map(task_file, task_names())]
    return state_of(union_of([Path(__file__), *files]))[:16]


class Storm(NamedTuple):
    """Which runs there are: a number stands for one of them."""

    seed: int
    planners: Sequence[str]
    covered: bool = False
    """Leave out what storms are known to break."""


def make_job(storm: Storm, index: int) -> str:
    """Return run ``index`` of a storm as text."""
    name = f"{storm.seed}:{index}"
    return json.dumps({"key": name, "world": name, "number": index, "storm": storm})


def draw_job(asked: Mapping[str, Any]) -> Draw | dict[str, int]:
    """Draw the run of a job."""
    storm = Storm(*asked["storm"])
    return draw(storm.seed, asked["number"], storm.planners, storm.covered)


def play_job(job: str) -> str:
    """Draw a run and play it; whatever goes wrong becomes part of the answer."""
    asked = json.loads(job)
    begun = time.perf_counter()
    answer: dict[str, Any] = {"key": asked["key"], "number": asked["number"]}
    drawn = draw_job(asked)
    if isinstance(drawn, dict):
        return json.dumps(answer | {"refused": drawn})
    values = drawn.case.values
    row = answer | {"refused": drawn.refused, "where": drawn.where, "planner": values["planner"]["name"]}
    row["robots"] = values["robots"]
    try:
        played = watched(drawn.case, drawn.again, drawn.setup)
    except SwarmscopeError as error:
        row["refused"] = {**drawn.refused, str(error)[:80]: 1}
        return json.dumps(answer | {"refused": row["refused"]})
    row |= played._asdict() | {"breach": None if played.breach is None else played.breach._asdict()}
    row |= {"wall_s": time.perf_counter() - begun, "again": drawn.again}
    return json.dumps(row)


def _digest(trace: Trace) -> str:
    """Return a hash of all that a run's robots did."""
    found = hashlib.sha256()
    for name in DIGESTED:
        found.update(np.ascontiguousarray(getattr(trace.records, name)).tobytes())
    found.update(trace.robots.tobytes())
    return found.hexdigest()[:32]
