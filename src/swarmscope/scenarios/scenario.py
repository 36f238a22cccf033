"""The schema of a scenario: one file that describes one run completely, validated.

A default that the kernels have, too, is taken from there: ``Body``, ``Guarding``, ``Safety``, ``Sharing``, ``Noise``,
``Radio``, ``Faults``, ``Setting``.
The text after a field is its meaning, with the unit in brackets; docs/scenario.md and ``swarmscope config`` print it.
"""

from __future__ import annotations

import math
from typing import Annotated, Any, Final, Literal, Self

from pydantic import BaseModel, BeforeValidator, ConfigDict, Discriminator, Field, Tag, model_validator

from swarmscope.onboard.body import Body
from swarmscope.onboard.data_sheets import MOST_FIRST_SCANS
from swarmscope.onboard.lidar import LEAST_VIEW_DEG, Lidar
from swarmscope.onboard.rig import Guarding, Safety, Sharing
from swarmscope.sim.loop import Setting
from swarmscope.sim.state import Faults, Noise, Radio
from swarmscope.sim.world import LONGEST_M, Obstacle, WorldSpec


def _only_numbers(value: Any) -> Any:
    """Refuse what Python would take for a number: true is no 1, and text is text. Minus zero becomes zero."""
    if isinstance(value, bool | str | bytes):
        raise ValueError(f"must be a number, not {value!r}" if not isinstance(value, bool) else "must be a number")
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError("must be a finite number")
    return value + 0.0 if isinstance(value, float) else value


NUMBER: Final = BeforeValidator(_only_numbers)
Fraction = Annotated[float, Field(ge=0.0, le=1.0), NUMBER]
Size = Annotated[float, Field(ge=1e-3, le=100.0), NUMBER]
"""Of a body."""
Side = Annotated[float, Field(ge=1e-3, le=100.0), NUMBER]
"""Of a cell."""
Reach = Annotated[float, Field(ge=0.0, le=1000.0), NUMBER]
"""Of a sensor, or of what is kept free."""
Pace = Annotated[float, Field(ge=1e-3, le=1000.0), NUMBER]
"""Speeds, turn rates."""
Angle = Annotated[float, Field(ge=0.0, le=45.0), NUMBER]
Rate = Annotated[float, Field(ge=0.0, le=3600.0), NUMBER]
Metres = Annotated[float, Field(ge=-LONGEST_M, le=LONGEST_M), NUMBER]
Heading = Annotated[float, Field(ge=-1000.0, le=1000.0), NUMBER]
Duration = Annotated[float, Field(ge=0.0, le=86400.0), NUMBER]

BODY: Final = Body()
LIDAR: Final = Lidar()
NOISE: Final = Noise()
RADIO: Final = Radio()
FAULTS: Final = Faults()
GUARDING: Final = Guarding()
SAFETY: Final = Safety()
SHARING: Final = Sharing()
"""What robots run on when nobody says otherwise."""


class _Strict(BaseModel):
    """No unknown keys, nothing changed after loading."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class RobotModel(_Strict):
    """The robots' data sheet; a list of them, one for each robot, when they differ."""

    radius_m: Size = BODY.radius_m
    """Radius of the circle round the body [m]."""
    half_width_m: Size = BODY.half_width_m
    """Half of the body's width across its direction of travel, r_0 [m]."""
    footprint: Annotated[list[tuple[Metres, Metres]], Field(min_length=3, max_length=1000)] | None = None
    """Instead of both: corners of the body round the place that it turns about, x forward, y left [m]."""
    v_max_mps: Pace = BODY.v_max_mps
    """Highest speed [m/s]."""
    a_max_mps2: Annotated[float, Field(ge=1e-3, le=1e6), NUMBER] = BODY.a_max_mps2
    """Largest acceleration, also when braking [m/s²]."""
    w_max_radps: Pace = BODY.w_max_radps
    """Highest turn rate [rad/s]."""
    sensor_delay_s: Annotated[float, Field(ge=0.0, le=60.0), NUMBER] = BODY.sensor_delay_s
    """From a return to the command that heeds it, t_d: it makes the safety margin r wider [s]."""

    @model_validator(mode="before")
    @classmethod
    def _measure_footprint(cls, values: Any) -> Any:
        """Take radius and half width from the footprint."""
        return values | _size_of(values) if isinstance(values, dict) and values.get("footprint") else values


