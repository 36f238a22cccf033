"""The folder of one run: complete, or not there at all.

Everything is written and synced in a hidden sibling folder, and then renamed into place.
A process killed at any moment leaves the earlier result or the new one, and at worst a hidden sibling,
which the next write to the same place removes.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, cast

import numpy as np
import numpy.typing as npt
import yaml

from swarmscope.errors import ConfigError, InputFileError, SwarmscopeError
from swarmscope.scenarios.plain import plain
from swarmscope.sim.scan_files import read_npz
from swarmscope.texts import load_yaml, read_text
from swarmscope.user_files import whole_path

CONFIG, WORLD, TRAJECTORY, METRICS = "config.yaml", "world.json", "trajectory.npz", "metrics.json"
REQUIRED = frozenset({CONFIG, WORLD, TRAJECTORY, METRICS})
RUN_FILES = REQUIRED | {"paths.png", "replay.html"}
ASKED_FILES = frozenset({"run.mcap", "video.gif", "video.mp4"})
"""What a run folder holds only where somebody asked for it."""
USER_FILES = frozenset({"planner.py", "task.py"})
"""Copies of a user's files that were run; nothing runs them again."""
YAML_END = "...\n"
MOST_BYTES = 1 << 30
"""Of a text in a run folder."""
LEFTOVER = re.compile(r"\..+\.\d+\.tmp")
"""What a killed ``swarmscope replay`` may leave in a run folder."""


def write_run(
    out: Path,
    config: Mapping[str, Any],
    world: Mapping[str, Any],
    trajectory: Mapping[str, npt.NDArray[Any]],
    metrics: Mapping[str, Any],
    files: Mapping[str, str] | None = None,
    extras: Callable[[Path], None] | None = None,
) -> Path:
    """Write a complete run folder at ``out`` and return its path; an earlier run there is replaced last.

    ``files`` are texts of ``USER_FILES``. ``extras`` is called with the unfinished folder to add the other
    ``RUN_FILES`` and ``ASKED_FILES``. When anything fails,
    nothing of the new run stays and the earlier run is as it was.
    """
    place = _place(out)
    with _explained(place):
        place.parent.mkdir(parents=True, exist_ok=True)
        with _locked(place.parent):
            _refuse_foreign(place)
            _tidy_leftovers(place)
        partial = place.with_name(f".{place.name}.partial-{os.getpid()}")
        partial.mkdir()
        try:
            _write_texts(partial, files or {})
            _write_all(partial, config, world, trajectory, metrics, extras)
            with _locked(place.parent):
                _publish(partial, place)
        finally:
            shutil.rmtree(partial, ignore_errors=True)
    return place


def check_out(out: Path) -> Path:
    """Return the resolved ``out`` if a run may be written there, else raise ``ConfigError``.

    Meant to be called before a run, too, so that a long one does not end in a refusal.
    """
    place = _place(out)
    with _explained(place):
        _refuse_impossible(place)
        if place.parent.is_dir():
            with _locked(place.parent):
                _refuse_foreign(place)
    return place


def _refuse_impossible(place: Path) -> None:
    """Raise ``ConfigError`` where no folder can be made: in what is none, or in place of a link that leads nowhere."""
    if place.is_symlink():
        raise ConfigError(str(place), "is a link that leads nowhere, or in a circle")
    there = next(above for above in place.parents if os.path.lexists(above))
    if not there.is_dir():
        raise ConfigError(str(place), f"cannot be made: {there} is no folder")
    if not os.access(there, os.W_OK | os.X_OK):
        raise ConfigError(str(place), f"cannot be made: {there} may not be written to")


def check_same(out: Path, config: Mapping[str, Any]) -> None:
    """Raise a ``ConfigError`` with the first key that differs if there is the finished run of another scenario."""
    place = _place(out)
    if not (place / CONFIG).is_file():
        return
    there, here = plain(read_config(place)), plain(config)
    for key in dict.fromkeys([*there, *here]):
        if there.get(key) != here.get(key):
            raise ConfigError(str(place), f"holds another run ('{key}' differs): give another --out, or --force")


