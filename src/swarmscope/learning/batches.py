"""From shards to batches: scans are drawn into pictures when they are needed (26 us each).

Mirroring a sample about the target direction (rows of pictures, positions, side) gives another true sample. Training
does that with half of them at random, and lets robots see less far in some.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope._jit import jit
from swarmscope.learning.records import Shard
from swarmscope.onboard.network.graph import (
    OWN_CELL,
    information_gain_series,
    position_cell,
)
from swarmscope.onboard.network.local_map import CELL_ANGLE, CELL_DISTANCE, CELLS, CHANNELS, Drawing, draw_map

SHORTEST_M = 1.0
"""The least that a robot sees in training."""


class View(NamedTuple):
    """What networks get to see of a sample."""

    radius_m: float
    """Of the pictures."""
    seen_m: float
    """How far robots see, at most ``radius_m``."""
    alone: bool = False
    """Neighbours are left out."""
    shorter: float = 0.0
    """In training: share of the samples in which robots see less far, by chance."""


class Batch(NamedTuple):
    """Arrays of B decisions with at most K robots each, E robots in all."""

    maps: NDArray[np.uint8]
    """(E, CHANNELS, CELLS, CELLS)."""
    slots: NDArray[np.int64]
    """(B, K) which of the maps, 0 where there is none."""
    cells: NDArray[np.int64]
    """(B, K) position cells (4)."""
    gains: NDArray[np.float32]
    """(B, K) beta (8)."""
    present: NDArray[np.float32]
    """(B, K) 1 where there is a robot."""
    right: NDArray[np.int64]
    """(B,) the class: 0 left, 1 right."""
    detour_m: NDArray[np.float32]
    """(B,)."""


def batches(data: Shard, size: int, view: View, rng: np.random.Generator | None = None) -> Iterator[Batch]:
    """Yield the samples in batches, for training with ``rng``: shuffled, mirrored and short-sighted at random."""
    order = np.arange(data.samples) if rng is None else rng.permutation(data.samples)
    mirrored = np.zeros(data.samples, np.bool_) if rng is None else rng.random(data.samples) < 0.5
    seen = np.full(data.samples, view.seen_m)
    if rng is not None and view.shorter > 0.0:
        short = rng.random(data.samples) < view.shorter
        seen[short] = rng.uniform(min(SHORTEST_M, view.seen_m), view.seen_m, int(short.sum()))
    for k in range(0, data.samples, size):
        chosen = order[k : k + size]
        yield make_batch(data, chosen, mirrored[chosen], seen[chosen], view)


def make_batch(
    data: Shard,
    chosen: NDArray[np.int64],
    mirrored: NDArray[np.bool_],
    seen_m: NDArray[np.float64],
    view: View,
) -> Batch:
    """Return the samples ``chosen (B,)``, mirrored where told, all its robots seeing as far as ``seen_m (B,)``."""
    begin, end = data.first[chosen], data.first[chosen + 1]
    if view.alone:
        end = begin + 1
    count = end - begin
    width = int(count.max())
    ranks = np.arange(width)
    present = ranks[None, :] < count[:, None]
    nodes = (begin[:, None] + ranks[None, :])[present]
    slots = np.zeros(present.shape, np.int64)
    slots[present] = np.arange(len(nodes))
    sign = np.where(mirrored, -1.0, 1.0)
    x, y = data.node_x[nodes].astype(np.float64), data.node_y[nodes] * np.repeat(sign, count)
    cells, gains = np.full(present.shape, OWN_CELL), np.zeros(present.shape, np.float32)
    cells[present] = [position_cell(a, b) for a, b in zip(x, y, strict=True)]
    sees = np.repeat(seen_m, count)
    gains[present] = [information_gain_series(d, r) for d, r in zip(np.hypot(x, y), sees, strict=True)]
    maps = np.empty((len(nodes), CHANNELS, CELLS, CELLS), np.uint8)
    draw_all(
        data.codes, data.node_scan[nodes], data.node_target[nodes], np.repeat(mirrored, count), view.radius_m,
        sees, CELL_ANGLE, CELL_DISTANCE, maps,
    )  # fmt: skip
    right = np.where(data.side[chosen] * sign > 0.0, 0, 1)
    return Batch(maps, slots, cells, gains, present.astype(np.float32), right, data.detour_m[chosen])


@jit
def draw_all(
    codes: np.ndarray,
    scan: np.ndarray,
    target: np.ndarray,
    mirrored: np.ndarray,
    radius_m: float,
    seen_m: np.ndarray,
    cell_angle: np.ndarray,
    cell_distance: np.ndarray,
    out: np.ndarray,
) -> None:
    """Draw pictures of a full circle of beams, those ``mirrored`` with left and right exchanged."""
    increment = 2.0 * np.pi / codes.shape[1]
    for e in range(scan.shape[0]):
        drawing = Drawing(-np.pi, increment, target[e], radius_m, seen_m[e])
        draw_map(codes[scan[e]], drawing, cell_angle, cell_distance, out[e])
        if mirrored[e]:
            for channel in range(out.shape[1]):
                for row in range(out.shape[2] // 2):
                    for column in range(out.shape[3]):
                        other = out.shape[2] - 1 - row
                        kept = out[e, channel, row, column]
                        out[e, channel, row, column] = out[e, channel, other, column]
                        out[e, channel, other, column] = kept

