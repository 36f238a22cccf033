"""The choice of a side: own features, neighbours' features, fused (Nav-SCOPE 8-15, Algorithm 1 lines 16-27)."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.percept import PEERS, Rig, Row
from swarmscope.onboard.perception.areas import normalise, passable_distance, quadrant_area
from swarmscope.onboard.perception.features import align_features
from swarmscope.onboard.planning.fields import (
    following_probability,
    fuse,
    in_pass_band,
    interaction_force,
    left_probability,
)


@jit
def own_probability(
    angles: np.ndarray, distances: np.ndarray, count: int, half_alpha: float, bias: float, polygon: bool
) -> float:
    """Return P_a (9), SFM-MAS (7), from our features in the target-aligned frame, sorted in [0, 2 pi), normalised.

    ``polygon`` takes areas from triangles (SFM-MAS 24), with borders linear in the angle, as Table II needs.
    """
    quarter = 0.5 * math.pi
    return left_probability(
        quadrant_area(angles, distances, count, 0.0, half_alpha, polygon),
        quadrant_area(angles, distances, count, -half_alpha, 0.0, polygon),
        quadrant_area(angles, distances, count, half_alpha, quarter, polygon),
        quadrant_area(angles, distances, count, -quarter, -half_alpha, polygon),
        bias,
    )


@jit
def choose_side(
    percept: Row,
    shared: Row,
    decision: Row,
    rig: Rig,
    w_i: float,
    bias: float,
    polygon: bool,
    angles: np.ndarray,
    distances: np.ndarray,
    count: int,
    out_angles: np.ndarray,
    out_distances: np.ndarray,
) -> int:
    """Return the side to pass the obstacle on, +1 left or -1 right, and note the numbers in ``decision``.

    ``angles``, ``distances``: our ``count`` features, compass frame, m. Left iff P_dir >= 0.5 (MAP, readings 10).
    ``polygon`` reads features as SFM-MAS does: areas (24), passable distances (22) with borders on the chords.
    """
    target = percept["compass"] + percept["goal_bearing"]
    half_alpha = 0.5 * rig.protection.alpha
    range_max = rig.sensor.range_max
    align_features(angles, distances, count, -target, out_angles, out_distances)
    _normalise_all(out_distances, count, range_max)
    p_self = own_probability(out_angles, out_distances, count, half_alpha, bias, polygon)
    threshold = normalise(rig.protection.w_n, range_max)
    weighted, weights = 0.0, 0.0
    heard = 0
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            continue
        x, y = shared["track_x"][t], shared["track_y"][t]
        distance = math.sqrt(x * x + y * y)
        if not in_pass_band(distance, rig.protection.sigma_a):
            continue
        bearing = wrap_angle(math.atan2(y, x) - target)
        slot = _heard_of(shared, shared["track_id"][t])
        if slot < 0 or abs(bearing) > 0.5 * math.pi:
            continue
        n = shared["heard_n"][slot]
        align_features(
            shared["heard_angle"][slot], shared["heard_distance"][slot], n, -target, out_angles, out_distances
        )
        _normalise_all(out_distances, n, range_max)
        x_1 = passable_distance(out_angles, out_distances, n, 0.0, half_alpha, polygon)
        x_2 = passable_distance(out_angles, out_distances, n, -half_alpha, 0.0, polygon)
        force = interaction_force(distance, rig.protection.sigma_a, w_i)
        follow = following_probability(x_1, x_2, threshold, bearing >= 0.0)
        weighted += force * follow
        weights += force
        decision["heard_id"][heard] = shared["track_id"][t]
        decision["heard_p"][heard], decision["heard_f"][heard] = follow, force
        decision["heard_side"][heard] = 1 if bearing >= 0.0 else -1
        heard += 1
    p_left = fuse(p_self, weighted, weights)
    decision["p_self"], decision["p_left"] = p_self, p_left
    decision["fused"], decision["heard"] = 1, heard
    return 1 if p_left >= 0.5 else -1


@jit_inner
def _normalise_all(distances: np.ndarray, count: int, range_max: float) -> None:
    """Apply (SFM-MAS 25) to the first ``count`` distances in place."""
    for j in range(count):
        distances[j] = normalise(distances[j], range_max)


@jit_inner
def _heard_of(shared: Row, peer: int) -> int:
    """Return the slot with the features of ``peer``, or -1."""
    for p in range(PEERS):
        if shared["heard_id"][p] == peer and shared["heard_n"][p] > 0:
            return p
    return -1
