"""Heading and way to the goal, steadied by odometry: a compass that jitters is believed over seconds, not in a tick."""

from __future__ import annotations

import math

from swarmscope._jit import jit_inline, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.percept import Row

GAIN = 0.1
"""Share of what a tick measures that enters: 10 degrees of jitter become 2.3."""
EXACT = 1e-9
"""What agrees with odometry to this [rad, m] is taken as measured."""
JUMP_RAD, JUMP_M = 0.8, 1.0
"""What is off by more than this is new: another goal, a compass that was set anew."""


@jit_inline
def steady(percept: Row, shared: Row) -> None:
    """Replace compass, goal bearing and goal distance of the percept by what they and odometry say together.

    A complementary filter with ``GAIN``, in the state ``shared["compass"]``, ``["goal_x"]``, ``["goal_y"]`` (body
    frame [m]). The goal is predicted from odometry alone: its error need not be that of the compass.
    """
    distance, bearing = percept["goal_distance"], percept["goal_bearing"]
    gx, gy = distance * math.cos(bearing), distance * math.sin(bearing)
    if shared["started"] != 0:
        compass = _mixed(percept["compass"], shared["compass"] + percept["odom_yaw"], JUMP_RAD)
        c, s = math.cos(percept["odom_yaw"]), math.sin(percept["odom_yaw"])
        x, y = shared["goal_x"] - percept["odom_x"], shared["goal_y"] - percept["odom_y"]
        px, py = c * x + s * y, c * y - s * x
        percept["compass"] = compass
        ex, ey = gx - px, gy - py
        off = math.sqrt(ex * ex + ey * ey)
        if EXACT < off < JUMP_M + JUMP_RAD * distance:
            gx, gy = px + GAIN * ex, py + GAIN * ey
            percept["goal_distance"] = math.sqrt(gx * gx + gy * gy)
            percept["goal_bearing"] = math.atan2(gy, gx)
    shared["goal_x"], shared["goal_y"] = gx, gy


@jit_inner
def _mixed(measured: float, predicted: float, jump: float) -> float:
    """Return an angle between measured and predicted, the measured one where they agree or lie far apart."""
    off = wrap_angle(measured - predicted)
    if EXACT < abs(off) < jump:
        return wrap_angle(predicted + GAIN * off)
    return measured
