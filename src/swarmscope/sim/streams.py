"""Random numbers keyed by (seed, robot, tick, purpose): the same whatever the order or the number of threads."""

from __future__ import annotations

from statistics import NormalDist
from typing import Any, TypeAlias

import numpy as np

from swarmscope._jit import jit, jit_inline

SCAN_NOISE, SCAN_DROP, RANGE_NOISE, BEARING_NOISE, COMPASS_NOISE, RADIO_LOSS, BOOT = range(1, 8)
ODOMETRY_SCALE, ODOMETRY_X, ODOMETRY_Y, ODOMETRY_YAW, COMPASS_BIAS = range(8, 13)
NAN_READINGS, STUCK_BEAMS, BLIND_SECTOR, SCAN_AGE = range(13, 17)
RESTART, SILENCE, CLOCK_JUMP = range(17, 20)
"""Purposes."""

Bits: TypeAlias = Any
"""64 random bits, a numpy uint64."""
_LEVELS = 4096
_quantiles = np.array([NormalDist().inv_cdf((k + 0.5) / _LEVELS) for k in range(_LEVELS)])
NORMAL_TABLE = (_quantiles / _quantiles.std()).astype(np.float32)
"""Quantiles of the normal distribution, unit variance, cut at 3.7 sigma: 12 random bits pick one."""

_A = np.uint64(0x9E3779B97F4A7C15)
_B = np.uint64(0xBF58476D1CE4E5B9)
_C = np.uint64(0x94D049BB133111EB)
_S30, _S27, _S31, _S11 = np.uint64(30), np.uint64(27), np.uint64(31), np.uint64(11)
_MASK = np.uint64(_LEVELS - 1)
_S12 = np.uint64(12)
_S48 = np.uint64(48)


@jit_inline
def mix(z: Bits) -> Bits:
    """Return the splitmix64 finaliser of ``z`` (uint64): every input bit reaches every output bit."""
    z = (z ^ (z >> _S30)) * _B
    z = (z ^ (z >> _S27)) * _C
    return z ^ (z >> _S31)


@jit
def key(seed: int, robot: int, tick: int, purpose: int) -> Bits:
    """Return the start (uint64) of the stream for this seed, robot, tick and purpose."""
    k = mix(np.uint64(seed) + _A)
    k = mix(k + np.uint64(robot) * _A + np.uint64(1))
    k = mix(k + np.uint64(tick) * _A + np.uint64(2))
    return mix(k + np.uint64(purpose) * _A + np.uint64(3))


@jit
def boot_number(seed: int, robot: int, boots: int) -> int:
    """Return the number, 0 to 65535, of a robot's start after ``boots`` earlier ones."""
    return int(key(seed, robot, boots, BOOT) >> _S48)


@jit_inline
def uniform(k: Bits) -> float:
    """Return a number in [0, 1) from the random bits ``k``."""
    return float(k >> _S11) * 1.1102230246251565e-16


@jit_inline
def normal(k: Bits) -> float:
    """Return a standard normal number from the random bits ``k``."""
    return float(NORMAL_TABLE[int(k & _MASK)])


@jit
def add_scan_noise(ranges: np.ndarray, k: Bits, sigma: float, range_max: float) -> None:
    """Multiply every return by (1 + sigma * normal); what leaves ``range_max`` is no return (+inf)."""
    state = k
    bits = k
    for n in range(ranges.size):
        if n % 4 == 0:
            state = state + _A
            bits = mix(state)
        s = ranges[n] * (1.0 + sigma * NORMAL_TABLE[int(bits & _MASK)])
        bits = bits >> _S12
        ranges[n] = np.inf if s > range_max else s


@jit
def replace_readings(ranges: np.ndarray, k: Bits, share: float, value: float) -> None:
    """Put ``value`` in the place of each reading with the probability ``share``."""
    state = k
    for n in range(ranges.size):
        state = state + _A
        if uniform(mix(state)) < share:
            ranges[n] = value
