"""Task maze: corridors one cell wide round blocks, some of them closed, like the test mazes of ORION."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from swarmscope.bounds import Share
from swarmscope.sim.world import Obstacle, grid_from_solid
from swarmscope.tasks._check import check_setup
from swarmscope.tasks._contract import Amount, Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._rooms import Box
from swarmscope.tasks._trips import Floor, TripOptions, Ways, make_trips, on_random_tree, setup_on

NAME = "maze"
SUMMARY = "corridors one cell wide round blocks, some of the corridors closed, as in the mazes of ORION"
BLOCK_COLUMNS, BLOCK_ROWS = (1, 6), (1, 3)
"""Width and height of a block in cells: from, and below."""
CELLS_EACH = 4.0
"""Cells of corridor for a robot, at least."""
CORRIDOR = 0.4
"""Share of the cells that are corridor, about."""

Cells = NDArray[np.uint8]


@dataclass(frozen=True)
class MazeOptions(TripOptions):
    """Sizes and shares; the numbers of cells are ORION's."""

    ways: Ways = "any"
    columns: Amount = 33.0  # of cells, more for many robots
    rows: Amount = 30.0  # of cells, more for many robots
    cell_m: Length = 1.5  # side of a cell
    closed: Share = 0.25  # of the corridors between two crossings that may be closed
    cleared: Share = 0.1  # of the blocks: those that are open floor


OPTIONS = MazeOptions


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a maze and trips in it; options are the fields of `MazeOptions`."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    rng = np.random.default_rng(seed)
    cells = chosen.columns * chosen.rows
    grow = math.sqrt(max(1.0, CELLS_EACH * robots / max(1.0, CORRIDOR * cells)))
    columns, rows = (max(7, math.ceil(count * grow - 1e-9)) for count in (chosen.columns, chosen.rows))
    solid, side = _maze(rng, columns, rows, chosen), chosen.cell_m
    inside = solid[1:-1, 1:-1]  # the walls round it are the floor's
    obstacles: list[Obstacle] = [grid_from_solid(inside, side, (0.0, 0.0))] if inside.any() else []
    width, height = side * (columns - 2), side * (rows - 2)
    rooms: list[Box] = [
        (side * j, side * i, side * (j + 1), side * (i + 1)) for i, j in np.argwhere(inside == 0).tolist()
    ]
    left, right = (0.0, 0.0, side, height), (width - side, 0.0, width, height)
    floor = Floor(obstacles, left, right, rooms)
    setup = setup_on(floor, *make_trips(rng, floor, robots, radius, chosen))
    check_setup(setup, radius)
    return setup


def _maze(rng: np.random.Generator, columns: int, rows: int, chosen: MazeOptions) -> Cells:
    """Return the cells (rows, columns), 1 where they are solid: corridors in lines, blocks between them."""
    across, up = _lines(rng, columns, BLOCK_COLUMNS), _lines(rng, rows, BLOCK_ROWS)
    solid = np.ones((rows, columns), np.uint8)
    solid[np.ix_(up, range(1, columns - 1))] = 0
    solid[np.ix_(range(1, rows - 1), across)] = 0
    for i in range(len(up) - 1):
        for j in range(len(across) - 1):
            if rng.random() < chosen.cleared:
                solid[up[i] : up[i + 1], across[j] : across[j + 1]] = 0
    ways = _stretches(across, up)
    on_tree = on_random_tree(rng, np.array([way[:2] for way in ways]))
    may_close = ~on_tree & (rng.random(len(ways)) < chosen.closed)
    for (_, _, rows_of, columns_of, is_rim), closes in zip(ways, may_close, strict=True):
        if closes and not is_rim:
            solid[rows_of, columns_of] = 1
    return solid


def _lines(rng: np.random.Generator, cells: int, block: tuple[int, int]) -> list[int]:
    """Return which rows or columns are corridors: the first, the last, and some between."""
    found, last = [1], cells - 2
    while True:
        following = found[-1] + 1 + int(rng.integers(*block))
        if following >= last - block[0]:
            break
        found.append(following)
    return [*found, last]


def _stretches(across: list[int], up: list[int]) -> list[tuple[int, int, slice, slice, bool]]:
    """Return the corridors between crossings: both crossings, their cells, and whether they run along the rim."""
    found = []
    for i, row in enumerate(up):
        for j, column in enumerate(across):
            here = i * len(across) + j
            if j + 1 < len(across):
                cells = slice(row, row + 1), slice(column + 1, across[j + 1])
                found.append((here, here + 1, *cells, i in (0, len(up) - 1)))
            if i + 1 < len(up):
                cells = slice(row + 1, up[i + 1]), slice(column, column + 1)
                found.append((here, here + len(across), *cells, j in (0, len(across) - 1)))
    return found