class RobotOfMany(RobotModel):
    """The data sheet of one robot among others."""

    start_s: Duration = 0.0
    """When it is switched on; until then it stands at its start and is silent [s]."""


def _size_of(values: dict[str, Any]) -> dict[str, float]:
    """Return radius and half width of the body whose ``footprint`` is given."""
    try:
        points = [(float(x), float(y)) for x, y in values["footprint"]]
    except (TypeError, ValueError, OverflowError):
        return {}  # which will be said of the footprint itself
    size = {"radius_m": max(math.hypot(x, y) for x, y in points), "half_width_m": max(abs(y) for _, y in points)}
    for name, value in size.items():
        given = values.get(name, value)
        if isinstance(given, int | float) and abs(given - value) > 1e-9:
            raise ValueError(f"the footprint makes {name} {value:.4g}, not {given:g}: leave it out")
    return size


def _kind_of_robots(value: Any) -> str:
    """Tell whether robots are alike or each has its own data sheet."""
    return "each" if isinstance(value, list) else "alike"


Robots = Annotated[
    Annotated[RobotModel, Tag("alike")] | Annotated[list[RobotOfMany], Tag("each"), Field(min_length=1)],
    Discriminator(_kind_of_robots),
]


class LidarModel(_Strict):
    """The LiDAR."""

    beams: Annotated[int, Field(ge=8, le=4096), NUMBER] = LIDAR.beams
    """Beams of a scan."""
    fov_deg: Annotated[float, Field(ge=LEAST_VIEW_DEG, le=360.0), NUMBER] = LIDAR.fov_deg
    """Field of view, in the middle of which is straight ahead [°]."""
    range_m: Annotated[float, Field(ge=0.01, le=1000.0), NUMBER] = LIDAR.range_m
    """Longest range; beyond it there is no return [m]."""
    range_min_m: Reach = LIDAR.range_min_m
    """Shortest range; a nearer return is invalid and counts as blocked [m]."""
    rate_hz: Annotated[float, Field(ge=0.01, le=100.0), NUMBER] = 1.0 / Setting.dt
    """Scans per second; a robot decides once for each scan [Hz]."""


class NoiseModel(_Strict):
    """Sensor errors, standard deviations where nothing else is said; 0 is none."""

    range_fraction: Annotated[float, Field(ge=0.0, le=0.3), NUMBER] = NOISE.range_fraction
    """Error of a LiDAR range, and of the distance to a neighbour, as a fraction of it."""
    dropout: Fraction = NOISE.dropout
    """Share of LiDAR returns that are lost."""
    bearing_deg: Angle = math.degrees(NOISE.bearing_rad)
    """Error of the bearing of a neighbour [°]."""
    compass_deg: Angle = math.degrees(NOISE.compass_rad)
    """Error of a robot's compass, drawn anew for every scan [°]."""
    compass_bias_deg: Angle = math.degrees(NOISE.compass_bias_rad)
    """Error of a robot's compass that stays the same for the whole run, beside the one drawn for every scan [°]."""
    odometry_scale: Annotated[float, Field(ge=0.0, le=0.1), NUMBER] = NOISE.odometry_scale
    """Error of the size of a robot's wheels, the same for the whole run: of its speed and of all motion as it measures
    them, as a fraction; it drives as it wants to."""
    odometry_drift_m: Annotated[float, Field(ge=0.0, le=1.0), NUMBER] = NOISE.odometry_drift_m
    """Error of the place by odometry after 1 m, along and across, a random walk that grows with the root of the way
    [m/√m]."""
    odometry_turn_deg: Angle = math.degrees(NOISE.odometry_turn_rad)
    """Error of the heading by odometry, in the same way; it steadies the compass [°/√m]."""
    nan: Fraction = NOISE.nan
    """Share of LiDAR readings that are broken (NaN), drawn anew for every scan."""
    stuck: Fraction = NOISE.stuck
    """Share of a robot's beams that say the longest range for the whole run, whatever is there."""
    blind_deg: Annotated[float, Field(ge=0.0, le=360.0), NUMBER] = math.degrees(NOISE.blind_rad)
    """Width of the sector in which a robot's LiDAR finds nothing for the whole run; it lies anywhere in its field of
    view [°]."""
    scan_age_s: Annotated[float, Field(ge=0.0, le=1.0), NUMBER] = NOISE.scan_age_s
    """Age of the oldest scan that a robot decides on: each is by a random time below this older than the decision, with
    all that moved and turned since; the guard counts on the oldest [s]."""


