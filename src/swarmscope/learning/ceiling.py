"""Where the ceiling lies: how often the expert's sides contradict each other for what looks the same.

A decider's own view is its scan, turned to the target and cut at the radius of the pictures: a vector of M ranges. For
each test sample the most similar training sample is looked up, mirrored ones included. Where both are nearly the same
and the sides differ, no network that sees this alone can be right on both.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.learning.records import Shard
from swarmscope.onboard.network.local_map import CODE_STEP_M, NOTHING, UNKNOWN

SHARES = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)
MOST = 60_000
"""Training samples that are searched (twice as many with their mirror images)."""


class Twins(NamedTuple):
    """The most similar pairs."""

    share: float
    """Which share of the test samples, those with the most similar partner first."""
    difference_m: float
    """Largest mean difference of a range among them [m]."""
    contradict: float
    """Share of pairs with opposite sides."""
    pairs: int


def view_vectors(data: Shard, view_m: float) -> NDArray[np.float32]:
    """Return the ranges (n, M) [m] of the deciders' scans from the target direction on, cut at ``view_m``."""
    first = data.first[:-1]
    codes = data.codes[data.node_scan[first]]
    beams = codes.shape[1]
    ranges = codes.astype(np.float32) * CODE_STEP_M
    ranges[(codes == NOTHING) | (codes == UNKNOWN)] = np.inf
    shift = np.rint((data.node_target[first] + np.pi) * beams / (2.0 * np.pi)).astype(int)
    index = (np.arange(beams)[None, :] + shift[:, None]) % beams
    return np.asarray(np.minimum(np.take_along_axis(ranges, index, axis=1), view_m), dtype=np.float32)


def mirrored(vectors: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return the vectors of the mirrored world: beam k becomes beam -k."""
    return np.roll(vectors[:, ::-1], 1, axis=1)


def contradictions(train: Shard, test: Shard, view_m: float) -> list[Twins]:
    """Return how often the sides of near twins differ, for growing shares of the test samples."""
    from sklearn.neighbors import NearestNeighbors

    rng = np.random.default_rng(0)
    chosen = rng.permutation(train.samples)[:MOST]
    known = view_vectors(train, view_m)[chosen]
    sides = train.side[chosen]
    search = NearestNeighbors(n_neighbors=1, algorithm="brute").fit(np.concatenate([known, mirrored(known)]))
    asked = view_vectors(test, view_m)
    _, nearest = search.kneighbors(asked)
    twin = nearest[:, 0]
    expected = np.concatenate([sides, -sides])[twin]
    partner = np.where((twin < len(known))[:, None], known[twin % len(known)], mirrored(known[twin % len(known)]))
    difference = np.abs(asked - partner).mean(axis=1)
    differs = expected != test.side
    order = np.argsort(difference, kind="stable")
    found = []
    for share in SHARES:
        part = order[: max(1, round(share * len(order)))]
        found.append(Twins(share, float(difference[part].max()), float(differs[part].mean()), len(part)))
    return found
