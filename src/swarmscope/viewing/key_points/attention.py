"""The attention weights (6) of a network that a planner runs, which its file computes and keeps to itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError, InputFileError, MissingExtraError
from swarmscope.onboard.network.model import DECIDER, Model, Network, check_files

ATTENTIVE = frozenset({"giwt", "gat"})
"""Networks that weigh robots by attention."""


class Asked(NamedTuple):
    """What a network was given for a choice and what it said; K robots, the one that chooses first."""

    tick: int
    features: NDArray[np.float32]
    """(K, 128)"""
    cells: NDArray[np.int64]
    """(K,), the position grid's (4)."""
    gains: NDArray[np.float32]
    """(K,), beta of (8), 0 of the robot itself."""
    p_left: float


class Listener:
    """A network that answers as another one does, and keeps what that was asked for choices."""

    def __init__(self, network: Network) -> None:
        self._network = network
        self.alone, self.view_m = network.alone, network.view_m
        self.tick = -1
        """Set from outside: which tick is being decided, -1 while the planner is loaded."""
        self.asked: list[Asked] = []

    def encode(self, maps: np.ndarray) -> np.ndarray:
        """Return what the network makes of pictures."""
        return self._network.encode(maps)

    def p_left(self, features: np.ndarray, cells: np.ndarray, gains: np.ndarray) -> np.ndarray:
        """Return what the network says. A question of one row is a choice; more rows ask what each would say alone."""
        found = self._network.p_left(features, cells, gains)
        if len(features) == 1:
            given = (features[0].copy(), cells[0].copy(), gains[0].copy())
            self.asked.append(Asked(self.tick, *given, float(found[0])))
        return found


class Weighed(NamedTuple):
    """What a decider says of one choice."""

    logits: NDArray[np.float64]
    """(2,): of left and of right."""
    weights: NDArray[np.float64]
    """(K, H): attention of every head to every robot, the one that chooses first; each column sums to 1."""


class Attention:
    """The decider of a model with its attention weights as a second output.

    The file's only Softmax makes them. Its result is named an output, and nothing else is changed: the weights are
    exactly those of the graph that robots run, whatever trained it.
    """

    def __init__(self, folder: Path) -> None:
        check_files(folder, ATTENTIVE)
        onnx, runtime = _packages()
        model = onnx.load(folder / DECIDER)
        made = [node.output[0] for node in model.graph.node if node.op_type == "Softmax"]
        if len(made) != 1:
            raise InputFileError(folder / DECIDER, f"has {len(made)} Softmax instead of that of its attention weights")
        model.graph.output.append(onnx.helper.make_empty_tensor_value_info(made[0]))
        options = runtime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        given = model.SerializeToString()
        self._session = runtime.InferenceSession(given, options, providers=["CPUExecutionProvider"])
        self._outputs = ["logits", made[0]]
        self._inputs = [port.name for port in self._session.get_inputs()]

    def of(self, asked: Asked) -> Weighed:
        """Return outputs and attention weights of a choice."""
        rows: dict[str, Any] = {"features": asked.features, "cells": asked.cells, "gains": asked.gains}
        ports = {name: array[None] for name, array in rows.items()} | {"present": np.ones_like(asked.gains)[None]}
        found: Any = self._session.run(self._outputs, {name: ports[name] for name in self._inputs})
        return Weighed(*(array[0].astype(np.float64) for array in found))


def attention_of(planner: str, model: Model | None) -> Attention:
    """Return the attention of a planner's network. Errors: ConfigError, InputFileError, MissingExtraError."""
    if model is None or not model.networks & ATTENTIVE:
        raise ConfigError(f"planner '{planner}'", "has no attention weights; 'giwt' and 'giwt-gat' have them")
    return Attention(model.folder)


def _packages() -> tuple[Any, Any]:
    try:
        import onnx
        import onnxruntime
    except ImportError:
        raise MissingExtraError("attention weights", "learn") from None
    return onnx, onnxruntime
