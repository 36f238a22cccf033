"""What the guard does before somebody who does not yield: the robot stands before he can reach it (docs/safety.md)."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.control.corners import matters_up_to, out_of_hidden_halves, strangers
from swarmscope.onboard.control.halves import leaves_room
from swarmscope.onboard.control.way import Way
from swarmscope.onboard.perception.mend import least_range
from swarmscope.onboard.perception.standing import MOVES, STANDS
from swarmscope.onboard.rig import SIGMAS
from swarmscope.onboard.sharing.tracks import near_track, on_track
from swarmscope.onboard.view import View


@jit
def held_by_strangers(see: View, v: float, way: Way, near: int) -> bool:
    """Tell whether somebody who does not yield could reach a robot that takes this way before it stands.

    Whoever comes is a return that does not stand, is hidden behind one, or walks through another robot: one that is
    hidden behind it as a whole is farther away, in the ratio of their radii; one of whom something shows may not be.
    """
    rig, coming = see.rig, strangers(v, see.percept["dt_s"], see.rig)
    enough, least = matters_up_to(way, coming), least_range(rig)
    behind = max(1.0, coming.smallest / rig.guarding.others_largest_m)
    if _nearest_moving(see, near) < enough:
        behind = 1.0
    for k in range(near):
        n = int(see.edges[k])
        s = float(see.scan[n])
        if not s >= least:
            return True
        if not s < rig.sensor.range_max:
            continue
        s *= max(0.5, 1.0 - SIGMAS * rig.sensor.range_sigma)
        c, si = rig.cos[n], rig.sin[n]
        robots = _is_robots(see, s * c, s * si)
        if not robots and s < rig.body.radius_m:
            return True  # who has walked into a robot may go on
        if robots:
            s *= behind
        if (robots or see.standing[n] != STANDS) and not leaves_room(s * c, s * si, s, way, coming, rig):
            return True
        if not out_of_hidden_halves(see, n, way, coming, enough):
            return True
    return False


@jit_inner
def _nearest_moving(see: View, near: int) -> float:
    """Return the smallest range of a return that moves and is no robot's [m]."""
    rig, best = see.rig, math.inf
    for k in range(near):
        n = int(see.edges[k])
        s = float(see.scan[n])
        if see.standing[n] == MOVES and s < best and not _is_robots(see, s * rig.cos[n], s * rig.sin[n]):
            best = s
    return best


@jit_inner
def _is_robots(see: View, px: float, py: float) -> bool:
    """Tell whether the return at (px, py), body frame, is a robot's; where positions err, whether it may be."""
    if see.rig.sensor.position_sigma > 0.0 or see.rig.guarding.latency_s > 0.0:
        return bool(near_track(see.percept, see.shared, px, py, see.rig))
    return bool(on_track(see.percept, see.shared, px, py, see.rig))
