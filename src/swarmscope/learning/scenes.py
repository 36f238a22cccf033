"""Scenes that expert data is taken from: maps A, B, C, tasks I and II, robots placed at random or met while driving.

*placed* (4.4.1): robots stand at random in the free space, face their goals, and count when an obstacle is in the safe
area ahead. Task I: starts and goals anywhere, at least 7 m apart. Task II: a column somewhere between the left side and
the middle, each robot up to ``RAGGED_M`` ahead or behind; goals on the right side, opposite.

*driven*: DH-Bug, but for its ``long_gaps`` set as planner ``giwt`` is, drives the robots of tasks GIWT_1 (everybody
moves) and GIWT_2; each of its key points counts. The document calls that too slow; here a run takes a fraction of a
second, and the data is of what happens in use.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field, fields, replace
from functools import lru_cache
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.held import Held
from swarmscope.judging.sides import judged_by
from swarmscope.learning.labels import LABELLED, OUTCOMES, Label, label
from swarmscope.learning.views import look
from swarmscope.onboard.network.answering import look as look_round
from swarmscope.onboard.network.graph import GRID_M
from swarmscope.onboard.planners import Planner, load_planner
from swarmscope.onboard.planning import dh_bug
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.view import Swarm
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.scenario import Scenario
from swarmscope.scenarios.to_kernels import make_rig_of, make_setting
from swarmscope.sim.beams import Beams, make_beams
from swarmscope.sim.loop import run
from swarmscope.sim.world import World, compile_world
from swarmscope.tasks import Setup
from swarmscope.tasks._giwt_maps import SIZE_M, MapOptions, draw_map
from swarmscope.tasks._occupancy import Raster, centres_of, rasterise
from swarmscope.tasks.giwt_1 import apart_from
from swarmscope.tasks.giwt_2 import EDGE_M

ROBOTS = 15
CASES = 4
"""Placements of the robots on one map."""
RAGGED_M = 1.0
COLUMN_M = (0.7, 11.0)
"""Where a column can be."""
LIMIT_S = 90.0
"""Length of a driven run."""
TRIES = 3000
RESOLUTION_M = 0.1
"""Of the grid that ways are searched on; 0.05 m gives the same side in 99.8 % of the cases, in six times the time."""

Floats = NDArray[np.float64]
Sampling = Literal["placed", "driven"]


class Node(NamedTuple):
    """One robot of a sample: its scan, and where it is for the one that decides."""

    codes: NDArray[np.uint8]
    """(M,) its scan."""
    target: float
    """The decider's target direction in this scan's frame [rad]."""
    x: float
    """Position in the decider's target frame [m]; the decider's own is (0, 0)."""
    y: float


class Sample(NamedTuple):
    """One decision: the decider first, then its neighbours, nearest first, and the expert's answer."""

    nodes: list[Node]
    label: Label
    goal_m: float
    """Distance to the goal."""
    place: tuple[float, float, float, float]
    """Robot and goal, world frame: x, y, x, y [m]; for looking at, never for learning from."""


class Counts(dict[str, int]):
    """How many robots had which outcome."""

    def __init__(self) -> None:
        super().__init__({"looked_at": 0, "clear_ahead": 0} | dict.fromkeys(OUTCOMES, 0))


@lru_cache(maxsize=1)
def robot() -> tuple[Scenario, Beams, Rig, float, float]:
    """Return the default scenario, its sensor and rig; what ways keep off obstacles, how far ahead is looked [m]."""
    scenario = parse_scenario({"task": {"name": "GIWT_2"}, "planner": {"name": "dh-bug"}, "limit_s": LIMIT_S}, "data")
    lidar, rig = scenario.lidar, make_rig_of(scenario)
    beams = make_beams(lidar.beams, math.radians(lidar.fov_deg), lidar.range_m)
    return scenario, beams, rig, *judged_by(scenario, rig)


