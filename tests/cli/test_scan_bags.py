"""Scans from bags that the library itself has written: rosbag2 in both storages, MCAP alone, ROS 1."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np
import pytest
from command_line import refused, swarmscope
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

from swarmscope.errors import InputFileError, MissingExtraError
from swarmscope.sim import scan_bags, scan_read
from swarmscope.sim.scan_files import load_scans
from swarmscope.sim.scan_read import Ask

SCAN, ODOMETRY, TEXT = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry", "std_msgs/msg/String"
STORES = {kind: get_typestore(kind) for kind in (Stores.ROS1_NOETIC, Stores.ROS2_HUMBLE)}
RANGES = np.array([1.0, np.inf, np.nan, 0.0, 11.0], np.float32)


def types_of(first):
    return STORES[Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE]


def header(types, seconds):
    kinds = types.types
    stamp = kinds["builtin_interfaces/msg/Time"](sec=int(seconds), nanosec=round(1e9 * (seconds % 1.0)))
    more = {"seq": 0} if "seq" in kinds["std_msgs/msg/Header"].__dataclass_fields__ else {}
    return kinds["std_msgs/msg/Header"](stamp=stamp, frame_id="laser", **more)


def scan(types, seconds, ranges=RANGES, **fields):
    values = {"angle_min": 1.0, "angle_max": -1.0, "angle_increment": -0.5, "time_increment": 0.01, "scan_time": 0.1}
    values |= {"range_min": 0.1, "range_max": 10.0, "intensities": np.ones(len(ranges), np.float32)} | fields
    return types.types[SCAN](header=header(types, seconds), ranges=ranges, **values)


def odometry(types, seconds, x, y, yaw):
    def make(kind, *fields):
        return types.types[f"geometry_msgs/msg/{kind}"](*fields)

    turned = make("Quaternion", 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))
    pose = make("PoseWithCovariance", make("Pose", make("Point", x, y, 0.0), turned), np.zeros(36))
    rest = make("Twist", make("Vector3", 0.0, 0.0, 0.0), make("Vector3", 0.0, 0.0, 0.0))
    return types.types[ODOMETRY](header(types, seconds), "base", pose, make("TwistWithCovariance", rest, np.zeros(36)))


def write(place: Path, messages_of, kind="sqlite3") -> Path:
    """Write (topic, message type, message, seconds) of ``messages_of(types)``; return what is to be read."""
    first = kind == "ros1"
    types = types_of(first)
    path = place / ("drive.bag" if first else f"drive_{kind}")
    storage = {"sqlite3": StoragePlugin.SQLITE3, "mcap": StoragePlugin.MCAP, "mcap alone": StoragePlugin.MCAP}
    with Writer1(path) if first else Writer2(path, version=9, storage_plugin=storage[kind]) as writer:
        connections = {}
        for topic, name, message, seconds in messages_of(types):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, name, typestore=types)
            raw = (types.serialize_ros1 if first else types.serialize_cdr)(message, name)
            writer.write(connections[topic], round(1e9 * seconds), raw)
    return next(path.glob("*.mcap")) if kind == "mcap alone" else path


def two_scans(types):
    yield "/odom", ODOMETRY, odometry(types, 99.0, 1.0, 2.0, 3.0), 99.0
    yield "/scan", SCAN, scan(types, 100.0), 100.1
    yield "/scan", SCAN, scan(types, 100.5, RANGES[:4]), 100.6
    yield "/odom", ODOMETRY, odometry(types, 101.0, 1.0, 4.0, 3.0), 101.0


@pytest.mark.parametrize("kind", ["sqlite3", "mcap", "mcap alone", "ros1"])
def test_every_kind_of_bag(tmp_path, kind):
    log = load_scans(write(tmp_path, two_scans, kind))
    expected = [1.0, np.inf, np.nan, 0.0, np.inf]
    np.testing.assert_array_equal(log.ranges_m, [expected, [*expected[:4], np.nan]])
    assert log.lengths.tolist() == [5, 4] and log.geometry is None and log.notes == ()
    assert (log.angle_min, log.increment, log.range_max) == (1.0, -0.5, 10.0)
    assert (log.range_min, log.time_increment) == pytest.approx((0.1, 0.01))
    assert log.stamp_s == pytest.approx([0.0, 0.5])
    assert log.odom == pytest.approx(np.array([[1.0, 3.0, 3.0], [1.0, 3.5, 3.0]]))


def test_through_the_command_line(tmp_path):
    said = swarmscope("perceive", write(tmp_path, two_scans), "--every", 2)
    assert said.exit_code == 0 and "│ 1 │" in " ".join(said.stdout.split())
    assert "put right for the robot's own motion" in swarmscope("perceive", write(tmp_path, two_scans, "ros1")).stdout


def test_the_topic_is_asked_for_when_there_are_several(tmp_path):
    def messages(types):
        for topic, far in (("/front/scan", 1.0), ("/back/scan", 2.0)):
            yield topic, SCAN, scan(types, 1.0, np.full(5, far, np.float32)), 1.0
        yield "/said", TEXT, types.types[TEXT]("x"), 1.0

    bag = write(tmp_path, messages)
    assert "choose with --topic: /back/scan, /front/scan" in refused("perceive", bag)
    assert "did you mean '/front/scan'" in refused("perceive", bag, "--topic", "/fron/scan")
    assert "valid: /back/scan, /front/scan" in refused("perceive", bag, "--topic", "/said")
    for topic in ("/back/scan", "back/scan"):
        assert (load_scans(bag, Ask(topic=topic)).ranges_m == 2.0).all()


def test_a_topic_of_what_is_no_bag_is_refused(tmp_path):
    (tmp_path / "a.csv").write_text("1,2,3,4,5,6,7,8\n")
    assert "--topic: " in refused("perceive", tmp_path / "a.csv", "--topic", "/scan")


def test_a_bag_without_scans_says_what_it_holds(tmp_path):
    bag = write(tmp_path, lambda types: [("/said", TEXT, types.types[TEXT]("x"), 1.0)])
    assert "holds no LaserScan; its topics are: /said (std_msgs/msg/String)" in refused("perceive", bag)


def test_scans_may_lie_along_other_rays_and_run_backwards(tmp_path):
    def messages(types):
        yield "/scan", SCAN, scan(types, 2.0), 2.0
        yield "/scan", SCAN, scan(types, 1.0, angle_min=0.75, range_max=9.0), 2.1
        for name in ("/a", "/b"):
            yield name, ODOMETRY, odometry(types, 1.0, 0.0, 0.0, 0.0), 2.2

    log = load_scans(write(tmp_path, messages))
    assert log.geometry.tolist() == [[1.0, -0.5], [0.75, -0.5]]
    assert np.isnan(log.stamp_s).all() and log.odom is None
    for words in ("odometry is on /a, /b", "ranges change", "stamps run backwards"):
        assert any(words in note for note in log.notes)


def test_a_message_without_a_stamp_has_the_time_of_recording(tmp_path):
    log = load_scans(write(tmp_path, lambda types: [("/s", SCAN, scan(types, 0.0), at) for at in (5.0, 5.25)]))
    assert log.stamp_s == pytest.approx([0.0, 0.25])


def test_long_bags_are_read_as_far_as_there_is_room(tmp_path, monkeypatch):
    bag = write(tmp_path, lambda types: [("/s", SCAN, scan(types, at), at) for at in np.arange(1.0, 9.0)])
    monkeypatch.setattr(scan_bags, "MOST_READINGS", 17)
    monkeypatch.setattr(scan_read, "MOST_READINGS", 17)
    log = load_scans(bag)
    assert len(log.ranges_m) == 3 and "only the first 3 scans are read; --every 10" in log.notes[0]
    assert load_scans(bag, Ask(every=3)).stamp_s == pytest.approx([0.0, 3.0, 6.0])


@pytest.mark.parametrize("kind", ["sqlite3", "mcap alone", "ros1"])
def test_torn_bags_are_refused_or_a_part(tmp_path, kind):
    path = write(tmp_path, two_scans, kind)
    file = path if path.is_file() else next(path.glob("*.db3"))
    whole = file.read_bytes()
    for size in (*range(0, len(whole), len(whole) // 9), len(whole) - 1):
        torn = tmp_path / f"torn{file.suffix}"
        torn.write_bytes(whole[:size])
        try:
            assert len(load_scans(torn).ranges_m) <= 2
        except InputFileError as error:
            assert "\n" not in str(error)
    file.write_bytes(b"no bag at all" * 9)
    assert "torn or foreign bag" in refused("perceive", path)


@pytest.mark.parametrize(("field", "value"), [("angle_min", np.nan), ("angle_increment", np.inf)])
def test_headers_that_are_no_numbers_are_refused(tmp_path, field, value):
    bag = write(tmp_path, lambda types: [("/s", SCAN, scan(types, 1.0, **{field: value}), 1.0)])
    assert "message 1 on /s: its header holds NaN or infinity" in refused("perceive", bag)


def test_folders_that_are_none(tmp_path):
    assert "no rosbag2" in refused("perceive", tmp_path)
    (tmp_path / "metadata.yaml").write_text("a: 1\n")
    assert "torn or foreign bag" in refused("perceive", tmp_path)
    assert f"name the folder, {tmp_path}" in refused("perceive", tmp_path / "metadata.yaml")
    bag = write(tmp_path, two_scans)
    next(bag.glob("*.db3")).unlink()
    assert "missing" in refused("perceive", bag)


def test_without_the_library_the_extra_is_named(tmp_path, monkeypatch):
    bag = write(tmp_path, two_scans)
    monkeypatch.setitem(sys.modules, "rosbags.rosbag1", None)
    with pytest.raises(MissingExtraError, match=r"swarmscope\[bags\]"):
        load_scans(bag)
