"""Where does one robot end up, from anywhere? A numerical check for local minima, for every controller.

One robot moves, the others (if any) are frozen. ``field_on_grid`` asks a controller for the robot's velocity at
every free point of a grid; ``basins`` follows the field from each of them until the robot arrives, stalls, touches
something or has gone a very long way, which it can only do by circling. That finds what draws a robot in from a
set that the grid meets; it does not prove that nothing else exists, and it says nothing of robots that stall each
other while all of them move.

Equipotentials: a controller that descends a potential may say so by one more method,

    def potential(self, state: Floats, out: Floats) -> None

that writes the potential of each run's positions ``state`` (runs, n, 2) into ``out`` (runs,), infinity where
something touches. ``potential_on_grid`` uses it and raises ConfigError for controllers without it; ask
``has_potential`` first.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from swarmscope.disk.controllers import Kind
from swarmscope.disk.maps import DiskMap
from swarmscope.disk.rules import ROUNDING, Floats, Ints, Rules, goals
from swarmscope.disk.runs import Controller, Problem
from swarmscope.errors import ConfigError

ARRIVES, BARRED, CIRCLES, TOUCHES = 0, -1, -2, -3
"""Labels of basins besides 1, 2, ... of the stall points: an end at the goal, no free point, and two bad ends."""
WINDOW = 1000
"""Steps over which a robot has to get somewhere: near an unstable equilibrium it is slow for some hundreds."""
PROGRESS = 0.05
"""A robot that stays within this part of the way it could go in a window stalls."""
FILMED = 20
"""Steps between two points of a path."""
CLUSTER = 0.03
"""Ends nearer to each other than this are the same stall point."""


TIGHT = 1e-6
"""Points of the grid with a smaller gap than this count as barred: there a rounding error decides on contact."""


class Situation(NamedTuple):
    """One robot that moves among others that do not."""

    kind: Kind
    map: DiskMap
    rules: Rules
    permutation: tuple[int, ...]
    """Who goes where, for the goals of all robots."""
    robot: int
    """The one that moves."""
    others: Floats | None = None
    """(n, 2) where the robots are, of which row ``robot`` is not used; None if this one is alone on the map."""

    @property
    def goal(self) -> Floats:
        """The place that the robot goes to, (2,)."""
        place: Floats = goals(self.permutation)[self.robot]
        return place

    @property
    def row(self) -> int:
        """The robot's row in the states that the controller gets."""
        return 0 if self.others is None else self.robot


class FieldGrid(NamedTuple):
    """Velocities on a grid; [k, l] belongs to y[k], x[l]."""

    x: Floats
    y: Floats
    velocity: Floats
    """(ny, nx, 2) in units of v_max, not longer than 1; NaN where the robot cannot be."""
    free: npt.NDArray[np.bool_]
    """(ny, nx): whether the robot touches nothing there."""


class Stall(NamedTuple):
    """A place where robots get stuck."""

    x: float
    y: float
    points: int
    """Points of the grid from which it is reached."""


class Basins(NamedTuple):
    """Where one ends up from each point of a grid."""

    grid: FieldGrid
    """The field that was followed; it was asked for with steps as the rules have them."""
    labels: Ints
    """(ny, nx): ARRIVES, BARRED, CIRCLES, TOUCHES, or k for ``stalls[k - 1]``."""
    ends: Floats
    """(ny, nx, 2): the last position; NaN where the robot cannot be."""
    stalls: tuple[Stall, ...]
    """Largest first."""

    def share(self, label: int) -> float:
        """Return the part of the free points that has this label."""
        return float((self.labels == label).sum() / max(1, self.grid.free.sum()))


@runtime_checkable
class WithPotential(Protocol):
    """A controller that descends a potential."""

    def potential(self, state: Floats, out: Floats) -> None:
        """Write the potential of each run into ``out`` (runs,)."""


def field_on_grid(of: Situation, resolution: int = 61) -> FieldGrid:
    """Return the velocity at ``resolution`` by ``resolution`` points of the workspace, for a robot that stood still."""
    return _field(of, *_grid(of, resolution))


