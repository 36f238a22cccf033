"""Trips through a building: who goes from where to where, and when everybody sets out.

A `Floor` says where robots may stand: two halls at its ends and the rooms between. Trips lead across, from hall to
hall, one way or both ways, or anywhere, from one room to another. Robots set out all at once, staggered, or as a
convoy: one trip for all, out of a queue along the wall of one hall to a row along the wall of the other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import minimum_spanning_tree

from swarmscope.bounds import Seconds
from swarmscope.errors import ConfigError
from swarmscope.sim.world import Circle, Obstacle, WorldSpec
from swarmscope.tasks._contract import Length, Setup
from swarmscope.tasks._forest import smallest_spacing, yaw_toward
from swarmscope.tasks._rooms import ASIDE_M, WALL_M, Box, closed_room

QUEUE_M = 0.6
"""Between the places of a queue."""
BESIDE_M = 0.2
"""Between a robot in a queue and the wall."""
WALKER_M, WALKER_MPS = 0.25, (0.3, 0.6)
EDGE_M = 0.5
"""Drawn beyond the outermost wall."""

Floats = NDArray[np.float64]
Ways = Literal["one", "two", "any"]


@dataclass(frozen=True)
class TripOptions:
    """How robots set out and where to."""

    depart: Literal["at_once", "staggered", "convoy"] = "at_once"  # convoy: one trip for all, one after the other
    every_s: Seconds = 8.0  # between two that set out, staggered and in a convoy
    ways: Ways = "one"  # from hall to hall one way or two ways, or from any room to any other
    far_m: Length = 12.0  # from a start to its goal as the crow flies, at least (ways any)


class Floor(NamedTuple):
    """What stands on a floor and where robots may stand."""

    obstacles: list[Obstacle]
    """All but the walls round it."""
    left: Box
    """The hall on the left, without its walls."""
    right: Box
    rooms: list[Box]
    """Those between the halls."""


def step_of(radius: float) -> float:
    """Return the distance between places in a hall or a room [m]."""
    return max(0.9, smallest_spacing(radius))


def hall_width(robots: int, radius: float, length: float, least: float) -> float:
    """Return how wide a hall of this length has to be for so many robots that stand in columns [m]."""
    edge, step = radius + ASIDE_M, step_of(radius)
    column = max(1, 1 + math.floor((length - 2.0 * edge) / step + 1e-9))
    return max(least, 2.0 * edge + (math.ceil(robots / column) - 1) * step)


def places_in(room: Box, step: float, edge: float) -> Floats:
    """Return places (K, 2) in a room, ``step`` apart, ``edge`` off its walls and even about its middle [m]."""
    axes = []
    for low, high in ((room[0], room[2]), (room[1], room[3])):
        count = math.floor((high - low - 2.0 * edge) / step + 1e-9)
        span = np.arange(max(count, 0) + 1) * step
        axes.append(0.5 * (low + high) + span - 0.5 * span[-1])
    x, y = np.meshgrid(*axes)
    return np.stack([x.ravel(), y.ravel()], axis=1)


def make_trips(
    rng: np.random.Generator, floor: Floor, robots: int, radius: float, chosen: TripOptions
) -> tuple[Floats, Floats, Floats | None]:
    """Return starts and goals (N, 2) [m], and when each robot sets out (N,) [s], None for at once."""
    if chosen.depart == "convoy":
        starts, goals = (_row(hall, robots, radius, outer) for hall, outer in ((floor.left, 0), (floor.right, 2)))
    elif chosen.ways == "any":
        starts, goals = _anywhere(rng, floor, robots, radius, chosen.far_m)
    else:
        step, edge = step_of(radius), radius + ASIDE_M
        starts, goals = (_some(rng, places_in(hall, step, edge), robots) for hall in (floor.left, floor.right))
        if chosen.ways == "two":
            back = np.arange(robots) % 2 == 1
            starts[back], goals[back] = goals[back].copy(), starts[back].copy()
    start_s = None if chosen.depart == "at_once" else chosen.every_s * np.arange(robots, dtype=np.float64)
    return starts, goals, start_s


def _some(rng: np.random.Generator, places: Floats, count: int) -> Floats:
    """Return ``count`` of the places, at random."""
    if len(places) < count:
        raise ConfigError("robots", f"{count} do not fit: there are {len(places)} places")
    return np.asarray(places[rng.permutation(len(places))[:count]])


def _row(hall: Box, robots: int, radius: float, outer: int) -> Floats:
    """Return places in a row along the outer wall of a hall, and in further rows where one is too short."""
    step, off = max(QUEUE_M, smallest_spacing(radius) - 0.1), radius + BESIDE_M
    per_row = max(1, 1 + math.floor((hall[3] - hall[1] - 2.0 * off) / step + 1e-9))
    row, place = np.divmod(np.arange(robots), per_row)
    inward = 1.0 if outer == 0 else -1.0
    y = 0.5 * (hall[1] + hall[3]) + (place - 0.5 * (np.minimum(robots, per_row) - 1)) * step
    return np.stack([hall[outer] + inward * (off + row * step), y], axis=1)


def _anywhere(
    rng: np.random.Generator, floor: Floor, robots: int, radius: float, far_m: float
) -> tuple[Floats, Floats]:
    """Return starts and goals in rooms, all of them different places, no goal nearer than ``far_m`` to its start."""
    places = np.vstack([places_in(room, step_of(radius), radius + ASIDE_M) for room in floor.rooms])
    starts = _some(rng, places, robots)
    taken = (places[:, None] == starts[None]).all(axis=2).any(axis=1)
    goals = np.zeros((robots, 2))
    for robot in range(robots):
        far = np.flatnonzero(~taken & (np.hypot(*(places - starts[robot]).T) >= far_m))
        if not far.size:
            raise ConfigError("far_m", f"robot {robot}: no place is left that is {far_m:g} m away: lower it")
        one = int(rng.choice(far))
        goals[robot], taken[one] = places[one], True
    return starts, goals


def on_random_tree(rng: np.random.Generator, ends: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which of the edges (E, 2) between nodes, numbered from 0, are those of a random spanning tree (E,)."""
    order = 1.0 + rng.permutation(len(ends))
    size = int(ends.max()) + 1
    tree = minimum_spanning_tree(coo_array((order, (ends[:, 0], ends[:, 1])), shape=(size, size)))
    return np.isin(order, tree.data)


def walker(rng: np.random.Generator, begin: tuple[float, float], end: tuple[float, float]) -> Circle:
    """Return a disc that walks to and fro between two places [m]."""
    speed = float(rng.uniform(*WALKER_MPS))
    return Circle(center=begin, radius=WALKER_M, way=[end], speed_mps=speed)


def setup_on(floor: Floor, starts: Floats, goals: Floats, start_s: Floats | None) -> Setup:
    """Return the setup on a floor with walls round it."""
    x0, y0, x1, y1 = floor.left[0], floor.left[1], floor.right[2], floor.right[3]
    edge = WALL_M + EDGE_M
    world = WorldSpec(
        obstacles=[*closed_room(x0, y0, x1, y1), *floor.obstacles], bounds=(x0 - edge, y0 - edge, x1 + edge, y1 + edge)
    )
    yaw = yaw_toward(starts[:, 0], starts[:, 1], goals[:, 0], goals[:, 1])
    return Setup(world, np.column_stack([starts, yaw]), goals, start_s=start_s)
