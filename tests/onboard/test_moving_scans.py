"""Scans whose readings were taken one after the other while the robot drove: at 1 m/s and 5 Hz, turning or not."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import DT, rig_of, scan_at
from robots import Driver, Header, LaserScan, brakes, forest, new_robot
from swarmscope.errors import ConfigError
from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.robot import Robot
from swarmscope.onboard.trail import poses_at

PERIOD_S, BEAMS = 0.2, 360
STEP_S = PERIOD_S / BEAMS
ROOM = (-2.5, 3.5, -1.0, 1.2)
"""Walls at x, x, y, y [m]."""
FAST = Body(v_max_mps=1.0)


def pose_on_arc(t, v, w):
    if w == 0.0:
        return v * t, 0.0, 0.0
    return v / w * math.sin(w * t), v / w * (1.0 - math.cos(w * t)), w * t


def range_in_room(x, y, angle, room=ROOM):
    """How far a ray goes; walls are met from inside."""
    c, s = math.cos(angle), math.sin(angle)
    along = [(wall - at) / d for wall, at, d in zip(room, (x, x, y, y), (c, c, s, s), strict=True) if abs(d) > 1e-12]
    return min(length for length in along if length > 0.0)


def scan_on_arc(t0, v, w, step_s=STEP_S, first=-math.pi, step=2.0 * math.pi / BEAMS, mount=(0.0, 0.0)):
    """A scan that began at t0."""
    found = []
    for n in range(BEAMS):
        x, y, yaw = pose_on_arc(t0 + n * step_s, v, w)
        c, s = math.cos(yaw), math.sin(yaw)
        sensor = x + c * mount[0] - s * mount[1], y + s * mount[0] + c * mount[1]
        found.append(range_in_room(*sensor, yaw + first + n * step))
    return np.array(found, np.float32)


def off_the_walls(ranges, pose, directions=None):
    """How far each return lies from the nearest wall of the room, seen from a pose."""
    angles = pose[2] + (-math.pi + 2.0 * math.pi / BEAMS * np.arange(BEAMS) if directions is None else directions)
    seen = np.isfinite(ranges)
    x, y = pose[0] + ranges[seen] * np.cos(angles[seen]), pose[1] + ranges[seen] * np.sin(angles[seen])
    walls = np.abs(np.stack([x - ROOM[0], x - ROOM[1], y - ROOM[2], y - ROOM[3]]))
    return walls.min(axis=0)


def driven(lidar, v, w, scan_of, ticks=3):
    """What a robot of this LiDAR sees when it has driven an arc, a scan in every tick, and where it is then."""
    driver = Driver(Robot("nav-scope", FAST, lidar, address=1))
    driver.robot.warm_up()
    before = (0.0, 0.0, 0.0)
    for k in range(1, ticks + 1):
        pose = pose_on_arc(k * PERIOD_S, v, w)
        c, s = math.cos(before[2]), math.sin(before[2])
        dx, dy = pose[0] - before[0], pose[1] - before[1]
        moved = (c * dx + s * dy, c * dy - s * dx, pose[2] - before[2])
        command = driver.tick(scan_of((k - 1) * PERIOD_S), scan_s=(k - 1) * PERIOD_S, speed=v, moved=moved)
        assert command.ok, command.reason
        before = pose
    return driver.robot.rows.scan, before


@pytest.mark.parametrize(("v", "w"), [(1.0, 0.0), (1.0, 1.0), (1.0, -1.5), (0.3, 2.0)])
def test_walls_come_out_straight(v, w):
    """All but what nobody has seen, where a robot that turns against the beams has left a gap, and corners."""
    found, here = driven(Lidar(time_increment_s=STEP_S), v, w, lambda t: scan_on_arc(t, v, w))
    off, unseen = off_the_walls(found, here), max(0.0, -w * PERIOD_S / math.radians(1.0))
    assert (off > 0.003).sum() <= unseen + 6
    assert off.max() < (0.02 if unseen == 0.0 else 1.0)
    bent, here = driven(Lidar(), v, w, lambda t: scan_on_arc(t, v, w))
    assert (off_the_walls(bent, here) > 0.03).sum() > 50


BACKWARDS = {"first": math.pi, "step": -2.0 * math.pi / BEAMS}
SHEETS = {
    "clockwise": (Lidar(clockwise=True, time_increment_s=STEP_S), BACKWARDS),
    "from straight ahead": (Lidar(first_deg=0.0, time_increment_s=STEP_S), {"first": 0.0}),
    "off the centre": (Lidar(mount=(0.1, -0.05, 0.0), time_increment_s=STEP_S), {"mount": (0.1, -0.05)}),
    "upside down": (Lidar(upside_down=True, time_increment_s=STEP_S), BACKWARDS),
    "half the period": (Lidar(time_increment_s=0.5 * STEP_S), {"step_s": 0.5 * STEP_S}),
}


@pytest.mark.parametrize("sheet", SHEETS)
@pytest.mark.parametrize("w", [0.8, -0.8])
def test_so_they_do_for_every_lidar(sheet, w):
    lidar, cast = SHEETS[sheet]
    found, here = driven(lidar, 1.0, w, lambda t: scan_on_arc(t, 1.0, w, **cast))
    off = off_the_walls(found, here)
    gap = 10 * ((w < 0.0) == (cast.get("step", 1.0) > 0.0))
    assert (off > 0.003).sum() <= gap + 6 + 4 * lidar.mount.count(0.1)


def test_a_message_says_how_long_a_scan_takes():
    """Its time_increment counts when it says one, and the data sheet's when it says 0."""
    for step_s in (STEP_S, 0.0):
        found, here = driven(
            Lidar(time_increment_s=STEP_S),
            1.0,
            1.0,
            lambda t, step_s=step_s: LaserScan(scan_on_arc(t, 1.0, 1.0), time_increment=step_s, header=Header(t)),
        )
        assert (off_the_walls(found, here) > 0.003).sum() <= 6