def read_metrics(run_dir: Path) -> dict[str, Any]:
    """Return the figures of a finished run; anything else raises ``InputFileError``."""
    return _read_json(_finished(run_dir) / METRICS)


def read_world(run_dir: Path) -> dict[str, Any]:
    """Return the world of a finished run; anything else raises ``InputFileError``."""
    return _read_json(_finished(run_dir) / WORLD)


def read_trajectory(run_dir: Path) -> dict[str, npt.NDArray[Any]]:
    """Return the arrays of a finished run; anything else raises ``InputFileError``."""
    return read_npz(_finished(run_dir) / TRAJECTORY)


def read_config(run_dir: Path) -> dict[str, Any]:
    """Return the scenario of a finished run; anything else raises ``InputFileError``."""
    path = _finished(run_dir) / CONFIG
    text = _read_text(path)
    if not text.endswith("\n" + YAML_END):
        raise InputFileError(path, "torn: the end mark is missing")
    try:
        return _as_mapping(path, load_yaml(text))
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        raise InputFileError(path, f"torn or foreign YAML ({type(error).__name__})") from None


def read_user_files(run_dir: Path) -> dict[str, str]:
    """Return the texts of the ``USER_FILES`` of a finished run; anything else raises ``InputFileError``."""
    folder = _finished(run_dir)
    return {name: _read_text(folder / name) for name in sorted(USER_FILES) if (folder / name).is_file()}


def _place(out: Path) -> Path:
    place = whole_path(out)
    if not place.name:
        raise ConfigError(str(place), "is not a place for a run folder")
    return place


def _refuse_foreign(place: Path) -> None:
    """Raise ``ConfigError`` unless there is nothing, an empty folder or a finished run at ``place``."""
    if not place.exists():
        return
    if not place.is_dir():
        raise ConfigError(str(place), "is a file; a run is written into a folder of its own")
    names = {entry.name for entry in place.iterdir() if not LEFTOVER.fullmatch(entry.name)}
    foreign = sorted(names - RUN_FILES - ASKED_FILES - USER_FILES)
    if foreign:
        raise ConfigError(
            str(place), f"holds '{foreign[0]}', which is no part of a run; refusing to overwrite it"
        )
    if names and not names >= REQUIRED:
        raise ConfigError(str(place), f"holds '{min(names)}' but no finished run; refusing to overwrite it")


def _write_texts(folder: Path, files: Mapping[str, str]) -> None:
    if not files.keys() <= USER_FILES:
        raise ValueError(f"{sorted(files.keys() - USER_FILES)}: a run folder holds {sorted(USER_FILES)}")
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def _write_all(
    folder: Path,
    config: Mapping[str, Any],
    world: Mapping[str, Any],
    trajectory: Mapping[str, npt.NDArray[Any]],
    metrics: Mapping[str, Any],
    extras: Callable[[Path], None] | None,
) -> None:
    (folder / CONFIG).write_text(_yaml_text(config), encoding="utf-8")
    (folder / WORLD).write_text(_json_text(world), encoding="utf-8")
    _write_npz(folder / TRAJECTORY, trajectory)
    (folder / METRICS).write_text(_json_text(metrics), encoding="utf-8")
    if extras is not None:
        extras(folder)  # pictures of a run whose data are complete; the folder itself is not in place yet
    names = {entry.name for entry in folder.iterdir()}
    odd = sorted(names - RUN_FILES - ASKED_FILES - USER_FILES)
    if odd:
        raise ValueError(f"extras wrote {odd}; a run folder holds {sorted(RUN_FILES | ASKED_FILES)}")
    for name in names:
        _sync(folder / name)
    _sync(folder)


