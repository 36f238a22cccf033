"""A scan as a small picture for a network: what is hit and what is seen to be free, turned to a target (GIWT 4.3.1).

The picture is a square of ``CELLS`` x ``CELLS`` cells with the robot in the middle cell, x along the target direction
(columns), y to its left (rows, row 0 the rightmost). It shows what lies within ``radius_m``; at 2.5 m a cell is 0.05 m.
Two channels: HIT (a beam ends in the cell), FREE (a beam passes the cell); where both are 0 nothing is known.

Before anything else ranges become codes of one byte, in data sets and on board alike, so that both are the same.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline
from swarmscope.onboard.sensor import Sensor

CELLS = 101
CHANNELS = 2
HIT, FREE = range(CHANNELS)
CODE_STEP_M = 0.02
"""A range code is a range in units of this; 1 to ``FARTHEST``."""
FARTHEST = 253
NOTHING = 254
"""No return: free as far as the sensor sees."""
UNKNOWN = 255
"""A beam without a valid range (NaN), or one that ends at another robot: it says nothing."""
HALF_CELL = 0.6
"""A cell is hit when its centre is at most so many cells nearer or farther than a range."""


def polar_cells() -> tuple[np.ndarray, np.ndarray]:
    """Return direction [rad, from x, (-pi, pi]] and distance [cells] of every cell's centre, float32 (CELLS, CELLS)."""
    middle = CELLS // 2
    across = np.arange(CELLS) - middle
    x, y = np.meshgrid(across, across, indexing="xy")
    return np.arctan2(y, x).astype(np.float32), np.hypot(x, y).astype(np.float32)


CELL_ANGLE, CELL_DISTANCE = polar_cells()


@jit_inline
def _code(range_m: float) -> int:
    """Return the code of one range."""
    if not range_m >= 0.0:
        return UNKNOWN
    if range_m > FARTHEST * CODE_STEP_M:
        return NOTHING
    return max(1, int(math.floor(range_m / CODE_STEP_M + 0.5)))


@jit
def encode_scan(ranges: np.ndarray, out: np.ndarray) -> None:
    """Write the codes of ``ranges (M,)`` [m] into ``out (M,)`` uint8; NaN is UNKNOWN, infinity NOTHING."""
    for n in range(ranges.shape[0]):
        out[n] = _code(ranges[n])


@jit
def hide_robot(codes: np.ndarray, sensor: Sensor, x: float, y: float, radius: float) -> None:
    """Make the beams UNKNOWN that end at a robot of ``radius`` [m] at (x, y) [m], body frame."""
    beams = codes.shape[0]
    distance = math.sqrt(x * x + y * y)
    if distance <= radius:
        return
    half = math.asin(radius / distance)
    centre = (math.atan2(y, x) - sensor.angle_min) / sensor.increment
    low = int(math.floor(centre - half / sensor.increment))
    high = int(math.ceil(centre + half / sensor.increment))
    nearest = (distance - radius) / CODE_STEP_M - 2.0
    farthest = (distance + radius) / CODE_STEP_M + 2.0
    for k in range(low, high + 1):
        n = k % beams if sensor.wraps else k
        if 0 <= n < beams and nearest <= codes[n] <= farthest and codes[n] <= FARTHEST:
            codes[n] = UNKNOWN


class Drawing(NamedTuple):
    """How a scan is drawn: beam n looks at ``angle_min + n increment`` [rad, body frame]."""

    angle_min: float
    increment: float
    target: float
    """Direction of the picture's x axis [rad, body frame]."""
    radius_m: float
    """What the picture shows."""
    seen_m: float
    """How far the sensor sees."""


@jit
def draw_map(
    codes: np.ndarray, drawing: Drawing, cell_angle: np.ndarray, cell_distance: np.ndarray, out: np.ndarray
) -> None:
    """Draw the scan ``codes (M,)`` uint8 into ``out (CHANNELS, CELLS, CELLS)``.

    ``cell_angle``, ``cell_distance`` are those of ``polar_cells``. Cells that no beam comes near (a scan of less than a
    full circle) stay unknown, and those farther than the sensor sees.
    """
    beams = codes.shape[0]
    cell_m = 2.0 * drawing.radius_m / (CELLS - 1)
    per_circle = 2.0 * math.pi / drawing.increment
    shift = (drawing.target - drawing.angle_min) / drawing.increment
    per_code = CODE_STEP_M / cell_m
    rim = min(0.5 * (CELLS - 1), drawing.seen_m / cell_m)
    for row in range(CELLS):
        for column in range(CELLS):
            out[HIT, row, column] = 0
            out[FREE, row, column] = 0
            away = cell_distance[row, column]
            if away > rim:
                continue
            beam = shift + cell_angle[row, column] / drawing.increment + 0.5
            n = int(math.floor(beam - per_circle * math.floor(beam / per_circle)))
            if n >= beams:
                continue
            code = codes[n]
            if code == UNKNOWN:
                continue
            reach = code * per_code
            if code == NOTHING or away < reach - HALF_CELL:
                out[FREE, row, column] = 1
            elif away <= reach + HALF_CELL:
                out[HIT, row, column] = 1
