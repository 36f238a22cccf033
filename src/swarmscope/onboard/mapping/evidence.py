"""From scans to the map: what beams hit is set, what all beams over a near cell pass is cleared.

A wall that fills a part of a cell is hit from here and passed from there, and a robot whose map comes and goes with
that commutes. So a cell counts as passed only when every beam across it ends behind it, only near, and the less the
more often it has come back.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import point_segment_distance, rough_angle
from swarmscope.onboard.mapping.cells import (
    HALF_DIAGONAL,
    block_round,
    clear_cell,
    is_near,
    is_set,
    move_fine_layer,
    row_of,
    set_cell,
)
from swarmscope.onboard.mapping.memory import GONE, NEAR
from swarmscope.onboard.mapping.words import ZERO, Spot, bit, lowest, number, without_lowest
from swarmscope.onboard.percept import Row
from swarmscope.onboard.view import View

HIT, PASSED, MOST = 4, 4, 15
MOST_AGAIN = 3
"""As often as counts."""
SURE = 12
"""Of a cell that was seen before it came near."""
CLEARS_WITHIN_M = 2.0
MOST_RETURNS, RETURNS_S = 2, 120.0
"""A cell that was cleared so often within so long stays when it comes back."""
HIDDEN_M = 0.1
"""What is behind a hit is hidden when beams so far beside it do not get there either."""
CROWD = 5
"""Of so many neighbours in sight there may be more than are reported."""
BESIDE_M = 0.15
"""Returns so much farther or nearer than those beside them are of something else; what is wider than a robot by so much
is none."""
EVERY = 4
"""A cell is looked at for being passed in one tick of so many."""


@jit
def learn(see: View, memory: Row, cell_m: float, deep_m: float, cautious: bool) -> None:
    """Take this tick's scan into the map. Cells that close the way are noted in ``closed``, others gone in ``opened``.

    ``cautious``: a cell is cleared as `is_passed` and `_pass` say, else as soon as one beam goes through its middle.
    """
    shared, rig = see.shared, see.rig
    u, v = shared["x"] / cell_m, shared["y"] / cell_m
    here = Spot(u, v)
    move_fine_layer(memory, int(math.floor(u)), int(math.floor(v)))
    _move_near(memory, int(math.floor(u)), int(math.floor(v)))
    c, s = math.cos(see.percept["compass"]) / cell_m, math.sin(see.percept["compass"]) / cell_m
    first, last = 0, rig.sensor.beams - 1
    if rig.sensor.field > 0:
        first, last = shared["view_first"], shared["view_last"]
    was_x, was_y = -(2**40), -(2**40)
    told_m = _told_m(see)
    for n in range(first, last + 1):
        r = see.masked[n]
        if not (rig.sensor.range_min <= r < rig.sensor.range_max) or see.unseen[n] != 0:
            continue
        eu, ev = c * rig.cos[n] - s * rig.sin[n], s * rig.cos[n] + c * rig.sin[n]
        hu, hv = u + r * eu, v + r * ev
        ix, iy = int(math.floor(hu)), int(math.floor(hv))
        if (ix == was_x and iy == was_y) or _on_standing(memory, hu, hv, rig.footprint / cell_m):
            continue
        was_x, was_y = ix, iy
        if r > told_m and not (is_near(memory, ix, iy) and is_set(memory, ix, iy)) and _may_be_robot(see, n):
            continue
        _hit(memory, here, ix, iy)
        if deep_m > 0.0 and (r > CLEARS_WITHIN_M or _is_hidden(see, n, r + deep_m)):
            _hit(memory, here, int(math.floor(hu + deep_m * eu)), int(math.floor(hv + deep_m * ev)))
    _clear_passed(see, memory, cell_m, cautious)
    memory["ticks"] += 1


@jit_inner
def _told_m(see: View) -> float:
    """Return how far away [m] what is seen can be told from robots.

    Only the nearest are reported, and where many are in sight more may be: a guess, `CROWD`, since nobody counts them.
    """
    percept, far = see.percept, 0.0
    if percept["n_neighbours"] < CROWD:
        return math.inf
    for k in range(percept["n_neighbours"]):
        x, y = percept["neighbour_x"][k], percept["neighbour_y"][k]
        far = max(far, math.sqrt(x * x + y * y))
    return far - see.rig.guarding.others_largest_m


@jit_inner
def _may_be_robot(see: View, n: int) -> bool:
    """Tell whether what beam n hits is no wider than a robot, as far as returns lie close to one another."""
    wide, r = 0.0, see.masked[n]
    most = 2.0 * see.rig.guarding.others_largest_m + BESIDE_M
    for side in range(-1, 2, 2):
        k, here, there = n, r, True
        while there and wide <= most:
            k, there = _wrapped(see, k + side)
            if not there:
                break
            step = here * see.rig.sensor.increment
            there = see.unseen[k] == 0 and abs(see.masked[k] - here) < BESIDE_M
            here = see.masked[k]
            wide += step if there else 0.0
    return bool(wide <= most)


@jit_inline
def _is_hidden(see: View, n: int, r: float) -> bool:
    """Tell whether the place ``r`` away [m] along beam n lies behind what the beams on both sides of it hit, too.

    Else it may be beside the thing: behind a corner, or where the beam only grazes a wall.
    """
    aside = max(1, int(HIDDEN_M / (r * see.rig.sensor.increment)))
    return _ends_before(see, n - aside, r) and _ends_before(see, n + aside, r)


@jit_inline
def _ends_before(see: View, n: int, r: float) -> bool:
    """Tell whether something is hit before ``r`` [m] along beam n, which may lie beyond the first or the last."""
    n, there = _wrapped(see, n)
    return there and see.unseen[n] == 0 and bool(see.masked[n] < r)


@jit_inline
def _ends_behind(see: View, n: int, r: float) -> bool:
    """Tell whether nothing is hit before ``r`` [m] along beam n, as far as that is seen."""
    n, there = _wrapped(see, n)
    if not there or see.unseen[n] != 0 or not see.scan[n] >= r:
        return False
    return see.rig.sensor.field <= 0 or bool(see.shared["view_first"] <= n <= see.shared["view_last"])


@jit_inline
def _wrapped(see: View, n: int) -> tuple[int, bool]:
    """Return the beam that is meant by a number before the first or after the last, and whether there is one."""
    sensor = see.rig.sensor
    if sensor.wraps and n < 0:
        n += sensor.beams
    elif sensor.wraps and n >= sensor.beams:
        n -= sensor.beams
    return n, 0 <= n < sensor.beams


@jit_inner
def _on_standing(memory: Row, hu: float, hv: float, own: float) -> bool:
    """Tell whether a return [cells] may be that of a robot that stands."""
    for k in range(memory["stand_n"]):
        reach = memory["stand_r"][k] - own + 2.0
        if (hu - memory["stand_u"][k]) ** 2 + (hv - memory["stand_v"][k]) ** 2 < reach * reach:
            return True
    return False


@jit_inline
def _hit(memory: Row, here: Spot, ix: int, iy: int) -> None:
    """Count a hit in a cell; note it when that closes the way of a robot ``here``."""
    if not is_near(memory, ix, iy):
        block_round(memory, ix + 0.5, iy + 0.5)
        return
    known = is_set(memory, ix, iy)
    if abs(ix - memory["near_x"]) < NEAR // 2 and abs(iy - memory["near_y"]) < NEAR // 2:
        e = number(memory["evidence"][iy & (NEAR - 1), ix & (NEAR - 1)])
        again = e >> 4
        sure = HIT * (1 + again) + (e & 15 if known else 0)
        memory["evidence"][iy & (NEAR - 1), ix & (NEAR - 1)] = (again << 4) | (sure if sure < MOST else MOST)
    if not known:
        set_cell(memory, ix, iy)
        if closes(memory, here, Spot(ix + 0.5, iy + 0.5), memory["disc_r"][memory["way_room"]]):
            memory["closed"] = 1


@jit
def closes(memory: Row, here: Spot, there: Spot, room: float) -> bool:
    """Tell whether something at a place is in the way of a robot ``here`` that takes so much ``room`` [cells]."""
    au, av = here.u, here.v
    for k in range(memory["way_n"]):
        bu, bv = memory["way_u"][k], memory["way_v"][k]
        if point_segment_distance(there.u, there.v, au, av, bu, bv) < room:
            return True
        au, av = bu, bv
    return False


@jit
def _move_near(memory: Row, cx: int, cy: int) -> None:
    """Let the square of known evidence follow the robot to cell (cx, cy); what comes in is as the map has it."""
    if cx == memory["near_x"] and cy == memory["near_y"]:
        return
    dx, dy = cx - memory["near_x"], cy - memory["near_y"]
    memory["near_x"], memory["near_y"] = cx, cy
    half = NEAR // 2
    for k in range(min(NEAR, abs(dx))):
        ix = cx + half - 1 - k if dx > 0 else cx - half + k
        for iy in range(cy - half, cy + half):
            memory["evidence"][iy & (NEAR - 1), ix & (NEAR - 1)] = SURE if is_set(memory, ix, iy) else 0
    for k in range(min(NEAR, abs(dy))):
        iy = cy + half - 1 - k if dy > 0 else cy - half + k
        for ix in range(cx - half, cx + half):
            memory["evidence"][iy & (NEAR - 1), ix & (NEAR - 1)] = SURE if is_set(memory, ix, iy) else 0


@jit
def _clear_passed(see: View, memory: Row, cell_m: float, cautious: bool) -> None:
    """Look at some of the near cells in the map for whether all beams pass them."""
    u, v = see.shared["x"] / cell_m, see.shared["y"] / cell_m
    reach = min(NEAR // 2 - 1, int(CLEARS_WITHIN_M / cell_m))
    x0 = memory["near_x"] - reach
    mask = bit(2 * reach + 1) - bit(0)
    for iy in range(memory["near_y"] - reach, memory["near_y"] + reach + 1):
        if (iy + memory["ticks"]) % EVERY != 0:
            continue
        row = row_of(memory, x0, iy) & mask
        while row != ZERO:
            ix = x0 + lowest(row)
            row = without_lowest(row)
            du, dv = ix + 0.5 - u, iy + 0.5 - v
            if not cautious:
                if _is_crossed(see, du, dv, cell_m):
                    clear_cell(memory, ix, iy)
                    memory["opened"] = 1
            elif is_passed(see, du, dv, cell_m):
                _pass(memory, ix, iy, see.percept["now_s"])


@jit_inline
def is_passed(see: View, du: float, dv: float, cell_m: float) -> bool:
    """Tell whether every beam across the cell that lies (du, dv) [cells] from here ends behind it."""
    sensor = see.rig.sensor
    d = cell_m * math.sqrt(du * du + dv * dv)
    if d < see.rig.body.radius_m - HALF_DIAGONAL * cell_m:
        return True
    c, s = math.cos(see.percept["compass"]), math.sin(see.percept["compass"])
    x, y = c * du + s * dv, c * dv - s * du
    half = HALF_DIAGONAL * cell_m
    behind = d + half + 0.5 * cell_m + 3.0 * sensor.range_sigma * d
    if behind >= sensor.range_max:
        return False
    middle = (rough_angle(x, y + 1e-12) - sensor.angle_min) / sensor.increment
    wide = math.asin(min(1.0, half / max(d, half))) / sensor.increment
    for k in range(int(math.floor(middle - wide)), int(math.ceil(middle + wide)) + 1):
        if not _ends_behind(see, k, behind):
            return False
    return True


@jit_inner
def _is_crossed(see: View, du: float, dv: float, cell_m: float) -> bool:
    """Tell whether the beam through the middle of the cell that lies (du, dv) [cells] from here ends behind it."""
    c, s = math.cos(see.percept["compass"]), math.sin(see.percept["compass"])
    x, y = c * du + s * dv, c * dv - s * du
    sensor = see.rig.sensor
    n = int(round((rough_angle(x, y + 1e-12) - sensor.angle_min) / sensor.increment))
    behind = cell_m * (math.sqrt(du * du + dv * dv) + 0.5)
    return behind < sensor.range_max and _ends_behind(see, n, behind)


@jit_inner
def _pass(memory: Row, ix: int, iy: int, now: float) -> None:
    """Count that a cell was passed; it leaves the map when nothing is left of what speaks for it.

    One that has come back again and again stays: nobody is to go to and fro for it.
    """
    e = number(memory["evidence"][iy & (NEAR - 1), ix & (NEAR - 1)])
    again, sure = e >> 4, e & 15
    less = PASSED >> again
    sure -= less if less > 1 else 1
    if sure <= 0:
        sure, again = 0, again + 1 if again < MOST_AGAIN else again
        k = _gone(memory, ix, iy)
        if k >= 0 and memory["gone_n"][k] >= MOST_RETURNS and now - memory["gone_s"][k] < RETURNS_S:
            sure = MOST
        else:
            clear_cell(memory, ix, iy)
            _note_gone(memory, (ix, iy), k, now)
            memory["opened"] = 1
    memory["evidence"][iy & (NEAR - 1), ix & (NEAR - 1)] = (again << 4) | sure


@jit_inner
def _gone(memory: Row, ix: int, iy: int) -> int:
    """Return where it is noted that a cell has been cleared before, -1: nowhere."""
    for k in range(GONE):
        if memory["gone_x"][k] == ix and memory["gone_y"][k] == iy and memory["gone_n"][k] > 0:
            return k
    return -1


@jit_inner
def _note_gone(memory: Row, cell: tuple[int, int], k: int, now: float) -> None:
    """Note that a cell has been cleared, again if ``k`` says where that is noted."""
    if k < 0:
        k = memory["gone_at"] % GONE
        memory["gone_at"] += 1
        memory["gone_x"][k], memory["gone_y"][k], memory["gone_n"][k] = cell[0], cell[1], 0
    memory["gone_n"][k] = min(MOST_RETURNS, memory["gone_n"][k] + 1)
    memory["gone_s"][k] = now