def samples_of(kind: str, task: str, sampling: Sampling, seed: int, counts: Counts) -> Iterator[Sample]:
    """Yield the samples of map ``seed`` of ``kind`` A, B, C for ``task`` I, II, and count what was looked at."""
    of = "ABC".index(kind), ("I", "II").index(task), ("placed", "driven").index(sampling)
    rng = np.random.default_rng([seed, *of])
    options = MapOptions(obstacles=kind)  # type: ignore[arg-type]
    if sampling == "driven":
        yield from _driven(rng, options, task, counts)
        return
    world = compile_world(draw_map(rng, options, np.zeros((0, 2)), 0.0))
    _, _, _, keeps_off, _ = robot()
    raster = rasterise(world, keeps_off, (0.0, 0.0, SIZE_M, SIZE_M), RESOLUTION_M)
    free = np.argwhere(raster.blocked == 0)
    if not len(free):
        return
    for _ in range(CASES):
        places, goals = _anywhere(rng, raster, free) if task == "I" else _column(rng, raster)
        if len(places):
            yield from _placed(world, raster, places, goals, counts)


def _anywhere(rng: np.random.Generator, raster: Raster, free: NDArray[np.int64]) -> tuple[Floats, Floats]:
    """Return up to ROBOTS places (N, 2) and goals (N, 2) of task I, connected or not."""
    points = centres_of(raster, free[rng.integers(0, len(free), TRIES)])
    points += rng.uniform(-0.5, 0.5, points.shape) * raster.resolution
    places: list[Floats] = []
    for point in points[: TRIES // 10]:
        if len(places) < ROBOTS and (not places or apart_from(point[None], np.array(places))[0]):
            places.append(point)
    goals: list[Floats] = []
    for place in places:
        far = np.flatnonzero(np.hypot(*(points - place).T) >= MapOptions.apart_m)
        goals.append(points[rng.choice(far)] if len(far) else place)
    kept = [k for k in range(len(places)) if goals[k] is not places[k]]
    return np.array([places[k] for k in kept]), np.array([goals[k] for k in kept])


def _column(rng: np.random.Generator, raster: Raster) -> tuple[Floats, Floats]:
    """Return places (N, 2) in a ragged column and the goals (N, 2) opposite, without who would stand in something."""
    step = (SIZE_M - 2.0 * EDGE_M) / ROBOTS
    y = EDGE_M + (np.arange(ROBOTS) + rng.uniform(0.3, 0.7, ROBOTS)) * step
    x = rng.uniform(*COLUMN_M) + rng.uniform(-RAGGED_M, RAGGED_M, ROBOTS)
    places = np.column_stack([np.maximum(x, EDGE_M), y])
    goals = np.column_stack([np.full(ROBOTS, SIZE_M - EDGE_M), EDGE_M + (np.arange(ROBOTS) + 0.5) * step])
    cells = np.minimum((places / raster.resolution).astype(int), np.array(raster.blocked.shape)[::-1] - 1)
    free = raster.blocked[cells[:, 1], cells[:, 0]] == 0
    return places[free], goals[free]


def _placed(world: World, raster: Raster, places: Floats, goals: Floats, counts: Counts) -> Iterator[Sample]:
    """Yield the samples of robots that stand."""
    _, beams, rig, _, horizon = robot()
    views = look(world, places, goals, beams, rig)
    counts["looked_at"] += len(places)
    counts["clear_ahead"] += int((~views.blocked).sum())
    for i in np.flatnonzero(views.blocked):
        found = label(raster, places[i], goals[i], horizon)
        counts[OUTCOMES[found.outcome]] += 1
        if found.outcome != LABELLED:
            continue
        towards = goals[i] - places[i]
        target = math.atan2(towards[1], towards[0])
        near = np.flatnonzero(views.sees[i])
        near = near[np.argsort(np.hypot(*(places[near] - places[i]).T), kind="stable")]
        nodes = [Node(views.codes[i], target, 0.0, 0.0)]
        nodes += [Node(views.codes[j], target, *turned(places[j] - places[i], target)) for j in near]
        yield Sample(nodes, found, float(np.hypot(*towards)), (*places[i].tolist(), *goals[i].tolist()))


def turned(vector: Floats, target: float) -> tuple[float, float]:
    """Return a vector (2,) in a frame whose x axis points along ``target`` [rad]."""
    c, s = math.cos(target), math.sin(target)
    return float(c * vector[0] + s * vector[1]), float(c * vector[1] - s * vector[0])


def _driven(rng: np.random.Generator, options: MapOptions, task: str, counts: Counts) -> Iterator[Sample]:
    """Yield the key points of one run of DH-Bug."""
    scenario, _, _, keeps_off, horizon = robot()
    setup = _setup(rng, options, task)
    if setup is None:
        return
    recorder = _recorder()
    seed, turn = int(rng.integers(2**31)), int(rng.choice([dh_bug.TURN_RANDOM, dh_bug.TURN_NEAREST]))
    params = dh_bug.Params(turn=turn, seed=int(rng.integers(2**31)), long_gaps=1)
    setting = make_setting(scenario, setup)
    setting = replace(setting, planner=recorder, record_scans=False, seed=seed, params=params)
    trace = run(setting)
    raster = rasterise(compile_world(setup.world), keeps_off, (0.0, 0.0, SIZE_M, SIZE_M), RESOLUTION_M)
    for choice, nodes in zip(trace.choices, recorder.key_points, strict=True):
        counts["looked_at"] += 1
        place = np.array([choice["x"], choice["y"]])
        goal = setup.goals[choice["robot"]]
        found = label(raster, place, goal, horizon)
        counts[OUTCOMES[found.outcome]] += 1
        if found.outcome == LABELLED:
            yield Sample(nodes, found, float(np.hypot(*(goal - place))), (*place.tolist(), *goal.tolist()))


def _setup(rng: np.random.Generator, options: MapOptions, task: str) -> Setup | None:
    """Return a setup of a task that is played on the seeds kept for data."""
    from swarmscope.errors import UnsolvableWorldError
    from swarmscope.tasks import giwt_1, giwt_2

    seed = int(rng.integers(2**31, 2**62))  # beyond the seeds that a scenario can have
    try:
        if task == "I":
            return giwt_1.make(seed, ROBOTS, obstacles=options.obstacles, moves="all")
        return giwt_2.make(seed, ROBOTS, obstacles=options.obstacles)
    except UnsolvableWorldError:
        return None


@dataclass(frozen=True)
class Recorder(Planner):
    """DH-Bug as a planner that notes what is seen at its key points, in the order of the log of choices."""

    key_points: list[list[Node]] = field(default_factory=list)

    def step_all(self, first: int, last: int, held: Held[Swarm], memories: Any, params: Any) -> None:
        """Run one tick of robots ``first`` to ``last - 1``."""
        super().step_all(first, last, held, memories, params)
        swarm = held.what
        for i in np.flatnonzero(swarm.decisions["fused"][first:last]) + first:
            self.key_points.append(_nodes(swarm, int(i)))


def _recorder() -> Recorder:
    bug = load_planner("dh-bug")
    return Recorder(*(getattr(bug, item.name) for item in fields(bug)))


def _nodes(swarm: Swarm, i: int) -> list[Node]:
    own = swarm.percepts[i]
    target = float(own["goal_bearing"])
    nodes = [Node(_codes(swarm, i), target, 0.0, 0.0)]
    for k in range(own["n_neighbours"]):
        place = np.array([own["neighbour_x"][k], own["neighbour_y"][k]])
        if math.hypot(*place) <= GRID_M:
            codes = _codes(swarm, int(own["neighbour_id"][k]))
            nodes.append(Node(codes, target - float(own["neighbour_yaw"][k]), *turned(place, target)))
    return nodes


def _codes(swarm: Swarm, i: int) -> NDArray[np.uint8]:
    codes = np.zeros(swarm.rig.sensor.beams, np.uint8)
    look_round(i, swarm, codes)
    return codes
