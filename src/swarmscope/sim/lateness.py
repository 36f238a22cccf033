"""Scans that are older than they should be: cast from where everybody was a random moment before the decision.

Where robots were at the last ticks is kept in a short ring, ``Sim.past``; in between they are taken to have driven
straight.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import Pose, seen_from, then, wrap_angle
from swarmscope.sim.cells import column_of, row_of
from swarmscope.sim.lidar import cast_disc, cast_static
from swarmscope.sim.moving import cast_moving
from swarmscope.sim.state import Sim
from swarmscope.sim.streams import SCAN_AGE, key, uniform


@jit
def note_pose(sim: Sim, tick: int, i: int) -> None:
    """Keep where robot i is at this tick, and how it has moved since the last as it measures that."""
    robot, percept, slot = sim.robots[i], sim.percepts[i], tick % sim.past.shape[0]
    row, step = sim.past[slot, i], sim.steps[slot, i]
    row[0], row[1], row[2] = robot["x"], robot["y"], robot["yaw"]
    step[0], step[1], step[2] = percept["odom_x"], percept["odom_y"], percept["odom_yaw"]


@jit_inner
def _pose_before(sim: Sim, tick: int, i: int, age: float) -> Pose:
    """Return where robot i was ``age`` [ticks] before this tick, less than the ring holds."""
    slots, back = sim.past.shape[0], int(age)
    robot, newer = sim.robots[i], sim.past[(tick - back) % slots, i]
    x, y, yaw = robot["x"], robot["y"], robot["yaw"]
    if back > 0:
        x, y, yaw = newer[0], newer[1], newer[2]
    older = sim.past[(tick - back - 1) % slots, i]
    part = age - back
    return x + part * (older[0] - x), y + part * (older[1] - y), yaw + part * wrap_angle(older[2] - yaw)


@jit_inner
def _step(sim: Sim, tick: int, i: int) -> Pose:
    """Return how robot i moved up to this tick by its wheels, in its frame of the tick before."""
    step = sim.steps[tick % sim.steps.shape[0], i]
    return step[0], step[1], step[2]


@jit_inner
def _back(sim: Sim, tick: int, i: int, age: float) -> Pose:
    """Return where robot i was ``age`` [ticks] ago by its wheels, seen from where it is now."""
    back = int(age)
    here = (0.0, 0.0, 0.0)
    for k in range(back):
        here = then(_step(sim, tick - k, i), here)
    step, part = _step(sim, tick - back, i), 1.0 - (age - back)
    return seen_from(then(step, here), (part * step[0], part * step[1], part * step[2]))


@jit
def cast_late(sim: Sim, tick: int, i: int) -> None:
    """Cast robot i's scan as it was up to ``noise.scan_age_s`` ago, the others where they were at that moment.

    It is told how it has moved since, by its wheels: a scan has a stamp.
    """
    beams, ranges = sim.beams, sim.ranges[i]
    age_s = sim.noise.scan_age_s * uniform(key(sim.clock.seed, i, tick, SCAN_AGE))
    age = age_s / sim.clock.dt
    percept = sim.percepts[i]
    percept["scan_x"], percept["scan_y"], percept["scan_yaw"] = _back(sim, tick, i, age)
    x, y, yaw = _pose_before(sim, tick, i, age)
    cast_static(sim.world, x, y, yaw, beams, ranges)
    reach = beams.range_max + sim.widest
    wide = reach + sim.fastest * age_s  # they have driven since
    c, s = math.cos(yaw), math.sin(yaw)
    if sim.moving.radius.size + sim.moving.closed.size > 0:
        cast_moving(sim.moving, max(0.0, (tick - age) * sim.clock.dt), x, y, c, s, beams, ranges)
    columns = int(sim.cell_layout[2])
    for row in range(row_of(sim, y - wide), row_of(sim, y + wide) + 1):
        begin = sim.cell_start[row * columns + column_of(sim, x - wide)]
        end = sim.cell_start[row * columns + column_of(sim, x + wide) + 1]
        for k in range(begin, end):
            j = sim.cell_items[k]
            if j == i:
                continue
            other = _pose_before(sim, tick, j, age)
            dx, dy = other[0] - x, other[1] - y
            if dx * dx + dy * dy < reach * reach:
                cast_disc(c * dx + s * dy, c * dy - s * dx, sim.robots[j]["radius"], beams, ranges)
