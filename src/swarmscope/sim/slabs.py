"""The free cells of an occupancy grid as slabs: rectangles that a lidar's beams cross from portal to portal.

A free run is a row's free cells between two that are not; a slab is a run together with the same runs straight above
it. Left and right of a slab is wall all along, or the grid's edge; below and above it other slabs begin where their
columns overlap with its own: the portals. Cells are counted from the grid's lower left corner.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from swarmscope._jit import jit, jit_inline

Bytes = npt.NDArray[np.uint8]
Indices = npt.NDArray[np.int32]

LEFT, BOTTOM, RIGHT, TOP = 0, 1, 2, 3
"""Columns of `Slabs.table`: the borders of a slab [cells]."""
ABOVE, BELOW = 4, 6
"""Columns of `Slabs.table`: where the slabs above and below begin in `Slabs.links`; where they end is the next one."""
MOST_SLABS = 1 << 22
"""Grids with more free runs have no slabs (a scan holds their numbers in float32, which is exact to 1 << 24)."""


class Slabs(NamedTuple):
    """The slabs of a grid with H rows; without a grid, and above `MOST_SLABS`, there are none."""

    row_start: Indices
    """(H + 1,) first free run of each row."""
    run_slab: Indices
    """(R,) to which slab each free run belongs; from left to right, row by row."""
    table: Indices
    """(S, 8) left, bottom, right, top [cells]; where in ``links`` those above begin and end, and those below."""
    links: Indices
    """(L,) the slabs above each one from right to left, and those below from left to right: counter-clockwise."""


def free_slabs(solid: Bytes) -> Slabs:
    """Return the slabs of the free cells of ``solid`` (H, W), in which 1 is solid; row 0 is at the bottom."""
    edges = np.diff(np.pad(solid == 0, ((0, 0), (1, 1))).view(np.int8), axis=1)
    rows, first = np.nonzero(edges == 1)
    if len(first) > MOST_SLABS:
        return free_slabs(solid[:0])
    row_start = np.searchsorted(rows, np.arange(len(solid) + 1)).astype(np.int32)
    runs = np.column_stack([first, np.nonzero(edges == -1)[1]]).astype(np.int32)
    run_slab, table = np.zeros(len(runs), np.int32), np.zeros((len(runs), 8), np.int32)
    count = _join_runs(row_start, runs, run_slab, table)
    links = np.zeros(4 * len(runs), np.int32)  # between two rows there are fewer portals than free runs in both
    used = _link_slabs(row_start, runs, run_slab, table, links)
    return Slabs(row_start, run_slab, table[:count].copy(), links[:used].copy())


@jit_inline
def slab_at(slabs: Slabs, row: int, col: int) -> int:
    """Return the slab of a free cell."""
    low, high = slabs.row_start[row], slabs.row_start[row + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if slabs.table[slabs.run_slab[middle], LEFT] <= col:
            low = middle
        else:
            high = middle
    return int(slabs.run_slab[low])


@jit
def _join_runs(row_start: Indices, runs: Indices, run_slab: Indices, table: Indices) -> int:
    """Fill ``run_slab`` and the borders in ``table``; return how many slabs there are.

    ``runs`` (R, 2) are first column and end of the free runs.
    """
    count = 0
    for row in range(row_start.shape[0] - 1):
        below = row_start[max(row - 1, 0)]
        for run in range(row_start[row], row_start[row + 1]):
            while below < row_start[row] and runs[below, 0] < runs[run, 0]:
                below += 1
            if below < row_start[row] and runs[below, 0] == runs[run, 0] and runs[below, 1] == runs[run, 1]:
                run_slab[run] = run_slab[below]
            else:
                run_slab[run] = count
                table[count, LEFT], table[count, BOTTOM], table[count, RIGHT] = runs[run, 0], row, runs[run, 1]
                count += 1
            table[run_slab[run], TOP] = row + 1
    return count


@jit
def _link_slabs(row_start: Indices, runs: Indices, run_slab: Indices, table: Indices, links: Indices) -> int:
    """Fill ``links`` and where those of each slab are in ``table``; return how many there are."""
    used = 0
    for row in range(1, row_start.shape[0] - 1):
        low, middle, high = row_start[row - 1], row_start[row], row_start[row + 1]
        other = high - 1
        for run in range(middle - 1, low - 1, -1):
            slab = run_slab[run]
            while other >= middle and runs[other, 0] >= runs[run, 1]:
                other -= 1
            if table[slab, TOP] == row:
                table[slab, ABOVE] = used
                above = other
                while above >= middle and runs[above, 1] > runs[run, 0]:
                    links[used] = run_slab[above]
                    used += 1
                    above -= 1
                table[slab, ABOVE + 1] = used
        other = low
        for run in range(middle, high):
            slab = run_slab[run]
            while other < middle and runs[other, 1] <= runs[run, 0]:
                other += 1
            if table[slab, BOTTOM] == row:
                table[slab, BELOW] = used
                below = other
                while below < middle and runs[below, 0] < runs[run, 1]:
                    links[used] = run_slab[below]
                    used += 1
                    below += 1
                table[slab, BELOW + 1] = used
    return used
