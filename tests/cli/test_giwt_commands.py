"""``swarmscope giwt`` from data to a model that drives, in small; what is wrong is said in a line or two."""

from __future__ import annotations

import json
from importlib.util import find_spec

import pytest
from command_line import SMALL, refused, swarmscope

for package in ("torch", "torch_geometric", "safetensors", "tensorboard", "sklearn", "onnx", "onnxruntime"):
    if find_spec(package) is None:  # not importorskip: who runs none of these tests need not wait for the imports
        pytest.skip(f"needs {package}", allow_module_level=True)

SET = ("--set-of", "B-II")
CHANGES = ("sets=[B-II]", "epochs=1", "samples_per_epoch=200", "validation_samples=100", "threads=1")
TINY = ("tiny", *(word for change in CHANGES for word in ("--set", change)))


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    folder = tmp_path_factory.mktemp("giwt")
    made = swarmscope("giwt", "data", "--data", folder / "data", *SET, "--samples", 700, "--workers", 1)
    assert made.exit_code == 0 and "B-II" in made.stdout
    for network in ("giwt", "cnn"):
        done = swarmscope("giwt", "train", *TINY, "--set", f"network={network}", "--data", folder / "data",
                          "--out", folder / network)  # fmt: skip
        assert done.exit_code == 0 and "best of 1 epochs" in done.stdout
    return folder


def evaluated(place, *words):
    return ("giwt", "eval", *words, "--data", place / "data", *SET)


@pytest.mark.slow
def test_scores_pictures_export_and_a_run(place, tmp_path):
    out, pictures = tmp_path / "scores.json", tmp_path / "pictures"
    done = swarmscope(*evaluated(place, place / "giwt", place / "cnn"), "--radius", 4, "--radius", 2, "--radius", 4,
                      "--out", out, "--pictures", pictures)  # fmt: skip
    assert done.exit_code == 0, done.stderr
    for words in ("accuracy on test maps", "giwt minus the others", "saved", "by perception radius"):
        assert words in " ".join(done.stdout.split())
    scores = json.loads(out.read_text())
    assert [row["label"] for row in scores["sets"]["B-II"]["networks"]] == ["giwt", "cnn"]
    assert list(scores["radii"]["cnn"]) == ["2", "4"] and str(place) not in out.read_text()
    assert {p.name for p in pictures.iterdir()} == {"layers.png", "radius.png"}
    model = tmp_path / "model"
    assert swarmscope("giwt", "export", place / "giwt", model, "--scores", out).exit_code == 0
    assert json.loads((model / "model.json").read_text())["scores"] == scores
    ran = swarmscope("run", *SMALL, "--planner", "giwt", "--set", f"planner.model={model}", "--out", tmp_path / "run")
    assert ran.exit_code == 0, ran.stderr
    assert swarmscope("giwt", "ceiling", "--data", place / "data", *SET).exit_code == 0
    assert "checksums" in swarmscope("giwt", "data", "--data", place / "data", "--check").stdout


def test_networks_with_one_name_are_told_apart(place, tmp_path):
    out = tmp_path / "scores.json"
    runs = (place / "cnn", place / "cnn" / "best.safetensors", place / "giwt")
    assert swarmscope(*evaluated(place, *runs), "--out", out).exit_code == 0
    scores = json.loads(out.read_text())
    assert [row["label"] for row in scores["sets"]["B-II"]["networks"]] == ["cnn (cnn) 1", "cnn (cnn) 2", "giwt"]
    assert [row["first_ahead"]["value"] for row in scores["mean"][:2]] == [0.0, 0.0]
    assert scores["mean"][2]["accuracy"] == scores["sets"]["B-II"]["networks"][2]["accuracy"]


def test_what_is_wrong_is_said_before_anything_is_scored(place, tmp_path):
    run = place / "giwt"
    assert "none of train, validation, test" in refused(*evaluated(place, run), "--split", "all")
    assert "the pictures of giwt show 5 m" in refused(*evaluated(place, run), "--radius", 6)
    assert "is a folder" in refused(*evaluated(place, run), "--out", tmp_path)
    assert "no set 'C-I'" in refused("giwt", "eval", run, "--data", place / "data", "--set-of", "C-I")
    assert "is not there" in refused(*evaluated(place, tmp_path))
    assert "cannot be read" in refused("giwt", "export", run, tmp_path / "m", "--scores", tmp_path / "none.json")
    assert "is no folder" in refused("giwt", "data", "--data", run / "best.safetensors")
    assert "not KEY=VALUE" in refused("giwt", "train", "--set", "epochs")
    assert "unknown key" in refused("giwt", "train", "--set", "speed=3")


def test_ctrl_c_says_how_to_go_on(place, monkeypatch):
    def stop(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("swarmscope.learning.train.train", stop)
    stopped = swarmscope("giwt", "train", *TINY, "--data", place / "data")
    assert stopped.exit_code == 130 and "goes on after the last whole epoch" in stopped.stderr


def test_decisions_of_a_run_are_printed_and_drawn(tmp_path):
    run, out = tmp_path / "run", tmp_path / "d.png"
    words = ("--task", "GIWT_2", "--seed", 31003, "--limit", 8, "--no-pictures", "--out", run)
    assert swarmscope("run", "--planner", "giwt", *words).exit_code == 0
    assert "made no choice 99: 0, 1" in refused("giwt", "decisions", run, "--number", 99, "--out", out)
    done = swarmscope("giwt", "decisions", run, "--number", 1, "--out", out)
    assert done.exit_code == 0 and "itself 0.25, 14: 0.75" in done.stdout
    assert out.read_bytes().startswith(b"\x89PNG")
