"""Task depository: five wide robots through a cluttered store room, after the papers' experiment.

Published (Nav-SCOPE VII, SFM-MAS VI): 5 robots of r_e = 0.43 m, 0.38 obstacles per m^2 of various shapes, a
mean path of 10.77 m with gamma = 3.8 %, so shortest ways of 10.4 m. Everything else is ours: the room, the
mix and sizes of the shapes, that the robots go from one side to the other in the order of their starts, and that
things stand in stacks with aisles between them, as people put them. At this density nearly every gap between
things that stand about one by one is too narrow for such robots (``stack=1, aisle_m=0.1`` makes that room).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.sim.world import Circle, Obstacle, WorldSpec
from swarmscope.tasks._check import Reach, check_places, pass_each_other
from swarmscope.tasks._contract import Amount, Density, Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._forest import MARGIN_M, ROOM_M, smallest_spacing
from swarmscope.tasks._rocks import draw_rocks
from swarmscope.tasks._rooms import WALL_M, Box, closed_room, polygon

NAME = "depository"
SUMMARY = "five wide robots (robot.radius_m=0.43) through a cluttered store room"
REDRAWS = 40
TRIES_PER_THING = 2000
AT_ONCE = 40  # tries, which take hardly longer than one
WALL_SIDE_M = 1.5  # from the lines of starts and goals to the walls behind them
CLEAR_M = 1.4  # from these lines to the cluttered floor: room to pass a robot that has arrived
TOUCH_M = 0.02  # between the bounding circles of one stack's things
BOX_M = (0.2, 0.4)  # sides of boxes
DRUM_M = (0.08, 0.2)  # radii of drums
SHELF_M = ((0.6, 0.9), (0.1, 0.2))  # lengths and depths of shelves
PILE_M = (0.1, 0.2)  # a pile has the area of a disc of such a radius
SHARES = (0.4, 0.25, 0.15, 0.2)  # of boxes, drums, shelves and piles

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class DepositoryOptions:
    """Sizes of the room."""

    way_m: Length = 9.8  # from the starts to the goals
    width_m: Length = 7.0  # wider for more robots than fit side by side
    density: Density = 0.38  # things per m^2 of the cluttered floor
    size: Amount = 1.0  # of the things, times ours
    stack: Amount = 4.0  # things in a stack, at most
    aisle_m: Length = 1.0  # between stacks, and between stacks and walls, at least
    spare_m: Length = 0.1  # that a way leaves on both sides; r_e + 0.1 m is the published r = 0.49 m + 0.04 m


OPTIONS = DepositoryOptions


class _Thing(NamedTuple):
    outline: Floats | None  # corners (N, 2) round the origin [m]; None: a drum
    reach: float  # radius of the bounding circle [m]


class _Stack(NamedTuple):
    things: list[_Thing]
    offsets: Floats  # (N, 2) from the stack's middle [m]
    reach: float  # radius of the bounding circle [m]


class _NoRoomError(Exception):
    """One draw of the things does not fit."""


def make(seed: int, robots: int = 5, radius: float = 0.43, **options: Option) -> Setup:
    """Return a solvable store room; draw d uses the random stream (seed, d)."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    fits = False
    for draw in range(REDRAWS + 1):
        try:
            setup = draw_room(seed, draw, robots, radius, chosen)
        except _NoRoomError:
            continue
        fits = True
        if pass_each_other(setup, Reach(radius, chosen.spare_m)):
            check_places(setup, radius)
            return setup
    if not fits:
        raise ConfigError(f"task {NAME}: density", f"things of {chosen.density:g} per m^2 do not fit into the room")
    raise UnsolvableWorldError(
        f"no solvable depository in {REDRAWS + 1} draws of seed {seed} for robots of radius {radius:g} m; "
        "lower the density or the radius"
    )


def draw_room(seed: int, draw: int, robots: int, radius: float, options: DepositoryOptions) -> Setup:
    """Return one draw, solvable or not."""
    way = options.way_m
    width = max(options.width_m, robots * smallest_spacing(radius))
    if way < 2.0 * CLEAR_M + 1.0:
        raise ConfigError(f"task {NAME}: way_m", f"must be {2.0 * CLEAR_M + 1.0:g} m or more, not {way:g}")
    y = (np.arange(robots) + 0.5) * width / robots
    starts = np.column_stack([np.zeros(robots), y, np.zeros(robots)])
    goals = np.column_stack([np.full(robots, way), y])
    floor = (CLEAR_M, 0.0, way - CLEAR_M, width)
    keep_off = np.vstack([starts[:, :2], goals])
    rng = np.random.default_rng([seed, draw])
    count = round(options.density * (floor[2] - floor[0]) * width)
    stacks = _stack(rng, _draw_things(rng, count, options.size), options.stack)
    things = _place(rng, stacks, floor, keep_off, max(MARGIN_M, radius + ROOM_M), options.aisle_m)
    x0, x1 = -WALL_SIDE_M, way + WALL_SIDE_M
    edge = 2.0 * WALL_M
    world = WorldSpec(
        obstacles=[*closed_room(x0, 0.0, x1, width), *things],
        bounds=(x0 - edge, -edge, x1 + edge, width + edge),
    )
    return Setup(world, starts, goals)


