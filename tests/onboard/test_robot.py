"""One robot behind `Robot.tick`: the same as in the simulator, whatever form its inputs have."""

from __future__ import annotations

import array
import gc
import math
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from helpers import DT, make_sensor, place_sim, rig_of, scan_at, world_of
from robots import (
    ANGLES,
    OPEN,
    Driver,
    Header,
    LaserScan,
    box_left,
    brakes,
    forest,
    new_robot,
    wall_ahead,
    within,
)
from swarmscope.errors import ConfigError
from swarmscope.held import Held
from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import Lidar
from swarmscope.onboard.percept import MAX_INBOX, MAX_NEIGHBOURS
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.onboard.rig import Safety
from swarmscope.onboard.robot import Robot, Seen
from swarmscope.onboard.sensor import all_round
from swarmscope.onboard.sharing.message import MAX_PACKET_BYTES, OK, Head, decode, encode_request
from swarmscope.sim.cells import index_robots
from swarmscope.sim.motion import judge, move
from swarmscope.sim.radio import exchange
from swarmscope.sim.sensing import sense
from swarmscope.sim.state import Noise
from swarmscope.sim.world import Circle

ON_ROBOTS = [name for name in planner_names() if name != "oracle"]
every_planner = pytest.mark.parametrize("name", ON_ROBOTS)


def seen_by(percept):
    return [
        Seen(*(percept[f"neighbour_{f}"][k].item() for f in ("id", "x", "y", "yaw")))
        for k in range(percept["n_neighbours"])
    ]


def packets_of(percept):
    return [percept["packet"][k, : percept["packet_length"][k]].tobytes() for k in range(percept["n_packets"])]


def tick_as(robot, sim, i):
    """Tick a robot with what the simulator's robot i has just perceived."""
    p = sim.percepts[i]
    return robot.tick(
        scan=sim.ranges[i], now_s=p["now_s"], goal=(p["goal_bearing"], p["goal_distance"]),
        heading=p["compass"], speed=p["speed"], moved=(p["odom_x"], p["odom_y"], p["odom_yaw"]),
        neighbours=seen_by(p), inbox=packets_of(p),
    )  # fmt: skip


def drive_alike(name, lidar, noise):
    """Let robots and the simulator's perceive the same for 60 ticks; return how many packets they sent."""
    planner = load_planner(name)
    starts = [(-3.0, 0.0, 0.0), (-3.0, 0.9, 0.2), (3.0, 0.2, 3.0), (0.0, -3.0, 1.5)]
    goals = [(3.0, 0.3), (3.0, -0.5), (-3.0, 0.0), (0.0, 3.0)]
    world = world_of(Circle(center=(0.0, 0.0), radius=0.5), Circle(center=(-1.2, 0.6), radius=0.2))
    sensor = all_round(make_sensor(lidar.beams, math.radians(lidar.fov_deg), lidar.range_m))
    sim, swarm = place_sim(starts, goals, world, rig_of(sensor=sensor, speed_step_mps=Safety().speed_step_mps), noise)
    held, memory = Held(swarm), planner.new_memory(4)
    boots = sim.percepts["boot"].tolist()
    robots = [new_robot(name, lidar, address=i, boot=boot) for i, boot in enumerate(boots)]
    index_robots(sim)
    packets = 0
    for tick in range(60):
        sense(sim, tick, 0, 4)
        commands = [tick_as(robot, sim, i) for i, robot in enumerate(robots)]  # the step writes into what it is given
        planner.step_all(0, 4, held, memory, planner.params())
        for i, (robot, command) in enumerate(zip(robots, commands, strict=True)):
            d = sim.decisions[i]
            assert command[:2] == (d["v"], d["w"]), (tick, i, command)
            assert len(command.outbox) == d["n_out"]
            assert robot.rows.decision.tobytes() == d.tobytes()
            assert robot.rows.memory.tobytes() == memory[i].tobytes()
            packets += len(command.outbox)
        exchange(sim, tick)
        move(sim, tick, 0, 4)
        judge(sim, tick)
        index_robots(sim)
    assert (sim.robots["x"] != np.array(starts)[:, 0]).all()
    assert not any(robot.faults for robot in robots)
    return packets


SILENT = ("nav-i", "sfm-i", "dh-bug", "orca", "giwt-cnn", "giwt", "giwt-gat", "giwt-sage", "atlas", "atlas-mute")
"""Who asks nobody, or whom the scene gives no reason to."""


