"""A navigation function of all robots at once, descended by each robot in its own part of the joint space.

Unit-disk report, section 2.1, asks for a potential U(X) of all robots whose descent leads everyone home without a
collision. This is one of the kind of Koditschek and Rimon, carried over to many discs by Karagoz, Bozma and
Koditschek: attraction to a power against the product of everything that must stay above zero,

    phi = gamma^k / beta,    gamma = sum_i s(V_i),    beta = prod_(i<j) h_ij prod_(i,m) h_im,

in logarithms (``_potential`` has the formulas; log phi has the same critical points and the same descent).

V_i is the exact length of robot i's shortest way to its goal among obstacles grown by r and a small margin, so
obstacles that overlap after growing are merged into whatever shape they form, and no star or forest transform is
needed: a way's length falls at rate 1 along the way, in every bay and crevice, also where two ways are equally
long. h is 1 beyond a short range, so that only what is near matters. The rim is no factor of beta, because starts
and goals lie on it: moves are projected onto the disk instead, which keeps descent.

What holds, and why
-------------------
*No collision, unconditionally*, in discrete time, for every map, number of robots, length of a step and choice of
numbers, from any state that is free: no robot uses more than 0.45 of its gap to any robot or 0.9 of that to any
obstacle in one step, and steps are straight. This does not rest on the potential.

*Descent.* Each robot moves along minus its own block of the gradient, scaled by a positive number and turned by at
most 80 degrees, so d/dt phi <= -cos(80 deg) sum_i |u_i| |grad_i phi| <= 0 in continuous time; scaling and turning
add no equilibrium: robots rest at critical points of phi (on the rim: where the projected gradient is zero) only.
The turn is free to be anything, and is used to steer clear of where others will be, to the right rather than left.

*Alone, a robot arrives from everywhere* that is connected to its goal at the margin chosen (``widest_margins``):
inside a margin the way's first direction does not point into the obstacle, so its inner product with any sum of
pushes of obstacles is not negative, and going that way phi falls at a rate of at least k s'(V)/gamma. So phi of one
robot has no critical point but the goal, not even a saddle, whatever the shape of the obstacles.

What does not hold
------------------
Together, robots arrive from almost all starts only if every critical point besides the goals is a saddle. In the
literature that is proved for smooth attraction and k large enough in worlds with room. Here V has kinks: next to a
wall the way's direction turns back to the wall so sharply (like the root of the distance) that two robots that meet
head-on along it can have a true minimum, for any k; a passage for one has one, too, if two want through it in
opposite senses and neither can be pushed all the way back. So do robots packed against each other or the rim. The
steering makes such meetings rare, nothing excludes them. Steps of a finite length follow phi down only up to its
curvature: near contact, where phi is steep, it may rise for a step and robots may tremble.
Robots that have arrived stay part of gamma and of beta: they give way to others and return.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.disk import bounds, geodesic
from swarmscope.disk.controllers._potential import attraction, obstruction
from swarmscope.disk.rules import ROUNDING, Floats, Ints
from swarmscope.disk.runs import Problem

SUMMARY = "descends a navigation function of all robots: shortest ways against nearness, turned to pass each other"
KNOWS = "all positions and goals, what the others did in the last step, all obstacles"
GUARANTEES = (
    "never a collision, in discrete time and from any free state; a robot alone always arrives, if the way leaves it "
    "0.0001 on both sides; together the potential falls (short steps), but may have minima besides the goals: next to "
    "walls, in passages for one, in a throng"
)

LIMITS = {
    "k": (1e-3, 1e9),
    "power": (0.01, 100.0),
    "smooth": (1e-6, 1.0),
    "steer": (0, 1),
    "horizon": (1e-6, 1000.0),
}

MARGINS = (0.004, 0.002, 0.001, 0.0005, 0.0002, 0.0001)
"""Widths of the strip round obstacles in which they push, widest first; the first that bars no way is taken."""
DETOUR = 0.02
"""A margin that makes some way longer than this is said to bar it."""
SHARE = 0.45
"""Part of the gap to another robot that may be used up in one step; below 1/2 two robots cannot touch."""
EDGE = 0.1
"""Part of the gap to an obstacle that is never used up in one step."""
TURN = math.radians(20.0)
SIDES = 4
"""The descent is turned by a multiple of TURN, at most SIDES of them: less than 90 degrees, so that it descends."""
GRAZE = 0.03
"""Part of the margin that a way may cut into without counting as a way into the obstacle: ways go along margins."""
RIM_AHEAD, RIM_COUNTS = 0.01, 0.3
"""A direction that leaves the disk within that way counts like a robot met after that part of the horizon."""
FULL = 0.05
"""A robot goes at full speed unless pull and pushes cancel to less than this part of the pull."""


class Params(NamedTuple):
    """Numbers of the navigation function."""

    k: float = 3000.0
    """Exponent of gamma: the larger, the nearer robots come before their push outweighs the pull."""
    power: float = 1.0
    """p of the attraction s(V), about V^p."""
    smooth: float = 0.02
    """e of s(V): nearer to the goal than about this the pull fades."""
    reach: float = 1.0
    """Gap at which a robot begins to push, in radii of a robot."""
    steer: int = 1
    """1: turn the descent, by at most 80 degrees, away from where others will be; 0: pure descent."""
    horizon: float = 0.5
    """A robot is seen coming when it would touch within the time in which one covers this length."""
    clearance: float = 0.1
    """How far one steers clear of others, in radii of a robot."""
    turn_cost: float = 0.5
    """What the widest turn costs; a touch at once costs 1."""
    left_cost: float = 0.1
    """What a turn to the left costs more than one to the right."""


class NavigationFunction:
    """The navigation function of some runs."""

    def __init__(self, problem: Problem, params: Params) -> None:
        self._params, self._rules = params, problem.rules
        margins = widest_margins(problem)
        field_map, field_goal, self._field = bounds.fields(problem)
        ways = geodesic.build([one.obstacles for one in problem.maps], (problem.rules.r + margins).tolist())
        self._ways = geodesic.add_goals(ways, field_map, field_goal)
        self._margin, self._map_of = margins, problem.map_of
        self._pull = np.zeros((problem.rules.n, 5))

    def velocities(self, step: int, alive: Ints, state: Floats, velocity: Floats, out: Floats) -> None:
        """Write the velocities (see ``Controller``)."""
        _velocities(
            alive,
            state,
            velocity,
            self._ways,
            self._field,
            self._map_of,
            self._margin,
            self._rules.r,
            self._rules.step,
            self._params,
            self._pull,
            out,
        )

    def potential(self, state: Floats, out: Floats) -> None:
        """Write log phi of each run into ``out`` (runs,): infinity where something touches."""
        _potentials(state, self._ways, self._field, self._map_of, self._margin, self._rules.r, self._params, out)

    def gradient(self, state: Floats, out: Floats) -> None:
        """Write the gradient of log phi by the positions into ``out`` (runs, n, 2)."""
        _gradients(
            state, self._ways, self._field, self._map_of, self._margin, self._rules.r, self._params, self._pull, out
        )


def create(problem: Problem, params: Params) -> NavigationFunction:
    """Return the controller of these runs."""
    return NavigationFunction(problem, params)


def widest_margins(problem: Problem) -> Floats:
    """Return for each map the widest margin round its obstacles that makes no robot's way much longer."""
    maps = [one.obstacles for one in problem.maps]
    field_map, field_goal, field = bounds.fields(problem)
    start = problem.start.reshape(-1, 2)

    def lengths(margins: Floats) -> Floats:
        ways = geodesic.add_goals(geodesic.build(maps, (problem.rules.r + margins).tolist()), field_map, field_goal)
        return geodesic.lengths(ways, field, start)

    best = lengths(np.zeros(len(maps)))
    margins = np.full(len(maps), MARGINS[0])
    owner = np.repeat(problem.map_of, problem.rules.n)
    for narrower in MARGINS[1:]:
        barred = np.unique(owner[~(lengths(margins) <= best + DETOUR)])
        if not len(barred):
            break
        margins[barred] = narrower
    return margins


