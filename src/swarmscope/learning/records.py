"""Data sets on disk: a folder with one folder of shards for each set, and a manifest that knows them all.

A shard is a ``.npz`` of plain arrays (``SCHEMA``), read without unpickling anything. Scans are stored once per robot
and drawn into pictures when they are loaded. ``manifest.json`` lists every shard with its SHA-256, its maps and what
was left out; it is written anew after each shard, so that a stopped generation goes on where it was.
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import zipfile
import zlib
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import InputFileError
from swarmscope.learning.scenes import Sample
from swarmscope.texts import read_text

FORMAT = "swarmscope-giwt-data"
VERSION = 1
MANIFEST = "manifest.json"
SCHEMA: dict[str, tuple[str, int]] = {
    "codes": ("uint8", 2),  # (S, M) scans as range codes (onboard/network/local_map.py), body frame
    "node_scan": ("int32", 1),  # (E,) which scan a robot of a sample has
    "node_target": ("float32", 1),  # (E,) the decider's target direction in that scan's frame [rad]
    "node_x": ("float32", 1),  # (E,) its place in the decider's target frame [m]; 0 for the decider
    "node_y": ("float32", 1),
    "first": ("int64", 1),  # (n + 1,) first robot of each sample: the decider, then its neighbours, nearest first
    "side": ("int8", 1),  # (n,) the expert's side, +1 left, -1 right
    "detour_m": ("float32", 1),  # (n,) how much longer the best way on the other side is, at most 20 m
    "way_m": ("float32", 1),  # (n,) length of the shortest way
    "goal_m": ("float32", 1),  # (n,) distance to the goal
    "map": ("int64", 1),  # (n,) the map's seed; splits go by it
    "place": ("float32", 2),  # (n, 4) robot x, y, goal x, y, world frame [m]; to look at, not to learn from
}
HEAD: dict[str, type] = {"sets": dict, "schema": dict, "versions": dict, "git": str}
"""What the manifest says of the folder, besides format and version."""
ENTRY: dict[str, type] = {
    "file": str, "sha256": str, "samples": int, "left": int, "scans": int, "neighbours": int, "first_map": int,
    "maps": int, "splits": dict, "counts": dict,
}  # fmt: skip
"""What the manifest says of a shard."""
SPLITS = ("train", "validation", "test")
SPLIT_OF = np.array([0, 0, 0, 1, 2])
"""3:1:1 by map: the split of a map is that of its seed modulo 5."""


class Shard(NamedTuple):
    """The arrays of SCHEMA, in its order."""

    codes: NDArray[np.uint8]
    node_scan: NDArray[np.int32]
    node_target: NDArray[np.float32]
    node_x: NDArray[np.float32]
    node_y: NDArray[np.float32]
    first: NDArray[np.int64]
    side: NDArray[np.int8]
    detour_m: NDArray[np.float32]
    way_m: NDArray[np.float32]
    goal_m: NDArray[np.float32]
    map: NDArray[np.int64]
    place: NDArray[np.float32]

    @property
    def samples(self) -> int:
        """How many samples it holds."""
        return len(self.side)


def pack(samples: Iterable[tuple[int, Sample]]) -> Shard:
    """Return (map seed, sample) pairs as a shard; equal scans of one map are stored once."""
    codes: list[NDArray[np.uint8]] = []
    seen: dict[bytes, int] = {}
    nodes: list[tuple[int, float, float, float]] = []
    first, rows, places = [0], [], []
    for seed, sample in samples:
        for node in sample.nodes:
            key = node.codes.tobytes()
            if key not in seen:
                seen[key] = len(codes)
                codes.append(node.codes)
            nodes.append((seen[key], node.target, node.x, node.y))
        first.append(len(nodes))
        rows.append((sample.label.side, sample.label.detour_m, sample.label.way_m, sample.goal_m, seed))
        places.append(sample.place)
    scans = np.array(codes, np.uint8).reshape(len(codes), -1)
    about_nodes = np.array(nodes, np.float64).reshape(-1, 4).T
    row = np.array(rows, np.float64).reshape(-1, 5).T
    columns = (scans, *about_nodes, np.array(first), *row, np.array(places, np.float64).reshape(-1, 4))
    return Shard(*(c.astype(kind) for c, (kind, _) in zip(columns, SCHEMA.values(), strict=True)))


def concatenate(shards: list[Shard]) -> Shard:
    """Return several shards as one."""
    scans = np.cumsum([0, *(len(s.codes) for s in shards)])
    nodes = np.cumsum([0, *(len(s.node_scan) for s in shards)])
    joined = {name: np.concatenate([getattr(s, name) for s in shards]) for name in SCHEMA if name != "first"}
    joined["node_scan"] = np.concatenate(
        [(s.node_scan + offset).astype(np.int32) for s, offset in zip(shards, scans, strict=False)]
    )
    starts = [s.first[:-1] + offset for s, offset in zip(shards, nodes, strict=False)]
    return Shard(**joined, first=np.concatenate([*starts, nodes[-1:]]))


def select(shard: Shard, chosen: NDArray[np.bool_]) -> Shard:
    """Return the samples where ``chosen (n,)``; scans that nobody needs any more stay."""
    counts = np.diff(shard.first)
    nodes = np.repeat(chosen, counts)
    rows = {name: getattr(shard, name)[chosen] for name in ("side", "detour_m", "way_m", "goal_m", "map", "place")}
    kept = {name: getattr(shard, name)[nodes] for name in ("node_scan", "node_target", "node_x", "node_y")}
    first = np.concatenate([[0], np.cumsum(counts[chosen])])
    return Shard(codes=shard.codes, first=first, **rows, **kept)


def some(shard: Shard, samples: int, seed: int = 0) -> Shard:
    """Return so many samples drawn at random, or all if there are fewer."""
    if shard.samples <= samples:
        return shard
    chosen = np.zeros(shard.samples, np.bool_)
    chosen[np.random.default_rng([seed, 1]).permutation(shard.samples)[:samples]] = True
    return select(shard, chosen)


def split_of(maps: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the index into SPLITS of each map seed."""
    return np.asarray(SPLIT_OF[maps % len(SPLIT_OF)], dtype=np.int64)


