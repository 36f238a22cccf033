"""GIWT's trained network: a folder with ``model.json`` and two ONNX files, run by ONNX Runtime (extra ``giwt``).

``encoder.onnx`` makes 128 features of a picture, ``decider.onnx`` two logits of the features, cells and gains of a
robot and its neighbours (4)-(9). ``model.json`` names the files with their SHA-256; what does not match it is not run.
One thread and one robot at a time: a result does not depend on who else is computed with it.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from swarmscope.errors import InputFileError, MissingExtraError
from swarmscope.onboard.network.graph import FEATURES, VIEW_M
from swarmscope.onboard.network.local_map import CELLS, CHANNELS

FORMAT = "swarmscope-giwt"
VERSION = 1
CARD = "model.json"
ENCODER, DECIDER = "encoder.onnx", "decider.onnx"
NETWORKS = ("giwt", "gat", "graphsage", "cnn")
ALONE = frozenset({"cnn"})
"""Networks that look at the robot's own features only: with them nobody is asked."""
SHIPPED = Path(__file__).resolve().parents[2] / "data" / "models"
VIEWS_M = (0.2, 20.0)
"""Smallest and largest radius of pictures."""
LARGEST_BYTES = 256 * 2**20
"""Larger files are not read."""

Shape = tuple[int | None, ...]
Port = tuple[str, Shape]
"""Type and shape; None is a size that is known when it runs."""
PORTS: dict[str, tuple[dict[str, Port], dict[str, Port]]] = {
    ENCODER: (
        {"maps": ("tensor(float)", (None, CHANNELS, CELLS, CELLS))},
        {"features": ("tensor(float)", (None, FEATURES))},
    ),
    DECIDER: (
        {
            "features": ("tensor(float)", (None, None, FEATURES)),
            "cells": ("tensor(int64)", (None, None)),
            "gains": ("tensor(float)", (None, None)),
            "present": ("tensor(float)", (None, None)),
        },
        {"logits": ("tensor(float)", (None, 2))},
    ),
}
"""Inputs and outputs of both files."""
NEEDED = frozenset({"maps", "features", "logits"})
"""Ports that must be there; a network that does not use another input may lack it."""


class Network:
    """A loaded model; ``encode`` and ``decide`` may be called from several threads."""

    def __init__(self, folder: Path, card: dict[str, Any]) -> None:
        self.folder = folder
        self.alone = card["network"] in ALONE
        self.view_m = float(card["view_m"])
        """Radius of the pictures that it was trained with."""
        self._encoder = _session(folder / ENCODER, _checked(folder / ENCODER, card["files"][ENCODER]))
        self._decider = _session(folder / DECIDER, _checked(folder / DECIDER, card["files"][DECIDER]))
        self._inputs = [port.name for port in self._decider.get_inputs()]

    def encode(self, maps: np.ndarray) -> np.ndarray:
        """Return the features (B, 128) of pictures ``maps (B, 2, 101, 101)`` float32 (3)."""
        found: np.ndarray = self._encoder.run(["features"], {"maps": maps})[0]
        return found

    def p_left(self, features: np.ndarray, cells: np.ndarray, gains: np.ndarray) -> np.ndarray:
        """Return the probability (B,) of left for ``features (B, K, 128)``, ``cells (B, K)``, ``gains (B, K)``.

        Every robot named is there; the first one decides.
        """
        ports = {"features": features, "cells": cells, "gains": gains, "present": np.ones_like(gains)}
        logits = self._decider.run(["logits"], {name: ports[name] for name in self._inputs})[0].astype(np.float64)
        with np.errstate(over="ignore", invalid="ignore"):
            found: np.ndarray = 1.0 / (1.0 + np.exp(logits[:, 1] - logits[:, 0]))
        return found


@dataclass(frozen=True)
class Model:
    """Where a planner's network lies, and what kinds of network the planner runs."""

    planner: str
    folder: Path
    networks: frozenset[str]

    @cached_property
    def network(self) -> Network:
        """The network, loaded when it is first used; raises MissingExtraError without ONNX Runtime."""
        return load_network(self.folder, self.planner, self.networks)

    def at(self, folder: Path | str) -> Model:
        """Return the same with the network in ``folder``."""
        return replace(self, folder=Path(folder))

    def check(self) -> None:
        """Raise a MissingExtraError without ONNX Runtime, an InputFileError unless the model is whole."""
        _runtime(self.planner)
        check_files(self.folder, self.networks)

    def state(self) -> str:
        """Return a hash of the model: of its card, which holds those of its files."""
        return str(read_card(self.folder, self.networks)["sha256"])


def shipped(planner: str, network: str) -> Model:
    """Return the model of a planner that comes with the package."""
    return Model(planner, SHIPPED / planner.replace("-", "_"), frozenset({network}))