@jit_inner
def _attractions(b: int, state: Floats, ways: geodesic.Ways, field: Ints, params: Params, pull: Floats) -> float:
    """Write (ds/dV, direction, V, disc that the way makes for or -1) of each robot into ``pull``, return gamma."""
    gamma = 0.0
    for i in range(state.shape[1]):
        way, dx, dy, slot = geodesic.look_up(ways, field[b, i], state[b, i, 0], state[b, i, 1])
        if not way < math.inf:
            way, dx, dy = 2.0, 0.0, 0.0
        value, slope = attraction(way, params.power, params.smooth)
        gamma += value
        pull[i, 0], pull[i, 1], pull[i, 2], pull[i, 3] = slope, dx, dy, way
        pull[i, 4] = slot // 2 if slot >= 0 else -1
    return max(gamma, 1e-12)


@jit_inner
def _descent(
    b: int,
    i: int,
    state: Floats,
    ways: geodesic.Ways,
    which: int,
    margin: float,
    r: float,
    stride: float,
    force: float,
    pull: Floats,
    params: Params,
) -> tuple[float, float, float]:
    """Return minus the gradient of log phi by robot i's position, and how far it may move without touching.

    force is k / gamma. The room is below SHARE of the gap to each robot, and below the gap to each obstacle;
    those too far to be met within ``stride`` are left out. In a crevice where margins overlap, a way found from
    inside may begin into one of them; then the pull is left out, and the pushes alone lead out of the crevice.
    """
    x, y = state[b, i, 0], state[b, i, 1]
    fx = fy = 0.0
    inwards = False
    fall = 1.0
    room = math.inf
    reach = params.reach * r
    look = 2.0 * r + max(reach, 3.0 * stride)
    for j in range(state.shape[1]):
        px, py = x - state[b, j, 0], y - state[b, j, 1]
        square = px * px + py * py
        if j != i and square < look * look:
            apart = math.sqrt(square)
            gap = apart - 2.0 * r
            room = min(room, SHARE * gap)
            _, push = obstruction(gap, reach)
            fx += push * px / apart
            fy += push * py / apart
    for m in range(ways.disc_start[which], ways.disc_start[which + 1]):
        px, py, rho = x - ways.disc[m, 0], y - ways.disc[m, 1], ways.disc[m, 2]
        square = px * px + py * py
        look = rho + 2.0 * stride
        if square < look * look:
            apart = math.sqrt(square)
            gap = apart - rho + margin
            room = min(room, (1.0 - EDGE) * gap)
            _, push = obstruction(gap, margin)
            fx += push * px / apart
            fy += push * py / apart
            if gap < margin and pull[i, 4] == m:
                # Inside the margin V is the length along its edge, which is longer by that than where the robot is.
                fall = rho / apart
            inwards = inwards or (gap < margin and px * pull[i, 1] + py * pull[i, 2] < -ROUNDING)
    if not inwards:
        fx += force * fall * pull[i, 0] * pull[i, 1]
        fy += force * fall * pull[i, 0] * pull[i, 2]
    return fx, fy, room


