"""Where the rays of a scan look: plain numbers for kernels."""

from __future__ import annotations

from typing import NamedTuple


class Rays(NamedTuple):
    """Directions of a scan, counter-clockwise: ray n at ``start + n * increment`` [rad]."""

    start: float
    increment: float
    closed: bool
    """Whether the last ray is the first one's neighbour."""
    reach: float
    """Longest range [m]."""
