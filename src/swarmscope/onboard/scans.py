"""The last scan: taken in when one comes, turned into what is seen from where the robot is now in every tick.

Readings that were not taken all at once (``time_increment_s``) are put where the robot was at the time of each.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.geometry import TWO_PI, Pose
from swarmscope.onboard.edge import Unusable, number, readings, short
from swarmscope.onboard.lidar import Layout, Lidar, grid_of, lay_out, layout_of, same_rays, seen_from_above, sweep_s
from swarmscope.onboard.perception.reproject import NEAR_M, NEAR_STEPS, Found, Grid, settle
from swarmscope.onboard.readings import must_be_millimetres, own_rays, translate
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.sweep import Taken, from_many_places, from_one_place, seen_from_the_centre
from swarmscope.onboard.trail import Trail

MOST_READINGS = 8192
STALE_PERIODS = 3.05
"""Older scans are not used: three periods, and a little for rounding."""
AHEAD_PERIODS = 0.5
"""A scan may be stamped this much later than the tick."""
LONGEST_PERIODS = 2.0
"""A scan takes no longer: it would be too old before the next one comes."""
LONGER_PERIODS = 0.1
"""By so much may a message say that a scan takes longer than the data sheet says."""


class _Told(NamedTuple):
    """How the readings of one scan lie: by the data sheet, or by a message's own header."""

    layout: Layout
    readings: int
    least_m: float
    step_s: float
    """From one reading to the next."""
    own: np.ndarray
    """(M,) rays in which the robot sees itself."""
    any_own: bool
    late_s: np.ndarray
    """(M,) after the first reading."""
    direct: bool
    """Whether its rays are those that planners see."""


