"""Shortest ways among discs, exactly: straight lines and arcs (no grid).

A robot of radius r among obstacles of radius R is a point among discs of radius rho = R + r, which may overlap;
a shortest way leaves and meets discs along tangents and follows arcs between. ``build`` finds all free tangents
of some maps once; ``add_goals`` the cost from each of them to each goal; ``look_up`` answers for a point how far
it is to a goal and which way to go, in well under a microsecond for a handful of discs.

A *slot* is one way round a disc: ``2 * disc`` counter-clockwise, ``2 * disc + 1`` clockwise. A *node* is the point
where a free tangent to another disc leaves a slot; nodes of a slot are sorted in the sense of travel.

A start or a goal may lie inside discs: who stands a rounding error too deep, or in a margin that is used up, can
still leave, and who is to go there still arrives. Both ends are treated alike, so a way is as long there as back.
While a way is straight towards or from an end, a disc that holds this end counts as shrunk until it touches it. A
way that goes round the disc itself begins or ends beside the point on its rim, and the distance between the two is
not counted: such a way may be shorter than the straight line by the depths of its ends.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_alloc, jit_inline, jit_inner
from swarmscope.disk.contact import nearest_on_the_way
from swarmscope.disk.rules import ROUNDING, Floats, Ints
from swarmscope.geometry import angle_from, positive_angle

TWO_PI = 2.0 * math.pi
TOUCH = 1e-9
"""A way may come that much nearer to a disc than its radius: tangents touch."""


class Ways(NamedTuple):
    """Tangents of all maps and costs of all goals, as flat arrays that kernels take."""

    disc_start: Ints
    """(maps + 1,): discs of map k are rows disc_start[k] to disc_start[k + 1] of ``disc``."""
    disc: Floats
    """(discs, 3): x, y, rho."""
    slot_start: Ints
    """(2 discs + 1,): nodes of a slot."""
    node_angle: Floats
    """(nodes,): angle on the disc at which the tangent leaves [rad]."""
    node_length: Floats
    node_to: Ints
    """(nodes,): slot at which the tangent arrives."""
    node_to_angle: Floats
    block_start: Ints
    """(2 discs + 1,): blocks of a slot."""
    block_angle: Floats
    """(blocks,): angles at which going on along the slot would enter another disc or leave the workspace."""
    field_map: Ints
    """(fields,): the map of a goal."""
    field_goal: Floats
    """(fields, 2)."""
    field_node: Ints
    """(fields,): where the costs of this goal begin in ``cost``; they are in the order of the map's nodes."""
    field_slot: Ints
    """(fields,): where the slots of this goal begin in ``last_angle`` and ``last_length``."""
    cost: Floats
    """From a node on, travelling along its slot and leaving at the best place: length to the goal."""
    last_angle: Floats
    """Angle at which the tangent to the goal leaves a slot, NaN where none is free."""
    last_length: Floats
    last_clear: Floats
    """How far [rad] before ``last_angle`` one may have entered what bars the slot: above 0 for goals in discs only."""
    goal_depth: Floats
    """(fields,): how deep a goal lies in a disc at most."""


@jit_inline
def segment_is_free(ways: Ways, which: int, ax: float, ay: float, bx: float, by: float, one: int, two: int) -> bool:
    """Return whether a-b passes all discs of map ``which`` but ``one`` and ``two``.

    A disc that holds ``a`` counts as shrunk until it touches it: who stands a rounding error too deep, or has
    been given a margin that is used up, can still leave.
    """
    for c in range(ways.disc_start[which], ways.disc_start[which + 1]):
        if c in (one, two):
            continue
        x, y, rho = ways.disc[c, 0], ways.disc[c, 1], ways.disc[c, 2]
        px, py = ax - x, ay - y
        rho = min(rho, math.sqrt(px * px + py * py)) - TOUCH
        if nearest_on_the_way(px, py, bx - x, by - y) < rho:
            return False
    return True


