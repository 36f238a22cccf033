"""What GIWT's network is told besides pictures: where neighbours are and what they add (GIWT 4.3.2); features as bytes.

*Target frame*: origin at the robot that decides, x along its target direction, y to the left [m].
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit

FEATURES = 128
"""F, the length of a robot's feature vector."""
GRID = 7
"""The position grid has GRID x GRID cells."""
GRID_M = 5.0
"""It covers neighbours up to this distance along x and y; those beyond are in its outermost cells [m]."""
OWN_CELL = 24
"""The middle cell, the robot itself."""
VIEW_M = 2.5
"""R_FOV as printed [m]: the radius of the pictures of a model whose card names no other."""
STEPS_PER_OCTAVE = 8.0
SCALE_ZERO = 160
"""Scale codes: a scale is 2 ** ((code - SCALE_ZERO) / STEPS_PER_OCTAVE)."""


@jit
def position_cell(x: float, y: float) -> int:
    """Return P(i) in (4), the cell 0 to 48 of the position grid that holds (x, y) [m, target frame].

    Rows count from the right (y = -GRID_M) to the left, columns from behind to ahead; the middle one is OWN_CELL.
    """
    side = 2.0 * GRID_M / GRID
    column = min(GRID - 1, max(0, int(math.floor((x + GRID_M) / side))))
    row = min(GRID - 1, max(0, int(math.floor((y + GRID_M) / side))))
    return row * GRID + column


@jit
def information_gain(distance: float, view: float) -> float:
    """Return beta of (7): the share of a neighbour's disc of radius ``view`` [m] outside one's own, (0..1).

    With q = distance / (2 view) instead of the printed distance / view: only so is it that area, and (8) its series.
    Farther than 2 view the discs are disjoint: 1.
    """
    q = min(1.0, 0.5 * distance / view)
    return 1.0 - 2.0 * math.acos(q) / math.pi + 2.0 * q * math.sqrt(1.0 - q * q) / math.pi


@jit
def information_gain_series(distance: float, view: float) -> float:
    """Return beta of (8), the Taylor series of (7) to third order: 4 q / pi - 2 q^3 / (3 pi)."""
    q = min(1.0, 0.5 * distance / view)
    return 4.0 * q / math.pi - 2.0 * q * q * q / (3.0 * math.pi)


@jit
def quantise(features: np.ndarray, out: np.ndarray) -> int:
    """Write ``features (F,)`` as signed bytes into ``out (F,)`` uint8; return the code of their scale (one byte).

    The scale is the smallest of a fixed ladder with which the largest magnitude fits. NaN and infinity become 0.
    """
    largest = 0.0
    for k in range(features.shape[0]):
        value = abs(features[k])
        if value > largest and value < math.inf:
            largest = value
    code = 0
    if largest > 0.0:
        code = int(math.ceil(SCALE_ZERO + STEPS_PER_OCTAVE * math.log2(largest / 127.0) - 1e-9))
        code = min(255, max(0, code))
    scale = scale_of(code)
    for k in range(features.shape[0]):
        value = features[k] / scale
        if not abs(value) < math.inf:
            value = 0.0
        step = int(math.floor(min(127.0, max(-127.0, value)) + 0.5))
        out[k] = step & 0xFF
    return code


@jit
def scale_of(code: int) -> float:
    """Return the value that one step of a quantised feature stands for."""
    return float(2.0 ** ((int(code) - SCALE_ZERO) / STEPS_PER_OCTAVE))  # a byte would wrap without the compiler


@jit
def restore(codes: np.ndarray, scale_code: int, out: np.ndarray) -> None:
    """Write the features that ``codes (F,)`` uint8 stand for into ``out (F,)`` float32."""
    scale = scale_of(scale_code)
    for k in range(codes.shape[0]):
        step = int(codes[k])
        out[k] = scale * (step - 256 if step > 127 else step)
