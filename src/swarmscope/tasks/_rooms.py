"""Walls of boxes, groups of robots in ranks, and two rooms joined by a passage.

All walls are `WALL_M` thick boxes (convex polygons), so that a robot sees them from every side.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.sim.world import Obstacle, Polygon, WorldSpec
from swarmscope.tasks._check import check_setup
from swarmscope.tasks._contract import Setup
from swarmscope.tasks._forest import smallest_spacing, yaw_toward

WALL_M = 0.15
JITTER_M = 0.08  # of a start, along each axis
ASIDE_M = 0.45  # from a wall to the surface of a robot that starts or arrives
BETWEEN_M = 1.0  # from the last rank of starts to the first rank of goals, beside the rank's own spacing
EDGE_M = 0.5  # drawn beyond the outermost thing

Floats = NDArray[np.float64]
Box = tuple[float, float, float, float]


class Ranks(NamedTuple):
    """Places of robots one behind the other: x backward from the first rank, y across."""

    places: Floats  # (N, 2) x, y [m]
    depth: float  # from the first to the last rank [m]


def spacing(radius: float) -> float:
    """Return the distance [m] between neighbours in a rank and between ranks."""
    return max(0.9, smallest_spacing(radius) + 2.0 * JITTER_M)


def ranks(count: int, width: float, radius: float) -> Ranks:
    """Return ``count`` places in ranks that are at most ``width`` [m] wide, centred on y = 0."""
    step = spacing(radius)
    per_rank = max(1, min(count, 1 + math.floor(width / step + 1e-9)))
    rank, place = np.divmod(np.arange(count), per_rank)
    last = int(rank[-1]) if count else 0
    in_rank = np.where(rank < last, per_rank, count - last * per_rank)
    y = (place - 0.5 * (in_rank - 1)) * step
    return Ranks(np.stack([rank * step, y], axis=1), last * step)


def goal_ranks(starts: Ranks) -> Ranks:
    """Return the ranks mirrored back to front, so that who comes first goes deepest and leaves the way
    free."""
    places = starts.places.copy()
    places[:, 0] = starts.depth - places[:, 0]
    return Ranks(places, starts.depth)


def bar(ax: float, ay: float, bx: float, by: float, thickness: float = WALL_M) -> Polygon:
    """Return a box of this thickness [m] along the line a-b, whose ends it does not pass."""
    along = np.array([bx - ax, by - ay])
    side = 0.5 * thickness * np.array([-along[1], along[0]]) / np.hypot(*along)
    corners = np.array([[ax, ay], [bx, by], [bx, by], [ax, ay]]) + np.array([-side, -side, side, side])
    return polygon(corners)


def box(x0: float, y0: float, x1: float, y1: float) -> Polygon:
    """Return the box between two corners."""
    return polygon(np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]]))


def polygon(corners: Floats) -> Polygon:
    """Return the polygon of the corners (N, 2)."""
    return Polygon(points=[(float(x), float(y)) for x, y in corners])


def closed_room(x0: float, y0: float, x1: float, y1: float) -> list[Obstacle]:
    """Return four walls around the free floor between two corners."""
    t = WALL_M
    return [
        box(x0 - t, y0 - t, x1 + t, y0),
        box(x0 - t, y1, x1 + t, y1 + t),
        box(x0 - t, y0, x0, y1),
        box(x1, y0, x1 + t, y1),
    ]


def jitter(rng: np.random.Generator, points: Floats) -> Floats:
    """Return the points, each moved a little."""
    moved: Floats = points + rng.uniform(-JITTER_M, JITTER_M, points.shape)
    return moved


def setup_of(obstacles: list[Obstacle], starts: Floats, goals: Floats, bounds: Box, radius: float) -> Setup:
    """Return the checked setup; starts (N, 2) get the heading toward their goals (N, 2)."""
    yaw = yaw_toward(starts[:, 0], starts[:, 1], goals[:, 0], goals[:, 1])
    world = WorldSpec(obstacles=obstacles, bounds=bounds)
    setup = Setup(world, np.column_stack([starts, yaw]), goals)
    check_setup(setup, radius)
    return setup


class Passage(NamedTuple):
    """A straight passage along x between two rooms [m]."""

    length: float
    width: float
    y: float  # of its middle; the rooms' middle is y = 0
    room_width: float  # of both rooms, across
    gap: float  # from its ends to the first rank of starts


def two_rooms(rng: np.random.Generator, robots: int, radius: float, passage: Passage) -> Setup:
    """Return two groups that change rooms through one passage; goals are permuted within each rank's room.

    The first half (rounded up) starts in the left room. Starts stand in ranks behind the passage's end,
    goals in ranks behind the starts of the other group, so that no goal is taken at the beginning.
    """
    inside = passage.room_width - 2.0 * (ASIDE_M + radius)
    groups = [ranks(robots - robots // 2, inside, radius), ranks(robots // 2, inside, radius)]
    mouth = 0.5 * passage.length
    starts, goals, ends = [], [], []
    for side, (own, other) in zip((-1.0, 1.0), (groups, groups[::-1]), strict=True):
        first = mouth + passage.gap
        beyond = first + own.depth + BETWEEN_M + spacing(radius)
        ends.append(beyond + other.depth + radius + ASIDE_M)
        starts.append(jitter(rng, own.places + np.array([first, 0.0])) * [side, 1.0])
        goals.append((goal_ranks(other).places + np.array([beyond, 0.0])) * [side, 1.0])
    goals = [_permuted(rng, goals[1]), _permuted(rng, goals[0])]
    depth, half = max(ends), 0.5 * passage.room_width
    walls = closed_room(-depth, -half, depth, half)
    low, high = passage.y - 0.5 * passage.width, passage.y + 0.5 * passage.width
    walls += [box(-mouth, -half, mouth, low), box(-mouth, high, mouth, half)]
    edge = WALL_M + EDGE_M
    bounds = (-depth - edge, -half - edge, depth + edge, half + edge)
    return setup_of(walls, np.vstack(starts), np.vstack(goals), bounds, radius)


def _permuted(rng: np.random.Generator, goals: Floats) -> Floats:
    """Return the goals with those of equal x permuted."""
    order = np.arange(len(goals))
    for x in np.unique(goals[:, 0]):
        same = np.flatnonzero(goals[:, 0] == x)
        order[same] = rng.permutation(same)
    return goals[order]
