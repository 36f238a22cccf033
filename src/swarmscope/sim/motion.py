"""Unicycle motion at a finer step than the sensors', and contacts that nothing can tunnel through."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import point_segment_distance, segments_distance, wrap_angle
from swarmscope.onboard.control.unicycle import ramp
from swarmscope.onboard.reasons import ARRIVED
from swarmscope.sim.cells import column_of, row_of
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.moving import disc_at, door_distance, should_open
from swarmscope.sim.state import Sim
from swarmscope.sim.world import WALL_M

LOOK = 0.5
"""Clearances are measured up to this [m]."""
DOOR_M = 0.1
"""A door closes when robots are so much farther away than they need to stop [m]."""
NEAR = 0.05
"""Clearances below this [m] are measured along every piece of a path."""


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
    v_wanted = min(robot["v_max"], max(0.0, v_wanted))
    w = min(robot["w_max"], max(-robot["w_max"], w))
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
        v, way = ramp(v, v_wanted, robot["a_max"], h)
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
    radius = robot["radius"]
    limit = radius + LOOK
    robot["clearance"] = static_clearance(sim.world, path[0, 0], path[0, 1], path[steps, 0], path[steps, 1], limit)
    robot["clearance"] -= radius
    if robot["crashed"] or _chord_tells(sim, i, robot["clearance"]):
        return
    best = math.inf
    for k in range(steps):
        c = static_clearance(sim.world, path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1], limit) - radius
        best = min(best, c)
        if c <= 0.0:
            _stop_at(sim, i, k)
            break
    robot["clearance"] = best


@jit_inner
def _chord_tells(sim: Sim, i: int, clearance: float) -> bool:
    """Tell whether the clearance of the straight line from start to end of robot i's path stands for the path's own.

    It does where it is at least `NEAR` and four times what the path strays from that line: less than a quarter is lost.
    """
    path, steps = sim.path[i], sim.clock.substeps
    if not clearance > NEAR:
        return False
    if clearance > 2.0 * sim.robots[i]["v_max"] * sim.clock.dt:  # nothing strays farther than half of its way
        return True
    ax, ay, bx, by = path[0, 0], path[0, 1], path[steps, 0], path[steps, 1]
    for k in range(1, steps):
        if 4.0 * point_segment_distance(path[k, 0], path[k, 1], ax, ay, bx, by) > clearance:
            return False
    return True


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
    _meet_robots(sim)
    if sim.moving.radius.size + sim.moving.closed.size > 0:
        _meet_moving(sim, tick)
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
def _meet_moving(sim: Sim, tick: int) -> None:
    """Find contacts with discs on their ways and with doors: who drives stops there, who stands has been walked into.

    Then let doors open and close for the next tick.
    """
    for i in range(sim.robots.size):
        robot, touched = sim.robots[i], False
        for d in range(sim.moving.radius.size):
            touched |= _meet_disc(sim, tick, i, d)
        if touched and not robot["in_touch"]:
            robot["touched"] += 1
        robot["in_touch"] = touched
        for k in range(sim.moving.closed.size):
            if sim.moving.closed[k]:
                _meet_door(sim, i, k)
    for k in range(sim.moving.closed.size):
        opens = should_open(sim.moving, k, (tick + 1) * sim.clock.dt)
        sim.moving.closed[k] = not opens and (sim.moving.closed[k] or not _in_the_way(sim, k))


@jit_inner
def _meet_disc(sim: Sim, tick: int, i: int, d: int) -> bool:
    """Measure robot i's gap to disc d while it drives; return whether they touch where it stands."""
    robot, path, steps = sim.robots[i], sim.path[i], sim.clock.substeps
    h, apart = sim.clock.dt / steps, robot["radius"] + sim.moving.radius[d]
    touched = False
    x, y = disc_at(sim.moving, d, tick * sim.clock.dt)
    for k in range(steps):
        ax, ay = x - path[k, 0], y - path[k, 1]
        x, y = disc_at(sim.moving, d, tick * sim.clock.dt + (k + 1) * h)
        bx, by = x - path[k + 1, 0], y - path[k + 1, 1]
        gap = point_segment_distance(0.0, 0.0, ax, ay, bx, by) - apart
        if path[k, 0] == path[k + 1, 0] and path[k, 1] == path[k + 1, 1]:
            touched |= gap <= 0.0
            continue
        robot["clearance"] = min(robot["clearance"], gap)
        if gap <= 0.0:
            _stop_at(sim, i, k)
    return touched


