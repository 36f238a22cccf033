"""Forests of trees or fields of rocks, and the lines and rings of robots in front of them.

*Trees* are circles with radii uniform in [radius_min, radius_max], placed uniformly at random (rejection)
inside a square or a disc; they do not overlap, and keep ``MARGIN_M`` between their surface and every start
and goal.

*Rocks* (option ``obstacles: rocks``) are convex polygons of 5 to 8 corners in place of the trees: the radii are
drawn as those of trees, and a rock has the area of the tree of its radius, so areas are spread alike
(`_rocks`). Placing and margins go by the rock's bounding circle, so that rocks keep at least the margins of
trees.

*More robots than fit.* With ``robots`` up to what one line (or ring) holds at the smallest spacing 2 radius
+ 0.4 m, the forest has the size asked for and the robots are evenly spaced. Beyond that, the forest grows so
that the forest area per robot stays what it is when one line (ring) is filled at ``SPACING_M`` (at least 1
m), its density stays, and the robots stand in several ranks (rings), ``SPACING_M`` apart. So 10 000 robots
of T1 have a forest of 447 m x 447 m.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from swarmscope._jit import jit_alloc as jit
from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.sim.world import Circle, Obstacle, Polygon, WorldSpec
from swarmscope.tasks._check import Reach, check_places, unreachable
from swarmscope.tasks._contract import Density, Length, Setup
from swarmscope.tasks._rocks import Rocks, draw_rocks

MARGIN_M = 0.60  # between a tree's surface and the centre of a start or goal, at least
ROOM_M = 0.30  # the same beyond a robot's radius, for robots wider than 0.30 m
SPACING_M = 1.0  # between robots when there are several ranks, and between ranks
LINE_OFFSET_M = 0.5  # from the square's side to the first rank of starts
RING_OFFSET_M = 0.7  # from the disc's rim to the first ring of starts
REDRAWS = 20  # how often an unsolvable forest is drawn anew
TRIES_PER_TREE = 400
MOST_TREES = 2_000_000
SURE_LEFT, SURE_SHARE = 1000, 0.01  # of so many trees that are left, a smaller share placed by 4 tries a tree: never
TREES, GOALS, ROCKS = 1, 2, 3  # purposes: each has its own random stream

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class ForestOptions:
    """Sizes of a forest; the defaults are Nav-SCOPE's 140 trees in 400 m^2."""

    size_m: Length = 20.0  # side of the square; a disc has the same area
    density: Density = 0.35  # trees per m^2
    radius_min: Length = 0.15  # of the smallest tree
    radius_max: Length = 0.35  # of the largest tree
    obstacles: Literal["trees", "rocks"] = "trees"  # rocks are convex polygons of the same areas


@dataclass(frozen=True)
class Places:
    """Where the forest is and where the robots are: a disc round the origin, or a square from the origin."""

    extent: float  # radius of the disc or side of the square [m]
    is_disc: bool
    starts: Floats  # (N, 3)
    goals: Floats  # (N, 2)

    @property
    def area(self) -> float:
        """Return the area [m^2] of the forest."""
        return math.pi * self.extent**2 if self.is_disc else self.extent**2


def smallest_spacing(radius: float) -> float:
    """Return the smallest distance [m] between neighbouring starts of one line."""
    return 2.0 * radius + 0.4


def lines(robots: int, radius: float, size: float) -> Places:
    """Return starts on the left of a square and goals on its right, in the same order (T1).

    Rank k starts at x = -0.5 - k m; the foremost rank has the farthest goals, so all robots travel equally
    far.
    """
    step = max(SPACING_M, smallest_spacing(radius))
    per_rank = max(1, robots)
    if size / per_rank < smallest_spacing(radius):
        full = max(1, math.floor(size / step))
        size = max(size, math.sqrt(robots * size**2 / full))
        per_rank = max(1, math.floor(size / step))
    rank, place = np.divmod(np.arange(robots), per_rank)
    ranks = int(rank[-1]) + 1
    in_rank = np.where(rank < ranks - 1, per_rank, robots - (ranks - 1) * per_rank)
    y = (place + 0.5) * size / in_rank
    starts = np.stack([-LINE_OFFSET_M - rank * step, y, np.zeros(robots)], axis=1)
    goals = np.stack([size + LINE_OFFSET_M + (ranks - 1 - rank) * step, y], axis=1)
    return Places(size, False, starts, goals)