@every_planner
def test_it_does_what_the_simulators_robots_do(name):
    assert drive_alike(name, Lidar(), None) > 0 or name in SILENT


@pytest.mark.parametrize("name", ["nav-scope", "dh-bug", "orca"])
def test_so_it_does_with_a_limited_view_and_sensors_that_err(name):
    """What is remembered of scans, of lost returns and of the heading is the same, too."""
    errors = {"dropout": 0.05, "nan": 0.02, "compass_rad": 0.05, "range_fraction": 0.01, "odometry_scale": 0.02}
    drive_alike(name, Lidar(181, fov_deg=180.0), Noise(**errors))


FORMS = {
    "float64": lambda s: s.astype(np.float64),
    "list": lambda s: s.tolist(),
    "tuple": lambda s: tuple(s.tolist()),
    "array.array f": lambda s: array.array("f", s.tolist()),
    "array.array d": lambda s: array.array("d", s.tolist()),
    "memoryview": memoryview,
    "float16": lambda s: s.astype(np.float16).astype(np.float32),
    "every other of 720": lambda s: np.repeat(s, 2)[::2],
    "backwards twice": lambda s: s[::-1].copy()[::-1],
    "big-endian": lambda s: s.astype(">f4"),
    "read-only": lambda s: np.frombuffer(s.tobytes(), np.float32),
    "column": lambda s: np.asfortranarray(np.tile(s[:, None], (1, 3)))[:, 1],
    "masked": lambda s: np.ma.array(s, mask=np.zeros(360, bool)),
    "LaserScan": LaserScan,
    "LaserScan of a list": lambda s: LaserScan(s.tolist()),
    "LaserScan of array.array": lambda s: LaserScan(array.array("f", s.tolist())),
    "LaserScan, 32 bit header": lambda s: LaserScan(s, float(np.float32(-np.pi)), float(np.float32(np.pi / 180.0))),
    "clockwise LaserScan": lambda s: LaserScan(np.roll(s[::-1], 1), math.pi, -math.pi / 180.0),
    "0..2 pi LaserScan": lambda s: LaserScan(np.roll(s, 180), 0.0),
}


@pytest.mark.parametrize("form", FORMS)
def test_the_form_of_a_scan_does_not_matter(form):
    scan = np.where(np.isfinite(box_left()), 0.5, np.inf).astype(np.float32)
    plain, other = Driver(), Driver()
    for _ in range(6):
        assert other.tick(FORMS[form](scan)) == plain.tick(scan)
        assert other.robot.rows.scan.tobytes() == plain.robot.rows.scan.tobytes()
    assert plain.tick(scan).state == "follow"


SHEETS = {
    "clockwise": (Lidar(clockwise=True), math.pi - np.pi / 180.0 * np.arange(360)),
    "0..2 pi": (Lidar(first_deg=0.0), np.pi / 180.0 * np.arange(360)),
    "clockwise from 0": (Lidar(first_deg=0.0, clockwise=True), -np.pi / 180.0 * np.arange(360)),
    "turned on the body": (Lidar(mount=(0.0, 0.0, math.pi / 2)), ANGLES + math.pi / 2),
    "upside down, turned": (
        Lidar(clockwise=True, mount=(0.0, 0.0, -0.5 * math.pi)),
        0.5 * math.pi - np.pi / 180.0 * np.arange(360),
    ),
}


@pytest.mark.parametrize("sheet", SHEETS)
@pytest.mark.parametrize("scene", [wall_ahead, box_left])
def test_the_order_of_the_beams_does_not_matter(sheet, scene):
    lidar, angles = SHEETS[sheet]
    plain, other = Driver(), Driver(new_robot(lidar=lidar))
    plain_scan, other_scan = scene(), scene(np.round(np.degrees(angles)) * np.pi / 180.0)
    for _ in range(6):
        expected, found = plain.tick(plain_scan), other.tick(other_scan)
        assert found[:2] == pytest.approx(expected[:2], abs=1e-6)
        assert found[2:] == expected[2:]
        assert found.v < 0.01 or abs(other.robot.rows.decision["heading"]) > 0.5


