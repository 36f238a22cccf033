"""How DH-Bug notices that it goes in circles: poses of a following, and turning on the spot."""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.percept import Row

LOG = 184
LOG_M = 0.07
"""Poses of a following are logged this far apart [m]; when ``LOG`` are known, every other one is forgotten."""
MM = 1000.0
YAW_UNIT = math.pi / 127.0
SAME_M = 0.05
SAME_RAD = math.radians(20.0)
"""Closer than this to a logged pose, in place and heading, is the same pose."""
APART = 10
"""The newest poses are not compared: a robot that stands is not in a loop."""
ROTATION = math.radians(390.0)
"""Turning on the spot for longer than this is a loop."""
STANDING_MPS = 0.02


@jit
def begin_log(shared: Row, memory: Row) -> None:
    """Forget the poses logged before: a following begins here."""
    memory["log_n"], memory["log_m"] = 0, LOG_M
    memory["key_x"], memory["key_y"] = shared["x"], shared["y"]
    memory["rotated"] = 0.0


@jit
def loops(percept: Row, shared: Row, memory: Row) -> bool:
    """Log the pose; tell whether the robot is back at an earlier one, or has turned on the spot for too long."""
    if percept["speed"] < STANDING_MPS:
        memory["rotated"] += abs(percept["odom_yaw"])
        if memory["rotated"] > ROTATION:
            memory["rotated"] = 0.0
            return True
    else:
        memory["rotated"] = 0.0
    x = int(min(32000.0, max(-32000.0, (shared["x"] - memory["key_x"]) * MM)))
    y = int(min(32000.0, max(-32000.0, (shared["y"] - memory["key_y"]) * MM)))
    yaw = percept["compass"]
    n = memory["log_n"]
    if n > 0 and _apart2(memory, n - 1, x, y) <= (memory["log_m"] * MM) ** 2:
        return False
    same = max(SAME_M, 0.6 * memory["log_m"]) * MM
    for j in range(n - APART):
        turned = abs(wrap_angle(yaw - YAW_UNIT * memory["log_yaw"][j]))
        if _apart2(memory, j, x, y) < same * same and turned < SAME_RAD:
            return True
    if n == LOG:
        n = LOG // 2
        memory["log_m"] *= 2.0
        for j in range(n):
            memory["log_x"][j], memory["log_y"][j] = memory["log_x"][2 * j], memory["log_y"][2 * j]
            memory["log_yaw"][j] = memory["log_yaw"][2 * j]
    memory["log_x"][n], memory["log_y"][n] = x, y
    memory["log_yaw"][n] = int(math.floor(wrap_angle(yaw) / YAW_UNIT + 0.5))
    memory["log_n"] = n + 1
    return False


@jit_inner
def _apart2(memory: Row, j: int, x: int, y: int) -> float:
    """Return the squared distance [mm^2] of (x, y) [mm] from logged pose ``j``."""
    dx, dy = float(x - memory["log_x"][j]), float(y - memory["log_y"][j])
    return dx * dx + dy * dy
