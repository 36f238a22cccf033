"""Expert data in several processes: shards of consecutive map seeds until each set is large enough.

The data depends on the configuration alone, not on the number of processes: a set is its first shards, in order, that
together hold enough samples.
"""

from __future__ import annotations

import hashlib
import math
import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from swarmscope.errors import ConfigError, SwarmscopeError
from swarmscope.experiments.engines.local import start_worker
from swarmscope.judging.provenance import own_revision, versions
from swarmscope.learning.records import (
    FORMAT,
    MANIFEST,
    SCHEMA,
    SPLITS,
    VERSION,
    content_key,
    pack,
    read_manifest,
    read_shard,
    split_of,
    to_bytes,
    write_atomically,
    write_manifest,
)
from swarmscope.learning.scenes import Counts, Sampling, samples_of

Report = Callable[[str, int, int], None]
"""Called with a set's name, its samples so far and those wanted."""


class SetName(NamedTuple):
    """One set of expert data."""

    kind: str
    """Map A, B, C."""
    task: str
    """I or II."""
    sampling: Sampling

    @property
    def text(self) -> str:
        """Its name, as in ``A-I`` (placed) or ``A-I-driven``."""
        return f"{self.kind}-{self.task}" + ("" if self.sampling == "placed" else "-driven")

    @property
    def maps_in_a_shard(self) -> int:
        """How many maps a shard is usually taken from."""
        return 400 if self.sampling == "placed" else 100

    @property
    def samples_of_a_map(self) -> float:
        """About how many samples a map gives, at least."""
        return 1.5 if self.sampling == "placed" else 7.5


PLACED = [f"{kind}-{task}" for task in ("I", "II") for kind in "ABC"]
"""The six sets of the document, in its order."""
DRIVEN = [f"{name}-driven" for name in PLACED]
SEED_STEP = 10_000_000
"""Sets have their own ranges of map seeds: SEED_STEP (1 + index) onwards."""


def parse_set(text: str) -> SetName:
    """Return the set called ``text``; raises ConfigError."""
    if text not in PLACED + DRIVEN:
        raise ConfigError("sets", f"'{text}' is none of {', '.join(PLACED + DRIVEN)}")
    kind, task, *driven = text.split("-")
    return SetName(kind, task, "driven" if driven else "placed")


def generate(
    folder: Path,
    names: list[str],
    samples: int,
    workers: int | None = None,
    report: Report | None = None,
    maps: int | None = None,
) -> dict[str, Any]:
    """Bring the sets ``names`` in ``folder`` to at least ``samples`` samples each; return the manifest.

    Shards that are there already are kept, whatever state of the rules they were made by; new ones are taken from
    ``maps`` maps each, by default as many as is usual for the set. A single worker is this process itself. Raises
    ConfigError when the folder holds something else.
    """
    chosen = [parse_set(name) for name in names]
    if samples < 1:
        raise ConfigError("samples", f"must be at least 1, not {samples}")
    manifest = _open(folder)
    write_manifest(folder, manifest)
    workers = workers or len(os.sched_getaffinity(0))
    pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"), initializer=start_worker)
    try:
        for one in chosen:
            shards = _Shards(one, maps or one.maps_in_a_shard, None if workers == 1 else pool, workers)
            _fill(folder, manifest, shards, samples, report)
    except BrokenProcessPool:
        why = "a worker process died (out of memory?); start again with --workers 1: nothing is lost"
        raise SwarmscopeError(why) from None
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
    write_atomically(folder / "README.md", data_card(manifest).encode())
    return manifest


def _open(folder: Path) -> dict[str, Any]:
    """Return the manifest of a folder that may be new."""
    if (folder / MANIFEST).exists():
        return read_manifest(folder)
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        why = "is not empty and has no manifest" if folder.is_dir() else "is no folder"
        raise ConfigError(str(folder), f"{why}; name another folder")
    schema = {name: f"{kind}, {dimensions} dimension(s)" for name, (kind, dimensions) in SCHEMA.items()}
    about = {"format": FORMAT, "version": VERSION, "schema": schema, "versions": versions(), "git": own_revision()}
    return about | {"sets": {}}


class _Shards:
    """The next shards of one set, made in this process or, some ahead, by others."""

    def __init__(self, one: SetName, maps: int, pool: ProcessPoolExecutor | None, workers: int) -> None:
        self.one = one
        self._maps, self._pool, self._workers = maps, pool, workers
        self._pending: dict[int, Future[tuple[bytes, dict[str, Any]]]] = {}

    def next(self, begin: int, missing: float) -> tuple[bytes, dict[str, Any]]:
        """Return the shard from map ``begin`` of the set on; samples of about ``missing`` maps are still wanted."""
        if self._pool is None:
            return make_shard(self.one, begin, self._maps)
        wanted = math.ceil(missing / self._maps)  # what is begun ahead and not wanted keeps the cores from others
        for k in range(min(wanted, self._workers + 1)):
            first = begin + k * self._maps
            if first not in self._pending:
                self._pending[first] = self._pool.submit(make_shard, self.one, first, self._maps)
        return self._pending.pop(begin).result()

    def stop(self) -> None:
        """Drop what has not begun."""
        for future in self._pending.values():
            future.cancel()


