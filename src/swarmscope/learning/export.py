"""From a checkpoint to what a robot runs: two ONNX files and ``model.json`` (read by network/model.py).

The encoder runs on every robot for itself, the decider on the one that decides. The graph layers of PyTorch Geometric
are written out for a star of at most K robots, which ONNX Runtime can run; that this is the same is checked for every
export against the layers themselves.
"""

from __future__ import annotations

import hashlib
import io
import json
import warnings
from pathlib import Path
from typing import Any, cast

import numpy as np
import torch
from torch import Tensor, nn

from swarmscope.errors import InputFileError, MissingExtraError, SwarmscopeError
from swarmscope.learning.checkpoints import Checkpoint, read, restore_model, sha256_of
from swarmscope.learning.config import parse_config
from swarmscope.learning.models import FAR_BELOW, SLOPE, Chooser, Peer
from swarmscope.learning.records import write_atomically
from swarmscope.onboard.network.graph import FEATURES, GRID, OWN_CELL
from swarmscope.onboard.network.local_map import CELLS, CHANNELS
from swarmscope.onboard.network.model import CARD, DECIDER, ENCODER, FORMAT, VERSION
from swarmscope.texts import read_text

OPSET = 18
CLOSE = 1e-4
"""Largest difference between PyTorch and ONNX Runtime that is let pass."""
PROBES = 64


class _Decider(nn.Module):
    def __init__(self, model: Chooser) -> None:
        super().__init__()
        self.fusion = StarPeer(model.fusion) if isinstance(model.fusion, Peer) else model.fusion
        self.mapper = model.mapper

    def forward(self, features: Tensor, cells: Tensor, gains: Tensor, present: Tensor) -> Tensor:
        """Return logits (B, 2)."""
        out: Tensor = self.mapper(self.fusion(features * present.unsqueeze(-1), cells, gains, present))
        unused = cells.float().sum(dim=1, keepdim=True) + gains.sum(dim=1, keepdim=True)
        return out + 0.0 * unused  # so that the exporter keeps inputs that this network has no use for


class StarPeer(nn.Module):
    """What a ``Peer`` computes for robot 0 of a star, in plain tensor operations."""

    def __init__(self, peer: Peer) -> None:
        super().__init__()
        self.layer: Any = peer.layer
        self.attends = peer.attends

    def forward(self, features: Tensor, cells: Tensor, gains: Tensor, present: Tensor) -> Tensor:
        """Return h (B, F); ``cells`` and ``gains`` are not used."""
        layer = self.layer
        if self.attends:
            fused = layer.lin(features).unflatten(-1, (layer.heads, -1))
            source = (fused * layer.att_src[0]).sum(-1)
            target = (fused[:, :1] * layer.att_dst[0]).sum(-1)
            scores = nn.functional.leaky_relu(source + target, SLOPE)
            there = present.unsqueeze(-1)
            weights = torch.softmax(scores + FAR_BELOW * (1.0 - there), dim=1) * there
            summed = (weights.unsqueeze(-1) * fused).sum(dim=1).flatten(1)
            return torch.relu(summed + layer.res(features[:, 0]) + layer.bias)
        others = present[:, 1:].unsqueeze(-1)
        mean = (features[:, 1:] * others).sum(dim=1) / others.sum(dim=1).clamp(min=1.0)
        return torch.relu(layer.lin_l(mean) + layer.lin_r(features[:, 0]))


def export(checkpoint: Path, out: Path, card: dict[str, Any] | None = None) -> float:
    """Write the model of ``checkpoint`` to folder ``out``; return the largest difference to PyTorch on random inputs.

    ``card`` is added to ``model.json`` (scores of ``eval``). Raises SwarmscopeError when the difference is above CLOSE;
    then nothing is written.
    """
    try:
        import onnx  # noqa: F401
    except ImportError:
        raise MissingExtraError("giwt export", "learn") from None
    found = read(checkpoint)
    model = restore_model(found, checkpoint).eval()
    features = torch.zeros(2, 3, FEATURES)
    row = torch.zeros(2, 3, dtype=torch.int64)
    files = {
        ENCODER: _to_onnx(
            model.encoder, (torch.zeros(2, CHANNELS, CELLS, CELLS),), ["maps"], "features", {0: "batch"}
        ),
        DECIDER: _to_onnx(
            _Decider(model), (features, row, row.float(), torch.ones(2, 3)),
            ["features", "cells", "gains", "present"], "logits", {0: "batch", 1: "robots"},
        ),
    }  # fmt: skip
    about = _about(found, files, checkpoint, card or {})
    difference = compare(model, files)
    if not difference <= CLOSE:
        raise SwarmscopeError(f"{checkpoint}: ONNX Runtime and PyTorch differ by {difference:.2g}, not below {CLOSE:g}")
    for name, data in files.items():
        write_atomically(out / name, data)
    write_atomically(out / CARD, about)
    return difference


