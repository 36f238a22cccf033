"""Training: cross-entropy on the expert's sides, with checkpoints after every epoch and the best one kept.

Everything random follows from the seed and the number of the epoch, so that a stopped training goes on as if nothing
had happened.
"""

from __future__ import annotations

import ctypes
import json
import math
import os
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from swarmscope.errors import ConfigError, InputFileError, SwarmscopeError
from swarmscope.judging.provenance import own_revision, versions
from swarmscope.learning import checkpoints
from swarmscope.learning.batches import Batch, View, batches
from swarmscope.learning.config import TrainingConfig
from swarmscope.learning.models import Architecture, Chooser
from swarmscope.learning.records import (
    SPLITS,
    Shard,
    concatenate,
    content_key,
    load,
    read_manifest,
    select,
    some,
    split_of,
    write_atomically,
)

LAST, BEST, HISTORY = "last.safetensors", "best.safetensors", "history.json"
WEIGHTS = (0.1, 10.0)
LARGEST_GRADIENT = 5.0
Report = Callable[[int, int, int, str], None]
"""Called with epoch, batches done, batches in all, and what there is to say."""


class Scores(NamedTuple):
    """A model on some samples."""

    loss: float
    accuracy: float
    regret_m: float
    """Mean detour taken because of wrong sides [m]."""


def architecture_of(config: TrainingConfig) -> Architecture:
    """Return the architecture that a configuration asks for."""
    giwt = config.network == "giwt"
    return Architecture(
        config.network, tuple(config.channels), config.stem_stride,
        config.use_gain if giwt else False, config.use_position if giwt else False,
        config.as_printed if giwt else False, config.dropout,
    )  # fmt: skip


def view_of(config: TrainingConfig) -> View:
    """Return what a configuration's network gets to see."""
    return View(config.view_m, config.view_m, config.network == "cnn", config.shorter)


def train(
    config: TrainingConfig,
    data: Path,
    out: Path,
    init: Path | None = None,
    report: Report | None = None,
) -> list[dict[str, float]]:
    """Train, or go on training, in folder ``out``; return the history, a row for each epoch.

    ``init`` is a checkpoint to begin from: all of it if it is of the same architecture, else its encoder. Raises
    ConfigError when ``out`` holds another training, SwarmscopeError when the loss is not finite; the last checkpoint
    stays.
    """
    set_up(config.threads, config.seed)
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    model = place(Chooser(architecture_of(config)), device)
    if init is not None:
        _begin_from(init, model)
    optimizer = torch.optim.AdamW(model.parameters(), lr=config.learning_rate, weight_decay=config.weight_decay)
    training, validation = read_splits(config, data)
    about: dict[str, Any] = {
        "config": config.model_dump(mode="json"), "versions": all_versions(), "git": own_revision(),
        "init": None if init is None else checkpoints.sha256_of(init),
        "data": content_key(read_manifest(data), config.sets),
    }  # fmt: skip
    history = _resume(about, out, model, optimizer)
    write_atomically(out / "config.json", (config.model_dump_json(indent=1) + "\n").encode())
    board = _Board(out / "tensorboard")
    steps = math.ceil(min(config.samples_per_epoch, training.samples) / config.batch)
    for epoch in range(len(history), config.epochs):
        if _without_progress(history) >= config.patience:
            break
        begun = time.perf_counter()
        row = _epoch(model, optimizer, config, training, epoch, steps, device, report)
        if report is not None:
            report(epoch, steps, steps, "validates")
        scores = evaluate(model, validation, config, device)
        if not math.isfinite(scores.loss):
            raise not_finite(scores.loss, f"the validation after epoch {epoch + 1}")
        row |= {"validation_loss": scores.loss, "validation_accuracy": scores.accuracy}
        row |= {"validation_regret_m": scores.regret_m, "wall_s": time.perf_counter() - begun}
        history.append(row)
        about["history"] = history
        if scores.loss <= min(r["validation_loss"] for r in history):
            checkpoints.write(out / BEST, model, about)
        checkpoints.write(out / LAST, model, about, optimizer)
        write_atomically(out / HISTORY, (json.dumps(history, indent=1) + "\n").encode())
        board.add(epoch, row)
        if report is not None:
            report(epoch, steps, steps, f"validation {scores.loss:.4f}, {100 * scores.accuracy:.2f} %")
    board.close()
    return history


