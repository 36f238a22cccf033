"""Scans seen from elsewhere than where they were taken, from one place or from many: the steps before the kernels.

Holes are bridged by the rule for holes (``mend``) before anything is moved: what no body fits into hides none from
anywhere. A robot that turns against its beams has not seen all round when a scan ends; that is a hole, too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.geometry import TWO_PI, Pose
from swarmscope.onboard.lidar import Layout
from swarmscope.onboard.perception.mend import bridge
from swarmscope.onboard.perception.reproject import Found, Grid, Seat, reproject
from swarmscope.onboard.perception.straighten import straighten
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.sensor import Sensor
from swarmscope.onboard.trail import then

Mount = tuple[float, float, float]


class Taken(NamedTuple):
    """A scan and the sensor that took it."""

    scan: np.ndarray
    """(B,) [m] along the rays of ``layout``."""
    layout: Layout
    mount: Mount
    least_m: float
    """Nearer things the sensor does not measure."""


def from_one_place(taken: Taken, back: Pose, rig: Rig, wanted: Grid) -> Found:
    """Return a scan, taken when the body was at ``back``, as seen from where it is now, along ``wanted``."""
    scan, layout, mount, _ = taken
    x, y, _ = then(back, (*mount[:2], 0.0))
    found = _found(wanted)
    seat = Seat(x, y, back[2], back[0], back[1], _core(rig))
    reproject(*bridged(scan, layout, rig, _blind_m(taken)), layout.rays, seat, wanted, found)
    return found


def from_many_places(taken: Taken, back: np.ndarray, rig: Rig, wanted: Grid) -> Found:
    """Return the same of a scan whose ray n was taken when the body was at ``back[n]`` (B, 3)."""
    scan, layout, mount, _ = taken
    rays = layout.rays
    angles = rays.start + rays.increment * np.arange(scan.size) + back[:, 2]
    scan, angles, back = _with_gap(scan, layout, angles, back)
    c, s = np.cos(back[:, 2]), np.sin(back[:, 2])
    x, y = back[:, 0] + c * mount[0] - s * mount[1], back[:, 1] + s * mount[0] + c * mount[1]
    turned = angles - rays.start - rays.increment * np.arange(scan.size)
    found = _found(wanted)
    seats = np.column_stack([x, y, turned, back[:, 0], back[:, 1], np.full(scan.size, _core(rig))])
    straighten(*bridged(scan, layout, rig, _blind_m(taken)), rays, seats, wanted, found)
    return found


def _found(wanted: Grid) -> Found:
    """Return room for what is seen along ``wanted``."""
    return Found(np.empty(wanted.cos.size, np.float32), np.empty(wanted.cos.size, np.float32))


def seen_from_the_centre(layout: Layout, own: np.ndarray, mount: Mount, core: float) -> Layout:
    """Return which rays of a limited field the body's centre would see, its body of radius ``core`` [m] aside.

    A sensor off the centre leaves out what only it can see, and rays in which the robot sees itself, 1 in ``own``.
    Raises ConfigError where straight ahead is not left.
    """
    rays = layout.rays
    angles = rays.start + rays.increment * np.arange(layout.order.size)
    open_scan, no_hole = np.where(own, np.nan, np.inf).astype(np.float32), np.full(angles.size, np.nan, np.float32)
    seat, grid = Seat(*mount[:2], 0.0, 0.0, 0.0, core), Grid(rays, np.cos(angles), np.sin(angles))
    found = _found(grid)
    reproject(open_scan, no_hole, rays, seat, grid, found)
    seen = np.flatnonzero(~np.isnan(found.scan))
    first, last = (int(seen[0]), int(seen[-1])) if seen.size else (0, 0)
    if not (angles[first] <= 1e-9 and angles[last] >= -1e-9 and last > first):
        raise ConfigError("lidar.mount", "the body's centre would not see straight ahead: mount it nearer the centre")
    start = rays._replace(start=rays.start + first * rays.increment)
    return Layout(start, np.ascontiguousarray(layout.order[first : last + 1]))


def _blind_m(taken: Taken) -> float:
    """Return how far from the body's centre something may be that is too near to be measured [m]."""
    return taken.least_m + math.hypot(taken.mount[0], taken.mount[1])


def bridged(scan: np.ndarray, layout: Layout, rig: Rig, blind_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return ``scan (M,)`` with the holes bridged that no body fits into, and from which range on each hides things.

    That is (M,) float32 [m], NaN where none was bridged; wider holes stay NaN.
    """
    holes, hides = np.isnan(scan), np.full(scan.size, np.nan, np.float32)
    if not holes.any():
        return scan, hides
    whole, rays, sensor = scan.copy(), layout.rays, rig.sensor
    told = Sensor(
        beams=scan.size,
        angle_min=rays.start,
        increment=rays.increment,
        wraps=rays.closed,
        range_min=max(sensor.range_min, blind_m),
        range_max=sensor.range_max,
        range_sigma=sensor.range_sigma,
        position_sigma=sensor.position_sigma,
    )
    bridge(whole, rays.closed, rig._replace(sensor=told), hides)
    hides[~holes] = np.nan
    return np.where(holes, whole, scan), hides


def _core(rig: Rig) -> float:
    """Return what is the robot itself [m]."""
    return rig.body.radius_m + rig.guarding.clearance_m


def _with_gap(
    scan: np.ndarray, layout: Layout, angles: np.ndarray, back: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return scan, directions and places with broken rays where a circle has come apart because the robot turned."""
    if not layout.rays.closed:
        return scan, angles, back
    jumps = np.flatnonzero(np.abs(np.diff(layout.order)) > 1)  # there the first reading is beside the last
    at = int(jumps[0]) + 1 if jumps.size else scan.size
    gap = angles[at % scan.size] - angles[at - 1] + (0.0 if jumps.size else TWO_PI)
    missing = round(gap / layout.rays.increment) - 1
    if missing < 1:
        return scan, angles, back
    part = np.arange(1, missing + 1) / (missing + 1)
    between = back[at - 1] + part[:, None] * (back[at % scan.size] - back[at - 1])
    return (
        np.insert(scan, at, np.full(missing, np.nan, np.float32)),
        np.insert(angles, at, angles[at - 1] + part * gap),
        np.insert(back, np.full(missing, at), between, axis=0),
    )
