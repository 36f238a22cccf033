"""What sensors get wrong: some of it for the whole run, a draw for each robot, the rest anew for each scan."""

from __future__ import annotations

import math

from swarmscope._jit import jit_inline, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.sim.state import Sim
from swarmscope.sim.streams import (
    BLIND_SECTOR,
    COMPASS_BIAS,
    COMPASS_NOISE,
    NAN_READINGS,
    ODOMETRY_SCALE,
    ODOMETRY_X,
    ODOMETRY_Y,
    ODOMETRY_YAW,
    SCAN_DROP,
    SCAN_NOISE,
    STUCK_BEAMS,
    add_scan_noise,
    key,
    normal,
    replace_readings,
    uniform,
)


@jit_inline
def compass_error(sim: Sim, tick: int, i: int) -> float:
    """Return the error of robot i's compass at this tick [rad]."""
    error = 0.0
    if sim.noise.compass_rad > 0.0:
        error = sim.noise.compass_rad * normal(key(sim.clock.seed, i, tick, COMPASS_NOISE))
    if sim.noise.compass_bias_rad > 0.0:
        error += sim.noise.compass_bias_rad * normal(key(sim.clock.seed, i, 0, COMPASS_BIAS))
    return error


@jit_inline
def measure_motion(sim: Sim, tick: int, i: int) -> None:
    """Fill speed and odometry of robot i."""
    robot, percept = sim.robots[i], sim.percepts[i]
    dx, dy = robot["x"] - robot["last_x"], robot["y"] - robot["last_y"]
    c, s = math.cos(robot["last_yaw"]), math.sin(robot["last_yaw"])
    percept["speed"] = robot["v"]
    percept["odom_x"] = c * dx + s * dy
    percept["odom_y"] = c * dy - s * dx
    percept["odom_yaw"] = wrap_angle(robot["yaw"] - robot["last_yaw"])
    robot["last_x"], robot["last_y"], robot["last_yaw"] = robot["x"], robot["y"], robot["yaw"]
    _spoil_odometry(sim, tick, i, math.sqrt(math.sqrt(dx * dx + dy * dy)))


@jit_inner
def _spoil_odometry(sim: Sim, tick: int, i: int, root: float) -> None:
    """Add the errors of robot i's wheels; ``root`` [sqrt m] is that of the way that it made."""
    percept, noise, seed = sim.percepts[i], sim.noise, sim.clock.seed
    if noise.odometry_scale > 0.0:
        scale = 1.0 + noise.odometry_scale * normal(key(seed, i, 0, ODOMETRY_SCALE))
        percept["speed"] *= scale
        percept["odom_x"] *= scale
        percept["odom_y"] *= scale
        percept["odom_yaw"] *= scale
    if noise.odometry_drift_m > 0.0:
        percept["odom_x"] += noise.odometry_drift_m * root * normal(key(seed, i, tick, ODOMETRY_X))
        percept["odom_y"] += noise.odometry_drift_m * root * normal(key(seed, i, tick, ODOMETRY_Y))
    if noise.odometry_turn_rad > 0.0:
        percept["odom_yaw"] += noise.odometry_turn_rad * root * normal(key(seed, i, tick, ODOMETRY_YAW))


@jit_inline
def spoil_scan(sim: Sim, tick: int, i: int) -> None:
    """Turn robot i's exact ranges into what its LiDAR says."""
    ranges, noise, seed = sim.ranges[i], sim.noise, sim.clock.seed
    if noise.range_fraction > 0.0:
        add_scan_noise(ranges, key(seed, i, tick, SCAN_NOISE), noise.range_fraction, sim.beams.range_max)
    if noise.dropout > 0.0:
        replace_readings(ranges, key(seed, i, tick, SCAN_DROP), noise.dropout, math.inf)
    if noise.stuck > 0.0:
        replace_readings(ranges, key(seed, i, 0, STUCK_BEAMS), noise.stuck, sim.beams.range_max)
    if noise.blind_rad > 0.0:
        _blind(sim, i)
    if noise.nan > 0.0:
        replace_readings(ranges, key(seed, i, tick, NAN_READINGS), noise.nan, math.nan)
    if sim.range_min > 0.0:
        for n in range(ranges.size):
            if ranges[n] < sim.range_min:
                ranges[n] = math.nan


@jit_inner
def _blind(sim: Sim, i: int) -> None:
    """Take the returns out of robot i's blind sector, which lies within its field of view."""
    ranges, beams = sim.ranges[i], sim.beams
    count = min(ranges.size, int(sim.noise.blind_rad / beams.increment + 0.5))
    places = ranges.size if beams.wraps else ranges.size - count + 1
    first = int(uniform(key(sim.clock.seed, i, 0, BLIND_SECTOR)) * places)
    for k in range(first, first + count):
        ranges[k % ranges.size] = math.inf
