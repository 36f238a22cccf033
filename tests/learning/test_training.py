"""A tiny network learns for real; a stopped training goes on as if it had not been stopped; what is bad is named."""

import json

import numpy as np
import pytest

torch = pytest.importorskip("torch")
pytest.importorskip("torch_geometric")

from swarmscope.errors import ConfigError, InputFileError, SwarmscopeError  # noqa: E402
from swarmscope.learning import checkpoints, export, models, train  # noqa: E402
from swarmscope.learning.batches import View, make_batch  # noqa: E402
from swarmscope.learning.config import parse_config, read_config  # noqa: E402
from swarmscope.learning.evaluate import (  # noqa: E402
    ahead_of,
    as_sent,
    coin_regret,
    judge,
    majority,
    open_trained,
    read_test,
    share,
)
from swarmscope.learning.generate import generate  # noqa: E402
from swarmscope.learning.records import load  # noqa: E402

SMALL = {"sets": ["A-II-driven"], "channels": [4, 8, 8], "batch": 32, "threads": 2, "precision": "float32"}

VIEW = View(5.0, 5.0)
FAR = np.full(40, 5.0)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    place = tmp_path_factory.mktemp("data")
    generate(place, ["A-II-driven"], 3000, workers=2)
    return place


def config(**more):
    return parse_config(SMALL | more, "test")


def test_a_tiny_network_learns_more_than_the_majority(data, tmp_path):
    chosen = config(channels=[8, 16, 16], epochs=4, samples_per_epoch=1500, learning_rate=3e-3)
    history = train.train(chosen, data, tmp_path / "run")
    test = read_test(data, ["A-II-driven"])["A-II-driven"]
    most = majority(test)
    chance = -(most * np.log(most) + (1.0 - most) * np.log(1.0 - most))
    assert min(row["validation_loss"] for row in history) < chance - 0.05
    verdict = judge(open_trained(tmp_path / "run"), test)
    score = share(verdict.hit, verdict.map)
    assert most + 0.03 < score.value and score.low < score.value < score.high
    assert ahead_of(verdict, verdict).value == 0.0
    assert any((tmp_path / "run" / "tensorboard").iterdir())


def test_a_stopped_training_goes_on_as_if_nothing_had_happened(data, tmp_path):
    short = {"samples_per_epoch": 200, "validation_samples": 100, "warm_up": 0.0}
    whole = train.train(config(epochs=3, **short), data, tmp_path / "whole")

    def stop(epoch, done, steps, note):
        if epoch == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        train.train(config(epochs=3, **short), data, tmp_path / "parts", report=stop)
    parts = train.train(config(epochs=3, **short), data, tmp_path / "parts")
    for a, b in zip(whole, parts, strict=True):
        assert {k: v for k, v in a.items() if k != "wall_s"} == {k: v for k, v in b.items() if k != "wall_s"}
    with pytest.raises(ConfigError, match="holds a training with learning_rate"):
        train.train(config(epochs=3, learning_rate=0.5, **short), data, tmp_path / "parts")
    with pytest.raises(ConfigError, match="another architecture: network is giwt, not cnn"):
        train.train(config(network="cnn", epochs=3, **short), data, tmp_path / "parts")


def test_a_loss_that_is_not_finite_stops_and_keeps_what_was_there(data, tmp_path, monkeypatch):
    short = {"samples_per_epoch": 100, "validation_samples": 50}
    train.train(config(epochs=1, **short), data, tmp_path)
    kept = (tmp_path / "last.safetensors").read_bytes()
    def spoilt(model, batch, device):
        return model.mapper[1].bias[0] * torch.full((len(batch.right), 2), torch.nan)

    monkeypatch.setattr(train, "forward", spoilt)
    with pytest.raises(SwarmscopeError, match="loss is nan in epoch 2, batch 1"):
        train.train(config(epochs=2, **short), data, tmp_path)
    assert (tmp_path / "last.safetensors").read_bytes() == kept


def test_the_encoder_of_another_network_is_taken_over(data, tmp_path):
    short = {"samples_per_epoch": 64, "validation_samples": 50, "epochs": 1}
    train.train(config(network="cnn", **short), data, tmp_path / "cnn")
    train.train(config(learning_rate=1e-9, **short), data, tmp_path / "giwt", tmp_path / "cnn" / "last.safetensors")
    a, b = (checkpoints.read(tmp_path / n / "last.safetensors").tensors for n in ("cnn", "giwt"))
    assert torch.allclose(a["model.encoder.linear.weight"], b["model.encoder.linear.weight"], atol=1e-5)
    with pytest.raises(ConfigError, match="another architecture"):
        train.train(config(channels=[4, 4, 4], **short), data, tmp_path / "no", tmp_path / "cnn" / "last.safetensors")


