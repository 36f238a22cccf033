"""Shards: what goes in comes out; torn, changed, foreign and missing files are named; stopping loses nothing."""

import errno
import json
import os

import numpy as np
import pytest

from swarmscope.errors import ConfigError, InputFileError
from swarmscope.learning import generate as generate_module
from swarmscope.learning.generate import data_card, generate, parse_set, totals, verify
from swarmscope.learning.records import (
    MANIFEST,
    SCHEMA,
    concatenate,
    content_key,
    load,
    read_manifest,
    read_shard,
    select,
    split_of,
    to_bytes,
    write_atomically,
)
from swarmscope.learning.scenes import Counts, samples_of

SAMPLES, MAPS = 100, 25
"""Three shards of set B-II, one of C-II-driven."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("data")
    generate(place, ["B-II", "C-II-driven"], SAMPLES, workers=2, maps=MAPS)
    return place


def test_sets_are_large_enough_whole_and_described(folder):
    manifest = verify(folder)
    for name, row in totals(manifest).items():
        shard = load(folder)[name]
        assert row["samples"] == shard.samples >= SAMPLES
        assert row["train"] + row["validation"] + row["test"] == shard.samples
        assert 0.3 < row["left"] / shard.samples < 0.7
        assert name in (folder / "README.md").read_text()


def test_splits_share_no_map(folder):
    shard = load(folder, ["B-II"])["B-II"]
    splits = split_of(shard.map)
    seen = [set(shard.map[splits == k].tolist()) for k in range(3)]
    assert all(seen) and not (seen[0] & seen[1] or seen[0] & seen[2] or seen[1] & seen[2])


def test_a_shard_holds_its_samples(folder):
    shard = load(folder, ["B-II"])["B-II"]
    seed = int(shard.map[0])
    samples = list(samples_of("B", "II", "placed", seed, Counts()))
    rows = np.flatnonzero(shard.map == seed)
    assert len(rows) == len(samples)
    for row, sample in zip(rows, samples, strict=True):
        nodes = slice(shard.first[row], shard.first[row + 1])
        assert np.array_equal(shard.codes[shard.node_scan[nodes]], [n.codes for n in sample.nodes])
        assert shard.node_x[nodes].tolist() == pytest.approx([n.x for n in sample.nodes], rel=1e-6)
        assert shard.node_x[nodes][0] == 0.0 and shard.side[row] == sample.label.side
        assert np.hypot(shard.node_x[nodes], shard.node_y[nodes]).max() <= 5.0 + 1e-3


def test_data_does_not_depend_on_the_number_of_workers_and_grows_by_shards(folder, tmp_path):
    before = json.loads((folder / MANIFEST).read_text())["sets"]["B-II"]["shards"]
    assert len(before) >= 2 and [s["first_map"] - before[0]["first_map"] for s in before[:2]] == [0, MAPS]
    generate(tmp_path / "again", ["B-II"], before[0]["samples"], workers=1, maps=MAPS)
    first = read_manifest(tmp_path / "again")["sets"]["B-II"]["shards"]
    assert first == before[:1]
    again = generate(tmp_path / "again", ["B-II"], SAMPLES, workers=1, maps=MAPS)
    assert again["sets"]["B-II"]["shards"] == before


def test_bytes_read_and_selected(folder, tmp_path):
    shard = load(folder, ["C-II-driven"])["C-II-driven"]
    path = tmp_path / "shard.npz"
    path.write_bytes(to_bytes(shard))
    again = read_shard(path)
    assert all(np.array_equal(a, b) for a, b in zip(shard, again, strict=True))
    assert to_bytes(again) == path.read_bytes()
    chosen = np.arange(shard.samples) % 3 == 0
    part = select(shard, chosen)
    both = concatenate([part, select(shard, ~chosen)])
    assert both.samples == shard.samples and part.samples == chosen.sum()
    k, original = 5, int(np.flatnonzero(chosen)[5])
    a, b = slice(part.first[k], part.first[k + 1]), slice(shard.first[original], shard.first[original + 1])
    assert np.array_equal(both.codes[both.node_scan[a]], shard.codes[shard.node_scan[b]])


@pytest.mark.parametrize("harm", ["cut", "bit", "gone", "schema", "index", "places", "pickle", "array"])
def test_a_bad_shard_is_named(folder, tmp_path, harm):
    shard = load(folder, ["B-II"])["B-II"]
    manifest = json.loads((folder / MANIFEST).read_text())
    entry = manifest["sets"]["B-II"]["shards"][0]
    path, sha = tmp_path / "shard.npz", entry["sha256"]
    data = (folder / entry["file"]).read_bytes()
    if harm == "cut":
        data = data[:-100]
    elif harm == "bit":
        data = data[:500] + bytes([data[500] ^ 1]) + data[501:]
    elif harm == "schema":
        sha, data = None, to_bytes(shard._replace(side=shard.side.astype(np.int64)))
    elif harm == "index":
        sha, data = None, to_bytes(shard._replace(node_scan=shard.node_scan + 10**6))
    elif harm == "places":
        sha, data = None, to_bytes(shard._replace(place=shard.place[:, :2]))
    elif harm == "array":
        sha = None
        with path.open("wb") as file:
            np.save(file, shard.codes)
        data = path.read_bytes()
    elif harm == "pickle":
        sha = None
        np.savez(path, **{name: np.array([print], dtype=object) for name in SCHEMA})
        data = path.read_bytes()
    if harm != "gone":
        path.write_bytes(data)
    with pytest.raises(InputFileError, match=r"shard\.npz"):
        read_shard(path, sha)


def test_foreign_folders_and_manifests_are_refused(tmp_path):
    with pytest.raises(InputFileError, match="is missing"):
        load(tmp_path / "nowhere")
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ConfigError, match="not empty"):
        generate(tmp_path, ["A-I"], 10, workers=1)
    (tmp_path / MANIFEST).write_text("[1, 2")
    with pytest.raises(InputFileError, match="cannot be read"):
        load(tmp_path)
    (tmp_path / MANIFEST).write_text('{"format": "swarmscope-giwt-data", "version": 99}')
    with pytest.raises(InputFileError, match="version 99"):
        load(tmp_path)
    with pytest.raises(ConfigError, match="none of"):
        parse_set("D-I")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda m: m.pop("sets"), "'sets' is missing"),
        (lambda m: m.update(sets=[1]), "'sets' is missing or of another kind"),
        (lambda m: m["sets"].update({"B-II": {}}), "set 'B-II' has no list of shards"),
        (lambda m: m["sets"]["B-II"]["shards"][0].pop("sha256"), "'sha256' of shard 0 of set 'B-II'"),
        (lambda m: m["sets"]["B-II"]["shards"].append("x"), "of set 'B-II' is missing or of another kind"),
    ],
)
def test_a_manifest_of_another_form_is_named(folder, tmp_path, change, words):
    manifest = json.loads((folder / MANIFEST).read_text())
    change(manifest)
    (tmp_path / MANIFEST).write_text(json.dumps(manifest))
    for read in (load, verify, read_manifest):
        with pytest.raises(InputFileError, match=words):
            read(tmp_path)


def test_a_set_without_shards_is_a_row_of_zeros(folder):
    manifest = json.loads((folder / MANIFEST).read_text())
    manifest["sets"]["C-I"] = {"shards": []}
    assert set(totals(manifest)["C-I"].values()) == {0} and "| C-I | 0 |" in data_card(manifest)


def test_what_cannot_be_written_is_named_and_leaves_the_folder_usable(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(ConfigError, match="is no folder"):
        generate(tmp_path / "file", ["A-I"], 10, workers=1)
    with pytest.raises(InputFileError, match="cannot be written"):
        write_atomically(tmp_path / "file" / "out", b"1")

    def full(_):
        raise OSError(errno.ENOSPC, "No space left on device")

    (tmp_path / "kept").write_bytes(b"before")
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(InputFileError, match="No space left"):
            write_atomically(tmp_path / "kept", b"after")
    assert (tmp_path / "kept").read_bytes() == b"before" and not list(tmp_path.glob("*.part"))


def test_a_generation_that_got_nowhere_can_go_on(tmp_path, monkeypatch):
    def full(path, data):
        raise InputFileError(path, "cannot be written (No space left on device)")

    monkeypatch.setattr(generate_module, "make_shard", None)
    monkeypatch.setattr(generate_module, "_fill", lambda folder, *rest: full(folder / "A-I", b""))
    for _ in range(2):
        with pytest.raises(InputFileError, match="No space left"):
            generate(tmp_path / "data", ["A-I"], 10, workers=1)
    assert verify(tmp_path / "data")["sets"] == {}


def test_the_key_of_data_is_that_of_its_shards(folder):
    manifest = read_manifest(folder)
    key = content_key(manifest, ["B-II", "C-II-driven"])
    assert key == content_key(manifest, ["C-II-driven", "B-II"]) != content_key(manifest, ["B-II"])


def test_a_missing_set_is_named(folder):
    with pytest.raises(InputFileError, match="no set 'C-I'"):
        load(folder, ["C-I"])


def test_driven_samples_are_the_key_points_of_the_runs(folder):
    row = totals(read_manifest(folder))["C-II-driven"]
    assert row["looked_at"] == sum(row[k] for k in ("unreachable", "nothing_ahead", "tie", "labelled"))
    assert row["labelled"] == row["samples"] > 5 * MAPS


def test_views_are_turned_to_the_target_and_mirrored_about_it(folder):
    pytest.importorskip("sklearn")
    from swarmscope.learning.ceiling import contradictions, mirrored, view_vectors

    shard = load(folder, ["B-II"])["B-II"]
    vectors = view_vectors(shard, 2.5)
    assert vectors.shape == (shard.samples, 360) and vectors.max() <= 2.5
    assert vectors[:, 0].mean() < 0.6 * vectors[:, 180].mean()  # the obstacle ahead is near, what lies behind is not
    assert np.array_equal(mirrored(mirrored(vectors)), vectors)
    assert np.array_equal(mirrored(vectors)[:, 90], vectors[:, 270])
    same = contradictions(shard, shard, 2.5)
    assert same[-1].contradict == 0.0 and same[-1].difference_m == 0.0