def _field(of: Situation, axis: Floats, free: npt.NDArray[np.bool_], state: Floats) -> FieldGrid:
    velocity = np.full((*free.shape, 2), np.nan)
    if free.any():
        controller = _controller(of, len(state), 1)
        chosen = np.zeros(state.shape)
        controller.velocities(0, np.arange(len(state)), state, np.zeros(state.shape), chosen)
        velocity[free] = _cut(chosen[:, of.row])
    return FieldGrid(axis, axis.copy(), velocity, free)


def has_potential(of: Situation) -> bool:
    """Return whether the controller offers a potential."""
    return isinstance(_controller(of, 1, 1), WithPotential)


def potential_on_grid(of: Situation, resolution: int = 61) -> Floats:
    """Return the potential (ny, nx) with the robot at each point of the grid, NaN where it cannot be.

    Errors: ConfigError if the controller offers none.
    """
    _, free, state = _grid(of, resolution)
    controller = _controller(of, max(1, len(state)), 1)
    if not isinstance(controller, WithPotential):
        raise ConfigError("controller", f"{of.kind.name} offers no potential")
    values = np.full(free.shape, np.nan)
    found = np.empty(len(state))
    controller.potential(state, found)
    values[free] = found
    return values


def basins(of: Situation, resolution: int = 41, coarse: float = 1.0, longest: float = 6.0) -> Basins:
    """Follow the field from every free point of a grid to its end.

    Args:
        of: who moves where.
        resolution: points of the grid along each axis.
        coarse: length of a step, in steps of the rules; the controller is told that steps are that long. More than
            1 is as much faster, but can lose what happens in small gaps (the report's controller circles at 1 only).
        longest: way [radii of the workspace] after which a robot is said to circle.
    """
    axis, free, state = _grid(of, resolution)
    grid = _field(of, axis, free, state)
    fate = _follow(of, state, coarse, longest) if free.any() else np.empty(0, dtype=np.int64)
    end = state[:, of.row]
    stalls, owner = _clusters(end[fate == 1])
    fate[fate == 1] = owner + 1
    labels, ends = np.full(free.shape, BARRED, dtype=np.int64), np.full((*free.shape, 2), np.nan)
    labels[free], ends[free] = fate, end
    return Basins(grid, labels, ends, stalls)


def paths(of: Situation, resolution: int = 15, coarse: float = 1.0, longest: float = 3.0) -> list[Floats]:
    """Return where the robot goes from each free point of a grid, as points (k, 2)."""
    _, free, state = _grid(of, resolution)
    film: list[Floats] = []
    if free.any():
        _follow(of, state, coarse, longest, film)
    return list(np.array([*film, state[:, of.row]]).transpose(1, 0, 2))


def describe(found: Basins) -> str:
    """Return in words what was found."""
    words = [f"{found.share(ARRIVES):.1%} of {int(found.grid.free.sum())} points lead to the goal"]
    for label, what in ((CIRCLES, "circle"), (TOUCHES, "touch something or leave the disk")):
        if (found.labels == label).any():
            words.append(f"{found.share(label):.1%} {what}")
    count = len(found.stalls)
    places = ", ".join(f"({one.x:.3f}, {one.y:.3f}) from {one.points}" for one in found.stalls)
    words.append(f"{count} stall point{'' if count == 1 else 's'}{': ' + places if count else ''}")
    return "; ".join(words)


def _grid(of: Situation, resolution: int) -> tuple[Floats, npt.NDArray[np.bool_], Floats]:
    """Return the grid's axis, which points are free, and the states (free points, robots, 2)."""
    if resolution < 2:
        raise ConfigError("resolution", f"{resolution} points make no grid")
    axis = np.linspace(-1.0, 1.0, resolution)
    points = np.stack(np.meshgrid(axis, axis), axis=-1)
    free = (np.linalg.norm(points, axis=-1) <= 1.0) & (_least_gap(of, points) > TIGHT)
    count = int(free.sum())
    robots = points[free][:, None] if of.others is None else np.repeat(of.others[None], count, axis=0)
    robots = np.ascontiguousarray(robots, dtype=np.float64)
    robots[:, of.row] = points[free]
    return axis, free, robots


