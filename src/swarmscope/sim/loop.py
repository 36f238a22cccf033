"""The run: sense, decide, exchange, move, judge, each over all robots from one snapshot, until all have arrived."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.held import Held
from swarmscope.onboard.planners import Planner
from swarmscope.onboard.reasons import CRASHED, R_COLLIDED
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.view import Swarm, arrays_of
from swarmscope.sim.advice import Advice, tell_sides
from swarmscope.sim.beams import Beams
from swarmscope.sim.cells import index_robots
from swarmscope.sim.faults import blanks, forget, strike
from swarmscope.sim.motion import judge, move
from swarmscope.sim.moving import STANDSTILL, Moving, write_places
from swarmscope.sim.radio import exchange
from swarmscope.sim.sensing import sense
from swarmscope.sim.state import (
    CHOICES,
    Clock,
    Conditions,
    Faults,
    Noise,
    Radio,
    Records,
    Sim,
    Start,
    new_records,
    new_sim,
)
from swarmscope.sim.world import World

CHUNK = 256
"""Ticks for which records are allocated at once."""
PLAN_SAMPLES = 200
"""Planning steps that are timed one by one for the percentiles."""


@dataclass(frozen=True)
class Setting:
    """A run, ready for the kernels."""

    world: World
    bounds: tuple[float, float, float, float]
    starts: np.ndarray
    goals: np.ndarray
    beams: Beams
    rig: Rig
    """Of all robots, or of the first where they differ."""
    planner: Planner
    params: Any
    noise: Noise = field(default_factory=Noise)
    radio: Radio = field(default_factory=Radio)
    faults: Faults = field(default_factory=Faults)
    seed: int = 0
    dt: float = 0.2
    substeps: int = 20
    limit_s: float = 300.0
    threads: int = 1
    record_scans: bool = False
    advice: Advice | None = None
    """Costs to go, for planners that are told the side of the shortest way, and for judging those that are not."""
    goal_yaws: np.ndarray | None = None
    """(N,): headings wanted at the goals [rad], NaN where any will do."""
    moving: Moving = STANDSTILL
    rigs: tuple[Rig, ...] = ()
    """One for each robot where they differ, the same object for those that are alike."""
    start_s: tuple[float, ...] = ()
    """When each robot is switched on; nothing: at once."""


@dataclass(frozen=True)
class Trace:
    """What happened: records ``(T, N)``, robots at the end, deliveries, times."""

    t_s: np.ndarray
    records: Records
    robots: np.ndarray
    shared: np.ndarray
    links: np.ndarray
    discs: np.ndarray
    """(T, D, 2) where discs on their ways were [m]."""
    doors: np.ndarray
    """(T, K) 1 where a door was closed."""
    choices: np.ndarray
    """Every choice of a side, a row of ``CHOICE`` each."""
    plan_us: np.ndarray
    """Time of single planning steps [us], sampled over the run; measured, so not part of the deterministic bytes."""
    wall_s: float
    """Time of the run but for its first tick, which loads the kernels [s]."""
    memory_bytes: int
    """Planner memory of one robot, everything that its kernels read and write but the packets' way in and out."""


@jit
def record_tick(sim: Sim, safe: np.ndarray, records: Records, row: int, with_scans: bool, tick: int) -> None:
    """Write tick ``tick`` into row ``row`` of the records."""
    beams = sim.ranges.shape[1]
    _log_choices(sim, tick)
    for i in range(sim.robots.size):
        robot, decision = sim.robots[i], sim.decisions[i]
        records.x[row, i], records.y[row, i], records.yaw[row, i] = robot["x"], robot["y"], robot["yaw"]
        records.speed[row, i] = robot["v"]
        records.clearance[row, i] = robot["clearance"]
        records.p_left[row, i] = decision["p_left"]
        records.state[row, i] = CRASHED if robot["crashed"] else decision["state"]
        records.reason[row, i] = R_COLLIDED if robot["crashed"] else decision["reason"]
        records.side[row, i] = decision["side"]
        records.neighbours[row, i] = sim.percepts[i]["n_neighbours"]
        records.bytes_sent[row, i] = robot["bytes"]
        if with_scans:
            for n in range(beams):
                s = sim.ranges[i, n]
                level = 255 if not s <= sim.beams.range_max else int(254.0 * s / sim.beams.range_max + 0.5)
                records.scan[row, i, n] = level
                if safe[i, sim.first_beam + n]:
                    records.safe[row, i, n >> 3] |= np.uint8(128 >> (n & 7))


