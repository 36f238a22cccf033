"""From a scenario to its place: world, starts and goals."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.sim.maps import load_map, packaged_map
from swarmscope.sim.world import WorldSpec
from swarmscope.tasks import Setup, check_setup, place_on_map, setup_of_task

if TYPE_CHECKING:  # what a scenario says elsewhere changes no place
    from swarmscope.scenarios.scenario import Scenario


def make_setup(scenario: Scenario) -> Setup:
    """Return world, starts and goals of the scenario, checked to be solvable."""
    radius = scenario.robot.radius_m
    if scenario.task is not None:
        return setup_of_task(scenario.task.name, scenario.task.options, scenario.seed, scenario.robots, radius)
    if scenario.map is not None:
        spec = map_world(map_path(scenario.map.file))
        return place_on_map(spec, scenario.seed, scenario.robots, radius, scenario.map.min_distance_m)
    place = scenario.place
    if place is None or len(place.starts) != scenario.robots or len(place.goals) != scenario.robots:
        raise ConfigError("place", f"needs as many starts and goals as robots ({scenario.robots})")
    setup = Setup(place.world, np.array(place.starts, float), np.array(place.goals, float))
    check_setup(setup, radius)
    return setup


def map_world(path: Path) -> WorldSpec:
    """Return the world of a map_server map."""
    grid = load_map(path)
    x, y = grid.origin
    bounds = (x, y, x + grid.width * grid.resolution, y + grid.height * grid.resolution)
    return WorldSpec(obstacles=[grid], bounds=bounds)


def map_path(name: str) -> Path:
    """Return the YAML file of a map: a path, or the name of a map that comes with the package."""
    return packaged_map(name) if is_packaged(name) else Path(name)


def is_packaged(name: str) -> bool:
    """Tell whether this is the name of a map that comes with the package, not a path."""
    return not name.endswith((".yaml", ".yml"))
