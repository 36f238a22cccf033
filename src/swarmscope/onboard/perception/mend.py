"""Broken readings: a hole in the scan that nothing as large as the body fits into is bridged, a wider one blocks."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.rig import Rig

NEAR_BODIES = 4.0
"""Within so many times what touches the body centimetres count."""
BESIDE = 1e-6
"""A blocked beam ends this far outside of what the guard keeps free [m]."""

BRIDGED = 1.001
"""A hole that is filled farther away than so many times what touches the body is one that was bridged."""


@jit_inline
def least_range(rig: Rig) -> float:
    """Return the smallest range that can be a return of something else: others are broken, or inside the body."""
    return max(rig.sensor.range_min, 0.5 * rig.body.radius_m)


@jit_inline
def body_and_clearance(rig: Rig) -> float:
    """Return the range of what stands just outside of what the guard keeps free: the way towards it is blocked."""
    return rig.body.radius_m + rig.guarding.clearance_m + BESIDE


@jit_inline
def mend(ranges: np.ndarray, rig: Rig, broken: np.ndarray) -> int:
    """Replace broken readings (NaN, below ``least_range``) of ``ranges (M,)`` [m] in place; return how many there were.

    ``broken (M,)`` uint8 becomes 1 for each of them, 0 for the others.

    A run of them becomes as near as the nearer of the two readings beside it, near the body less what a corner may
    stand out there, and never farther than a body in the hole could be; with nothing sound beside it, it is what
    touches the body.
    """
    return _fill(ranges, rig, rig.sensor.wraps, broken)


@jit
def bridge(ranges: np.ndarray, closed: bool, rig: Rig, hides: np.ndarray) -> None:
    """Replace broken readings as ``mend`` does where no body fits into the hole; where it blocks they become NaN.

    ``ranges (B,)`` [m] go round a circle only if it is ``closed``. ``hides (B,)`` becomes NaN but for what was replaced
    by a range: there it is the range from which on the hole may hide something narrow [m].
    """
    if _fill(ranges, rig, closed, hides) == 0:
        hides[:] = np.nan
        return
    blocks = np.float32(BRIDGED * body_and_clearance(rig))
    for n in range(ranges.size):
        if hides[n] == 0.0:
            hides[n] = np.nan
        elif not ranges[n] > blocks:
            ranges[n] = hides[n] = np.nan
    for n in range(ranges.size):
        if hides[n] >= 0.0:
            hides[n] = shows_beside(_width(hides, n, closed), rig)


@jit_inner
def _width(hides: np.ndarray, n: int, closed: bool) -> int:
    """Return how many rays the hole has that ray n is in: those beside it that are not NaN."""
    width, total = 1, hides.size
    for step in (1, -1):
        k = n + step
        while width < total and (closed or 0 <= k < total) and hides[k % total] >= 0.0:
            width += 1
            k += step
    return width


@jit
def shows_beside(width: int, rig: Rig) -> float:
    """Return up to which range nothing stands that ``width`` broken beams hide: it would show beside them [m].

    The narrowest thing there is touches the beams on both sides of a hole and ends there. inf where nothing is narrow.
    """
    half = 0.5 * (width + 1) * rig.sensor.increment
    if not rig.guarding.thinnest_m > 0.0:
        return math.inf
    return 0.5 * rig.guarding.thinnest_m * (1.0 / math.sin(half) - 1.0) if half < 0.5 * math.pi else 0.0


@jit_inner
def _fill(ranges: np.ndarray, rig: Rig, wraps: bool, broken: np.ndarray) -> int:
    """Mark the broken readings, 1 in ``broken``, and bridge them; return how many there are."""
    least = least_range(rig)
    count = 0
    for n in range(ranges.size):
        broken[n] = not ranges[n] >= least
        count += broken[n]
    if count > 0:
        _bridge(ranges, rig, wraps, least)
    return count


@jit_inner
def _bridge(ranges: np.ndarray, rig: Rig, wraps: bool, least: float) -> None:
    """Bridge every run of broken readings."""
    total = ranges.size
    first = 0
    if wraps:
        while first < total and not ranges[first] >= least:
            first += 1
        if first == total:
            first = 0
    k = first
    while k < first + total:
        if ranges[k % total] >= least:
            k += 1
            continue
        stop = k
        while stop < first + total and not ranges[stop % total] >= least:
            stop += 1
        s = _behind(ranges, k, stop, rig, wraps)
        for n in range(k, stop):
            ranges[n % total] = s
        k = stop


@jit_inner
def _behind(ranges: np.ndarray, k: int, stop: int, rig: Rig, wraps: bool) -> float:
    """Return the range that stands for the broken run of beams k .. stop - 1."""
    total = ranges.size
    touching = body_and_clearance(rig)
    closed = wraps and stop - k < total
    if not closed and (k == 0 or stop == total):
        return touching
    width = (stop - k + 1) * rig.sensor.increment
    if width >= math.pi or (rig.sensor.range_min > touching and width * rig.sensor.range_min > rig.guarding.thinnest_m):
        return touching  # beyond the body something may stand too near to be measured
    fits = rig.guarding.others_smallest_m / math.sin(0.5 * width) - rig.guarding.others_smallest_m
    beside = min(float(ranges[(k - 1) % total]), float(ranges[stop % total]))
    if beside < NEAR_BODIES * touching:
        beside *= 1.0 - 0.5 * (stop - k) * rig.sensor.increment  # a corner of a right angle, in the hole
    return max(touching, min(fits, beside))
