"""A tiny network learns for real; a stopped training goes on as if it had not been stopped; what is bad is named."""

import hashlib
import json
import math
import shutil
from importlib.util import find_spec

import numpy as np
import pytest

torch = pytest.importorskip("torch")
if find_spec("torch_geometric") is None:  # its import takes longer than most tests, and few of them need it
    pytest.skip("needs torch_geometric", allow_module_level=True)

from safetensors.torch import save  # noqa: E402

from swarmscope.errors import ConfigError, InputFileError, SwarmscopeError  # noqa: E402
from swarmscope.learning import checkpoints, export, models, train  # noqa: E402
from swarmscope.learning.batches import View, make_batch  # noqa: E402
from swarmscope.learning.config import parse_config, read_config  # noqa: E402
from swarmscope.learning.evaluate import (  # noqa: E402
    as_sent,
    coin_regret,
    judge,
    majority,
    open_trained,
    read_test,
    scores_of,
    share,
)
from swarmscope.learning.generate import generate  # noqa: E402
from swarmscope.learning.records import load, read_manifest, select, split_of, to_bytes, write_manifest  # noqa: E402
from swarmscope.learning.scenes import robot  # noqa: E402
from swarmscope.onboard.network.answering import draw  # noqa: E402
from swarmscope.onboard.network.local_map import CELL_DISTANCE  # noqa: E402
from swarmscope.viewing.key_points.attention import Asked, Attention  # noqa: E402

SMALL = {"sets": ["B-I"], "channels": [4, 8, 8], "batch": 32, "threads": 1, "precision": "float32"}
"""One thread: several wait for each other most of the time where tests run beside each other."""

pytestmark = pytest.mark.filterwarnings("ignore:.torch.jit.script. is deprecated")  # says torch_geometric's import

VIEW = View(5.0, 5.0)
FAR = np.full(40, 5.0)


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    place = tmp_path_factory.mktemp("data")
    generate(place, ["B-I"], 700, workers=1, maps=60)
    return place


def config(**more):
    return parse_config(SMALL | more, "test")


def test_a_tiny_network_learns_more_than_the_majority(data, tmp_path):
    chosen = config(channels=[8, 16, 16], epochs=3, samples_per_epoch=400, learning_rate=3e-3)
    history = train.train(chosen, data, tmp_path / "run")
    test = read_test(data, ["B-I"])["B-I"]
    most = majority(test)
    chance = -(most * np.log(most) + (1.0 - most) * np.log(1.0 - most))
    assert min(row["validation_loss"] for row in history) < chance - 0.15
    verdict = judge(open_trained(tmp_path / "run"), test)
    score = share(verdict.hit, verdict.map)
    assert most + 0.2 < score.value and score.low < score.value < score.high
    assert scores_of([verdict], [verdict])["first_ahead"].value == 0.0
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


def test_a_validation_that_is_not_finite_stops_and_keeps_what_was_there(data, tmp_path, monkeypatch):
    short = {"samples_per_epoch": 100, "validation_samples": 50}
    train.train(config(epochs=1, **short), data, tmp_path)
    kept = (tmp_path / "last.safetensors").read_bytes()
    monkeypatch.setattr(train, "evaluate", lambda *_: train.Scores(math.nan, 0.5, 1.0))
    with pytest.raises(SwarmscopeError, match="loss is nan in the validation after epoch 2"):
        train.train(config(epochs=2, **short), data, tmp_path)
    assert (tmp_path / "last.safetensors").read_bytes() == kept


def test_a_training_without_progress_ends_and_stays_ended(data, tmp_path, monkeypatch):
    monkeypatch.setattr(train, "evaluate", lambda *_: train.Scores(0.5, 0.5, 1.0))
    short = {"samples_per_epoch": 64, "validation_samples": 50, "patience": 2}
    for _ in range(2):
        assert len(train.train(config(epochs=9, **short), data, tmp_path)) == 3
    assert len(train.train(config(epochs=9, **(short | {"patience": 3})), data, tmp_path)) == 4


def test_another_training_does_not_go_on_in_the_same_folder(data, tmp_path):
    short = {"samples_per_epoch": 64, "validation_samples": 50}
    first, last = config(epochs=1, **short), tmp_path / "run" / "last.safetensors"
    train.train(first, data, tmp_path / "run")
    fewer = tmp_path / "fewer"
    shutil.copytree(data, fewer)
    manifest = read_manifest(fewer)
    del manifest["sets"]["B-I"]["shards"][-1]
    write_manifest(fewer, manifest)
    with pytest.raises(ConfigError, match="on other data"):
        train.train(config(epochs=2, **short), fewer, tmp_path / "run")
    with pytest.raises(ConfigError, match="another --init"):
        train.train(config(epochs=2, **short), data, tmp_path / "run", last)
    shutil.copy(tmp_path / "run" / "best.safetensors", last)
    with pytest.raises(ConfigError, match="without its optimizer"):
        train.train(config(epochs=2, **short), data, tmp_path / "run")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputFileError, match="cannot be written"):
        train.train(first, data, tmp_path / "file")


