"""Robots whose LiDAR looks ahead only and sits before or behind the body's centre."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import circles_world
from swarmscope.errors import ConfigError
from swarmscope.onboard.body import Body
from swarmscope.onboard.control.unicycle import ramp
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.robot import Robot
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.beams import make_beams
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.lidar import cast_static
from swarmscope.sim.world import compile_world

DT, STEPS = 0.2, 10


class Drive:
    """A robot in a world, tick after tick; ``spoil`` may change its scans, which are ``late_s`` old."""

    def __init__(self, world, lidar, start, spoil=None, late_s=0.0, v_max_mps=0.5, **options):
        self.world, self.lidar, self.spoil, self.late_s = world, lidar, spoil, late_s
        self.robot = Robot("nav-scope", Body(v_max_mps=v_max_mps), lidar, address=1, **options)
        self.robot.warm_up()
        self.x, self.y, self.yaw = start
        self.now_s, self.speed, self.moved, self.least = 0.0, 0.0, (0.0, 0.0, 0.0), math.inf
        self.beams = make_beams(lidar.beams, math.radians(lidar.fov_deg), lidar.range_m)
        self.turned = lidar.mount[2]
        if lidar.first_deg is not None:
            self.turned += math.radians(lidar.first_deg) - self.beams.angle_min
        self.track = [tuple(start)] * (round(late_s / DT * STEPS) + 1)

    def scan(self):
        (x, y, yaw), (mx, my, _), turned = self.track[0], self.lidar.mount, self.turned
        c, s, found = math.cos(yaw), math.sin(yaw), np.empty(self.lidar.beams, np.float32)
        cast_static(self.world, x + c * mx - s * my, y + s * mx + c * my, yaw + turned, self.beams, found)
        if self.spoil is not None:
            self.spoil(found)
        return found

    def tick(self, gx, gy):
        """Go on towards a goal; return the command."""
        goal = math.atan2(gy - self.y, gx - self.x) - self.yaw, math.hypot(gx - self.x, gy - self.y)
        told = {"heading": self.yaw, "speed": self.speed, "moved": self.moved, "scan_s": self.now_s - self.late_s}
        command = self.robot.tick(scan=self.scan(), now_s=self.now_s, goal=goal, **told)
        x0, y0, yaw0 = self.x, self.y, self.yaw
        for _ in range(STEPS):
            turn = command.w * DT / STEPS
            self.speed, way = ramp(self.speed, command.v, self.robot.body.a_max_mps2, DT / STEPS)
            x1, y1 = self.x + way * math.cos(self.yaw + 0.5 * turn), self.y + way * math.sin(self.yaw + 0.5 * turn)
            gap = static_clearance(self.world, self.x, self.y, x1, y1, 1.0) - self.robot.body.radius_m
            self.least = min(self.least, gap)
            self.x, self.y, self.yaw = x1, y1, self.yaw + turn
            self.track = [*self.track[1:], (self.x, self.y, self.yaw)]
        dx, dy, c, s = self.x - x0, self.y - y0, math.cos(yaw0), math.sin(yaw0)
        self.moved = c * dx + s * dy, c * dy - s * dx, self.yaw - yaw0
        self.now_s += DT
        return command


def cross(lidar, seed, limit_s=100.0, **how):
    """Cross the forest alone; return whether the robot arrives, and its smallest clearance."""
    setup = make_setup(parse_scenario({"task": {"name": "T1"}, "seed": seed, "robots": 1}, "test"))
    drive = Drive(compile_world(setup.world), lidar, setup.starts[0], **how)
    while drive.now_s < limit_s:
        if drive.tick(*setup.goals[0][:2]).state == "arrived" and drive.speed == 0.0:
            return True, drive.least
    return False, drive.least


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


def break_edges(scan):
    scan[:15] = scan[-15:] = np.nan


@pytest.mark.parametrize(
    ("fov", "mount", "how"),
    [
        (180.0, (0.0, 0.0, 0.0), {"spoil": break_edges, "late_s": 0.1}),
        (270.0, (0.1, 0.0, 0.0), {"spoil": break_edges}),
        (330.0, (0.0, 0.0, 0.0), {"late_s": 0.2}),
        (340.0, (-0.1, 0.05, 0.0), {}),
        (350.0, (0.0, 0.05, 0.0), {"late_s": 0.1}),
        (60.0, (0.0, 0.0, 0.0), {"late_s": 0.2}),
        (50.0, (0.0, 0.0, 0.0), {"late_s": 0.2}),
    ],
)
def test_broken_edges_wide_fields_and_late_scans_stop_nobody(fov, mount, how):
    arrived, least = cross(Lidar(beams=int(fov) + 1, fov_deg=fov, mount=mount), 1, **how)
    assert arrived
    assert least > 0.0


@pytest.mark.parametrize(
    ("mount", "how"),
    [
        ((0.0, 0.0, 0.0), {}),
        ((0.0, 0.0, 0.0), {"late_s": 0.1}),
        ((0.05, 0.0, 0.0), {}),
        ((-0.05, 0.0, 0.0), {}),
        ((-0.1, 0.0, 0.0), {}),
        ((-0.14, 0.0, 0.0), {"late_s": 0.2}),
        ((0.0, 0.14, 0.0), {"late_s": 0.1}),
    ],
)
@pytest.mark.parametrize("radius", [0.01, 0.02])
def test_a_post_in_a_hole_of_the_scan_is_not_touched_wherever_the_scan_was_taken(mount, how, radius):
    def blind(scan):
        scan[179:182] = np.nan

    drive = Drive(circles_world([(1.2, 0.0, radius)]), Lidar(mount=mount), (0.0, 0.0, 0.0), blind, **how)
    for _ in range(40):
        drive.tick(4.0, 0.0)
    assert drive.least > 0.0
    assert drive.x > 0.3  # it stops where something narrow may stand in the hole, and turns to look


def blind_at_returns(first, count):
    """Spoil scans as a post does that gives no sound reading: ``count`` beams from its middle less ``first`` on."""

    def spoil(scan):
        found = np.flatnonzero(scan < 2.0)
        if found.size:
            middle = int(round(found.mean())) - first
            scan[np.arange(middle, middle + count) % scan.size] = np.nan

    return spoil


@pytest.mark.parametrize(
    ("fov", "mount", "late_s"),
    [
        (360.0, (0.0, 0.0, 0.0), 0.0),
        (360.0, (-0.14, 0.0, 0.0), 0.2),
        (180.0, (0.1, 0.1, 0.0), 0.2),
        (90.0, (0.05, 0.0, 0.0), 0.1),
        (90.0, (-0.05, 0.0, 0.0), 0.2),
        (90.0, (0.0, -0.14, 0.0), 0.0),
        (90.0, (-0.1, 0.1, 0.0), 0.2),
    ],
)
@pytest.mark.parametrize("y", [0.0, 0.05, -0.12])
@pytest.mark.parametrize(("first", "count"), [(0, 1), (1, 2), (1, 3), (2, 5)])
def test_a_post_that_gives_no_sound_reading_is_not_touched(fov, mount, late_s, y, first, count):
    """It shows beside the hole when it is near; nobody has looked past it before, and no scan kept has, either."""
    lidar = Lidar(beams=360 if fov == 360.0 else int(fov) + 1, fov_deg=fov, mount=mount)
    world, spoil = circles_world([(1.2, y, 0.01)]), blind_at_returns(first, count)
    drive = Drive(world, lidar, (0.0, 0.0, 0.0), spoil, late_s)
    for _ in range(45):
        drive.tick(4.0, 0.0)
    assert drive.least > 0.0


@pytest.mark.parametrize("v_max_mps", [1.0, 2.0])
def test_a_circle_that_closes_ahead_with_a_wider_gap_lets_its_robot_be_slower(v_max_mps):
    """180 readings over 357.2 degrees, from 1.4 degrees to the left on: a post ahead shows 0.4 m away, not 0.57."""
    lidar = Lidar(beams=180, fov_deg=357.2, first_deg=1.4)
    drive = Drive(circles_world([(1.2, 0.0, 0.01)]), lidar, (0.0, 0.0, 0.0), v_max_mps=v_max_mps, others_mps=0.0)
    assert drive.robot.rows.rig.horizon.things == pytest.approx(0.01 / math.sin(math.radians(1.4)) - 0.01)
    for _ in range(30):
        drive.tick(4.0, 0.0)
    assert drive.least > 0.0
    assert drive.x > 1.3


def absorb(scan):
    """Spoil scans as things do that give no reading at all."""
    scan[np.isfinite(scan)] = np.nan


@pytest.mark.parametrize("v_max_mps", [0.2, 0.5])
@pytest.mark.parametrize(("x", "y"), [(1.0, -0.2), (1.2, -0.04), (1.4, 0.08), (1.6, 0.0), (2.0, 0.16), (2.4, -0.08)])
def test_a_post_that_gives_no_reading_at_all_is_gone_round(x, y, v_max_mps):
    """The hole is as wide as the post; while the robot drives by fractions of a beam it may slip from beam to beam."""
    drive = Drive(circles_world([(x, y, 0.01)]), Lidar(), (0.0, 0.0, 0.0), absorb, v_max_mps=v_max_mps)
    for _ in range(round(8.0 / v_max_mps / DT)):
        drive.tick(4.0, 0.0)
    assert drive.least > 0.0
    assert drive.x > 3.9


@pytest.mark.parametrize(("x", "y"), [(1.0, 0.0), (1.3, 0.1)])
@pytest.mark.parametrize(("fov", "late_s"), [(180.0, 0.0), (120.0, 0.0), (120.0, 0.2), (90.0, 0.1)])
def test_nor_is_it_touched_by_robots_of_limited_view(fov, late_s, x, y):
    """What comes into view in a turn had been taken for looked at: beams out of view only remember."""
    lidar = Lidar(beams=int(fov) + 1, fov_deg=fov)
    drive = Drive(circles_world([(x, y, 0.01), (2.0, -0.3, 0.02)]), lidar, (0.0, 0.0, 1.0), absorb, late_s)
    for _ in range(90):
        drive.tick(4.0, 0.0)
    assert drive.least > 0.0


@pytest.mark.parametrize(
    ("masks", "mount"),
    [
        (((43.0, 47.0), (-47.0, -43.0)), (0.0, 0.0, 0.0)),
        (((40.0, 50.0), (-50.0, -40.0)), (-0.04, 0.0, 0.0)),
        (((85.0, 95.0), (-95.0, -85.0)), (0.1, 0.0, 0.0)),
        (((35.0, 55.0),), (0.0, 0.0, 0.0)),
        (((-2.0, 2.0),), (-0.1, 0.0, 0.0)),
        (((-5.0, 5.0),), (0.0, 0.0, 0.0)),
        (((130.0, 140.0), (-140.0, -130.0)), (-0.04, 0.0, 0.0)),
    ],
)
def test_a_robot_whose_own_posts_are_masked_turns_to_look_past_them_and_arrives(masks, mount):
    arrived, least = cross(Lidar(masks_deg=masks, mount=mount), 1)
    assert arrived
    assert least > 0.0


@pytest.mark.parametrize("step_s", [0.1 / 360, -0.1 / 360])
@pytest.mark.parametrize("yaw", [2.0, 3.0, -2.5])
def test_the_gap_of_a_circle_that_was_swept_in_a_turn_is_no_return_that_gets_lost(step_s, yaw):
    """In an empty place; the robot was held, "the LiDAR loses too much of what is there"."""
    lidar = Lidar(time_increment_s=step_s)
    drive = Drive(circles_world([(10.0, 10.0, 0.1)]), lidar, (0.0, 0.0, yaw), late_s=0.1)
    for _ in range(60):
        drive.tick(4.0, 0.0)
    assert drive.x > 3.9


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