class FaultsModel(_Strict):
    """What fails in the middle of a run, at random times; a rate is for each robot, 0 is never."""

    restarts_per_h: Rate = FAULTS.restarts_per_h
    """How often a robot restarts: it brakes and stands, without radio, then runs again with an empty memory, a clock at
    0 and a new boot number [1/h]."""
    restart_s: Duration = FAULTS.restart_s
    """How long it is switched off, braking included [s]."""
    silences_per_h: Rate = FAULTS.silences_per_h
    """How often a robot's radio falls silent: it neither sends nor hears [1/h]."""
    silence_s: Duration = FAULTS.silence_s
    """How long a radio is silent [s]."""
    clock_jumps_per_h: Rate = FAULTS.clock_jumps_per_h
    """How often a robot's own clock jumps, to and fro alike often [1/h]."""
    clock_jump_s: Duration = FAULTS.clock_jump_s
    """How far it jumps; robots take out what cannot be time that has passed [s]."""


class RadioModel(_Strict):
    """The link between robots."""

    range_m: Annotated[float, Field(ge=0.0, le=1e6), NUMBER] = RADIO.range_m
    """Packets to robots farther away are sent in vain [m]."""
    latency_s: Duration = RADIO.latency_s
    """From the end of the sending to the delivery [s]."""
    loss: Fraction = RADIO.loss
    """Share of packets that are lost by chance."""
    bitrate_bps: Annotated[float, Field(ge=1.0, le=1e12), NUMBER] = RADIO.bitrate_bps
    """Bandwidth of a robot's radio: a packet occupies sender and receiver for its bits over this [bit/s]."""
    exact_features: bool = SHARING.exact_features
    """Send features as float32 instead of bytes (to measure what quantisation costs)."""


class GuardModel(_Strict):
    """Distances kept free around the body; ``guard: false`` is ``guard: {enabled: false}``."""

    enabled: bool = GUARDING.enabled
    """Whether there is a guard. Without one, for studies only, what a planner decides is driven as it is, and a contact
    ends a robot; a robot on wheels always has one."""
    clearance_m: Reach = GUARDING.clearance_m
    """Kept free around the body by the guard, which slows down or stops [m]."""
    footprint_clearance_m: Reach = GUARDING.footprint_clearance_m
    """Added to the radius where ways are planned: directions that the widened body can take are safe [m]."""
    persistence_s: Duration = GUARDING.persistence_s
    """How long a neighbour that is out of sight is remembered [s]."""
    lost_s: Duration = GUARDING.lost_s
    """How long a return is kept that is lost while no beam has passed its place, three scans at least; 0: not at all
    [s]."""
    blind_s: Duration = GUARDING.blind_s
    """A robot brakes when its LiDAR has said nothing for so long, where something was [s]."""
    thinnest_m: Reach = GUARDING.thinnest_m
    """Width of the narrowest thing that must not be missed between two beams: robots drive no faster than they can stop
    short of it; 0 asks for nothing [m]."""
    others_mps: Annotated[float, Field(ge=-1.0, le=1000.0), NUMBER] = GUARDING.others_mps
    """How fast others may be; below 0: as fast as these robots, 0: nothing else moves [m/s]."""
    others_yield: bool = GUARDING.others_yield
    """Whether others run the same guard; before those that do not, a robot stands before they can reach it."""
    others_smallest_m: Annotated[float, Field(ge=-1.0, le=1000.0), NUMBER] = GUARDING.others_smallest_m
    """Radius of the smallest other robot; 0 and below: of the smallest there is [m]."""
    others_largest_m: Annotated[float, Field(ge=-1.0, le=1000.0), NUMBER] = GUARDING.others_largest_m
    """Radius of the largest other robot; 0 and below: of the largest there is [m]."""
    strangers_mps: Annotated[float, Field(ge=-1.0, le=1000.0), NUMBER] = GUARDING.strangers_mps
    """How fast those are that are no robots and do not yield, people: a robot stands before they can reach it; below 0:
    as fast as the fastest disc that moves in this world, 0: there are none [m/s]."""
    strangers_m: Annotated[float, Field(ge=-1.0, le=1000.0), NUMBER] = GUARDING.strangers_m
    """Radius of the smallest of them; 0 and below: of the smallest disc that moves here, 0.2 m without one [m]."""
    first_scans: Annotated[int, Field(ge=-1, le=MOST_FIRST_SCANS), NUMBER] = GUARDING.first_scans
    """A robot takes so many scans, and turns a little between them, before it sets off; below 0: three where
    ``noise.dropout`` or ``noise.stuck`` is above 0, else one."""


