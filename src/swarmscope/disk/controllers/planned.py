"""Everybody's way and timing planned beforehand from all positions and goals: the upper reference."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit
from swarmscope.disk.controllers import _paths, _schedule
from swarmscope.disk.rules import Floats, Ints, Rules, goal_places, starts
from swarmscope.disk.runs import ARRIVED, COLLISIONS, Problem, play

SUMMARY = "all ways and delays planned beforehand, for the last robot to arrive as early as possible"
KNOWS = "all obstacles, all starts, all goals, and that everybody keeps to the plan"
GUARANTEES = ("no collision: plans are played before they are used, and robots without one stay where they are; "
              "neither arrival nor the best plan is guaranteed")

SAG = 0.008
"""Largest distance between an arc and the chord of one tick, as a part of a robot's radius."""
HAIR = 2e-5
"""Gap to obstacles that plans keep apart from that, and to robots, but for ``robot_gap``."""


class Params(NamedTuple):
    """Numbers of the planned controller."""

    iterations: int = 400
    """Attempts to improve the first plan; fewer for more than 20 robots."""
    robot_gap: float = 0.002
    """Gap between robots, as a part of the radius."""
    tick: int = 32
    """Most steps between two points of a plan."""


class Tracks(NamedTuple):
    """The plans of all runs."""

    position: Floats
    """Points of all robots of all runs (points, 2)."""
    begin: Ints
    """(runs, n): where a robot's begin."""
    count: Ints
    """(runs, n)."""
    first: Ints
    """(runs,): steps of the first tick."""
    tick: Ints
    """(runs,): steps of the others."""


class PlannedController:
    """Plays plans."""

    def __init__(self, problem: Problem, tracks: Tracks) -> None:
        self._stride, self._tracks = problem.rules.step, tracks

    def velocities(self, step: int, alive: Ints, state: Floats, velocity: Floats, out: Floats) -> None:
        """Write the velocities (see ``Controller``)."""
        _velocities(step, alive, state, self._stride, self._tracks, out)


@jit
def _velocities(step: int, alive: Ints, state: Floats, stride: float, tracks: Tracks, out: Floats) -> None:
    for b in alive:
        first, tick = tracks.first[b], tracks.tick[b]
        after = step + 1
        if after <= first:
            k, part = 0, after / first
        else:
            k = 1 + (after - first - 1) // tick
            part = (after - first - (k - 1) * tick) / tick
        for i in range(state.shape[1]):
            begin, last = tracks.begin[b, i], tracks.count[b, i] - 1
            one, two = begin + min(k, last), begin + min(k + 1, last)
            for axis in range(2):
                want = tracks.position[one, axis] * (1.0 - part) + tracks.position[two, axis] * part
                out[b, i, axis] = (want - state[b, i, axis]) / stride


def tick_steps(rules: Rules, discs: Floats, most: int) -> int:
    """Return how many steps a tick may have for its chords to stay near the arcs round obstacles."""
    sharpest = rules.r + (float(discs[:, 2].min()) if len(discs) else 1.0)
    longest = math.sqrt(8.0 * sharpest * SAG * rules.r)
    return max(1, min(most, int(longest / rules.step)))


def create(problem: Problem, params: Params) -> PlannedController:
    """Return the controller of these runs, with all plans made and played once."""
    plans: list[tuple[list[Floats], int, int]] = []
    terrains: dict[int, tuple[_paths.Terrain, dict[tuple[int, int], list[Floats]], int]] = {}
    for b, which in enumerate(problem.map_of.tolist()):
        if which not in terrains:
            terrains[which] = _prepared(problem, which, params)
        plans.append(_plan(problem, b, terrains[which], params))
    tracks = _packed(plans, problem.rules.n)
    controller = PlannedController(problem, tracks)
    outcome = play(problem, controller)
    for b in np.flatnonzero(np.isin(outcome.status, COLLISIONS)):
        tracks.count[b] = 1
    return controller


def _prepared(
    problem: Problem, which: int, params: Params
) -> tuple[_paths.Terrain, dict[tuple[int, int], list[Floats]], int]:
    rules, discs = problem.rules, problem.maps[which].obstacles
    tick = tick_steps(rules, discs, params.tick)
    pace = tick * rules.step
    sharpest = rules.r + (float(discs[:, 2].min()) if len(discs) else 1.0)
    clear = 1.3 * pace * pace / (8.0 * sharpest) + HAIR
    apart = (2.0 + params.robot_gap) * rules.r + HAIR
    on = _paths.terrain(discs, rules.r, starts(rules.n), goal_places(rules.n), clear, apart, 0.5 * pace)
    return on, {}, tick


def _plan(
    problem: Problem,
    b: int,
    prepared: tuple[_paths.Terrain, dict[tuple[int, int], list[Floats]], int],
    params: Params,
) -> tuple[list[Floats], int, int]:
    """Return points of each robot of a run, and the steps of the first and of the other ticks."""
    on, known, tick = prepared
    rules, pairs = problem.rules, list(enumerate(problem.permutation[b].tolist()))
    for pair in pairs:
        if pair not in known:
            known[pair] = _paths.candidates(on, *pair)
    ways = [known[pair] for pair in pairs]
    lengths = [[max(0.0, _paths.way_length(way) - rules.tol + 1e-7) for way in some] for some in ways]
    longest = max((some[0] for some in lengths if some), default=0.0)
    steps = max(1, math.ceil(longest / rules.step - 1e-6))
    first = (steps - 1) % tick + 1
    case = _case(ways, lengths, on, first, tick, steps, rules, params)
    ticks = (rules.max_steps - first) // tick + 1
    plan, work = _schedule.room_for(case, ticks, b)
    order = np.array(sorted(range(rules.n), key=lambda i: -case.count[i, 0]), dtype=np.int64)
    _schedule.search(case, plan, work, order, params.iterations)
    return [plan.track[i, : plan.last[i] + 1].copy() for i in range(rules.n)], first, tick


def _case(
    ways: list[list[Floats]],
    lengths: list[list[float]],
    on: _paths.Terrain,
    first: int,
    tick: int,
    steps: int,
    rules: Rules,
    params: Params,
) -> _schedule.Case:
    n, pace = rules.n, tick * rules.step
    longest = max((some[-1] for some in lengths if some), default=0.0)
    most = int(longest / pace) + 4
    place = np.zeros((n, max(1, max(len(some) for some in ways)), most, 2))
    count = np.zeros(place.shape[:2], dtype=np.int64)
    for i, some in enumerate(ways):
        place[i, :, 0] = on.start[i]
        used = 0
        for way, length in zip(some, lengths[i], strict=True):
            many = _paths.places(way, first * rules.step, pace, length, place[i, used])
            if many and _paths.passes(place[i, used, :many], on.discs, on.r + 0.5 * HAIR):
                count[i, used] = many
                used += 1
    least = 1 + (steps - first) // tick
    return _schedule.Case(place, count, (2.0 + params.robot_gap) * rules.r + HAIR, pace * (1.0 + 1e-9), least)


def _packed(plans: list[tuple[list[Floats], int, int]], n: int) -> Tracks:
    count = np.array([[len(points) for points in run] for run, _, _ in plans], dtype=np.int64).reshape(-1, n)
    ends = np.cumsum(count.ravel())
    return Tracks(
        position=np.concatenate([np.empty((0, 2)), *(points for run, _, _ in plans for points in run)]),
        begin=(ends - count.ravel()).reshape(count.shape),
        count=count,
        first=np.array([first for _, first, _ in plans], dtype=np.int64),
        tick=np.array([tick for _, _, tick in plans], dtype=np.int64),
    )