def rings(robots: int, radius: float, size: float) -> Places:
    """Return starts on rings round a disc of area ``size``^2 and goals at the antipodal points (T3)."""
    step = max(SPACING_M, smallest_spacing(radius))
    disc = size / math.sqrt(math.pi)
    angles = [_even_angles(robots)]
    if 2.0 * math.pi * (disc + RING_OFFSET_M) / robots < smallest_spacing(radius):
        disc = max(disc, disc * math.sqrt(robots / _ring_holds(disc, 0, step)))
        angles = []
        while (left := robots - sum(map(len, angles))) > 0:
            angles.append(_even_angles(min(left, _ring_holds(disc, len(angles), step))))
    ring = np.repeat(np.arange(len(angles)), [len(a) for a in angles])
    angle, distance = np.concatenate(angles), disc + RING_OFFSET_M + ring * step
    x: Floats = np.asarray(distance * np.cos(angle), dtype=np.float64)
    y: Floats = np.asarray(distance * np.sin(angle), dtype=np.float64)
    return Places(disc, True, np.stack([x, y, yaw_toward(x, y, -x, -y)], axis=1), np.stack([-x, -y], axis=1))


def yaw_toward(x: Floats, y: Floats, goal_x: Floats, goal_y: Floats) -> Floats:
    """Return the headings [rad] from the points (x, y) to the goals."""
    return np.arctan2(goal_y - y, goal_x - x)


def open_field(places: Places, radius: float) -> Setup:
    """Return the places without any trees."""
    setup = Setup(WorldSpec(obstacles=[], bounds=_bounds(places)), places.starts, places.goals)
    check_places(setup, radius)
    return setup


def plant(seed: int, places: Places, radius: float, options: ForestOptions) -> Setup:
    """Return the places with a forest in which every robot can reach its goal.

    Draw d uses the random stream (seed, purpose, d); the first solvable of at most 20 redraws is taken.
    """
    reach, margin = Reach(radius), max(MARGIN_M, radius + ROOM_M)
    why = ""
    for draw in range(REDRAWS + 1):
        rng = np.random.default_rng([seed, TREES, draw])
        radii = _radii(rng, places, options)
        obstacles: list[Obstacle]
        if options.obstacles == "trees":
            trees = _planted(rng, places, options, radii, margin)
            obstacles = [Circle(center=(x, y), radius=r) for x, y, r in trees.tolist()]
        else:
            rocks = draw_rocks(np.random.default_rng([seed, ROCKS, draw]), math.pi * radii**2)
            obstacles = list(_rocks(rocks, _planted(rng, places, options, rocks.reach, margin)))
        # made of numbers that are known to be valid: 70 000 rocks need not be looked at twice
        world = WorldSpec.model_construct(obstacles=obstacles, bounds=_bounds(places))
        setup = Setup(world, places.starts, places.goals)
        bad = unreachable(setup, reach)
        if bad.size == 0:
            check_places(setup, radius)
            return setup
        why = f"robot {int(bad[0])} cannot reach its goal"
    raise UnsolvableWorldError(
        f"no solvable forest in {REDRAWS + 1} draws of seed {seed} ({why}); lower the density or the radii"
    )


def _bounds(places: Places) -> tuple[float, float, float, float]:
    points = np.vstack([places.starts[:, :2], places.goals])
    low, high = points.min(axis=0), points.max(axis=0)
    corner = -places.extent if places.is_disc else 0.0
    low, high = np.minimum(low, corner) - SPACING_M, np.maximum(high, places.extent) + SPACING_M
    return float(low[0]), float(low[1]), float(high[0]), float(high[1])


def _even_angles(count: int) -> Floats:
    return 2.0 * np.pi * np.arange(count) / count


def _ring_holds(disc: float, ring: int, step: float) -> int:
    return max(1, math.floor(2.0 * math.pi * (disc + RING_OFFSET_M + ring * step) / step))


def _radii(rng: np.random.Generator, places: Places, options: ForestOptions) -> Floats:
    """Return the radii (C,) [m] of the trees, or of trees as large as the rocks."""
    if not 0.0 < options.radius_min <= options.radius_max:
        raise ConfigError("radius_min, radius_max", "need 0 < radius_min <= radius_max")
    if 2.0 * options.radius_max >= places.extent:
        raise ConfigError("radius_max", f"is too large for a forest of {places.extent:.2f} m")
    count = round(options.density * places.area)
    if count > MOST_TREES:
        raise ConfigError("density", f"{count} {options.obstacles} are more than {MOST_TREES}: lower it, or size_m")
    return rng.uniform(options.radius_min, options.radius_max, count)


