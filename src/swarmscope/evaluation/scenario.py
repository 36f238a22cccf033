"""A scenario: one file that describes one run completely, validated; and the run made from it."""

from __future__ import annotations

import math
from dataclasses import asdict, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from swarmscope.errors import ConfigError, InputFileError, UnknownNameError, nearest_hint
from swarmscope.onboard.percept import Rig, Sensor, make_rig
from swarmscope.onboard.planning._contract import load_planner, make_params, planner_names
from swarmscope.onboard.robot import Body
from swarmscope.sim.lidar import make_beams
from swarmscope.sim.loop import Setting
from swarmscope.sim.maps import load_map, packaged_map
from swarmscope.sim.state import Noise, Radio
from swarmscope.sim.world import WorldSpec, compile_world
from swarmscope.tasks._contract import Option, Setup, load_task, task_names

Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Fraction = Annotated[float, Field(ge=0.0, le=1.0)]
NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]


class _Strict(BaseModel):
    """No unknown keys, nothing changed after loading."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class RobotModel(_Strict):
    """The robots' data sheet (``Body``)."""

    radius_m: Positive = 0.15
    half_width_m: Positive = 0.15
    v_max_mps: Positive = 0.5
    a_max_mps2: Positive = 2.0
    w_max_radps: Positive = 2.0
    sensor_delay_s: NotNegative = 0.175


class LidarModel(_Strict):
    """The LiDAR."""

    beams: Annotated[int, Field(ge=8, le=4096)] = 360
    fov_deg: Annotated[float, Field(gt=0.0, le=360.0)] = 360.0
    range_m: Positive = 5.0
    range_min_m: NotNegative = 0.0
    rate_hz: Annotated[float, Field(gt=0.0, le=100.0)] = 5.0


class NoiseModel(_Strict):
    """Sensor errors, one standard deviation each; 0 is none."""

    range_fraction: Annotated[float, Field(ge=0.0, le=0.3)] = 0.0
    """Of a LiDAR range and of the distance to a neighbour."""
    dropout: Fraction = 0.0
    """Share of LiDAR returns lost."""
    bearing_deg: Annotated[float, Field(ge=0.0, le=45.0)] = 0.0
    compass_deg: Annotated[float, Field(ge=0.0, le=45.0)] = 0.0


class RadioModel(_Strict):
    """The link between robots."""

    range_m: NotNegative = 15.0
    latency_s: NotNegative = 0.005
    loss: Fraction = 0.0
    bitrate_bps: Positive = 78125.0
    exact_features: bool = False
    """Send float32 features instead of bytes (to measure what quantisation costs)."""


class GuardModel(_Strict):
    """Distances kept free around the body."""

    clearance_m: NotNegative = 0.02
    footprint_clearance_m: NotNegative = 0.03
    persistence_s: NotNegative = 2.0


class SafetyModel(_Strict):
    """Which directions are safe (docs/theory.md); ``sector: true, look_ahead_m: 0`` is the printed rule."""

    sector: bool = False
    look_ahead_m: NotNegative = 2.0
    margin_m: NotNegative = 0.04
    narrow_m: NotNegative = 1.2


class TaskModel(_Strict):
    """A task by name, with its options."""

    name: str
    options: dict[str, float | str] = {}


class MapModel(_Strict):
    """A map_server map; starts and goals are drawn from its free space."""

    file: str
    min_distance_m: NotNegative = 8.0


class WorldModel(_Strict):
    """A world written out: obstacles, starts and goals."""

    world: WorldSpec
    starts: list[tuple[float, float, float]]
    goals: list[tuple[float, float]]


class PlannerModel(_Strict):
    """A planner by name, with its parameters."""

    name: str = "nav-scope"
    model: str | None = None
    """Folder of the network that it runs instead of its own; only for planners with a network."""
    params: dict[str, Annotated[float, Field(allow_inf_nan=False)]] = {}


