"""What the features say about the quadrants: areas (Nav-SCOPE 22, SFM-MAS 24) and passable distances (23).

All in the target-aligned frame: the target at angle 0, quadrant I from 0 to alpha/2 on the left, II on the
right, III and IV from alpha/2 on to 90 degrees. Distances are normalised by (SFM-MAS 25).
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline
from swarmscope.geometry import angle_from, positive_angle
from swarmscope.onboard.perception.features import reconstruct


@jit_inline
def normalise(distance: float, range_max: float) -> float:
    """Return f_n[d] = d / R + 1 (SFM-MAS 25)."""
    return distance / range_max + 1.0


@jit_inline
def sector_area(angle: float, d_l: float, d_u: float) -> float:
    """Return the area under a distance linear in the angle from d_l to d_u over ``angle`` [rad] (Nav-SCOPE 22)."""
    return angle / 6.0 * (d_l * d_l + d_l * d_u + d_u * d_u)


@jit_inline
def triangle_area(angle: float, d_l: float, d_u: float) -> float:
    """Return the area of the triangle between two vertices ``angle`` [rad] apart (SFM-MAS 24)."""
    return 0.5 * d_l * d_u * math.sin(angle)


@jit
def quadrant_area(
    angles: np.ndarray, distances: np.ndarray, count: int, lower: float, upper: float, triangles: bool
) -> float:
    """Return the reconstructed open area between ``lower`` and ``upper`` (target frame, rad; lower < upper).

    Features sorted in [0, 2 pi), distances normalised. ``triangles`` chooses (SFM-MAS 24) over (Nav-SCOPE 22).
    """
    start = positive_angle(lower)
    width = upper - lower
    area = 0.0
    at = 0.0
    d_at = reconstruct(angles, distances, count, start, False)
    first = 0
    while first < count and angles[first] <= start:
        first += 1
    for k in range(count):
        j = (first + k) % count
        there = angle_from(start, angles[j])
        if there >= width:
            break
        if there <= at:
            continue
        if triangles:
            area += triangle_area(there - at, d_at, distances[j])
        else:
            area += sector_area(there - at, d_at, distances[j])
        at, d_at = there, distances[j]
    end = start + width
    d_end = reconstruct(angles, distances, count, positive_angle(end), False)
    if triangles:
        return area + triangle_area(width - at, d_at, d_end)
    return area + sector_area(width - at, d_at, d_end)


@jit
def passable_distance(
    angles: np.ndarray, distances: np.ndarray, count: int, lower: float, upper: float, chords: bool
) -> float:
    """Return x_ni,k (23): the fuzzy passable distance between ``lower`` and ``upper`` (target frame, rad).

    The largest reconstructed distance in the quadrant; where a local minimum lies in it, the mean of that and
    the smallest minimum. Features sorted in [0, 2 pi), distances normalised. Boundary values linear in the
    angle, or on the polygon's ``chords`` (readings 8: Table II's R2 needs the former, R4 the latter).
    """
    start = positive_angle(lower)
    width = upper - lower
    end = positive_angle(start + width)
    largest = max(
        reconstruct(angles, distances, count, start, chords), reconstruct(angles, distances, count, end, chords)
    )
    smallest = math.inf
    for j in range(count):
        if angle_from(start, angles[j]) > width:
            continue
        largest = max(largest, distances[j])
        before = distances[j - 1] if j > 0 else distances[count - 1]
        after = distances[j + 1] if j + 1 < count else distances[0]
        if distances[j] < before and distances[j] < after:
            smallest = min(smallest, distances[j])
    return 0.5 * (largest + smallest) if smallest < math.inf else largest