def _switched(value: Any) -> Any:
    """Read true and false as a guard that is enabled or not."""
    return {"enabled": value} if isinstance(value, bool) else value


class SafetyModel(_Strict):
    """Which directions are safe (theory.md); ``sector: true, look_ahead_m: 0`` is the printed rule."""

    sector: bool = SAFETY.sector
    """Demand a free sector as wide as the scope angle within the planning distance l_th, as printed (3)."""
    look_ahead_m: Reach = SAFETY.look_ahead_m
    """How far ahead a direction must be free; 0 leaves it at l_th [m]."""
    margin_m: Reach = SAFETY.margin_m
    """Kept on both sides of the body within ``look_ahead_m`` [m]."""
    narrow_m: Reach = SAFETY.narrow_m
    """How far ahead a gap must be free that the body just fits, when no direction is safe; 0 is r [m]."""
    slow_mps: Reach = SAFETY.slow_mps
    """At lower speeds margins (18), (2) are those of this speed [m/s]."""
    speed_step_mps: Reach = SAFETY.speed_step_mps
    """Above it they follow the present speed in steps of this; 0: those of the top speed, as printed [m/s]."""


class FeaturesModel(_Strict):
    """Features (7): the extrema of the filtered scan that neighbours are told."""

    mask: Literal["planner", "none", "maxima", "all"] = "planner"
    """Which of them count only in safe directions: ``maxima`` (a narrow gap is no way), ``none``, or ``all``, with the
    obstacles that force a decision; ``planner``: as its document has it, ``none`` for SFM-MAS, else ``maxima``."""
    filter: Literal["lobe", "printed"] = "lobe"
    """Filter (6): ``lobe`` has T_c + 1 taps, the main lobe of the sinc, ``printed`` as many as a scan has beams."""


class TaskModel(_Strict):
    """A task by name, with its options."""

    name: str
    """Name of the task (``swarmscope tasks``)."""
    options: dict[str, float | str] = {}
    """Options of the task by name; those not given have their defaults."""


MapPlace = tuple[Metres, Metres] | tuple[Metres, Metres, Heading] | None


class MapModel(_Strict):
    """A map, solid beyond its picture; starts and goals that are not given are drawn from its free space."""

    file: str
    """The map (looked for beside the scenario, too): map_server's YAML, a picture alone, a Moving AI .map, a .npz of
    ORION's mazes, a .world of Gazebo with cylinders and boxes (DynaBARN's move), or the name of a packaged map."""
    resolution_m: Side | None = None
    """Side of a cell, for files that do not say it: all but map_server's YAML [m]."""
    number: Annotated[int, Field(ge=0, lt=2**31), NUMBER] | None = None
    """Which of ORION's mazes; its starts and goals are the robots' unless others are given."""
    starts: list[MapPlace] = []
    """Where robots start, in the map's coordinates: x, y or x, y, yaw [m, m, rad]; without yaw they look at their goal.
    What is null, or missing at the end, is drawn."""
    goals: list[MapPlace] = []
    """Where robots want to go, in the same way: x, y or x, y, yaw, to which they turn there [m, m, rad]."""
    obstacles: list[Obstacle] = []
    """What stands or moves there besides; each names its ``type``, none is a grid."""
    trips: str | None = None
    """A Moving AI .scen file (looked for beside the scenario, too): starts and goals of its trips."""
    first_trip: Annotated[int, Field(ge=0, lt=2**31), NUMBER] = 0
    """Number of robot 0's trip, 0 is the first; the others have the next ones."""
    min_distance_m: Annotated[float, Field(ge=0.0, le=LONGEST_M), NUMBER] | None = None
    """From a start to its goal, where one of them is drawn, at least; null is 8 m, in maps whose free space is shorter
    than 20 m two fifths of that [m]."""


class WorldModel(_Strict):
    """A world written out: obstacles, starts and goals."""

    world: WorldSpec
    """Bounds and obstacles."""
    starts: list[tuple[Metres, Metres, Heading]]
    """Where each robot starts: x, y, yaw [m, m, rad]."""
    goals: list[tuple[Metres, Metres] | tuple[Metres, Metres, Heading]]
    """Where each robot wants to go, with a yaw to which it turns there or without: x, y or x, y, yaw [m, m, rad]."""


