"""A breach made as small as it can be: greedily, always in the same order, within a number of runs."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from swarmscope.errors import SwarmscopeError
from swarmscope.storm.draw import Case, written_place
from swarmscope.storm.forger import Forger
from swarmscope.storm.play import watched
from swarmscope.storm.ranges import WORK
from swarmscope.storm.watch import Breach

MOST_RUNS = 1000
MOST_WORK = 20.0 * WORK
"""Together they do no more than this: a minute or two."""
LEAST_WORK = 1e5
"""Of a run, however short."""
GROUPS = ("noise", "faults", "radio")
ROUNDED = ("robot", "lidar", "guard", "noise", "faults", "radio")
DIGITS = (1, 2, 3)
"""Significant digits that are tried, in this order."""
DECIMALS = (0, 1, 2)
"""The same behind the point, of places [m] and angles."""

Values = dict[str, Any]
Kind = Callable[[Case], Breach | None]


def breach_of(case: Case) -> Breach | None:
    """Return how a run breaks, None if it does not or cannot be run."""
    try:
        return watched(case).breach
    except SwarmscopeError:
        return None


def shrink(case: Case, kind: str, budget: int = MOST_RUNS, play: Kind = breach_of) -> tuple[Case, Breach | None]:
    """Return the smallest run found that still breaks in this way, and how; None if it did not break at all."""
    search = _Search(case, kind, budget, play)
    if not search.tries(case):
        return case, None
    search.cut()
    search.tries(_with(search.case, written_place))
    search.cut()
    steps = (_without_forger, _fewer_robots, _fewer_obstacles, _fewer_cells, _without_keys, _plainer_forger, _rounder)
    while search.left > 0:
        before = search.best
        for step in steps:
            search.follow(step)
            search.cut()
        if search.best == before:
            break
    return search.case, search.breach


class _Search:
    """The smallest run so far, and how many may still be tried."""

    def __init__(self, case: Case, kind: str, left: int, play: Kind) -> None:
        self.case, self.kind, self.left, self.play = case, kind, left, play
        self.breach: Breach | None = None
        self.work = MOST_WORK + _work(case)

    @property
    def best(self) -> str:
        """The run as text, to compare."""
        forger = self.case.forger
        return json.dumps([self.case.values, None if forger is None else forger.as_dict()], sort_keys=True)

    def tries(self, case: Case | None) -> bool:
        """Play a run and keep it if it breaks in the same way."""
        if case is None or self.left <= 0:
            return False
        self.left -= 1
        self.work -= _work(case)
        if self.work <= 0.0:
            self.left = 0
        breach = self.play(case)
        if breach is None or breach.kind != self.kind:
            return False
        self.case, self.breach = case, breach
        return True

    def follow(self, step: Callable[[Case], Iterator[Case]]) -> None:
        """Try what a step offers; after one that still breaks, begin with that one anew."""
        found = True
        while found and self.left > 0:
            found = any(self.tries(candidate) for candidate in step(self.case))

    def cut(self) -> None:
        """End the run with the tick that breaks."""
        if self.breach is None:
            return
        rate = self.case.values.get("lidar", {}).get("rate_hz", 5.0)
        limit = float(f"{(self.breach.tick + 1) / rate:.3f}")
        if 0.0 < limit < self.case.values.get("limit_s", 300.0):
            self.tries(Case(self.case.values | {"limit_s": limit}, self.case.forger))


def _work(case: Case) -> float:
    """Return how much work a run is, at most: robots times ticks times beams."""
    lidar, values = case.values.get("lidar", {}), case.values
    ticks = values.get("limit_s", 300.0) * lidar.get("rate_hz", 5.0)
    return max(LEAST_WORK, float(values["robots"] * ticks * (lidar.get("beams", 360) + 200)))


def _with(case: Case, change: Callable[[Values], Values]) -> Case | None:
    try:
        return Case(change(case.values), case.forger)
    except SwarmscopeError:
        return None


def _without_forger(case: Case) -> Iterator[Case]:
    if case.forger is not None:
        yield Case(case.values, None)


def _plainer_forger(case: Case) -> Iterator[Case]:
    """Offer fewer kinds of packets, and fewer packets."""
    forger = case.forger
    if forger is None:
        return
    if len(forger.kinds) > 1:
        yield from (Case(case.values, Forger(forger.seed, forger.per_tick, (kind,))) for kind in forger.kinds)
    for less in (0.25 * forger.per_tick, 0.5 * forger.per_tick, float(f"{forger.per_tick:.1g}")):
        if less < forger.per_tick and less > 0.01:
            yield Case(case.values, Forger(forger.seed, less, forger.kinds))


def _without_keys(case: Case) -> Iterator[Case]:
    """Offer the run without whole groups, then without single keys: those then have their defaults."""
    for group in (*GROUPS, "guard"):
        if group in case.values:
            yield Case({k: v for k, v in case.values.items() if k != group}, case.forger)
    for group in (*GROUPS, "lidar", "robot"):
        for key in case.values.get(group, {}):
            left = {k: v for k, v in case.values[group].items() if k != key}
            if key == "radius_m":
                left.pop("half_width_m", None)
            if key != "half_width_m" or "radius_m" not in left:
                yield Case(case.values | {group: left}, case.forger)


def _fewer_robots(case: Case) -> Iterator[Case]:
    """Offer the run with parts of the robots; in a task, with fewer."""
    place, robots = case.values.get("place"), case.values["robots"]
    if place is None:
        return
    for kept in _parts(range(robots)):
        if kept:
            fewer = place | {name: [place[name][k] for k in kept] for name in ("starts", "goals")}
            yield Case(case.values | {"place": fewer, "robots": len(kept)}, case.forger)


def _fewer_obstacles(case: Case) -> Iterator[Case]:
    place = case.values.get("place")
    if place is None:
        return
    obstacles = place["world"]["obstacles"]
    for kept in _parts(range(len(obstacles))):
        world = place["world"] | {"obstacles": [obstacles[k] for k in kept]}
        yield Case(case.values | {"place": place | {"world": world}}, case.forger)


def _fewer_cells(case: Case) -> Iterator[Case]:
    """Offer the run with parts of the solid cells of its map."""
    place = case.values.get("place")
    if place is None:
        return
    obstacles = place["world"]["obstacles"]
    for k, grid in enumerate(obstacles):
        if grid["type"] != "grid":
            continue
        for kept in _parts(range(len(grid["rows"]))):
            fewer = grid | {"rows": [grid["rows"][row] for row in kept]}
            world = place["world"] | {"obstacles": [*obstacles[:k], fewer, *obstacles[k + 1 :]]}
            yield Case(case.values | {"place": place | {"world": world}}, case.forger)


def _parts(items: Sequence[int]) -> Iterator[list[int]]:
    """Yield what is left without a half, a quarter, ... of the items, at last without a single one."""
    if not items:
        return
    size = (len(items) + 1) // 2
    yield []
    while True:
        for first in range(0, len(items), size):
            yield [*items[:first], *items[first + size :]]
        if size == 1:
            return
        size = max(1, size // 2)


def _rounder(case: Case) -> Iterator[Case]:
    """Offer rounder numbers, each by itself; a number that is round enough is left alone."""
    for group in ROUNDED:
        for key, value in case.values.get(group, {}).items():
            if isinstance(value, bool):
                continue
            for digits in DIGITS:
                rounded = type(value)(float(f"{value:.{digits}g}"))
                if rounded == value:
                    break
                changed = case.values[group] | {key: rounded}
                if key == "radius_m":
                    changed["half_width_m"] = rounded
                yield Case(case.values | {group: changed}, case.forger)
    place = case.values.get("place")
    if place is None:
        return
    for decimals in DECIMALS:
        for path in (("starts",), ("goals",), ("world", "obstacles")):
            rounded_place = copy.deepcopy(place)
            at = rounded_place
            for part in path[:-1]:
                at = at[part]
            at[path[-1]] = _rounded(at[path[-1]], decimals)
            if rounded_place != place:
                yield Case(case.values | {"place": rounded_place}, case.forger)


def _rounded(value: Any, decimals: int) -> Any:
    if isinstance(value, float):
        return round(value, decimals)
    if isinstance(value, list):
        return [_rounded(item, decimals) for item in value]
    if isinstance(value, dict) and value.get("type") != "grid":
        return {key: _rounded(item, decimals) for key, item in value.items()}
    return value
