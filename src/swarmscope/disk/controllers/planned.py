"""Everybody's way and timing planned beforehand from all positions and goals: the upper reference."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit
from swarmscope.disk.controllers import _elastic, _paths, _schedule
from swarmscope.disk.rules import Floats, Ints, Rules, goal_places, spacing, starts
from swarmscope.disk.runs import COLLISIONS, Problem, play

SUMMARY = "all ways and delays planned beforehand, for the last robot to arrive as early as possible"
KNOWS = "all obstacles, all starts, all goals, and that everybody keeps to the plan"
GUARANTEES = (
    "no collision: plans are played before they are used, and robots without one stay where they are; "
    "neither arrival nor the best plan is guaranteed"
)

LIMITS = {"attempts": (1, 1000), "drafts": (0, 1000), "robot_gap": (0.0, 1.0), "tick": (1, 1000)}

SAG = 0.008
"""Largest distance between an arc and the chord of one tick, as a part of a robot's radius."""
MANY = 10
"""For more robots than that fewer plans are made and relaxed by fewer sweeps."""
PIECE = 1.0
"""Way between two points of a relaxed plan, as a part of the radius."""
INSIDE = 1e-10
"""How much nearer to their goals than the tolerance robots end."""
HAIR = 2e-5
"""Gap to obstacles that plans keep apart from that, and to robots, but for ``robot_gap``."""


class Params(NamedTuple):
    """Numbers of the planned controller."""

    attempts: int = 3
    """Plans made independently of each other; the best is used."""
    iterations: int = 200
    """Improvements tried of each."""
    drafts: int = 10
    """More plans without improvements: relaxed, some of them become the best."""
    robot_gap: float = 0.002
    """Gap between robots, as a part of the radius."""
    sweeps: int = 1500
    """Of the relaxation of plans that are longer than the bound ..."""
    finish: int = 6000
    """... and of that of the best of them."""
    tick: int = 32
    """Most steps between two points of a plan."""


class Schedule(NamedTuple):
    """The plan of a run: where everybody is at some times; between them all move straight."""

    point: list[Floats]
    """Of each robot (times, 2); who has arrived has no more."""
    time: Floats
    """Steps from the start, increasing."""


class Tracks(NamedTuple):
    """The plans of all runs."""

    position: Floats
    """Points of all robots of all runs (points, 2)."""
    begin: Ints
    """(runs, n): where a robot's begin."""
    points: Ints
    """(runs, n): how many they are."""
    time: Floats
    """(times,): those of all runs."""
    first: Ints
    """(runs + 1,): where those of a run begin."""
    now: Ints
    """(runs,): which was needed last."""


class PlannedController:
    """Plays plans."""

    def __init__(self, problem: Problem, tracks: Tracks) -> None:
        self._stride, self._tracks = problem.rules.step, tracks

    def velocities(self, step: int, alive: Ints, state: Floats, velocity: Floats, out: Floats) -> None:
        """Write the velocities (see ``Controller``)."""
        if step == 0:
            self._tracks.now[:] = 0
        _velocities(step + 1.0, alive, state, self._stride, self._tracks, out)


@jit
def _velocities(time: float, alive: Ints, state: Floats, stride: float, tracks: Tracks, out: Floats) -> None:
    for b in alive:
        first, most = tracks.first[b], tracks.first[b + 1] - tracks.first[b] - 1
        k = tracks.now[b]
        while k < most and tracks.time[first + k + 1] < time:
            k += 1
        tracks.now[b] = k
        part = 0.0
        if k < most:
            part = (time - tracks.time[first + k]) / (tracks.time[first + k + 1] - tracks.time[first + k])
        for i in range(state.shape[1]):
            begin, last = tracks.begin[b, i], tracks.points[b, i] - 1
            one, two = begin + min(k, last), begin + min(k + 1, last)
            for axis in range(2):
                move = tracks.position[two, axis] - tracks.position[one, axis]
                out[b, i, axis] = (tracks.position[one, axis] + part * move - state[b, i, axis]) / stride


def tick_steps(rules: Rules, discs: Floats, most: int) -> int:
    """Return how many steps a tick may have for its chords to stay near the arcs round obstacles."""
    sharpest = rules.r + (float(discs[:, 2].min()) if len(discs) else 1.0)
    longest = math.sqrt(8.0 * sharpest * SAG * rules.r)
    return max(1, min(most, int(longest / rules.step)))


def create(problem: Problem, params: Params) -> PlannedController:
    """Return the controller of these runs, with all plans made and played once."""
    plans: list[Schedule] = []
    terrains: dict[int, tuple[_paths.Terrain, dict[tuple[int, int], list[Floats]], int]] = {}
    for b, which in enumerate(problem.map_of.tolist()):
        if which not in terrains:
            terrains[which] = _prepared(problem, which, params)
        plans.append(_plan(problem, b, terrains[which], params))
    tracks = _packed(plans, problem.rules.n)
    controller = PlannedController(problem, tracks)
    outcome = play(problem, controller)
    tracks.points[np.isin(outcome.status, COLLISIONS)] = 1
    return controller


def _apart(rules: Rules, params: Params) -> float:
    return (2.0 + params.robot_gap) * rules.r + HAIR


