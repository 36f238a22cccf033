"""Can every robot stand where it is put and reach its goal? Asked of made forests, maps and users' own
scenarios."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.world import World, compile_world
from swarmscope.tasks._contract import Setup, check_robots
from swarmscope.tasks._occupancy import (
    Raster,
    components,
    domain_of,
    free_cells_near,
    labels_at,
    rasterise,
    with_circles,
)

CLEARANCE_M = 0.05  # room beyond the robot's radius that a way must leave
RESOLUTION_M = 0.05
FINE_M = 0.02  # the same where a scenario asks for more room, and robots need all of it
WOBBLE_M = 0.01  # that a robot in a passage is off its middle
TOLERANCE_M = 1e-9  # of rounded coordinates
ARRIVE_M = 0.05  # distance to the goal at which robots have arrived whose planner says nothing else
LARGEST_GRID_CELLS = 150_000_000  # worlds beyond this are checked on a grid coarse enough to stay below

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Reach(NamedTuple):
    """How the ways are searched: grid cells whose centres keep ``radius`` + ``clearance`` [m] off all
    obstacles."""

    radius: float
    clearance: float = CLEARANCE_M
    resolution: float = RESOLUTION_M


class Keeping(NamedTuple):
    """What keeps a scenario's robots off things [m], by the keys of the scenario."""

    clearance_m: float = 0.0
    footprint_clearance_m: float = 0.0
    range_min_m: float = 0.0

    def distance(self, radius: float) -> tuple[float, str]:
        """Return how near the centre of a robot of ``radius`` [m] comes to things [m], and the key behind it."""
        return max(
            (radius + self.clearance_m, "guard.clearance_m"),
            (radius + self.footprint_clearance_m, "guard.footprint_clearance_m"),
            (self.range_min_m, "lidar.range_min_m"),
        )

    def spacing(self, radius: float) -> tuple[float, str]:
        """Return how near to each other robots of ``radius`` [m] park in a row [m], and the key behind it."""
        return max(
            (2.0 * (radius + self.clearance_m), "guard.clearance_m"),
            (2.0 * (radius + self.footprint_clearance_m), "guard.footprint_clearance_m"),
            (radius + self.range_min_m, "lidar.range_min_m"),
        )


Radii = float | Sequence[float]
"""Of all robots, or of each [m]."""


def check_setup(setup: Setup, radius: Radii, keeping: Keeping | None = None) -> None:
    """Raise an UnsolvableWorldError that names the robot and the reason, unless all can start and arrive.

    Checked, in this order: finite numbers; robots of ``radius`` [m] that overlap at the start or at the
    goals; starts and goals closer than ``radius`` to an obstacle; goals that cannot be reached with 0.05 m
    to spare; and what a scenario's robots keep besides, if it is given (`check_keeping`).
    """
    check_places(setup, radius, keeping)
    for one, robots in _alike(setup, radius):
        bad = robots[unreachable(_only(setup, robots), Reach(one))]
        if bad.size:
            raise UnsolvableWorldError(
                f"robot {int(bad[0])}: no way from its start to its goal for a robot of radius {one:g} m "
                f"(searched with {CLEARANCE_M:g} m to spare on a {RESOLUTION_M:g} m grid)"
            )
    if keeping is not None:
        check_keeping(setup, radius, keeping)


def _alike(setup: Setup, radius: Radii) -> Iterator[tuple[float, Ints]]:
    """Return each radius that there is, and the robots that have it."""
    radii = np.broadcast_to(np.asarray(radius, float), len(setup.starts))
    for one in np.unique(radii).tolist():
        yield one, np.flatnonzero(radii == one)


def _only(setup: Setup, robots: Ints) -> Setup:
    """Return the setup of some of its robots."""
    return Setup(setup.world, setup.starts[robots], setup.goals[robots])


