"""On-board perception of recorded scans: the same kernels as on a robot, timed."""

from __future__ import annotations

import csv
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.onboard.body import Body
from swarmscope.onboard.lidar import LONGEST_M, Layout, Rays, grid_of, lay_out, same_rays
from swarmscope.onboard.perception.mend import mend
from swarmscope.onboard.perception.reproject import Grid, Seat, reproject, settle
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.rig import AHEAD, Rig, make_rig
from swarmscope.onboard.sensor import Sensor
from swarmscope.onboard.sharing.message import MAX_FEATURES_BYTES, Head, encode_features
from swarmscope.onboard.tick import own_features
from swarmscope.onboard.view import Swarm, new_swarm, view_of
from swarmscope.sim.scan_files import ScanLog

REPEATS = 50
TOO_NEAR_M = 1e-6
"""A reading of 0 is too near, whatever the scanner's shortest range."""
MASK_SLACK_DEG = 1e-6


class Use(NamedTuple):
    """How a robot uses a scanner."""

    range_m: float = 5.0
    """Readings beyond it count as no return [m]."""
    radius_m: float = 0.15
    """The robot's radius [m]."""
    beam_step: int = 1
    """Use every so manieth beam only."""
    no_return: float | None = None
    """The reading that says that there was no return, beside +inf, as the file has it [m]."""
    masks_deg: Sequence[tuple[float, float]] = ()
    """Directions, from .. to counter-clockwise, in which the robot sees itself [degrees]."""
    upside_down: bool = False
    """Mounted upside down: what its header calls left is right."""


@dataclass(frozen=True)
class Perception:
    """What a robot makes of each of K scans."""

    rig: Rig
    angles: np.ndarray
    """Beam directions (M,) [rad], sensor frame."""
    ranges_m: np.ndarray
    """(K, M), +inf beyond the range that the robot uses."""
    broken: np.ndarray
    """(K,) readings that were none: NaN, or too near to be of something else."""
    below: np.ndarray
    """(K,) those of them below the scanner's shortest range."""
    masked: int
    """Beams in which the robot sees itself, bridged in every scan."""
    safe: np.ndarray
    """(K, M) bool."""
    filtered_m: np.ndarray
    """(K, M)."""
    features: list[np.ndarray]
    """Per scan (n, 2): direction [rad] in (-pi, pi], distance [m]."""
    packet_bytes: np.ndarray
    """(K,) bytes of the message."""
    us: np.ndarray
    """(K,) time of one scan, mean of the repeats in a compiled loop [us]."""


def perceive(log: ScanLog, use: Use = Use()) -> Perception:  # noqa: B008  a tuple
    """Return safe directions, filtered scan, features and message size of every scan of the log."""
    _check(log, use)
    layout = _layout_of(log, use, log.ranges_m.shape[1])
    rig = _rig_of(log, grid_of(layout), use)
    ranges, below = _laid_out(log, use, rig)
    masked = int(_is_masked(layout, use.masks_deg).sum())
    scans, beams = ranges.shape
    broken, safe = np.zeros(scans, int), np.zeros((scans, beams), bool)
    filtered = np.zeros((scans, beams), np.float32)
    found: list[np.ndarray] = []
    sizes, times = np.zeros(scans, int), np.zeros(scans)
    packet = np.zeros(MAX_FEATURES_BYTES, np.uint8)
    swarm = new_swarm(1, rig)
    perceive_repeatedly(1, swarm)  # loads the kernels
    for k in range(scans):
        swarm.masked[0] = ranges[k]
        broken[k] = mend(swarm.masked[0], rig, swarm.safe[0])
        start = time.perf_counter_ns()
        count = perceive_repeatedly(REPEATS, swarm)
        times[k] = (time.perf_counter_ns() - start) / 1e3 / REPEATS
        safe[k], filtered[k] = swarm.safe[0] == 1, swarm.filtered[0]
        angles, distances = swarm.own.angles[0, :count].copy(), swarm.own.distances[0, :count].copy()
        found.append(np.column_stack([(angles + np.pi) % (2 * np.pi) - np.pi, distances]))
        sizes[k] = encode_features(Head(0, 0, 0, 0), angles, distances, count, rig.sensor.range_max, packet)
    directions = rig.sensor.angle_min + rig.sensor.increment * np.arange(beams)
    return Perception(rig, directions, ranges, broken, below, masked, safe, filtered, found, sizes, times)


