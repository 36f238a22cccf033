"""Beams that see nothing: one that says nothing wherever the beams beside it see a surface is taken as broken."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit_inline, jit_inner
from swarmscope.onboard.perception.lost import WITHIN
from swarmscope.onboard.rig import Rig

PATIENCE = 4
"""A beam that has missed a surface so often, and seen nothing since then, is broken."""
TOGETHER = 3
"""So many beams side by side may be broken and still be noticed."""
ALIKE = 0.25
"""Two returns that differ by less than this share are of one surface."""


@jit_inline
def leave_out_faulty(scan: np.ndarray, misses: np.ndarray, rig: Rig) -> None:
    """Write NaN over what faulty beams of ``scan (M,)`` [m] say; keep up how often each of them has missed something.

    ``misses (M,)`` uint8. A surface seen on both sides of up to `TOGETHER` silent beams, between which there is no room
    for the body, was missed by them.
    """
    sensor = rig.sensor
    first, last = (sensor.first, sensor.first + sensor.field - 1) if sensor.field > 0 else (0, sensor.beams - 1)
    before = _last_before_the_first(scan, rig)
    many = _keep_up(scan[first : last + 1], misses[first : last + 1], sensor.range_max)
    if not (many or before >= -scan.size or _begins_with_gap(scan[first : last + 1], sensor.range_max)):
        return
    for n in range(first, last + 1):
        if not scan[n] < sensor.range_max:
            continue
        if 1 < n - before <= TOGETHER + 1 and _one_surface(scan[before], scan[n], n - before, rig):
            for beside in range(before + 1, n):
                k = beside % scan.size
                misses[k] = min(255, misses[k] + 1)
                if misses[k] >= PATIENCE:
                    scan[k] = math.nan
        before = n


@jit_inner
def _keep_up(scan: np.ndarray, misses: np.ndarray, range_max: float) -> bool:
    """Forgive beams that see something, write NaN over those that have missed too much.

    Tell whether any of the others may have been missed between two that see, which seldom is so. Without branches.
    """
    far, patience, late = np.float32(range_max), np.uint8(PATIENCE), 0
    for n in range(scan.size):
        sees = scan[n] < far
        late += (not sees) & (misses[n] >= patience)
        misses[n] = np.uint8(0) if sees else misses[n]
    if late > 0:
        for n in range(scan.size):
            if misses[n] >= patience:
                scan[n] = math.nan
    missed, one, two, three, four = 0, scan[1:], scan[2:], scan[3:], scan[4:]
    for n in range(scan.size - TOGETHER - 1):
        before = (scan[n] < far) | (one[n] < far) | (two[n] < far)
        missed += (four[n] < far) & (not three[n] < far) & before
    return missed > 0


@jit_inner
def _begins_with_gap(scan: np.ndarray, range_max: float) -> bool:
    """Tell whether one of the first beams sees nothing though one before it does."""
    ends = 0
    for n in range(1, min(TOGETHER + 1, scan.size)):
        ends += scan[n - 1] < range_max and not scan[n] < range_max
    return ends > 0


@jit_inner
def _last_before_the_first(scan: np.ndarray, rig: Rig) -> int:
    """Return the number, below 0, of the last beam that has seen something, far below 0 where the circle is open."""
    if rig.sensor.field == 0 and rig.sensor.wraps:
        for k in range(1, min(TOGETHER + 1, scan.size) + 1):
            if scan[scan.size - k] < rig.sensor.range_max:
                return -k
    return -2 * scan.size


@jit_inner
def _one_surface(a: float, b: float, apart: int, rig: Rig) -> bool:
    """Tell whether returns of two beams ``apart`` may be of one surface, near enough to be seen in between."""
    near, far = min(a, b), max(a, b)
    if not (far < WITHIN * rig.sensor.range_max and far - near < ALIKE * near):
        return False
    return bool(apart * rig.sensor.increment * near < 2.0 * rig.guarding.others_smallest_m)