def check_places(setup: Setup, radius: Radii, keeping: Keeping | None = None) -> None:
    """Raise an UnsolvableWorldError unless every robot can stand at its start and at its goal, as in `check_setup`."""
    check_robots(len(setup.starts), float(np.max(radius)))
    starts, goals = np.asarray(setup.starts, dtype=np.float64), np.asarray(setup.goals, dtype=np.float64)
    if starts.ndim != 2 or starts.shape[1] != 3 or goals.shape != (len(starts), 2):
        raise UnsolvableWorldError(
            f"starts (N, 3) and goals (N, 2) do not fit: {starts.shape}, {goals.shape}"
        )
    _check_finite("start", starts)
    _check_finite("goal", goals)
    _check_apart("start", starts[:, :2], radius)
    _check_apart("goal", goals, radius)
    world = compile_world(setup.world)
    for one, robots in _alike(setup, radius):
        _check_free("start", world, starts[:, :2], robots, one)
        enough = "" if keeping is None else f"; {keeping.distance(one)[0]:g} m would do"
        _check_free("goal", world, goals, robots, one, enough)


def check_keeping(setup: Setup, radius: Radii, keeping: Keeping) -> None:
    """Raise a ConfigError that names the key, unless robots that keep so far off things get to their goals.

    Of a setup that `check_setup` has passed. A robot that starts at its goal need not go there.
    """
    moves = np.hypot(*(setup.goals - setup.starts[:, :2]).T) > ARRIVE_M
    for one, robots in _alike(setup, radius):
        _check_goals_kept_off(setup, robots[moves[robots]], one, keeping)
    parking = [keeping.spacing(float(one))[0] / 2.0 for one in np.broadcast_to(np.asarray(radius), len(setup.goals))]
    _check_parking(setup.goals, moves, parking, keeping.spacing(float(np.max(radius)))[1])
    for one, robots in _alike(setup, radius):
        _check_ways_kept_off(setup, robots[moves[robots]], one, keeping)


def _check_goals_kept_off(setup: Setup, robots: Ints, radius: float, keeping: Keeping) -> None:
    """Raise a ConfigError unless the goals of these robots are as far from things as they keep."""
    distance, key = keeping.distance(radius)
    world = compile_world(setup.world)
    for robot in robots.tolist():
        x, y = setup.goals[robot].tolist()
        free = static_clearance(world, x, y, x, y, 2.0 * distance)
        if free < distance - TOLERANCE_M:
            raise ConfigError(
                key,
                f"robot {robot} cannot arrive: its goal ({x:.3f}, {y:.3f}) is {free:.3f} m from an obstacle, "
                f"and with this value {distance:g} m would do",
            )


def _check_ways_kept_off(setup: Setup, robots: Ints, radius: float, keeping: Keeping) -> None:
    """Raise a ConfigError unless ways are as wide as these robots keep off things."""
    distance, key = keeping.distance(radius)
    if distance + WOBBLE_M <= radius + CLEARANCE_M:
        return
    bad = robots[unreachable(_only(setup, robots), Reach(radius, distance + WOBBLE_M - radius, FINE_M))]
    if bad.size:
        narrowest = 2.0 * (distance + WOBBLE_M + math.sqrt(0.5) * FINE_M)
        raise ConfigError(
            key,
            f"robot {int(bad[0])} has no way from its start to its goal: with this value robots pass through what is "
            f"{narrowest:.2f} m wide or wider",
        )


def _check_parking(goals: Floats, moves: NDArray[np.bool_], halves: Sequence[float], key: str) -> None:
    close = _closest(goals, np.array(halves) - 0.5 * TOLERANCE_M, moves)
    if close is not None:
        one, other, gap = close
        raise ConfigError(
            key,
            f"robots {one} and {other} cannot both arrive for certain: their goals are {gap:.3f} m apart, "
            f"and with this value {halves[one] + halves[other]:g} m would do",
        )


def unreachable(setup: Setup, reach: Reach) -> Ints:
    """Return the robots (K,) whose goal lies in another part of the free space than their start.

    One labelling of the free cells serves all robots. A start or goal whose own cell is blocked counts as in
    the free cell nearest to it within the clearance plus two cells.
    """
    return _apart(_raster_of(setup, reach), setup.starts, setup.goals, reach)