@jit_inner
def _log_choices(sim: Sim, tick: int) -> None:
    """Keep the choices of a side made in this tick."""
    for i in range(sim.robots.size):
        robot, decision = sim.robots[i], sim.decisions[i]
        at = sim.choices_n[0]
        if not decision["fused"] or robot["crashed"] or at >= CHOICES:
            continue
        choice = sim.choices[at]
        sim.choices_n[0] = at + 1
        choice["tick"], choice["robot"] = tick, i
        choice["x"], choice["y"] = robot["x"], robot["y"]
        choice["target"] = math.atan2(robot["goal_y"] - robot["y"], robot["goal_x"] - robot["x"])
        choice["p_self"], choice["p_left"] = decision["p_self"], decision["p_left"]
        choice["side"] = decision["side"]
        choice["told_side"] = sim.told[i]
        choice["heard"] = decision["heard"]
        for k in range(decision["heard"]):
            choice["heard_id"][k], choice["heard_side"][k] = decision["heard_id"][k], decision["heard_side"][k]
            choice["heard_p"][k], choice["heard_f"][k] = decision["heard_p"][k], decision["heard_f"][k]


@jit
def world_phase(
    held: Held[Sim], safe: np.ndarray, records: Held[Records], row: int, with_scans: bool, tick: int
) -> bool:
    """Record tick ``tick``, then exchange, move, judge and sense the next; return whether everybody is done."""
    sim = held.what
    record_tick(sim, safe, records.what, row, with_scans, tick)
    exchange(sim, tick)
    move(sim, tick, 0, sim.robots.size)
    return settle(sim, tick) or _sense_next(sim, tick)


@jit
def settle(sim: Sim, tick: int) -> bool:
    """Judge the tick, sort the robots anew, draw what fails next; return whether everybody has arrived or crashed."""
    judge(sim, tick)
    index_robots(sim)
    strike(sim, tick + 1)
    done = 0
    for i in range(sim.robots.size):
        done += sim.robots[i]["arrived"] or sim.robots[i]["crashed"]
    return done == sim.robots.size


@jit_inner
def _sense_next(sim: Sim, tick: int) -> bool:
    """Sense tick ``tick + 1`` for all robots; always False."""
    sense(sim, tick + 1, 0, sim.robots.size)
    return False


Sensed = Callable[[Held[Sim], int], None]
"""``(held, tick)``, called when everybody has sensed and nobody has decided yet: deciding mends the scans in place."""
Between = Callable[[Held[Sim], int], bool]
"""``(held, tick)``, called when everybody has decided and nothing has been sent or driven yet; True: the last tick."""


