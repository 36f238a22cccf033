"""How sure a figure is: intervals for means, shares and paired differences. Seeded, so the same data give
the same.

NaN is not data: values (or pairs) that are not finite are left out, and ``used`` says how many entered.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

RESAMPLES = 10_000
EXACT_PAIRS = 16  # up to here all 2^n sign flips are tried
BLOCK = 1_000_000  # random numbers drawn at once

Floats = NDArray[np.float64]


class Interval(NamedTuple):
    """An estimate with the bounds of its confidence interval."""

    estimate: float
    low: float
    high: float
    used: int


class PairedDifference(NamedTuple):
    """The mean of a - b over pairs, its interval, and how likely a mean so far from 0 is by chance."""

    estimate: float
    low: float
    high: float
    used: int
    p_value: float  # two-sided; sign-flip test


def bootstrap_mean(
    values: ArrayLike, confidence: float = 0.95, seed: int = 0, resamples: int = RESAMPLES
) -> Interval:
    """Return the mean with its percentile bootstrap interval (Efron 1979).

    With fewer than two values the bounds are NaN: one run says nothing about the spread.
    """
    _check_confidence(confidence)
    data = _finite(np.asarray(values, dtype=np.float64).ravel())
    if len(data) == 0:
        return Interval(math.nan, math.nan, math.nan, 0)
    if len(data) == 1:
        return Interval(float(data[0]), math.nan, math.nan, 1)
    means = _resampled_means(data, np.random.default_rng(seed), resamples)
    low, high = np.quantile(means, [0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence])
    return Interval(float(np.mean(data)), float(low), float(high), len(data))


def bootstrap_ratio(
    above: ArrayLike, below: ArrayLike, confidence: float = 0.95, seed: int = 0, resamples: int = RESAMPLES
) -> Interval:
    """Return sum(``above``) / sum(``below``) with its percentile bootstrap interval over the pairs of both.

    NaN where the sum below is 0; draws in which it is are left out of the interval.
    """
    _check_confidence(confidence)
    a, b = np.asarray(above, dtype=np.float64).ravel(), np.asarray(below, dtype=np.float64).ravel()
    if a.shape != b.shape:
        raise ValueError(f"a ratio needs as many values above as below, not {len(a)} and {len(b)}")
    known = np.isfinite(a) & np.isfinite(b)
    a, b = a[known], b[known]
    if len(a) == 0 or b.sum() == 0.0:
        return Interval(math.nan, math.nan, math.nan, len(a))
    estimate = float(a.sum() / b.sum())
    if len(a) == 1:
        return Interval(estimate, math.nan, math.nan, 1)
    rng, ratios = np.random.default_rng(seed), list[Floats]()
    for rows in _blocks(resamples, len(a)):
        drawn = rng.integers(0, len(a), size=(rows, len(a)))
        sums = b[drawn].sum(axis=1)
        ratios.append(a[drawn].sum(axis=1)[sums != 0.0] / sums[sums != 0.0])
    low, high = np.quantile(np.concatenate(ratios), [0.5 - 0.5 * confidence, 0.5 + 0.5 * confidence])
    return Interval(estimate, float(low), float(high), len(a))


def wilson(successes: int, trials: int, confidence: float = 0.95) -> Interval:
    """Return the share of successes with Wilson's score interval (Wilson 1927); it stays within [0, 1]."""
    _check_confidence(confidence)
    if not 0 <= successes <= trials:
        raise ValueError(f"need 0 <= successes <= trials, not {successes} of {trials}")
    if trials == 0:
        return Interval(math.nan, math.nan, math.nan, 0)
    z, share = normal_quantile(0.5 + 0.5 * confidence), successes / trials
    middle = (share + z * z / (2.0 * trials)) / (1.0 + z * z / trials)
    half = (
        math.sqrt(share * (1.0 - share) / trials + z * z / (4.0 * trials * trials))
        * z
        / (1.0 + z * z / trials)
    )
    low = 0.0 if successes == 0 else middle - half
    high = 1.0 if successes == trials else middle + half
    return Interval(share, low, high, trials)