@pytest.mark.parametrize("told", [STEP_S, -STEP_S, math.nan, "long"])
def test_a_scan_that_takes_longer_than_the_guard_counts_on_brakes(told):
    driver = Driver(new_robot())
    command = driver.tick(LaserScan(np.full(BEAMS, np.inf), time_increment=told))
    assert brakes(command) and "lidar.time_increment_s" in command.reason and driver.robot.faults["scan"] == 1
    assert driver.tick(LaserScan(np.full(BEAMS, np.inf), time_increment=0.05 * STEP_S)).ok


def test_the_guard_counts_on_the_oldest_reading():
    robot = new_robot(lidar=Lidar(time_increment_s=STEP_S), latency_s=0.05)
    assert robot.rows.rig.guarding.latency_s == pytest.approx(0.05 + STEP_S * (BEAMS - 1))
    assert new_robot().rows.rig.guarding.latency_s == 0.0


def test_the_stamp_is_that_of_the_first_reading():
    driver = Driver(new_robot(lidar=Lidar(time_increment_s=STEP_S)))
    driver.ticks(2)
    command = driver.tick(np.full(BEAMS, np.inf), scan_s=driver.now_s + PERIOD_S)
    assert brakes(command) and "the stamp is that of the first" in command.reason
    assert driver.tick(np.full(BEAMS, 0.5), scan_s=driver.now_s).ok
    assert driver.tick(np.full(BEAMS, 0.5)).ok


def test_a_robot_that_stands_sees_its_scan_as_it_is():
    driver = Driver(new_robot(lidar=Lidar(time_increment_s=STEP_S)))
    scan = scan_on_arc(0.0, 0.0, 0.0)
    driver.ticks(3, scan)
    assert driver.robot.rows.scan.tobytes() == scan.tobytes()


