"""Scans from ROS bags: rosbag2 folders, their .db3 and .mcap files, ROS 1 .bag files, by the library ``rosbags``.

Messages are read by the definitions that the library has of its own; definitions in a file are not used.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from swarmscope.errors import MissingExtraError, nearest_hint
from swarmscope.onboard.trail import poses_at
from swarmscope.sim.scan_read import HEADER_KEYS, MOST_READINGS, Arrays, Ask, BadFile, Read, as_stamps, padded
from swarmscope.texts import check_regular

if TYPE_CHECKING:
    from rosbags.interfaces import Connection
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.rosbag2 import Reader as Reader2

SUFFIXES = (".bag", ".mcap", ".db3")
METADATA = "metadata.yaml"
SCAN, ODOMETRY = "sensor_msgs/msg/LaserScan", "nav_msgs/msg/Odometry"
MOST_SHOWN = 20
MENDED_BY = "'ros2 bag reindex', 'mcap recover' or 'rosbag reindex' may mend a recording that was cut off"
FAR_S = 1.0
"""Odometry that has nothing so near a scan in time is of another clock."""


def is_bag(path: Path) -> bool:
    """Tell whether this is a bag, by its name or as a folder with a bag's metadata."""
    return path.suffix.lower() in SUFFIXES or (path.is_dir() and (path / METADATA).exists())


def read_bag(path: Path, ask: Ask) -> Read:
    """Return the scans of one topic; raises BadFile, MissingExtraError."""
    _check_files(path)
    try:
        from rosbags.rosbag1 import Reader as Reader1
        from rosbags.rosbag2 import Reader as Reader2
    except ImportError:
        raise MissingExtraError("reading bags", "bags") from None
    try:
        with (Reader1 if path.suffix.lower() == ".bag" else Reader2)(path) as reader:
            return _from_reader(reader, ask)
    except BadFile:
        raise
    except MemoryError:
        raise BadFile("claims more data than fits into memory: torn or foreign") from None
    except Exception as error:  # of damaged bags sqlite, lz4, zstd, struct and the library raise a dozen types
        reason = " ".join(str(error).split()) or type(error).__name__
        raise BadFile(f"torn or foreign bag ({reason[:200]}); {MENDED_BY}") from None


def _check_files(path: Path) -> None:
    if not path.is_dir():
        check_regular(path, None)
        if path.stat().st_size == 0:
            raise BadFile("is empty")
        return
    check_regular(path / METADATA)
    for file in path.iterdir():
        check_regular(file, None)


def _from_reader(reader: Reader1 | Reader2, ask: Ask) -> Read:
    """Return what an open bag holds."""
    scans = _chosen(reader.connections, ask.topic)
    odometry, notes = _odometry(reader.connections)
    found = _Found(scans[0].topic, ask.every)
    for kind, message, at_s in _messages(reader, scans, odometry):
        if kind == ODOMETRY:
            found.add_pose(message, at_s)
        elif not found.add_scan(message, at_s):
            break
    return found.read(notes)


def _chosen(connections: list[Connection], topic: str | None) -> list[Connection]:
    """Return the connections of the topic with the scans; raises BadFile with what there is."""
    names = sorted({one.topic for one in connections if one.msgtype == SCAN})
    if not names:
        others = sorted({f"{one.topic} ({one.msgtype})" for one in connections})
        raise BadFile(f"holds no LaserScan; its topics are: {_listed(others) or 'none'}")
    if topic is None and len(names) > 1:
        raise BadFile(f"scans are on {len(names)} topics; choose with --topic: {_listed(names)}")
    wanted = names[0] if topic is None else topic
    if wanted not in names:
        wanted = f"/{wanted}" if f"/{wanted}" in names else wanted
    if wanted not in names:
        raise BadFile(f"no LaserScan is on topic '{topic}'{nearest_hint(wanted, names[:MOST_SHOWN])}")
    return [one for one in connections if one.topic == wanted and one.msgtype == SCAN]


def _listed(names: list[str]) -> str:
    more = f", and {len(names) - MOST_SHOWN} more" if len(names) > MOST_SHOWN else ""
    return ", ".join(names[:MOST_SHOWN]) + more


def _odometry(connections: list[Connection]) -> tuple[list[Connection], tuple[str, ...]]:
    """Return the connections of the only odometry, or of that on /odom, and a note when it is not known which."""
    names = sorted({one.topic for one in connections if one.msgtype == ODOMETRY})
    chosen = names[0] if len(names) == 1 else "/odom"
    if names and chosen not in names:
        return [], (f"odometry is on {_listed(names)}: none of them is used, for none is /odom",)
    return [one for one in connections if one.msgtype == ODOMETRY and one.topic == chosen], ()


