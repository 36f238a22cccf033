"""What a robot with a network remembers besides what DH-Bug does: its round of questions and the answers."""

from __future__ import annotations

import numpy as np

from swarmscope.onboard.deciding import bug
from swarmscope.onboard.network.graph import FEATURES
from swarmscope.onboard.percept import MAX_OUTBOX

OWN = [
    ("stage", np.uint8),
    ("thinks", np.uint8),  # the network is needed in this tick
    ("asked_here", np.uint8),  # a round of requests was sent at this key point
    ("key_s", np.float64),  # since when the robot is at a key point, -1 = it is not
    ("direction", np.float64),  # target direction of the last round, compass frame [rad]
    ("asked_id", np.int64, MAX_OUTBOX),  # who was asked in it, nearest first, -1 = nobody
    ("answered", np.uint8, MAX_OUTBOX),
    ("scale", np.uint8, MAX_OUTBOX),  # their answers
    ("latent", np.uint8, (MAX_OUTBOX, FEATURES)),
    ("heard", np.uint8),  # how many entered the choice made in this tick
    ("p_left", np.float64),  # what the network says, NaN = nothing
]
MEMORY = np.dtype(bug.MEMORY.descr + OWN)
"""It begins with that of DH-Bug, so that DH-Bug's kernels can drive it."""


def new_memory(robots: int) -> np.ndarray:
    """Return the memory of ``robots`` robots that have seen nothing yet."""
    memory = np.zeros(robots, MEMORY)
    memory["wait_s"] = memory["key_s"] = memory["asked_id"] = -1
    return memory
