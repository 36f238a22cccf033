"""From a scenario to what the kernels run on: world, starts, goals, rig, planner, noise, radio."""

from __future__ import annotations

import math
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.onboard.body import Body
from swarmscope.onboard.planners import Planner, load_planner
from swarmscope.onboard.rig import Guarding, Rig, Safety, Sharing, make_rig
from swarmscope.onboard.sensor import Sensor
from swarmscope.scenarios.read import is_packaged, map_path
from swarmscope.scenarios.scenario import NoiseModel, PlannerModel, Scenario
from swarmscope.sim.lidar import make_beams
from swarmscope.sim.loop import Setting
from swarmscope.sim.maps import load_map
from swarmscope.sim.state import Noise, Radio
from swarmscope.sim.world import WorldSpec, compile_world
from swarmscope.tasks._contract import Option, Setup, load_task


def make_setup(scenario: Scenario) -> Setup:
    """Return world, starts and goals of the scenario, checked to be solvable."""
    radius = scenario.robot.radius_m
    if scenario.task is not None:
        task = load_task(scenario.task.name)
        return task.make(scenario.seed, scenario.robots, radius, **scenario.task.options)
    if scenario.map is not None:
        from swarmscope.tasks import place_on_map

        spec = map_world(map_path(scenario.map.file))
        return place_on_map(spec, scenario.seed, scenario.robots, radius, scenario.map.min_distance_m)
    place = scenario.place
    if place is None or len(place.starts) != scenario.robots or len(place.goals) != scenario.robots:
        raise ConfigError("place", f"needs as many starts and goals as robots ({scenario.robots})")
    from swarmscope.tasks import check_setup

    setup = Setup(place.world, np.array(place.starts, float), np.array(place.goals, float))
    check_setup(setup, radius)
    return setup


def complete(scenario: Scenario) -> dict[str, Any]:
    """Return the scenario as plain values, every default written out; ``parse_scenario`` reads it back."""
    planner = load_planner(scenario.planner.name)
    values = scenario.model_dump(mode="json", exclude_none=True)
    values["planner"]["params"] = planner.settings(scenario.planner.params)
    if scenario.task is not None:
        values["task"]["options"] = task_options(load_task(scenario.task.name)) | scenario.task.options
    if scenario.planner.model is not None:
        values["planner"]["model"] = str(Path(scenario.planner.model).resolve())
    if scenario.map is not None and not is_packaged(scenario.map.file):
        values["map"]["file"] = str(Path(scenario.map.file).resolve())
    return values


def task_options(task: Any) -> dict[str, Option]:
    """Return the options of a task module with their defaults: the fields of its ``...Options`` dataclass."""
    kinds: list[Any] = [k for name, k in vars(task).items() if name.endswith("Options") and is_dataclass(k)]
    values = [item for kind in kinds for item in asdict(kind()).items()]
    return {name: value if isinstance(value, str) else float(value) for name, value in values}


def map_world(path: Path) -> WorldSpec:
    """Return the world of a map_server map."""
    grid = load_map(path)
    x, y = grid.origin
    bounds = (x, y, x + grid.width * grid.resolution, y + grid.height * grid.resolution)
    return WorldSpec(obstacles=[grid], bounds=bounds)


def make_rig_of(scenario: Scenario) -> Rig:
    """Return what the scenario's robots know of themselves."""
    beams = make_beams(scenario.lidar.beams, math.radians(scenario.lidar.fov_deg), scenario.lidar.range_m)
    robot, noise = scenario.robot, scenario.noise
    sensor = Sensor(
        beams=scenario.lidar.beams,
        angle_min=beams.angle_min,
        increment=beams.increment,
        wraps=beams.wraps,
        range_min=scenario.lidar.range_min_m,
        range_max=scenario.lidar.range_m,
        range_sigma=noise.range_fraction,
        position_sigma=math.hypot(noise.range_fraction, math.radians(noise.bearing_deg)),
    )
    body = Body(**robot.model_dump())
    guard, safety = scenario.guard, scenario.safety
    return make_rig(
        body,
        sensor,
        Guarding(**guard.model_dump()),
        Safety(**safety.model_dump()),
        Sharing(exact_features=scenario.radio.exact_features),
    )


def planner_of(chosen: PlannerModel) -> Planner:
    """Return the planner, or the planner with the model that is named instead of its own."""
    planner = load_planner(chosen.name)
    return planner if chosen.model is None else planner.with_model(chosen.model)


def _with_run_seed(params: Any, seed: int) -> Any:
    """Return the parameters of a planner for one run: what it tosses for also depends on the scenario's ``seed``."""
    if "seed" not in params._fields:
        return params
    return params._replace(seed=int(np.random.SeedSequence([seed, int(params.seed)]).generate_state(1)[0]))


def _noise_of(noise: NoiseModel) -> Noise:
    """Return the errors in the units of the kernels."""
    return Noise(
        range_fraction=noise.range_fraction,
        dropout=noise.dropout,
        bearing_rad=math.radians(noise.bearing_deg),
        compass_rad=math.radians(noise.compass_deg),
    )


def make_setting(scenario: Scenario, setup: Setup, threads: int = 1) -> Setting:
    """Return the run of ``scenario`` in ``setup``, ready for the kernels."""
    planner = planner_of(scenario.planner)
    ticks = scenario.limit_s * scenario.lidar.rate_hz
    heavy = ticks * scenario.robots * scenario.lidar.beams > 4e7
    return Setting(
        world=compile_world(setup.world),
        bounds=setup.world.bounds,
        starts=setup.starts,
        goals=setup.goals,
        beams=make_beams(scenario.lidar.beams, math.radians(scenario.lidar.fov_deg), scenario.lidar.range_m),
        rig=make_rig_of(scenario),
        planner=planner,
        params=_with_run_seed(planner.params(scenario.planner.params), scenario.seed),
        noise=_noise_of(scenario.noise),
        radio=Radio(**scenario.radio.model_dump(exclude={"exact_features"})),
        seed=scenario.seed,
        dt=1.0 / scenario.lidar.rate_hz,
        substeps=scenario.substeps,
        limit_s=scenario.limit_s,
        threads=threads,
        record_scans=scenario.record_scans == "yes" or (scenario.record_scans == "auto" and not heavy),
    )