def _messages(
    reader: Reader1 | Reader2, scans: list[Connection], odometry: list[Connection]
) -> Iterator[tuple[str, Any, float]]:
    """Yield type, message and time of recording [s], one message at a time."""
    from rosbags.rosbag1 import Reader as Reader1
    from rosbags.typesys import Stores, get_typestore

    first = isinstance(reader, Reader1)
    store = get_typestore(Stores.ROS1_NOETIC if first else Stores.ROS2_HUMBLE)
    if first:
        _check_digests([*scans, *odometry], {kind: store.generate_msgdef(kind)[1] for kind in (SCAN, ODOMETRY)})
    read = store.deserialize_ros1 if first else store.deserialize_cdr
    for connection, at_ns, raw in reader.messages([*scans, *odometry]):
        yield connection.msgtype, read(raw, connection.msgtype), 1e-9 * at_ns


def _check_digests(connections: list[Connection], known: dict[str, str]) -> None:
    for one in connections:
        if one.digest and one.digest != known[one.msgtype]:
            raise BadFile(f"topic {one.topic}: its {one.msgtype} is none that ROS 1 knows")


class _Found:
    """What has been read so far."""

    def __init__(self, topic: str, every: int) -> None:
        self.topic, self.every = topic, every
        self.seen = self.readings = 0
        self.rows: list[npt.NDArray[np.float32]] = []
        self.heads: list[tuple[float, ...]] = []
        self.stamps: list[float] = []
        self.poses: list[tuple[float, float, float, float]] = []
        self.notes: tuple[str, ...] = ()

    def add_scan(self, message: Any, at_s: float) -> bool:
        """Keep a scan if its turn has come; tell whether there is room for more."""
        self.seen += 1
        if (self.seen - 1) % self.every:
            return True
        ranges = np.asarray(message.ranges, np.float32)
        if self.readings + ranges.size > MOST_READINGS:
            often = 10 * self.every
            self.notes = (f"only the first {len(self.rows)} scans are read; --every {often} takes every {often}th",)
            return False
        head = tuple(float(getattr(message, key)) for key in (*HEADER_KEYS, "time_increment"))
        if not all(map(math.isfinite, (*head[:3], head[4]))):
            raise BadFile(f"message {self.seen} on {self.topic}: its header holds NaN or infinity")
        self.rows.append(ranges)
        self.heads.append(head)
        self.stamps.append(_stamp_s(message, at_s))
        self.readings += ranges.size
        return True

    def add_pose(self, message: Any, at_s: float) -> None:
        """Keep where odometry says the robot is."""
        place, q = message.pose.pose.position, message.pose.pose.orientation
        yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
        pose = (_stamp_s(message, at_s), float(place.x), float(place.y), yaw)
        if all(map(math.isfinite, pose)) and len(self.poses) < MOST_READINGS // 4:
            self.poses.append(pose)

    def read(self, notes: tuple[str, ...]) -> Read:
        """Return everything; raises BadFile when there is nothing."""
        if not self.rows:
            raise BadFile(f"topic {self.topic} holds no message")
        notes += self.notes
        heads = np.array(self.heads)
        if (heads[:, 2:4] != heads[0, 2:4]).any():
            notes += (f"the scans' ranges change; those of the first count, {heads[0, 2]:g} to {heads[0, 3]:g} m",)
        arrays: Arrays = {key: heads[0, at] for at, key in enumerate(HEADER_KEYS)}
        arrays["time_increment"] = np.median(heads[:, 4])
        if (heads[:, :2] != heads[0, :2]).any():
            arrays["geometry"] = heads[:, :2]
        stamps = as_stamps(self.stamps)
        if not stamps:
            notes += ("the scans' stamps run backwards; they are not used",)
        elif self.poses:
            odom = _poses_at(np.array(self.stamps), np.array(self.poses))
            notes += () if odom else ("odometry is of another time than the scans; it is not used",)
            stamps |= odom
        return Read(arrays | padded(self.rows) | stamps, notes)


def _stamp_s(message: Any, at_s: float) -> float:
    """Return the stamp of a message's header, or if it has none when it was recorded [s]."""
    stamp = message.header.stamp
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec) or at_s


def _poses_at(when_s: npt.NDArray[np.float64], poses: npt.NDArray[np.float64]) -> Arrays:
    """Return where the robot was at each scan, nothing when odometry does not reach that far."""
    poses = poses[np.argsort(poses[:, 0], kind="stable")]
    if when_s[0] < poses[0, 0] - FAR_S or when_s[-1] > poses[-1, 0] + FAR_S:
        return {}
    return {"odom_xy_yaw": poses_at(when_s, poses[:, 0], poses[:, 1:])}