@jit_inline
def _ends_see_each_other(ways: Ways, which: int, ax: float, ay: float, bx: float, by: float) -> bool:
    """Return whether the straight way from a start to a goal passes all discs, those that hold an end shrunk."""
    for c in range(ways.disc_start[which], ways.disc_start[which + 1]):
        px, py = ax - ways.disc[c, 0], ay - ways.disc[c, 1]
        qx, qy = bx - ways.disc[c, 0], by - ways.disc[c, 1]
        near = nearest_on_the_way(px, py, qx, qy)
        rho = min(ways.disc[c, 2], math.sqrt(px * px + py * py))
        if near < rho - TOUCH and near < math.sqrt(qx * qx + qy * qy) - TOUCH:
            return False
    return True


@jit_inner
def _clear_run(ways: Ways, slot: int, angle: float) -> float:
    """Return how far [rad] one can travel along ``slot`` from ``angle`` until something is in the way."""
    least = TWO_PI
    for k in range(ways.block_start[slot], ways.block_start[slot + 1]):
        turn = _turn(slot, angle, ways.block_angle[k])
        least = min(least, turn)
    return least


@jit_inner
def _turn(slot: int, start: float, end: float) -> float:
    """Return the angle [rad, 0 to 2 pi] from start to end in the sense of the slot; a hair back counts as none."""
    turn = angle_from(start, end) if slot % 2 == 0 else angle_from(end, start)
    return 0.0 if turn > TWO_PI - 1e-9 else turn


