"""What moves by itself: discs on given ways, seen and touched like all else, and doors that open and close."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline
from swarmscope.geometry import point_segment_distance
from swarmscope.sim.beams import Beams, Ranges
from swarmscope.sim.lidar import cast_disc, cast_segment
from swarmscope.sim.world import WALL_M, Bytes, Circle, Door, Floats, Ints, WorldSpec

INSIDE = np.float32(0.0)
"""What a LiDAR inside a disc that walks over it says: nearer than anything that it can measure."""


class Moving(NamedTuple):
    """All that moves by itself, as plain arrays."""

    legs: Floats
    """(L, 5): from when [s], where x, y [m], velocity vx, vy [m/s]; those of one disc follow each other."""
    first: Ints
    """(D + 1,): the first leg of each disc."""
    period_s: Floats
    """(D,): after which it begins anew; 0: never."""
    radius: Floats
    """(D,) [m]."""
    doors: Floats
    """(K, 4): from ax, ay to bx, by [m]."""
    opens: Floats
    """(O, 2): from when until when [s] a door is open; those of one door follow each other."""
    door_first: Ints
    """(K + 1,): the first of them of each door."""
    door_period_s: Floats
    """(K,): after which a door begins anew; 0: never."""
    closed: Bytes
    """(K,): 1 where a door is closed now; it changes."""


def moving_in(spec: WorldSpec) -> Moving:
    """Return what moves in a world; doors begin open and close as soon as they should and nobody is in the way."""
    discs = [o for o in spec.obstacles if isinstance(o, Circle) and o.moves]
    doors = [o for o in spec.obstacles if isinstance(o, Door)]
    legs = [_legs(disc) for disc in discs]
    opens = [np.asarray(door.open_s, float).reshape(-1, 2) for door in doors]
    return Moving(
        legs=np.concatenate([np.zeros((0, 5)), *(leg for leg, _ in legs)]),
        first=np.cumsum([0, *(len(leg) for leg, _ in legs)], dtype=np.int64),
        period_s=np.array([period for _, period in legs], float),
        radius=np.array([disc.radius for disc in discs], float),
        doors=np.array([[*door.points[0], *door.points[1]] for door in doors], float).reshape(-1, 4),
        opens=np.concatenate([np.zeros((0, 2)), *opens]),
        door_first=np.cumsum([0, *map(len, opens)], dtype=np.int64),
        door_period_s=np.array([door.every_s or 0.0 for door in doors], float),
        closed=np.zeros(len(doors), np.uint8),
    )


def top_speed(moving: Moving) -> float:
    """Return the speed of the fastest disc [m/s], 0 without one."""
    return float(np.hypot(moving.legs[:, 3], moving.legs[:, 4]).max(initial=0.0))


def _legs(disc: Circle) -> tuple[Floats, float]:
    """Return the legs of a disc (L, 5), and after how long it begins anew [s], 0 for never."""
    if disc.velocity is not None:
        return np.array([[0.0, *disc.center, *disc.velocity]]), 0.0
    points, repeat = [disc.center, *(disc.way or [])], disc.repeat or "back"
    times = _times(disc)
    if repeat == "loop" and disc.times_s is None:
        points, times = [*points, disc.center], [*times, times[-1] + math.dist(points[-1], disc.center) / _speed(disc)]
    if repeat == "back":
        points, times = points + points[-2::-1], times + [2.0 * times[-1] - t for t in times[-2::-1]]
    legs = [
        [t, *a, (b[0] - a[0]) / (u - t), (b[1] - a[1]) / (u - t)]
        for (t, u), (a, b) in zip(pairwise(times), pairwise(points), strict=True)
        if u > t
    ]
    if repeat == "once":
        legs.append([times[-1], *points[-1], 0.0, 0.0])
    return np.array(legs), 0.0 if repeat == "once" else times[-1]


def _times(disc: Circle) -> list[float]:
    """Return when a disc is at the points of its way [s]."""
    if disc.times_s is not None:
        return [0.0, *disc.times_s]
    steps = [math.dist(a, b) / _speed(disc) for a, b in pairwise([disc.center, *(disc.way or [])])]
    return [0.0, *np.cumsum(steps).tolist()]


def _speed(disc: Circle) -> float:
    if disc.speed_mps is None:
        raise ValueError("a way needs speed_mps or times_s")
    return disc.speed_mps


STANDSTILL = moving_in(WorldSpec(bounds=(0.0, 0.0, 1.0, 1.0)))
"""Nothing moves."""


@jit_inline
def disc_at(moving: Moving, d: int, t: float) -> tuple[float, float]:
    """Return where disc d is at time t [s]: x, y [m]."""
    if moving.period_s[d] > 0.0:
        t -= math.floor(t / moving.period_s[d]) * moving.period_s[d]
    low, high = moving.first[d], moving.first[d + 1] - 1
    while low < high:
        middle = (low + high + 1) // 2
        if moving.legs[middle, 0] <= t:
            low = middle
        else:
            high = middle - 1
    leg = moving.legs[low]
    return leg[1] + leg[3] * (t - leg[0]), leg[2] + leg[4] * (t - leg[0])


@jit
def write_places(moving: Moving, t: float, out: Floats) -> None:
    """Write where each disc is at time t [s] into ``out (D, 2)`` [m]."""
    for d in range(len(out)):
        out[d, 0], out[d, 1] = disc_at(moving, d, t)


@jit_inline
def should_open(moving: Moving, k: int, t: float) -> bool:
    """Tell whether door k should be open at time t [s]."""
    if moving.door_period_s[k] > 0.0:
        t -= math.floor(t / moving.door_period_s[k]) * moving.door_period_s[k]
    for n in range(moving.door_first[k], moving.door_first[k + 1]):
        if moving.opens[n, 0] <= t < moving.opens[n, 1]:
            return True
    return False


@jit_inline
def cast_moving(
    moving: Moving, t: float, x: float, y: float, cos_yaw: float, sin_yaw: float, beams: Beams, out: Ranges
) -> None:
    """Lower ``out (M,)`` [m] where a disc, as it is at time t, or a closed door is nearer; as `lidar.cast_static`.

    From inside a disc all ranges are 0.
    """
    for d in range(moving.radius.size):
        cx, cy = disc_at(moving, d, t)
        dx, dy = cx - x, cy - y
        if dx * dx + dy * dy <= moving.radius[d] * moving.radius[d]:
            for n in range(out.size):
                out[n] = INSIDE
            return
        cast_disc(cos_yaw * dx + sin_yaw * dy, cos_yaw * dy - sin_yaw * dx, moving.radius[d], beams, out)
    for k in range(moving.closed.size):
        if moving.closed[k]:
            _cast_door(moving.doors[k], x, y, cos_yaw, sin_yaw, beams, out)


@jit
def _cast_door(
    door: Floats, x: float, y: float, cos_yaw: float, sin_yaw: float, beams: Beams, out: Ranges
) -> None:
    """Cast a closed door: both sides, in pieces, and round ends, like a wall's."""
    length = math.sqrt((door[2] - door[0]) ** 2 + (door[3] - door[1]) ** 2)
    ux, uy = (door[2] - door[0]) / length, (door[3] - door[1]) / length
    pieces = int(math.ceil(length))
    for side in (-1.0, 1.0):
        ox, oy = -side * uy * 0.5 * WALL_M - x, side * ux * 0.5 * WALL_M - y
        for p in range(pieces):
            a, b = length * p / pieces, length * (p + 1) / pieces
            ax, ay = door[0] + ux * a + ox, door[1] + uy * a + oy
            bx, by = door[0] + ux * b + ox, door[1] + uy * b + oy
            cast_segment(
                cos_yaw * ax + sin_yaw * ay, cos_yaw * ay - sin_yaw * ax,
                cos_yaw * bx + sin_yaw * by, cos_yaw * by - sin_yaw * bx, beams, out,
            )  # fmt: skip
    for e in range(2):
        dx, dy = door[2 * e] - x, door[2 * e + 1] - y
        cast_disc(cos_yaw * dx + sin_yaw * dy, cos_yaw * dy - sin_yaw * dx, 0.5 * WALL_M, beams, out)


@jit_inline
def door_distance(door: Floats, x: float, y: float) -> float:
    """Return how far (x, y) [m] is from the surface of a door, below 0 inside."""
    return point_segment_distance(x, y, door[0], door[1], door[2], door[3]) - 0.5 * WALL_M