def _planted(
    rng: np.random.Generator, places: Places, options: ForestOptions, radii: Floats, margin: float
) -> Floats:
    """Return discs (C, 3) x, y, radius [m] of these radii at free places."""
    count = len(radii)
    points = np.vstack([places.starts[:, :2], places.goals])
    cell = 2.0 * max(margin, options.radius_max, float(radii.max(initial=0.0)))
    placer = _Placer(places, points, margin, cell)
    trees = np.zeros((count, 3))
    trees[:, 2] = radii
    tries, planted = 0, 0
    while planted < count:
        if tries >= TRIES_PER_TREE * count:
            raise ConfigError(
                "density",
                f"{count} {options.obstacles} do not fit into {places.area:.0f} m^2 ({planted} of them were placed)",
            )
        unit = rng.random((4 * count, 2))
        tries += len(unit)
        left, planted = count - planted, placer.place(trees, planted, placer.spread(unit))
        if left > SURE_LEFT and count - planted > (1.0 - SURE_SHARE) * left:
            tries = TRIES_PER_TREE * count
    return trees


def _rocks(rocks: Rocks, places: Floats) -> Iterator[Polygon]:
    """Put rocks at places (C, 3) x, y, bounding radius."""
    first = 0
    for count, (x, y, _) in zip(rocks.counts.tolist(), places.tolist(), strict=True):
        corners = rocks.corners[first : first + count] + np.array([x, y])
        yield Polygon.model_construct(points=[(px, py) for px, py in corners.tolist()])
        first += count


class _Placer:
    """Discs that keep off each other: bins of the plane with the discs whose centres they hold."""

    def __init__(self, places: Places, points: Floats, margin: float, cell: float) -> None:
        low = np.minimum(points.min(axis=0), -places.extent if places.is_disc else 0.0)
        high = np.maximum(points.max(axis=0), places.extent)
        self.places, self.low, self.cell = places, low, cell
        columns, rows = (np.floor((high - low) / cell) + 1).astype(int)
        self.head = np.full((int(rows), int(columns)), -1, dtype=np.int64)
        self.keep_off = np.column_stack([points, np.full(len(points), margin)])
        self.chain: Ints = np.zeros(0, dtype=np.int64)

    def spread(self, unit: Floats) -> Floats:
        """Turn numbers in [0, 1) (K, 2) into points of the forest, uniform over its area."""
        if not self.places.is_disc:
            return unit * self.places.extent
        distance, angle = self.places.extent * np.sqrt(unit[:, 0]), 2.0 * np.pi * unit[:, 1]
        return np.stack([distance * np.cos(angle), distance * np.sin(angle)], axis=1)

    def place(self, trees: Floats, planted: int, candidates: Floats) -> int:
        """Give the next trees the candidates that are free; return how many trees stand now."""
        if self.chain.size == 0:
            self.chain = np.full(len(self.keep_off) + len(trees), -1, dtype=np.int64)
            _file(self.head, self.chain, self.keep_off, 0, self.low[0], self.low[1], self.cell)
        return _place(
            self.head, self.chain, self.keep_off, trees, planted, candidates,
            self.low[0], self.low[1], self.cell, self.places.extent, self.places.is_disc,
        )  # fmt: skip


@jit
def _file(head: Ints, chain: Ints, discs: Floats, first: int, x0: float, y0: float, cell: float) -> None:
    for k in range(discs.shape[0]):
        row, column = int((discs[k, 1] - y0) / cell), int((discs[k, 0] - x0) / cell)
        chain[first + k] = head[row, column]
        head[row, column] = first + k


@jit
def _place(
    head: Ints, chain: Ints, keep_off: Floats, trees: Floats, planted: int, candidates: Floats,
    x0: float, y0: float, cell: float, extent: float, is_disc: bool,
) -> int:  # fmt: skip
    fixed = keep_off.shape[0]
    for k in range(candidates.shape[0]):
        if planted == trees.shape[0]:
            break
        x, y, r = candidates[k, 0], candidates[k, 1], trees[planted, 2]
        if is_disc:
            inside = math.sqrt(x * x + y * y) <= extent - r
        else:
            inside = r <= x <= extent - r and r <= y <= extent - r
        if not inside:
            continue
        row, column = int((y - y0) / cell), int((x - x0) / cell)
        free = True
        for i in range(max(0, row - 1), min(head.shape[0], row + 2)):
            for j in range(max(0, column - 1), min(head.shape[1], column + 2)):
                other = head[i, j]
                while other >= 0:
                    if other < fixed:
                        dx, dy, reach = x - keep_off[other, 0], y - keep_off[other, 1], r + keep_off[other, 2]
                    else:
                        tree = other - fixed
                        dx, dy, reach = x - trees[tree, 0], y - trees[tree, 1], r + trees[tree, 2]
                    if dx * dx + dy * dy < reach * reach:
                        free = False
                    other = chain[other]
        if free:
            trees[planted, 0], trees[planted, 1] = x, y
            chain[fixed + planted] = head[row, column]
            head[row, column] = fixed + planted
            planted += 1
    return planted