@pytest.mark.parametrize("mount", [(0.1, 0.0, 0.0), (-0.1, 0.05, 0.0), (0.0, 0.12, 1.0), (0.05, -0.1, -2.5)])
def test_a_sensor_off_the_centre_sees_the_same_world(mount):
    robot, world, rig = new_robot(lidar=Lidar(mount=mount)), forest(), rig_of()
    driver = Driver(robot, speed=0.3)
    driver.tick(scan_at(world, rig, *mount))
    there, here = robot.rows.scan, scan_at(world, rig)
    both = np.isfinite(there) & np.isfinite(here)
    assert both.sum() > 50
    assert (np.abs(there[both] - here[both]) < 0.05).mean() > 0.8
    assert (there <= here + 0.02).mean() >= 0.95


@pytest.mark.parametrize("mount", [(0.1, 0.0, 0.0), (-0.12, 0.0, math.pi)])
def test_a_wall_is_where_it_is_for_the_body(mount):
    """A wall 0.35 m before the body's centre, seen by a sensor nearer to or farther from it."""
    angles = ANGLES + mount[2]
    scan = (0.35 - mount[0]) / np.maximum(np.cos(angles), 1e-6)
    scan[(np.cos(angles) < 0.5)] = np.inf
    driver = Driver(new_robot(lidar=Lidar(mount=mount)))
    driver.tick(scan.astype(np.float32))
    assert driver.robot.rows.scan[180] == pytest.approx(0.35, abs=1e-3)
    driver.always["speed"] = 0.3
    assert driver.tick(scan.astype(np.float32)).v < 0.2


def test_laser_scans_of_other_geometry_are_turned_into_the_data_sheets():
    world = forest()
    here = scan_at(world, rig_of())
    turn = 2.0 * math.pi
    for beams, first, step in ((720, -math.pi, turn / 720), (361, -math.pi, turn / 360), (360, 0.0, turn / 359)):
        fine = scan_at(world, rig_of(), 0.0, 0.0, 0.0)
        angles = first + step * np.arange(beams)
        nearest = np.round(np.degrees(np.remainder(angles + np.pi, 2 * np.pi))).astype(int) % 360
        driver = Driver()
        assert driver.tick(LaserScan(fine[nearest], first, step)).ok
        there = driver.robot.rows.scan
        both = np.isfinite(there) & np.isfinite(here)
        assert (np.abs(there[both] - here[both]) < 0.1).mean() > 0.8, beams
    assert driver.tick(LaserScan(fine, range_min=0.2)).ok


def test_a_laser_scan_of_half_the_field_is_blind_in_the_other():
    driver = Driver()
    driver.tick(LaserScan(OPEN[:181], -0.5 * math.pi))
    scan = driver.robot.rows.scan
    assert np.isinf(scan[92:268]).all()
    assert not np.isinf(scan[:85]).any()
    assert not np.isinf(scan[-85:]).any()


def test_the_stamp_in_the_header_counts_and_0_is_none():
    driver = Driver()
    driver.ticks(3)
    assert driver.tick(LaserScan(OPEN, header=Header(driver.now_s + DT))).ok
    assert brakes(driver.tick(LaserScan(OPEN, header=Header(100.0))))
    assert driver.tick(LaserScan(OPEN, header=Header(0.0))).ok


def test_seen_beyond_the_longest_range_is_no_return():
    driver = Driver()
    assert driver.tick(np.full(360, 5.5)) == Driver().tick(OPEN)
    assert np.isinf(driver.robot.rows.scan).all()


def test_without_a_new_scan_the_last_one_is_moved_on():
    """Towards a wall, a new scan in every third tick: the walls come nearer by what was driven."""
    driver, world, rig = Driver(goal=(0.0, 5.0)), world_of(Circle(center=(3.0, 0.0), radius=1.0)), rig_of()
    x, before = 0.0, 0.0
    for k in range(12):
        scan = scan_at(world, rig, x, 0.0) if k % 3 == 0 else None
        command = driver.tick(scan, moved=(x - before, 0.0, 0.0), speed=0.5)
        assert command.ok
        assert driver.robot.rows.scan[180] == pytest.approx(2.0 - x, abs=2e-3)
        before, x = x, x + 0.1


def test_turning_without_a_new_scan_turns_the_last_one():
    driver = Driver()
    driver.tick(box_left())
    driver.tick(None, moved=(0.0, 0.0, math.radians(20.0)), heading=math.radians(20.0))
    np.testing.assert_allclose(driver.robot.rows.scan, np.roll(box_left(), -20), rtol=1e-5)