@jit_inner
def _steered(
    b: int,
    i: int,
    state: Floats,
    velocity: Floats,
    ux: float,
    uy: float,
    ways: geodesic.Ways,
    which: int,
    margin: float,
    r: float,
    params: Params,
) -> tuple[float, float]:
    """Return the direction of descent u, turned away by up to 80 degrees if robot i would soon touch something."""
    danger = _danger(b, i, state, velocity, ux, uy, ways, which, margin, r, params)
    if danger <= 0.0:
        return ux, uy
    best, bx, by = danger, ux, uy
    for k in range(-SIDES, SIDES + 1):
        if k == 0:
            continue
        cosine, sine = math.cos(k * TURN), math.sin(k * TURN)
        vx, vy = ux * cosine - uy * sine, ux * sine + uy * cosine
        cost = params.turn_cost * abs(k) / SIDES + (params.left_cost if k > 0 else 0.0)
        if cost >= best:
            continue
        cost += _danger(b, i, state, velocity, vx, vy, ways, which, margin, r, params)
        if cost < best:
            best, bx, by = cost, vx, vy
    return bx, by


@jit_inner
def _danger(
    b: int,
    i: int,
    state: Floats,
    velocity: Floats,
    ux: float,
    uy: float,
    ways: geodesic.Ways,
    which: int,
    margin: float,
    r: float,
    params: Params,
) -> float:
    """Return 1 if robot i, going along u at full speed, touches something at once, 0 if not within the horizon."""
    x, y = state[b, i, 0], state[b, i, 1]
    first = 1.0
    wide = (2.0 + params.clearance) * r
    for j in range(state.shape[1]):
        if j == i:
            continue
        px, py = state[b, j, 0] - x, state[b, j, 1] - y
        vx, vy = ux - velocity[b, j, 0], uy - velocity[b, j, 1]
        first = min(first, _touch(px, py, vx, vy, wide) / params.horizon)
    for m in range(ways.disc_start[which], ways.disc_start[which + 1]):
        px, py = ways.disc[m, 0] - x, ways.disc[m, 1] - y
        within = ways.disc[m, 2] - GRAZE * margin
        first = min(first, _touch(px, py, ux, uy, within) / (0.5 * params.horizon))
    nx, ny = x + RIM_AHEAD * ux, y + RIM_AHEAD * uy
    if nx * nx + ny * ny > 1.0:
        first = min(first, RIM_COUNTS)
    return 1.0 - first


