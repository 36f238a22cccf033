"""The rule between two robots: each keeps to its half of the gap between them (docs/safety.md)."""

from __future__ import annotations

from swarmscope._jit import jit_inline
from swarmscope.onboard.control.way import Way
from swarmscope.onboard.rig import Rig


@jit_inline
def met_by(v: float, dt: float, rig: Rig) -> float:
    """Return how far one that does not yield comes until a robot that drives at ``v`` [m/s] stands [m]; others 0."""
    if rig.guarding.others_yield:
        return 0.0
    return rig.guarding.others_mps * (dt + rig.guarding.latency_s + v / rig.body.a_max_mps2)


@jit_inline
def in_own_half(px: float, py: float, s: float, way: Way, met: float, rig: Rig) -> bool:
    """Tell whether a way keeps to its half of the gap to (px, py); its braking counts twice.

    (px, py) is the nearest known point of a neighbour's body at range ``s``. Before one that does not yield the robot
    stands before it is reached.
    """
    if s <= 1e-6:
        return way.x5 * way.x5 + way.y5 * way.y5 < 1e-9
    nx, ny = px / s, py / s
    moved = way.x4 * nx + way.y4 * ny
    stopped = way.x5 * nx + way.y5 * ny
    return leaves_half(moved, stopped, met, s - rig.body.radius_m - rig.guarding.clearance_m, rig)


@jit_inline
def leaves_half(moved: float, stopped: float, met: float, free: float, rig: Rig) -> bool:
    """Tell whether a way leaves another robot its half of what is ``free`` between the two [m].

    It has come nearer by ``moved`` at the next tick and by ``stopped`` when it stands; ``met`` as in `met_by`.
    """
    towards = max(moved, stopped)
    if towards <= 1e-6:
        return True
    if rig.guarding.others_yield:
        return towards + max(0.0, stopped - moved) <= 0.5 * free
    return towards + met <= free