@pytest.mark.parametrize("every", [2, 3, 4])
def test_driving_by_moved_on_scans_touches_nothing(every):
    """A robot in the forest, its scans late or missing: driven in a plain world of our own."""
    robot, world, rig = new_robot(), forest(1), rig_of()
    goal, (x, y, yaw, v) = (4.0, 3.0), (0.0, 0.0, 0.0, 0.0)
    driver, moved = Driver(robot), (0.0, 0.0, 0.0)
    nearest, kept = math.inf, None
    for k in range(150):
        scan = scan_at(world, rig, x, y, yaw)
        nearest = min(nearest, scan.min())
        kept = scan if k % every == 0 else None
        gx, gy = goal[0] - x, goal[1] - y
        command = driver.tick(
            kept, goal=(math.atan2(gy, gx) - yaw, math.hypot(gx, gy)), heading=yaw, speed=v, moved=moved
        )
        assert within(command, Body())
        x0, y0, yaw0 = x, y, yaw
        for _ in range(20):
            v += max(-0.02, min(0.02, command.v - v))
            yaw += command.w * DT / 20
            x, y = x + v * DT / 20 * math.cos(yaw), y + v * DT / 20 * math.sin(yaw)
        dx, dy = x - x0, y - y0
        c, s = math.cos(yaw0), math.sin(yaw0)
        moved = (c * dx + s * dy, c * dy - s * dx, yaw - yaw0)
    assert nearest > 0.15
    assert math.hypot(goal[0] - x, goal[1] - y) < 0.3
    assert robot.faults["stale scan"] == 0


def test_a_late_scan_is_moved_on_by_its_age():
    driver = Driver()
    driver.ticks(3, moved=(0.1, 0.0, 0.0))
    driver.tick(box_left(), scan_s=driver.now_s + 0.5 * DT, moved=(0.1, 0.0, 0.0))
    assert driver.robot.rows.scan[182] == pytest.approx(0.45, abs=2e-3)


def test_the_same_scan_again_is_no_new_one():
    driver = Driver()
    driver.tick(OPEN)
    stamp = driver.now_s
    for _ in range(3):
        assert driver.tick(OPEN, scan_s=stamp).ok
    stale = driver.tick(OPEN, scan_s=stamp)
    assert brakes(stale)
    assert "0.8 s old" in stale.reason


def test_two_robots_ask_answer_and_fuse():
    """One in front of an obstacle, one beside it: a request of 9 bytes, an answer of 12 + 2 n, and a fused choice."""
    world, rig = world_of(Circle(center=(2.2, 0.05), radius=0.5), Circle(center=(0.5, -2.0), radius=0.3)), rig_of()
    a, b = Driver(new_robot(address=1), goal=(0.0, 6.0)), Driver(new_robot(address=2), goal=(0.0, 0.0))
    to_a, lengths, fused, x = [], [], [], 0.0
    for _ in range(25):
        before = x
        mail = to_a
        command = a.tick(
            scan_at(world, rig, x, 0.0), goal=(0.0, 6.0 - x), speed=0.25, inbox=mail, moved=(0.05, 0.0, 0.0),
            neighbours=[Seen(2, 1.0 - x, 1.2)],
        )  # fmt: skip
        x = before + (0.05 if x < 0.9 else 0.0)
        assert all(to == 2 for to, _ in command.outbox)
        lengths += [len(packet) for _, packet in command.outbox]
        reply = b.tick(
            scan_at(world, rig, 1.0, 1.2), inbox=[packet for _, packet in command.outbox],
            neighbours=[Seen(1, x - 1.0, -1.2)],
        )  # fmt: skip
        assert all(to == 1 for to, _ in reply.outbox)
        to_a = [packet for _, packet in reply.outbox]
        lengths += [len(packet) for packet in to_a]
        if a.robot.rows.decision["fused"]:
            fused.append((int(a.robot.rows.decision["heard"]), command.reason))
    assert 9 in lengths
    assert any(length >= 14 and length % 2 == 0 for length in lengths)
    assert (1, "obstacle ahead: chose a side with the neighbours' features") in fused
    assert not a.robot.faults
    assert not b.robot.faults


def test_more_packets_than_a_tick_takes_wait_for_the_next():
    driver = Driver()
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    requests = []
    for sender in range(100, 112):
        length = encode_request(Head(sender, 0, 1, 0), out)
        requests.append(out[:length].tobytes())
    first, second = driver.tick(inbox=requests), driver.tick()
    assert [to for to, _ in first.outbox] == list(range(100, 100 + MAX_INBOX))
    assert [to for to, _ in second.outbox] == list(range(100 + MAX_INBOX, 112))
    assert not driver.robot.faults