def _least_gap(of: Situation, points: Floats) -> Floats:
    """Return the gap between the robot at each point (..., 2) and whatever is nearest but the rim."""
    least = np.full(points.shape[:-1], math.inf)
    for x, y, radius in of.map.obstacles:
        least = np.minimum(least, np.hypot(points[..., 0] - x, points[..., 1] - y) - (radius + of.rules.r))
    if of.others is not None:
        for x, y in np.delete(of.others, of.robot, axis=0):
            least = np.minimum(least, np.hypot(points[..., 0] - x, points[..., 1] - y) - 2.0 * of.rules.r)
    return least


def _controller(of: Situation, runs: int, coarse: float) -> Controller:
    """Return a fresh controller for that many equal runs, with steps that are ``coarse`` times as long."""
    rules = replace(of.rules, dt=coarse * of.rules.dt)
    map_of = np.zeros(runs, dtype=np.int64)
    if of.others is not None:
        permutation = np.repeat(np.array([of.permutation], dtype=np.int64), runs, axis=0)
        return of.kind.create(Problem(rules, (of.map,), map_of, permutation), of.kind.params)
    alone = Problem(replace(rules, n=1), (of.map,), map_of, np.zeros((runs, 1), dtype=np.int64))
    # A problem of one robot knows one goal only; this robot has that of its place among the others.
    alone.goal[:] = of.goal
    return of.kind.create(alone, of.kind.params)


def _follow(of: Situation, state: Floats, coarse: float, longest: float, film: list[Floats] | None = None) -> Ints:
    """Move the robot in every state to its end, in place; return ARRIVES, CIRCLES, TOUCHES, or 1 for a stall.

    Positions are put into ``film`` now and then if it is given.
    """
    window = max(10, round(WINDOW / coarse))
    controller = _controller(of, len(state), coarse)
    step, row = coarse * of.rules.step, of.row
    velocity, chosen = np.zeros(state.shape), np.zeros(state.shape)
    fate = np.full(len(state), CIRCLES, dtype=np.int64)
    alive = np.arange(len(state))
    anchor, spread = state[:, row].copy(), np.zeros(len(state))
    for done in range(math.ceil(longest / step)):
        if film is not None and done % FILMED == 0:
            film.append(state[:, row].copy())
        away = np.linalg.norm(state[alive, row] - of.goal, axis=1)
        arrived = away <= max(of.rules.tol, step)
        fate[alive[arrived]] = ARRIVES
        alive = alive[~arrived]
        if not len(alive):
            break
        controller.velocities(done, alive, state, velocity, chosen)
        move = _cut(chosen[alive, row])
        velocity[alive, row] = move
        state[alive, row] += step * move
        now = state[alive, row]
        touches = ~((_least_gap(of, now) > 0.0) & (np.linalg.norm(now, axis=1) <= 1.0 + ROUNDING))
        fate[alive[touches]] = TOUCHES
        spread[alive] = np.maximum(spread[alive], np.linalg.norm(now - anchor[alive], axis=1))
        stuck = np.zeros(len(alive), dtype=bool)
        if done % window == window - 1:
            stuck = (spread[alive] < PROGRESS * window * step) & ~touches
            fate[alive[stuck]] = 1
            anchor[alive], spread[alive] = now, 0.0
        alive = alive[~(touches | stuck)]
    return fate


def _cut(velocity: Floats) -> Floats:
    """Return velocities (k, 2), those longer than 1 cut to length 1."""
    cut: Floats = velocity / np.maximum(1.0, np.linalg.norm(velocity, axis=1))[:, None]
    return cut


def _clusters(ends: Floats) -> tuple[tuple[Stall, ...], Ints]:
    """Return the stall points of ends (k, 2), and the index of each end's one."""
    owner = np.full(len(ends), -1, dtype=np.int64)
    groups: list[Ints] = []
    for k in range(len(ends)):
        if owner[k] < 0:
            near = (np.linalg.norm(ends - ends[k], axis=1) <= CLUSTER) & (owner < 0)
            owner[near] = len(groups)
            groups.append(np.flatnonzero(near))
    order = sorted(range(len(groups)), key=lambda g: -len(groups[g]))
    middles = [np.median(ends[groups[g]], axis=0) for g in order]
    stalls = tuple(Stall(float(x), float(y), len(groups[g])) for (x, y), g in zip(middles, order, strict=True))
    rank = np.empty(len(groups), dtype=np.int64)
    rank[order] = np.arange(len(groups))
    return stalls, rank[owner]