def _without_progress(history: list[dict[str, float]]) -> int:
    """Return how many epochs have passed since the one with the least validation loss."""
    return len(history) - 1 - int(np.argmin([row["validation_loss"] for row in history])) if history else 0


def _begin_from(init: Path, model: Chooser) -> None:
    found = checkpoints.read(init)
    if found.architecture == model.architecture:
        checkpoints.fill(model, "model.", found, init)
    else:
        checkpoints.fill(model.encoder, "model.encoder.", found, init)


def not_finite(loss: float, where: str) -> SwarmscopeError:
    """Return the error of a training that has run away."""
    return SwarmscopeError(
        f"the loss is {loss} in {where}: lower learning_rate; the checkpoint of the epoch before is kept"
    )


def set_up(threads: int, seed: int) -> None:
    """Set number of threads and seed; results depend on both."""
    torch.set_num_threads(threads or len(os.sched_getaffinity(0)))
    torch.manual_seed(seed)
    _keep_freed_memory()


def _keep_freed_memory() -> None:
    """Let glibc use freed memory again, in all of this process; else a third of an epoch goes into fresh pages."""
    mmap_max, trim_threshold = -4, -1  # malloc.h
    with suppress(AttributeError, OSError, TypeError):
        libc = ctypes.CDLL(None)
        libc.mallopt(mmap_max, 0)
        libc.mallopt(trim_threshold, 2**31 - 1)


def place(model: Chooser, device: torch.device) -> Chooser:
    """Return the model on ``device``, its tensors in the order in which convolutions are fastest."""
    return cast("Chooser", cast("Any", model).to(device, memory_format=torch.channels_last))


def all_versions() -> dict[str, str]:
    """Return the versions that a trained model depends on."""
    return versions() | {"torch": torch.__version__, "torch_geometric": version("torch_geometric")}


def read_splits(config: TrainingConfig, data: Path) -> tuple[Shard, Shard]:
    """Return training and validation data."""
    whole = concatenate(list(load(data, list(config.sets)).values()))
    splits = split_of(whole.map)
    training, validation = (select(whole, splits == SPLITS.index(s)) for s in ("train", "validation"))
    if training.samples < 2 or not validation.samples:
        raise ConfigError(str(data), "has no samples for training or for validation; generate more")
    return training, some(validation, config.validation_samples, config.seed)


def _resume(
    about: dict[str, Any], out: Path, model: Chooser, optimizer: torch.optim.Optimizer
) -> list[dict[str, float]]:
    """Load the last checkpoint in ``out`` if there is one, of the training ``about``; return the history so far."""
    path = out / LAST
    if not path.exists():
        return []
    found = checkpoints.read(path)
    checkpoints.expect(found, model.architecture, path)
    longer = {"epochs", "patience", "threads"}
    before, now = found.about["config"], about["config"]
    for key in now:
        if key not in longer and before.get(key) != now[key]:
            raise ConfigError(str(out), f"holds a training with {key}: {before.get(key)}, not {now[key]}")
    for key, what in (("data", "on other data"), ("init", "that began with another --init, or with none")):
        if found.about.get(key) != about[key]:
            raise ConfigError(str(out), f"holds a training {what}; name another --out")
    checkpoints.fill(model, "model.", found, path)
    checkpoints.restore_optimizer(optimizer, found, path)
    return list(found.about["history"])


def _epoch(
    model: Chooser,
    optimizer: torch.optim.Optimizer,
    config: TrainingConfig,
    training: Shard,
    epoch: int,
    steps: int,
    device: torch.device,
    report: Report | None,
) -> dict[str, float]:
    """Train on one epoch's samples; return loss and accuracy met on the way."""
    rng = np.random.default_rng([config.seed, 2, epoch])
    torch.manual_seed(config.seed * 10_007 + epoch)
    if training.samples > config.samples_per_epoch:
        chosen = np.zeros(training.samples, np.bool_)
        chosen[rng.permutation(training.samples)[: config.samples_per_epoch]] = True
        training = select(training, chosen)
    model.train()
    loss_sum, right, seen = 0.0, 0, 0
    for step, batch in enumerate(batches(training, config.batch, view_of(config), rng)):
        if len(batch.right) < 2:
            continue  # batch normalisation needs two
        for group in optimizer.param_groups:
            group["lr"] = config.learning_rate * schedule(epoch + step / steps, config)
        with autocast(config, device):
            logits = forward(model, batch, device).float()
        classes = torch.from_numpy(batch.right).to(device)
        weights = torch.from_numpy(np.clip(batch.detour_m, *WEIGHTS) ** config.detour_power).to(device)
        loss = (functional.cross_entropy(logits, classes, reduction="none") * weights).sum() / weights.sum()
        if not bool(torch.isfinite(loss)):
            raise not_finite(loss.item(), f"epoch {epoch + 1}, batch {step + 1}")
        optimizer.zero_grad(set_to_none=True)
        loss.backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(model.parameters(), LARGEST_GRADIENT)
        optimizer.step()
        loss_sum += loss.item() * len(classes)
        right += int((logits.argmax(1) == classes).sum())
        seen += len(classes)
        if report is not None:
            report(epoch, step + 1, steps, f"loss {loss_sum / seen:.4f}")
    return {"epoch": epoch + 1, "samples": seen, "loss": loss_sum / seen, "accuracy": right / seen}


