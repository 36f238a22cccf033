"""Ways out where the wanted heading is not free, and for robots that do not get away from where they are."""

from __future__ import annotations

import math

from swarmscope._jit import jit
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.mapping.words import Spot
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.corridor import corridor_length
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.rig import ESCAPE, NARROW
from swarmscope.onboard.view import View

MOVED_M = 0.05
"""Who has moved so far is not held."""
WIDEST_RAD = 1.6
"""A free direction so far beside the wanted one is of no use."""
DIRECTIONS, FAR_M, LEAVES_S = 24, 3.0, 1.0
"""A robot that leaves looks into so many directions, so far, and goes there for so long."""


@jit
def nearest_free(see: View, bearing: float) -> tuple[float, bool]:
    """Return the free direction nearest to ``bearing`` by the widest rule that leaves one, and whether there is one."""
    sensor = see.rig.sensor
    for rule in range(NARROW, ESCAPE + 1):
        safe_directions(see.masked, sensor, see.reach[rule], see.edges, see.narrow)
        best, heading = math.inf, 0.0
        for n in range(sensor.beams):
            if see.narrow[n]:
                off = abs(wrap_angle(sensor.angle_min + n * sensor.increment - bearing))
                if off < best:
                    best, heading = off, sensor.angle_min + n * sensor.increment
        if best < WIDEST_RAD:
            return wrap_angle(heading), True
    return 0.0, False


@jit
def watch_hold(see: View, memory: Row, here: Spot, cell_m: float, held_s: float) -> None:
    """Notice a robot that does not get away for ``held_s`` from where it is; let it leave where there is most room."""
    now = see.percept["now_s"]
    moved = MOVED_M / cell_m
    gone2 = (here.u - memory["held_u"]) ** 2 + (here.v - memory["held_v"]) ** 2
    if memory["ticks"] == 1 or gone2 > moved * moved:
        memory["held_u"], memory["held_v"], memory["held_s"] = here.u, here.v, now
        return
    if now - memory["held_s"] < held_s or now < memory["leave_s"]:
        return
    best, heading = 0.0, 0.0
    for k in range(DIRECTIONS):
        b = k * 2.0 * math.pi / DIRECTIONS
        free = corridor_length(see.masked, see.rig, b, see.rig.footprint, FAR_M)
        if free > best:
            best, heading = free, b
    memory["leave"], memory["leave_s"] = see.percept["compass"] + heading, now + LEAVES_S
    memory["held_s"] = now
    memory["closed"] = 1
