"""Rocks: random convex polygons of given areas.

The corners of a rock lie on an ellipse, so that the rock is convex: n corners, n uniform in 5 .. 8, the k-th at
the angle 2 pi (k + 0.7 u) / n with u uniform in [0, 1); the ratio of the ellipse's axes is uniform in [1, 2]
and the ellipse is turned by a uniform angle. Then the polygon is scaled to its area.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FEWEST, MOST = 5, 8  # corners
JITTER = 0.7  # of a corner, as a share of the even angle between two corners
STRETCH = 2.0  # largest ratio of the ellipse's axes

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


class Rocks(NamedTuple):
    """Outlines round the origin (the mean of their corners)."""

    corners: Floats  # (sum of counts, 2) x, y [m], counter-clockwise, one rock after the other
    counts: Ints  # (C,) corners of each rock
    reach: Floats  # (C,) distance [m] from the origin to the farthest corner


def draw_rocks(rng: np.random.Generator, areas: Floats) -> Rocks:
    """Return one rock for each of the areas (C,) [m^2]."""
    counts = rng.integers(FEWEST, MOST, len(areas), endpoint=True)
    stretch, turn = rng.uniform(1.0, STRETCH, len(areas)), rng.uniform(0.0, 2.0 * np.pi, len(areas))
    owner = np.repeat(np.arange(len(areas)), counts)
    start = np.cumsum(counts) - counts
    place = np.arange(len(owner)) - start[owner]
    angle = 2.0 * np.pi * (place + JITTER * rng.random(len(owner))) / counts[owner]
    x, y = np.cos(angle) * np.sqrt(stretch)[owner], np.sin(angle) / np.sqrt(stretch)[owner]
    after = np.where(place == counts[owner] - 1, start[owner], np.arange(len(owner)) + 1)
    twice = np.bincount(owner, x * y[after] - y * x[after], minlength=len(areas))
    scale = np.sqrt(2.0 * areas / twice)
    x -= (np.bincount(owner, x, minlength=len(areas)) / counts)[owner]
    y -= (np.bincount(owner, y, minlength=len(areas)) / counts)[owner]
    cos, sin = np.cos(turn)[owner], np.sin(turn)[owner]
    corners = scale[owner, None] * np.stack([cos * x - sin * y, sin * x + cos * y], axis=1)
    reach = np.zeros(len(areas))
    np.maximum.at(reach, owner, np.hypot(corners[:, 0], corners[:, 1]))
    return Rocks(corners, counts, reach)