class Scenario(_Strict):
    """One run, complete: exactly one of ``task``, ``map``, ``place``."""

    task: TaskModel | None = None
    map: MapModel | None = None
    place: WorldModel | None = None
    planner: PlannerModel = PlannerModel()
    robots: Annotated[int, Field(ge=1, le=200_000)] = 15
    seed: Annotated[int, Field(ge=0, lt=2**31)] = 0
    robot: RobotModel = RobotModel()
    lidar: LidarModel = LidarModel()
    noise: NoiseModel = NoiseModel()
    radio: RadioModel = RadioModel()
    guard: GuardModel = GuardModel()
    safety: SafetyModel = SafetyModel()
    limit_s: Positive = 300.0
    substeps: Annotated[int, Field(ge=1, le=1000)] = 20
    record_scans: Literal["auto", "yes", "no"] = "auto"
    judge_sides: bool = False
    """Note the side of the shortest way beside every choice; planners with ``told`` set take it."""

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if sum(p is not None for p in (self.task, self.map, self.place)) != 1:
            raise ValueError("give exactly one of 'task', 'map' and 'place'")
        return self


def parse_scenario(values: Any, where: str) -> Scenario:
    """Return the scenario in ``values``; a ConfigError names place, problem and the nearest valid key."""
    if not isinstance(values, dict):
        raise ConfigError(where, "a scenario is a mapping of keys to values")
    try:
        scenario = Scenario.model_validate(values)
    except ValidationError as error:
        raise _first_problem(error, where) from None
    if scenario.task is not None and scenario.task.name not in task_names():
        raise UnknownNameError("task", scenario.task.name, task_names(), f"{where}: task.name")
    if scenario.planner.name not in planner_names():
        raise UnknownNameError("planner", scenario.planner.name, planner_names(), f"{where}: planner.name")
    if scenario.planner.model is not None and not hasattr(load_planner(scenario.planner.name), "with_model"):
        raise ConfigError(f"{where}: planner.model", f"planner '{scenario.planner.name}' runs no network")
    return scenario


def read_scenario_file(path: Path) -> dict[str, Any]:
    """Return the mapping in YAML file ``path``, not validated yet; a map file and a model are looked for beside it."""
    try:
        values = yaml.safe_load(path.read_text(encoding="utf-8"))
    except UnicodeDecodeError:
        raise InputFileError(path, "is not text") from None
    except OSError as error:
        raise InputFileError(path, f"cannot be read ({error.strerror})") from None
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise InputFileError(path, f"is not YAML ({' '.join(str(error).split())})") from None
    if not isinstance(values, dict):
        raise ConfigError(str(path), "a scenario is a mapping of keys to values")
    place = values.get("map")
    if isinstance(place, dict) and isinstance(place.get("file"), str):
        place["file"] = _find_map(path, place["file"])
    planner = values.get("planner")
    if isinstance(planner, dict) and isinstance(planner.get("model"), str):
        planner["model"] = _find_beside(path, planner["model"])
    return values


def _find_map(scenario: Path, name: str) -> str:
    """Return the map's path: beside the scenario or as it is; names of packaged maps stay names."""
    if _is_packaged(name):
        return name
    return _find_beside(scenario, name)


def _find_beside(scenario: Path, name: str) -> str:
    """Return the path beside the scenario if there is something, else as it is."""
    beside = scenario.parent / name
    return str(beside) if beside.exists() else name


def load_scenario(path: Path) -> Scenario:
    """Return the scenario in YAML file ``path``."""
    return parse_scenario(read_scenario_file(path), str(path))


def _first_problem(error: ValidationError, where: str) -> ConfigError:
    """Turn pydantic's first error into ours."""
    problem = error.errors()[0]
    place = ".".join(str(p) for p in problem["loc"]) or "(top)"
    message = str(problem["msg"]).removeprefix("Value error, ")
    if problem["type"] == "extra_forbidden":
        message = f"unknown key{nearest_hint(str(problem['loc'][-1]), _valid_keys(problem['loc'][:-1]))}"
    return ConfigError(f"{where}: {place}", message)


