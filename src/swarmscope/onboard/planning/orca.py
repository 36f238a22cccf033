"""ORCA: optimal reciprocal collision avoidance by the library navground (RVO2 inside), a baseline.

Each tick: the scan becomes line segments, the tracks become moving discs, the library finds the velocity nearest to
the preferred one that avoids all of them for a time horizon (van den Berg et al. 2011), and the wheels follow it.
The preferred velocity points at the goal. ORCA alone stops wherever that leads into a dead end, for ever; therefore,
as its users do, a planner above it leads a robot that makes no progress along the border (``deadlock = 0``: plain
ORCA). Nothing is sent: the robots only see each other.

All that the library is given is in the *goal frame*: origin at the robot, x towards the goal.
"""

from __future__ import annotations

import math
import threading
from typing import Any, NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.bounds import Metres, Radians, Seconds, Share
from swarmscope.errors import MissingExtraError
from swarmscope.onboard.control.wanting import head_for
from swarmscope.onboard.deciding.preference import Preferring, prefer
from swarmscope.onboard.percept import PEERS, Row
from swarmscope.onboard.perception.segments import MAX_LINES, write_segments
from swarmscope.onboard.reasons import ADVANCE, R_BLOCKED_WAIT, YIELD
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.sharing.tracks import moves
from swarmscope.onboard.view import Swarm, View, view_of

NAME = "orca"
SUMMARY = "ORCA by the library navground (extra 'orca'), with a rule against dead ends; a baseline"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours"


class Params(NamedTuple):
    """What can be set. Distances in m, times in s."""

    horizon_s: Seconds = 3.0
    """Collisions with robots are avoided this far ahead."""
    obstacle_horizon_s: Seconds = 1.5
    """The same for obstacles."""
    margin: Metres = 0.035
    """Kept free around the body, what the wheels cannot follow exactly included."""
    creep: Share = 0.2
    """Slower than this share of the preferred speed nobody drives at an obstacle between it and its goal."""
    deadlock: Share = 1.0
    """1: without progress follow the border; 0: plain ORCA."""
    stall_s: Seconds = 2.0
    """No progress for so long is a dead end."""
    progress: Share = 0.3
    """Progress is to get closer to the goal than ever at this share of the top speed, or faster."""
    turn_back: Radians = 2.5
    """A following turns back towards the target by at most this in one tick [rad]."""
    evade: Radians = 1.0
    """Turn to the right [rad] of the preferred velocity in a jam of robots, for ``stall_s``."""
    loop_s: Seconds = 30.0
    """A following that lasts longer changes its side; the time doubles with every change."""
    arrive_m: Metres = 0.05
    """Distance to the goal at which a robot has arrived."""
    still_s: Seconds = 1.0
    """A neighbour that has not moved for so long is an obstacle."""


MEMORY = np.dtype(
    [
        ("arrived", np.uint8),
        ("free", np.uint8),  # the straight way to the goal is, as far as we look ahead
        ("side", np.int8),  # of the border that is followed: +1 left, -1 right, 0 none
        ("strict", np.uint8),  # the following ends only where the way leads closer to the goal than ever
        ("last_side", np.int8),  # side of the last following without progress since
        ("best", np.float64),  # smallest goal distance so far [m]
        ("best_s", np.float64),  # when the last progress, following or evading ended
        ("closest", np.float64),  # goal distance of the nearest point seen free on the way, where followings began [m]
        ("wind", np.float64),  # how far the following has turned off the target; may exceed 2 pi [rad]
        ("target", np.float64),  # direction of the target at the last tick, compass frame [rad]
        ("turn_s", np.float64),  # when the following changes its side
        ("loop_s", np.float64),  # after how long it does
        ("evade_s", np.float64),  # until when a jam is evaded
        ("lost", np.float64),  # direction that is taken where no direction is safe, compass frame [rad]
        ("lost_s", np.float64),  # until when
        ("speed", np.float64),  # preferred speed [m/s]
        ("turn", np.float64),  # direction of the preferred velocity, goal frame [rad]
        ("vx", np.float32),  # own velocity, goal frame [m/s]
        ("vy", np.float32),
        ("ux", np.float32),  # what the library answered, goal frame [m/s]
        ("uy", np.float32),
        ("lines_n", np.int32),  # -1: the library is not asked
        ("others_n", np.int32),
        ("lines", np.float32, (MAX_LINES, 2, 2)),  # both ends of each segment, goal frame [m]
        ("others", np.float32, (PEERS, 2, 2)),  # positions [m] and velocities [m/s] of neighbours, goal frame
        ("radii", np.float32, PEERS),  # theirs [m]
    ]
)

_local = threading.local()


def new_memory(robots: int) -> np.ndarray:
    """Return the memory of ``robots`` robots that have seen nothing yet."""
    memory = np.zeros(robots, MEMORY)
    memory["best"] = memory["closest"] = np.inf
    memory["evade_s"] = -1.0
    return memory


def decide_all(first: int, last: int, swarm: Swarm, memories: np.ndarray, params: Params) -> None:
    """Decide for robots ``first`` to ``last - 1``; raises MissingExtraError without the library."""
    library = _library()
    prepare_all(first, last, swarm, memories, params)
    _ask_library(library, memories[first:last], swarm.percepts[first:last], swarm.rig, params)
    command_all(first, last, swarm, memories, params)


def check_available() -> None:
    """Raise a MissingExtraError when the library is not installed."""
    _library()


