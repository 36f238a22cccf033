"""The worlds of the benchmark from files: a folder of the challenge's own, or one ``.npz``.

======================  =============================================================================
folder                  ``world_N.world``, here or in ``world_files/``; optional ``path_N.npy``, here or in
                        ``path_files/``: the cells (P, 2) of a way through the clutter
``.npz``                ``world (W,)`` numbers, ``offsets (W + 1,)`` into ``centers_m (K, 2)``, ``radius_m``,
                        ``start`` (x, y, yaw), ``goal`` (x, y), ``path_length_m (W,)``
======================  =============================================================================
"""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.barn.world_file import read_world_file
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.sim.scan_files import read_npz
from swarmscope.texts import check_regular

START = (-2.25, 3.0, 0.5 * math.pi)
"""Where the robot starts: x, y [m], yaw [rad] (the challenge writes 1.57)."""
GOAL = (-2.25, 13.0)
"""10 m ahead [m]."""
CELL_M, CELLS = 0.15, 30
"""The ways of the challenge lie on a grid: side of a cell [m], and columns."""
FIRST_ROW_M = 5.0
"""Lower edge of the grid's first row [m]."""
DIGITS = 6
"""Positions are read to the micrometre, as world files hold them, so that both kinds of files give the same worlds."""
MOST_PATH_BYTES = 1 << 20
WORLD_NAME = re.compile(r"world_(\d+)\.world")

Floats = NDArray[np.float64]


class BarnWorld(NamedTuple):
    """One world: what stands in it, and where the robot shall go."""

    number: int
    discs: Floats
    """(K, 3) x, y, radius [m]."""
    start: tuple[float, float, float]
    """x, y [m], yaw [rad]."""
    goal: tuple[float, float]
    """x, y [m]."""
    path_m: float
    """Length of the challenge's own way [m], NaN where there is no file with it."""


class Worlds(NamedTuple):
    """Worlds that are read when they are asked for."""

    numbers: list[int]
    read: Callable[[int], BarnWorld]
    """Returns the world of a number. Errors: InputFileError."""


def find_worlds(place: Path) -> Worlds:
    """Return the worlds of a folder or of a ``.npz``. Errors: InputFileError."""
    return _in_folder(place) if place.is_dir() else _in_npz(place)


def chosen(numbers: list[int], asked: list[int], every: int) -> list[int]:
    """Return every ``every``-th of the numbers ``asked``, or of all; a ConfigError names one that is not there."""
    missing = sorted(set(asked) - set(numbers))
    if missing:
        raise ConfigError("--worlds", f"there is no world {missing[0]}; there are {len(numbers)}, {_span(numbers)}")
    wanted = set(asked or numbers)
    return [number for number in numbers if number in wanted][::every]


def _span(numbers: list[int]) -> str:
    return f"{numbers[0]} to {numbers[-1]}"


def _in_folder(folder: Path) -> Worlds:
    inner = folder / "world_files"
    files = {}
    for file in sorted((inner if inner.is_dir() else folder).iterdir()):
        match = WORLD_NAME.fullmatch(file.name)
        if match:
            files[int(match[1])] = file
    if not files:
        raise InputFileError(folder, "holds no world_N.world, neither itself nor in world_files/")
    return Worlds(sorted(files), lambda number: _from_files(number, files[number], folder))


def _from_files(number: int, file: Path, folder: Path) -> BarnWorld:
    discs = read_world_file(file).round(DIGITS)
    paths = (folder / place / f"path_{number}.npy" for place in (".", "path_files", "../path_files"))
    found = next((path for path in paths if path.exists()), None)
    return BarnWorld(number, discs, START, GOAL, math.nan if found is None else read_path_m(found))


def read_path_m(file: Path) -> float:
    """Return the length [m] of the challenge's way: from the start through its cells to the goal."""
    check_regular(file, MOST_PATH_BYTES)
    try:
        with warnings.catch_warnings(action="ignore"), file.open("rb") as opened:
            cells = np.lib.format.read_array(opened, allow_pickle=False)
    except OSError as error:
        raise InputFileError(file, error.strerror or "cannot be read") from None
    except Exception as error:  # damaged files make numpy raise a dozen unrelated types
        raise InputFileError(file, f"torn, or no .npy with numbers ({str(error).partition(chr(10))[0]})") from None
    if cells.ndim != 2 or cells.shape[1] != 2 or cells.dtype.kind not in "iuf" or not np.isfinite(cells).all():
        raise InputFileError(file, f"must hold the cells (P, 2) of a way, not {cells.dtype} {cells.shape}")
    ways = np.vstack([START[:2], metres(cells.astype(float)), GOAL])
    return float(np.hypot(*np.diff(ways, axis=0).T).sum())


def metres(cells: Floats) -> Floats:
    """Return the middles x, y [m] of the challenge's cells (P, 2) column, row."""
    half = 0.5 * CELL_M
    return np.asarray(cells * CELL_M + (-half - CELLS * CELL_M, half + FIRST_ROW_M))


def _in_npz(file: Path) -> Worlds:
    arrays = read_npz(file)
    take = partial(_numbers, arrays, file)
    numbers = _whole(take("world", 1, None), file, "world")
    count = len(numbers)
    if not count or len(set(numbers)) != count:
        raise InputFileError(file, "'world' must hold a number for each world, none twice")
    centres = take("centers_m", 2, None)
    offsets = _whole(take("offsets", 1, count + 1), file, "offsets")
    if centres.shape[1] != 2 or sorted(offsets) != offsets or (offsets[0], offsets[-1]) != (0, len(centres)):
        raise InputFileError(file, "'offsets' must rise from 0 to the number of rows of 'centers_m' (K, 2)")
    radius = float(take("radius_m", 0, None))
    lengths = take("path_length_m", 1, count)
    if not (radius > 0.0 and np.all(lengths > 0.0)):
        raise InputFileError(file, "'radius_m' and 'path_length_m' must be more than 0")
    x, y, yaw = take("start", 1, 3).tolist()
    goal_x, goal_y = take("goal", 1, 2).tolist()
    place = {number: k for k, number in enumerate(numbers)}

    def read(number: int) -> BarnWorld:
        k = place[number]
        standing = centres[offsets[k] : offsets[k + 1]].round(DIGITS)
        discs = np.column_stack([standing, np.full(len(standing), radius)])
        return BarnWorld(number, discs, (x, y, yaw), (goal_x, goal_y), float(lengths[k]))

    return Worlds(sorted(numbers), read)


def _numbers(arrays: Mapping[str, NDArray[Any]], file: Path, key: str, axes: int, length: int | None) -> Floats:
    """Return an array of finite numbers by its key; an InputFileError says what is wrong with it."""
    if key not in arrays:
        raise InputFileError(file, f"has no '{key}'")
    found = arrays[key]
    if found.dtype.kind not in "iuf" or found.ndim != axes or (length is not None and len(found) != length):
        need = f"{axes} axes" + ("" if length is None else f" and {length} entries")
        raise InputFileError(file, f"'{key}' is {found.dtype} {found.shape}; it must be numbers with {need}")
    if not np.isfinite(found).all():
        raise InputFileError(file, f"'{key}' holds NaN or infinity")
    return found.astype(np.float64)


def _whole(values: Floats, file: Path, key: str) -> list[int]:
    if np.any(values != np.floor(values)) or np.any(values < 0.0):
        raise InputFileError(file, f"'{key}' must hold whole numbers from 0 up")
    return [int(value) for value in values]
