"""The Moving AI benchmarks: maps of characters, and scenario files of trips."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from swarmscope.errors import ConfigError, InputFileError
from swarmscope.sim.maps.files import as_grid, check_size
from swarmscope.sim.world import Grid
from swarmscope.texts import read_text

MOVINGAI_FREE, MOVINGAI_BLOCKED = ".GS", "@OTW"


class Trip(NamedTuple):
    """A start and a goal of a scenario file, cells (column, row), row 0 at the top."""

    start: tuple[int, int]
    goal: tuple[int, int]
    size: tuple[int, int] | None = None
    """Columns and rows of the map that it is for, where the file says it."""


def load_movingai(path: str | Path, resolution: float = 1.0) -> Grid:
    """Read a Moving AI ``.map`` (type octile), first row at the top.

    '.', 'G', 'S' are free, '@', 'O', 'T', 'W' solid. One character becomes one cell of ``resolution``
    [m]; the lower left corner of the map is (0, 0).
    """
    path = Path(path)
    lines = read_text(path).splitlines()
    header = dict(zip(("type", "height", "width"), lines[:3], strict=False))
    sizes = {}
    for number, (key, line) in enumerate(header.items(), start=1):
        words = line.split()
        if len(words) != 2 or words[0] != key or (key != "type" and not words[1].isdecimal()):
            raise InputFileError(path, f"line {number}: expected '{key} ...', got {line[:40]!r}")
        sizes[key] = words[1]
    if len(lines) < 4 or sizes["type"] != "octile" or lines[3].strip() != "map":
        raise InputFileError(path, "not a Moving AI map: expected 'type octile', 'height', 'width', 'map'")
    height, width = int(sizes["height"]), int(sizes["width"])
    check_size(path, width, height)
    rows = [line.rstrip() for line in lines[4:]]
    while rows and not rows[-1]:
        rows.pop()
    if len(rows) != height:
        raise InputFileError(path, f"the header says {height} rows, the map has {len(rows)}")
    for number, row in enumerate(rows, start=5):
        strange = set(row) - set(MOVINGAI_FREE + MOVINGAI_BLOCKED)
        if len(row) != width or strange:
            why = f"unknown terrain {sorted(strange)}" if strange else f"{len(row)} cells instead of {width}"
            raise InputFileError(path, f"line {number}: {why}")
    solid = np.array([[cell in MOVINGAI_BLOCKED for cell in row] for row in reversed(rows)])
    return as_grid(path, solid.reshape(height, width), resolution, (0.0, 0.0))


def load_trips(path: str | Path) -> list[Trip]:
    """Read a Moving AI ``.scen`` file: trips in the order of their lines. Errors: InputFileError."""
    path = Path(path)
    lines = read_text(path).splitlines()
    if not lines or lines[0].split()[:1] != ["version"]:
        raise InputFileError(path, "not a Moving AI scenario: expected 'version 1' in the first line")
    trips = []
    for number, line in enumerate(lines[1:], start=2):
        words = line.split()
        if not words:
            continue
        cells = words[-7:-1]
        if len(words) < 9 or not all(word.isascii() and word.isdecimal() for word in cells):
            raise InputFileError(path, f"line {number}: expected bucket, map, width, height, start, goal, length")
        columns, rows, x, y, goal_x, goal_y = map(int, cells)
        trips.append(Trip((x, y), (goal_x, goal_y), (columns, rows)))
    return trips


def place_of(cell: tuple[int, int], grid: Grid) -> tuple[float, float]:
    """Return the middle of a cell (column, row), row 0 at the top [m]. Errors: ConfigError for one off the map."""
    column, row = cell
    if not (0 <= column < grid.width and 0 <= row < grid.height):
        raise ConfigError("map.trips", f"cell {cell} is not on the map of {grid.width} x {grid.height} cells")
    (x, y), side = grid.origin, grid.resolution
    return x + (column + 0.5) * side, y + (grid.height - row - 0.5) * side


def check_trips(path: Path, trips: list[Trip], grid: Grid) -> None:
    """Raise a ConfigError for trips on a map of another size."""
    here = (grid.width, grid.height)
    other = next((trip.size for trip in trips if trip.size not in (None, here)), None)
    if other is not None:
        columns, rows = other
        why = f"{path} is for a map of {columns} x {rows} cells, and this one has {here[0]} x {here[1]}"
        raise ConfigError("map.trips", why)
