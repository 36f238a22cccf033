"""The schema of a scenario: one file that describes one run completely, validated."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

from swarmscope.sim.world import WorldSpec

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