VARIANTS = [{"network": n} for n in models.NETWORKS]
VARIANTS += [{"as_printed": True}, {"use_gain": False}, {"use_position": False}]


@pytest.mark.parametrize("variant", VARIANTS, ids=str)
def test_exported_files_answer_like_pytorch(variant, tmp_path):
    chosen = config(**variant)
    torch.manual_seed(1)
    model = models.Chooser(train.architecture_of(chosen))
    for module in model.modules():
        if isinstance(module, torch.nn.BatchNorm2d):
            module.running_mean.normal_()
            module.running_var.uniform_(0.5, 2.0)
    path = tmp_path / "model.safetensors"
    checkpoints.write(path, model, {"config": chosen.model_dump(mode="json")})
    assert export.export(path, tmp_path / "out") < 1e-4
    assert json.loads((tmp_path / "out" / "model.json").read_text())["network"] == chosen.network


@pytest.mark.parametrize("variant", VARIANTS, ids=str)
def test_absent_robots_and_their_order_do_not_matter(variant, data):
    torch.manual_seed(0)
    model = models.Chooser(models.Architecture(channels=(4, 8, 8), **variant)).eval()
    features = torch.randn(5, 4, 128)
    cells = torch.tensor([[24, 3, 30, 12]] * 5)
    gains = torch.tensor([[0.0, 0.7, 0.2, 0.9]] * 5)
    present = torch.ones(5, 4)
    present[:, 3] = 0.0
    logits = model.decide(features, cells, gains, present)
    fewer = model.decide(features[:, :3], cells[:, :3], gains[:, :3], present[:, :3])
    order = torch.tensor([0, 2, 1, 3])
    swapped = model.decide(features[:, order], cells[:, order], gains[:, order], present[:, order])
    assert torch.allclose(logits, fewer, atol=1e-5) and torch.allclose(logits, swapped, atol=1e-5)


def test_a_mirrored_sample_is_the_sample_of_the_mirrored_world(data):
    shard = load(data)["A-II-driven"]
    chosen = np.arange(40)
    plain = make_batch(shard, chosen, np.zeros(40, bool), FAR, VIEW)
    mirrored = make_batch(shard, chosen, np.ones(40, bool), FAR, VIEW)
    assert np.array_equal(plain.maps[:, :, ::-1], mirrored.maps)
    assert np.array_equal(plain.right, 1 - mirrored.right)
    rows, columns = np.divmod(plain.cells, 7)
    assert np.array_equal(np.where(plain.present > 0, (6 - rows) * 7 + columns, 24), mirrored.cells)


def test_features_of_others_come_in_bytes_and_the_own_ones_exactly(data):
    shard = load(data)["A-II-driven"]
    batch = make_batch(shard, np.arange(40), np.zeros(40, bool), FAR, VIEW)
    features = torch.randn(len(batch.maps), 128)
    sent = as_sent(features, batch)
    own = batch.slots[:, 0]
    others = np.setdiff1d(np.arange(len(features)), own)
    assert len(others) > 0 and torch.equal(sent[own], features[own])
    error = (sent[others] - features[others]).abs().amax(1) / features[others].abs().amax(1)
    assert 0.0 < float(error.max()) < 2.0**0.125 / 254.0 + 1e-6
    assert coin_regret(shard) == pytest.approx(float(shard.detour_m.mean()) / 2.0)


def test_bad_checkpoints_and_configurations_are_named(tmp_path):
    with pytest.raises(InputFileError, match="is not there"):
        checkpoints.read(tmp_path / "none.safetensors")
    (tmp_path / "torn.safetensors").write_bytes(b"\x10\0\0\0\0\0\0\0{")
    with pytest.raises(InputFileError, match="no whole safetensors"):
        checkpoints.read(tmp_path / "torn.safetensors")
    for values, what in (({"epoch": 3}, "unknown key"), ({"batch": 0}, "batch"), ({"sets": ["X"]}, "none of")):
        with pytest.raises(ConfigError, match=what):
            parse_config(values, "mine.yaml")
    with pytest.raises(InputFileError, match="packaged ones are cpu, full, tiny"):
        read_config(str(tmp_path / "mine.yaml"))
