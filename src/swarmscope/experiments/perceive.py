"""On-board perception of recorded scans: the same kernels as on a robot, timed."""

from __future__ import annotations

import csv
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from swarmscope._jit import jit
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.onboard.body import Body
from swarmscope.onboard.perception.mend import mend
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.rig import AHEAD, Rig, make_rig
from swarmscope.onboard.sensor import Sensor
from swarmscope.onboard.sharing.message import MAX_FEATURES_BYTES, Head, encode_features
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
    broken: np.ndarray
    """(K,) readings that were none: NaN, or too near to be of something else."""
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


def perceive(log: ScanLog, range_m: float = 5.0, radius_m: float = 0.15, beam_step: int = 1) -> Perception:
    """Return safe directions, filtered scan, features and message size of every scan of the log.

    ``beam_step`` k uses every k-th beam only.
    """
    if not 0.0 < range_m <= 1000.0:
        raise ConfigError("--range", f"must be a positive number of metres, not {range_m}")
    if beam_step < 1:
        raise ConfigError("--beam-step", f"must be at least 1, not {beam_step}")
    if not range_m > log.range_min:
        raise ConfigError("--range", f"must be above the scanner's smallest range, {log.range_min:g} m")
    ranges = np.array(log.ranges_m[:, ::beam_step], np.float32, order="C")
    rig = _rig_of(log, ranges.shape[1], log.increment * beam_step, range_m, radius_m)
    ranges[ranges > rig.sensor.range_max] = np.inf
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
    return Perception(rig, directions, ranges, broken, safe, filtered, found, sizes, times)


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


def _rig_of(log: ScanLog, beams: int, increment: float, range_m: float, radius_m: float) -> Rig:
    """Return a robot with the log's scanner."""
    if beams < 2:
        raise ConfigError(log.name, "a scan needs at least two beams")
    sensor = Sensor(
        beams=beams,
        angle_min=float(log.angle_min),
        increment=float(increment),
        wraps=abs(beams * increment - 2.0 * np.pi) < 0.5 * increment,
        range_min=float(log.range_min),
        range_max=float(min(range_m, log.range_max)),
        range_sigma=0.0,
        position_sigma=0.0,
    )
    return make_rig(Body(radius_m=radius_m, half_width_m=radius_m), sensor)
