"""From a scenario to its place: world, starts and goals."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.sim.maps import Trip, closed, load_map, load_movingai, load_trips, packaged_map
from swarmscope.sim.maps.gazebo import load_world
from swarmscope.sim.maps.map_server import YAML
from swarmscope.sim.maps.movingai import check_trips, place_of
from swarmscope.sim.maps.orion import load_maze
from swarmscope.sim.world import LONGEST_M, Grid, WorldSpec, grid_corners
from swarmscope.tasks import Setup, Wanted, check_setup, place_wanted, setup_of_task
from swarmscope.tasks._check import Keeping, check_keeping
from swarmscope.tasks._occupancy import domain_of

if TYPE_CHECKING:  # what a scenario says elsewhere changes no place
    from swarmscope.scenarios.scenario import MapModel, Scenario

MOST_M2 = 5e6
"""Area of a world, of a box round its bounds, starts and goals."""


def make_setup(scenario: Scenario) -> Setup:
    """Return world, starts and goals of the scenario, checked to be solvable for robots as it describes them."""
    radius: float | list[float] = scenario.radii_m
    guard = scenario.guard
    keeping = Keeping(guard.clearance_m, guard.footprint_clearance_m, scenario.lidar.range_min_m)
    if scenario.place is not None:
        setup = _written_out(scenario)
        _check_extent(setup, "place")
        check_setup(setup, radius, keeping)
        return setup
    setup = _made(scenario)
    _check_extent(setup, "map" if scenario.map is not None else "task")
    check_keeping(setup, radius, keeping)
    return setup


def _check_extent(setup: Setup, key: str) -> None:
    """Raise a ConfigError for a world that is too large to look for ways in."""
    x0, y0, x1, y1 = domain_of(setup.world, [setup.starts, setup.goals])
    if not (x1 - x0) * (y1 - y0) <= MOST_M2:
        why = f"bounds, starts and goals span {x1 - x0:.0f} m x {y1 - y0:.0f} m"
        raise ConfigError(key, f"{why}; ways are looked for on at most {MOST_M2 / 1e6:g} km²")


def _written_out(scenario: Scenario) -> Setup:
    place = scenario.place
    if place is None or len(place.starts) != scenario.robots or len(place.goals) != scenario.robots:
        raise ConfigError("place", f"needs as many starts and goals as robots ({scenario.robots})")
    goals, yaws = apart(place.goals)
    return Setup(place.world, np.array(place.starts, float), goals, yaws)


def apart(goals: Sequence[Sequence[float]]) -> tuple[np.ndarray, np.ndarray | None]:
    """Return goals (N, 2), and the headings wanted there (N,), NaN where any will do; None where none is."""
    yaws = np.array([goal[2] if len(goal) > 2 else np.nan for goal in goals])
    return np.array([goal[:2] for goal in goals], float), yaws if np.isfinite(yaws).any() else None


def _made(scenario: Scenario) -> Setup:
    """Return the setup of a task, or of a map."""
    radius, task = scenario.widest.radius_m, scenario.task
    if task is not None:
        return setup_of_task(task.name, task.options, scenario.seed, scenario.robots, radius)
    if scenario.map is None:
        raise ConfigError("task", "is missing")
    return _on_map(scenario, scenario.map)


def _on_map(scenario: Scenario, place: MapModel) -> Setup:
    """Return the setup of robots on a map: starts and goals as given, the others drawn."""
    world, grid, trips = _world_of_map(place)
    starts, goals = list(place.starts), list(place.goals)
    if place.trips is not None:
        if starts or goals:
            raise ConfigError("map.trips", "give either trips, or starts and goals")
        trips = load_trips(Path(place.trips))
    if trips and not starts and not goals:
        trips = _some_trips(trips, place.first_trip, scenario.robots)
        if grid is None:
            raise ConfigError("map.trips", "trips count in cells, and this file holds none")
        check_trips(Path(place.trips or place.file), trips, grid)
        starts = [place_of(trip.start, grid) for trip in trips]
        goals = [place_of(trip.goal, grid) for trip in trips]
    for key, given in (("starts", starts), ("goals", goals)):
        if len(given) > scenario.robots:
            raise ConfigError(f"map.{key}", f"{len(given)} are given for {scenario.robots} robots: raise 'robots'")
    if place.obstacles:
        world = WorldSpec(obstacles=[*world.obstacles, *place.obstacles], bounds=world.bounds)
    radii = scenario.radii_m
    each = tuple(radii) if isinstance(radii, list) else ()
    wanted = Wanted(
        scenario.seed, scenario.robots, scenario.widest.radius_m, place.min_distance_m, starts, goals, each
    )
    _check_extent(Setup(world, np.zeros((0, 3)), np.zeros((0, 2))), "map")
    with _naming_trips(place.first_trip if trips else None):
        return place_wanted(world, wanted)


@contextmanager
def _naming_trips(first: int | None) -> Iterator[None]:
    """Name the trip, not a key that nobody gave, in what is wrong with a start or a goal; None: there are no trips."""
    try:
        yield
    except ConfigError as error:
        found = re.fullmatch(r"map\.(start|goal)s\[(\d+)\]", error.where)
        if first is None or found is None:
            raise
        raise ConfigError(f"map.trips: {found[1]} of trip {first + int(found[2])}", error.why) from None


def count_trips(place: MapModel) -> int:
    """Return how many trips a scenario's map has from the first one on that is asked for; 0 without trips.

    Errors: SwarmscopeError of a file that cannot be read.
    """
    if place.trips is not None:
        return max(0, len(load_trips(Path(place.trips))) - place.first_trip)
    if place.number is None or place.resolution_m is None:
        return 0
    return max(0, len(_read_map(place)[1]) - place.first_trip)


def _world_of_map(place: MapModel) -> tuple[WorldSpec, Grid | None, list[Trip]]:
    """Return the world of a scenario's map, its cells if it has some, and the trips that its file holds."""
    path = map_path(place.file)
    if path.suffix.lower() == ".world":
        if place.resolution_m is not None or place.number is not None:
            raise ConfigError("map.resolution_m, map.number", f"{path} is a world of Gazebo: leave them out")
        return load_world(path), None, []
    grid, trips = _read_map(place)
    return world_of(grid), grid, trips


