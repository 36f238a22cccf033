"""The replay page as a file: whole, self-contained, faithful, bounded."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fake_run import make_fake_run

from swarmscope.errors import InputFileError
from swarmscope.viewing import replay
from swarmscope.viewing.replay import write_replay

DTYPES = {"f8": "<f8", "f4": "<f4", "i4": "<i4", "i2": "<i2", "i1": "i1", "u1": "u1"}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_fake_run(tmp_path / "run", crashed=4)


def embedded(page: Path) -> dict[str, Any]:
    found = re.search(r'<script id="data" type="application/json">(.*?)</script>', page.read_text("utf-8"), re.S)
    assert found is not None
    content = json.loads(found[1])
    assert isinstance(content, dict)
    return content


def decoded(entry: dict[str, Any]) -> np.ndarray:
    return np.frombuffer(base64.b64decode(entry["base64"]), DTYPES[entry["type"]]).reshape(entry["shape"])


def test_page_refers_to_nothing_outside(folder: Path) -> None:
    page = write_replay(folder)
    assert page == folder / "replay.html"
    text = re.sub(r'"base64":"[^"]*"', "", page.read_text("utf-8"))
    assert not re.search(r"https?://|//[a-z]+\.[a-z]", text)
    assert not re.search(r"\b(fetch|XMLHttpRequest|importScripts|WebSocket|DecompressionStream)\b", text)
    assert not re.search(r"@import|url\(", text)
    assert re.findall(r'(?:src|href)="([^"]*)"', text) == ["data:,"]
    assert "default-src 'none'" in text


def test_embedded_arrays_equal_the_trajectory(folder: Path) -> None:
    arrays = embedded(write_replay(folder))["arrays"]
    with np.load(folder / "trajectory.npz") as recorded:
        for name, entry in arrays.items():
            found = decoded(entry)
            np.testing.assert_array_equal(found, recorded[name].astype(found.dtype), err_msg=name)
    assert {"scan_u8", "safe_bits", "links", "x_m", "p_left"} <= set(arrays)


def test_world_and_words_are_embedded(folder: Path) -> None:
    data = embedded(write_replay(folder))
    assert [o["type"] for o in data["obstacles"]].count("circle") == 10
    assert {o["type"] for o in data["obstacles"]} == {"circle", "polygon", "wall", "grid"}
    assert data["title"] == "T1 · nav-scope · 6 robots · seed 7"
    assert ["Collisions", "1"] in data["summary"]
    assert data["failures"] == {"4": "collided"}
    assert data["crash_ticks"] == [60, 60, 60, 60, 30, 60]


def test_names_cannot_break_out_of_the_page(folder: Path) -> None:
    nasty = "</script><img src=x onerror=alert(1)>"
    metrics = json.loads((folder / "metrics.json").read_text())
    metrics["run"]["task"] = nasty
    (folder / "metrics.json").write_text(json.dumps(metrics))
    page = write_replay(folder)
    assert nasty not in page.read_text("utf-8") and "<img" not in page.read_text("utf-8")
    assert embedded(page)["title"].startswith(nasty)


def test_same_run_same_page(folder: Path) -> None:
    first = write_replay(folder).read_bytes()
    assert write_replay(folder).read_bytes() == first
    assert {entry.name for entry in folder.iterdir() if entry.name.startswith(".")} == set()


def test_run_without_scans(tmp_path: Path) -> None:
    data = embedded(write_replay(make_fake_run(tmp_path / "run", ticks=5, scans=False)))
    assert data["arrays"]["scan_u8"]["base64"] == "" and data["arrays"]["safe_bits"]["base64"] == ""


def test_page_is_hardly_larger_than_its_content(folder: Path) -> None:
    per_tick = 60 * 6 * (6 * 4 + 4 + 4 + 72 + 9)
    assert write_replay(folder).stat().st_size < 1.4 * per_tick + 60_000


def test_too_many_scans_are_thinned_in_time(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay, "SCAN_BUDGET_BYTES", 60 * 6 * 81 // 3)
    data = embedded(write_replay(folder))
    assert data["scan_stride"] == 3
    with np.load(folder / "trajectory.npz") as recorded:
        np.testing.assert_array_equal(decoded(data["arrays"]["scan_u8"]), recorded["scan_u8"][::3])
        np.testing.assert_array_equal(decoded(data["arrays"]["safe_bits"]), recorded["safe_bits"][::3])
    assert data["arrays"]["x_m"]["shape"] == [60, 6]


def test_unfinished_run_is_refused(folder: Path) -> None:
    (folder / "metrics.json").unlink()
    with pytest.raises(InputFileError, match=r"metrics\.json"):
        write_replay(folder)
    assert not (folder / "replay.html").exists()