def _check(log: ScanLog, use: Use) -> None:
    """Raise a ConfigError for what cannot be."""
    if not 0.0 < use.range_m <= LONGEST_M:
        raise ConfigError("--range", f"must be a positive number of metres, not {use.range_m}")
    if use.beam_step < 1:
        raise ConfigError("--beam-step", f"must be at least 1, not {use.beam_step}")
    if not use.range_m > log.range_min:
        raise ConfigError("--range", f"must be above the scanner's smallest range, {log.range_min:g} m")
    if log.ranges_m[:, :: use.beam_step].shape[1] < 2:
        raise ConfigError(log.name, "a scan needs at least two beams")


def _layout_of(log: ScanLog, use: Use, length: int) -> Layout:
    """Return the layout of the used ones of ``length`` readings: counter-clockwise, a circle closed where it closes."""
    sign = -1.0 if use.upside_down else 1.0
    count, reach = len(range(0, length, use.beam_step)), min(use.range_m, log.range_max)
    return lay_out(count, sign * log.angle_min, sign * log.increment * use.beam_step, reach)


def _laid_out(log: ScanLog, use: Use, rig: Rig) -> tuple[np.ndarray, np.ndarray]:
    """Return scans (K, M) along the rig's rays [m], and how many readings of each were too near."""
    values = np.array(log.ranges_m[:, :: use.beam_step], np.float32, order="C")
    if use.no_return is not None:
        with np.errstate(over="ignore"):
            values[values == np.float32(use.no_return)] = np.inf
    lengths = np.full(len(values), log.ranges_m.shape[1]) if log.lengths is None else log.lengths
    sensor, below = rig.sensor, np.zeros(len(values), int)
    scans = np.empty((len(values), sensor.beams), np.float32)
    rays = Rays(sensor.angle_min, sensor.increment, sensor.wraps, sensor.range_max)
    wanted, whole = Grid(rays, rig.cos, rig.sin), Layout(rays, np.arange(sensor.beams))
    here = Seat(0.0, 0.0, 0.0, 0.0, 0.0, use.radius_m)
    for length in np.unique(lengths).tolist():
        layout = _layout_of(log, use, length)
        own, raw = _is_masked(layout, use.masks_deg), np.empty(layout.order.size, np.float32)
        for k in np.flatnonzero(lengths == length).tolist():
            row = values[k]
            row[layout.order[own]] = np.nan
            used = row[layout.order]
            below[k] = np.count_nonzero((used >= 0.0) & (used < max(log.range_min, TOO_NEAR_M)))
            settle(row, layout.order, log.range_min, sensor.range_max, raw)
            if same_rays(layout, whole):
                scans[k] = raw
            else:
                reproject(raw, layout.rays, here, wanted, scans[k])
    return scans, below


def _is_masked(layout: Layout, masks_deg: Sequence[tuple[float, float]]) -> np.ndarray:
    """Return which rays (M,) look in one of the directions from .. to [degrees], counter-clockwise."""
    angles = np.degrees(layout.rays.start + layout.rays.increment * np.arange(layout.order.size))
    own = np.zeros(angles.size, bool)
    for first, last in masks_deg:
        own |= (angles - first) % 360.0 <= (last - first) % 360.0 + MASK_SLACK_DEG
    return own


@jit
def perceive_repeatedly(repeats: int, swarm: Swarm) -> int:
    """Find the safe directions and features of the first robot's masked scan; return the number of features.

    Once is enough for the result; many times in a row give a time without the call from Python.
    """
    count = 0
    for _ in range(repeats):
        see = view_of(swarm, 0)
        safe_directions(see.masked, see.rig.sensor, see.rig.reach[-1, AHEAD], see.edges, see.safe)
        count = own_features(see)
    return count


def write_features(path: Path, perception: Perception) -> Path:
    """Write one line per feature: scan, direction [rad], distance [m]; return the path."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="", encoding="utf-8") as file:
            rows = csv.writer(file)
            rows.writerow(["scan", "direction_rad", "distance_m"])
            for k, pairs in enumerate(perception.features):
                rows.writerows([k, f"{angle:.6f}", f"{distance:.4f}"] for angle, distance in pairs)
    except OSError as error:
        raise InputFileError(path, f"cannot be written ({error.strerror})") from None
    return path


def _rig_of(log: ScanLog, grid: Layout, use: Use) -> Rig:
    """Return a robot with the log's scanner."""
    sensor = Sensor(
        beams=int(grid.order.size),
        angle_min=grid.rays.start,
        increment=grid.rays.increment,
        wraps=grid.rays.closed,
        range_min=float(log.range_min),
        range_max=grid.rays.reach,
        range_sigma=0.0,
        position_sigma=0.0,
    )
    return make_rig(Body(radius_m=use.radius_m, half_width_m=use.radius_m), sensor)
