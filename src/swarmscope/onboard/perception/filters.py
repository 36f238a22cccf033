"""The two scan filters of Nav-SCOPE (4) and (6), as direct circular convolutions.

The papers run them by FFT. For 360 beams and 61 taps the direct form is faster and exact; the tests prove
both equal to the FFT form. Group delay: the taps are symmetric about the beam, so that it is zero.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit

KAISER_BETA = 2.5
"""Kaiser parameter of (6), printed nowhere. See docs/theory.md: with one main lobe (T_c + 1 taps) the taps stay
positive, so that no beta overshoots; 2.5 brings the response to about half at f_c. A convention, not an optimum."""


def window_half(alpha: float, increment: float) -> int:
    """Return how many beams of ``increment`` [rad] lie within alpha/2 on either side (T_c = 2 half + 1 samples)."""
    return int(math.floor(0.5 * alpha / increment + 1e-9))


def scope_filter(half: int) -> np.ndarray:
    """Return h_1 (4): the rectangular window of ``2 half + 1`` taps with sum 1, float32."""
    return np.full(2 * half + 1, 1.0 / (2 * half + 1), np.float32)


def feature_filter(half: int, beta: float = KAISER_BETA) -> np.ndarray:
    """Return h_2 (6): sinc at f_c = 1/T_c under a Kaiser window, ``2 half + 1`` taps, sum 1, float32."""
    n = np.arange(-half, half + 1)
    f_c = 1.0 / max(1, 2 * half)
    taps = 2.0 * f_c * np.sinc(2.0 * f_c * n) * np.kaiser(2 * half + 1, beta)
    normalised: np.ndarray = (taps / taps.sum()).astype(np.float32)
    return normalised


def printed_filter(half: int, beams: int, beta: float = KAISER_BETA) -> np.ndarray:
    """Return h_2 (6) with as many taps as a scan has ``beams``, M as printed, one less where M is even: sum 1, float32.

    The window is as long as the scan, so that side lobes of the sinc stay, and filtered values below 0 occur.
    """
    n = np.arange(-((beams - 1) // 2), (beams - 1) // 2 + 1)
    f_c = 1.0 / max(1, 2 * half)
    taps = 2.0 * f_c * np.sinc(2.0 * f_c * n) * np.kaiser(n.size, beta)
    normalised: np.ndarray = (taps / taps.sum()).astype(np.float32)
    return normalised


@jit
def prepare_scan(
    ranges: np.ndarray, range_min: float, range_max: float, wraps: bool, half: int, padded: np.ndarray
) -> None:
    """Write ``range_max - range`` of each beam into ``padded (M + 2 half,)``, wrapped or mirrored at the ends.

    No return (+inf) and anything beyond ``range_max`` counts as ``range_max``; NaN and readings below
    ``range_min`` are invalid and count as range 0. Filtering the deviation keeps open space exactly flat.
    """
    beams = ranges.size
    least, most, nothing = np.float32(range_min), np.float32(range_max), np.float32(0.0)
    middle = padded[half : half + beams]
    for n in range(beams):
        s = ranges[n]
        s = most if s > most else s
        middle[n] = most - (s if s >= least else nothing)
    for k in range(half):
        if wraps:
            padded[k] = padded[beams + k]
            padded[half + beams + k] = padded[half + k]
        else:
            padded[half - 1 - k] = padded[half]
            padded[half + beams + k] = padded[half + beams - 1]


@jit
def filter_padded(padded: np.ndarray, taps: np.ndarray, range_max: float, out: np.ndarray) -> None:
    """Write y_2 (6) [m] into ``out (M,)``: ``range_max`` minus the filtered deviation. Symmetric ``taps``."""
    beams = out.size
    half = taps.size // 2
    limit = np.float32(range_max)
    centre = taps[half]
    middle = padded[half : half + beams]
    for n in range(beams):
        out[n] = limit - centre * middle[n]
    k = 1
    while k + 4 <= half:  # five taps a pass: the loop is bound by loads and stores
        t0, t1, t2 = taps[half + k], taps[half + k + 1], taps[half + k + 2]
        t3, t4 = taps[half + k + 3], taps[half + k + 4]
        low = padded[half - k - 4 : half - k + beams]
        high = padded[half + k : half + k + 4 + beams]
        for n in range(beams):
            out[n] -= (
                t0 * (low[n + 4] + high[n])
                + t1 * (low[n + 3] + high[n + 1])
                + t2 * (low[n + 2] + high[n + 2])
                + t3 * (low[n + 1] + high[n + 3])
                + t4 * (low[n] + high[n + 4])
            )
        k += 5
    while k <= half:
        tap = taps[half + k]
        low = padded[half - k : half - k + beams]
        high = padded[half + k : half + k + beams]
        for n in range(beams):
            out[n] -= tap * (low[n] + high[n])
        k += 1
