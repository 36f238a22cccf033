"""Safe directions: the sector test (3)-(5) of Nav-SCOPE, with the swept footprint."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.sensor import Sensor

BINS = 512
"""Entries of a reach table over [0, range_max): 1 cm each at 5 m."""
BORDER = BINS + 1
"""Entry of a reach table for the ends of a limited field of view."""
UNSEEN_HALF_ANGLE = math.pi / 6.0
"""What lies just outside a limited field of view counts as a return two footprints away: asin(1/2) to either side."""


class Rule(NamedTuple):
    """What makes a direction unsafe; lengths in m, angles in rad, 0 = does not."""

    l_th: float
    """Returns nearer than this keep the footprint, and ``half_alpha`` to either side, off."""
    half_alpha: float = 0.0
    look_ahead: float = 0.0
    """Returns nearer than this are passed at ``margin``."""
    margin: float = 0.0


def blocking_half_angle(s: np.ndarray, footprint: float, rule: Rule) -> np.ndarray:
    """Return how far [rad] to either side returns at ranges ``s`` [m] make directions unsafe (0 = not at all).

    The largest of three rules. Nav-SCOPE (3): alpha/2 when ``s < l_th``. Swept footprint (readings 3): a disc
    of radius ``footprint`` that leaves along a direction clips the return unless it is asin(footprint / s)
    away, the whole half-plane when the return is closer than the footprint. Look-ahead: a way that keeps
    ``margin`` from the return, asin(margin / s), when ``s < look_ahead``.
    """
    swept = np.where(s < rule.l_th, np.maximum(rule.half_alpha, _half_angle_of(footprint, s)), 0.0)
    ahead = np.where(s < rule.look_ahead, _half_angle_of(rule.margin, s), 0.0)
    return np.maximum(swept, ahead)


def _half_angle_of(radius: float, s: np.ndarray) -> np.ndarray:
    """Return the half angle [rad] of a disc of ``radius`` at distances ``s``, a right angle within it."""
    return np.asarray(np.arcsin(np.divide(radius, s, out=np.ones(np.shape(s)), where=s > radius)))


def reach_table(increment: float, range_max: float, footprint: float, rule: Rule) -> np.ndarray:
    """Return, for each range bin, how many beams to either side a return blocks; -1 = none. (BINS + 2,) int16.

    Rounded to the safe side: a bin blocks what the nearest range in it blocks. Entry ``BINS`` is the number of
    the first bin that blocks nothing any more, entry ``BORDER`` how many beams at either end of a limited field
    of view are not safe, because nobody has seen what is beside them.
    """
    table = np.empty(BINS + 2, np.int16)
    table[BINS] = 0
    table[BORDER] = math.ceil(max(rule.half_alpha, UNSEEN_HALF_ANGLE) / increment - 1e-6)
    table[:BINS] = -1
    half = blocking_half_angle(np.arange(BINS) * range_max / BINS, footprint, rule)
    blocks = np.flatnonzero(half > 0.0)
    table[blocks] = np.ceil(half[blocks] / increment - 1e-6)
    if blocks.size > 0:
        table[BINS] = blocks[-1] + 1
    return table


@jit
def safe_directions(
    ranges: np.ndarray, sensor: Sensor, reach: np.ndarray, edges: np.ndarray, safe: np.ndarray
) -> int:
    """Write 1 into ``safe (M,)`` for each beam direction that is safe, else 0; return how many are.

    ``reach (BINS + 2,)`` comes from ``reach_table``; ``edges (M + 1,)`` is scratch. With the sector rule alone this
    is (5), y_1 >= l_th on the scan truncated to l_th. Invalid beams count as range 0. With a limited
    field of view a direction whose window of ``reach[BORDER]`` beams leaves it is not safe.
    """
    beams = ranges.size
    for n in range(beams + 1):
        edges[n] = 0
    if not sensor.wraps:
        _block(edges, beams, sensor.wraps, -1, reach[BORDER] - 1)
        _block(edges, beams, sensor.wraps, beams - reach[BORDER], beams)
    scale = np.float32(BINS / sensor.range_max)
    far = np.float32(reach[BINS] * sensor.range_max / BINS)
    for n in range(beams):
        s = ranges[n]
        if s >= far:
            continue
        k = reach[min(BINS - 1, int(s * scale))] if s >= sensor.range_min else reach[0]
        if k >= 0:
            _block(edges, beams, sensor.wraps, n - k, n + k)
    depth = 0
    count = 0
    for n in range(beams):
        depth += edges[n]
        safe[n] = depth == 0
        count += depth == 0
    return count


@jit_inner
def _block(edges: np.ndarray, beams: int, wraps: bool, first: int, last: int) -> None:
    """Add the run of beams first..last to the difference array ``edges``."""
    if last - first + 1 >= beams:
        edges[0] += 1
        return
    if first < 0:
        if wraps:
            edges[first + beams] += 1
            edges[beams] -= 1
        first = 0
    if last >= beams:
        if wraps:
            edges[0] += 1
            edges[last - beams + 1] -= 1
        last = beams - 1
    edges[first] += 1
    edges[last + 1] -= 1


@jit
def beam_of(bearing: float, sensor: Sensor) -> int:
    """Return the beam nearest to ``bearing`` (body frame, rad), or -1 outside the field of view."""
    n = int(math.floor((bearing - sensor.angle_min) / sensor.increment + 0.5))
    if sensor.wraps:
        return n % sensor.beams
    return n if 0 <= n < sensor.beams else -1