def test_an_outbox_can_be_handed_over_as_it_is():
    driver = Driver()
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    length = encode_request(Head(9, 0, 1, 0), out)
    assert driver.tick(inbox=[(7, out[:length].tobytes())]).outbox[0][0] == 9
    length = encode_request(Head(9, 0, 2, 0), out)
    assert driver.tick(inbox=[out[:length]]).outbox[0][0] == 9
    length = encode_request(Head(9, 0, 3, 0), out)
    assert driver.tick(inbox=[bytearray(out[:length].tobytes())]).outbox[0][0] == 9


def test_the_nearest_neighbours_are_kept_nearest_first():
    driver = Driver()
    driver.tick(neighbours=[Seen(k, 20.0 - k, 0.0) for k in range(20)])
    percept = driver.robot.rows.percept
    assert percept["n_neighbours"] == MAX_NEIGHBOURS
    assert percept["neighbour_id"].tolist() == [k for k in range(19, 8, -1) if k != 7][:MAX_NEIGHBOURS]
    assert [seen.address for seen in driver.robot.seen] == percept["neighbour_id"].tolist()


def test_a_larger_neighbour_is_kept_clear_of_by_its_own_size():
    """Its nearest surface counts: with three times our radius the robot slows down that much earlier."""
    small, large = Driver(speed=0.5), Driver(speed=0.5)
    v_small = small.tick(neighbours=[Seen(1, 0.7, 0.0)]).v
    v_large = large.tick(neighbours=[Seen(1, 1.0, 0.0, radius_m=0.45)]).v
    assert v_small == pytest.approx(v_large)
    assert v_small < Driver(speed=0.5).tick(neighbours=[Seen(1, 1.0, 0.0, radius_m=0.1)]).v
    assert Driver(speed=0.5).tick(neighbours=[Seen(1, 0.2, 0.0, radius_m=2.0)]).v < 0.5


@every_planner
def test_a_warm_robot_never_compiles(name):
    robot = new_robot(name, lidar=Lidar(mount=(0.05, 0.0, 0.0)))
    before = signatures()
    driver, rng = Driver(robot), np.random.default_rng(0)
    for scan in [form(box_left()) for form in FORMS.values()] + [None, "no scan", np.zeros(3)]:
        driver.tick(
            scan, goal=(np.float32(0.1), 5), heading=1, speed=np.float64(0.2), moved=[0.01, 0, np.float32(0.1)],
            neighbours=[Seen(np.int64(3), 1, np.float32(0.5), speed=1, radius_m=0.3), (4, 2.0, 0.0)],
            inbox=[b"", rng.bytes(7), bytearray(10), memoryview(bytes(42)), np.zeros(MAX_PACKET_BYTES, np.uint8)],
        )  # fmt: skip
    assert signatures() == before
    assert robot.faults["scan"] == 2


def signatures():
    """How many signatures every compiled function of the package has."""
    return {
        (module, name): len(value.signatures)
        for module in sorted(m for m in sys.modules if m.startswith("swarmscope"))
        for name, value in vars(sys.modules[module]).items()
        if hasattr(value, "signatures") and hasattr(value, "py_func")
    }


def test_warming_up_says_what_it_did():
    said = []
    robot = Robot("nav-scope", Body(), Lidar(), address=1)
    done = robot.warm_up(said.append)
    assert set(done.compiled) | set(done.loaded) == {"step_nav_scope", "settle", "reproject", "straighten"}
    assert done.seconds > 0.0
    assert said[0].startswith("nav-scope: ")
    assert robot.warm_up().compiled == ()


def test_warming_up_does_not_touch_a_robot_at_work():
    driver, other = Driver(), Driver()
    for k in range(6):
        if k == 3:
            other.robot.warm_up()
        assert driver.tick(box_left()) == other.tick(box_left())


def test_a_tick_before_the_warm_up_warms_up_and_brakes():
    driver = Driver(Robot("nav-scope", Body(), Lidar(), address=1))
    first = driver.tick()
    assert brakes(first)
    assert "warm_up" in first.reason
    assert driver.tick().v == 0.5
    assert dict(driver.robot.faults) == {"not warmed up": 1}