def test_the_encoder_of_another_network_is_taken_over(data, tmp_path):
    short = {"samples_per_epoch": 64, "validation_samples": 50, "epochs": 1}
    train.train(config(network="cnn", **short), data, tmp_path / "cnn")
    train.train(config(learning_rate=1e-9, **short), data, tmp_path / "giwt", tmp_path / "cnn" / "last.safetensors")
    a, b = (checkpoints.read(tmp_path / n / "last.safetensors").tensors for n in ("cnn", "giwt"))
    assert torch.allclose(a["model.encoder.linear.weight"], b["model.encoder.linear.weight"], atol=1e-5)
    again = config(network="cnn", learning_rate=1e-9, **short)
    train.train(again, data, tmp_path / "on", tmp_path / "cnn" / "last.safetensors")
    on = checkpoints.read(tmp_path / "on" / "last.safetensors").tensors
    assert torch.allclose(a["model.mapper.1.weight"], on["model.mapper.1.weight"], atol=1e-5)
    with pytest.raises(ConfigError, match="another architecture"):
        train.train(config(channels=[4, 4, 4], **short), data, tmp_path / "no", tmp_path / "cnn" / "last.safetensors")


def write_untrained(path, **variant):
    chosen = config(**variant)
    checkpoints.write(path, models.Chooser(train.architecture_of(chosen)), {"config": chosen.model_dump(mode="json")})
    return path


