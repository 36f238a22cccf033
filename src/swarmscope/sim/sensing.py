"""What each robot perceives: its scan, its neighbours, its goal, its own motion, the packets that have come in."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import ray_circle, wrap_angle
from swarmscope.onboard.percept import MAX_INBOX, MAX_NEIGHBOURS, Row
from swarmscope.sim.beams import Beams
from swarmscope.sim.cells import column_of, row_of
from swarmscope.sim.errors import compass_error, measure_motion, spoil_scan
from swarmscope.sim.lateness import cast_late, note_pose
from swarmscope.sim.lidar import cast_disc, cast_static
from swarmscope.sim.moving import cast_moving
from swarmscope.sim.state import Sim
from swarmscope.sim.streams import BEARING_NOISE, RANGE_NOISE, key, mix, normal

SIGHT_SLACK = 1e-3
"""A neighbour is in sight when a beam ends at most this short of its surface [m]."""


@jit
def sense(sim: Sim, tick: int, first: int, last: int) -> None:
    """Fill scan and percept of robots ``first`` to ``last - 1`` from one snapshot of all poses."""
    for i in range(first, last):
        _sense_self(sim, tick, i)
        _scan_and_neighbours(sim, tick, i)
        _receive(sim, tick, i)


@jit_inner
def _sense_self(sim: Sim, tick: int, i: int) -> None:
    """Fill clock, compass, goal and odometry of robot i."""
    robot, percept = sim.robots[i], sim.percepts[i]
    heading = robot["yaw"] + compass_error(sim, tick, i)
    gx, gy = robot["goal_x"] - robot["x"], robot["goal_y"] - robot["y"]
    percept["now_s"] = tick * sim.clock.dt + robot["clock_s"]
    percept["compass"] = wrap_angle(heading)
    percept["goal_bearing"] = wrap_angle(math.atan2(gy, gx) - heading)
    percept["goal_distance"] = math.sqrt(gx * gx + gy * gy)
    turn = robot["goal_yaw"] - heading
    percept["goal_turn"] = wrap_angle(turn) if math.isfinite(turn) else math.nan
    measure_motion(sim, tick, i)


@jit_inner
def _scan_and_neighbours(sim: Sim, tick: int, i: int) -> None:
    """Cast robot i's scan and list the neighbours in its line of sight, nearest first."""
    robot, percept, ranges = sim.robots[i], sim.percepts[i], sim.ranges[i]
    x, y, yaw = robot["x"], robot["y"], robot["yaw"]
    cast_static(sim.world, x, y, yaw, sim.beams, ranges)
    reach = sim.beams.range_max + sim.widest
    c, s = math.cos(yaw), math.sin(yaw)
    if sim.moving.radius.size + sim.moving.closed.size > 0:
        cast_moving(sim.moving, tick * sim.clock.dt, x, y, c, s, sim.beams, ranges)
    columns = int(sim.cell_layout[2])
    found = 0
    for row in range(row_of(sim, y - reach), row_of(sim, y + reach) + 1):
        begin = sim.cell_start[row * columns + column_of(sim, x - reach)]
        end = sim.cell_start[row * columns + column_of(sim, x + reach) + 1]
        for k in range(begin, end):
            j = sim.cell_items[k]
            dx, dy = sim.robots[j]["x"] - x, sim.robots[j]["y"] - y
            if j == i or dx * dx + dy * dy >= reach * reach:
                continue
            bx, by = c * dx + s * dy, c * dy - s * dx
            cast_disc(bx, by, sim.robots[j]["radius"], sim.beams, ranges)
            found = _insert(percept, found, j, bx, by)
    _keep_visible(sim, tick, i, found)
    if sim.noise.scan_age_s > 0.0:
        note_pose(sim, tick, i)
        cast_late(sim, tick, i)
    spoil_scan(sim, tick, i)
    if ranges.size < sim.scans.shape[1]:
        for n in range(ranges.size):
            sim.scans[i, sim.first_beam + n] = ranges[n]


@jit_inner
def _insert(percept: Row, found: int, j: int, bx: float, by: float) -> int:
    """Insert neighbour j into the list sorted by distance; return its new length."""
    ids, xs, ys = percept["neighbour_id"], percept["neighbour_x"], percept["neighbour_y"]
    d2 = bx * bx + by * by
    k = found
    if found == MAX_NEIGHBOURS:
        k = found - 1
        if xs[k] * xs[k] + ys[k] * ys[k] <= d2:
            return found
    while k > 0 and xs[k - 1] * xs[k - 1] + ys[k - 1] * ys[k - 1] > d2:
        ids[k], xs[k], ys[k] = ids[k - 1], xs[k - 1], ys[k - 1]
        k -= 1
    ids[k], xs[k], ys[k] = j, bx, by
    return min(MAX_NEIGHBOURS, found + 1)


