"""One tick of a robot, from scan to command: what every planner shares before and after its own decision."""

from __future__ import annotations

import numpy as np

from swarmscope._jit import jit
from swarmscope.onboard.control.guard import guard
from swarmscope.onboard.percept import Rig, Row
from swarmscope.onboard.perception.features import align_features, extrema
from swarmscope.onboard.perception.filters import filter_padded, prepare_scan
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.sharing.inbox import read_inbox
from swarmscope.onboard.sharing.tracks import mask_moving_neighbours, update_odometry, update_tracks


@jit
def begin(
    ranges: np.ndarray,
    percept: Row,
    shared: Row,
    decision: Row,
    work: np.ndarray,
    edges: np.ndarray,
    safe: np.ndarray,
    header: np.ndarray,
    angles: np.ndarray,
    distances: np.ndarray,
    rig: Rig,
    still_s: float,
) -> int:
    """Take in packets, poses and scan; return the number of safe directions.

    Afterwards ``work (M,)`` is the scan without moving neighbours and ``safe (M,)`` its safe directions.
    """
    decision["n_out"] = 0
    decision["fused"] = 0
    dx, dy = update_odometry(percept, shared)
    read_inbox(percept, shared, rig, header, angles[1], distances[1])
    update_tracks(percept, shared, rig, dx, dy)
    mask_moving_neighbours(ranges, percept, shared, rig, still_s, work)
    sensor = rig.sensor
    return safe_directions(
        work, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[0], edges, safe
    )


@jit
def features(
    work: np.ndarray,
    percept: Row,
    edges: np.ndarray,
    mask: np.ndarray,
    padded: np.ndarray,
    angles: np.ndarray,
    distances: np.ndarray,
    filtered: np.ndarray,
    rig: Rig,
) -> int:
    """Compute our features (7) of the scan ``work`` into row 0, compass frame; return how many.

    ``edges``, ``mask (M,)`` are scratch. The mask is the printed rule (3): the look-ahead would hide whatever is near.
    """
    sensor = rig.sensor
    safe_directions(work, sensor.range_min, sensor.range_max, sensor.wraps, rig.reach[3], edges, mask)
    prepare_scan(work, sensor.range_min, sensor.range_max, sensor.wraps, rig.half, padded)
    filter_padded(padded, rig.taps, sensor.range_max, filtered)
    count = extrema(
        filtered,
        mask,
        sensor.angle_min,
        sensor.increment,
        sensor.wraps,
        sensor.range_max,
        angles[1],
        distances[1],
    )
    align_features(angles[1], distances[1], count, percept["compass"], angles[0], distances[0])
    return count


@jit
def finish(
    ranges: np.ndarray, percept: Row, shared: Row, decision: Row, edges: np.ndarray, rig: Rig
) -> None:
    """Let the guard have the last word."""
    guard(ranges, percept, shared, decision, edges, rig)