def read_scores(path: Path, checkpoint: Path) -> dict[str, Any]:
    """Return what ``eval`` wrote to ``path``; raises InputFileError unless it is complete and of ``checkpoint``."""
    try:
        scores = json.loads(read_text(path))
    except (ValueError, RecursionError) as error:
        raise InputFileError(path, f"cannot be read ({error})") from None
    if not isinstance(scores, dict) or not isinstance(scores.get("sets"), dict) or "mean" not in scores:
        raise InputFileError(path, "holds no complete scores of 'swarmscope giwt eval'")
    try:
        known = {row.get("sha256") for entry in scores["sets"].values() for row in entry["networks"]}
    except (TypeError, KeyError, AttributeError):
        raise InputFileError(path, "holds scores of another form") from None
    if None not in known and sha256_of(checkpoint) not in known:
        raise InputFileError(path, f"holds no scores of {checkpoint}: run 'swarmscope giwt eval' again")
    return scores


def _about(found: Checkpoint, files: dict[str, bytes], checkpoint: Path, card: dict[str, Any]) -> bytes:
    about = {
        "format": FORMAT,
        "version": VERSION,
        "network": found.architecture.network,
        "files": {name: hashlib.sha256(data).hexdigest() for name, data in files.items()},
        "view_m": parse_config(found.about["config"], str(checkpoint)).view_m,
        "parameters": int(sum(v.numel() for k, v in found.tensors.items() if k.startswith("model."))),
        "training": {k: found.about[k] for k in ("config", "versions", "git", "init", "data") if k in found.about},
        "history": found.about.get("history", []),
    }
    return (json.dumps(about | card, indent=1) + "\n").encode()


def _to_onnx(
    module: nn.Module, example: tuple[Tensor, ...], inputs: list[str], output: str, dynamic: dict[int, str]
) -> bytes:
    """Return a module as the bytes of an ONNX file."""
    axes = dict.fromkeys(inputs, dynamic) | {output: {0: "batch"}}
    out = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # the exporter talks about its own future
        torch.onnx.export(
            module.eval(), example, cast("Any", out), input_names=inputs, output_names=[output], dynamic_axes=axes,
            opset_version=OPSET, dynamo=False,
        )  # fmt: skip
    return out.getvalue()


def compare(model: Chooser, files: dict[str, bytes]) -> float:
    """Return the largest difference of features and logits between ``model`` and its two ONNX files."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    encoder, decider = (
        onnxruntime.InferenceSession(files[name], options, providers=["CPUExecutionProvider"])
        for name in (ENCODER, DECIDER)
    )
    rng = np.random.default_rng(0)
    worst = 0.0
    for robots in (1, 2, 6):
        maps = (rng.random((PROBES, CHANNELS, CELLS, CELLS)) < rng.random()).astype(np.float32)
        cells = rng.integers(0, GRID * GRID, (PROBES, robots))
        cells[:, 0] = OWN_CELL
        gains = rng.random((PROBES, robots), np.float32)
        gains[:, 0] = 0.0
        present = np.ones((PROBES, robots), np.float32)
        present[:, 1:] = rng.random((PROBES, robots - 1)) < 0.7
        with torch.no_grad():
            expected = model.encoder(torch.from_numpy(maps))
            picked = rng.integers(0, PROBES, (PROBES, robots))
            features = expected[torch.from_numpy(picked)] * torch.from_numpy(present).unsqueeze(-1)
            arrays = [torch.from_numpy(a) for a in (cells, gains, present)]
            logits = model.decide(features, *arrays)
        got = encoder.run(None, {"maps": maps})[0]
        inputs = {"features": features.numpy(), "cells": cells, "gains": gains, "present": present}
        answer = decider.run(None, inputs)[0]
        worst = max(worst, float(np.abs(got - expected.numpy()).max()), float(np.abs(answer - logits.numpy()).max()))
    return worst
