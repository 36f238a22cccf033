"""Whether runs can end well at all: room at starts and goals, and a way between them for each robot alone."""

from __future__ import annotations

import numpy as np

from swarmscope.disk import geodesic
from swarmscope.disk.rules import Floats
from swarmscope.disk.runs import Problem
from swarmscope.errors import UnsolvableWorldError


def first_fault(discs: Floats, r: float, start: Floats, goal: Floats) -> str:
    """Return what makes a run impossible, '' if nothing does.

    Args:
        discs: (m, 3) obstacles.
        r: radius of the robots.
        start, goal: (n, 2) of each robot.
    """
    for places, what in ((start, "start"), (goal, "goal")):
        apart = np.linalg.norm(places[:, None] - discs[None, :, :2], axis=2) - (discs[:, 2] + r)
        if discs.size and apart.min() <= 0.0:
            robot, m = np.unravel_index(apart.argmin(), apart.shape)
            x, y, radius = discs[m]
            return (
                f"robot {robot} would touch obstacle {m} (radius {radius:g} at {x:g}, {y:g}) at its {what} "
                f"({places[robot, 0]:.3f}, {places[robot, 1]:.3f})"
            )
    cost = _alone(discs, r, start, goal)
    if not np.isfinite(cost).all():
        robot = int(np.flatnonzero(~np.isfinite(cost))[0])
        return (
            f"infeasible: robot {robot} of radius {r:g} has no way from ({start[robot, 0]:.3f}, "
            f"{start[robot, 1]:.3f}) to its goal ({goal[robot, 0]:.3f}, {goal[robot, 1]:.3f})"
        )
    return ""


def check(of: Problem) -> None:
    """Raise UnsolvableWorldError if some run cannot end well, saying which and why."""
    for b, which in enumerate(of.map_of):
        fault = first_fault(of.maps[which].obstacles, of.rules.r, of.start[b], of.goal[b])
        if fault:
            raise UnsolvableWorldError(f"map {of.maps[which].name}: {fault}")


def _alone(discs: Floats, r: float, start: Floats, goal: Floats) -> Floats:
    ways = geodesic.build([discs], r)
    ways = geodesic.add_goals(ways, np.zeros(len(goal), dtype=np.int64), goal)
    return geodesic.lengths(ways, np.arange(len(goal)), start)