def _prepared(
    problem: Problem, which: int, params: Params
) -> tuple[_paths.Terrain, dict[tuple[int, int], list[Floats]], int]:
    rules, discs = problem.rules, problem.maps[which].obstacles
    tick = tick_steps(rules, discs, params.tick)
    pace = tick * rules.step
    sharpest = rules.r + (float(discs[:, 2].min()) if len(discs) else 1.0)
    clear = 1.3 * pace * pace / (8.0 * sharpest) + HAIR
    apart = _apart(rules, params)
    on = _paths.terrain(discs, rules.r, starts(rules.n), goal_places(rules.n), clear, apart, 0.5 * pace)
    return on, {}, tick


def _plan(
    problem: Problem,
    b: int,
    prepared: tuple[_paths.Terrain, dict[tuple[int, int], list[Floats]], int],
    params: Params,
) -> Schedule:
    """Return the plan of a run."""
    on, known, tick = prepared
    rules, pairs = problem.rules, list(enumerate(problem.permutation[b].tolist()))
    for pair in pairs:
        if pair not in known:
            known[pair] = _paths.candidates(on, *pair)
    ways = [known[pair] for pair in pairs]
    # Robots stop short of their goals, but where goals are close to each other not so far that they bar neighbours'.
    short = min(rules.tol - INSIDE, max(0.0, 0.49 * (spacing(rules.n) - _apart(rules, params))))
    lengths = [[max(0.0, _paths.way_length(way) - short) for way in some] for some in ways]
    longest = max((some[0] for some in lengths if some), default=0.0)
    steps = max(1, math.ceil(longest / rules.step - 1e-6))
    first = (steps - 1) % tick + 1
    case = _case(ways, lengths, on, first, tick, steps, rules, params)
    ticks = max(1, (rules.max_steps - first) // tick + 1)
    time = np.concatenate([[0.0], first + tick * np.arange(ticks - 1.0)])
    plan, work = _schedule.room_for(case, ticks)
    longest_first = sorted(range(rules.n), key=lambda i: -case.used[i, 0])
    bands = _bands(on, problem.goal[b], rules, case)
    few = min(1.0, MANY / rules.n)
    found: list[tuple[int, float, Schedule]] = []
    iterations = math.ceil(min(1.0, 5 * few) * params.iterations)
    attempts, drafts = max(1, math.ceil(few * params.attempts)), int(few * params.drafts)
    for attempt in range(attempts + drafts):
        order = np.array(longest_first, dtype=np.int64)
        if attempt > 0:
            order = np.random.default_rng(attempt).permutation(rules.n)
        _schedule.search(case, plan, work, order, iterations if attempt < attempts else 0, attempt)
        points = [plan.track[i, : plan.last[i] + 1].copy() for i in range(rules.n)]
        made = Schedule(points, time[: plan.last.max() + 1])
        lost = int(np.count_nonzero(plan.arrival == _schedule.NEVER))
        if lost == 0 and plan.last.max() <= case.least:
            return made
        if lost == 0:
            made = _relaxed(made, bands, longest, rules, math.ceil(few * params.sweeps))
        found.append((lost, float(made.time[-1]), made))
    lost, _, made = min(found, key=lambda one: one[:2])
    return made if lost else _relaxed(made, bands, longest, rules, math.ceil(few * params.finish))


def _bands(on: _paths.Terrain, goal: Floats, rules: Rules, case: _schedule.Case) -> _elastic.Bands:
    point = np.empty((rules.n, 0, 2))
    over = 0.002 * rules.r
    return _elastic.Bands(point, goal, on.discs, rules.tol - INSIDE, rules.r, case.apart, HAIR, over)


def _relaxed(plan: Schedule, bands: _elastic.Bands, longest: float, rules: Rules, sweeps: int) -> Schedule:
    """Return the plan with all its ways relaxed, or the plan itself if that did not make it shorter."""
    if sweeps <= 0:
        return plan
    count = 2 + int(plan.time[-1] * rules.step / (PIECE * rules.r))
    point = _elastic.resampled(plan.point, plan.time, count)
    point, length = _elastic.relax(bands._replace(point=point), longest, sweeps)
    if not length / rules.step < plan.time[-1]:
        return plan
    pieces = np.linalg.norm(np.diff(point, axis=1), axis=2).max(axis=0) / rules.step * (1.0 + 1e-9)
    moving = np.concatenate([[True], pieces > 1e-6])
    return Schedule(list(point[:, moving]), np.concatenate([[0.0], np.cumsum(pieces)])[moving])


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
    return _schedule.Case(place, count, _apart(rules, params), pace * (1.0 + 1e-9), least)


def _packed(plans: list[Schedule], n: int) -> Tracks:
    count = np.array([[len(points) for points in plan.point] for plan in plans], dtype=np.int64).reshape(-1, n)
    ends = np.cumsum(count.ravel())
    return Tracks(
        position=np.concatenate([np.empty((0, 2)), *(points for plan in plans for points in plan.point)]),
        begin=(ends - count.ravel()).reshape(count.shape),
        points=count,
        time=np.concatenate([np.empty(0), *(plan.time for plan in plans)]),
        first=np.cumsum([0, *(len(plan.time) for plan in plans)]),
        now=np.zeros(len(plans), dtype=np.int64),
    )
