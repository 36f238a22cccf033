"""The maps of GIWT 5.1.1: a walled square with rectangles (A), cylinders (B), or both (C), at random and overlapping.

As printed: 20 x 20 m, 10 to 30 obstacles, rectangles with sides of 0.5 to 3 m at any angle, cylinders with radii of
0.5 to 3 m. Centres are uniform over the square (not printed). An obstacle that would come too near a place that has to
stay free is drawn anew.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.sim.world import Circle, Obstacle, Polygon, WorldSpec
from swarmscope.tasks._contract import Amount, Length
from swarmscope.tasks._rooms import WALL_M, closed_room

SIZE_M = 20.0
FEWEST, MOST = 10, 30
SIDE_M = (0.5, 3.0)
RADIUS_M = (0.5, 3.0)
REDRAWS = 200
"""Of one obstacle; after so many it is left out."""
MOST_TRIES, TRIES_EACH = 10_000, 5
"""When more places, and more for each obstacle, are drawn for a map, it is full."""
DRAWS, FEWEST_DRAWS, MOST_DRAWN = 50, 5, 5000
"""So many maps are drawn, fewer where they have many obstacles."""
LEFT_OUT = 20
"""When so many more are left out than placed there is no point in going on."""

Floats = NDArray[np.float64]
Range = tuple[float, float]
Kind = Literal["A", "B", "C"]


@dataclass(frozen=True)
class MapOptions:
    """Sizes; the defaults are those of the document."""

    obstacles: Kind = "C"  # A rectangles, B cylinders, C both
    size_m: Length = SIZE_M  # side of the map
    fewest: Amount = FEWEST  # obstacles on it, at least
    most: Amount = MOST  # and at most
    apart_m: Length = 7.0  # from a start to its goal, at least (task I)


class Sizes(NamedTuple):
    """Where obstacles stand and how large they are [m]."""

    floor_m: Range
    """Centres are on (0, 0) to this corner."""
    side_m: Range
    """Of rectangles, from least to most."""
    radius_m: Range
    """Of cylinders, from least to most."""


def draw_map(rng: np.random.Generator, options: MapOptions, keep_free: Floats, free_m: float) -> WorldSpec:
    """Return a walled map whose obstacles stay ``free_m`` [m] off the points ``keep_free (K, 2)`` [m]."""
    sizes = Sizes((options.size_m, options.size_m), SIDE_M, RADIUS_M)
    counts = (options.fewest, options.most)
    return walled(draw_obstacles(rng, options.obstacles, counts, sizes, keep_free, free_m), options.size_m)


def draw_obstacles(
    rng: np.random.Generator, kind: Kind, counts: Range, sizes: Sizes, keep_free: Floats, free_m: float
) -> list[Obstacle]:
    """Return obstacles, from the first to the second of ``counts``, ``free_m`` [m] off the points ``keep_free (K, 2)``.

    One for which REDRAWS places are not enough is left out. Errors: ConfigError if most of many are.
    """
    obstacles: list[Obstacle] = []
    wanted = int(rng.integers(int(counts[0]), int(counts[1]) + 1))
    tries = 0
    for number in range(wanted):
        for _ in range(REDRAWS):
            tries += 1
            one = _draw_obstacle(rng, kind, sizes)
            if _stays_off(one, keep_free, free_m):
                obstacles.append(one)
                break
        if number - len(obstacles) > LEFT_OUT + len(obstacles) or tries > max(MOST_TRIES, TRIES_EACH * wanted):
            raise ConfigError("most", f"{wanted} obstacles do not fit: lower it, or 'robots', or enlarge the map")
    return obstacles


def walled(obstacles: Sequence[Obstacle], size: float) -> WorldSpec:
    """Return the world of a square with walls round it."""
    bounds = (-WALL_M, -WALL_M, size + WALL_M, size + WALL_M)
    # made of numbers that are known to be valid: a million maps need not be looked at twice
    return WorldSpec.model_construct(obstacles=[*closed_room(0.0, 0.0, size, size), *obstacles], bounds=bounds)


def _draw_obstacle(rng: np.random.Generator, kind: Kind, sizes: Sizes) -> Obstacle:
    """Return a rectangle (A) or a cylinder (B), or one of both (C)."""
    if kind == "C":
        kind = "A" if rng.random() < 0.5 else "B"
    x, y = (float(v) for v in rng.uniform(0.0, sizes.floor_m, 2))
    if kind == "B":
        return Circle.model_construct(type="circle", center=(x, y), radius=float(rng.uniform(*sizes.radius_m)))
    a, b = 0.5 * rng.uniform(*sizes.side_m, 2)
    yaw = rng.uniform(0.0, math.pi)
    c, s = math.cos(yaw), math.sin(yaw)
    corners = [(x + c * u - s * v, y + s * u + c * v) for u, v in ((a, b), (-a, b), (-a, -b), (a, -b))]
    return Polygon.model_construct(type="polygon", points=[(float(px), float(py)) for px, py in corners])


def _stays_off(obstacle: Obstacle, points: Floats, distance: float) -> bool:
    """Tell whether no point is in the obstacle or closer to it than ``distance``."""
    if not len(points):
        return True
    if isinstance(obstacle, Circle):
        away = np.hypot(points[:, 0] - obstacle.center[0], points[:, 1] - obstacle.center[1]) - obstacle.radius
        return bool(away.min() > distance)
    assert isinstance(obstacle, Polygon)  # noqa: S101 - the only other kind drawn
    corners = np.array(obstacle.points)
    edges = np.roll(corners, -1, axis=0) - corners
    rel = points[:, None, :] - corners[None, :, :]
    along = np.clip((rel * edges).sum(axis=2) / (edges**2).sum(axis=1), 0.0, 1.0)
    off = rel - along[:, :, None] * edges
    inside = (edges[:, 0] * rel[:, :, 1] - edges[:, 1] * rel[:, :, 0] > 0.0).all(axis=1)
    return bool(not inside.any() and np.hypot(off[:, :, 0], off[:, :, 1]).min() > distance)


def draws_of(most: float) -> int:
    """Return how many maps with up to ``most`` obstacles are drawn before a seed is given up."""
    return max(FEWEST_DRAWS, min(DRAWS, MOST_DRAWN // max(1, int(most))))


def check_counts(fewest: float, most: float, task: str) -> None:
    """Raise a ConfigError unless there is a whole number of obstacles from ``fewest`` to ``most``."""
    if int(most) < int(fewest):
        raise ConfigError(f"task {task}: most", f"is {most:g}, less than fewest, {fewest:g}")


def unsolvable(name: str, seed: int, draws: int, why: str) -> UnsolvableWorldError:
    """Return the error for a seed that gives no solvable map."""
    remedy = "lower 'most' or 'robots', or enlarge the map"
    return UnsolvableWorldError(f"{name}: no solvable map in {draws} draws of seed {seed} ({why}); {remedy}")