class Scans:
    """A LiDAR's scans as one robot uses them."""

    def __init__(self, lidar: Lidar, period_s: float, core: float) -> None:
        """``core`` [m]: the radius of what is the robot itself, its clearance included."""
        self._lidar, self._period_s = lidar, period_s
        if sweep_s(lidar) > LONGEST_PERIODS * period_s:
            takes, used = f"{sweep_s(lidar):.3g}", f"{LONGEST_PERIODS * period_s:.3g}"
            raise ConfigError("lidar.time_increment_s", f"a scan takes {takes} s; at this rate_hz it may take {used} s")
        self._sheet = layout_of(lidar)
        self._centred = lidar.mount[:2] == (0.0, 0.0)
        self.grid = grid_of(self._sheet)
        if not (self._centred or self.grid.rays.closed):
            own = own_rays(self.grid, lidar.masks_deg, lidar.mount[2])
            self.grid = seen_from_the_centre(self.grid, own, lidar.mount, core)
        angles = self.grid.rays.start + self.grid.rays.increment * np.arange(self.grid.order.size)
        self._wanted = Grid(self.grid.rays, np.cos(angles), np.sin(angles))
        self._header: tuple[float, ...] = ()
        self._by_sheet = self._by_header = self._told = self._tell(
            self._sheet, lidar.beams, lidar.range_min_m, lidar.time_increment_s
        )
        self._raw = np.empty(lidar.beams, np.float32)
        self._scan = np.empty(self._sheet.order.size, np.float32)
        self._rig: Rig
        self.forget()

    @property
    def gap(self) -> float:
        """How far apart the first and the last reading of a closed circle are [rad]; 0 of an open one."""
        rays = self._sheet.rays
        return TWO_PI - rays.increment * (self._sheet.order.size - 1) if rays.closed else 0.0

    def build_in(self, rig: Rig) -> None:
        """Let scans be those of a robot with ``rig``."""
        self._rig = rig

    def forget(self) -> None:
        """Forget the last scan."""
        self._stamp_s = -math.inf

    def take(self, scan: Any, scan_s: Any, now_s: float) -> None:
        """Take in a scan stamped ``scan_s`` (None: its header's, else it has just ended); raises Unusable, and then
        has none.

        The stamp is that of the first reading. One that is not newer than the last is no new scan.
        """
        stamp = self._stamp(scan, scan_s, now_s)
        if stamp <= self._stamp_s:
            return
        self.forget()
        told = self._by_sheet
        if hasattr(scan, "angle_increment"):
            scan, told = self._laser_scan(scan)
        sweep = told.step_s * (told.readings - 1)
        self._check_age(now_s - stamp - min(0.0, sweep))
        if stamp + max(0.0, sweep) > now_s + AHEAD_PERIODS * self._period_s:
            ahead = f"{stamp + sweep - now_s:.3g} s ahead of the clock"
            raise Unusable("scan stamp", f"the scan's last reading is {ahead}: the stamp is that of the first")
        values = self._row(scan, told.readings)
        if told.layout.order.size != self._scan.size:
            self._scan = np.empty(told.layout.order.size, np.float32)
        self._told = told
        self._understand(values)
        self._stamp_s = stamp

    def _understand(self, values: np.ndarray) -> None:
        """Make the scan of the raw readings (B,); raises Unusable."""
        lidar, told = self._lidar, self._told
        if lidar.no_return_m:
            translate(values, lidar.no_return_m)
        if settle(values, told.layout.order, told.least_m, lidar.range_m, self._scan) == 0:
            raise Unusable("scan", "no reading of the scan is sound")
        if not np.isfinite(self._scan).any() and must_be_millimetres(values, told.least_m, lidar.range_m):
            raise Unusable("scan", "the readings can only be millimetres; they must be metres")
        if told.any_own:
            self._scan[told.own] = np.nan

    def _tell(self, layout: Layout, count: int, least_m: float, step_s: float) -> _Told:
        own = own_rays(layout, self._lidar.masks_deg, self._lidar.mount[2])
        late_s, direct = step_s * layout.order, same_rays(layout, self.grid)
        return _Told(layout, count, least_m, step_s, own, bool(own.any()), late_s, direct)

    def rehearse(self, now_s: float) -> None:
        """Take in an open scan as the data sheet says."""
        self.take(np.full(self._lidar.beams, np.inf, np.float32), None, now_s)

    def rehearse_moving(self, trail: Trail, out: Found) -> None:
        """Write the scan as one whose readings were taken one after the other."""
        self._write_straight(trail, out)

    def write(self, trail: Trail, now_s: float, out: Found) -> None:
        """Write what is seen from where the robot is now into ``out``; raises Unusable."""
        if self._stamp_s == -math.inf:
            raise Unusable("no scan", "there is no scan")
        self._check_age(now_s - self._stamp_s)
        if self._told.step_s != 0.0:
            self._write_straight(trail, out)
            return
        back = trail.back_to(self._stamp_s)
        if back is None:
            raise _unknown_motion()
        if self._told.direct and self._centred and _is_here(back, self.grid.rays.increment):
            _write_as_it_is(self._scan, out)
        else:
            _write(from_one_place(self._taken(), back, self._rig, self._wanted), out)

    def _taken(self) -> Taken:
        return Taken(self._scan, self._told.layout, self._lidar.mount, self._told.least_m)

    def _write_straight(self, trail: Trail, out: Found) -> None:
        """Write a scan whose readings were taken one after the other."""
        back = trail.back_over(self._stamp_s + self._told.late_s)
        if back is None:
            raise _unknown_motion()
        near = NEAR_STEPS * self.grid.rays.increment
        if self._told.direct and self._centred and np.all(np.abs(back) <= (0.7 * NEAR_M, 0.7 * NEAR_M, near)):
            _write_as_it_is(self._scan, out)
        else:
            _write(from_many_places(self._taken(), back, self._rig, self._wanted), out)

    def _check_age(self, age_s: float) -> None:
        if age_s > STALE_PERIODS * self._period_s:
            raise Unusable("stale scan", f"the scan is {age_s:.3g} s old")

    def _stamp(self, scan: Any, scan_s: Any, now_s: float) -> float:
        """Return when the first reading was taken [s]."""
        stamp = number(scan_s)
        if scan_s is None:
            stamp = _header_stamp(scan) or now_s - max(0.0, self._lidar.time_increment_s) * (self._lidar.beams - 1)
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

    def _laser_scan(self, message: Any) -> tuple[Any, _Told]:
        """Return the ranges of what looks like a LaserScan, and how they lie; raises Unusable."""
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
        step_s = self._time_increment(message, count)
        header = (count, first, step, least, step_s)
        if header != self._header:
            first, step = seen_from_above(first, step, lidar.upside_down)
            layout = lay_out(count, first + lidar.mount[2], step, lidar.range_m)
            self._by_header = self._tell(layout, count, max(least, lidar.range_min_m), step_s)
            self._header = header
        return ranges, self._by_header

    def _time_increment(self, message: Any, count: int) -> float:
        """Return the time from one reading to the next [s]: the message's, or if it says none the data sheet's."""
        told, sheet = number(getattr(message, "time_increment", 0.0)), self._lidar.time_increment_s
        if told == 0.0:
            return sheet
        if not abs(told) * (count - 1) <= sweep_s(self._lidar) + LONGER_PERIODS * self._period_s:
            told_s, sheet_s = f"{abs(told) * (count - 1):.3g}", f"{sweep_s(self._lidar):.3g}"
            raise Unusable(
                "scan", f"the scan takes {told_s} s by its time_increment, {sheet_s} s by lidar.time_increment_s"
            )
        return told


def _write(found: Found, out: Found) -> None:
    out.scan[:], out.hidden[:] = found


def _write_as_it_is(scan: np.ndarray, out: Found) -> None:
    """Write a scan whose holes are where they are: what they hide the kernels find out."""
    out.scan[:], out.hidden[:] = scan, np.inf


def _unknown_motion() -> Unusable:
    return Unusable("moved", "how the robot has moved since the scan is not known")


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
