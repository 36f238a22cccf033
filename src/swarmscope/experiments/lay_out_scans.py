"""Recorded scans as `Robot` lays them out: every reading understood, every scan along the same rays, and counted."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swarmscope.errors import ConfigError
from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import LONGEST_SWEEP_S, Layout, lay_out, same_rays, seen_from_above
from swarmscope.onboard.perception.mend import least_range
from swarmscope.onboard.perception.rays import Rays
from swarmscope.onboard.perception.reproject import Grid, settle
from swarmscope.onboard.readings import own_rays, translate
from swarmscope.onboard.rig import GUARDING, SAFETY, SHARING, Guarding, Rig, Safety, Sharing
from swarmscope.onboard.sweep import Taken, bridged, from_many_places
from swarmscope.onboard.trail import poses_at, seen_from, then
from swarmscope.sim.scan_files import ScanLog

CENTRED = (0.0, 0.0, 0.0)


class Use(NamedTuple):
    """How a robot uses a scanner, and its data sheet."""

    range_m: float = 5.0
    """Readings beyond it count as no return [m]."""
    beam_step: int = 1
    """Use every so manieth beam only."""
    no_return: Sequence[float] = ()
    """Readings that say that there was no return, beside +inf, in the unit of the file; may be NaN."""
    masks_deg: Sequence[tuple[float, float]] = ()
    """Directions, from .. to counter-clockwise, in which the robot sees itself [degrees]."""
    upside_down: bool = False
    """Mounted upside down: what its header calls left is right."""
    time_increment_s: float | None = None
    """From one reading to the next [s]; None: as the file says."""
    motion: tuple[float, float] | None = None
    """Speed [m/s] and turn rate [rad/s] of the robot while it recorded; None: by the file's odometry, if there is."""
    range_min_m: float = 0.0
    """Shorter readings are too near to be measured; the file's own shortest range counts, too [m]."""
    body: Body = Body()
    guarding: Guarding = GUARDING
    safety: Safety = SAFETY
    sharing: Sharing = SHARING
    range_sigma: float = 0.0
    position_sigma: float = 0.0


@dataclass(frozen=True)
class Counts:
    """What became of the readings of K scans; all (K,) whole numbers of readings but the last two fields."""

    open: np.ndarray
    """There was no return within the range."""
    broken: np.ndarray
    """NaN or negative."""
    broken_blocks: np.ndarray
    """Those of them in holes that a body fits into: nothing goes there."""
    below: np.ndarray
    """Too near to be measured, or inside the body."""
    below_blocks: np.ndarray
    own: np.ndarray
    """In which the robot sees itself."""
    own_blocks: np.ndarray
    inside: np.ndarray
    """Sound returns from within the robot's radius: of itself, or of what it touches."""
    moved: int
    """Scans put right for the robot's own motion."""
    turned: int
    """Scans whose readings lay along other rays than most."""


COUNTED = ("open", "broken", "broken_blocks", "below", "below_blocks", "own", "own_blocks", "inside")


class _Key(NamedTuple):
    """What scans have in common that are laid out in the same way."""

    readings: int
    first: float
    step: float


def layout_of(log: ScanLog, use: Use) -> Layout:
    """Return the layout that most scans have, counter-clockwise, a circle closed where it closes."""
    return _layout(log, use, _commonest(_keys(log)))


def _commonest(keys: list[_Key]) -> _Key:
    counts = Counter(keys)
    return max(counts, key=lambda key: (counts[key], key.readings))


def lay_out_scans(log: ScanLog, use: Use, rig: Rig) -> tuple[np.ndarray, Counts]:
    """Return scans (K, M) along the rig's rays [m], and what was done to them."""
    keys, sensor = _keys(log), rig.sensor
    rays = Rays(sensor.angle_min, sensor.increment, sensor.wraps, sensor.range_max)
    wanted, whole = Grid(rays, rig.cos, rig.sin), Layout(rays, np.arange(sensor.beams))
    ways = {key: _Way.of(log, use, key) for key in dict.fromkeys(keys)}
    step_s = _time_increment(log, use)
    was_at = _way_driven(log, use) if step_s != 0.0 else None
    scans, counted = np.empty((len(keys), sensor.beams), np.float32), np.zeros((len(keys), len(COUNTED)), int)
    for k, key in enumerate(keys):
        layout, own = ways[key].layout, ways[key].own
        values = np.array(log.ranges_m[k, : key.readings : use.beam_step], np.float32)
        translate(values, [value * log.unit_m for value in use.no_return])
        raw = np.empty(layout.order.size, np.float32)
        settle(values, layout.order, sensor.range_min, sensor.range_max, raw)
        raw[own] = np.nan
        counted[k] = _counted(values[layout.order], raw, own, layout, rig)
        if was_at is None and same_rays(layout, whole):
            scans[k] = raw
            continue
        back = np.zeros((raw.size, 3)) if was_at is None else was_at(k, use.beam_step * step_s * layout.order)
        scans[k] = from_many_places(Taken(raw, layout, CENTRED, sensor.range_min), back, rig, wanted).scan
    turned = len(keys) - keys.count(_commonest(keys))
    found = dict(zip(COUNTED, counted.T, strict=True))
    return scans, Counts(**found, moved=0 if was_at is None else len(keys), turned=turned)


