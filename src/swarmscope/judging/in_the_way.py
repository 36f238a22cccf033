"""Who stands in the way of robots that did not arrive: asked of the true world when a run is over."""

from __future__ import annotations

import numpy as np

from swarmscope.tasks import Setup
from swarmscope.tasks._check import RESOLUTION_M, Reach, reachable_past

MOST_ASKED = 20
"""Of more robots that did not arrive only the first are asked about: each takes a look at the whole world."""
LARGEST_M2 = 10_000.0
"""In larger worlds nobody is asked about."""
KEPT_M = 0.03
"""What robots keep off things where they have to squeeze through [m]."""


def who_is_in_the_way(setup: Setup, places: np.ndarray, radii: np.ndarray, robot: int) -> list[int]:
    """Return the robots without which ``robot`` could get to its goal, nearest first; none where it still can.

    ``places`` (N, 2) [m] are where all stand; each of those that are returned closes the way by itself.
    """
    x0, y0, x1, y1 = setup.world.bounds
    if (x1 - x0) * (y1 - y0) > LARGEST_M2:
        return []
    here = Setup(setup.world, places[robot][None, :], setup.goals[robot][None, :])
    reach = Reach(float(radii[robot]), KEPT_M, RESOLUTION_M)
    everybody = np.column_stack([places, radii])
    others = np.delete(everybody, robot, axis=0)
    if reachable_past(here, reach, others) or not reachable_past(here, reach, others[:0]):
        return []
    near = np.argsort(np.hypot(*(places - places[robot]).T), kind="stable").tolist()
    near.remove(robot)
    return [n for n in near if reachable_past(here, reach, np.delete(everybody, [robot, n], axis=0))]
