"""What a LiDAR's readings mean, before anything else is done with them: the one place for robots and for recordings.

+inf and what is beyond the longest range is no return, as are the values that the user names; NaN, -inf and what is
below the shortest range or below 0 is broken (REP-117), and so is every reading in which the robot sees itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from swarmscope.onboard.lidar import Layout

MASK_SLACK_DEG = 1e-6
MILLI, MOST, LEAST_MM = 1000.0, 0.9, 120.0
"""A millimetre; this share of all readings; no 2D LiDAR sees farther than so many metres, nor nearer in millimetres."""


def own_rays(layout: Layout, masks_deg: Sequence[tuple[float, float]], facing: float = 0.0) -> np.ndarray:
    """Return which rays (M,) look from .. to [degrees], counter-clockwise, seen from a sensor that faces ``facing``."""
    angles = np.degrees(layout.rays.start - facing + layout.rays.increment * np.arange(layout.order.size))
    own = np.zeros(angles.size, bool)
    for first, last in masks_deg:
        span = 360.0 if last - first >= 360.0 else (last - first) % 360.0
        own |= (angles - first + MASK_SLACK_DEG) % 360.0 <= span + 2.0 * MASK_SLACK_DEG
    return own


def translate(values: np.ndarray, no_return: Sequence[float]) -> None:
    """Make the readings (B,) that say that there was no return +inf, in place; NaN may be one of those values."""
    for value in no_return:
        with np.errstate(over="ignore"):  # beyond what float32 can hold: inf, which means no return anyway
            said = values.dtype.type(value)
        values[np.isnan(values) if math.isnan(value) else values == said] = np.inf


def are_millimetres(values: np.ndarray, least_m: float, most_m: float) -> bool:
    """Tell whether nearly all readings are far beyond the longest range, and within it as millimetres."""
    found = values[np.isfinite(values) & (values > 0.0)]
    if found.size == 0 or np.mean(found > most_m) < MOST:
        return False
    within = (found / MILLI >= least_m) & (found / MILLI <= most_m)
    return bool(np.mean(within) >= MOST)


def must_be_millimetres(values: np.ndarray, least_m: float, most_m: float) -> bool:
    """Tell the same of readings [m] of a scanner whose own longest range is not known.

    Many that are all alike are a way of saying that there was no return.
    """
    found = np.unique(values[np.isfinite(values) & (values > 0.0)])
    return found.size > 1 and bool(found[0] > LEAST_MM) and are_millimetres(found, least_m, most_m)