@jit_inner
def _keep_visible(sim: Sim, tick: int, i: int, found: int) -> None:
    """Keep the neighbours of which robot i's own (noise-free) scan shows something; add the sensor's errors."""
    percept, beams, noise = sim.percepts[i], sim.beams, sim.noise
    ids, xs, ys = percept["neighbour_id"], percept["neighbour_x"], percept["neighbour_y"]
    error = compass_error(sim, tick, i)
    kept = 0
    for k in range(found):
        j, x, y = ids[k], xs[k], ys[k]
        distance = math.sqrt(x * x + y * y)
        bearing = math.atan2(y, x)
        if not (_shows(sim, i, j, distance, bearing) or (not beams.wraps and _in_sight(sim, tick, i, j, found))):
            continue
        if noise.range_fraction > 0.0 or noise.bearing_rad > 0.0:
            bits = mix(key(sim.clock.seed, i, tick, RANGE_NOISE) + key(0, j, 0, RANGE_NOISE))
            distance *= 1.0 + noise.range_fraction * normal(bits)
            bits = mix(key(sim.clock.seed, i, tick, BEARING_NOISE) + key(0, j, 0, BEARING_NOISE))
            bearing += noise.bearing_rad * normal(bits)
            x, y = distance * math.cos(bearing), distance * math.sin(bearing)
        ids[kept], xs[kept], ys[kept] = j, x, y
        heading = sim.robots[j]["yaw"] + compass_error(sim, tick, j)
        percept["neighbour_yaw"][kept] = wrap_angle(heading - sim.robots[i]["yaw"] - error)
        kept += 1
    percept["n_neighbours"] = kept


@jit_inner
def _shows(sim: Sim, i: int, j: int, distance: float, bearing: float) -> bool:
    """Tell whether a beam of robot i's noise-free scan ends on robot j, at ``distance`` [m] and ``bearing`` [rad]."""
    beams, ranges, radius = sim.beams, sim.ranges[i], sim.robots[j]["radius"]
    middle = (bearing - beams.angle_min) / beams.increment
    spread = math.asin(min(1.0, radius / max(distance, 1e-9))) / beams.increment
    for k in range(int(math.ceil(middle - spread)), int(math.floor(middle + spread)) + 1):
        n = k % ranges.size if beams.wraps else k
        if not 0 <= n < ranges.size:
            continue
        off = (k - middle) * beams.increment
        surface = ray_circle(math.cos(off), math.sin(off), distance, 0.0, radius)
        if surface <= beams.range_max and ranges[n] >= surface - SIGHT_SLACK:
            return True
    return False


@jit_inner
def _in_sight(sim: Sim, tick: int, i: int, j: int, found: int) -> bool:
    """Tell whether nothing stands between the centres of robots i and j, where the LiDAR need not look.

    Mutual positioning is a sensor of its own: it works all round. Who could be in between is among the first ``found``
    neighbours of the list, kept ones first.
    """
    robot, other, ray = sim.robots[i], sim.robots[j], sim.sight[i]
    dx, dy = other["x"] - robot["x"], other["y"] - robot["y"]
    distance = math.sqrt(dx * dx + dy * dy)
    towards = math.atan2(dy, dx)
    beams = Beams(sim.straight_cos, sim.straight_sin, 0.0, 2.0 * math.pi, True, max(distance, 1e-3))
    cast_static(sim.world, robot["x"], robot["y"], towards, beams, ray)
    c, s = dx / max(distance, 1e-9), dy / max(distance, 1e-9)
    if sim.moving.radius.size + sim.moving.closed.size > 0:
        cast_moving(sim.moving, tick * sim.clock.dt, robot["x"], robot["y"], c, s, beams, ray)
    for k in range(found):
        third = sim.percepts[i]["neighbour_id"][k]
        if third != j:
            ex, ey = sim.robots[third]["x"] - robot["x"], sim.robots[third]["y"] - robot["y"]
            cast_disc(c * ex + s * ey, c * ey - s * ex, sim.robots[third]["radius"], beams, ray)
    return bool(ray[0] >= distance - other["radius"] - SIGHT_SLACK)


@jit_inner
def _receive(sim: Sim, tick: int, i: int) -> None:
    """Hand over the packets that have arrived, oldest first; the rest stays in the queue."""
    robot, percept = sim.robots[i], sim.percepts[i]
    now = tick * sim.clock.dt + 1e-9
    taken, kept = 0, 0
    for q in range(robot["queued"]):
        if sim.queue_due[i, q] <= now and taken < MAX_INBOX:
            percept["packet_length"][taken] = sim.queue_length[i, q]
            for b in range(sim.queue_length[i, q]):
                percept["packet"][taken, b] = sim.queue_data[i, q, b]
            taken += 1
            continue
        if kept != q:
            sim.queue_due[i, kept] = sim.queue_due[i, q]
            sim.queue_length[i, kept] = sim.queue_length[i, q]
            sim.queue_from[i, kept] = sim.queue_from[i, q]
            for b in range(sim.queue_length[i, q]):
                sim.queue_data[i, kept, b] = sim.queue_data[i, q, b]
        kept += 1
    robot["queued"] = kept
    percept["n_packets"] = taken
