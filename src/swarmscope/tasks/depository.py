"""Task depository: five wide robots through a cluttered store room, after the papers' experiment.

Published (Nav-SCOPE VII, SFM-MAS VI): 5 robots of r_e = 0.43 m, 0.38 obstacles per m^2 of various shapes, a
mean path of 10.77 m with gamma = 3.8 %, so shortest ways of 10.4 m. Everything else is ours: the room, the
mix and sizes of the shapes, and that the robots go from one side to the other in the order of their starts.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.sim.world import Circle, Obstacle, WorldSpec
from swarmscope.tasks._check import Reach, check_setup, unreachable
from swarmscope.tasks._contract import Option, Setup, check_robots, read_options
from swarmscope.tasks._forest import MARGIN_M, ROOM_M, smallest_spacing
from swarmscope.tasks._rocks import draw_rocks
from swarmscope.tasks._rooms import WALL_M, Box, closed_room, polygon

NAME = "depository"
SUMMARY = "five wide robots (robot.radius_m=0.43) through a cluttered store room"
REDRAWS = 40
TRIES_PER_THING = 2000
WALL_SIDE_M = 1.5  # from the lines of starts and goals to the walls behind them
CLEAR_M = 0.75  # from these lines to the cluttered floor
GAP_M = 0.1  # between two things, at least (of their bounding circles)
BOX_M = (0.2, 0.4)  # sides of boxes
DRUM_M = (0.08, 0.2)  # radii of drums
SHELF_M = ((0.6, 0.9), (0.1, 0.2))  # lengths and depths of shelves
PILE_M = (0.1, 0.2)  # a pile has the area of a disc of such a radius
SHARES = (0.4, 0.25, 0.15, 0.2)  # of boxes, drums, shelves and piles

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class DepositoryOptions:
    """Sizes of the room."""

    way_m: float = 8.8  # from the starts to the goals
    width_m: float = 7.0  # wider for more robots than fit side by side
    density: float = 0.38  # things per m^2 of the cluttered floor
    size: float = 1.0  # of the things, times ours
    spare_m: float = 0.1  # that a way leaves on both sides; r_e + 0.1 m is the published r = 0.49 m + 0.04 m


class _Thing(NamedTuple):
    outline: Floats | None  # corners (N, 2) round the origin [m]; None: a drum
    reach: float  # radius of the bounding circle [m]


def make(seed: int, robots: int = 5, radius: float = 0.43, **options: Option) -> Setup:
    """Return a solvable store room; draw d uses the random stream (seed, d)."""
    check_robots(robots, radius)
    chosen = read_options(DepositoryOptions, options, NAME)
    for draw in range(REDRAWS + 1):
        setup = draw_room(seed, draw, robots, radius, chosen)
        if unreachable(setup, Reach(radius, chosen.spare_m)).size == 0:
            check_setup(setup, radius)
            return setup
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
    things = _place(rng, _draw_things(rng, count, options.size), floor, keep_off, max(MARGIN_M, radius + ROOM_M))
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


def _place(
    rng: np.random.Generator, things: list[_Thing], floor: Box, keep_off: Floats, margin: float
) -> list[Obstacle]:
    """Return the things at random places of the floor (x0, y0, x1, y1), off each other and the points."""
    x0, y0, x1, y1 = floor
    centres, reach = np.zeros((len(things), 2)), np.array([thing.reach for thing in things])
    found: list[Obstacle] = []
    for k, thing in enumerate(things):
        for _ in range(TRIES_PER_THING):
            point = rng.uniform((x0 + reach[k], y0 + reach[k]), (x1 - reach[k], y1 - reach[k]))
            if np.any(np.hypot(*(keep_off - point).T) < margin + reach[k]):
                continue
            if not np.any(np.hypot(*(centres[:k] - point).T) < reach[:k] + reach[k] + GAP_M):
                break
        else:
            raise ConfigError(f"task {NAME}: density", f"{len(things)} things do not fit into the room")
        centres[k] = point
        x, y = point.tolist()
        if thing.outline is None:
            found.append(Circle(center=(x, y), radius=thing.reach))
        else:
            found.append(polygon(thing.outline + point))
    return found
