"""Small networks with random weights in the files that planners with a network load."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

FLOAT, INT = TensorProto.FLOAT, TensorProto.INT64


def _save(path, nodes, inputs, outputs, weights):
    tensors = [numpy_helper.from_array(np.asarray(value), name) for name, value in weights.items()]
    graph = helper.make_graph(nodes, path.stem, inputs, outputs, tensors)
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    onnx.checker.check_model(model)
    path.write_bytes(model.SerializeToString())


def port(name, kind, *shape):
    return helper.make_tensor_value_info(name, kind, list(shape))


def encoder(path, rng, inputs=None, outputs=None):
    """Strided convolution, pooling, a linear layer, ReLU."""
    weights = {
        "w1": rng.normal(0.0, 0.2, (4, 2, 9, 9)).astype(np.float32),
        "w2": rng.normal(0.0, 0.3, (4 * 6 * 6, 128)).astype(np.float32),
    }
    nodes = [
        helper.make_node("Conv", ["maps", "w1"], ["c"], strides=[8, 8]),
        helper.make_node("Relu", ["c"], ["r"]),
        helper.make_node("MaxPool", ["r"], ["p"], kernel_shape=[2, 2], strides=[2, 2]),
        helper.make_node("Flatten", ["p"], ["f"]),
        helper.make_node("MatMul", ["f", "w2"], ["features"]),
    ]
    _save(
        path, nodes,
        inputs or [port("maps", FLOAT, "B", 2, 101, 101)],
        outputs or [port("features", FLOAT, "B", 128)],
        weights,
    )  # fmt: skip


def decider(path, rng):
    """Sum over robots of present (1 + gain) (features + embedding of the cell), then a linear layer."""
    weights = {
        "table": rng.normal(0.0, 0.3, (49, 128)).astype(np.float32),
        "one": np.float32(1.0),
        "last": np.int64([-1]),
        "robots": np.int64([1]),
        "w": rng.normal(0.0, 0.2, (128, 2)).astype(np.float32),
    }
    nodes = [
        helper.make_node("Gather", ["table", "cells"], ["places"]),
        helper.make_node("Add", ["features", "places"], ["placed"]),
        helper.make_node("Add", ["gains", "one"], ["more"]),
        helper.make_node("Mul", ["more", "present"], ["weight"]),
        helper.make_node("Unsqueeze", ["weight", "last"], ["weights"]),
        helper.make_node("Mul", ["placed", "weights"], ["weighted"]),
        helper.make_node("ReduceSum", ["weighted", "robots"], ["h"], keepdims=0),
        helper.make_node("MatMul", ["h", "w"], ["logits"]),
    ]
    inputs = [
        port("features", FLOAT, "B", "K", 128),
        port("cells", INT, "B", "K"),
        port("gains", FLOAT, "B", "K"),
        port("present", FLOAT, "B", "K"),
    ]
    _save(path, nodes, inputs, [port("logits", FLOAT, "B", 2)], weights)


def write_card(folder, **changes):
    """Write ``model.json`` for the files that lie in ``folder``."""
    files = {f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in sorted(Path(folder).glob("*.onnx"))}
    card = {"format": "swarmscope-giwt", "version": 1, "network": "giwt", "files": files} | changes
    (Path(folder) / "model.json").write_text(json.dumps(card))


def make_model(folder, seed=0, network="giwt"):
    """Write a model with random weights into ``folder``; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng(seed)
    encoder(folder / "encoder.onnx", rng)
    decider(folder / "decider.onnx", rng)
    write_card(folder, network=network)
    return folder
