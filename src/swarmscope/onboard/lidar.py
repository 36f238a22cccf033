"""A robot's LiDAR as its data sheet says, and how its readings lie round the robot."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.geometry import TWO_PI
from swarmscope.onboard.perception.rays import Rays
from swarmscope.onboard.sensor import Sensor

FEWEST_BEAMS, MOST_BEAMS = 8, 4096
LEAST_VIEW_DEG = 30.0
"""What stands beside a robot has been ahead of it before; with a narrower view than this many do not get on."""
LONGEST_M = 1000.0
FINEST_RAD = math.radians(0.01)
"""Readings lie at least this far apart [rad]."""
LONGEST_SWEEP_S = 2.0
"""No scan takes longer [s]."""
SAME = 0.05
"""Layouts that differ by less than this share of an increment are the same."""


class Lidar(NamedTuple):
    """A 2D LiDAR's data sheet. Directions count counter-clockwise, 0 is where the sensor faces (REP-103)."""

    beams: int = 360
    """Readings in a scan."""
    range_m: float = 5.0
    """Longest range [m]; the same for all robots of a swarm (docs/message.md). Beyond it is "no return"."""
    range_min_m: float = 0.0
    """Shortest range [m]; what is below is a broken reading."""
    fov_deg: float = 360.0
    """Field of view. 360 is a closed circle: the reading after the last would be the first again. Anything less has
    a reading at both edges."""
    first_deg: float | None = None
    """Direction of the first reading; None: the right edge of the field (-fov/2), the left one of a clockwise LiDAR."""
    clockwise: bool = False
    """Whether the readings go clockwise, seen from above a LiDAR that stands upright."""
    mount: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where the sensor sits and faces on the body: x, y [m] from the body's centre, yaw [rad]."""
    range_sigma: float = 0.0
    """Standard deviation of a range as a fraction of it."""
    position_sigma: float = 0.0
    """Standard deviation of a neighbour's measured position as a fraction of its distance."""
    upside_down: bool = False
    """Whether it hangs upside down: what its own papers and messages call left is right. ``masks_deg`` and ``mount``
    are as seen from above all the same."""
    no_return_m: tuple[float, ...] = ()
    """Readings that mean "no return", beside +inf and what is beyond ``range_m`` [m]: 0 or -1 for some LiDARs; may be
    NaN."""
    masks_deg: tuple[tuple[float, float], ...] = ()
    """Directions, from .. to counter-clockwise, in which the robot sees itself: its posts [degrees]."""
    time_increment_s: float = 0.0
    """From one reading to the next, in the order of the scan [s]; 0: all are taken at once."""


class Layout(NamedTuple):
    """Which reading belongs to which ray."""

    rays: Rays
    order: np.ndarray
    """(B,) int64: ray n is reading ``order[n]``."""


def lay_out(count: int, first: float, step: float, reach: float) -> Layout:
    """Return the layout of ``count`` readings from ``first`` [rad] on, ``step`` [rad] apart (below 0: clockwise).

    A circle is closed when what no reading covers is less than 1.5 steps. An exact one begins at -pi, whichever
    reading was the first; of any other the part within [-pi, pi] is kept.
    """
    order = np.arange(count)
    if step < 0.0:
        order, first, step = order[::-1], first + step * (count - 1), -step
    if abs(count * step - TWO_PI) < 0.25 * step:
        return _circle(order, first, reach)
    closed = TWO_PI - (count - 1) * step < 1.5 * step
    first -= TWO_PI * round((first + 0.5 * step * (count - 1)) / TWO_PI)
    if closed:
        return Layout(Rays(first, step, True, reach), np.ascontiguousarray(order))
    skip = max(0, math.ceil((-math.pi - first) / step - 1e-6))
    stop = min(count, math.floor((math.pi - first) / step + 1e-6) + 1)
    return Layout(Rays(first + skip * step, step, False, reach), np.ascontiguousarray(order[skip:stop]))


def _circle(order: np.ndarray, first: float, reach: float) -> Layout:
    """Return a closed circle of readings in ``order``, turned so that it begins at -pi."""
    count = order.size
    step = TWO_PI / count
    first = first - TWO_PI * math.floor((first + math.pi) / TWO_PI + 1e-12)
    skip = math.ceil((math.pi - first) / step - 1e-3)
    first += skip * step - TWO_PI
    if abs(first + math.pi) < 1e-9:
        first = -math.pi
    return Layout(Rays(first, step, True, reach), np.roll(order, -skip))


def same_rays(a: Layout, b: Layout) -> bool:
    """Tell whether two layouts have their rays in the same directions."""
    near = SAME * b.rays.increment
    return (
        a.order.size == b.order.size
        and a.rays.closed == b.rays.closed
        and abs(a.rays.start - b.rays.start) < near
        and abs(a.rays.increment - b.rays.increment) * b.order.size < near
    )