def _fill(folder: Path, manifest: dict[str, Any], source: _Shards, samples: int, report: Report | None) -> None:
    """Append shards to one set until it is large enough."""
    name = source.one.text
    entry = manifest["sets"].setdefault(name, {"shards": []})
    shards: list[dict[str, Any]] = entry["shards"]
    total, maps = (sum(s[key] for s in shards) for key in ("samples", "maps"))
    if report is not None:
        report(name, total, samples)
    while total < samples:
        of_a_map = max(total, 1) / maps if maps else source.one.samples_of_a_map
        data, about = source.next(maps, (samples - total) / of_a_map)
        file = f"{name}/shard-{len(shards):05d}.npz"
        write_atomically(folder / file, data)
        shards.append({"file": file, "sha256": hashlib.sha256(data).hexdigest(), "git": own_revision(), **about})
        write_manifest(folder, manifest)
        total += about["samples"]
        maps += about["maps"]
        if report is not None:
            report(name, total, samples)
    source.stop()


def make_shard(one: SetName, begin: int, maps: int) -> tuple[bytes, dict[str, Any]]:
    """Return the shard of a set's maps ``begin`` to ``begin + maps - 1`` as bytes, and what the manifest says of it."""
    offset = SEED_STEP * (1 + (PLACED + DRIVEN).index(one.text)) + begin
    seeds = range(offset, offset + maps)
    counts = Counts()
    found = [(seed, s) for seed in seeds for s in samples_of(one.kind, one.task, one.sampling, seed, counts)]
    shard = pack(found)
    splits = np.bincount(split_of(shard.map), minlength=len(SPLITS)).tolist()
    about = {
        "samples": shard.samples, "left": int((shard.side > 0).sum()), "scans": len(shard.codes),
        "neighbours": len(shard.node_scan) - shard.samples, "first_map": seeds[0], "maps": len(seeds),
        "splits": dict(zip(SPLITS, splits, strict=True)), "counts": dict(counts),
    }  # fmt: skip
    return to_bytes(shard), about


def verify(folder: Path, report: Report | None = None) -> dict[str, Any]:
    """Check every shard of a folder against its manifest; return the manifest."""
    manifest = read_manifest(folder)
    for name, row in totals(manifest).items():
        done = 0
        for shard in manifest["sets"][name]["shards"]:
            read_shard(folder / shard["file"], shard["sha256"])
            done += shard["samples"]
            if report is not None:
                report(name, done, row["samples"])
    return manifest


def totals(manifest: dict[str, Any]) -> dict[str, dict[str, int]]:
    """Return the sums over the shards of each set."""
    summed = {}
    for name, entry in manifest["sets"].items():
        row: dict[str, int] = dict.fromkeys(("samples", "left", "neighbours", "scans", "maps", *SPLITS, *Counts()), 0)
        for shard in entry["shards"]:
            numbers = {k: shard[k] for k in ("samples", "left", "neighbours", "scans", "maps")}
            for key, value in (numbers | shard["splits"] | shard["counts"]).items():
                row[key] = row.get(key, 0) + value
        summed[name] = row
    return summed


def data_card(manifest: dict[str, Any]) -> str:
    """Return the README of a data folder."""
    rows = totals(manifest)
    columns = ("samples", "train", "validation", "test", "left", "neighbours", "maps", "looked_at", "clear_ahead",
               "unreachable", "nothing_ahead", "tie")  # fmt: skip
    lines = [f"| {name} | " + " | ".join(f"{row[c]}" for c in columns) + " |" for name, row in rows.items()]
    schema = "\n".join(f"- `{name}`: {text}" for name, text in manifest["schema"].items())
    key = content_key(manifest, manifest["sets"])
    return f"""# Expert data for GIWT

Made by `swarmscope giwt data` ({manifest["versions"]["swarmscope"]}, git {manifest["git"]}); content {key}.

What a sample is: a robot with something in its way, its scan and those of the robots in its line of sight within
5 m, where they are, and the side on which the shortest way on the true map passes. Simulated: 20 x 20 m maps with walls
round them, 10 to 30 rectangles (A), cylinders (B) or both (C); starts and goals at random (I) or in columns (II).
Sets `*-driven` are the key points of DH-Bug runs, the others robots placed at random with an obstacle in the safe area
ahead.

Left out and counted: nothing in the safe area (`clear_ahead`), no way to the goal (`unreachable`), nothing blocked on
the line within 2.15 m at the width that ways are searched with (`nothing_ahead`), best ways on both sides within 0.1 m
of each other (`tie`). Splits go by map: seed modulo 5 = 0, 1, 2 train, 3 validation, 4 test.

| set | {" | ".join(columns)} |
|---|{"---|" * len(columns)}
{chr(10).join(lines)}

Limits: exact scans and positions, one sensor (360 beams, 5 m), one robot size (0.15 m), static obstacles of two shapes.

Arrays of a shard (`.npz`, no pickles; checksums in `{MANIFEST}`):

{schema}
"""
