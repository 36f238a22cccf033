"""How good a trained network is: accuracy with intervals on every set, beside others on the same samples.

Intervals and comparisons go by map (samples of one map are not independent): the share of hits per map, weighted by its
samples, is bootstrapped over maps.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from swarmscope.learning import checkpoints
from swarmscope.learning.batches import batches
from swarmscope.learning.config import TrainingConfig, parse_config
from swarmscope.learning.models import Chooser
from swarmscope.learning.records import SPLITS, Shard, content_key, load, read_manifest, select, split_of
from swarmscope.learning.train import BEST, autocast, forward, place, set_up

RESAMPLES = 2000
Floats = NDArray[np.float64]
Report = Callable[[str, int, int], None]
"""Called with what is scored, samples done and samples in all."""


class Trained(NamedTuple):
    """A trained network."""

    label: str
    path: Path
    config: TrainingConfig
    model: Chooser


class Verdict(NamedTuple):
    """A network's answers on the samples of one set."""

    hit: NDArray[np.bool_]
    """(n,) whether the side is the expert's."""
    p_left: NDArray[np.float32]
    """(n,)."""
    map: NDArray[np.int64]
    """(n,) seed of the map."""
    detour_m: NDArray[np.float32]
    """(n,) what a wrong side costs."""


class Score(NamedTuple):
    """A share, or a difference of shares, with its 95 % interval over maps."""

    value: float
    low: float
    high: float
    samples: int
    maps: int


def open_trained(path: Path) -> Trained:
    """Return the network of a run folder (its best checkpoint) or of a checkpoint file."""
    file = path / BEST if path.is_dir() else path
    found = checkpoints.read(file)
    config = parse_config(found.about["config"], str(file))
    label: str = config.network
    if config.network == "giwt":
        without = [w for w, used in (("beta", config.use_gain), ("positions", config.use_position)) if not used]
        label += f" without {' and '.join(without)}" if without else ""
        label += " as printed" if config.as_printed else ""
    return Trained(label, file, config, checkpoints.restore_model(found, file))


def read_test(data: Path, names: list[str], split: str = "test") -> dict[str, Shard]:
    """Return one split of each set."""
    whole = load(data, names)
    return {name: select(shard, split_of(shard.map) == SPLITS.index(split)) for name, shard in whole.items()}


def data_key(data: Path, names: list[str]) -> str:
    """Return what identifies the data that scores are of."""
    return content_key(read_manifest(data), names)


@torch.no_grad()
def judge(trained: Trained, data: Shard, report: Callable[[int], None] | None = None) -> Verdict:
    """Return the network's answers on ``data``."""
    config, model = trained.config, trained.model.eval()
    set_up(config.threads, config.seed)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    place(model, device)
    parts = []
    for batch in batches(data, 2 * config.batch, config.view_m, config.network == "cnn"):
        with autocast(config, device):
            logits = forward(model, batch, device).float()
        parts.append(torch.softmax(logits, dim=1)[:, 0].cpu().numpy())
        if report is not None:
            report(len(batch.right))
    p_left = np.concatenate(parts) if parts else np.zeros(0, np.float32)
    return Verdict((p_left > 0.5) == (data.side > 0), p_left, data.map, data.detour_m)


def share(values: NDArray[np.float64] | NDArray[np.bool_], maps: NDArray[np.int64]) -> Score:
    """Return the mean of ``values (n,)`` with its interval over maps."""
    if not len(values):
        return Score(math.nan, math.nan, math.nan, 0, 0)
    _, index = np.unique(maps, return_inverse=True)
    total, count = np.bincount(index, values.astype(np.float64)), np.bincount(index)
    rng = np.random.default_rng(0)
    means = np.empty(RESAMPLES)
    for k in range(RESAMPLES):
        drawn = np.bincount(rng.integers(0, len(count), len(count)), minlength=len(count))
        means[k] = (drawn * total).sum() / (drawn * count).sum()
    low, high = np.quantile(means, [0.025, 0.975])
    return Score(float(np.mean(values)), float(low), float(high), len(values), len(count))


def ahead_of(one: Verdict, other: Verdict) -> Score:
    """Return by how much ``one`` is right more often than ``other`` on the same samples."""
    return share(one.hit.astype(np.float64) - other.hit, one.map)


def regret(verdict: Verdict) -> Score:
    """Return the mean detour [m] that wrong sides cost."""
    return share(np.where(verdict.hit, 0.0, verdict.detour_m.astype(np.float64)), verdict.map)


def majority(data: Shard) -> float:
    """Return the accuracy of always naming the more frequent side."""
    left = float((data.side > 0).mean())
    return max(left, 1.0 - left)
