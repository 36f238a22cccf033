"""What one robot remembers of its own progress: the memory that the four-state planners share."""

from __future__ import annotations

import numpy as np

from swarmscope._jit import jit_paste
from swarmscope.onboard.percept import Row
from swarmscope.onboard.view import View

LOG = 16
"""Choices of a side that are remembered."""

MEMORY = np.dtype(
    [
        ("mode", np.uint8),
        ("side", np.int8),
        ("strict", np.uint8),  # follows the border until closer to the goal than ever (after a loop)
        ("told", np.int8),  # side of the shortest way, +1 left, -1 right: oracles only, 0 on a robot
        ("heading", np.float64),  # direction of travel, compass frame [rad]
        ("turning", np.uint8),  # turns on the spot towards it
        ("wind", np.float64),  # how far the following has turned off the target; may exceed 2 pi [rad]
        ("target", np.float64),  # direction of the target at the last tick, compass frame [rad]
        ("travel", np.float64),  # way made so far, by odometry [m]
        ("left_at", np.float64),  # of it when the last following ended [m]
        ("last_side", np.int8),  # side of the last following
        ("best", np.float64),  # smallest goal distance so far [m]
        ("best_s", np.float64),  # when
        ("closest", np.float64),  # goal distance of the nearest free point ever seen on the way to the goal [m]
        ("stuck_s", np.float64),  # how long without progress is a loop; doubles with every one in a row
        ("wait_s", np.float64),  # when the present wait began, -1 = none
        ("push_s", np.float64),  # until when waiting is not allowed
        ("log_n", np.int64),  # choices of a side so far
        ("log_x", np.float64, LOG),
        ("log_y", np.float64, LOG),
        ("log_goal", np.float64, LOG),
        ("log_travel", np.float64, LOG),
        ("log_side", np.int8, LOG),
    ]
)


def new_memory(robots: int) -> np.ndarray:
    """Return the memory of ``robots`` robots that have seen nothing yet."""
    memory = np.zeros(robots, MEMORY)
    memory["wait_s"] = -1.0
    memory["best"] = np.inf
    memory["closest"] = np.inf
    memory["left_at"] = -np.inf
    return memory


@jit_paste
def say(see: View, memory: Row, state: int, reason: int) -> None:
    """Note state and reason for people to read."""
    see.out["state"], see.out["reason"], see.out["side"] = state, reason, memory["side"]
