"""Who waits before a narrow place: whoever is not in it yet while somebody comes through, beside the others' way."""

from __future__ import annotations

import math
from typing import NamedTuple

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.cells import fits
from swarmscope.onboard.mapping.words import Spot
from swarmscope.onboard.percept import PEERS, Row
from swarmscope.onboard.sharing.tracks import moves
from swarmscope.onboard.view import View

OF_M = 0.15
"""Lengths here are for robots of this radius; for others they are larger in proportion."""
REACH_M = 2.5
"""Narrow places are looked for so far ahead."""
STEP_M, SIDE_M = 0.2, 0.125
"""Between the places on the way at which its width is looked at, and between those to its sides."""
ASIDE, NARROW_PLACES = 6, 6
"""So many places to either side of the way are looked at, up to the first that is not free; it is narrow where fewer of
them all are free than that. Who is to wait needs as many to the right."""
IN_M = 0.45
"""Who is so near to the middle of a narrow place is in it."""
TOWARDS_MPS = 0.1
FACES, HELD_S = -0.5, 30.0
"""Who faces against the way by an angle with less than this cosine, and has stood for less than so long, wants to come
through; who has stood for longer has parked."""
LANE_M, BEFORE_M = 0.75, 0.7
"""Who waits does so this far beside the way through, and no nearer to the narrow place."""
WITHIN_M = 0.15
"""Of both: who is so near to that stands."""


class Narrow(NamedTuple):
    """A narrow place on the way: where it is from the robot [m], compass frame, and where the way leads there."""

    x: float
    y: float
    dx: float
    dy: float
    far_m: float
    """Along the way; negative: there is none."""


@jit
def narrow_ahead(memory: Row, here: Spot, cell_m: float, size: float) -> Narrow:
    """Return the first narrow place on the way of a robot whose radius is ``size`` times `OF_M`."""
    step, side, reach = STEP_M * size, SIDE_M * size / cell_m, REACH_M * size
    au, av, gone = here.u, here.v, 0.0
    for k in range(memory["way_n"]):
        bu, bv = memory["way_u"][k], memory["way_v"][k]
        length = cell_m * math.sqrt((bu - au) ** 2 + (bv - av) ** 2)
        du, dv = (bu - au) * cell_m / max(1e-9, length), (bv - av) * cell_m / max(1e-9, length)
        at = 0.0
        while at < length and gone + at < reach:
            u, v = au + at / cell_m * du, av + at / cell_m * dv
            if _is_narrow(memory, u, v, -dv * side, du * side):
                return Narrow((u - here.u) * cell_m, (v - here.v) * cell_m, du, dv, gone + at)
            at += step
        gone += length
        if gone >= reach:
            break
        au, av = bu, bv
    return Narrow(0.0, 0.0, 1.0, 0.0, -1.0)


@jit_inner
def _is_narrow(memory: Row, u: float, v: float, nu: float, nv: float) -> bool:
    """Tell whether a place has little room to its sides, (nu, nv) being a step to the left [cells]."""
    count = 1
    for side in range(-1, 2, 2):
        for k in range(1, ASIDE + 1):
            if not fits(memory, u + side * k * nu, v + side * k * nv):
                break
            count += 1
            if count >= NARROW_PLACES:
                return False
    return True


@jit
def has_room_aside(memory: Row, here: Spot, place: Narrow, side: float) -> bool:
    """Tell whether a robot can get out of the way where it is: to the right, seen along the way through.

    ``side`` is a step [cells]: `SIDE_M` for a robot of `OF_M`.
    """
    nu, nv = place.dy * side, -place.dx * side
    free = 0
    while free < ASIDE and fits(memory, here.u + (free + 1) * nu, here.v + (free + 1) * nv):
        free += 1
    return free == ASIDE


@jit
def comes_through(see: View, place: Narrow, still_s: float) -> bool:
    """Tell whether somebody is in a narrow place and comes towards us, or wants to: stands there and faces us."""
    shared, size = see.shared, see.rig.body.radius_m / OF_M
    for t in range(PEERS):
        if shared["track_id"][t] < 0:
            continue
        x, y = shared["track_x"][t] - place.x, shared["track_y"][t] - place.y
        along, beside = x * place.dx + y * place.dy, x * place.dy - y * place.dx
        if not (abs(beside) < LANE_M * size and abs(along) < IN_M * size):
            continue
        if moves(see.percept, shared, t, still_s):
            towards = -(shared["track_vx"][t] * place.dx + shared["track_vy"][t] * place.dy)
            if towards > TOWARDS_MPS:
                return True
        elif moves(see.percept, shared, t, HELD_S):
            yaw = shared["track_yaw"][t]
            if math.cos(yaw) * place.dx + math.sin(yaw) * place.dy < FACES:
                return True
    return False


@jit_inline
def where_to_wait(place: Narrow, size: float) -> tuple[float, float]:
    """Return where to wait [m], from the robot, compass frame: to the right of the way through; 0, 0: right here."""
    lane, least, within = LANE_M * size, BEFORE_M * size, WITHIN_M * size
    before = place.x * place.dx + place.y * place.dy
    right = place.y * place.dx - place.x * place.dy  # so far to the right of the way through the robot is
    is_beside = before > least - within and (right > lane - within or right < -lane)
    if is_beside or before <= 0.0:  # or the way leads back there: no place on this side of it is beside that
        return 0.0, 0.0
    before = max(least, before)
    x = place.x - before * place.dx + lane * place.dy
    y = place.y - before * place.dy - lane * place.dx
    return x, y
