"""Can every robot stand where it is put and reach its goal? Asked of made forests, maps and users' own
scenarios."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import UnsolvableWorldError
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
LARGEST_GRID_CELLS = 150_000_000  # worlds beyond this are checked on a grid coarse enough to stay below

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Reach(NamedTuple):
    """How the ways are searched: grid cells whose centres keep ``radius`` + ``clearance`` [m] off all
    obstacles."""

    radius: float
    clearance: float = CLEARANCE_M
    resolution: float = RESOLUTION_M


def check_setup(setup: Setup, radius: float) -> None:
    """Raise an UnsolvableWorldError that names the robot and the reason, unless all can start and arrive.

    Checked, in this order: finite numbers; robots of ``radius`` [m] that overlap at the start or at the
    goals; starts and goals closer than ``radius`` to an obstacle; goals that cannot be reached with 0.05 m
    to spare.
    """
    check_robots(len(setup.starts), radius)
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
    _check_free("start", world, starts[:, :2], radius)
    _check_free("goal", world, goals, radius)
    bad = unreachable(setup, Reach(radius))
    if bad.size:
        raise UnsolvableWorldError(
            f"robot {int(bad[0])}: no way from its start to its goal for a robot of radius {radius:g} m "
            f"(searched with {CLEARANCE_M:g} m to spare on a {RESOLUTION_M:g} m grid)"
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


def _check_apart(what: str, points: Floats, radius: float) -> None:
    """Look at each point's neighbours in bins of side 2 radius."""
    bins: dict[tuple[int, int], list[int]] = {}
    for robot, (column, row) in enumerate(np.floor(points / (2.0 * radius)).astype(np.int64).tolist()):
        for near in ((column + i, row + j) for i in (-1, 0, 1) for j in (-1, 0, 1)):
            for other in bins.get(near, []):
                gap = float(np.hypot(*(points[robot] - points[other])))
                if gap < 2.0 * radius:
                    raise UnsolvableWorldError(
                        f"robots {other} and {robot}: their {what}s are {gap:.3f} m apart, "
                        f"less than two radii ({2.0 * radius:g} m)"
                    )
        bins.setdefault((column, row), []).append(robot)


def _check_free(what: str, world: World, points: Floats, radius: float) -> None:
    for robot, (x, y) in enumerate(points.tolist()):
        if static_clearance(world, x, y, x, y, 2.0 * radius) <= radius:
            raise UnsolvableWorldError(
                f"robot {robot}: its {what} ({x:.3f}, {y:.3f}) is in an obstacle or closer to one "
                f"than its radius ({radius:g} m)"
            )