def run(
    setting: Setting,
    progress: Callable[[float, int], None] | None = None,
    between: Between | None = None,
    sensed: Sensed | None = None,
) -> Trace:
    """Run to the end; ``progress(simulated seconds, robots done)`` is called every now and then.

    ``between`` looks at every tick, may throw packets at robots (`radio.throw_all`), and may end the run with it;
    ``sensed`` looks at every scan as it was measured.

    The result does not depend on ``threads``: every kernel writes only its own robots' rows, random numbers
    are keyed, and what robots do to each other (radio, contacts) happens in the order of the robots.
    """
    sim, swarm = begin(setting)
    n = len(setting.starts)
    memory = setting.planner.new_memory(n)
    late = max(setting.start_s, default=0.0) > 0.0
    forgotten = blanks(setting.planner, swarm, memory) if late or setting.faults.restarts_per_h > 0.0 else []
    held = Held(sim)
    step_all = _stepper(setting, swarm, memory)
    beams = sim.ranges.shape[1] if setting.record_scans else 0
    ticks = math.ceil(setting.limit_s / setting.dt - 1e-9)
    chunks: list[Held[Records]] = []
    pool = _Pool(n, setting.threads)
    plan_us: list[float] = []
    doors: list[np.ndarray] = []
    sample_every = max(1, ticks // PLAN_SAMPLES)
    index_robots(sim)
    step_all(0, 0)  # loads the kernels, so that no step's time contains that
    begun = time.perf_counter()
    pool.each(lambda a, b: sense(sim, 0, a, b))
    tick, done, last = 0, False, False
    while tick < ticks and not (done or last):
        row = tick % CHUNK
        if row == 0:
            chunks.append(Held(new_records(min(CHUNK, ticks - tick), n, beams)))
        doors.append(sim.moving.closed.copy())
        if sensed is not None:
            sensed(held, tick)
        _tell(setting, sim, memory)
        if tick % sample_every == 0:
            plan_us += _time_steps(step_all, n)
        else:
            pool.each(step_all)
        for rows, blank in forgotten:
            forget(sim.robots, tick, rows, blank)
        last = between is not None and between(held, tick)
        if pool.size == 1:
            done = world_phase(held, swarm.safe, chunks[-1], row, beams > 0, tick)
        else:
            record_tick(sim, swarm.safe, chunks[-1].what, row, beams > 0, tick)
            exchange(sim, tick)
            pool.each(partial(move, sim, tick))
            done = settle(sim, tick)
            if not done:
                pool.each(partial(sense, sim, tick + 1))
        tick += 1
        if tick == 1:
            begun = time.perf_counter()  # the first tick loads, or compiles, the kernels
        if progress is not None and tick % 50 == 0:
            progress(tick * setting.dt, int((sim.robots["arrived"] | sim.robots["crashed"]).sum()))
    pool.close()
    wall_s = time.perf_counter() - begun
    return Trace(
        t_s=np.arange(tick) * setting.dt,
        records=_join(chunks, tick),
        robots=sim.robots,
        shared=swarm.shared,
        links=sim.links[: sim.links_n[0]].copy(),
        discs=_ways(setting, tick),
        doors=np.array(doors, np.uint8).reshape(tick, -1),
        choices=sim.choices[: sim.choices_n[0]].copy(),
        plan_us=np.array(plan_us),
        wall_s=wall_s,
        memory_bytes=_row_bytes(swarm, memory),
    )


def begin(setting: Setting) -> tuple[Sim, Swarm]:
    """Return the simulation of a setting at its start, and the rows of its robots."""
    clock = Clock(int(setting.seed), float(setting.dt), int(setting.substeps))
    goals = setting.goals if setting.goal_yaws is None else np.column_stack([setting.goals, setting.goal_yaws])
    start = Start(setting.starts, goals, setting.bounds, setting.moving, setting.rigs, setting.start_s)
    conditions = Conditions(setting.noise, setting.radio, setting.faults)
    return new_sim(setting.world, setting.beams, setting.rig, start, conditions, clock)


def _stepper(setting: Setting, swarm: Swarm, memory: np.ndarray) -> Callable[[int, int], None]:
    """Return what runs one tick of robots ``first`` to ``last - 1``; those that are alike, side by side, in one go."""
    rigs = setting.rigs or (setting.rig,) * len(setting.starts)
    edges = [i for i in range(1, len(rigs)) if rigs[i] is not rigs[i - 1]]
    groups = [(a, b, Held(swarm._replace(rig=rigs[a]))) for a, b in pairwise([0, *edges, len(rigs)])]

    def step_all(first: int, last: int) -> None:
        for a, b, held in groups:
            begin, end = max(a, first), min(b, last)
            if begin < end or (begin == end == a == first):
                setting.planner.step_all(begin, end, held, memory, setting.params)

    return step_all


def _ways(setting: Setting, ticks: int) -> np.ndarray:
    """Return where the discs that move were at each tick (T, D, 2) [m]."""
    places = np.zeros((ticks if len(setting.moving.radius) else 0, len(setting.moving.radius), 2))
    for tick in range(len(places)):
        write_places(setting.moving, tick * setting.dt, places[tick])
    return places if len(places) else np.zeros((ticks, 0, 2))


def _tell(setting: Setting, sim: Sim, memory: np.ndarray) -> None:
    """Find the sides of the shortest ways, if that is wanted, and tell them planners that may look."""
    if setting.advice is None:
        return
    tell_sides(sim, setting.advice)
    if setting.planner.is_told:
        memory["told"] = sim.told


def _time_steps(step_all: Callable[[int, int], None], robots: int) -> list[float]:
    """Run one tick of all robots; return this thread's mean processor time for one robot's step [us]."""
    before = time.thread_time_ns()
    step_all(0, robots)
    return [(time.thread_time_ns() - before) / 1e3 / robots]


class _Pool:
    """Runs a kernel over chunks of robots, on this thread or on several."""

    def __init__(self, robots: int, threads: int) -> None:
        self.size = max(1, min(threads, robots))
        edges = np.linspace(0, robots, self.size + 1).astype(int)
        self._parts = [(int(a), int(b)) for a, b in pairwise(edges)]
        self._pool = ThreadPoolExecutor(self.size) if self.size > 1 else None

    def each(self, kernel: Callable[[int, int], None]) -> None:
        """Call ``kernel(first, last)`` for every chunk and wait for all."""
        if self._pool is None:
            kernel(*self._parts[0])
            return
        jobs = [self._pool.submit(kernel, a, b) for a, b in self._parts]
        wait(jobs)
        for job in jobs:
            job.result()

    def close(self) -> None:
        """Stop the threads."""
        if self._pool is not None:
            self._pool.shutdown()


def _join(chunks: list[Held[Records]], ticks: int) -> Records:
    """Return the chunks as one, cut to the ticks that were run."""
    return Records(*(np.concatenate(parts)[:ticks] for parts in zip(*(held.what for held in chunks), strict=True)))


def _row_bytes(swarm: Swarm, memory: np.ndarray) -> int:
    """Return the bytes of one robot's rows."""
    return int(sum(a[:1].nbytes for a in (*arrays_of(swarm), memory)))
