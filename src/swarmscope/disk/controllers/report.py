"""The controller of the unit-disk report, as the baseline that everything else is compared with."""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.disk.rules import Floats, Ints
from swarmscope.disk.runs import Problem

SUMMARY = "the report's own: attraction, two repulsions, and a turn by 90 degrees near anything that is in the way"
KNOWS = "all positions, its own goal, all obstacles"
GUARANTEES = "nothing: 7 of the 600 runs circle until the steps run out"

LIMITS: dict[str, tuple[float, float]] = {"nearest": (0, 1), "rim_buffer": (0.0, 0.5)}

FLOOR = 1e-5
"""Gaps are not taken as smaller than this, report section 2.2."""
AHEAD = 0.05
"""Something is in the way when target and thing, as seen from the robot, have a larger inner product than this."""


class Params(NamedTuple):
    """Numbers of the report's controller."""

    obstacle_buffer: float = 0.01
    """Gap below which an obstacle repels; 0.003, 0.005, 0.007 or 0.008 instead lets all 600 runs arrive."""
    robot_buffer: float = 0.02
    """Gap below which a robot repels."""
    nearest: int = 0
    """1: of the obstacles only the nearest one decides about the turn, section 4's cure for loops; 0: every one."""
    rim_buffer: float = 0.0
    """Gap between a robot's centre and the rim below which the rim repels, as 1/gap^3, too; 0: it does not, as in the
    report. Goals lie 0.001 off the rim and are met within 0.005, so beyond 0.006 nobody arrives."""


@jit_inline
def repulsion(distance: float, gap: float) -> float:
    """Return what the vector away from a thing is multiplied with: 1 / (distance gap^3), report equations (1), (2)."""
    gap = max(gap, FLOOR)
    return 1.0 / (distance * (gap * gap * gap))


class ReportController:
    """The report's controller for some runs."""

    def __init__(self, problem: Problem, params: Params) -> None:
        self._problem, self._params = problem, params
        self._first, self._disc = problem.discs()

    def velocities(self, step: int, alive: Ints, state: Floats, velocity: Floats, out: Floats) -> None:
        """Write the velocities (see ``Controller``)."""
        of = self._problem
        _velocities(alive, state, of.goal, of.map_of, self._first, self._disc, of.rules.r, self._params, out)


def create(problem: Problem, params: Params) -> ReportController:
    """Return the controller of these runs."""
    return ReportController(problem, params)


@jit
def _velocities(
    alive: Ints,
    state: Floats,
    goal: Floats,
    map_of: Ints,
    first: Ints,
    disc: Floats,
    r: float,
    params: Params,
    out: Floats,
) -> None:
    for b in alive:
        begin, end = first[map_of[b]], first[map_of[b] + 1]
        for i in range(state.shape[1]):
            vx, vy = report_velocity(i, state[b], goal[b, i, 0], goal[b, i, 1], disc[begin:end], r, params)
            out[b, i, 0], out[b, i, 1] = vx, vy


@jit_inner
def _any_ahead(x: float, y: float, to_x: float, to_y: float, things: Floats, but: int) -> bool:
    """Return whether one of the things (k, 2 or more) other than ``but`` lies towards the goal, as seen from (x, y)."""
    ahead = False
    for k in range(len(things)):
        if k != but:
            ahead = ahead or to_x * (things[k, 0] - x) + to_y * (things[k, 1] - y) > AHEAD
    return ahead


@jit_inner
def _nearest(x: float, y: float, disc: Floats) -> int:
    """Return which of the obstacles (m, 3) has its rim nearest to (x, y), the first of several."""
    nearest, least = 0, math.inf
    for m in range(len(disc)):
        gap = math.hypot(x - disc[m, 0], y - disc[m, 1]) - disc[m, 2]
        if gap < least:
            nearest, least = m, gap
    return nearest


@jit
def report_velocity(
    i: int, state: Floats, goal_x: float, goal_y: float, disc: Floats, r: float, params: Params
) -> tuple[float, float]:
    """Return the velocity of robot i, of length 1: unit-disk report, equations (1) to (3) and code snippets 1 to 4.

    A rim that repels does so by (1), and counts for the mixing of push and attraction, but never as in the way: it is
    no thing that can be passed.

    Args:
        i: the robot.
        state: (n, 2) positions.
        goal_x, goal_y: its goal.
        disc: (m, 3) obstacles: x, y, R.
        r: radius of the robots.
        params: the buffers, and whose direction the turn asks for.
    """
    x, y = state[i, 0], state[i, 1]
    to_x, to_y = goal_x - x, goal_y - y
    vx, vy = to_x, to_y
    at_obstacle = at_robot = False
    for m in range(len(disc)):
        px, py = x - disc[m, 0], y - disc[m, 1]
        distance = math.hypot(px, py)
        gap = distance - (disc[m, 2] + r)
        if gap <= params.obstacle_buffer:
            at_obstacle = True
            push = repulsion(distance, gap)
            vx += push * px
            vy += push * py
    for j in range(len(state)):
        px, py = x - state[j, 0], y - state[j, 1]
        distance = math.hypot(px, py)
        gap = distance - 2.0 * r
        if j != i and gap <= params.robot_buffer:
            at_robot = True
            push = repulsion(distance, gap)
            vx += push * px
            vy += push * py
    at_rim = params.rim_buffer > 0.0 and 1.0 - math.hypot(x, y) <= params.rim_buffer
    if at_rim:
        push = repulsion(math.hypot(x, y), 1.0 - math.hypot(x, y))
        vx -= push * x
        vy -= push * y
    if at_obstacle or at_robot or at_rim:
        size = math.hypot(vx, vy)
        asked = disc
        if at_obstacle and params.nearest == 1:
            k = _nearest(x, y, disc)
            asked = disc[k : k + 1]
        if (at_obstacle and _any_ahead(x, y, to_x, to_y, asked, -1)) or (
            at_robot and _any_ahead(x, y, to_x, to_y, state, i)
        ):
            vx, vy = -vy, vx
        elif size > 1e-6:
            vx, vy = to_x + vx / size, to_y + vy / size
        else:
            vx, vy = to_x, to_y
    # The report divides by the length plus 1e-12.
    size = math.sqrt(vx * vx + vy * vy) + 1e-12
    return vx / size, vy / size
