"""Safe directions: the sector test (3)-(5) of Nav-SCOPE, with the swept footprint."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline


@jit_inline
def blocking_half_angle(s: float, l_th: float, half_alpha: float, footprint: float) -> float:
    """Return how far [rad] to either side a return at range ``s`` [m] makes directions unsafe (0 = not at all).

    Nav-SCOPE (3): everything within alpha/2 when ``s < l_th``. Swept footprint: a disc of radius ``footprint``
    that leaves along a direction clips the return unless it is asin(footprint / s) away; the whole half-plane
    when the return is closer than the footprint.
    """
    if not s < l_th:
        return 0.0
    if s <= footprint:
        return 0.5 * math.pi
    return max(half_alpha, math.asin(footprint / s))


@jit
def safe_directions(
    ranges: np.ndarray,
    range_min: float,
    increment: float,
    wraps: bool,
    l_th: float,
    half: int,
    footprint: float,
    edges: np.ndarray,
    safe: np.ndarray,
) -> int:
    """Write 1 into ``safe (M,)`` for each beam direction that is safe, else 0; return how many are.

    ``half`` is alpha/2 in beams, ``edges (M + 1,)`` is scratch. Equivalent to (5), y_1 >= l_th on the scan
    truncated to l_th, wherever no return is so close that its footprint is wider than alpha/2. With a limited
    field of view a direction whose window leaves it is not safe.
    """
    beams = ranges.size
    for n in range(beams + 1):
        edges[n] = 0
    sine = math.sin(half * increment)
    wide = footprint / sine if sine > 0.0 else math.inf
    for n in range(beams):
        s = ranges[n]
        if s >= l_th:
            continue
        reach = half
        if not s >= range_min or s <= footprint:
            reach = int(math.ceil(0.5 * math.pi / increment))
        elif s < wide:
            reach = max(half, int(math.ceil(math.asin(footprint / s) / increment)))
        _block(edges, beams, wraps, n - reach, n + reach)
    depth = 0
    count = 0
    for n in range(beams):
        depth += edges[n]
        free = depth == 0
        if not wraps and (n < half or n >= beams - half):
            free = False
        safe[n] = free
        count += free
    return count


@jit_inline
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
def beam_of(bearing: float, angle_min: float, increment: float, beams: int, wraps: bool) -> int:
    """Return the beam nearest to ``bearing`` (body frame, rad), or -1 outside the field of view."""
    n = int(math.floor((bearing - angle_min) / increment + 0.5))
    if wraps:
        return n % beams
    return n if 0 <= n < beams else -1


@jit
def corridor_length(
    ranges: np.ndarray,
    range_min: float,
    angle_min: float,
    increment: float,
    bearing: float,
    half_width: float,
    limit: float,
) -> float:
    """Return how far [m] a disc of radius ``half_width`` gets along ``bearing`` before it touches a return.

    At most ``limit``; an invalid beam within 90 degrees of the bearing stops it at once.
    """
    free = limit
    reach = limit + half_width
    for n in range(ranges.size):
        s = ranges[n]
        if s > reach:
            continue
        turn = angle_min + n * increment - bearing
        along = math.cos(turn)
        if not s >= range_min:
            if along > 0.0:
                return 0.0
            continue
        across = s * math.sin(turn)
        if along <= 0.0 or abs(across) >= half_width:
            continue
        free = min(free, s * along - math.sqrt(half_width * half_width - across * across))
    return max(0.0, free)