def check_lidar(lidar: Lidar) -> Lidar:
    """Return the data sheet with plain numbers; raises ConfigError with the field's name."""
    beams = _whole(lidar.beams, "lidar.beams", FEWEST_BEAMS, MOST_BEAMS)
    values = {name: finite(getattr(lidar, name), f"lidar.{name}") for name in _NUMBERS}
    if not 0.0 < values["range_m"] <= LONGEST_M:
        raise ConfigError("lidar.range_m", f"must be above 0 and at most {LONGEST_M:g} m, not {lidar.range_m!r}")
    if not 0.0 <= values["range_min_m"] < values["range_m"]:
        raise ConfigError("lidar.range_min_m", f"must be at least 0 and below range_m, not {lidar.range_min_m!r}")
    if not 0.0 < values["fov_deg"] <= 360.0:
        raise ConfigError("lidar.fov_deg", f"must be above 0 and at most 360 degrees, not {lidar.fov_deg!r}")
    for name in ("range_sigma", "position_sigma"):
        if not 0.0 <= values[name] < 1.0:
            raise ConfigError(f"lidar.{name}", f"must be at least 0 and below 1, not {getattr(lidar, name)!r}")
    if abs(values["time_increment_s"]) * (beams - 1) > LONGEST_SWEEP_S:
        sweep = f"{beams} readings would take {abs(values['time_increment_s']) * (beams - 1):.3g} s"
        raise ConfigError("lidar.time_increment_s", f"{sweep}; a scan takes at most {LONGEST_SWEEP_S:g} s")
    checked = Lidar(
        beams,
        **values,
        first_deg=None if lidar.first_deg is None else finite(lidar.first_deg, "lidar.first_deg"),
        clockwise=bool(lidar.clockwise),
        mount=_mount(lidar.mount),
        upside_down=bool(lidar.upside_down),
        no_return_m=_no_return(lidar.no_return_m),
        masks_deg=_masks(lidar.masks_deg),
    )
    if abs(_step(checked)) < FINEST_RAD:
        raise ConfigError("lidar.fov_deg", f"{beams} readings in {values['fov_deg']:g} degrees lie too close together")
    return checked


_NUMBERS = ("range_m", "range_min_m", "fov_deg", "range_sigma", "position_sigma", "time_increment_s")


def finite(value: Any, where: str) -> float:
    """Return ``value`` as a float; raises ConfigError unless it is a finite number."""
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if math.isfinite(number):
            return number
    raise ConfigError(where, f"must be a finite number, not {value!r}")


def _whole(value: Any, where: str, least: int, most: int) -> int:
    number = finite(value, where)
    if number != int(number) or not least <= number <= most:
        raise ConfigError(where, f"must be a whole number from {least} to {most}, not {value!r}")
    return int(number)


def _mount(mount: Any) -> tuple[float, float, float]:
    try:
        x, y, yaw = mount
    except (TypeError, ValueError):
        raise ConfigError("lidar.mount", f"must be x [m], y [m], yaw [rad], not {mount!r}") from None
    return finite(x, "lidar.mount"), finite(y, "lidar.mount"), finite(yaw, "lidar.mount")


def _no_return(values: Any) -> tuple[float, ...]:
    """Return the values as plain numbers; a single number is one of them."""
    try:
        found = tuple(values) if hasattr(values, "__iter__") else (values,)
        return tuple(value if value != value else finite(value, "lidar.no_return_m") for value in found)  # noqa: PLR0124
    except TypeError:
        raise ConfigError("lidar.no_return_m", f"must be readings [m], not {values!r}") from None


def _masks(masks: Any) -> tuple[tuple[float, float], ...]:
    try:
        pairs = [(first, last) for first, last in masks]
    except (TypeError, ValueError):
        raise ConfigError("lidar.masks_deg", f"must be pairs (from, to) [degrees], not {masks!r}") from None
    return tuple((finite(first, "lidar.masks_deg"), finite(last, "lidar.masks_deg")) for first, last in pairs)


def seen_from_above(first: float, step: float, upside_down: bool) -> tuple[float, float]:
    """Return the first direction and the step of a LiDAR's own papers as they are, counter-clockwise from above."""
    return (-first, -step) if upside_down else (first, step)


def sweep_s(lidar: Lidar) -> float:
    """Return how long a scan takes, from its first to its last reading [s]."""
    return abs(lidar.time_increment_s) * (lidar.beams - 1)


def _step(lidar: Lidar) -> float:
    """Return how far the next reading lies from one [rad], below 0 clockwise."""
    field = math.radians(lidar.fov_deg)
    step = TWO_PI / lidar.beams if lidar.fov_deg >= 360.0 else field / (lidar.beams - 1)
    return -step if lidar.clockwise else step


def layout_of(lidar: Lidar) -> Layout:
    """Return the layout of a checked LiDAR's scans in the body's axes, the mount's yaw included.

    Raises ConfigError when the robot cannot see straight ahead: it drives forwards only.
    """
    first = math.radians(lidar.fov_deg) * (0.5 if lidar.clockwise else -0.5)
    if lidar.first_deg is not None:
        first = math.radians(lidar.first_deg)
    first, step = seen_from_above(first, _step(lidar), lidar.upside_down)
    layout = lay_out(lidar.beams, first + lidar.mount[2], step, lidar.range_m)
    rays, count = layout.rays, layout.order.size
    last = rays.start + rays.increment * (count - 1)
    if not rays.closed and not (rays.start <= 1e-9 and last >= -1e-9 and count >= FEWEST_BEAMS):
        raise ConfigError(
            "lidar.mount" if lidar.mount[2] else "lidar.first_deg",
            f"the field of view is {math.degrees(rays.start):.0f} to {math.degrees(last):.0f} degrees: "
            "straight ahead is not in it, and the robot drives forwards",
        )
    return layout


def grid_of(layout: Layout) -> Layout:
    """Return the rays that planners see: those of the LiDAR, its circle made an exact one."""
    if not layout.rays.closed:
        return layout
    return _circle(np.arange(layout.order.size), layout.rays.start, layout.rays.reach)


def sensor_of(lidar: Lidar, grid: Layout) -> Sensor:
    """Return what planners know of a checked LiDAR: the rays ``grid`` round the body's centre."""
    offset = math.hypot(lidar.mount[0], lidar.mount[1])
    return Sensor(
        beams=int(grid.order.size),
        angle_min=grid.rays.start,
        increment=grid.rays.increment,
        wraps=grid.rays.closed,
        range_min=max(0.0, lidar.range_min_m - offset),
        range_max=lidar.range_m,
        range_sigma=lidar.range_sigma,
        position_sigma=lidar.position_sigma,
    )