@pytest.mark.parametrize(
    ("value", "words"), [(0.1, "35.9 s"), (0.002, "it may take 0.4 s"), (math.inf, "finite"), ("1", "finite")]
)
def test_impossible_times_are_refused(value, words):
    with pytest.raises(ConfigError, match=words):
        Robot("nav-scope", FAST, Lidar(time_increment_s=value), address=1)


def test_between_stamps_a_robot_drove_an_arc():
    stamps = np.array([0.0, 1.0, 2.0])
    poses = np.array([(0.0, 0.0, 3.0), (math.sin(1.0), 1.0 - math.cos(1.0), 4.0), (math.sin(1.0), 1.0, 4.0)])
    poses[:, 2] = np.remainder(poses[:, 2] + math.pi, 2.0 * math.pi) - math.pi
    quarter = poses_at(np.array([-1.0, 0.0, 0.5, 1.0, 1.5, 9.0]), stamps, poses)
    assert quarter[[0, 1]].tolist() == [[0.0, 0.0, pytest.approx(3.0 - 2.0 * math.pi)]] * 2
    assert quarter[2] == pytest.approx([math.sin(0.5), 1.0 - math.cos(0.5), 3.5 - 2.0 * math.pi])
    assert quarter[4, :2] == pytest.approx([math.sin(1.0), 0.5 * (2.0 - math.cos(1.0))])
    assert quarter[[3, 5]] == pytest.approx(poses[1:])


@pytest.mark.parametrize(("seed", "first_deg"), [(0, None), (2, 0.0)])
def test_driving_with_a_lidar_that_turns_touches_nothing(seed, first_deg):
    """At 1 m/s through the forest, the readings of each scan spread over the whole period between two ticks."""
    world, rig, goal, parts = forest(seed), rig_of(), (4.2, 3.2), 12
    robot = Robot("nav-scope", FAST, Lidar(first_deg=first_deg, time_increment_s=STEP_S), address=1)
    robot.warm_up()
    driver, (x, y, yaw, v), moved = Driver(robot), (0.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    way, nearest = [(x, y, yaw)] * parts, math.inf
    for _ in range(90):
        scan = np.empty(BEAMS, np.float32)
        for part, pose in zip(np.array_split(np.arange(BEAMS), parts), way, strict=True):
            there = scan_at(world, rig, *pose)
            scan[part] = there[part if first_deg is None else (part + 180) % 360]
            nearest = min(nearest, there.min())
        gx, gy = goal[0] - x, goal[1] - y
        if math.hypot(gx, gy) < 0.3:
            break
        bearing = math.atan2(gy, gx) - yaw
        command = driver.tick(
            scan, scan_s=driver.now_s, goal=(bearing, math.hypot(gx, gy)), heading=yaw, speed=v, moved=moved
        )
        assert command.ok
        x0, y0, yaw0, way = x, y, yaw, []
        for _ in range(parts):
            way.append((x, y, yaw))
            v += max(-2.0 * DT / parts, min(2.0 * DT / parts, command.v - v))
            yaw += command.w * DT / parts
            x, y = x + v * DT / parts * math.cos(yaw), y + v * DT / parts * math.sin(yaw)
        dx, dy, c, s = x - x0, y - y0, math.cos(yaw0), math.sin(yaw0)
        moved = (c * dx + s * dy, c * dy - s * dx, yaw - yaw0)
    assert nearest > 0.15 and math.hypot(goal[0] - x, goal[1] - y) < 0.3


@pytest.mark.parametrize("clockwise", [False, True])
@pytest.mark.parametrize("fov", [180.0, 270.0])
def test_the_edges_of_a_field_bar_nothing_that_was_seen(fov, clockwise):
    """In the open; once the outermost ray stood as a wall from the body outwards, and nothing was safe."""
    beams = int(fov) + 1
    lidar = Lidar(beams, fov_deg=fov, clockwise=clockwise, time_increment_s=PERIOD_S / beams)
    found, _ = driven(lidar, 0.5, 0.0, lambda t: np.full(beams, np.inf))
    assert np.isinf(found).all()
