"""From a scenario to what the kernels run on: world, starts, goals, rig, planner, noise, radio."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import Any

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.onboard.body import Body
from swarmscope.onboard.data_sheets import check_horizon
from swarmscope.onboard.perception.features import MASKS
from swarmscope.onboard.planners import Planner, load_planner
from swarmscope.onboard.rig import Guarding, Rig, Safety, Sharing, make_rig
from swarmscope.onboard.sensor import Sensor, all_round
from swarmscope.scenarios.places import is_packaged, map_path
from swarmscope.scenarios.scenario import GuardModel, NoiseModel, PlannerModel, RobotModel, Scenario
from swarmscope.sim.beams import make_beams
from swarmscope.sim.loop import Setting
from swarmscope.sim.moving import STANDSTILL, Moving, moving_in, top_speed
from swarmscope.sim.state import Faults, Noise, Radio
from swarmscope.sim.world import compile_world
from swarmscope.tasks import Setup, load_task
from swarmscope.tasks._contract import all_options
from swarmscope.user_files import is_file_name, whole_path

FIRST_SCANS = 3
"""What one beam sees may be lost in one scan or in two, while the beam that looks there later is stuck."""
MOST_PLACES = 50_000_000
"""Of things that move, over a run: 0.8 GB."""


def complete(scenario: Scenario, run_files: bool = True) -> dict[str, Any]:
    """Return the scenario as plain values, every default written out; ``parse_scenario`` reads it back.

    Unless ``run_files``, defaults that only running a user's file would tell are left out.
    """
    values = scenario.model_dump(mode="json", exclude_none=True)
    planner, task = scenario.planner, scenario.task
    if run_files or not is_file_name(planner.name):
        values["planner"]["params"] = load_planner(planner.name).settings(planner.params)
    if task is not None and (run_files or not is_file_name(task.name)):
        values["task"]["options"] = all_options(load_task(task.name), task.options)
    for group in ("planner", "task"):
        if group in values and is_file_name(values[group]["name"]):
            values[group]["name"] = str(whole_path(values[group]["name"]))
    if planner.model is not None:
        values["planner"]["model"] = str(whole_path(planner.model))
    if scenario.map is not None and not is_packaged(scenario.map.file):
        values["map"]["file"] = str(whole_path(map_path(scenario.map.file)))
    if scenario.map is not None and scenario.map.trips is not None:
        values["map"]["trips"] = str(whole_path(scenario.map.trips))
    return values


def make_rig_of(scenario: Scenario) -> Rig:
    """Return what the scenario's robots know of themselves; where they differ, what the largest knows."""
    return _rig_of(scenario, scenario.widest, STANDSTILL)


def make_rigs_of(scenario: Scenario, moving: Moving) -> tuple[Rig, ...]:
    """Return what each of the scenario's robots knows of itself, the same object for those that are alike."""
    keys = [str(sheet.model_dump(exclude={"start_s"})) for sheet in scenario.sheets]
    different = dict(zip(keys, scenario.sheets, strict=True))
    rigs = {key: _rig_of(scenario, sheet, moving) for key, sheet in different.items()}
    return tuple(rigs[key] for key in keys)


def _rig_of(scenario: Scenario, sheet: RobotModel, moving: Moving) -> Rig:
    """Return what a robot with this data sheet knows of itself, of the others and of what ``moving`` there is."""
    beams = make_beams(scenario.lidar.beams, math.radians(scenario.lidar.fov_deg), scenario.lidar.range_m)
    range_sigma, position_sigma = sigmas_of(scenario)
    sensor = Sensor(
        beams=scenario.lidar.beams,
        angle_min=beams.angle_min,
        increment=beams.increment,
        wraps=beams.wraps,
        range_min=scenario.lidar.range_min_m,
        range_max=scenario.lidar.range_m,
        range_sigma=range_sigma,
        position_sigma=position_sigma,
    )
    return _latest_rig(all_round(sensor), *sheet_of(scenario, sheet, moving))


def sigmas_of(scenario: Scenario) -> tuple[float, float]:
    """Return the standard deviations of a range and of a neighbour's position, as fractions of the distance."""
    noise = scenario.noise
    return noise.range_fraction, math.hypot(noise.range_fraction, math.radians(noise.bearing_deg))


def sheet_of(
    scenario: Scenario, sheet: RobotModel | None = None, moving: Moving = STANDSTILL
) -> tuple[Body, Guarding, Safety, Sharing]:
    """Return the data sheet of a robot of the scenario, the largest one if none is named, but the LiDAR."""
    guard, safety, noise = scenario.guard, scenario.safety, scenario.noise
    return (
        body_of(sheet or scenario.widest),
        Guarding(
            **guard.model_dump(exclude_none=True) | _about_others(scenario, moving) | _first_scans(scenario),
            latency_s=noise.scan_age_s,
            odometry_scale=noise.odometry_scale,
            odometry_drift_m=noise.odometry_drift_m,
            odometry_turn_rad=math.radians(noise.odometry_turn_deg),
        ),
        Safety(**safety.model_dump()),
        Sharing(
            exact_features=scenario.radio.exact_features,
            feature_mask=_mask_of(scenario),
            printed_filter=scenario.features.filter == "printed",
        ),
    )