def test_an_export_that_answers_otherwise_or_has_no_place_leaves_everything_as_it_was(tmp_path, monkeypatch):
    path = write_untrained(tmp_path / "model.safetensors", network="cnn")
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputFileError, match="cannot be written"):
        export.export(path, tmp_path / "file")
    monkeypatch.setattr(export, "compare", lambda *_: 1.0)
    with pytest.raises(SwarmscopeError, match="differ by 1, not below"):
        export.export(path, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_scores_of_another_network_do_not_get_into_a_card(tmp_path):
    path, scores = write_untrained(tmp_path / "model.safetensors", network="cnn"), tmp_path / "scores.json"
    row = {"label": "cnn", "sha256": checkpoints.sha256_of(path)}
    complete = {"sets": {"A-I": {"networks": [row]}}, "mean": [{}]}
    scores.write_text(json.dumps(complete))
    assert export.read_scores(scores, path) == complete
    row["sha256"] = "0" * 64
    wrong = {
        "no scores of": complete, "no complete scores": {"sets": complete["sets"]}, "complete scores": [1],
        "another form": {"sets": {"A-I": 3}, "mean": []},
    }  # fmt: skip
    for words, values in wrong.items():
        scores.write_text(json.dumps(values))
        with pytest.raises(InputFileError, match=words):
            export.read_scores(scores, path)
    scores.write_text("{")
    for place in (scores, tmp_path / "nowhere.json"):
        with pytest.raises(InputFileError, match="cannot be read"):
            export.read_scores(place, path)


def test_an_interval_goes_by_map():
    rng = np.random.default_rng(3)
    maps = np.repeat(np.arange(100), 50)
    alike = np.repeat(rng.random(100) < 0.7, 50)
    together, alone = share(alike, maps), share(alike, np.arange(5000))
    assert together.value == alone.value == pytest.approx(alike.mean())
    assert together.maps == 100 and together.samples == 5000
    half = 1.96 * math.sqrt(0.7 * 0.3 / 100)
    assert together.high - together.low == pytest.approx(2.0 * half, rel=0.2)
    assert together.high - together.low > 5.0 * (alone.high - alone.low)


def test_a_split_without_samples_is_named(data, tmp_path):
    none = tmp_path / "none"
    shutil.copytree(data, none)
    manifest = read_manifest(none)
    entry = manifest["sets"]["B-I"]
    shard = load(none)["B-I"]
    part = to_bytes(select(shard, split_of(shard.map) == 0))
    (none / entry["shards"][0]["file"]).write_bytes(part)
    entry["shards"] = [entry["shards"][0] | {"sha256": hashlib.sha256(part).hexdigest()}]
    write_manifest(none, manifest)
    with pytest.raises(ConfigError, match="'B-I' has no test samples"):
        read_test(none, ["B-I"])
    with pytest.raises(ConfigError, match="no samples for training or for validation"):
        train.train(config(), none, tmp_path / "run")


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


@pytest.mark.parametrize("as_printed", [False, True])
def test_attention_weights_of_exported_files_are_those_of_the_layer(as_printed, tmp_path):
    path = write_untrained(tmp_path / "model.safetensors", network="giwt", as_printed=as_printed)
    export.export(path, tmp_path / "out")
    rng = np.random.default_rng(2)
    features, cells = rng.normal(size=(4, 128)).astype(np.float32), np.array([24, 3, 30, 12])
    gains = np.array([0.0, 0.7, 0.2, 0.9], np.float32)
    weighed = Attention(tmp_path / "out").of(Asked(0, features, cells, gains, 0.5))
    model = checkpoints.restore_model(checkpoints.read(path), path).eval()
    layer, rows = model.fusion, torch.from_numpy(features)
    with torch.no_grad():
        # (5), then (6) in our reading: a softmax over robots of a learnt vector times LeakyReLU of the sum.
        fused = layer.bend(layer.transform(rows) + layer.embed(torch.from_numpy(cells)))
        pairs = layer.slope(layer.query(fused[:1]) + layer.key(fused)).unflatten(-1, (layer.heads, -1))
        wanted = torch.softmax((pairs * layer.score).sum(-1), dim=0)
        arrays = (torch.from_numpy(a)[None] for a in (features, cells, gains, np.ones_like(gains)))
        logits = model.decide(*arrays)[0]
    assert weighed.weights == pytest.approx(wanted.numpy(), abs=1e-5) and weighed.weights.shape == wanted.shape
    assert weighed.weights.sum(axis=0) == pytest.approx(1.0) and np.ptp(weighed.weights) > 0.01
    assert weighed.logits == pytest.approx(logits.numpy(), abs=1e-4)


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
    shard = load(data)["B-I"]
    chosen = np.arange(40)
    plain = make_batch(shard, chosen, np.zeros(40, bool), FAR, VIEW)
    mirrored = make_batch(shard, chosen, np.ones(40, bool), FAR, VIEW)
    assert np.array_equal(plain.maps[:, :, ::-1], mirrored.maps)
    assert np.array_equal(plain.right, 1 - mirrored.right)
    rows, columns = np.divmod(plain.cells, 7)
    assert np.array_equal(np.where(plain.present > 0, (6 - rows) * 7 + columns, 24), mirrored.cells)


def test_a_picture_in_a_batch_is_what_the_planner_draws(data):
    shard, rig = load(data)["B-I"], robot()[2]
    batch = make_batch(shard, np.arange(40), np.zeros(40, bool), FAR, VIEW)
    picture = np.empty(batch.maps.shape[1:], np.float32)
    for e, (scan, target) in enumerate(zip(shard.node_scan, shard.node_target, strict=True)):
        if e == len(batch.maps):
            break
        draw(shard.codes[scan], float(target), 5.0, rig, picture)
        assert np.array_equal(picture, batch.maps[e])
    assert e == shard.first[40]


def test_robots_that_see_less_far_have_less_in_their_pictures_and_gain_more(data):
    shard = load(data)["B-I"]
    far, near = (make_batch(shard, np.arange(40), np.zeros(40, bool), np.full(40, s), VIEW) for s in (5.0, 2.0))
    seen = CELL_DISTANCE * 0.1 <= 2.0 + 1e-6
    assert np.array_equal(near.maps[:, :, seen], far.maps[:, :, seen]) and not near.maps[:, :, ~seen].any()
    assert far.maps[:, :, ~seen].any()
    others = far.present.astype(bool) & (far.cells != 24)
    assert (near.gains[others] > far.gains[others]).all() and (near.gains[:, 0] == 0.0).all()


def test_features_of_others_come_in_bytes_and_the_own_ones_exactly(data):
    shard = load(data)["B-I"]
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
    wrong = (
        ({"epoch": 3}, "unknown key"), ({"batch": 1}, "batch"), ({"sets": ["X"]}, "none of"), ({"sets": []}, "sets"),
        ({"sets": "A-I"}, "sets"), ({"view_m": 50.0}, "view_m"), ({"learning_rate": math.nan}, "learning_rate"),
    )  # fmt: skip
    for values, what in wrong:
        with pytest.raises(ConfigError, match=what):
            parse_config(values, "mine.yaml")
    whole = write_untrained(tmp_path / "whole.safetensors")
    found = checkpoints.read(whole)
    about = {"format": checkpoints.FORMAT, "version": checkpoints.VERSION, "about": {"config": {}}}
    shape = {"network": "giwt", "channels": [4, 8, 8]}
    headers = {
        "is no 'swarmscope-giwt-checkpoint'": [], "of version 1": about | {"version": 2},
        "what configuration": about | {"about": {}, "architecture": shape}, "another version": about,
        "unknown network 'gpt'": about | {"architecture": shape | {"network": "gpt"}},
    }  # fmt: skip
    for words, header in headers.items():
        whole.write_bytes(save(found.tensors, {"swarmscope": json.dumps(header)}))
        with pytest.raises(InputFileError, match=words):
            checkpoints.read(whole)
    with pytest.raises(InputFileError, match="packaged ones are cpu, full, tiny"):
        read_config(str(tmp_path / "mine.yaml"))