@jit_inner
def _meet_door(sim: Sim, i: int, k: int) -> None:
    """Measure robot i's clearance to a closed door; stop it where it touches."""
    robot, path, door = sim.robots[i], sim.path[i], sim.moving.doors[k]
    for n in range(sim.clock.substeps):
        gap = segments_distance(
            path[n, 0], path[n, 1], path[n + 1, 0], path[n + 1, 1], door[0], door[1], door[2], door[3]
        )
        gap -= robot["radius"] + 0.5 * WALL_M
        robot["clearance"] = min(robot["clearance"], gap)
        if gap <= 0.0 and not robot["crashed"]:
            _stop_at(sim, i, n)


@jit_inner
def _in_the_way(sim: Sim, k: int) -> bool:
    """Tell whether a robot is so near door k that it could not stop before it, if it closed."""
    for i in range(sim.robots.size):
        robot = sim.robots[i]
        stops = 2.0 * robot["v_max"] * sim.clock.dt + robot["v_max"] * robot["v_max"] / (2.0 * robot["a_max"])
        if door_distance(sim.moving.doors[k], robot["x"], robot["y"]) < robot["radius"] + DOOR_M + stops:
            return True
    return False


@jit_inner
def _meet_robots(sim: Sim) -> None:
    """Measure the gaps between all robots that are near one another, all moving; stop those that touch."""
    steps = sim.clock.substeps
    touched = False
    for i in range(sim.robots.size):
        touched = _gaps_of(sim, i, 0, steps, False) or touched
    if not touched:
        return
    for k in range(steps):  # in the order of time: who has been stopped is not where it would have been
        for i in range(sim.robots.size):
            _gaps_of(sim, i, k, k + 1, True)
    for i in range(sim.robots.size):
        _gaps_of(sim, i, 0, steps, False)


@jit_inline
def _gaps_of(sim: Sim, i: int, first: int, stop: int, halt: bool) -> bool:
    """Measure robot i's gaps to near robots with larger numbers within pieces first .. stop - 1 of their paths.

    Return whether one touches that still moves; ``halt`` stops both, else the gap of such a pair is not noted.
    """
    x, y = sim.path[i, 0, 0], sim.path[i, 0, 1]
    reach = 2.0 * sim.widest + LOOK + 2.0 * sim.fastest * sim.clock.dt  # both drive
    columns = int(sim.cell_layout[2])
    touched = False
    for row in range(row_of(sim, y - reach), row_of(sim, y + reach) + 1):
        begin = sim.cell_start[row * columns + column_of(sim, x - reach)]
        end = sim.cell_start[row * columns + column_of(sim, x + reach) + 1]
        for c in range(begin, end):
            j = sim.cell_items[c]
            dx, dy = sim.path[j, 0, 0] - x, sim.path[j, 0, 1] - y
            if j <= i or dx * dx + dy * dy >= reach * reach:
                continue
            gap = _gap(sim, i, j, first, stop)
            if gap <= 0.0 and not (sim.robots[i]["crashed"] and sim.robots[j]["crashed"]):
                touched = True
                if not halt:
                    continue
                _stop_at(sim, i, first)
                _stop_at(sim, j, first)
            sim.robots[i]["clearance"] = min(sim.robots[i]["clearance"], gap)
            sim.robots[j]["clearance"] = min(sim.robots[j]["clearance"], gap)
    return touched


@jit_inline
def _gap(sim: Sim, i: int, j: int, first: int, stop: int) -> float:
    """Return the smallest gap [m] between robots i and j within these pieces, or the first that is none."""
    path, other = sim.path[i], sim.path[j]
    best, both = math.inf, float(sim.robots[i]["radius"] + sim.robots[j]["radius"])
    for k in range(first, stop):
        ax, ay = other[k, 0] - path[k, 0], other[k, 1] - path[k, 1]
        bx, by = other[k + 1, 0] - path[k + 1, 0], other[k + 1, 1] - path[k + 1, 1]
        best = min(best, point_segment_distance(0.0, 0.0, ax, ay, bx, by))
        if best <= both:
            break
    return best - both