def schedule(progress: float, config: TrainingConfig) -> float:
    """Return the share of the full learning rate after ``progress`` epochs."""
    if progress < config.warm_up:
        return max(1e-3, progress / config.warm_up)
    left = min(1.0, (progress - config.warm_up) / max(1e-9, config.epochs - config.warm_up))
    return 0.5 * (1.0 + math.cos(math.pi * left))


def forward(model: Chooser, batch: Batch, device: torch.device) -> Tensor:
    """Return the logits (B, 2) of a batch."""
    return decide(model, encode(model, batch, device), batch, device)


def encode(model: Chooser, batch: Batch, device: torch.device) -> Tensor:
    """Return the features (E, F) of a batch's pictures."""
    maps = torch.from_numpy(batch.maps).to(device, torch.float32).contiguous(memory_format=torch.channels_last)
    out: Tensor = model.encoder(maps).float()
    return out


def decide(model: Chooser, features: Tensor, batch: Batch, device: torch.device) -> Tensor:
    """Return the logits (B, 2) of a batch whose pictures have these features (E, F)."""
    arrays = (batch.slots, batch.cells, batch.gains, batch.present)
    slots, cells, gains, present = (torch.from_numpy(a).to(device) for a in arrays)
    return model.decide(features[slots] * present.unsqueeze(-1), cells, gains, present)


def autocast(config: TrainingConfig, device: torch.device) -> Any:
    """Return the context in which the network is computed."""
    half = config.precision == "bfloat16" or (config.precision == "auto" and _computes_bfloat16(device))
    return torch.autocast(device.type, torch.bfloat16, enabled=half)


def _computes_bfloat16(device: torch.device) -> bool:
    if device.type == "cuda":
        return bool(torch.cuda.is_bf16_supported())
    tells = getattr(torch.cpu, "_is_avx512_bf16_supported", None)  # no part of PyTorch's promises
    return bool(tells is not None and tells())


@torch.no_grad()
def evaluate(model: Chooser, data: Shard, config: TrainingConfig, device: torch.device) -> Scores:
    """Return the model's scores on ``data``, in the precision of the training."""
    model.eval()
    loss, right, regret = 0.0, 0, 0.0
    for batch in batches(data, 2 * config.batch, view_of(config)):
        with autocast(config, device):
            logits = forward(model, batch, device).float()
        classes = torch.from_numpy(batch.right).to(device)
        loss += float(functional.cross_entropy(logits, classes, reduction="sum"))
        hit = (logits.argmax(1) == classes).cpu().numpy()
        right += int(hit.sum())
        regret += float(batch.detour_m[~hit].sum())
    n = data.samples
    return Scores(loss / n, right / n, regret / n)


class _Board:
    """Writes what TensorBoard reads; a disk that is full ends the training, but not without its checkpoints."""

    def __init__(self, folder: Path) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self._folder = folder
        with self._named():
            self._writer = SummaryWriter(str(folder))

    def add(self, epoch: int, row: dict[str, float]) -> None:
        """Add the figures of an epoch."""
        with self._named():
            for name, value in row.items():
                if name != "epoch":
                    self._writer.add_scalar(name, value, epoch + 1)
            self._writer.flush()

    def close(self) -> None:
        """Close the file."""
        with self._named():
            self._writer.close()

    @contextmanager
    def _named(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            raise InputFileError(self._folder, f"cannot be written ({error.strerror})") from None
