"""Unicycle motion at a finer step than the sensors', and contacts that nothing can tunnel through."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import point_segment_distance, wrap_angle
from swarmscope.onboard.control.unicycle import ramp
from swarmscope.onboard.reasons import ARRIVED
from swarmscope.sim.cells import column_of, row_of
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.state import Sim

LOOK = 0.5
"""Clearances are measured up to this [m]."""


@jit
def move(sim: Sim, tick: int, first: int, last: int) -> None:
    """Drive robots ``first`` to ``last - 1`` through one tick; a robot that meets an obstacle stops there for good."""
    for i in range(first, last):
        _drive(sim, i)
        _meet_static(sim, i)


@jit_inner
def _drive(sim: Sim, i: int) -> None:
    """Integrate robot i: speed follows the command within a_max, the turn rate at once within w_max."""
    robot, decision, path = sim.robots[i], sim.decisions[i], sim.path[i]
    steps = sim.clock.substeps
    h = sim.clock.dt / steps
    v_wanted, w = decision["v"], decision["w"]
    if robot["crashed"] or not (math.isfinite(v_wanted) and math.isfinite(w)):
        v_wanted, w = 0.0, 0.0
    v_wanted = min(sim.v_max, max(0.0, v_wanted))
    w = min(sim.w_max, max(-sim.w_max, w))
    x, y, yaw, v = robot["x"], robot["y"], robot["yaw"], robot["v"]
    if robot["crashed"]:
        v = 0.0
    path[0, 0], path[0, 1] = x, y
    if v == 0.0 and v_wanted == 0.0:
        for k in range(1, steps + 1):
            path[k, 0], path[k, 1] = x, y
        robot["yaw"] = wrap_angle(yaw + w * sim.clock.dt)
        return
    turn = 0.5 * w * h
    c, s = math.cos(yaw + turn), math.sin(yaw + turn)
    ct, st = math.cos(w * h), math.sin(w * h)
    for k in range(1, steps + 1):
        v, way = ramp(v, v_wanted, sim.a_max, h)
        x += way * c
        y += way * s
        c, s = c * ct - s * st, s * ct + c * st
        path[k, 0], path[k, 1] = x, y
    robot["x"], robot["y"], robot["yaw"], robot["v"] = x, y, wrap_angle(yaw + w * sim.clock.dt), v


@jit_inner
def _meet_static(sim: Sim, i: int) -> None:
    """Measure robot i's clearance to the world along its path; stop it where it touches."""
    robot, path = sim.robots[i], sim.path[i]
    steps = sim.clock.substeps
    limit = sim.radius + LOOK
    robot["clearance"] = static_clearance(sim.world, path[0, 0], path[0, 1], path[steps, 0], path[steps, 1], limit)
    robot["clearance"] -= sim.radius
    if robot["crashed"] or robot["clearance"] > 0.05:
        return  # the path strays less than 0.05 m from its chord within one tick
    best = math.inf
    for k in range(steps):
        c = static_clearance(sim.world, path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1], limit) - sim.radius
        best = min(best, c)
        if c <= 0.0:
            _stop_at(sim, i, k)
            break
    robot["clearance"] = best


@jit_inner
def _stop_at(sim: Sim, i: int, k: int) -> None:
    """Leave robot i at step k of its path, crashed."""
    robot, path = sim.robots[i], sim.path[i]
    for m in range(k + 1, sim.clock.substeps + 1):
        path[m, 0], path[m, 1] = path[k, 0], path[k, 1]
    robot["x"], robot["y"], robot["v"] = path[k, 0], path[k, 1], 0.0
    robot["crashed"] = 1


@jit
def judge(sim: Sim, tick: int) -> None:
    """Find contacts between robots within this tick, then note lengths, waits and arrivals."""
    steps = sim.clock.substeps
    for i in range(sim.robots.size):
        _meet_robots(sim, i)
    for i in range(sim.robots.size):
        robot, path = sim.robots[i], sim.path[i]
        robot["min_clearance"] = min(robot["min_clearance"], robot["clearance"])
        if robot["arrived"] or robot["crashed"]:
            continue
        way = 0.0
        for k in range(steps):
            way += math.sqrt((path[k + 1, 0] - path[k, 0]) ** 2 + (path[k + 1, 1] - path[k, 1]) ** 2)
        robot["length"] += way
        if way < 0.02 * sim.clock.dt:
            robot["waited_s"] += sim.clock.dt
        if sim.decisions[i]["state"] == ARRIVED and robot["v"] <= 1e-9:
            gx, gy = robot["goal_x"] - robot["x"], robot["goal_y"] - robot["y"]
            robot["arrived"] = 1
            robot["arrival_s"] = (tick + 1) * sim.clock.dt
            robot["length"] += math.sqrt(gx * gx + gy * gy)


@jit_inner
def _meet_robots(sim: Sim, i: int) -> None:
    """Check robot i's path against every near robot with a larger number, both moving."""
    robot, path = sim.robots[i], sim.path[i]
    steps = sim.clock.substeps
    reach = 2.0 * sim.radius + LOOK + sim.v_max * sim.clock.dt
    columns = int(sim.cell_layout[2])
    x, y = path[0, 0], path[0, 1]
    for row in range(row_of(sim, y - reach), row_of(sim, y + reach) + 1):
        begin = sim.cell_start[row * columns + column_of(sim, x - reach)]
        end = sim.cell_start[row * columns + column_of(sim, x + reach) + 1]
        for c in range(begin, end):
            j = sim.cell_items[c]
            if j <= i:
                continue
            other = sim.path[j]
            dx, dy = other[0, 0] - x, other[0, 1] - y
            if dx * dx + dy * dy >= reach * reach:
                continue
            best = math.inf
            for k in range(steps):
                ax, ay = other[k, 0] - path[k, 0], other[k, 1] - path[k, 1]
                bx, by = other[k + 1, 0] - path[k + 1, 0], other[k + 1, 1] - path[k + 1, 1]
                best = min(best, point_segment_distance(0.0, 0.0, ax, ay, bx, by))
                if best <= 2.0 * sim.radius:
                    _stop_at(sim, i, k)
                    _stop_at(sim, j, k)
                    break
            gap = best - 2.0 * sim.radius
            robot["clearance"] = min(robot["clearance"], gap)
            sim.robots[j]["clearance"] = min(sim.robots[j]["clearance"], gap)
