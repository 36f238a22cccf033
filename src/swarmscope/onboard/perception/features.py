"""Features of a scan: the extrema of the filtered scan, Nav-SCOPE (7), and their reconstruction."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import TWO_PI, positive_angle
from swarmscope.onboard.sensor import Sensor

MINIMA, MAXIMA = 1, 2
"""Kinds of extrema, added up: which of them count in a direction."""
UNMASKED, MASK_MAXIMA, MASK_ALL = range(3)
MASKS = {"none": UNMASKED, "maxima": MASK_MAXIMA, "all": MASK_ALL}
"""Which extrema count in safe directions only (`Sharing.feature_mask`): none, maxima, or minima, too."""
FLAT = 1e-5
"""Change from beam to beam, as a fraction of the range, below which the filtered scan counts as flat."""


@jit
def extrema(
    filtered: np.ndarray, counts: np.ndarray, sensor: Sensor, angles: np.ndarray, distances: np.ndarray
) -> int:
    """Write the extrema of ``filtered (M,)`` (7) into ``angles`` [rad], ``distances`` [m]; return how many.

    A sign change of the first difference marks an extremum; a plateau counts once, at its middle. ``counts (M,)`` uint8
    says of which kinds they count in each direction (`what_counts`). Ascending angles, sensor frame.
    """
    beams = filtered.size
    flat = np.float32(FLAT * sensor.range_max)
    start = 0
    steps = beams if sensor.wraps else beams - 1
    if sensor.wraps:  # begin just after a slope, so that no plateau is cut in two
        while start < beams and abs(filtered[(start + 1) % beams] - filtered[start]) <= flat:
            start += 1
        if start == beams:
            return 0
    rising = 0
    slope_at = start  # beam and step number of the last change
    slope_step = 0
    count = 0
    n = start
    ahead = filtered[start]
    for k in range(steps + (1 if sensor.wraps else 0)):
        after = n + 1 if n + 1 < beams else 0
        here, ahead = ahead, filtered[after]
        if abs(ahead - here) > flat:
            sign = 1 if ahead > here else -1
            if sign == -rising:
                beam = slope_at + 1 + (k - slope_step - 1) // 2
                if beam >= beams:
                    beam -= beams
                kind = MINIMA if sign > 0 else MAXIMA
                if counts[beam] & kind and count < angles.size:
                    angles[count] = sensor.angle_min + beam * sensor.increment
                    distances[count] = filtered[beam]
                    count += 1
            rising, slope_at, slope_step = sign, n, k
        n = after
    _sort_by_angle(angles, distances, count)
    return count


@jit_inline
def what_counts(mask: int, safe: np.ndarray) -> None:
    """Turn ``safe (M,)`` uint8, 1 for safe directions, into the kinds of extrema that count in each of them.

    Nav-SCOPE (7) masks the features by the safe directions, "to filter out narrow spaces": maxima, since a narrow gap
    is no way. SFM-MAS (21) masks none. Minima are obstacles; to mask them, too, hides what forces a decision.
    """
    if mask == MASK_ALL:
        safe *= np.uint8(MINIMA + MAXIMA)
    elif mask == MASK_MAXIMA:
        safe *= np.uint8(MAXIMA)
        safe += np.uint8(MINIMA)
    else:
        safe[:] = MINIMA + MAXIMA


@jit_inner
def _sort_by_angle(angles: np.ndarray, distances: np.ndarray, count: int) -> None:
    """Sort the first ``count`` pairs by angle, in place (insertion sort: a handful of pairs)."""
    for i in range(1, count):
        angle, distance = angles[i], distances[i]
        j = i - 1
        while j >= 0 and angles[j] > angle:
            angles[j + 1], distances[j + 1] = angles[j], distances[j]
            j -= 1
        angles[j + 1], distances[j + 1] = angle, distance


@jit
def align_features(
    angles: np.ndarray,
    distances: np.ndarray,
    count: int,
    turn: float,
    out_angles: np.ndarray,
    out_distances: np.ndarray,
) -> None:
    """Write the features turned by ``turn`` [rad] into the out arrays: angles in [0, 2 pi), ascending.

    Features that come in ascending order stay in it but for where the circle ends, which saves the sorting.
    """
    turn = positive_angle(turn)
    first = 0  # the feature with the smallest angle after turning
    while first < count and angles[first] + turn < TWO_PI:
        first += 1
    j = first
    for k in range(count):
        if j == count:
            j = 0
        out_angles[k] = positive_angle(angles[j] + turn)
        out_distances[k] = distances[j]
        j += 1
    _sort_by_angle(out_angles, out_distances, count)


@jit
def reconstruct(angles: np.ndarray, distances: np.ndarray, count: int, phi: float, chords: bool) -> float:
    """Return the reconstructed distance at ``phi`` in [0, 2 pi) from features sorted in [0, 2 pi) (Nav-SCOPE IV-B).

    Linear in the angle between consecutive features, or along the polygon's chord (``chords``; readings 8).
    0 without features, their distance with one.
    """
    if count == 0:
        return 0.0
    if count == 1:
        return float(distances[0])
    right = 0
    while right < count and angles[right] <= phi:
        right += 1
    left = right - 1
    a = angles[left] if left >= 0 else angles[count - 1] - TWO_PI
    d_a = distances[left] if left >= 0 else distances[count - 1]
    b = angles[right] if right < count else angles[0] + TWO_PI
    d_b = distances[right] if right < count else distances[0]
    if b - a <= 1e-12:
        return float(d_b)
    if chords and b - a < math.pi:
        across = d_a * math.sin(phi - a) + d_b * math.sin(b - phi)
        return float(d_a * d_b * math.sin(b - a) / across) if across > 1e-12 else 0.0
    return float(d_a + (d_b - d_a) * (phi - a) / (b - a))