def test_a_reset_robot_is_as_new():
    driver = Driver()
    driver.ticks(8, box_left(), neighbours=[Seen(1, 1.0, 1.0)])
    driver.robot.reset()
    again, fresh = Driver(driver.robot), Driver()
    again.k = fresh.k = 1000
    for _ in range(6):
        assert again.tick(box_left()) == fresh.tick(box_left())


def test_every_start_has_a_boot_number_of_its_own():
    drawn = {new_robot().boot for _ in range(8)}
    assert len(drawn) > 1  # all alike: one in 2 ** 112
    assert all(0 <= boot < 65536 for boot in drawn)
    robot = new_robot(boot=65535)
    assert (robot.boot, int(robot.rows.percept["boot"])) == (65535, 65535)
    robot.reset()
    assert (robot.boot, int(robot.rows.percept["boot"])) == (0, 0)


@pytest.mark.parametrize("boot", [-1, 65536, 1.5, math.nan])
def test_an_impossible_boot_number_is_refused(boot):
    with pytest.raises(ConfigError, match="boot"):
        new_robot(boot=boot)


def test_a_robot_that_restarts_is_heard_and_hears_again():
    """Both counters begin anew; what was under way before the restart is dropped."""
    driver = Driver(new_robot(address=1, boot=7))
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)

    def answered(boot, seq):
        packet = out[: encode_request(Head(9, boot, seq, 0), out)].tobytes()
        return [to for to, _ in driver.tick(inbox=[packet]).outbox] == [9]

    assert all(answered(3, seq) for seq in range(100, 110))
    assert [answered(4, seq) for seq in range(1, 6)] == [False, True, True, True, True]
    driver.robot.reset()
    assert [answered(4, seq) for seq in range(6, 9)] == [True, True, True]
    reply = driver.tick(inbox=[out[: encode_request(Head(9, 4, 9, 0), out)].tobytes()]).outbox[0][1]
    header = np.zeros(6, np.int64)
    assert decode(np.frombuffer(reply, np.uint8).copy(), len(reply), header) == OK
    assert (header[1], header[3], header[5]) == (1, 4 ^ 9, 8)


def test_the_zero_of_the_clock_does_not_matter():
    plain, unix = Driver(), Driver()
    unix.k = int(1.7e9 / DT)
    for _ in range(20):
        a, b = plain.tick(box_left()), unix.tick(box_left())
        assert (a.v, a.w) == pytest.approx((b.v, b.w), abs=1e-6)
        assert a.reason == b.reason


def test_parameters_and_options_reach_planner_and_rig():
    options = {"look_ahead_m": 1, "clearance_m": 0.05, "sector": True}
    robot = Robot("nav-scope", Body(), Lidar(), address=1, params={"w_i": 0}, **options)
    assert robot.params.w_i == 0.0
    assert robot.rows.rig.look_ahead == 1.0
    assert robot.rows.rig.guarding.clearance_m == 0.05
    assert robot.rows.rig.body == Body()


def test_a_robots_memory_does_not_grow():
    driver = Driver()
    arguments = {"neighbours": [Seen(k, 1.0 + k, 1.0) for k in range(15)], "inbox": [bytes(7)] * 50}

    def blocks():
        driver.ticks(800, **arguments)
        gc.collect()
        return sys.getallocatedblocks()

    blocks()
    before = blocks()
    assert blocks() - before < 200


def test_the_example_runs():
    example = Path(__file__).resolve().parents[2] / "examples" / "robot.py"
    done = subprocess.run([sys.executable, str(example)], capture_output=True, text=True, check=True, timeout=600)
    lines = done.stdout.splitlines()
    assert any(line.endswith("3 -> 7: 9 bytes") for line in lines)
    assert any("7 -> 3: " in line for line in lines)
    assert any(line.endswith("chose a side with the neighbours' features") for line in lines)
    assert lines[-1].startswith("both arrived after ")
    assert lines[-1].endswith("faults: {3: {}, 7: {}}")


def test_a_robot_in_the_place_of_a_recording_says_why_it_does_what():
    example = Path(__file__).resolve().parents[2] / "examples" / "recording.py"
    done = subprocess.run([sys.executable, str(example)], capture_output=True, text=True, check=True, timeout=600)
    ticks = {words: int(count) for count, words in re.findall(r"(\d+) ticks  (.*)", done.stdout)}
    assert sum(ticks.values()) == 225 and len(ticks) > 3
    assert ticks["arrived: arrived at the goal"] == 1
    assert not any(words.startswith("brakes") for words in ticks)
