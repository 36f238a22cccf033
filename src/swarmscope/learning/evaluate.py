"""How good a trained network is: accuracy with intervals on every set, beside others on the same samples.

Intervals and comparisons go by map (samples of one map are not independent): the share of hits per map, weighted by its
samples, is bootstrapped over maps.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray

from swarmscope._jit import jit
from swarmscope.errors import ConfigError
from swarmscope.learning import checkpoints
from swarmscope.learning.batches import Batch, batches
from swarmscope.learning.config import TrainingConfig, parse_config
from swarmscope.learning.models import Chooser
from swarmscope.learning.records import SPLITS, Shard, content_key, load, read_manifest, select, split_of
from swarmscope.learning.train import BEST, decide, encode, place, set_up, view_of
from swarmscope.onboard.network.graph import quantise, restore

RESAMPLES = 2000


class Trained(NamedTuple):
    """A trained network."""

    label: str
    path: Path
    config: TrainingConfig
    model: Chooser
    sha256: str
    """Of the checkpoint."""


class Verdict(NamedTuple):
    """A network's answers on the samples of one set."""

    hit: NDArray[np.bool_]
    """(n,) whether the side is the expert's."""
    hit_as_sent: NDArray[np.bool_]
    """(n,) the same with neighbours' features as they come over the radio, in bytes."""
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
    return Trained(label, file, config, checkpoints.restore_model(found, file), checkpoints.sha256_of(file))


def read_test(data: Path, names: list[str], split: str = "test") -> dict[str, Shard]:
    """Return one split of each set; raises ConfigError when a set has nothing of it."""
    whole = load(data, names)
    found = {name: select(shard, split_of(shard.map) == SPLITS.index(split)) for name, shard in whole.items()}
    for name, shard in found.items():
        if not shard.samples:
            raise ConfigError(str(data), f"set '{name}' has no {split} samples; generate more")
    return found


def data_key(data: Path, names: list[str]) -> str:
    """Return what identifies the data that scores are of."""
    return content_key(read_manifest(data), names)


@torch.no_grad()
def judge(
    trained: Trained, data: Shard, report: Callable[[int], None] | None = None, seen_m: float = math.inf
) -> Verdict:
    """Return the network's answers on ``data``, of robots that see ``seen_m`` far, in float32 as on the robot."""
    config, model = trained.config, trained.model.eval()
    view = view_of(config)
    view = view._replace(seen_m=min(seen_m, view.seen_m))
    set_up(config.threads, config.seed)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    place(model, device)
    parts: list[tuple[NDArray[np.bool_], NDArray[np.bool_]]] = []
    for batch in batches(data, 2 * config.batch, view):
        features = encode(model, batch, device)
        logits = decide(model, features, batch, device)
        sent = decide(model, as_sent(features, batch), batch, device)
        parts.append((says_left(logits), says_left(sent)))
        if report is not None:
            report(len(batch.right))
    exact, received = (np.concatenate(part) for part in zip(*parts, strict=True))
    left = data.side > 0
    return Verdict(exact == left, received == left, data.map, data.detour_m)


def says_left(logits: torch.Tensor) -> NDArray[np.bool_]:
    """Return (B,) whether the network's side is left; equal logits are."""
    return np.asarray((logits[:, 0] >= logits[:, 1]).cpu().numpy())


def as_sent(features: torch.Tensor, batch: Batch) -> torch.Tensor:
    """Return features (E, F) as the decider has them: its own exactly, those of others in bytes."""
    values = features.cpu().numpy().copy()
    others = np.ones(len(values), np.bool_)
    others[batch.slots[:, 0]] = False
    through_bytes(values, others, np.zeros(values.shape[1], np.uint8))
    return torch.from_numpy(values).to(features.device)


@jit
def through_bytes(features: np.ndarray, chosen: np.ndarray, codes: np.ndarray) -> None:
    """Quantise and restore the ``chosen (E,)`` rows of ``features (E, F)`` in place; ``codes (F,)`` is scratch."""
    for e in range(features.shape[0]):
        if chosen[e]:
            scale = quantise(features[e], codes)
            restore(codes, scale, features[e])


def share(values: NDArray[np.float64] | NDArray[np.bool_], maps: NDArray[np.int64]) -> Score:
    """Return the mean of ``values (n,)`` with its interval over maps."""
    return mean_share([(values, maps)])


def mean_share(parts: Sequence[tuple[NDArray[np.float64] | NDArray[np.bool_], NDArray[np.int64]]]) -> Score:
    """Return the mean over sets, each counting alike, of the means of their values, with its interval over maps."""
    means = np.mean([_resampled(values, maps, k) for k, (values, maps) in enumerate(parts)], axis=0)
    low, high = np.quantile(means, [0.025, 0.975])
    value = float(np.mean([np.mean(values) for values, _ in parts]))
    maps_in_all = sum(len(np.unique(maps)) for _, maps in parts)
    return Score(value, float(low), float(high), sum(len(values) for values, _ in parts), maps_in_all)


def _resampled(
    values: NDArray[np.float64] | NDArray[np.bool_], maps: NDArray[np.int64], seed: int
) -> NDArray[np.float64]:
    """Return the means (RESAMPLES,) of values whose maps are drawn with replacement."""
    _, index = np.unique(maps, return_inverse=True)
    total, count = np.bincount(index, values.astype(np.float64)), np.bincount(index)
    rng = np.random.default_rng(seed)
    means = np.empty(RESAMPLES)
    for k in range(RESAMPLES):
        drawn = np.bincount(rng.integers(0, len(count), len(count)), minlength=len(count))
        means[k] = (drawn * total).sum() / (drawn * count).sum()
    return means


def scores_of(verdicts: Sequence[Verdict], first: Sequence[Verdict]) -> dict[str, Score]:
    """Return means over the sets that ``verdicts`` are of; ``first`` are another network's on the same samples.

    accuracy, how much more often ``first`` is right, how much less often sides are right with features in bytes, and
    the mean detour [m] that wrong sides cost.
    """
    values = {
        "accuracy": [v.hit for v in verdicts],
        "regret_m": [np.where(v.hit, 0.0, v.detour_m.astype(np.float64)) for v in verdicts],
        "first_ahead": [a.hit.astype(np.float64) - v.hit for a, v in zip(first, verdicts, strict=True)],
        "lost_on_the_radio": [v.hit.astype(np.float64) - v.hit_as_sent for v in verdicts],
    }
    maps = [v.map for v in verdicts]
    return {name: mean_share(list(zip(parts, maps, strict=True))) for name, parts in values.items()}


def coin_regret(data: Shard) -> float:
    """Return the mean detour [m] that tossing a coin costs."""
    return 0.5 * float(data.detour_m.mean())


def majority(data: Shard) -> float:
    """Return the accuracy of always naming the more frequent side."""
    left = float((data.side > 0).mean())
    return max(left, 1.0 - left)