def _valid_keys(loc: tuple[int | str, ...]) -> list[str]:
    """Return the keys that are valid at place ``loc`` of a scenario."""
    model: Any = Scenario
    for part in loc:
        fields = getattr(model, "model_fields", {})
        if part not in fields:
            return []
        kind = fields[part].annotation
        options = [k for k in getattr(kind, "__args__", ()) if hasattr(k, "model_fields")]
        model = options[0] if options else kind
    return list(getattr(model, "model_fields", {}))


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
    values["planner"]["params"] = make_params(planner, scenario.planner.params)._asdict()
    if scenario.task is not None:
        values["task"]["options"] = task_options(load_task(scenario.task.name)) | scenario.task.options
    if scenario.planner.model is not None:
        values["planner"]["model"] = str(Path(scenario.planner.model).resolve())
    if scenario.map is not None and not _is_packaged(scenario.map.file):
        values["map"]["file"] = str(Path(scenario.map.file).resolve())
    return values


def task_options(task: Any) -> dict[str, Option]:
    """Return the options of a task module with their defaults: the fields of its ``...Options`` dataclass."""
    kinds: list[Any] = [k for name, k in vars(task).items() if name.endswith("Options") and is_dataclass(k)]
    values = [item for kind in kinds for item in asdict(kind()).items()]
    return {name: value if isinstance(value, str) else float(value) for name, value in values}


def map_path(name: str) -> Path:
    """Return the YAML file of a map: a path, or the name of a map that comes with the package."""
    return packaged_map(name) if _is_packaged(name) else Path(name)


def _is_packaged(name: str) -> bool:
    return not name.endswith((".yaml", ".yml"))


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
    body = Body(
        robot.radius_m,
        robot.half_width_m,
        robot.v_max_mps,
        robot.a_max_mps2,
        robot.w_max_radps,
        robot.sensor_delay_s,
    )
    return make_rig(
        body,
        sensor,
        footprint_clearance=scenario.guard.footprint_clearance_m,
        clearance=scenario.guard.clearance_m,
        persistence=scenario.guard.persistence_s,
        exact_features=scenario.radio.exact_features,
        sector=scenario.safety.sector,
        look_ahead=scenario.safety.look_ahead_m,
        margin=scenario.safety.margin_m,
        narrow=scenario.safety.narrow_m,
    )


def planner_of(chosen: PlannerModel) -> Any:
    """Return the planner's module, or the planner with the model that is named instead of its own."""
    planner = load_planner(chosen.name)
    return planner if chosen.model is None else planner.with_model(chosen.model)


def _with_run_seed(params: Any, seed: int) -> Any:
    """Return the parameters of a planner for one run: what it tosses for also depends on the scenario's ``seed``."""
    if "seed" not in params._fields:
        return params
    return params._replace(seed=int(np.random.SeedSequence([seed, int(params.seed)]).generate_state(1)[0]))


def make_setting(scenario: Scenario, setup: Setup, threads: int = 1) -> Setting:
    """Return the run of ``scenario`` in ``setup``, ready for the kernels."""
    planner = planner_of(scenario.planner)
    noise, radio = scenario.noise, scenario.radio
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
        params=_with_run_seed(make_params(planner, scenario.planner.params), scenario.seed),
        noise=Noise(
            range_sigma=noise.range_fraction,
            dropout=noise.dropout,
            position_range_sigma=noise.range_fraction,
            bearing_sigma=math.radians(noise.bearing_deg),
            compass_sigma=math.radians(noise.compass_deg),
        ),
        radio=Radio(
            range_m=radio.range_m, latency_s=radio.latency_s, loss=radio.loss, bitrate=radio.bitrate_bps
        ),
        seed=scenario.seed,
        dt=1.0 / scenario.lidar.rate_hz,
        substeps=scenario.substeps,
        limit_s=scenario.limit_s,
        threads=threads,
        record_scans=scenario.record_scans == "yes" or (scenario.record_scans == "auto" and not heavy),
    )
