"""Robots that want to crash and are guarded: the safety claim, tested with the simulator's kernels."""

from __future__ import annotations

import math

from swarmscope._jit import jit
from swarmscope.onboard.control.guard import guard
from swarmscope.onboard.sharing.tracks import update_odometry, update_tracks
from swarmscope.onboard.view import view_of
from swarmscope.sim.cells import index_robots
from swarmscope.sim.motion import judge, move
from swarmscope.sim.sensing import sense
from swarmscope.sim.streams import key, uniform

RANDOM, CHASE, STUBBORN = range(3)
"""What an adversary asks for: anything, the way to the nearest thing, the same for eight ticks."""


@jit
def _nearest_bearing(ranges, angle_min, increment):
    nearest, at = math.inf, 0
    for n in range(ranges.size):
        if ranges[n] < nearest:
            nearest, at = ranges[n], n
    return angle_min + at * increment


@jit
def _run(sim, swarm, ticks, mode):
    rig = swarm.rig
    smallest = math.inf
    robots = sim.robots.size
    index_robots(sim)
    for tick in range(ticks):
        sense(sim, tick, 0, robots)
        for i in range(robots):
            see = view_of(swarm, i)
            decision = see.out
            when = tick // 8 if mode == STUBBORN else tick
            decision["v"] = sim.fastest * (1.5 * uniform(key(sim.clock.seed, i, when, 101)) - 0.1)
            decision["w"] = sim.robots[i]["w_max"] * (2.4 * uniform(key(sim.clock.seed, i, when, 102)) - 1.2)
            if mode == CHASE and uniform(key(sim.clock.seed, i, tick // 5, 103)) < 0.8:
                decision["v"] = sim.fastest
                decision["w"] = (
                    _nearest_bearing(see.scan, rig.sensor.angle_min, rig.sensor.increment) / sim.clock.dt
                )
            dx, dy = update_odometry(see.percept, see.shared)
            update_tracks(see.percept, see.shared, rig, dx, dy)
            guard(see)
        move(sim, tick, 0, robots)
        judge(sim, tick)
        for i in range(robots):
            smallest = min(smallest, sim.robots[i]["clearance"])
            if sim.robots[i]["crashed"]:
                return -1.0
        index_robots(sim)
    return smallest


def closest(sim, swarm, ticks, mode):
    """The smallest clearance [m] of any robot in ``ticks`` ticks, -1 after a contact."""
    return _run(sim, swarm, ticks, mode)