def paired_difference(
    first: ArrayLike, second: ArrayLike, confidence: float = 0.95, seed: int = 0, resamples: int = RESAMPLES
) -> PairedDifference:
    """Return the mean of ``first`` - ``second`` over pairs (same seed, same map) with interval and p value.

    The interval is a bootstrap over pairs. The p value is that of the sign-flip test: how often a mean at
    least so far from 0 appears when each difference has a random sign; exact up to 16 pairs, else from
    ``resamples`` random draws with the observed one added, so it is never 0.
    """
    a, b = np.asarray(first, dtype=np.float64).ravel(), np.asarray(second, dtype=np.float64).ravel()
    if a.shape != b.shape:
        raise ValueError(f"pairs need as many first as second values, not {len(a)} and {len(b)}")
    differences = _finite(a - b)
    interval = bootstrap_mean(differences, confidence, seed, resamples)
    return PairedDifference(*interval, sign_flip_p(differences, seed, resamples))


def sign_flip_p(differences: ArrayLike, seed: int = 0, resamples: int = RESAMPLES) -> float:
    """Return the two-sided p value of the mean of paired differences being 0; NaN without any difference."""
    data = _finite(np.asarray(differences, dtype=np.float64).ravel())
    if len(data) == 0:
        return math.nan
    reached = abs(float(np.sum(data))) - 1e-12 * float(np.sum(np.abs(data)))  # equal sums differ by rounding
    if len(data) <= EXACT_PAIRS:
        flips = (np.arange(2 ** len(data))[:, None] >> np.arange(len(data))) & 1
        return float(np.mean(np.abs((1.0 - 2.0 * flips) @ data) >= reached))
    rng = np.random.default_rng([seed, 1])
    sums = [
        np.abs((1.0 - 2.0 * rng.integers(0, 2, size=(rows, len(data)))) @ data)
        for rows in _blocks(resamples, len(data))
    ]
    return (1.0 + float(np.sum(np.concatenate(sums) >= reached))) / (1.0 + resamples)


def poisson_upper(count: int, confidence: float = 0.95) -> float:
    """Return the mean of a Poisson variable below which it is at most ``count`` too often: the exact one-sided bound.

    It solves P(X <= count) = 1 - confidence (Garwood 1936; half the chi-square quantile with 2 count + 2 degrees of
    freedom), by bisection; for 0 it is -ln(1 - confidence), 3.0 at 95 %.
    """
    _check_confidence(confidence)
    if count < 0:
        raise ValueError(f"a count is at least 0, not {count}")
    low, high = 0.0, 2.0 * count + 50.0 - math.log(1.0 - confidence)
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return middle
        terms = [k * math.log(middle) - middle - math.lgamma(k + 1.0) for k in range(count + 1)]
        if sum(map(math.exp, terms)) > 1.0 - confidence:
            low = middle
        else:
            high = middle


def normal_quantile(probability: float) -> float:
    """Return the z below which a standard normal variable lies with ``probability``, by bisection of erf."""
    if not 0.0 < probability < 1.0:
        raise ValueError(f"a probability between 0 and 1, not {probability}")
    low, high = -40.0, 40.0
    while True:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            return middle
        if 0.5 * math.erfc(-middle / math.sqrt(2.0)) < probability:
            low = middle
        else:
            high = middle


def _finite(values: Floats) -> Floats:
    return values[np.isfinite(values)]


def _check_confidence(confidence: float) -> None:
    if not 0.0 < confidence < 1.0:
        raise ValueError(f"confidence must lie between 0 and 1, not {confidence}")


def _blocks(rows: int, columns: int) -> list[int]:
    """Cut ``rows`` into blocks of at most BLOCK numbers."""
    size = max(1, BLOCK // columns)
    return [min(size, rows - done) for done in range(0, rows, size)]


def _resampled_means(data: Floats, rng: np.random.Generator, resamples: int) -> Floats:
    means = [
        data[rng.integers(0, len(data), size=(rows, len(data)))].mean(axis=1)
        for rows in _blocks(resamples, len(data))
    ]
    return np.concatenate(means)