def _some_trips(trips: list[Trip], first: int, robots: int) -> list[Trip]:
    if first + robots > len(trips):
        remedy = "ask for fewer 'robots'" if first == 0 else "ask for fewer 'robots', or begin earlier"
        why = f"{robots} robots take trips {first} to {first + robots - 1}, and there are {len(trips)}: {remedy}"
        raise ConfigError("map.first_trip", why)
    return trips[first : first + robots]


def _read_map(place: MapModel) -> tuple[Grid, list[Trip]]:
    """Return the cells of a scenario's map, and the trips that its file holds."""
    path = map_path(place.file)
    kind, side = path.suffix.lower(), place.resolution_m
    if kind == ".scen":
        raise ConfigError("map.file", f"{path} holds trips: give it as map.trips, --trips, beside its map")
    if kind in YAML and side is not None:
        raise ConfigError("map.resolution_m", f"{path} says it itself")
    if kind not in YAML and side is None:
        why = f"{path} does not say how large its cells are: give their side [m], --resolution"
        raise ConfigError("map.resolution_m", why)
    if kind == ".npz" and side is not None:
        if place.number is None:
            raise ConfigError("map.number", f"{path} holds many mazes: say which one, --number")
        return load_maze(path, place.number, side)
    if place.number is not None:
        raise ConfigError("map.number", f"{path} holds one map only")
    if kind == ".map" and side is not None:
        return load_movingai(path, side), []
    return load_map(path, side), []


def world_of(grid: Grid) -> WorldSpec:
    """Return the world of a map; its bounds are the box round the picture, and it is solid beyond."""
    corners = grid_corners(grid)
    (x0, y0), (x1, y1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    if not np.abs(corners).max() <= LONGEST_M:
        why = f"it reaches from ({x0:g}, {y0:g}) to ({x1:g}, {y1:g}) m, and worlds to {LONGEST_M:g} m"
        raise ConfigError("map", f"{why}: look at the resolution and at its origin")
    return WorldSpec(obstacles=[closed(grid)], bounds=(x0, y0, x1, y1))


def map_path(name: str) -> Path:
    """Return the file of a map: a path, or that of a map that comes with the package."""
    return packaged_map(name) if is_packaged(name) else Path(os.path.expanduser(name))


def is_packaged(name: str) -> bool:
    """Tell whether this is the name of a map that comes with the package, not a path."""
    return "/" not in name and not Path(name).suffix
