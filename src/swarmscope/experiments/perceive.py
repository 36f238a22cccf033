"""On-board perception of recorded scans: the same kernels as on a robot, timed."""

from __future__ import annotations

import csv
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swarmscope._jit import jit
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.experiments.lay_out_scans import Counts, Use, lay_out_scans, layout_of
from swarmscope.onboard.lidar import LONGEST_M, Layout, grid_of
from swarmscope.onboard.perception.mend import mend
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.rig import AHEAD, Rig, make_rig
from swarmscope.onboard.scans import MOST_READINGS
from swarmscope.onboard.sensor import Sensor
from swarmscope.onboard.sharing.message import MAX_PACKET_BYTES, Head, encode_exact_features, encode_features
from swarmscope.onboard.tick import own_features
from swarmscope.onboard.view import Swarm, new_swarm, view_of
from swarmscope.sim.scan_files import ScanLog

REPEATS = 50


@dataclass(frozen=True)
class Perception:
    """What a robot makes of each of K scans."""

    rig: Rig
    angles: np.ndarray
    """Beam directions (M,) [rad], sensor frame."""
    ranges_m: np.ndarray
    """(K, M), +inf beyond the range that the robot uses."""
    counts: Counts
    """What was wrong with the readings, and what was done."""
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
    rig = _rig_of(log, grid_of(layout_of(log, use)), use)
    ranges, counts = lay_out_scans(log, use, rig)
    scans, beams = ranges.shape
    safe, filtered = np.zeros((scans, beams), bool), np.zeros((scans, beams), np.float32)
    found: list[np.ndarray] = []
    sizes, times = np.zeros(scans, int), np.zeros(scans)
    swarm = new_swarm(1, rig)
    perceive_repeatedly(1, swarm)  # loads the kernels
    for k in range(scans):
        swarm.masked[0] = ranges[k]
        mend(swarm.masked[0], rig, swarm.safe[0])
        start = time.perf_counter_ns()
        count = perceive_repeatedly(REPEATS, swarm)
        times[k] = (time.perf_counter_ns() - start) / 1e3 / REPEATS
        safe[k], filtered[k] = swarm.safe[0] == 1, swarm.filtered[0]
        angles, distances = swarm.own.angles[0, :count].copy(), swarm.own.distances[0, :count].copy()
        found.append(np.column_stack([(angles + np.pi) % (2 * np.pi) - np.pi, distances]))
        sizes[k] = _message_bytes(angles, distances, rig)
    directions = rig.sensor.angle_min + rig.sensor.increment * np.arange(beams)
    return Perception(rig, directions, ranges, counts, safe, filtered, found, sizes, times)


def _check(log: ScanLog, use: Use) -> None:
    """Raise a ConfigError for what cannot be."""
    if not 0.0 < use.range_m <= LONGEST_M:
        raise ConfigError("--range", f"must be a positive number of metres, not {use.range_m}")
    if use.beam_step < 1:
        raise ConfigError("--beam-step", f"must be at least 1, not {use.beam_step}")
    least = max(log.range_min, use.range_min_m)
    if not use.range_m > least:
        raise ConfigError("--range", f"must be above the scanner's smallest range, {least:g} m")
    used = log.ranges_m[:, :: use.beam_step].shape[1]
    if used < 2:
        raise ConfigError(log.name, "a scan needs at least two beams")
    if used > MOST_READINGS:
        raise ConfigError("--beam-step", f"a robot uses at most {MOST_READINGS} of a scan's readings, not {used}")
    for name, value in (("--time-increment", use.time_increment_s), ("--speed, --turn-rate", use.motion)):
        if value is not None and not np.isfinite(value).all():
            raise ConfigError(name, "must be a finite number")


def _message_bytes(angles: np.ndarray, distances: np.ndarray, rig: Rig) -> int:
    """Return the bytes of the message with these features."""
    head, packet, count = Head(0, 0, 0, 0), np.zeros(MAX_PACKET_BYTES, np.uint8), len(angles)
    if rig.sharing.exact_features:
        return int(encode_exact_features(head, angles, distances, count, packet))
    return int(encode_features(head, angles, distances, count, rig.sensor.range_max, packet))


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
        range_min=max(float(log.range_min), use.range_min_m),
        range_max=grid.rays.reach,
        range_sigma=use.range_sigma,
        position_sigma=use.position_sigma,
    )
    return make_rig(use.body, sensor, use.guarding, use.safety, use.sharing)