def _library() -> Any:
    """Return this thread's (segment, neighbour, behaviour) of the library."""
    found = getattr(_local, "library", None)
    if found is None:
        try:
            from navground.core import LineSegment, Neighbor
            from navground.core.behaviors import ORCABehavior
        except ImportError:
            raise MissingExtraError(f"planner '{NAME}'", "orca") from None
        found = _local.library = (LineSegment, Neighbor, ORCABehavior())
    return found


def _ask_library(library: Any, memories: np.ndarray, percepts: np.ndarray, rig: Rig, params: Params) -> None:
    """Write the library's answer to every robot that has a preferred velocity into its memory."""
    segment, neighbour, orca = library
    orca.radius = rig.body.radius_m
    orca.safety_margin = params.margin
    orca.time_horizon = params.horizon_s
    orca.static_time_horizon = params.obstacle_horizon_s
    orca.horizon = 2.0 * params.horizon_s * rig.body.v_max_mps + 2.0
    state = orca.environment_state
    lines, others, radii = memories["lines"], memories["others"], memories["radii"].tolist()
    asked = memories["lines_n"].tolist()
    others_n = memories["others_n"].tolist()
    own = np.stack([memories["vx"], memories["vy"]], axis=1)
    speed, turn = memories["speed"], memories["turn"]
    wanted = np.stack([speed * np.cos(turn), speed * np.sin(turn)], axis=1).astype(np.float32)
    dt = percepts["dt_s"].tolist()
    for i, n in enumerate(asked):
        if n < 0:
            continue
        ends, seen = lines[i], others[i]
        state.line_obstacles = [segment(a, b) for a, b in zip(ends[:n, 0], ends[:n, 1], strict=True)]
        m = others_n[i]
        state.neighbors = [neighbour(seen[k, 0], radii[i][k], seen[k, 1]) for k in range(m)]
        orca.velocity = own[i]
        x, y = orca.desired_velocity_towards_velocity(wanted[i], dt[i]).tolist()
        memories["ux"][i], memories["uy"][i] = x, y


@jit
def prepare_all(first: int, last: int, swarm: Swarm, memories: np.ndarray, params: Params) -> None:
    """Write what the library needs into the memory of robots ``first`` to ``last - 1``."""
    for i in range(first, last):
        _prepare(view_of(swarm, i), memories[i], params)


@jit
def command_all(first: int, last: int, swarm: Swarm, memories: np.ndarray, params: Params) -> None:
    """Turn the library's answers into commands."""
    for i in range(first, last):
        if memories[i]["lines_n"] >= 0:
            _command(view_of(swarm, i), memories[i], params.creep)


@jit_inner
def _prepare(see: View, memory: Row, params: Params) -> None:
    """Choose the preferred velocity; write it with own velocity, neighbours and obstacles, all in the goal frame."""
    prefer(see, memory, _preferring(params))
    if memory["lines_n"] < 0:
        return
    bearing, speed = see.percept["goal_bearing"], see.percept["speed"]
    memory["vx"], memory["vy"] = math.cos(bearing) * speed, -math.sin(bearing) * speed
    _neighbours(see, memory, params.still_s)
    body = see.rig.body
    reach = body.v_max_mps * params.obstacle_horizon_s + body.radius_m + params.margin
    write_segments(see, memory, reach, 2.0 * (body.radius_m + params.margin))


@jit_inline
def _preferring(params: Params) -> Preferring:
    """Return how the preferred velocity is chosen."""
    return Preferring(
        params.margin, params.deadlock, params.stall_s, params.progress,
        params.turn_back, params.evade, params.loop_s, params.arrive_m,
    )  # fmt: skip


@jit_inner
def _neighbours(see: View, memory: Row, still_s: float) -> None:
    """Write the neighbours that move; those that stand are in the scan, as obstacles."""
    shared, rig = see.shared, see.rig
    turn = see.percept["compass"] + see.percept["goal_bearing"]
    c, s = math.cos(turn), math.sin(turn)
    count = 0
    for t in range(PEERS):
        if not moves(see.percept, shared, t, still_s):
            continue
        x, y = shared["track_x"][t], shared["track_y"][t]
        memory["others"][count, 0, 0], memory["others"][count, 0, 1] = c * x + s * y, c * y - s * x
        memory["radii"][count] = shared["track_radius"][t] + rig.sensor.position_sigma * math.sqrt(x * x + y * y)
        x, y = shared["track_vx"][t], shared["track_vy"][t]
        memory["others"][count, 1, 0], memory["others"][count, 1, 1] = c * x + s * y, c * y - s * x
        count += 1
    memory["others_n"] = count


@jit_inner
def _command(see: View, memory: Row, creep: float) -> None:
    """Ask for the velocity that the library answered, as far as the wheels can."""
    bearing = see.percept["goal_bearing"]
    c, s = math.cos(bearing), math.sin(bearing)
    x, y = c * memory["ux"] - s * memory["uy"], s * memory["ux"] + c * memory["uy"]
    speed = min(see.rig.body.v_max_mps, math.sqrt(x * x + y * y))
    heading = math.atan2(y, x) if speed > 1e-6 else 0.0
    if not speed >= creep * memory["speed"] and memory["free"] == 0 and memory["side"] == 0:
        speed = 0.0
        if see.out["state"] == ADVANCE:
            see.out["state"], see.out["reason"] = YIELD, R_BLOCKED_WAIT
    head_for(see, heading, speed)
