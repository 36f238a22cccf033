"""Running an experiment: what is missing in the store, on whatever engine, one transaction for each result."""

from __future__ import annotations

import json
import os
import random
from collections import Counter
from collections.abc import Callable, Iterator
from typing import NamedTuple

from swarmscope.errors import ConfigError, InputFileError
from swarmscope.experiments.engines import Engine
from swarmscope.experiments.experiment import Experiment, Unit, units
from swarmscope.experiments.store import Store
from swarmscope.experiments.warm_up import warm_up_jobs
from swarmscope.experiments.work import finished, make_job, unit_key, world_key
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import complete, planner_of

Keyed = tuple[Unit, str]
Progress = Callable[[int, int, int], None]
"""Called with the units that are done, that failed, and all."""


class State(NamedTuple):
    """How far an experiment is."""

    units: list[Keyed]
    done: set[str]
    failed: dict[str, str]
    damaged: dict[str, str]
    """What is wrong with rows of the store that cannot be read: their units are missing."""

    @property
    def missing(self) -> list[Keyed]:
        """Units that are neither done nor failed."""
        return [(u, key) for u, key in self.units if key not in self.done and key not in self.failed]


def keyed_units(experiment: Experiment, maps: int | None = None) -> list[Keyed]:
    """Return every unit with its content key; a ConfigError names the planner whose network is not there."""
    found: list[Keyed] = []
    for unit in units(experiment, maps):
        try:
            found.append((unit, unit_key(unit.scenario)))
        except InputFileError as error:
            raise ConfigError(f"{experiment.name}: planner '{unit.planner}'", f"has no model to run: {error}") from None
    return found


def state_of(experiment: Experiment, store: Store, maps: int | None = None) -> State:
    """Return how far the experiment is."""
    found = keyed_units(experiment, maps)
    keys = {key for _, key in found}
    done = store.done(keys)
    damaged = store.damaged(done)
    done -= damaged.keys()
    return State(found, done, store.failed(keys - done), damaged)


def run_missing(
    experiment: Experiment,
    store: Store,
    engine: Engine,
    maps: int | None = None,
    retry_failed: bool = False,
    progress: Progress | None = None,
    say: Callable[[str], None] | None = None,
) -> State:
    """Run every unit without a result and return how far the experiment is then.

    May be called by several processes on one store at once: each goes through the units in an order of its own
    and leaves out what another has finished meanwhile.
    """
    state = state_of(experiment, store, maps)
    store.enlist(experiment.name, state.units)
    wanted = [(u, key) for u, key in state.units if key not in state.done and (retry_failed or key not in state.failed)]
    todo = {key: unit for unit, key in wanted}  # two labels may name the same run
    if not todo:
        return state
    if state.damaged:
        store.set_aside(state.damaged)
        if say is not None:
            say(f"{len(state.damaged)} damaged row(s) of the store set aside (table 'damaged'); they are run again")
    _check_available([unit.scenario for unit in todo.values()])
    _warm_up({unit.scenario.planner.name for unit in todo.values()}, engine, say)
    order = list(todo)
    random.Random(os.getpid()).shuffle(order)  # noqa: S311  not the results' order: they do not depend on it
    skipped: list[str] = []
    count = Counter(done=len(state.done), failed=0)
    total = len({key for _, key in state.units})
    for answer in engine.answers(_jobs(order, todo, store, skipped)):
        key = str(json.loads(answer)["key"])
        result = finished(complete(todo[key].scenario), answer)
        store.add(result)
        count["failed" if result.error is not None else "done"] += 1
        if progress is not None:
            progress(count["done"] + len(skipped), count["failed"], total)
    return state_of(experiment, store, maps)


def _jobs(order: list[str], todo: dict[str, Unit], store: Store, skipped: list[str]) -> Iterator[str]:
    for key in order:
        if store.done([key]):
            skipped.append(key)
            continue
        scenario = todo[key].scenario
        world = world_key(scenario)
        yield make_job(key, world, complete(scenario), store.references(world))


def _check_available(scenarios: list[Scenario]) -> None:
    """Raise an error before anything is run if some planner lacks its library or its network here."""
    chosen = {(s.planner.name, s.planner.model or ""): s.planner for s in scenarios}
    for key in sorted(chosen):
        planner_of(chosen[key]).check_available()


def _warm_up(planners: set[str], engine: Engine, say: Callable[[str], None] | None) -> None:
    """Compile what has to be compiled once, instead of in every worker at the same time."""
    for k, job in enumerate(jobs := warm_up_jobs(sorted(planners))):
        if say is not None and k == 0:
            say(f"compiling kernels of {len(jobs)} planner(s) for the first time (a minute or two, kept on disk) ...")
        for _ in engine.answers(iter([job])):
            pass
