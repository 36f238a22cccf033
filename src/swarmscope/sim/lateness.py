"""Scans that are older than they should be: cast from where everybody was a random moment before the decision.

Where robots were at the last ticks is kept in a short ring, ``Sim.past``; in between they are taken to have driven
straight.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.sim.cells import column_of, row_of
from swarmscope.sim.lidar import cast_disc, cast_static
from swarmscope.sim.state import Sim
from swarmscope.sim.streams import SCAN_AGE, key, uniform


class Pose(NamedTuple):
    """Where a robot was, world frame [m, rad]."""

    x: float
    y: float
    yaw: float


@jit
def note_pose(sim: Sim, tick: int, i: int) -> None:
    """Keep where robot i is at this tick."""
    robot, row = sim.robots[i], sim.past[tick % sim.past.shape[0], i]
    row[0], row[1], row[2] = robot["x"], robot["y"], robot["yaw"]


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
    return Pose(x + part * (older[0] - x), y + part * (older[1] - y), yaw + part * wrap_angle(older[2] - yaw))


@jit
def cast_late(sim: Sim, tick: int, i: int) -> None:
    """Cast robot i's scan as it was up to ``noise.scan_age_s`` ago, the others where they were at that moment."""
    beams, ranges = sim.beams, sim.ranges[i]
    age_s = sim.noise.scan_age_s * uniform(key(sim.clock.seed, i, tick, SCAN_AGE))
    age = age_s / sim.clock.dt
    own = _pose_before(sim, tick, i, age)
    cast_static(sim.world, own.x, own.y, own.yaw, beams, ranges)
    reach = beams.range_max + sim.radius
    wide = reach + sim.v_max * age_s  # they have driven since
    c, s = math.cos(own.yaw), math.sin(own.yaw)
    columns = int(sim.cell_layout[2])
    for row in range(row_of(sim, own.y - wide), row_of(sim, own.y + wide) + 1):
        begin = sim.cell_start[row * columns + column_of(sim, own.x - wide)]
        end = sim.cell_start[row * columns + column_of(sim, own.x + wide) + 1]
        for k in range(begin, end):
            j = sim.cell_items[k]
            if j == i:
                continue
            other = _pose_before(sim, tick, j, age)
            dx, dy = other.x - own.x, other.y - own.y
            if dx * dx + dy * dy < reach * reach:
                cast_disc(c * dx + s * dy, c * dy - s * dx, sim.radius, beams, ranges)