def pass_each_other(setup: Setup, reach: Reach) -> bool:
    """Tell whether every robot has a way when all the others have arrived, which then stand in its way."""
    raster = _raster_of(setup, reach)
    parked = np.column_stack([setup.goals, np.full(len(setup.goals), reach.radius)])
    for i in range(len(parked)):
        # The world's obstacles are the same for all of them; painting those takes most of the time.
        seen = with_circles(raster, np.delete(parked, i, axis=0), reach.radius + reach.clearance)
        if _apart(seen, setup.starts[i : i + 1], setup.goals[i : i + 1], reach).size:
            return False
    return True


def reachable_past(setup: Setup, reach: Reach, others: Floats) -> bool:
    """Tell whether the one robot of a setup has a way past discs that stand: ``others`` (K, 3) x, y, radius [m]."""
    raster = _raster_of(setup, reach)
    if len(others):
        raster = with_circles(raster, others, reach.radius + reach.clearance)
    return not _apart(raster, setup.starts, setup.goals, reach).size


def _raster_of(setup: Setup, reach: Reach) -> Raster:
    domain = domain_of(setup.world, [setup.starts, setup.goals])
    area = (domain[2] - domain[0]) * (domain[3] - domain[1])
    resolution = max(reach.resolution, float(np.sqrt(area / LARGEST_GRID_CELLS)))
    return rasterise(compile_world(setup.world), reach.radius + reach.clearance, domain, resolution)


def _apart(raster: Raster, starts: Floats, goals: Floats, reach: Reach) -> Ints:
    """Return which starts and goals lie in different parts of the free space."""
    found = components(raster)
    slack = int(np.ceil(reach.clearance / raster.resolution)) + 2
    start = labels_at(found, free_cells_near(raster, starts, slack))
    goal = labels_at(found, free_cells_near(raster, goals, slack))
    return np.flatnonzero((start != goal) | (start < 0))


def _check_finite(what: str, points: Floats) -> None:
    bad = np.flatnonzero(~np.all(np.isfinite(points), axis=1))
    if bad.size:
        raise UnsolvableWorldError(f"robot {int(bad[0])}: its {what} {points[bad[0]].tolist()} is not finite")


def _check_apart(what: str, points: Floats, radius: Radii) -> None:
    radii = np.broadcast_to(np.asarray(radius, float), len(points))
    close = _closest(points, radii, np.ones(len(points), dtype=np.bool_))
    if close is not None:
        one, other, gap = close
        raise UnsolvableWorldError(
            f"robots {one} and {other}: their {what}s are {gap:.3f} m apart, less than two radii "
            f"({radii[one] + radii[other]:g} m)"
        )


def _closest(points: Floats, halves: Floats, moves: NDArray[np.bool_]) -> tuple[int, int, float] | None:
    """Return the first two robots with points closer than their ``halves`` [m] together of which one ``moves``, and the
    distance.

    Neighbours are in bins of the side that is the largest of these sums.
    """
    bins: dict[tuple[int, int], list[int]] = {}
    for robot, (column, row) in enumerate(np.floor(points / (2.0 * halves.max())).astype(np.int64).tolist()):
        for near in ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
            for other in bins.get(near, []):
                gap = float(np.hypot(*(points[robot] - points[other])))
                if gap < halves[robot] + halves[other] and (moves[robot] or moves[other]):
                    return other, robot, gap
        bins.setdefault((column, row), []).append(robot)
    return None


def _check_free(what: str, world: World, points: Floats, robots: Ints, radius: float, enough: str = "") -> None:
    for robot in robots.tolist():
        x, y = points[robot].tolist()
        if static_clearance(world, x, y, x, y, 2.0 * radius) <= radius:
            raise UnsolvableWorldError(
                f"robot {robot}: its {what} ({x:.3f}, {y:.3f}) is in an obstacle or closer to one "
                f"than its radius ({radius:g} m){enough}"
            )
