"""Checkpoints: tensors as safetensors, everything else as JSON in their header; nothing is ever unpickled."""

from __future__ import annotations

import hashlib
import json
from dataclasses import asdict
from pathlib import Path
from typing import Any, NamedTuple

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save
from torch import Tensor, nn

from swarmscope.errors import ConfigError, InputFileError
from swarmscope.learning.models import NETWORKS, Architecture, Chooser
from swarmscope.learning.records import write_atomically
from swarmscope.texts import check_regular

FORMAT = "swarmscope-giwt-checkpoint"
VERSION = 1


class Checkpoint(NamedTuple):
    """What a file holds."""

    architecture: Architecture
    about: dict[str, Any]
    """Configuration, history, versions."""
    tensors: dict[str, Tensor]
    """``model.*``, and in a resumable checkpoint ``optimizer.*``."""


def write(path: Path, model: Chooser, about: dict[str, Any], optimizer: torch.optim.Optimizer | None = None) -> None:
    """Write a checkpoint, whole or not at all; with ``optimizer`` training can go on from it."""
    tensors = {f"model.{name}": value.detach().cpu().contiguous() for name, value in model.state_dict().items()}
    if optimizer is not None:
        for index, state in optimizer.state_dict()["state"].items():
            tensors |= {f"optimizer.{index}.{k}": torch.as_tensor(v).cpu().contiguous() for k, v in state.items()}
    header = {"format": FORMAT, "version": VERSION, "architecture": asdict(model.architecture), "about": about}
    write_atomically(path, save(tensors, {"swarmscope": json.dumps(header)}))


def read(path: Path) -> Checkpoint:
    """Return a checkpoint; raises InputFileError for what is missing, torn or of another format."""
    if not path.exists():
        raise InputFileError(path, "is not there")
    check_regular(path, None)
    try:
        with safe_open(path, "pt") as file:
            header = json.loads((file.metadata() or {}).get("swarmscope", "{}"))
            tensors = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118 - not a mapping
    except (SafetensorError, OSError, ValueError, RecursionError) as error:
        raise InputFileError(path, f"is no whole safetensors file ({error})") from None
    if not isinstance(header, dict) or header.get("format") != FORMAT or header.get("version") != VERSION:
        raise InputFileError(path, f"is no '{FORMAT}' of version {VERSION}")
    about = header.get("about")
    if not isinstance(about, dict) or not isinstance(about.get("config"), dict):
        raise InputFileError(path, "does not say what configuration it was trained with")
    return Checkpoint(_architecture(header.get("architecture"), path), about, tensors)


def _architecture(values: Any, path: Path) -> Architecture:
    """Return the architecture that a header describes."""
    try:
        found = Architecture(**(values | {"channels": tuple(values["channels"])}))
    except (TypeError, KeyError) as error:
        raise InputFileError(path, f"its architecture is of another version ({error})") from None
    if found.network not in NETWORKS:
        raise InputFileError(path, f"unknown network {found.network!r} (valid: {', '.join(NETWORKS)})")
    return found


def sha256_of(path: Path) -> str:
    """Return the SHA-256 of a checkpoint; raises InputFileError when it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputFileError(path, f"cannot be read ({error.strerror})") from None


def restore_model(found: Checkpoint, path: Path) -> Chooser:
    """Return the model of a checkpoint."""
    model = Chooser(found.architecture)
    fill(model, "model.", found, path)
    return model


def fill(module: nn.Module, prefix: str, found: Checkpoint, path: Path) -> None:
    """Load the tensors whose names begin with ``prefix``; raises ConfigError when they do not fit."""
    state = {name.removeprefix(prefix): value for name, value in found.tensors.items() if name.startswith(prefix)}
    try:
        module.load_state_dict(state)
    except RuntimeError as error:
        first = str(error).splitlines()[1:2] or [str(error)]
        raise ConfigError(str(path), f"is of another architecture: {first[0].strip()}") from None


def expect(found: Checkpoint, wanted: Architecture, path: Path) -> None:
    """Raise ConfigError that names the difference unless the checkpoint has the architecture ``wanted``."""
    for key, value in asdict(wanted).items():
        other = asdict(found.architecture)[key]
        if other != value:
            raise ConfigError(str(path), f"is of another architecture: {key} is {other}, not {value}")


def restore_optimizer(optimizer: torch.optim.Optimizer, found: Checkpoint, path: Path) -> None:
    """Load the state of an optimizer of the same parameters; raises ConfigError when it is not there."""
    state: dict[int, dict[str, Tensor]] = {}
    for name, value in found.tensors.items():
        if name.startswith("optimizer."):
            _, index, key = name.split(".", 2)
            state.setdefault(int(index), {})[key] = value
    if not state:
        raise ConfigError(str(path), "holds a network without its optimizer: training cannot go on from it")
    optimizer.load_state_dict({"state": state, "param_groups": optimizer.state_dict()["param_groups"]})
