"""Model folders: whole ones load, all others are refused in one line."""

from __future__ import annotations

import builtins
import json

import numpy as np
import pytest
from onnx import TensorProto

from giwt_models import decider, encoder, make_model, port, write_card
from swarmscope.errors import InputFileError, MissingExtraError
from swarmscope.onboard.network.model import load_network, read_card
from swarmscope.onboard.planners import load_planner

GIWT = load_planner("giwt")


@pytest.fixture
def folder(tmp_path):
    return make_model(tmp_path / "model")


def load(folder):
    return load_network(folder, "giwt", frozenset({"giwt"}))


def refused(folder, words):
    for check in (lambda: load(folder), lambda: GIWT.with_model(folder).check_available()):
        with pytest.raises(InputFileError, match=words) as error:
            check()
        assert "\n" not in str(error.value)


def card(folder, **changes):
    path = folder / "model.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | changes))


def test_a_whole_model_loads_once(folder):
    network = load(folder)
    assert network.encode(np.zeros((3, 2, 101, 101), np.float32)).shape == (3, 128)
    assert load(folder) is network
    GIWT.with_model(folder).check_available()


def test_the_radius_of_the_pictures_is_the_models(folder):
    assert load(folder).view_m == 2.5
    card(folder, view_m=4)
    assert load(folder).view_m == 4.0


def test_another_model_at_the_same_place_is_another_model(folder):
    first, state = load(folder), GIWT.with_model(folder).model.state()
    make_model(folder, seed=1)
    assert load(folder) is not first
    assert GIWT.with_model(folder).model.state() != state == read_card(make_model(folder))["sha256"]


def test_a_missing_folder_or_file(folder, tmp_path):
    refused(tmp_path / "nowhere", "model.json: cannot be read")
    (folder / "decider.onnx").unlink()
    refused(folder, r"decider\.onnx: cannot be read")


@pytest.mark.parametrize("text", [b"", b"{", b"\xff\xfe", b"[" * 9000])
def test_a_card_that_is_no_json(folder, text):
    (folder / "model.json").write_bytes(text)
    refused(folder, "is not JSON")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"format": "other"}, "no card of a model"),
        ({"version": 2}, "of version 2, this program reads version 1"),
        ({"version": True}, "of version True"),
        ({"network": "mlp"}, "unknown network 'mlp'"),
        ({"network": "gat"}, "is a network 'gat'; this planner runs giwt"),
        ({"files": []}, "'files' must map"),
        ({"view_m": 0.0}, "'view_m' is 0.0"),
        ({"view_m": "wide"}, "'view_m' is 'wide'"),
        ({"files": {"encoder.onnx": "0"}}, "no SHA-256 of decider.onnx|SHA-256 differs"),
        ({"files": {"encoder.onnx": "0", "decider.onnx": "0"}}, "SHA-256 differs"),
    ],
)
def test_a_card_that_is_wrong(folder, changes, words):
    card(folder, **changes)
    refused(folder, words)


def test_a_torn_file(folder):
    path = folder / "encoder.onnx"
    path.write_bytes(path.read_bytes()[:-9])
    refused(folder, r"encoder\.onnx: is torn")


def rejected(folder, words):
    """The card is right and the file is what it names, but no such network."""
    write_card(folder)
    GIWT.with_model(folder).check_available()
    with pytest.raises(InputFileError, match=words) as error:
        load(folder)
    assert "\n" not in str(error.value)


def test_a_file_that_is_no_network(folder):
    (folder / "encoder.onnx").write_bytes(b"not a network")
    rejected(folder, r"encoder\.onnx: is no network")


def test_networks_with_other_ports(folder):
    rng, kind = np.random.default_rng(0), TensorProto.FLOAT
    encoder(folder / "encoder.onnx", rng, inputs=[port("maps", kind, 4, 2, 101, 101)])
    rejected(folder, r"input 'maps' is tensor\(float\) \[4, 2, 101, 101\] instead of .* \(any, 2, 101, 101\)")
    decider(folder / "encoder.onnx", rng)
    rejected(folder, r"has inputs cells, features, gains, present instead of maps")


def test_without_onnx_runtime_the_extra_is_named(folder, monkeypatch):
    load_module = builtins.__import__

    def without(name, *rest):
        if name == "onnxruntime":
            raise ImportError(name)
        return load_module(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    for check in (lambda: load(folder), GIWT.check_available):
        with pytest.raises(MissingExtraError, match=r"swarmscope\[giwt\]"):
            check()