def _draw_things(rng: np.random.Generator, count: int, size: float) -> list[_Thing]:
    """Return ``count`` things, the one with the largest reach first: it is the hardest to place."""
    things = []
    for kind in rng.choice(4, count, p=SHARES).tolist():
        if kind == 1:
            things.append(_Thing(None, size * float(rng.uniform(*DRUM_M))))
        elif kind == 3:
            rock = draw_rocks(rng, math.pi * (size * rng.uniform(*PILE_M, 1)) ** 2)
            things.append(_Thing(rock.corners, float(rock.reach[0])))
        else:
            spans = (BOX_M, BOX_M) if kind == 0 else SHELF_M
            length, depth = (size * float(rng.uniform(*span)) for span in spans)
            corners = 0.5 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]) * [length, depth]
            angle = float(rng.uniform(0.0, math.pi))
            turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
            things.append(_Thing(corners @ turn, 0.5 * math.hypot(length, depth)))
    return sorted(things, key=lambda thing: -thing.reach)


def _stack(rng: np.random.Generator, things: list[_Thing], most: float) -> list[_Stack]:
    """Return the things in stacks of 1 to ``most``, the widest stack first: it is the hardest to place."""
    stacks = []
    left = [things[k] for k in rng.permutation(len(things))]
    while left:
        count = min(len(left), int(rng.integers(1, max(1, int(most)) + 1)))
        stacks.append(_as_stack(left[:count], float(rng.uniform(0.0, 2.0 * math.pi))))
        left = left[count:]
    return sorted(stacks, key=lambda stack: -stack.reach)


def _as_stack(things: list[_Thing], turn: float) -> _Stack:
    """Return the things side by side on a ring round the stack's middle."""
    widest = max(thing.reach for thing in things)
    count = len(things)
    ring = (widest + 0.5 * TOUCH_M) / math.sin(math.pi / count) if count > 1 else 0.0
    angles = turn + 2.0 * math.pi * np.arange(count) / count
    return _Stack(things, ring * np.column_stack([np.cos(angles), np.sin(angles)]), ring + widest)


def _place(
    rng: np.random.Generator, stacks: list[_Stack], floor: Box, keep_off: Floats, margin: float, aisle: float
) -> list[Obstacle]:
    """Return the things, their stacks at random places of the floor (x0, y0, x1, y1), off each other and the points."""
    x0, y0, x1, y1 = floor
    centres, reach = np.zeros((len(stacks), 2)), np.array([stack.reach for stack in stacks])
    found: list[Obstacle] = []
    for k, stack in enumerate(stacks):
        low, high = np.array([x0 + reach[k], y0 + reach[k] + aisle]), np.array([x1 - reach[k], y1 - reach[k] - aisle])
        others = np.vstack([keep_off, centres[:k]])
        gaps = np.concatenate([np.full(len(keep_off), margin + reach[k]), reach[:k] + reach[k] + aisle])
        centres[k] = point = _free_point(rng, low, np.maximum(low, high), others, gaps)
        found += [_put(thing, point + offset) for thing, offset in zip(stack.things, stack.offsets, strict=True)]
    return found


def _free_point(rng: np.random.Generator, low: Floats, high: Floats, others: Floats, gaps: Floats) -> Floats:
    """Return the first random point of a box that keeps its gap to each of the others.

    The points are the ones that would come one by one, and so is what the generator draws next.
    """
    for _ in range(TRIES_PER_THING // AT_ONCE):
        before = rng.bit_generator.state
        points = rng.uniform(low, high, (AT_ONCE, 2))
        away = np.hypot(points[:, None, 0] - others[:, 0], points[:, None, 1] - others[:, 1])
        free = np.flatnonzero((away >= gaps).all(axis=1))
        if free.size:
            rng.bit_generator.state = before
            point: Floats = rng.uniform(low, high, (int(free[0]) + 1, 2))[-1]
            return point
    raise _NoRoomError


def _put(thing: _Thing, point: Floats) -> Obstacle:
    if thing.outline is None:
        return Circle(center=(float(point[0]), float(point[1])), radius=thing.reach)
    return polygon(thing.outline + point)