def read_card(folder: Path, networks: frozenset[str] = frozenset(NETWORKS)) -> dict[str, Any]:
    """Return the checked content of a model's ``model.json``, with its own hash as ``sha256``.

    Raises InputFileError for what is missing, torn, foreign, or not one of ``networks``.
    """
    path = folder / CARD
    text = _read(path)
    try:
        card = json.loads(text)
    except (ValueError, RecursionError):
        raise InputFileError(path, "is not JSON") from None
    if not isinstance(card, dict) or card.get("format") != FORMAT:
        raise InputFileError(path, f"is no card of a model ('format' must be '{FORMAT}')")
    if type(card.get("version")) is not int or card["version"] != VERSION:
        raise InputFileError(path, f"is of version {card.get('version')!r}, this program reads version {VERSION}")
    if card.get("network") not in NETWORKS:
        raise InputFileError(path, f"unknown network {card.get('network')!r} (valid: {', '.join(NETWORKS)})")
    if card["network"] not in networks:
        runs = " or ".join(sorted(networks))
        raise InputFileError(path, f"is a network '{card['network']}'; this planner runs {runs}")
    files = card.get("files")
    if not isinstance(files, dict):
        raise InputFileError(path, "'files' must map file names to their SHA-256")
    for name in PORTS:
        if not isinstance(files.get(name), str):
            raise InputFileError(path, f"'files' has no SHA-256 of {name}")
    view = card.get("view_m", VIEW_M)
    if isinstance(view, bool) or not isinstance(view, int | float) or not VIEWS_M[0] <= view <= VIEWS_M[1]:
        raise InputFileError(path, f"'view_m' is {view!r}, must be a radius of {VIEWS_M[0]:g} to {VIEWS_M[1]:g} m")
    return card | {"view_m": view, "sha256": hashlib.sha256(text).hexdigest()}


def load_network(folder: Path, planner: str, networks: frozenset[str] = frozenset(NETWORKS)) -> Network:
    """Return the model in ``folder``; loaded once as long as its card stays the same."""
    _runtime(planner)
    card = read_card(folder, networks)
    kept = {key: card[key] for key in ("network", "files", "view_m", "sha256")}
    return _load(folder, json.dumps(kept, sort_keys=True))


@lru_cache(maxsize=8)
def _load(folder: Path, card: str) -> Network:
    return Network(folder, json.loads(card))


def check_files(folder: Path, networks: frozenset[str] = frozenset(NETWORKS)) -> None:
    """Raise an InputFileError unless the model in ``folder`` is whole; nothing is run."""
    card = read_card(folder, networks)
    for name in PORTS:
        _checked(folder / name, card["files"][name])


def _runtime(planner: str) -> Any:
    try:
        import onnxruntime
    except ImportError:
        raise MissingExtraError(f"planner '{planner}'", "giwt") from None
    return onnxruntime


def _read(path: Path) -> bytes:
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise InputFileError(path, f"is larger than {LARGEST_BYTES >> 20} MB")
        return path.read_bytes()
    except OSError as error:
        raise InputFileError(path, f"cannot be read ({error.strerror})") from None


def _checked(path: Path, sha256: str) -> bytes:
    """Return the content of a file of the model if it is the one that the card names."""
    data = _read(path)
    if hashlib.sha256(data).hexdigest() != sha256.lower():
        raise InputFileError(path, f"is torn or not the file that {CARD} names (its SHA-256 differs)")
    return data


def _session(path: Path, data: bytes) -> Any:
    """Return an inference session of the checked file content."""
    runtime = _runtime("giwt")
    options = runtime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.execution_mode = runtime.ExecutionMode.ORT_SEQUENTIAL
    options.log_severity_level = 4
    try:
        session = runtime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
    except Exception as error:  # ONNX Runtime raises what it likes
        why = " ".join(str(error).split())[:200]
        raise InputFileError(path, f"is no network that ONNX Runtime can run ({why})") from None
    inputs, outputs = PORTS[path.name]
    _check_ports(path, "input", inputs, session.get_inputs())
    _check_ports(path, "output", outputs, session.get_outputs())
    return session


def _check_ports(path: Path, what: str, wanted: dict[str, Port], found: list[Any]) -> None:
    """Raise an InputFileError unless the ports are those wanted, sizes that vary being free."""
    ports = {port.name: port for port in found}
    if not (wanted.keys() & NEEDED <= ports.keys() <= wanted.keys()):
        raise InputFileError(path, f"has {what}s {', '.join(sorted(ports))} instead of {', '.join(sorted(wanted))}")
    for name, has in ports.items():
        kind, shape = wanted[name]
        fits = len(has.shape) == len(shape) and all(map(_fits, has.shape, shape, [what] * len(shape)))
        if has.type != kind or not fits:
            sizes = ", ".join("any" if size is None else str(size) for size in shape)
            raise InputFileError(path, f"{what} '{name}' is {has.type} {has.shape} instead of {kind} ({sizes})")


def _fits(has: Any, wanted: int | None, what: str) -> bool:
    """Tell whether a size is the wanted one; what an exporter left open in an output is accepted."""
    if wanted is None:
        return not isinstance(has, int)
    return bool(has == wanted) or (what == "output" and not isinstance(has, int))
