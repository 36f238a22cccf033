"""The last scan: taken in when one comes, turned into what is seen from where the robot is now in every tick."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from swarmscope.geometry import Pose
from swarmscope.onboard.edge import Unusable, number, readings, short
from swarmscope.onboard.lidar import Layout, Lidar, grid_of, lay_out, layout_of, same_rays
from swarmscope.onboard.perception.reproject import NEAR_M, NEAR_STEPS, Grid, Seat, reproject, settle
from swarmscope.onboard.trail import Trail, then

MOST_READINGS = 8192
STALE_PERIODS = 3.05
"""Older scans are not used: three periods, and a little for rounding."""
AHEAD_PERIODS = 0.5
"""A scan may be stamped this much later than the tick."""


class Scans:
    """A LiDAR's scans as one robot uses them."""

    def __init__(self, lidar: Lidar, period_s: float, core_m: float) -> None:
        self._lidar, self._period_s, self._core_m = lidar, period_s, core_m
        self._sheet = self._layout = layout_of(lidar)
        self.grid = grid_of(self._sheet)
        angles = self.grid.rays.start + self.grid.rays.increment * np.arange(self.grid.order.size)
        self._wanted = Grid(self.grid.rays, np.cos(angles), np.sin(angles))
        self._direct = same_rays(self._sheet, self.grid)
        self._header: tuple[float, ...] = ()
        self._told = self._sheet
        self._least_m = lidar.range_min_m
        self._raw = np.empty(lidar.beams, np.float32)
        self._scan = np.empty(self._sheet.order.size, np.float32)
        self._centred = lidar.mount[:2] == (0.0, 0.0)
        self.forget()

    def forget(self) -> None:
        """Forget the last scan."""
        self._stamp_s = -math.inf

    def take(self, scan: Any, scan_s: Any, now_s: float) -> None:
        """Take in a scan stamped ``scan_s`` (None: its header's, else now); raises Unusable, and then has none.

        One that is not newer than the last is no new scan.
        """
        stamp = self._stamp(scan, scan_s, now_s)
        if stamp <= self._stamp_s:
            return
        self.forget()
        self._check_age(now_s - stamp)
        layout, count, least = self._sheet, self._lidar.beams, self._lidar.range_min_m
        if hasattr(scan, "angle_increment"):
            scan, layout, count, least = self._laser_scan(scan)
        values = self._row(scan, count)
        if layout is not self._layout:
            self._layout, self._direct = layout, same_rays(layout, self.grid)
            self._scan = np.empty(layout.order.size, np.float32)
        if settle(values, layout.order, least, self._lidar.range_m, self._scan) == 0:
            raise Unusable("scan", "no reading of the scan is sound")
        self._stamp_s = stamp

    def rehearse(self, now_s: float) -> None:
        """Take in an open scan as the data sheet says."""
        self.take(np.full(self._lidar.beams, np.inf, np.float32), now_s, now_s)

    def write(self, trail: Trail, now_s: float, out: np.ndarray) -> None:
        """Write what is seen from where the robot is now into ``out (M,)`` float32; raises Unusable."""
        if self._stamp_s == -math.inf:
            raise Unusable("no scan", "there is no scan")
        self._check_age(now_s - self._stamp_s)
        back = trail.back_to(self._stamp_s)
        if back is None:
            raise Unusable("moved", "how the robot has moved since the scan is not known")
        if self._direct and self._centred and _is_here(back, self.grid.rays.increment):
            out[:] = self._scan
            return
        x, y, _ = then(back, (*self._lidar.mount[:2], 0.0))
        seat = Seat(x, y, back[2], back[0], back[1], self._core_m)
        reproject(self._scan, self._layout.rays, seat, self._wanted, out)

    def _check_age(self, age_s: float) -> None:
        if age_s > STALE_PERIODS * self._period_s:
            raise Unusable("stale scan", f"the scan is {age_s:.3g} s old")

    def _stamp(self, scan: Any, scan_s: Any, now_s: float) -> float:
        """Return when the scan was taken [s]."""
        stamp = now_s if scan_s is None else number(scan_s)
        if scan_s is None:
            stamp = _header_stamp(scan) or now_s
        if not math.isfinite(stamp):
            self.forget()
            raise Unusable("scan stamp", f"scan_s must be a time [s], not {short(scan_s)}")
        if stamp > now_s + AHEAD_PERIODS * self._period_s:
            self.forget()
            raise Unusable("scan stamp", f"the scan is stamped {stamp - now_s:.3g} s ahead of the clock")
        return stamp

    def _row(self, scan: Any, count: int) -> np.ndarray:
        """Return the readings (B,) as float32; raises Unusable."""
        length = _length(scan)
        if length != count:
            raise Unusable("scan", f"the scan has {length} readings, the data sheet says {count}")
        values = readings(scan)
        if self._raw.size != count:
            self._raw = np.empty(count, np.float32)
        with np.errstate(over="ignore", invalid="ignore"):
            np.copyto(self._raw, values, casting="unsafe")
        return self._raw

    def _laser_scan(self, message: Any) -> tuple[Any, Layout, int, float]:
        """Return ranges, layout, count and range_min [m] of what looks like a LaserScan; raises Unusable."""
        ranges, lidar = getattr(message, "ranges", None), self._lidar
        first, step = number(getattr(message, "angle_min", None)), number(message.angle_increment)
        least, most = number(getattr(message, "range_min", 0.0)), number(getattr(message, "range_max", lidar.range_m))
        count = _length(ranges)
        if not (abs(first) < 100.0 and 1e-4 < abs(step) < 1.0):
            raise Unusable("scan", f"the scan's header has angle_min {first:g}, angle_increment {step:g}")
        if not (most >= lidar.range_m * 0.999 and least < lidar.range_m):
            raise Unusable("scan", f"the scan's ranges are {least:g} to {most:g} m, not to {lidar.range_m:g}")
        if not 2 <= count <= MOST_READINGS or count * abs(step) > 7.0 + abs(step):
            raise Unusable("scan", f"the scan has {count} readings {step:g} rad apart")
        if (count, first, step) != self._header:
            self._header = count, first, step
            self._told = lay_out(count, first + lidar.mount[2], step, lidar.range_m)
        return ranges, self._told, count, max(least, lidar.range_min_m)


def _is_here(back: Pose, increment: float) -> bool:
    return math.hypot(back[0], back[1]) <= NEAR_M and abs(back[2]) <= NEAR_STEPS * increment


def _header_stamp(scan: Any) -> float:
    """Return the stamp of a LaserScan's header [s], 0 when it has none."""
    if not hasattr(scan, "angle_increment"):
        return 0.0
    stamp = getattr(getattr(scan, "header", None), "stamp", None)
    return number(getattr(stamp, "sec", 0)) + 1e-9 * number(getattr(stamp, "nanosec", 0))


def _length(scan: Any) -> int:
    try:
        return len(scan)
    except Exception:
        raise Unusable("scan", f"a scan must be a list or an array of ranges [m], not {short(scan)}") from None