class PlannerModel(_Strict):
    """A planner by name, with its parameters."""

    name: str = "nav-scope"
    """Name of the planner (``swarmscope planners``)."""
    model: str | None = None
    """Folder of the network that it runs instead of its own; only for planners with a network."""
    preset: str | None = None
    """Keys of all groups that hold where nothing else is said: ``printed``, the planner as its document prints it
    (``swarmscope planners NAME`` lists them)."""
    params: dict[str, Annotated[float, Field(allow_inf_nan=False), NUMBER]] = {}
    """Parameters of the planner by name; those not given have their defaults."""


class Scenario(_Strict):
    """One run, complete: exactly one of ``task``, ``map``, ``place``."""

    task: TaskModel | None = None
    """World, starts and goals made from the seed."""
    map: MapModel | None = None
    """Instead of ``task``: a building."""
    place: WorldModel | None = None
    """Instead of ``task``: a world written out."""
    planner: PlannerModel = PlannerModel()
    """Who decides."""
    robots: Annotated[int, Field(ge=1, le=200_000), NUMBER] = 15
    """Number of robots."""
    seed: Annotated[int, Field(ge=0, lt=2**31), NUMBER] = Setting.seed
    """Seed of the world, of all noise and of what planners toss for."""
    robot: Robots = RobotModel()
    """The robots' data sheet; a list of them, one for each robot, when they differ, with ``start_s`` besides."""
    lidar: LidarModel = LidarModel()
    """The LiDAR."""
    noise: NoiseModel = NoiseModel()
    """Sensor errors, standard deviations where nothing else is said; 0 is none."""
    radio: RadioModel = RadioModel()
    """The link between robots."""
    faults: FaultsModel = FaultsModel()
    """What fails in the middle of a run, at random times; a rate is for each robot, 0 is never."""
    guard: Annotated[GuardModel, BeforeValidator(_switched)] = GuardModel()
    """Distances kept free around the body; ``false``, for studies only: no guard."""
    safety: SafetyModel = SafetyModel()
    """Which directions are safe."""
    features: FeaturesModel = FeaturesModel()
    """What neighbours are told of a scan."""
    limit_s: Annotated[float, Field(ge=1e-3, le=1e6), NUMBER] = Setting.limit_s
    """Simulated time after which the run ends; it ends earlier when all have arrived or collided [s]."""
    substeps: Annotated[int, Field(ge=1, le=1000), NUMBER] = Setting.substeps
    """Steps of motion and contact between two scans; more are taken where these leave the arc driven by 0.1 mm."""
    record_scans: Literal["auto", "yes", "no"] = "auto"
    """Keep scans for the replay page; ``auto`` leaves them out where they would be huge."""
    judge_sides: bool = False
    """Note the side of the shortest way beside every choice of a side; planners with ``told`` set take it."""

    @model_validator(mode="before")
    @classmethod
    def _count_robots(cls, values: Any) -> Any:
        """As many robots as have a start or a goal, or a data sheet, if nobody says how many."""
        if not isinstance(values, dict) or "robots" in values:
            return values
        chosen = values.get("map") or values.get("place")
        place: dict[str, Any] = chosen if isinstance(chosen, dict) else {}
        listed = [place[key] for key in ("starts", "goals") if isinstance(place.get(key), list)]
        listed += [values["robot"]] if isinstance(values.get("robot"), list) else []
        count = max(map(len, listed), default=0)
        return values | {"robots": count} if count > 0 else values

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if sum(p is not None for p in (self.task, self.map, self.place)) != 1:
            raise ValueError("give exactly one of 'task', 'map' and 'place'")
        if isinstance(self.robot, list) and len(self.robot) != self.robots:
            raise ValueError(f"{len(self.robot)} data sheets in 'robot' for {self.robots} 'robots': leave 'robots' out")
        return self

    @property
    def sheets(self) -> list[RobotModel]:
        """The data sheet of each robot."""
        return [*self.robot] if isinstance(self.robot, list) else [self.robot] * self.robots

    @property
    def widest(self) -> RobotModel:
        """The data sheet of the largest robot."""
        return max(self.sheets, key=lambda sheet: sheet.radius_m) if isinstance(self.robot, list) else self.robot

    @property
    def radii_m(self) -> float | list[float]:
        """The robots' radius, or that of each where they have data sheets of their own [m]."""
        return [sheet.radius_m for sheet in self.robot] if isinstance(self.robot, list) else self.robot.radius_m