def _write_npz(path: Path, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    """Write the arrays; the same arrays give the same bytes (sorted, C order, numpy's fixed date of 1980)."""
    plain = {name: np.asarray(arrays[name], order="C") for name in sorted(arrays)}
    for name, array in plain.items():
        if array.dtype.hasobject:
            raise ValueError(f"'{name}' holds Python objects; a run folder has no pickles")
    with path.open("wb") as file:
        np.savez_compressed(file, **cast("dict[str, Any]", plain))


def _json_text(data: Mapping[str, Any]) -> str:
    return json.dumps(plain(data, finite=True), sort_keys=True, indent=1, allow_nan=False) + "\n"


def _yaml_text(data: Mapping[str, Any]) -> str:
    return yaml.safe_dump(plain(data), sort_keys=False, allow_unicode=True, explicit_end=True)


def _publish(partial: Path, place: Path) -> None:
    """Rename ``partial`` to ``place``; an earlier run is moved aside first and comes back when that fails."""
    aside = place.with_name(f".{place.name}.old-{os.getpid()}")
    replaced = place.exists()
    if replaced:
        place.rename(aside)
    try:
        partial.rename(place)
    except BaseException:
        if replaced:
            aside.rename(place)
        raise
    with suppress(OSError):  # the run is in place; only its safety in a power cut is less sure
        _sync(place.parent)
    shutil.rmtree(aside, ignore_errors=True)


def _tidy_leftovers(place: Path) -> None:
    """Remove what killed writers left beside ``place``; a run that one had moved aside comes back first."""
    for kind in ("old", "partial"):
        for leftover in _leftovers(place, kind):
            if kind == "old" and not place.exists():
                leftover.rename(place)
            else:
                shutil.rmtree(leftover, ignore_errors=True)


def _leftovers(place: Path, kind: str) -> list[Path]:
    """Return the hidden siblings that no living writer owns; this process is only about to start writing."""
    pattern = re.compile(rf"\.{re.escape(place.name)}\.{kind}-(\d+)")
    matches = ((pattern.fullmatch(entry.name), entry) for entry in place.parent.iterdir())
    return sorted(entry for match, entry in matches if match and not _other_is_alive(int(match[1])))


def _other_is_alive(pid: int) -> bool:
    if pid == os.getpid():
        return False
    try:
        os.kill(pid, 0)
    except (ProcessLookupError, OverflowError):
        return False
    except PermissionError:
        return True
    return True


def _sync(path: Path) -> None:
    """Force a file or folder to the disk."""
    descriptor = os.open(path, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Let one writer at a time rename inside ``folder``; without locks on a file system that has none."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(descriptor, fcntl.LOCK_EX)
        yield
    finally:
        os.close(descriptor)


@contextmanager
def _explained(place: Path) -> Iterator[None]:
    """Turn a full disk, a missing permission and the like into an error that names the place."""
    try:
        yield
    except OSError as error:
        reason = "the disk is full" if error.errno == errno.ENOSPC else error.strerror or str(error)
        raise SwarmscopeError(
            f"{place}: cannot write the run: {reason}; an earlier run there is unchanged"
        ) from error


def _finished(run_dir: Path) -> Path:
    """Return ``run_dir`` if it holds a finished run."""
    folder = Path(run_dir)
    if not folder.is_dir():
        raise InputFileError(
            folder, "is a file, not a run folder" if folder.exists() else "no such run folder"
        )
    if not (folder / METRICS).is_file():
        raise InputFileError(folder, f"no finished run: it has no {METRICS}")
    for name in sorted(REQUIRED):
        path = folder / name
        if not path.is_file() or path.stat().st_size == 0:
            raise InputFileError(path, "is missing or empty: the run folder is torn")
    return folder


def _read_text(path: Path) -> str:
    return read_text(path, MOST_BYTES)


def _read_json(path: Path) -> dict[str, Any]:
    text = _read_text(path)
    try:
        return _as_mapping(path, json.loads(text))
    except (ValueError, OverflowError, RecursionError):
        raise InputFileError(path, "torn or foreign JSON") from None


def _as_mapping(path: Path, data: object) -> dict[str, Any]:
    if not isinstance(data, dict):
        raise InputFileError(path, "does not hold a table of keys and values: foreign")
    return data
