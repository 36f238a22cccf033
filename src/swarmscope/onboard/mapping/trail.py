"""Where the robot has been, and where it turned out not to get through: what the place layer says of less room.

A robot that came in through a gap which its map, to half a cell, does not have open would never find out again: where
its body has been less room does, whatever is seen there later.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inner
from swarmscope.onboard.mapping.cells import NODE, row_of
from swarmscope.onboard.mapping.pages import block, is_blocked, is_slim
from swarmscope.onboard.mapping.words import ONE, ZERO, bit, number
from swarmscope.onboard.percept import Row

BESIDE = 1.0
"""Who comes so near [cells] to the square round a node has passed it."""


@jit
def note_passed(memory: Row, u: float, v: float) -> None:
    """Note that the robot's body was at (u, v): whatever the map may say, less room than it takes does there."""
    for k in range(4):
        kx = int(math.floor(u + BESIDE * (2 * (k & 1) - 1))) // NODE
        ky = int(math.floor(v + BESIDE * (2 * (k >> 1) - 1))) // NODE
        if not is_slim(memory, kx, ky) and _is_something_near(memory, kx, ky):
            block(memory, kx, ky, True, True)


@jit
def close_round(memory: Row, u: float, v: float, r: float) -> None:
    """Take back that less room does at the nodes within ``r`` [cells] of a place."""
    for ky in range(int(math.floor(v - r)) // NODE, int(math.floor(v + r)) // NODE + 1):
        for kx in range(int(math.floor(u - r)) // NODE, int(math.floor(u + r)) // NODE + 1):
            if is_slim(memory, kx, ky):
                block(memory, kx, ky, is_blocked(memory, kx, ky), False)


@jit_inner
def _is_something_near(memory: Row, kx: int, ky: int) -> bool:
    """Tell whether so near to a node something stands that the place layer may have it blocked one day."""
    near, square = number(memory["disc_half"]) + NODE // 2, ZERO
    for iy in range(NODE * ky + 2 - near, NODE * ky + 2 + near):
        square |= row_of(memory, NODE * kx + 2 - near, iy)
    return bool(square & (bit(2 * near) - ONE))
