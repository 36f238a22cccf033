"""ROS 2 messages: made of plain numbers, their definitions, their bytes (CDR)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
"""Message types as they have been since Humble."""

GIGA = 1_000_000_000
MAP = "map"
"""The world's frame (REP-105)."""

Points = npt.NDArray[np.float64]


def full(kind: str) -> str:
    """Return ``sensor_msgs/msg/LaserScan`` for ``sensor_msgs/LaserScan``."""
    return kind.replace("/", "/msg/")


def make(kind: str, *fields: Any) -> Any:
    """Return a message with its fields in their order."""
    return STORE.types[full(kind)](*fields)


def definition(kind: str) -> bytes:
    """Return the definition of a message and of all that it holds, as ``ros2msg``."""
    return STORE.generate_msgdef(full(kind), ros_version=2)[0].encode()


def as_cdr(message: Any, kind: str) -> bytes:
    """Return the bytes of a message, the same on every machine."""
    return bytes(STORE.serialize_cdr(message, full(kind), little_endian=True))


def nanoseconds(t_s: float) -> int:
    """Return a time of the run in whole nanoseconds."""
    return round(t_s * GIGA)


def header(t_ns: int, frame: str) -> Any:
    """Return a header."""
    return make("std_msgs/Header", make("builtin_interfaces/Time", *divmod(t_ns, GIGA)), frame)


def vector(x: float, y: float, z: float = 0.0) -> Any:
    """Return a vector."""
    return make("geometry_msgs/Vector3", x, y, z)


def point(x: float, y: float, z: float = 0.0) -> Any:
    """Return a point."""
    return make("geometry_msgs/Point", x, y, z)


def turned(yaw: float) -> Any:
    """Return the rotation by ``yaw`` round the axis that points up."""
    return make("geometry_msgs/Quaternion", 0.0, 0.0, math.sin(0.5 * yaw), math.cos(0.5 * yaw))


def pose(x: float, y: float, z: float = 0.0, yaw: float = 0.0) -> Any:
    """Return a pose."""
    return make("geometry_msgs/Pose", point(x, y, z), turned(yaw))


class Look(NamedTuple):
    """How a marker looks."""

    colour: tuple[float, float, float, float]
    size: tuple[float, float, float]
    """Of a line its width, of a text its height in the last place [m]."""
    lifetime_s: float = 0.0
    """0: until it is replaced."""


class Name(NamedTuple):
    """Which marker: a later one of this name takes its place."""

    group: str
    number: int


ARROW, CYLINDER, LINE_STRIP, TEXT, TRIANGLES = 0, 3, 4, 9, 11


def marker(
    kind: int, name: Name, head: Any, where: Any, look: Look, points: Sequence[Sequence[float]] = (), text: str = ""
) -> Any:
    """Return a marker; one whose header is not in the map's frame moves with that frame."""
    life = make("builtin_interfaces/Duration", *divmod(nanoseconds(look.lifetime_s), GIGA))
    nothing = np.zeros(0, np.uint8)
    texture = make("sensor_msgs/CompressedImage", header(0, ""), "", nothing)
    return make(
        "visualization_msgs/Marker",
        head,
        name.group,
        name.number,
        kind,
        0,  # add or modify
        where,
        vector(*look.size),
        make("std_msgs/ColorRGBA", *look.colour),
        life,
        head.frame_id != MAP,
        [point(*p) for p in points],
        [],  # colours of the points: all alike
        "",
        texture,
        [],
        text,
        "",
        make("visualization_msgs/MeshFile", "", nothing),
        False,
    )
