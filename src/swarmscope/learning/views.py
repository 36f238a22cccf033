"""What robots see from given places: scans as codes, who sees whom, who has an obstacle ahead."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.network.graph import GRID_M
from swarmscope.onboard.network.local_map import encode_scan, hide_robot
from swarmscope.onboard.perception.safety import beam_of, safe_directions
from swarmscope.onboard.rig import PRINTED, Rig
from swarmscope.onboard.sensor import Sensor
from swarmscope.sim.beams import Beams
from swarmscope.sim.lidar import cast_disc, cast_static
from swarmscope.sim.sensing import SIGHT_SLACK
from swarmscope.sim.world import World

Floats = NDArray[np.float64]


class Views(NamedTuple):
    """What N robots that look east see."""

    codes: NDArray[np.uint8]
    """(N, M) their scans, beams that end at robots in sight taken out."""
    sees: NDArray[np.bool_]
    """(N, N) whether robot i has robot j in line of sight within GRID_M."""
    blocked: NDArray[np.bool_]
    """(N,) whether an obstacle is in the safe area towards the goal."""


def look(world: World, places: Floats, goals: Floats, beams: Beams, rig: Rig) -> Views:
    """Return what robots at ``places (N, 2)`` on their way to ``goals (N, 2)`` [m, world frame] see."""
    n, m = len(places), beams.cos.size
    views = Views(np.zeros((n, m), np.uint8), np.zeros((n, n), np.bool_), np.zeros(n, np.bool_))
    ranges, safe = np.zeros(m, np.float32), np.zeros(m, np.uint8)
    _look(world, places, goals, beams, rig, ranges, np.zeros(m + 1, np.int16), safe, *views)
    return views


@jit
def _look(
    world: World,
    places: np.ndarray,
    goals: np.ndarray,
    beams: Beams,
    rig: Rig,
    ranges: np.ndarray,
    edges: np.ndarray,
    safe: np.ndarray,
    codes: np.ndarray,
    sees: np.ndarray,
    blocked: np.ndarray,
) -> None:
    sensor, radius = rig.sensor, rig.body.radius_m
    for i in range(places.shape[0]):
        x, y = places[i, 0], places[i, 1]
        cast_static(world, x, y, 0.0, beams, ranges)
        safe_directions(ranges, sensor, rig.reach[-1, PRINTED], edges, safe)
        bearing = math.atan2(goals[i, 1] - y, goals[i, 0] - x)
        ahead = beam_of(bearing, sensor)
        blocked[i] = safe[ahead] == 0
        for j in range(places.shape[0]):
            if j != i:
                cast_disc(places[j, 0] - x, places[j, 1] - y, radius, beams, ranges)
        encode_scan(ranges, codes[i])
        for j in range(places.shape[0]):
            if j != i and _in_sight(ranges, sensor, places[j, 0] - x, places[j, 1] - y, radius):
                sees[i, j] = True
                hide_robot(codes[i], sensor, places[j, 0] - x, places[j, 1] - y, radius)


@jit_inner
def _in_sight(ranges: np.ndarray, sensor: Sensor, dx: float, dy: float, radius: float) -> bool:
    """Tell whether a robot at (dx, dy) is within GRID_M and the beam towards it ends at its surface."""
    distance = math.sqrt(dx * dx + dy * dy)
    n = beam_of(math.atan2(dy, dx), sensor)
    return bool(distance <= GRID_M and ranges[n] >= distance - radius - SIGHT_SLACK)
