"""Runs: many at once, step by step; every controller and every user's file goes through here.

All runs of a batch obey the same rules. In each step a controller writes the velocities of all robots of all runs
that are still going on, then ``advance`` moves them and looks for contacts on the way. Runs do not know of each
other, so results do not depend on how they are put into batches or on the number of workers.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Protocol

import numpy as np

from swarmscope._jit import jit
from swarmscope.disk.contact import nearest_on_the_way
from swarmscope.disk.maps import DiskMap
from swarmscope.disk.rules import ROUNDING, Floats, Ints, Rules, goals, starts

GOING, ARRIVED, HIT_ROBOT, HIT_OBSTACLE, LEFT_DISK, TIMED_OUT, INVALID = range(7)
STATUS_WORDS = (
    "still going",
    "arrived",
    "robots collided",
    "hit an obstacle",
    "left the disk",
    "ran out of steps",
    "got no valid velocity",
)
COLLISIONS = (HIT_ROBOT, HIT_OBSTACLE, LEFT_DISK)


@dataclass(frozen=True, eq=False)
class Problem:
    """Runs under the same rules: which map, and which robot goes where."""

    rules: Rules
    maps: tuple[DiskMap, ...]
    map_of: Ints
    """(runs,): index into ``maps``."""
    permutation: Ints
    """(runs, n)."""
    goal: Floats = field(init=False)
    """(runs, n, 2)."""
    start: Floats = field(init=False)
    """(runs, n, 2)."""

    def __post_init__(self) -> None:
        places = [goals(one) for one in self.permutation.tolist()]
        shape = (len(self.map_of), self.rules.n, 2)
        object.__setattr__(self, "goal", np.ascontiguousarray(np.array(places).reshape(shape)))
        object.__setattr__(self, "start", np.ascontiguousarray(np.broadcast_to(starts(self.rules.n), shape)))

    def part(self, runs: slice) -> Problem:
        """Return a problem of some of the runs, with the maps that they need."""
        used, map_of = np.unique(self.map_of[runs], return_inverse=True)
        maps = tuple(self.maps[k] for k in used)
        return Problem(self.rules, maps, map_of.astype(np.int64), self.permutation[runs])

    def discs(self) -> tuple[Ints, Floats]:
        """Return all obstacles as one array (k, 3), and where each map's begin in it (maps + 1,)."""
        first = np.cumsum([0, *(len(one.obstacles) for one in self.maps)]).astype(np.int64)
        return first, np.concatenate([np.empty((0, 3)), *(one.obstacles for one in self.maps)])


def problem(rules: Rules, maps: Sequence[DiskMap], permutations: Sequence[Sequence[int]]) -> Problem:
    """Return the runs of every permutation on every map, map by map."""
    map_of = np.repeat(np.arange(len(maps)), len(permutations))
    each = np.array(permutations, dtype=np.int64).reshape(len(permutations), rules.n)
    return Problem(rules, tuple(maps), map_of, np.tile(each, (len(maps), 1)))


class Controller(Protocol):
    """What moves the robots of a batch."""

    def velocities(self, step: int, alive: Ints, state: Floats, velocity: Floats, out: Floats) -> None:
        """Write the velocity of each robot of the runs ``alive`` into ``out``, in units of v_max.

        Args:
            step: steps done so far.
            alive: indices of the runs that go on.
            state: (runs, n, 2) positions.
            velocity: (runs, n, 2) what each robot did in the last step, in units of v_max; 0 at first.
            out: (runs, n, 2); a velocity longer than 1 is cut to length 1, NaN ends the run as invalid.
        """


class Outcome(NamedTuple):
    """How runs ended."""

    status: Ints
    """(runs,): one of the words above."""
    steps: Ints
    """(runs,): steps done."""
    arrival: Ints
    """(runs, n): step after which a robot last came within tol of its goal and stayed; -1 when it is not there."""
    length: Floats
    """(runs, n): way covered."""
    robot_gap: Floats
    """(runs,): smallest gap between two robots, infinity for one robot alone."""
    obstacle_gap: Floats
    """(runs,): smallest gap between a robot and an obstacle, infinity without obstacles."""
    involved: Ints
    """(runs, 2): robots (robot and obstacle, robot and -1) of a collision, -1 elsewhere."""


class Film(NamedTuple):
    """Positions over time of all runs of a batch."""

    every: int
    """Steps between two pictures."""
    positions: list[Floats]
    """One (runs, n, 2) for each picture; runs that have ended stand still."""


def no_outcome(runs: int, n: int) -> Outcome:
    """Return the outcome of runs that have not begun."""
    return Outcome(
        status=np.full(runs, GOING, dtype=np.int64),
        steps=np.zeros(runs, dtype=np.int64),
        arrival=np.full((runs, n), -1, dtype=np.int64),
        length=np.zeros((runs, n)),
        robot_gap=np.full(runs, math.inf),
        obstacle_gap=np.full(runs, math.inf),
        involved=np.full((runs, 2), -1, dtype=np.int64),
    )