def _first_scans(scenario: Scenario) -> dict[str, int]:
    """Return how many scans it takes to set off where beams lose what they see, and nobody has said otherwise."""
    loses = scenario.noise.dropout > 0.0 or scenario.noise.stuck > 0.0
    return {"first_scans": FIRST_SCANS} if loses and scenario.guard.first_scans < 0 else {}


def _mask_of(scenario: Scenario) -> int:
    """Return which extrema count in safe directions only."""
    mask = scenario.features.mask
    return load_planner(scenario.planner.name).feature_mask if mask == "planner" else MASKS[mask]


def body_of(sheet: RobotModel) -> Body:
    """Return the data sheet as planners know it."""
    return Body(**sheet.model_dump(include=set(Body._fields)))


def _is_open(guard: GuardModel, key: str) -> bool:
    """Tell whether what is said of a key leaves it open; 0 m/s is an answer, 0 m is none."""
    value: float = getattr(guard, key)
    return value < 0.0 or (value == 0.0 and not key.endswith("_mps"))


def _about_others(scenario: Scenario, moving: Moving) -> dict[str, float]:
    """Return what the guard has to know of other robots and of what moves, as far as the scenario does not say it."""
    sheets, guard = scenario.sheets if isinstance(scenario.robot, list) else [], scenario.guard
    found = {"strangers_mps": top_speed(moving)}
    if moving.radius.size:
        found["strangers_m"] = float(moving.radius.min())
    if sheets:
        radii = [sheet.radius_m for sheet in sheets]
        found |= {"others_smallest_m": min(radii), "others_largest_m": max(radii)}
        found["others_mps"] = max(sheet.v_max_mps for sheet in sheets)
    said = guard.model_fields_set
    return {key: value for key, value in found.items() if key not in said or _is_open(guard, key)}


@lru_cache(maxsize=8)
def _latest_rig(sensor: Sensor, body: Body, guarding: Guarding, safety: Safety, sharing: Sharing) -> Rig:
    """Return the rig of this data sheet; those of the last ones asked for, whose tables take long, are kept."""
    return make_rig(body, sensor, guarding, safety, sharing)


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
        compass_bias_rad=math.radians(noise.compass_bias_deg),
        odometry_scale=noise.odometry_scale,
        odometry_drift_m=noise.odometry_drift_m,
        odometry_turn_rad=math.radians(noise.odometry_turn_deg),
        nan=noise.nan,
        stuck=noise.stuck,
        blind_rad=math.radians(noise.blind_deg),
        scan_age_s=noise.scan_age_s,
    )


def make_setting(scenario: Scenario, setup: Setup, threads: int = 1) -> Setting:
    """Return the run of ``scenario`` in ``setup``, ready for the kernels."""
    planner = planner_of(scenario.planner)
    ticks = scenario.limit_s * scenario.lidar.rate_hz
    moving, dt = moving_in(setup.world), 1.0 / scenario.lidar.rate_hz
    if ticks * (len(moving.radius) + len(moving.closed)) > MOST_PLACES:
        raise ConfigError("limit_s", f"{ticks:g} ticks of {len(moving.radius)} discs are too many to be kept: lower it")
    rigs = make_rigs_of(scenario, moving)
    for rig in dict(zip(map(id, rigs), rigs, strict=True)).values():
        check_horizon(rig, dt)
    heavy = ticks * scenario.robots * scenario.lidar.beams > 4e7
    return Setting(
        world=compile_world(setup.world),
        bounds=setup.world.bounds,
        starts=setup.starts,
        goals=setup.goals,
        beams=make_beams(scenario.lidar.beams, math.radians(scenario.lidar.fov_deg), scenario.lidar.range_m),
        rig=rigs[0],
        planner=planner,
        params=_with_run_seed(planner.params(scenario.planner.params), scenario.seed),
        noise=_noise_of(scenario.noise),
        radio=Radio(**scenario.radio.model_dump(exclude={"exact_features"})),
        faults=Faults(**scenario.faults.model_dump()),
        seed=scenario.seed,
        dt=dt,
        substeps=scenario.substeps,
        limit_s=scenario.limit_s,
        threads=threads,
        goal_yaws=setup.goal_yaws,
        moving=moving,
        rigs=rigs if isinstance(scenario.robot, list) else (),
        start_s=_start_s(scenario, setup),
        record_scans=scenario.record_scans == "yes" or (scenario.record_scans == "auto" and not heavy),
    )


def _start_s(scenario: Scenario, setup: Setup) -> tuple[float, ...]:
    """Return when each robot is switched on [s], the later of what its data sheet and the task say."""
    given = [sheet.start_s for sheet in scenario.robot] if isinstance(scenario.robot, list) else []
    if setup.start_s is None:
        return tuple(given)
    return tuple(np.maximum(setup.start_s, given or [0.0]).tolist())
