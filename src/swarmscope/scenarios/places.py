"""From a scenario to its place: world, starts and goals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.sim.maps import closed, load_map, packaged_map
from swarmscope.sim.world import WorldSpec
from swarmscope.tasks import Setup, check_setup, place_on_map, setup_of_task
from swarmscope.tasks._check import Keeping, check_keeping

if TYPE_CHECKING:  # what a scenario says elsewhere changes no place
    from swarmscope.scenarios.scenario import Scenario


def make_setup(scenario: Scenario) -> Setup:
    """Return world, starts and goals of the scenario, checked to be solvable for robots as it describes them."""
    radius = scenario.robot.radius_m
    guard = scenario.guard
    keeping = Keeping(guard.clearance_m, guard.footprint_clearance_m, scenario.lidar.range_min_m)
    if scenario.place is not None:
        setup = _written_out(scenario)
        check_setup(setup, radius, keeping)
        return setup
    setup = _made(scenario)
    check_keeping(setup, radius, keeping)
    return setup


def _written_out(scenario: Scenario) -> Setup:
    place = scenario.place
    if place is None or len(place.starts) != scenario.robots or len(place.goals) != scenario.robots:
        raise ConfigError("place", f"needs as many starts and goals as robots ({scenario.robots})")
    return Setup(place.world, np.array(place.starts, float), np.array(place.goals, float))


def _made(scenario: Scenario) -> Setup:
    """Return the setup of a task, or of a map."""
    radius, task = scenario.robot.radius_m, scenario.task
    if task is not None:
        return setup_of_task(task.name, task.options, scenario.seed, scenario.robots, radius)
    if scenario.map is None:
        raise ConfigError("task", "is missing")
    spec = map_world(map_path(scenario.map.file))
    return place_on_map(spec, scenario.seed, scenario.robots, radius, scenario.map.min_distance_m)


def map_world(path: Path) -> WorldSpec:
    """Return the world of a map_server map; its bounds are the picture's, and solid."""
    grid = load_map(path)
    x, y = grid.origin
    bounds = (x, y, x + grid.width * grid.resolution, y + grid.height * grid.resolution)
    return WorldSpec(obstacles=[closed(grid)], bounds=bounds)


def map_path(name: str) -> Path:
    """Return the YAML file of a map: a path, or the name of a map that comes with the package."""
    return packaged_map(name) if is_packaged(name) else Path(name)


def is_packaged(name: str) -> bool:
    """Tell whether this is the name of a map that comes with the package, not a path."""
    return not name.endswith((".yaml", ".yml"))
