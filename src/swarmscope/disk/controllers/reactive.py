"""A distributed reactive controller: everybody looks ahead with what it sees, and a barrier has the last word.

Each robot knows the obstacles, its own goal, and where the others are and how they move; nobody tells anybody a goal
or a plan. Now and then (every tenth of a radius) a robot looks ahead: if its shortest way (``geodesic``) stays clear
of where the others will be, it follows it. Else it compares manoeuvres - go some way in another direction, wait, go
slowly, and then on along the shortest way from there - by

    time of arrival + fear (horizon / time to the first conflict - 1),

the second term only for a conflict within the horizon, and begins the best. It looks again a tenth of a radius
later, so a manoeuvre ends as soon as the shortest way is clear: a circulation with an exit test, in contrast to the
unit-disk report's turn by 90 degrees, which goes on as long as anything is near.

Who gives way is settled once, and in the same way by all: the robot with the longer free run goes first, that is the
way from its place to the rim in the direction in which it set out (ties by number). In a total order no two robots
can each wait for the other, and the first of all never leaves its shortest way for somebody that moves. Everybody
also plans round robots that stand. A standing robot that goes first is expected to go on in the direction in which
it last moved, so that those who block it clear the way, if need be backwards. Two can still stand on either side of
a passage, each for the other: who has stood for ``patience`` goes on as if those behind it in the order were not
there until its way is clear, and they give way.

What is chosen passes ``nearest_admissible`` in every step, which rules out contact whatever was chosen.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.disk import bounds
from swarmscope.disk.contact import nearest_on_the_way
from swarmscope.disk.controllers._barrier import MOST, nearest_admissible
from swarmscope.disk.geodesic import Ways, look_up, segment_is_free, straight_part
from swarmscope.disk.rules import Floats, Ints
from swarmscope.disk.runs import Problem

SUMMARY = "shortest ways, manoeuvres that give way in a fixed order, and a barrier against contact"
KNOWS = "positions and velocities of all robots, its own goal, all obstacles; no goals or plans of others"
GUARANTEES = (
    "no contact in discrete time, if all robots run it and start apart; arrival is not proven: who waits for each "
    "other stops doing so after a while (patience), but a robot can be kept from its goal by others at their goals"
)

LIMITS = {"horizon": (1e-3, 1000.0), "stride": (0.05, 1000.0), "gain": (1e-3, 0.999), "margin": (0.0, 1.0)}

TURNS_DEG = (3, 6, 9, 12, 16, 20, 25, 30, 40, 50, 60, 75, 90, 110, 135, 160)
LENGTHS = (1.0, 2.0, 4.0, 8.0)
WAITS = (0.2, 0.4, 0.8, 1.4, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)
SPEEDS = (0.25, 0.5, 0.75)
SLOW_TIMES = (2.0, 4.0, 8.0, 16.0)
MOVES = 0.5
"""Speed (part of v_max) from which a direction of travel counts as seen; below 0.2 a robot stands."""
STANDS = 0.2


class Params(NamedTuple):
    """Numbers of the reactive controller; lengths and times are in radii (a time in what one travels in it)."""

    horizon: float = 20.0
    """How far ahead conflicts are looked for, after a manoeuvre."""
    stride: float = 0.8
    """Step of looking ahead."""
    fear: float = 1.0
    """Weight of a conflict."""
    room: float = 0.1
    """Gap that is kept from predicted robots."""
    patience: float = 5.0
    """Time after which one who has waited goes on as if those who stand were not there."""
    again: float = 0.1
    """Time between two looks."""
    gain: float = 0.9
    """Part of a gap that one step may use up (see ``_barrier``)."""
    margin: float = 1e-5
    """Gap to obstacles that shortest ways keep, in radii of the workspace."""


class Memory(NamedTuple):
    """What robots remember, and scratch."""

    wish: Floats
    """(runs, n, 2): velocity that was chosen, of a manoeuvre or on the shortest way."""
    acts: Ints
    """(runs, n): 1 during a manoeuvre, 0 on the shortest way."""
    holds: Ints
    """(runs, n): steps for which the shortest way keeps its direction."""
    heading: Floats
    """(runs, n, 2): direction in which each was last seen to move."""
    rank: Floats
    """(runs, n): free run at the start; the larger goes first."""
    waited: Ints
    """(runs, n): looks since a robot began to stand among others, and from ``patience`` on until its way is clear."""
    cost: Floats
    known: Ints
    near: Ints
    planes: Floats


class Scale(NamedTuple):
    """Lengths of the rules and parameters in radii of the workspace."""

    r: float
    step: float
    tol: float
    horizon: float
    stride: float
    fear: float
    room: float
    gain: float
    cadence: int
    patience: int


def manoeuvres(r: float) -> Floats:
    """Return the manoeuvres (k, 3): turn away from the shortest way [rad], part of full speed, time."""
    turns = [sign * math.radians(turn) for turn in TURNS_DEG for sign in (1, -1)] + [math.pi]
    rows = [(turn, 1.0, length) for turn in turns for length in LENGTHS]
    rows += [(0.0, 0.0, wait) for wait in WAITS]
    rows += [(0.0, speed, time) for speed in SPEEDS for time in SLOW_TIMES]
    return np.array(rows) * (1.0, 1.0, r)


class ReactiveController:
    """The reactive controller for some runs."""

    def __init__(self, problem: Problem, params: Params) -> None:
        rules = problem.rules
        self._problem = problem
        self._first, self._disc = problem.discs()
        self._ways, self._field = bounds.ways_of(problem, params.margin)
        self._menu = manoeuvres(rules.r)
        cadence = max(1, round(params.again * rules.r / rules.step))
        self._scale = Scale(
            r=rules.r,
            step=rules.step,
            tol=rules.tol,
            horizon=params.horizon * rules.r,
            stride=params.stride * rules.r,
            fear=params.fear * rules.r,
            room=params.room * rules.r,
            gain=params.gain,
            cadence=cadence,
            patience=max(1, round(params.patience * rules.r / (cadence * rules.step))),
        )
        runs, n = problem.goal.shape[:2]
        self._memory = Memory(
            wish=np.zeros((runs, n, 2)),
            acts=np.zeros((runs, n), dtype=np.int64),
            holds=np.zeros((runs, n), dtype=np.int64),
            heading=np.zeros((runs, n, 2)),
            rank=np.zeros((runs, n)),
            waited=np.zeros((runs, n), dtype=np.int64),
            cost=np.zeros(len(self._menu)),
            known=np.zeros(len(self._menu), dtype=np.int64),
            near=np.zeros(n, dtype=np.int64),
            planes=np.zeros((MOST, 3)),
        )

    def velocities(self, step: int, alive: Ints, state: Floats, velocity: Floats, out: Floats) -> None:
        """Write the velocities (see ``Controller``)."""
        _velocities(
            step,
            alive,
            state,
            velocity,
            self._problem.map_of,
            self._first,
            self._disc,
            self._ways,
            self._field,
            self._menu,
            self._scale,
            self._memory,
            out,
        )


def create(problem: Problem, params: Params) -> ReactiveController:
    """Return the controller of these runs."""
    return ReactiveController(problem, params)


@jit
def _velocities(
    step: int,
    alive: Ints,
    state: Floats,
    velocity: Floats,
    map_of: Ints,
    first: Ints,
    disc: Floats,
    ways: Ways,
    field: Ints,
    menu: Floats,
    scale: Scale,
    memory: Memory,
    out: Floats,
) -> None:
    for b in alive:
        n = state.shape[1]
        if step % scale.cadence == 0 and step > 0:
            for i in range(n):
                _watch(b, i, step == scale.cadence, state, velocity, memory)
            for i in range(n):
                acts = _decide(b, i, state, velocity, ways, field[b, i], menu, scale, memory)
                if acts != memory.acts[b, i]:
                    memory.acts[b, i], memory.holds[b, i] = acts, 0
        for i in range(n):
            if memory.acts[b, i] == 0 and memory.holds[b, i] <= 0:
                _follow(b, i, state, ways, field[b, i], scale, memory)
            memory.holds[b, i] -= 1
            wx, wy = memory.wish[b, i, 0], memory.wish[b, i, 1]
            obstacles = disc[first[map_of[b]] : first[map_of[b] + 1]]
            ux, uy = nearest_admissible(i, wx, wy, state[b], obstacles, scale.r, scale.step, scale.gain, memory.planes)
            out[b, i, 0], out[b, i, 1] = ux, uy
            if ux != wx or uy != wy:
                memory.holds[b, i] = 0


@jit_inner
def _follow(b: int, i: int, state: Floats, ways: Ways, field: int, scale: Scale, memory: Memory) -> None:
    """Note the direction of the shortest way, and for how many steps it stays the same."""
    x, y = state[b, i, 0], state[b, i, 1]
    length, ux, uy, slot = look_up(ways, field, x, y)
    if length < 0.5 * scale.tol:
        memory.wish[b, i, 0], memory.wish[b, i, 1] = 0.0, 0.0
        return
    memory.wish[b, i, 0], memory.wish[b, i, 1] = ux, uy
    straight = length - 0.5 * scale.tol if slot < 0 else straight_part(ways, slot, x, y)
    memory.holds[b, i] = int(straight / scale.step)


@jit_inner
def _watch(b: int, i: int, settle: bool, state: Floats, velocity: Floats, memory: Memory) -> None:
    """Note in which direction robot i moves; at the first look also its rank."""
    vx, vy = velocity[b, i, 0], velocity[b, i, 1]
    speed = math.sqrt(vx * vx + vy * vy)
    if speed > MOVES:
        memory.heading[b, i, 0], memory.heading[b, i, 1] = vx / speed, vy / speed
    if settle:
        memory.rank[b, i] = free_run(state[b, i, 0], state[b, i, 1], memory.heading[b, i, 0], memory.heading[b, i, 1])


@jit_inline
def free_run(x: float, y: float, vx: float, vy: float) -> float:
    """Return for how long a point with velocity v stays in the unit disk; 0 if it stands."""
    speed2 = vx * vx + vy * vy
    if speed2 == 0.0:
        return 0.0
    along = x * vx + y * vy
    return (math.sqrt(max(0.0, along * along + speed2 * (1.0 - x * x - y * y))) - along) / speed2


@jit_inner
def _goes_first(b: int, i: int, j: int, memory: Memory) -> bool:
    """Return whether robot j goes before robot i."""
    mine, other = memory.rank[b, i], memory.rank[b, j]
    return bool(mine < other or (mine == other and j < i))


@jit_inner
def _concerned(b: int, i: int, pushes: bool, state: Floats, velocity: Floats, scale: Scale, memory: Memory) -> int:
    """List the robots that i has to mind: those that go first, and (unless it pushes) those that stand.

    Return their number.
    """
    reach = 2.0 * (scale.horizon + scale.r) + scale.room
    count = 0
    for j in range(state.shape[1]):
        if j == i or abs(state[b, j, 0] - state[b, i, 0]) > reach or abs(state[b, j, 1] - state[b, i, 1]) > reach:
            continue
        vx, vy = velocity[b, j, 0], velocity[b, j, 1]
        stands = vx * vx + vy * vy < STANDS * STANDS
        if (stands and not pushes) or _goes_first(b, i, j, memory):
            memory.near[count] = j
            count += 1
    return count


@jit_inner
def _conflict(
    b: int,
    i: int,
    count: int,
    t: float,
    h: float,
    px: float,
    py: float,
    qx: float,
    qy: float,
    state: Floats,
    velocity: Floats,
    scale: Scale,
    memory: Memory,
) -> bool:
    """Return whether going from p at time t to q at t + h comes too near to anybody of the list."""
    for k in range(count):
        j = memory.near[k]
        x, y = state[b, j, 0], state[b, j, 1]
        vx, vy = velocity[b, j, 0], velocity[b, j, 1]
        if vx * vx + vy * vy < STANDS * STANDS:
            vx, vy = 0.0, 0.0
            if _goes_first(b, i, j, memory):
                vx, vy = memory.heading[b, j, 0], memory.heading[b, j, 1]
        apart = math.sqrt((x - state[b, i, 0]) ** 2 + (y - state[b, i, 1]) ** 2)
        # Who is already nearer than one would like may stay as near as that.
        near = min(2.0 * scale.r + scale.room, 0.999 * apart)
        last = free_run(x, y, vx, vy)
        t0, t1 = min(t, last), min(t + h, last)
        if nearest_on_the_way(px - x - vx * t0, py - y - vy * t0, qx - x - vx * t1, qy - y - vy * t1) < near:
            return True
    return False


@jit_inner
def _clear_until(
    b: int,
    i: int,
    count: int,
    x: float,
    y: float,
    t: float,
    ways: Ways,
    field: int,
    state: Floats,
    velocity: Floats,
    scale: Scale,
    memory: Memory,
) -> float:
    """Return when one who follows the shortest way from (x, y) at time t meets somebody; infinity if not soon."""
    if count == 0:
        return math.inf
    end = t + scale.horizon
    straight, dx, dy, slot = 0.0, 0.0, 0.0, 0
    while t < end:
        if straight < scale.stride and slot >= 0:
            straight, dx, dy, slot = look_up(ways, field, x, y)
            if slot >= 0:
                straight = straight_part(ways, slot, x, y)
        # Past the point where the way begins to bend it is left by a hair: the next look finds back.
        go = scale.stride if slot >= 0 else min(scale.stride, straight)
        straight -= go
        qx, qy = x + dx * go, y + dy * go
        if _conflict(b, i, count, t, scale.stride, x, y, qx, qy, state, velocity, scale, memory):
            return t
        x, y = qx, qy
        t += scale.stride
    return math.inf


@jit_inner
def _clear_straight(
    b: int,
    i: int,
    count: int,
    x: float,
    y: float,
    ux: float,
    uy: float,
    time: float,
    state: Floats,
    velocity: Floats,
    scale: Scale,
    memory: Memory,
) -> float:
    """Return when one who goes with velocity u from (x, y) meets somebody; ``time`` or more if not until then."""
    clear = 0.0
    while clear < time:
        h = min(scale.stride, time - clear)
        ax, ay = x + ux * clear, y + uy * clear
        if _conflict(b, i, count, clear, h, ax, ay, ax + ux * h, ay + uy * h, state, velocity, scale, memory):
            break
        clear += scale.stride
    return clear


@jit_inner
def _fear(clear: float, scale: Scale) -> float:
    """Return what a conflict at that time costs."""
    return scale.fear * max(0.0, scale.horizon / (clear + 0.02 * scale.r) - 1.0)


@jit_inner
def _decide(
    b: int,
    i: int,
    state: Floats,
    velocity: Floats,
    ways: Ways,
    field: int,
    menu: Floats,
    scale: Scale,
    memory: Memory,
) -> int:
    """Choose between the shortest way (0) and a manoeuvre (1, and its velocity is noted)."""
    x, y = state[b, i, 0], state[b, i, 1]
    count = _concerned(b, i, False, state, velocity, scale, memory)
    clear = _clear_until(b, i, count, x, y, 0.0, ways, field, state, velocity, scale, memory)
    if clear == math.inf:
        memory.waited[b, i] = 0
        return 0
    vx, vy = velocity[b, i, 0], velocity[b, i, 1]
    if memory.waited[b, i] < scale.patience:
        memory.waited[b, i] = memory.waited[b, i] + 1 if vx * vx + vy * vy < STANDS * STANDS else 0
    if memory.waited[b, i] >= scale.patience:
        count = _concerned(b, i, True, state, velocity, scale, memory)
        clear = _clear_until(b, i, count, x, y, 0.0, ways, field, state, velocity, scale, memory)
        if clear == math.inf:
            return 0
    length, wx, wy, _ = look_up(ways, field, x, y)
    best, acts = length + _fear(clear, scale), 0
    for k in range(len(menu)):
        # Nobody who travels on for so long can be nearer to the goal than this: the cost is looked up when it matters.
        memory.cost[k], memory.known[k] = menu[k, 2] + length - menu[k, 1] * menu[k, 2], 0
    while True:
        k = int(np.argmin(memory.cost))
        if memory.cost[k] >= best:
            return acts
        turn, speed, time = menu[k, 0], menu[k, 1], menu[k, 2]
        cosine, sine = math.cos(turn) * speed, math.sin(turn) * speed
        ux, uy = wx * cosine - wy * sine, wx * sine + wy * cosine
        qx, qy = x + ux * time, y + uy * time
        if memory.known[k] == 0:
            memory.known[k] = 1
            memory.cost[k] = _cost_of_going(ways, field, x, y, qx, qy, time)
            continue
        cost, memory.cost[k] = memory.cost[k], math.inf
        clear = _clear_straight(b, i, count, x, y, ux, uy, time, state, velocity, scale, memory)
        if clear >= time:
            clear = _clear_until(b, i, count, qx, qy, time, ways, field, state, velocity, scale, memory)
        if clear < math.inf:
            cost += _fear(clear, scale)
        if cost < best:
            best, acts = cost, 1
            memory.wish[b, i, 0], memory.wish[b, i, 1] = ux, uy


@jit_inner
def _cost_of_going(ways: Ways, field: int, x: float, y: float, qx: float, qy: float, time: float) -> float:
    """Return the time of arrival of one who first goes straight to q for some time; infinity if q is not free."""
    if qx * qx + qy * qy > 1.0:
        return math.inf
    if (qx != x or qy != y) and not segment_is_free(ways, ways.field_map[field], x, y, qx, qy, -1, -1):
        return math.inf
    onward, _, _, _ = look_up(ways, field, qx, qy)
    return time + onward