def to_bytes(shard: Shard) -> bytes:
    """Return the shard as the bytes of an .npz, the same for the same arrays."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED, compresslevel=5) as file:
        for name, values in zip(SCHEMA, shard, strict=True):
            part = io.BytesIO()
            np.save(part, np.asarray(values), allow_pickle=False)
            file.writestr(zipfile.ZipInfo(f"{name}.npy", (1980, 1, 1, 0, 0, 0)), part.getvalue(), zipfile.ZIP_DEFLATED)
    return out.getvalue()


def read_shard(path: Path, sha256: str | None = None) -> Shard:
    """Return the shard in ``path``; raises InputFileError for what is missing, torn, changed or of another schema."""
    try:
        data = path.read_bytes()
    except OSError as error:
        raise InputFileError(path, f"cannot be read ({error.strerror})") from None
    if sha256 is not None and hashlib.sha256(data).hexdigest() != sha256:
        raise InputFileError(path, "is torn or was changed: its checksum is not the one in the manifest")
    arrays = {}
    try:
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            for name, (kind, dimensions) in SCHEMA.items():
                arrays[name] = file[name]
                if arrays[name].dtype != kind or arrays[name].ndim != dimensions:
                    raise InputFileError(path, f"'{name}' is not {kind} with {dimensions} dimension(s)")
    except (ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile, zlib.error, OSError) as error:
        raise InputFileError(path, f"is no shard of version {VERSION} ({error})") from None
    shard = Shard(**arrays)
    _check_indices(path, shard)
    return shard


def _check_indices(path: Path, shard: Shard) -> None:
    """Raise InputFileError unless lengths and indices fit together."""
    n, e = shard.samples, len(shard.node_scan)
    per_sample = (shard.detour_m, shard.way_m, shard.goal_m, shard.map, shard.place)
    per_node = (shard.node_target, shard.node_x, shard.node_y)
    widths = shard.place.shape[1] == 4 and (e == 0 or shard.codes.shape[1] > 0)
    fit = all(len(a) == n for a in per_sample) and all(len(a) == e for a in per_node) and len(shard.first) == n + 1
    if not (widths and fit):
        raise InputFileError(path, "its arrays have lengths that do not fit together")
    in_order = shard.first[0] == 0 and shard.first[-1] == e and bool((np.diff(shard.first) >= 1).all())
    in_range = e == 0 or (shard.node_scan.min() >= 0 and shard.node_scan.max() < len(shard.codes))
    if not (in_order and in_range and bool(np.isin(shard.side, (-1, 1)).all())):
        raise InputFileError(path, "its indices or sides are out of range")


def write_atomically(path: Path, data: bytes) -> None:
    """Write a file that is there whole or not at all."""
    part = path.with_name(path.name + ".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with part.open("wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise InputFileError(path, f"cannot be written ({error.strerror})") from None


def write_manifest(folder: Path, manifest: dict[str, Any]) -> None:
    """Write the manifest of a data folder."""
    write_atomically(folder / MANIFEST, (json.dumps(manifest, indent=1) + "\n").encode())


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of a data folder; raises InputFileError when it is missing, torn or of another format."""
    path = folder / MANIFEST
    if not path.exists():
        raise InputFileError(path, "is missing: the folder is no data set (see 'swarmscope giwt data --help')")
    try:
        manifest = json.loads(read_text(path))
    except (OSError, ValueError, RecursionError) as error:
        raise InputFileError(path, f"cannot be read ({error})") from None
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise InputFileError(path, f"is not the manifest of a '{FORMAT}' folder")
    if manifest.get("version") != VERSION:
        raise InputFileError(path, f"has version {manifest.get('version')!r}; this program reads version {VERSION}")
    _check_entries(path, manifest)
    return manifest