def _counted(values: np.ndarray, raw: np.ndarray, own: np.ndarray, layout: Layout, rig: Rig) -> tuple[int, ...]:
    """Return the fields of `Counts` of one scan: ``values (M,)`` as they were, ``raw (M,)`` as they are understood."""
    holes = ~(raw >= least_range(rig))
    blocks = holes & np.isnan(bridged(np.where(holes, np.nan, raw), layout, rig, rig.sensor.range_min)[1])
    near = holes & ~own & ((values >= 0.0) | (values == -np.inf))
    broken = holes & ~own & ~near
    inside = ~holes & (raw < rig.body.radius_m)
    parts = (broken, broken & blocks, near, near & blocks, own, own & blocks, inside)
    return int(np.isinf(raw).sum()), *(int(part.sum()) for part in parts)


def _keys(log: ScanLog) -> list[_Key]:
    """Return how each scan lies."""
    scans, beams = log.ranges_m.shape
    lengths = [beams] * scans if log.lengths is None else log.lengths.tolist()
    if log.geometry is None:
        return [_Key(length, log.angle_min, log.increment) for length in lengths]
    return [_Key(length, *pair) for length, pair in zip(lengths, log.geometry.tolist(), strict=True)]


def _layout(log: ScanLog, use: Use, key: _Key) -> Layout:
    """Return the layout of the used ones of a scan's readings."""
    first, step = seen_from_above(key.first, key.step, use.upside_down)
    count = len(range(0, key.readings, use.beam_step))
    return lay_out(count, first, step * use.beam_step, min(use.range_m, log.range_max))


class _Way(NamedTuple):
    """How some scans are laid out."""

    layout: Layout
    own: np.ndarray

    @classmethod
    def of(cls, log: ScanLog, use: Use, key: _Key) -> _Way:
        layout = _layout(log, use, key)
        return cls(layout, own_rays(layout, use.masks_deg))


def _time_increment(log: ScanLog, use: Use) -> float:
    """Return the time from one reading to the next [s]; raises ConfigError."""
    step_s = log.time_increment if use.time_increment_s is None else use.time_increment_s
    sweep = abs(step_s) * (log.ranges_m.shape[1] - 1)
    if sweep > LONGEST_SWEEP_S:
        why = f"a scan would take {sweep:.3g} s, at most {LONGEST_SWEEP_S:g} s (0: all at once)"
        raise ConfigError("--time-increment", why)
    return step_s


def _way_driven(log: ScanLog, use: Use) -> Callable[[int, np.ndarray], np.ndarray] | None:
    """Return what says where the robot was when readings of scan k were taken, None when nobody knows.

    It is told how long after the scan's stamp each was taken (M,) [s], and returns x, y, yaw (M, 3) seen from where the
    robot was at the last of them.
    """
    if use.motion is not None:
        v, w = use.motion
        return lambda k, late_s: _on_arc(late_s - late_s.max(), v, w)
    if log.odom is None or len(log.odom) < 2 or not np.isfinite(log.stamp_s).all():
        return None
    stamps, poses = log.stamp_s, log.odom
    lasts = float(stamps[-1] - stamps[-2])
    if lasts > 0.0:  # after the last scan it went on in the same way
        x, y, yaw = (float(value) for value in poses[-1])
        before = (float(poses[-2, 0]), float(poses[-2, 1]), float(poses[-2, 2]))
        poses = np.vstack([poses, then((x, y, yaw), seen_from(before, (x, y, yaw)))])
        stamps = np.append(stamps, stamps[-1] + lasts)
    return lambda k, late_s: _from_last(poses_at(log.stamp_s[k] + late_s, stamps, poses), int(np.argmax(late_s)))


def _on_arc(since_s: np.ndarray, v: float, w: float) -> np.ndarray:
    """Return where a robot was that drives ``v`` [m/s] and turns ``w`` [rad/s], seen from where it is now (M, 3)."""
    turn = w * since_s
    if w == 0.0:
        return np.column_stack([v * since_s, 0.0 * since_s, turn])
    return np.column_stack([v / w * np.sin(turn), v / w * (1.0 - np.cos(turn)), turn])


def _from_last(poses: np.ndarray, last: int) -> np.ndarray:
    """Return poses (M, 3) as seen from one of them."""
    dx, dy, yaw = (poses - poses[last]).T
    c, s = np.cos(poses[last, 2]), np.sin(poses[last, 2])
    return np.column_stack([c * dx + s * dy, c * dy - s * dx, yaw])