def play(
    of: Problem, controller: Controller, film: Film | None = None, progress: Callable[[int], None] | None = None
) -> Outcome:
    """Play all runs of a problem to their ends.

    Args:
        of: the runs.
        controller: made for these runs.
        film: pictures are put here if given.
        progress: called with the number of runs that ended, now and then.
    """
    runs, n = of.goal.shape[:2]
    outcome = no_outcome(runs, n)
    state, velocity = of.start.copy(), np.zeros((runs, n, 2))
    chosen = np.zeros((runs, n, 2))
    first, disc = of.discs()
    alive = np.arange(runs)
    limits = (of.rules.r, of.rules.step, of.rules.tol, of.rules.max_steps)
    step = 0
    while len(alive):
        if film is not None and step % film.every == 0:
            film.positions.append(state.copy())
        controller.velocities(step, alive, state, velocity, chosen)
        ended = advance(alive, state, velocity, chosen, of.goal, of.map_of, first, disc, limits, outcome)
        step += 1
        if ended:
            alive = alive[outcome.status[alive] == GOING]
            if progress is not None:
                progress(ended)
    if film is not None:
        film.positions.append(state.copy())
    return outcome


@jit
def advance(
    alive: Ints,
    state: Floats,
    velocity: Floats,
    chosen: Floats,
    goal: Floats,
    map_of: Ints,
    first: Ints,
    disc: Floats,
    limits: tuple[float, float, float, int],
    outcome: Outcome,
) -> int:
    """Move all robots of all runs by one step, look for contacts on the way, return how many runs ended.

    Unit-disk report, section 1: contact is |xi - xj| <= 2 r, |xi - c| <= R + r or |xi| > 1 (plus rounding).
    """
    r, stride, tol, max_steps = limits
    ended = 0
    for b in alive:
        n = state.shape[1]
        status, one, two = GOING, -1, -1
        for i in range(n):
            ux, uy = chosen[b, i, 0], chosen[b, i, 1]
            size = math.sqrt(ux * ux + uy * uy)
            if not size < math.inf:
                status, one = INVALID, i
                break
            if size > 1.0:
                ux, uy = ux / size, uy / size
            velocity[b, i, 0], velocity[b, i, 1] = ux, uy
        if status == GOING:
            for i in range(n):
                status, one, two = _contact(b, i, state, velocity, stride, r, map_of[b], first, disc, outcome)
                if status != GOING:
                    break
            _move(b, state, velocity, stride, outcome)
            if status == GOING:
                status = _arrivals(b, state, goal, tol, max_steps, outcome)
        if status != GOING:
            outcome.status[b] = status
            outcome.involved[b, 0], outcome.involved[b, 1] = one, two
            ended += 1
    return ended


@jit
def _contact(
    b: int,
    i: int,
    state: Floats,
    velocity: Floats,
    stride: float,
    r: float,
    which: int,
    first: Ints,
    disc: Floats,
    outcome: Outcome,
) -> tuple[int, int, int]:
    """Return what robot i touches in the coming step, and note its gaps."""
    x, y = state[b, i, 0], state[b, i, 1]
    mx, my = velocity[b, i, 0] * stride, velocity[b, i, 1] * stride
    for j in range(i + 1, state.shape[1]):
        px, py = x - state[b, j, 0], y - state[b, j, 1]
        if abs(px) - 2.0 * (stride + r) > outcome.robot_gap[b] or abs(py) - 2.0 * (stride + r) > outcome.robot_gap[b]:
            continue
        qx = px + mx - velocity[b, j, 0] * stride
        qy = py + my - velocity[b, j, 1] * stride
        gap = nearest_on_the_way(px, py, qx, qy) - 2.0 * r
        outcome.robot_gap[b] = min(outcome.robot_gap[b], gap)
        if gap <= 0.0:
            return HIT_ROBOT, i, j
    for m in range(first[which], first[which + 1]):
        px, py = x - disc[m, 0], y - disc[m, 1]
        reach = stride + r + disc[m, 2] + outcome.obstacle_gap[b]
        if abs(px) > reach or abs(py) > reach:
            continue
        gap = nearest_on_the_way(px, py, px + mx, py + my) - (disc[m, 2] + r)
        outcome.obstacle_gap[b] = min(outcome.obstacle_gap[b], gap)
        if gap <= 0.0:
            return HIT_OBSTACLE, i, m - first[which]
    if (x + mx) * (x + mx) + (y + my) * (y + my) > (1.0 + ROUNDING) * (1.0 + ROUNDING):
        return LEFT_DISK, i, -1
    return GOING, -1, -1


@jit
def _move(b: int, state: Floats, velocity: Floats, stride: float, outcome: Outcome) -> None:
    for i in range(state.shape[1]):
        ux, uy = velocity[b, i, 0], velocity[b, i, 1]
        state[b, i, 0] += ux * stride
        state[b, i, 1] += uy * stride
        outcome.length[b, i] += math.sqrt(ux * ux + uy * uy) * stride


@jit
def _arrivals(b: int, state: Floats, goal: Floats, tol: float, max_steps: int, outcome: Outcome) -> int:
    outcome.steps[b] += 1
    away = 0
    for i in range(state.shape[1]):
        gx, gy = goal[b, i, 0] - state[b, i, 0], goal[b, i, 1] - state[b, i, 1]
        if gx * gx + gy * gy > tol * tol:
            outcome.arrival[b, i] = -1
            away += 1
        elif outcome.arrival[b, i] < 0:
            outcome.arrival[b, i] = outcome.steps[b]
    if away == 0:
        return ARRIVED
    return TIMED_OUT if outcome.steps[b] >= max_steps else GOING