def _check_entries(path: Path, manifest: dict[str, Any]) -> None:
    """Raise InputFileError unless the manifest says of every shard of every set what ENTRY lists."""
    for key, kind in HEAD.items():
        if not isinstance(manifest.get(key), kind):
            raise InputFileError(path, f"'{key}' is missing or of another kind")
    for name, entry in manifest["sets"].items():
        shards = entry.get("shards") if isinstance(entry, dict) else None
        if not isinstance(shards, list):
            raise InputFileError(path, f"set '{name}' has no list of shards")
        for k, shard in enumerate(shards):
            for key, kind in ENTRY.items():
                if not isinstance(shard, dict) or not isinstance(shard.get(key), kind):
                    raise InputFileError(path, f"'{key}' of shard {k} of set '{name}' is missing or of another kind")


def content_key(manifest: dict[str, Any], names: Iterable[str]) -> str:
    """Return a hash of what some sets of a data folder contain."""
    sums = {name: [shard["sha256"] for shard in manifest["sets"][name]["shards"]] for name in sorted(names)}
    return hashlib.sha256(json.dumps(sums).encode()).hexdigest()[:16]


def load(folder: Path, names: list[str] | None = None) -> dict[str, Shard]:
    """Return the whole sets ``names`` (all if None) of a data folder, every shard checked against the manifest."""
    manifest = read_manifest(folder)
    wanted = list(manifest["sets"]) if names is None else names
    found = {}
    for name in wanted:
        if name not in manifest["sets"]:
            raise InputFileError(folder / MANIFEST, f"has no set '{name}', only {', '.join(manifest['sets'])}")
        entries = manifest["sets"][name]["shards"]
        if not entries:
            raise InputFileError(folder / MANIFEST, f"set '{name}' has no shards yet: generate it first")
        found[name] = concatenate([read_shard(folder / e["file"], e["sha256"]) for e in entries])
    return found
