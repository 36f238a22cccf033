"""Candidate ways of one robot: the shortest, others past displaced points, one that keeps off starts and goals.

Polylines from a start to a goal round discs grown by r and a hair. Those past a point p join the shortest way from
p back to the start, turned round, and the shortest way from p to the goal, so that 2 n fields serve all of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit
from swarmscope.disk import geodesic
from swarmscope.disk.contact import nearest_on_the_way
from swarmscope.disk.geodesic import Ways, _along_slot, _by_last_tangent, _clear_run, _next_node, _turn, look_up
from swarmscope.disk.rules import ROUNDING, Floats

VERTICES = 4000
"""Room for one way."""
FRACTIONS = (0.5, 0.3, 0.7)
"""Where along the shortest way it is displaced sideways ..."""
OFFSETS = (0.4, 0.8, 1.2, 1.8, 2.5, 3.5)
"""... and how far, in widths of a robot."""
OTHER_SIDES = 6
"""Ways that pass single obstacles on the other side, at most."""


class Terrain(NamedTuple):
    """Shortest ways of one map to all starts and goals: field k is start k, field n + k is goal place k."""

    open: Ways
    """Round obstacles."""
    kept: Ways
    """Round obstacles, starts and goals, between points just inside of those."""
    start: Floats
    goal: Floats
    inner_start: Floats
    inner_goal: Floats
    discs: Floats
    """Obstacles as they are."""
    r: float
    clear: float
    spacing: float
    """Largest distance of vertices on arcs."""


def terrain(
    discs: Floats, r: float, start: Floats, goal: Floats, clear: float, apart: float, spacing: float
) -> Terrain:
    """Return the ways of a map.

    Args:
        discs: (m, 3) obstacles.
        r: radius of the robots.
        start, goal: (n, 2) places.
        clear: gap to obstacles.
        apart: distance between the centres of robots.
        spacing: largest distance of vertices on arcs.
    """
    n = len(start)
    sag = 0.33 * spacing * spacing / r  # of a chord twice as long, on a circle of radius 2 r, and a bit
    inner_start, inner_goal = (
        p * (1.0 - (apart + 3.0 * sag) / np.linalg.norm(p, axis=1))[:, None] for p in (start, goal)
    )
    ends = np.concatenate([start, goal])
    # Ways between inner points bend outwards round obstacles only, so only places near those have to be kept free.
    near = np.linalg.norm(ends[:, None] - discs[None, :, :2], axis=2) < discs[:, 2] + apart + 5.0 * r
    crossed = ends[near.any(axis=1)]
    parked = np.column_stack([crossed, np.full(len(crossed), apart + sag - r - clear)])
    here = np.zeros(2 * n, dtype=np.int64)
    open_ways = geodesic.add_goals(geodesic.build([discs], r + clear), here, ends)
    kept = geodesic.build([np.concatenate([discs.reshape(-1, 3), parked])], r + clear)
    kept = geodesic.add_goals(kept, here[:n], inner_goal)
    return Terrain(open_ways, kept, start, goal, inner_start, inner_goal, discs, r, clear, spacing)


def candidates(on: Terrain, robot: int, place: int) -> list[Floats]:
    """Return ways (k, 2) of a robot from its start to a goal place, the shortest first; none if there is none."""
    room = np.empty((VERTICES, 2))
    start, goal = on.start[robot], on.goal[place]
    n = len(on.start)
    found: list[Floats] = []
    count = trace(on.open, n + place, start[0], start[1], on.spacing, room, 0)
    if count > 1:
        found.append(room[:count].copy())
        for x, y in _points(on, found[0], n + place, robot):
            count = through(on.open, robot, n + place, x, y, on.spacing, room)
            if count > 1:
                found.append(room[:count].copy())
    a = on.inner_start[robot]
    room[0] = start
    count = trace(on.kept, place, a[0], a[1], on.spacing, room, 1)
    if 1 < count < VERTICES:
        room[count] = goal
        found.append(room[: count + 1].copy())
    found = [way for way in found if passes(way, on.discs, on.r + 0.1 * on.clear)]
    return sorted(found, key=way_length)


def way_length(way: Floats) -> float:
    """Return the length of a polyline."""
    return float(np.hypot(*np.diff(way, axis=0).T).sum())


def _points(on: Terrain, way: Floats, goal_field: int, start_field: int) -> Sequence[tuple[float, float]]:
    """Return points beside the shortest way, and beside obstacles."""
    steps = np.hypot(*np.diff(way, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    points: list[tuple[float, float]] = []
    for fraction in FRACTIONS:
        at = np.array([np.interp(fraction * along[-1], along, way[:, k]) for k in range(2)])
        k = min(max(int(np.searchsorted(along, fraction * along[-1])) - 1, 0), len(steps) - 1)
        ux, uy = (way[k + 1] - way[k]) / max(steps[k], 1e-12)
        for offset in OFFSETS:
            for side in (-2.0 * on.r * offset, 2.0 * on.r * offset):
                points.append((at[0] - uy * side, at[1] + ux * side))
    ux, uy = (way[-1] - way[0]) / max(float(np.hypot(*(way[-1] - way[0]))), 1e-12)
    others = []
    for x, y, rho in on.open.disc:
        for side in (-rho - 2.0 * on.clear, rho + 2.0 * on.clear):
            px, py = x - uy * side, y + ux * side
            if _stands(on, px, py):
                out = geodesic.lengths(on.open, np.array([start_field, goal_field]), np.array([[px, py], [px, py]]))
                others.append((float(out.sum()), px, py))
    others.sort()
    last, taken = along[-1], 0
    for length, px, py in others:
        if length > last + 1e-3 and math.isfinite(length) and taken < OTHER_SIDES:
            points.append((px, py))
            last, taken = length, taken + 1
    return [(x, y) for x, y in points if _stands(on, x, y)]


def _stands(on: Terrain, x: float, y: float) -> bool:
    if x * x + y * y > 1.0:
        return False
    discs = on.open.disc
    return bool((np.hypot(discs[:, 0] - x, discs[:, 1] - y) > discs[:, 2]).all())


@jit
def through(ways: Ways, back: int, onward: int, x: float, y: float, spacing: float, out: Floats) -> int:
    """Write the way from the goal of field ``back`` past a point to the goal of ``onward``; return how many points."""
    count = trace(ways, back, x, y, spacing, out, 0)
    if count < 0:
        return -1
    for k in range(count // 2):
        for axis in range(2):
            out[k, axis], out[count - 1 - k, axis] = out[count - 1 - k, axis], out[k, axis]
    return trace(ways, onward, x, y, spacing, out, count - 1)


@jit
def trace(ways: Ways, field: int, x: float, y: float, spacing: float, out: Floats, first: int) -> int:
    """Write the shortest way from a point to a goal into ``out`` from row ``first``.

    Returns the number of rows in use, -1 where there is no way or no room.
    """
    length, dx, dy, slot = look_up(ways, field, x, y)
    if not length < math.inf or first + 2 > len(out):
        return -1
    out[first, 0], out[first, 1] = x, y
    count = first + 1
    gx, gy = ways.field_goal[field, 0], ways.field_goal[field, 1]
    which = ways.field_map[field]
    first_slot = 2 * ways.disc_start[which]
    offset = ways.field_node[field] - ways.slot_start[first_slot]
    if slot >= 0:
        c = slot // 2
        px, py = ways.disc[c, 0] - x, ways.disc[c, 1] - y
        ahead = max(0.0, px * dx + py * dy)
        angle = math.atan2(y + dy * ahead - ways.disc[c, 1], x + dx * ahead - ways.disc[c, 0])
        node = -1
        while True:
            rho = ways.disc[slot // 2, 2]
            if node >= 0:
                leave = ways.node_length[node] + _along_slot(ways, field, ways.node_to[node], ways.node_to_angle[node])
                if leave <= ways.cost[offset + node] + 1e-10:
                    slot, angle, node = ways.node_to[node], ways.node_to_angle[node], -1
                    continue
            clear = _clear_run(ways, slot, angle) + 1e-9
            last, turn_last = _by_last_tangent(ways, field, slot, angle, clear)
            begin, end = ways.slot_start[slot], ways.slot_start[slot + 1]
            follow, turn_node, following = math.inf, 0.0, -1
            if end > begin:
                if node < 0:
                    following = _next_node(ways, slot, angle)
                elif end - begin > 1:
                    following = node + 1 if node + 1 < end else begin
                if following >= 0:
                    turn_node = _turn(slot, angle, ways.node_angle[following])
                    if turn_node <= clear:
                        follow = turn_node * rho + ways.cost[offset + following]
            if not min(last, follow) < math.inf:
                return -1
            turn = turn_last if last <= follow else turn_node
            pieces = int(turn * rho / spacing) + 1
            if count + pieces + 2 > len(out):
                return -1
            sense = 1.0 if slot % 2 == 0 else -1.0
            for k in range(pieces + 1):
                at = angle + sense * turn * k / pieces
                out[count, 0] = ways.disc[slot // 2, 0] + rho * math.cos(at)
                out[count, 1] = ways.disc[slot // 2, 1] + rho * math.sin(at)
                count += 1
            if last <= follow:
                break
            angle, node = ways.node_angle[following], following
    out[count, 0], out[count, 1] = gx, gy
    return count + 1


@jit
def passes(way: Floats, discs: Floats, reach: float) -> bool:
    """Return whether a polyline stays more than ``reach`` off all discs and inside the workspace."""
    for k in range(len(way)):
        x, y = way[k, 0], way[k, 1]
        if math.sqrt(x * x + y * y) > 1.0 + 0.5 * ROUNDING:
            return False
        if k + 1 == len(way):
            break
        for c in range(len(discs)):
            px, py = x - discs[c, 0], y - discs[c, 1]
            qx, qy = way[k + 1, 0] - discs[c, 0], way[k + 1, 1] - discs[c, 1]
            if nearest_on_the_way(px, py, qx, qy) <= discs[c, 2] + reach:
                return False
    return True


@jit
def places(way: Floats, first: float, pace: float, total: float, out: Floats) -> int:
    """Write places along a way: its start, one after ``first``, then one every ``pace``, the last at ``total``.

    Returns their number, 0 if there is no room.
    """
    out[0, 0], out[0, 1] = way[0, 0], way[0, 1]
    count, segment, done = 1, 0, 0.0
    want = min(first, total)
    while segment + 1 < len(way):
        ux, uy = way[segment + 1, 0] - way[segment, 0], way[segment + 1, 1] - way[segment, 1]
        size = math.sqrt(ux * ux + uy * uy)
        if size < want - done:
            done += size
            segment += 1
            continue
        if count >= len(out):
            return 0
        part = (want - done) / size if size > 0.0 else 0.0
        out[count, 0], out[count, 1] = way[segment, 0] + part * ux, way[segment, 1] + part * uy
        count += 1
        if want >= total:
            return count
        want = min(want + pace, total)
    return count
