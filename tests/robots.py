"""What tests of `Robot` share: robots that are warm, and ticks with everything in order but what a test says."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from helpers import DT, scan_at, world_of
from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.robot import Robot
from swarmscope.sim.world import Circle, Wall

OPEN = np.full(360, np.inf, np.float32)
ANGLES = -np.pi + np.pi / 180.0 * np.arange(360)


def new_robot(planner="nav-scope", lidar=None, address=7, **options):
    robot = Robot(planner, Body(), lidar or Lidar(), address=address, **options)
    robot.warm_up()
    return robot


class Driver:
    """Ticks a robot every DT; remembers the clock."""

    def __init__(self, robot=None, **always):
        self.robot, self.k = robot or new_robot(), 0
        self.always = {"goal": (0.0, 10.0), "heading": 0.0, "speed": 0.0, "moved": (0.0, 0.0, 0.0)} | always

    @property
    def now_s(self):
        return self.k * DT

    def tick(self, scan=OPEN, **values):
        self.k += 1
        return self.robot.tick(**({"scan": scan, "now_s": self.now_s} | self.always | values))

    def ticks(self, count, *args, **values):
        return [self.tick(*args, **values) for _ in range(count)][-1]


def brakes(command):
    """Whether a command is the one of a fault."""
    return command[:2] == (0.0, 0.0) and not command.ok and command.outbox == [] and len(command.reason) > 10


def within(command, body):
    return (
        math.isfinite(command.v)
        and math.isfinite(command.w)
        and 0.0 <= command.v <= body.v_max_mps
        and abs(command.w) <= body.w_max_radps
    )


def wall_ahead(angles=ANGLES, distance=0.35):
    """A wall 0.35 m ahead, 0.6 rad to either side."""
    angles = np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi
    return np.where(np.abs(angles) < 0.6, distance / np.maximum(np.cos(angles), 0.1), np.inf).astype(np.float32)


def box_left(angles=ANGLES):
    """Something 0.5 m ahead, to the left of straight ahead only: not its own mirror image."""
    angles = np.remainder(angles + np.pi, 2.0 * np.pi) - np.pi
    return np.where((angles > -0.2) & (angles < 0.9), 0.5, np.inf).astype(np.float32)


@cache
def forest(seed=0):
    """A world of trees round the origin, and one wall."""
    rng = np.random.default_rng(seed)
    trees = np.column_stack([rng.uniform(-4.0, 4.0, (16, 2)), rng.uniform(0.1, 0.3, 16)])
    free = trees[np.hypot(trees[:, 0], trees[:, 1]) - trees[:, 2] > 0.8]
    wall = Wall(points=[(-4.5, -4.5), (-4.5, 4.5)])
    return world_of(wall, *(Circle(center=(float(x), float(y)), radius=float(r)) for x, y, r in free))


class LaserScan:
    """What ROS hands over."""

    def __init__(self, ranges, angle_min=-math.pi, angle_increment=math.pi / 180.0, **more):
        self.ranges, self.angle_min, self.angle_increment = ranges, angle_min, angle_increment
        self.angle_max = angle_min + angle_increment * (len(ranges) - 1)
        self.range_min, self.range_max = 0.0, 5.0
        vars(self).update(more)


class Header:
    def __init__(self, seconds):
        self.stamp = type("Time", (), {"sec": int(seconds), "nanosec": int(1e9 * (seconds - int(seconds)))})()


def seen_from(world, rig, x=0.0, y=0.0, yaw=0.0):
    return scan_at(world, rig, x, y, yaw)