@jit_inner
def _by_last_tangent(ways: Ways, field: int, slot: int, angle: float, clear: float) -> tuple[float, float]:
    """Return the cost for who goes along ``slot`` until the tangent to the goal, and how far that is [rad].

    ``clear`` is how far one can go [rad]. Cost infinity if there is no tangent or one cannot go that far.
    """
    local = slot - 2 * ways.disc_start[ways.field_map[field]] + ways.field_slot[field]
    if ways.last_angle[local] != ways.last_angle[local]:
        return math.inf, 0.0
    turn = _turn(slot, angle, ways.last_angle[local])
    if turn > clear + ways.last_clear[local]:
        return math.inf, turn
    return turn * ways.disc[slot // 2, 2] + ways.last_length[local], turn


@jit_inner
def _along_slot(ways: Ways, field: int, slot: int, angle: float) -> float:
    """Return the cost to the goal for who arrives on ``slot`` at ``angle``, infinity if there is no way on."""
    which = ways.field_map[field]
    rho = ways.disc[slot // 2, 2]
    clear = _clear_run(ways, slot, angle) + 1e-9
    least, _ = _by_last_tangent(ways, field, slot, angle, clear)
    first, end = ways.slot_start[slot], ways.slot_start[slot + 1]
    if end > first:
        node = _next_node(ways, slot, angle)
        turn = _turn(slot, angle, ways.node_angle[node])
        if turn <= clear:
            offset = ways.field_node[field] - ways.slot_start[2 * ways.disc_start[which]]
            least = min(least, turn * rho + ways.cost[offset + node])
    return least


@jit_inner
def _next_node(ways: Ways, slot: int, angle: float) -> int:
    """Return the first node at or after ``angle`` in the sense of travel."""
    first, end = ways.slot_start[slot], ways.slot_start[slot + 1]
    best, least = int(first), math.inf
    for k in range(first, end):
        turn = _turn(slot, angle, ways.node_angle[k])
        if turn < least:
            best, least = k, turn
    return best


@jit_inline
def look_up(ways: Ways, field: int, x: float, y: float) -> tuple[float, float, float, int]:
    """Return the length of the shortest way from a point to a goal, its first direction, and the slot it makes for.

    The direction is a unit vector; the slot is -1 on the straight way to the goal. Length infinity and direction
    0 where there is no way. The point and the goal may lie in discs (see the top of this file).
    """
    which = ways.field_map[field]
    gx, gy = ways.field_goal[field, 0], ways.field_goal[field, 1]
    ux, uy = gx - x, gy - y
    straight = math.sqrt(ux * ux + uy * uy)
    if _ends_see_each_other(ways, which, x, y, gx, gy):
        if straight == 0.0:
            return 0.0, 0.0, 0.0, -1
        return straight, ux / straight, uy / straight, -1
    least, dx, dy, chosen = math.inf, 0.0, 0.0, -1
    for c in range(ways.disc_start[which], ways.disc_start[which + 1]):
        px, py = ways.disc[c, 0] - x, ways.disc[c, 1] - y
        apart = math.sqrt(px * px + py * py)
        rho = min(ways.disc[c, 2], apart)
        length = math.sqrt(max(0.0, apart * apart - rho * rho))
        if length >= least or apart == 0.0:
            continue
        not_counted = (ways.disc[c, 2] - rho) + ways.goal_depth[field]
        for side in range(2):
            cost, tx, ty = _by_tangent(
                ways, field, 2 * c + side, x, y, px / apart, py / apart, rho / apart, length, least + not_counted
            )
            if cost < least:
                least, dx, dy, chosen = cost, tx, ty, 2 * c + side
    return least, dx, dy, chosen


@jit_inline
def straight_part(ways: Ways, slot: int, x: float, y: float) -> float:
    """Return how long the way from (x, y) stays straight that makes for ``slot``."""
    px, py, rho = ways.disc[slot // 2, 0] - x, ways.disc[slot // 2, 1] - y, ways.disc[slot // 2, 2]
    return math.sqrt(max(0.0, px * px + py * py - rho * rho))


@jit_inner
def _by_tangent(
    ways: Ways,
    field: int,
    slot: int,
    x: float,
    y: float,
    px: float,
    py: float,
    sine: float,
    length: float,
    known: float,
) -> tuple[float, float, float]:
    """Return cost and direction of the way by the tangent to ``slot``; p is the unit vector to the disc's centre.

    Infinity for a way that is not free, or cannot be shorter than ``known``.
    """
    dx, dy = _towards(slot, px, py, sine)
    ex, ey = x + dx * length, y + dy * length
    if ex * ex + ey * ey > 1.0 + 3.0 * ROUNDING:
        return math.inf, dx, dy
    gx, gy = ways.field_goal[field, 0] - ex, ways.field_goal[field, 1] - ey
    if length + math.sqrt(gx * gx + gy * gy) >= known:
        return math.inf, dx, dy
    c = slot // 2
    if not segment_is_free(ways, ways.field_map[field], x, y, ex, ey, c, -1):
        return math.inf, dx, dy
    if length < TOUCH and _leads_into_another(ways, ways.field_map[field], x, y, dx, dy, c):
        return math.inf, dx, dy
    angle = positive_angle(math.atan2(ey - ways.disc[c, 1], ex - ways.disc[c, 0]))
    return length + _along_slot(ways, field, slot, angle), dx, dy


@jit_inner
def _towards(slot: int, px: float, py: float, sine: float) -> tuple[float, float]:
    """Return the direction in which one makes for ``slot``; p is the unit vector to the disc's centre.

    ``sine`` is that of the angle between the two.
    """
    sense = 1.0 if slot % 2 == 0 else -1.0
    cosine = math.sqrt(max(0.0, 1.0 - sine * sine))
    # With the disc on the left (counter-clockwise) one passes it on the right of the line to its centre.
    return px * cosine + py * sine * sense, py * cosine - px * sine * sense


@jit_inner
def _is_free(discs: Floats, row: Floats) -> bool:
    """Return whether a tangent touches no third disc and stays in the workspace."""
    a, b = int(row[0]) // 2, int(row[3]) // 2
    ax = discs[a, 0] + discs[a, 2] * math.cos(row[1])
    ay = discs[a, 1] + discs[a, 2] * math.sin(row[1])
    bx = discs[b, 0] + discs[b, 2] * math.cos(row[4])
    by = discs[b, 1] + discs[b, 2] * math.sin(row[4])
    if max(ax * ax + ay * ay, bx * bx + by * by) > 1.0 + 3.0 * ROUNDING:
        return False
    for c in range(len(discs)):
        if c in (a, b):
            continue
        x, y = discs[c, 0], discs[c, 1]
        if nearest_on_the_way(ax - x, ay - y, bx - x, by - y) < discs[c, 2] - TOUCH:
            return False
    return True


@jit_inner
def _leads_into_another(ways: Ways, which: int, x: float, y: float, dx: float, dy: float, own: int) -> bool:
    """Return whether who stands in another disc, too, would go deeper into it in direction d."""
    for c in range(ways.disc_start[which], ways.disc_start[which + 1]):
        px, py, rho = ways.disc[c, 0] - x, ways.disc[c, 1] - y, ways.disc[c, 2] - TOUCH
        if c != own and px * px + py * py < rho * rho and px * dx + py * dy > 0.0:
            return True
    return False


@jit_alloc
def _tangents(discs: Floats) -> Floats:
    """Return the free tangents (k, 5) between discs: slot, angle, length, slot, angle."""
    m = len(discs)
    rows = np.empty((4 * m * max(m - 1, 0), 5))
    count = 0
    for a in range(m):
        for b in range(m):
            ux, uy = discs[b, 0] - discs[a, 0], discs[b, 1] - discs[a, 1]
            apart = math.sqrt(ux * ux + uy * uy)
            if a == b or apart == 0.0:
                continue
            for first in range(2):
                for second in range(2):
                    s, t = 1.0 - 2.0 * first, 1.0 - 2.0 * second
                    sine = (t * discs[b, 2] - s * discs[a, 2]) / apart
                    if abs(sine) > 1.0:
                        continue  # discs that overlap have no crossing tangents, one inside another none at all
                    heading = math.atan2(uy, ux) - math.asin(sine)
                    rows[count, 0] = 2 * a + first
                    rows[count, 1] = positive_angle(heading - s * math.pi / 2)
                    rows[count, 2] = apart * math.sqrt(1.0 - sine * sine)
                    rows[count, 3] = 2 * b + second
                    rows[count, 4] = positive_angle(heading - t * math.pi / 2)
                    if _is_free(discs, rows[count]):
                        count += 1
    return rows[:count]


@jit_alloc
def _blocks(discs: Floats) -> Floats:
    """Return (k, 2): slot and angle at which travelling along it would enter another disc or leave the workspace."""
    m = len(discs)
    rows = np.empty((2 * m * (m + 1), 2))
    count = 0
    for a in range(m):
        for c in range(m + 1):
            if c == a:
                continue
            # The workspace is a disc of radius 1, of which the outside is barred.
            outside = c == m
            x, y, rho = (0.0, 0.0, 1.0) if outside else (discs[c, 0], discs[c, 1], discs[c, 2])
            ux, uy = x - discs[a, 0], y - discs[a, 1]
            apart = math.sqrt(ux * ux + uy * uy)
            if apart == 0.0:
                continue
            cosine = (apart * apart + discs[a, 2] ** 2 - rho * rho) / (2.0 * apart * discs[a, 2])
            if abs(cosine) >= 1.0:
                continue
            half, middle = math.acos(cosine), math.atan2(uy, ux)
            if outside:
                half, middle = math.pi - half, middle + math.pi
            rows[count, 0], rows[count, 1] = 2 * a, positive_angle(middle - half)
            rows[count + 1, 0], rows[count + 1, 1] = 2 * a + 1, positive_angle(middle + half)
            count += 2
    return rows[:count]


def build(maps: Sequence[Floats], margins: Sequence[float] | float) -> Ways:
    """Return the tangents of maps, each an array (m, 3) of x, y, R; discs are grown by ``margins`` (r, or more)."""
    grown = [np.asarray(one, dtype=np.float64).reshape(-1, 3).copy() for one in maps]
    for one, margin in zip(grown, np.broadcast_to(margins, len(grown)), strict=True):
        one[:, 2] += margin
    disc_start = np.cumsum([0, *(len(one) for one in grown)])
    nodes, blocks = [], []
    for one, first in zip(grown, disc_start, strict=False):
        nodes.append(_shifted(_free_tangents(one), 2 * int(first), (0, 3)))
        blocks.append(_shifted(_blocks(one), 2 * int(first), (0,)))
    slots = 2 * int(disc_start[-1])
    node, block = np.concatenate([np.empty((0, 5)), *nodes]), np.concatenate([np.empty((0, 2)), *blocks])
    no_floats, no_ints = np.empty(0), np.empty(0, dtype=np.int64)
    return Ways(
        disc_start=disc_start.astype(np.int64),
        disc=np.concatenate([np.empty((0, 3)), *grown]),
        slot_start=_offsets(node[:, 0], slots),
        node_angle=node[:, 1].copy(),
        node_length=node[:, 2].copy(),
        node_to=node[:, 3].astype(np.int64),
        node_to_angle=node[:, 4].copy(),
        block_start=_offsets(block[:, 0], slots),
        block_angle=block[:, 1].copy(),
        field_map=no_ints,
        field_goal=np.empty((0, 2)),
        field_node=no_ints,
        field_slot=no_ints,
        cost=no_floats,
        last_angle=no_floats,
        last_length=no_floats,
        last_clear=no_floats,
        goal_depth=no_floats,
    )


def _free_tangents(discs: Floats) -> Floats:
    free = _tangents(discs)
    travel = np.where(free[:, 0] % 2 == 0, free[:, 1], -free[:, 1])
    return free[np.lexsort((travel, free[:, 0]))]


def _shifted(rows: Floats, by: int, columns: Sequence[int]) -> Floats:
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    rows[:, list(columns)] += by
    return rows


def _offsets(slot: Floats, slots: int) -> Ints:
    return np.searchsorted(slot, np.arange(slots + 1)).astype(np.int64)


def add_goals(ways: Ways, which: Ints, goals: Floats) -> Ways:
    """Return ``ways`` with the costs to ``goals`` (k, 2), of which goal k lies in map ``which[k]``."""
    which, goals = np.asarray(which, dtype=np.int64), np.asarray(goals, dtype=np.float64).reshape(-1, 2)
    first, last = ways.disc_start[which], ways.disc_start[which + 1]
    nodes = ways.slot_start[2 * last] - ways.slot_start[2 * first]
    slots = 2 * (last - first)
    field_node, field_slot = np.cumsum(nodes) - nodes, np.cumsum(slots) - slots
    full = ways._replace(
        field_map=which,
        field_goal=goals,
        field_node=field_node.astype(np.int64),
        field_slot=field_slot.astype(np.int64),
        cost=np.full(int(nodes.sum()), np.inf),
        last_angle=np.full(int(slots.sum()), np.nan),
        last_length=np.full(int(slots.sum()), np.nan),
        last_clear=np.zeros(int(slots.sum())),
        goal_depth=np.zeros(len(which)),
    )
    for field in range(len(which)):
        _fill(full, field)
    return full


@jit
def _fill(ways: Ways, field: int) -> None:
    """Compute the costs of one goal: backwards from it, until no tangent gets better."""
    which = ways.field_map[field]
    first_slot = 2 * ways.disc_start[which]
    ways.goal_depth[field] = _depth(ways, which, ways.field_goal[field, 0], ways.field_goal[field, 1], -1)
    for slot in range(first_slot, 2 * ways.disc_start[which + 1]):
        _last_tangent(ways, field, slot, ways.field_slot[field] + slot - first_slot)
    offset = ways.field_node[field] - ways.slot_start[first_slot]
    better = True
    while better:
        better = False
        for slot in range(first_slot, 2 * ways.disc_start[which + 1]):
            first, end = ways.slot_start[slot], ways.slot_start[slot + 1]
            for k in range(end - 1, first - 1, -1):
                cost = ways.node_length[k] + _along_slot(ways, field, ways.node_to[k], ways.node_to_angle[k])
                cost = min(cost, _further(ways, field, slot, k))
                if cost < ways.cost[offset + k] - 1e-12:
                    ways.cost[offset + k] = cost
                    better = True


@jit_inner
def _further(ways: Ways, field: int, slot: int, node: int) -> float:
    """Return the cost from a node when one stays on its slot, past this node."""
    which = ways.field_map[field]
    rho, angle = ways.disc[slot // 2, 2], ways.node_angle[node]
    clear = _clear_run(ways, slot, angle) + 1e-9
    least, _ = _by_last_tangent(ways, field, slot, angle, clear)
    first, end = ways.slot_start[slot], ways.slot_start[slot + 1]
    if end - first > 1:
        following = node + 1 if node + 1 < end else first
        turn = _turn(slot, angle, ways.node_angle[following])
        if turn <= clear:
            offset = ways.field_node[field] - ways.slot_start[2 * ways.disc_start[which]]
            least = min(least, turn * rho + ways.cost[offset + following])
    return least


@jit_inner
def _last_tangent(ways: Ways, field: int, slot: int, local: int) -> None:
    """Note where the tangent to the goal leaves a slot, if it is free."""
    c, which = slot // 2, ways.field_map[field]
    x, y = ways.disc[c, 0], ways.disc[c, 1]
    gx, gy = ways.field_goal[field, 0], ways.field_goal[field, 1]
    px, py = gx - x, gy - y
    apart = math.sqrt(px * px + py * py)
    if apart == 0.0:
        return
    rho = min(ways.disc[c, 2], apart)
    # Seen from the centre the tangent point lies that far before the goal, in the sense of travel.
    before = math.acos(rho / apart)
    angle = math.atan2(py, px) - before if slot % 2 == 0 else math.atan2(py, px) + before
    cosine, sine = math.cos(angle), math.sin(angle)
    ex, ey = x + rho * cosine, y + rho * sine
    if ex * ex + ey * ey > 1.0 + 3.0 * ROUNDING:
        return
    # From the goal, which may lie deep in a margin, back to the disc.
    if not segment_is_free(ways, which, gx, gy, ex, ey, c, -1):
        return
    length = math.sqrt(max(0.0, apart * apart - rho * rho))
    back = slot + 1 - 2 * (slot % 2)
    dx, dy = _towards(back, -px / apart, -py / apart, rho / apart)
    if length < TOUCH and _leads_into_another(ways, which, gx, gy, dx, dy, c):
        return
    ways.last_angle[local] = positive_angle(angle)
    ways.last_length[local] = length
    rim_x, rim_y = x + ways.disc[c, 2] * cosine, y + ways.disc[c, 2] * sine
    if rim_x * rim_x + rim_y * rim_y > 1.0 + 3.0 * ROUNDING or _depth(ways, which, rim_x, rim_y, c) > TOUCH:
        # What one enters on the way to it holds the goal: as on the way back, only what is passed wholly bars.
        ways.last_clear[local] = _clear_run(ways, back, ways.last_angle[local])


@jit_inner
def _depth(ways: Ways, which: int, x: float, y: float, own: int) -> float:
    """Return how deep a point lies in a disc of map ``which`` other than ``own`` at most, 0 if in none."""
    deepest = 0.0
    for c in range(ways.disc_start[which], ways.disc_start[which + 1]):
        px, py = x - ways.disc[c, 0], y - ways.disc[c, 1]
        if c != own:
            deepest = max(deepest, ways.disc[c, 2] - math.sqrt(px * px + py * py))
    return deepest


@jit
def look_up_many(ways: Ways, fields: Ints, points: Floats, out: Floats) -> None:
    """Write length and direction of the shortest way from each point (k, 2) to the goal of its field, out (k, 3)."""
    for k in range(len(fields)):
        length, dx, dy, _ = look_up(ways, fields[k], points[k, 0], points[k, 1])
        out[k, 0], out[k, 1], out[k, 2] = length, dx, dy


def lengths(ways: Ways, fields: Ints, points: Floats) -> Floats:
    """Return the length of the shortest way from each point (k, 2) to the goal of its field."""
    fields = np.ascontiguousarray(fields, dtype=np.int64).ravel()
    out = np.empty((len(fields), 3))
    look_up_many(ways, fields, np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 2), out)
    return out[:, 0].copy()
