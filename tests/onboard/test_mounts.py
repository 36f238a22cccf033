"""Robots whose LiDAR looks ahead only and sits before or behind the body's centre."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarmscope.errors import ConfigError
from swarmscope.onboard.body import Body
from swarmscope.onboard.control.unicycle import ramp
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.robot import Robot
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.lidar import cast_static, make_beams
from swarmscope.sim.world import compile_world

DT, LIMIT_S, STEPS = 0.2, 100.0, 10


def cross(lidar, seed):
    """Cross the forest alone; return whether the robot arrives, and its smallest clearance."""
    setup = make_setup(parse_scenario({"task": {"name": "T1"}, "seed": seed, "robots": 1}, "test"))
    world, body = compile_world(setup.world), Body()
    robot = Robot("nav-scope", body, lidar, address=1)
    robot.warm_up()
    beams, scan = make_beams(lidar.beams, math.radians(lidar.fov_deg), 5.0), np.empty(lidar.beams, np.float32)
    (x, y, yaw), (gx, gy) = setup.starts[0], setup.goals[0][:2]
    speed, moved, least = 0.0, (0.0, 0.0, 0.0), math.inf
    for now in np.arange(0.0, LIMIT_S, DT):
        c, s, (mx, my, _) = math.cos(yaw), math.sin(yaw), lidar.mount
        cast_static(world, x + c * mx - s * my, y + s * mx + c * my, yaw + lidar.mount[2], beams, scan)
        goal = math.atan2(gy - y, gx - x) - yaw, math.hypot(gx - x, gy - y)
        command = robot.tick(scan=scan, now_s=now, goal=goal, heading=yaw, speed=speed, moved=moved, scan_s=now)
        if command.state == "arrived" and speed == 0.0:
            return True, least
        x0, y0, yaw0 = x, y, yaw
        for _ in range(STEPS):
            turn = command.w * DT / STEPS
            speed, way = ramp(speed, command.v, body.a_max_mps2, DT / STEPS)
            x1, y1 = x + way * math.cos(yaw + 0.5 * turn), y + way * math.sin(yaw + 0.5 * turn)
            least = min(least, static_clearance(world, x, y, x1, y1, 1.0) - body.radius_m)
            x, y, yaw = x1, y1, yaw + turn
        dx, dy, c, s = x - x0, y - y0, math.cos(yaw0), math.sin(yaw0)
        moved = c * dx + s * dy, c * dy - s * dx, yaw - yaw0
    return False, least


@pytest.mark.parametrize(
    ("fov", "mount"),
    [
        (180.0, (0.1, 0.0, 0.0)),
        (180.0, (-0.1, 0.0, 0.0)),
        (270.0, (0.14, 0.0, 0.0)),
        (240.0, (0.1, 0.05, 0.1)),
        (120.0, (0.1, 0.0, 0.0)),
        (90.0, (0.05, -0.03, 0.0)),
    ],
)
def test_a_lidar_that_sits_off_the_centre_and_looks_ahead_brings_its_robot_across(fov, mount):
    arrived, least = cross(Lidar(beams=int(fov) + 1, fov_deg=fov, mount=mount), 1)
    assert arrived
    assert least > 0.0


def test_the_centre_sees_less_than_a_sensor_before_it():
    robot = Robot("nav-scope", Body(), Lidar(beams=181, fov_deg=180.0, mount=(0.1, 0.0, 0.0)), address=1)
    edge = math.acos(0.1 / (0.15 + 0.02))  # there the line beside the sensor leaves the body and its clearance
    angles = np.radians(np.arange(-90, 91))
    assert robot.rows.swarm.rig.sensor.field == (np.abs(angles) < edge).sum()
    behind = Robot("nav-scope", Body(), Lidar(beams=181, fov_deg=180.0, mount=(-0.1, 0.0, 0.0)), address=1)
    assert behind.rows.swarm.rig.sensor.field == 181


@pytest.mark.parametrize(
    ("fov", "mount", "key"),
    [
        (90.0, (0.14, 0.0, 0.0), "lidar.fov_deg"),
        (60.0, (0.0, 0.14, 0.0), "lidar.mount"),
        (25.0, (0.0, 0.0, 0.0), "lidar.fov_deg"),
    ],
)
def test_a_view_that_would_not_do_is_refused(fov, mount, key):
    with pytest.raises(ConfigError) as refused:
        Robot("nav-scope", Body(), Lidar(beams=int(fov) + 1, fov_deg=fov, mount=mount), address=1)
    assert refused.value.where == key
    assert "would do" in str(refused.value) or "nearer the centre" in str(refused.value)