@jit_inner
def _touch(px: float, py: float, vx: float, vy: float, wide: float) -> float:
    """Return the time at which a point p that one moves towards with v comes as near as ``wide``, else infinity."""
    closing = px * vx + py * vy
    if closing <= 0.0:
        return math.inf
    over = px * px + py * py - wide * wide
    if over <= 0.0:
        return 0.0
    speed2 = vx * vx + vy * vy
    under = closing * closing - speed2 * over
    if under <= 0.0:
        return math.inf
    return over / (closing + math.sqrt(under))


@jit
def _velocities(
    alive: Ints,
    state: Floats,
    velocity: Floats,
    ways: geodesic.Ways,
    field: Ints,
    map_of: Ints,
    margins: Floats,
    r: float,
    stride: float,
    params: Params,
    pull: Floats,
    out: Floats,
) -> None:
    for b in alive:
        which = map_of[b]
        force = params.k / _attractions(b, state, ways, field, params, pull)
        for i in range(state.shape[1]):
            fx, fy, room = _descent(b, i, state, ways, which, margins[which], r, stride, force, pull, params)
            size = math.sqrt(fx * fx + fy * fy)
            out[b, i, 0], out[b, i, 1] = 0.0, 0.0
            if not (size > 1e-9 and size < math.inf):
                continue
            ux, uy = fx / size, fy / size
            if params.steer and pull[i, 3] > 2.0 * stride:
                ux, uy = _steered(b, i, state, velocity, ux, uy, ways, which, margins[which], r, params)
            steered = ux * fx + uy * fy < size * 0.9999
            # Blocks of the gradient may be scaled: full speed, less where push and pull are about to cancel,
            # near the goal, and where a longer step could touch something.
            length = min(min(stride, room), stride * min(1.0, size / (FULL * force)))
            if length > pull[i, 3] and ux * pull[i, 1] + uy * pull[i, 2] > 0.0:
                length = pull[i, 3]
            x, y = state[b, i, 0], state[b, i, 1]
            mx, my = _kept_inside(x, y, length * ux, length * uy)
            if steered and mx * fx + my * fy <= 0.0:
                # At the rim a turned descent may not descend any more; the gradient itself, projected, does.
                mx, my = _kept_inside(x, y, length * fx / size, length * fy / size)
            out[b, i, 0], out[b, i, 1] = mx / stride, my / stride


@jit_inner
def _kept_inside(x: float, y: float, mx: float, my: float) -> tuple[float, float]:
    """Return the move m from a point of the workspace, shortened to end at its point nearest to x + m."""
    nx, ny = x + mx, y + my
    away = math.sqrt(nx * nx + ny * ny)
    if away <= 1.0:
        return mx, my
    return nx / away - x, ny / away - y


@jit
def _gradients(
    state: Floats,
    ways: geodesic.Ways,
    field: Ints,
    map_of: Ints,
    margins: Floats,
    r: float,
    params: Params,
    pull: Floats,
    out: Floats,
) -> None:
    for b in range(len(state)):
        which = map_of[b]
        force = params.k / _attractions(b, state, ways, field, params, pull)
        for i in range(state.shape[1]):
            fx, fy, _ = _descent(b, i, state, ways, which, margins[which], r, 0.0, force, pull, params)
            out[b, i, 0], out[b, i, 1] = -fx, -fy


@jit
def _potentials(
    state: Floats,
    ways: geodesic.Ways,
    field: Ints,
    map_of: Ints,
    margins: Floats,
    r: float,
    params: Params,
    out: Floats,
) -> None:
    for b in range(len(state)):
        which = map_of[b]
        gamma = total = 0.0
        for i in range(state.shape[1]):
            x, y = state[b, i, 0], state[b, i, 1]
            way, _, _, _ = geodesic.look_up(ways, field[b, i], x, y)
            gamma += attraction(way, params.power, params.smooth)[0]
            for j in range(i):
                apart = math.hypot(x - state[b, j, 0], y - state[b, j, 1])
                total += obstruction(apart - 2.0 * r, params.reach * r)[0]
            for m in range(ways.disc_start[which], ways.disc_start[which + 1]):
                apart = math.hypot(x - ways.disc[m, 0], y - ways.disc[m, 1])
                total += obstruction(apart - ways.disc[m, 2] + margins[which], margins[which])[0]
        out[b] = params.k * math.log(max(gamma, 1e-12)) + total
