"""The mazes of ORION (github.com/marmotlab/ORION) from a ``.npz``, one grey value a cell.

``map`` (K,) numbers, ``true`` (K, rows, columns) uint8, row 0 at the top: 255 free, 127 wall, 208 + i the start and
50 + i the goal of robot i.
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from swarmscope.errors import ConfigError, InputFileError
from swarmscope.sim.maps.files import as_grid
from swarmscope.sim.maps.movingai import Trip
from swarmscope.sim.scan_files import read_npz
from swarmscope.sim.world import Grid

WALL, START, GOAL, MOST_ROBOTS = 127, 208, 50, 40


class Maze(NamedTuple):
    """A maze and its robots' trips, in the order of their numbers."""

    grid: Grid
    trips: list[Trip]


def load_maze(path: Path, number: int, resolution: float) -> Maze:
    """Return maze ``number`` with cells of ``resolution`` [m]. Errors: InputFileError, ConfigError."""
    arrays = read_npz(path)
    numbers, mazes = arrays.get("map"), arrays.get("true")
    if numbers is None or mazes is None:
        hint = "; worlds of BARN are for 'swarmscope barn'" if "centers_m" in arrays else ""
        raise InputFileError(path, "is no file of ORION's mazes: it has no 'map' and 'true'" + hint)
    if mazes.dtype != np.uint8 or mazes.ndim != 3 or 0 in mazes.shape or numbers.shape != mazes.shape[:1]:
        raise InputFileError(path, f"'true' is {mazes.dtype} {mazes.shape}; it must be uint8 (mazes, rows, columns)")
    found = np.flatnonzero(numbers == number)
    if not found.size:
        raise ConfigError("map.number", f"{path} has no maze {number}; it has {numbers.size}: {_some_of(numbers)}")
    cells = mazes[found[0]]
    return Maze(as_grid(path, cells[::-1] == WALL, resolution, (0.0, 0.0)), _trips_in(path, cells))


def _some_of(numbers: npt.NDArray[np.generic]) -> str:
    return ", ".join(map(str, numbers[:3].tolist())) + (", ..." if numbers.size > 3 else "")


def _trips_in(path: Path, cells: npt.NDArray[np.uint8]) -> list[Trip]:
    trips: list[Trip] = []
    for robot in range(MOST_ROBOTS):
        start, goal = np.argwhere(cells == START + robot), np.argwhere(cells == GOAL + robot)
        if not len(start) and not len(goal):
            break
        if len(start) != 1 or len(goal) != 1:
            raise InputFileError(path, f"robot {robot} has {len(start)} starts and {len(goal)} goals in this maze")
        (row, column), (goal_row, goal_column) = start[0].tolist(), goal[0].tolist()
        trips.append(Trip((column, row), (goal_column, goal_row)))
    return trips
