"""``--set planner.model=...`` and the lists, with and without ONNX Runtime."""

from __future__ import annotations

import hashlib
import json
import sys

from command_line import SMALL, refused, swarmscope

from giwt_models import make_model


def test_a_run_with_a_model_of_ones_own(tmp_path):
    model = make_model(tmp_path / "m")
    chosen = ("--planner", "giwt", "--set", f"planner.model={model}")
    result = swarmscope("run", *SMALL[:-1], *chosen, "--out", tmp_path / "r")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "r/replay.html").is_file()
    metrics = json.loads((tmp_path / "r/metrics.json").read_text())
    assert metrics["model_sha256"] == hashlib.sha256((model / "model.json").read_bytes()).hexdigest()
    assert str(model) in (tmp_path / "r/config.yaml").read_text()


def test_what_is_wrong_with_a_model_is_one_line(tmp_path):
    error = refused("run", *SMALL, "--planner", "giwt", "--set", f"planner.model={tmp_path}", "--out", tmp_path / "r")
    assert "model.json: cannot be read" in error
    error = refused("run", *SMALL, "--planner", "dh-bug", "--set", f"planner.model={tmp_path}")
    assert "runs no network" in error


def test_planners_are_listed_without_onnx_runtime(monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    result = swarmscope("planners")
    assert result.exit_code == 0
    for words in ("giwt-cnn", "giwt-gat", "giwt-sage", "answer_s", "stands at a key"):
        assert words in " ".join(result.stdout.split())
