"""The shortest ways l* that the metrics compare with: 8-connected A* as in the papers, and any-angle.

*Grid* (Nav-SCOPE, GIWT): A* over cells of 0.05 m, a cell being blocked when its centre is closer than the
robot's radius r0 to an obstacle; diagonal steps need both cells beside them free. The first and the last
point of a way are the robot's true start and goal instead of the centres of their cells, so a way is never
shorter than the straight line. An 8-connected way is up to 8.2 % longer than the shortest one.

*Any-angle*: in worlds of circles, the exact shortest way of a disc of radius r0: straight lines and arcs,
found in the tangent graph of the inflated circles (which may overlap). In worlds with walls, polygons or a
grid, or where more than `MOST_DISCS` circles matter, the A* way pulled taut: an upper bound, marked
``exact=False``; on 900 ways through forests it was 0.2 to 0.7 % longer than the exact one on average
and 4.2 % at most (`benchmarks/bench_paths.py`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope._jit import jit_alloc as jit
from swarmscope._jit import jit_inline
from swarmscope.geometry import angle_from, point_segment_distance
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.world import World, WorldSpec, compile_world
from swarmscope.tasks._occupancy import Raster, centres_of, domain_of, free_cells_near, rasterise
from swarmscope.tasks._search import Searcher, sift_down, sift_up

RESOLUTION_M = 0.05
WINDOW_M = 4.0  # searches look at this much around start and goal first
MOST_CELLS = 60_000_000  # of a window; a way that needs a larger one gets no reference
SNAP_CELLS = 3  # a start or goal in a blocked cell is taken to the nearest free one within this
MOST_DISCS = 400  # of one tangent graph; more take the pulled way
MOST_POINTS = 500  # of a way that is pulled taut; longer ones are thinned
TOUCH_M = 1e-9  # a tangent may touch, rounding must not block it
PIECE_M = 1.5  # a line of sight is looked at in pieces of this length
ARC_STEP_RAD = 0.05  # between the points that draw an arc

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Shorts = NDArray[np.int32]


class ShortestPath(NamedTuple):
    """One robot's shortest way."""

    length_m: float  # NaN when there is none
    points: Floats  # (P, 2) x, y [m], start first, empty when there is none
    exact: bool  # the shortest for the world given; False: for a grid, or an upper bound


def path_length_m(points: Floats) -> float:
    """Return the length [m] of the polyline (P, 2)."""
    steps = np.diff(points, axis=0)
    return float(np.hypot(steps[:, 0], steps[:, 1]).sum())


def lengths_m(paths: list[ShortestPath]) -> Floats:
    """Return the lengths (N,) [m], NaN for robots without a way."""
    return np.array([path.length_m for path in paths])


def grid_paths(
    spec: WorldSpec, starts: Floats, goals: Floats, radius: float, resolution: float = RESOLUTION_M
) -> list[ShortestPath]:
    """Return the 8-connected A* ways of robots of ``radius`` [m] from starts (N, 2+) to goals (N, 2).

    The grid reaches 2 m beyond the bounds, starts and goals. Each search looks at a window round its start
    and goal first, and at more when its result does not prove that nothing outside can be shorter (all ways
    of at most a length lie in an ellipse), so the result is that of the whole grid.
    """
    raster = rasterise(compile_world(spec), radius, domain_of(spec, [starts, goals]), resolution)
    pairs = zip(starts[:, :2], goals, strict=True)
    search = _WindowedSearch(raster)
    return [search.path(start, goal) for start, goal in pairs]


def any_angle_paths(
    spec: WorldSpec, starts: Floats, goals: Floats, radius: float, grid: list[ShortestPath] | None = None
) -> list[ShortestPath]:
    """Return shortest ways of any direction for discs of ``radius`` [m]: exact in worlds of circles.

    ``grid`` are the same robots' `grid_paths`, if they are known already.
    """
    grid = grid if grid is not None else grid_paths(spec, starts, goals, radius)
    world = compile_world(spec)
    only_circles = len(world.segments) == 0 and world.solid.size == 0
    ways = []
    for way, start, goal in zip(grid, starts[:, :2], goals, strict=True):
        taut = pulled_path(world, way, radius)
        exact = taut_path(world.circles, start, goal, radius, taut.length_m) if only_circles else None
        ways.append(exact or taut)
    return ways


def pulled_path(world: World, way: ShortestPath, radius: float) -> ShortestPath:
    """Return the shortest way along straight lines between points of ``way`` that keep ``radius`` off all
    obstacles.

    Steps of the way itself are kept as they are, so the result is never longer. It is an upper bound on the
    shortest way, up to the millimetres by which a step between free cells may come closer than ``radius``.
    """
    if len(way.points) < 3:
        return way
    stride = math.ceil(len(way.points) / MOST_POINTS)
    kept = np.unique(np.append(np.arange(0, len(way.points), stride), len(way.points) - 1))
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way.points, axis=0).T))])
    before = _pull(world, np.ascontiguousarray(way.points[kept]), along[kept], radius)
    points = [way.points[-1:]]
    here = len(kept) - 1
    while here > 0:
        back = int(before[here])
        first = kept[back]
        points.append(way.points[first : kept[here]] if back == here - 1 else way.points[first : first + 1])
        here = back
    taut = np.concatenate(points[::-1])
    return ShortestPath(path_length_m(taut), taut, False)


def taut_path(
    circles: Floats, start: Floats, goal: Floats, radius: float, guess_m: float
) -> ShortestPath | None:
    """Return the exact shortest way of a disc of ``radius`` among circles (C, 3), None when this cannot be
    told.

    ``guess_m`` is a length thought to suffice. Only circles that a way of the bound's length can touch enter
    the graph; if the way found is longer than the bound, the bound grows. None: more than `MOST_DISCS`
    circles matter, the start or goal is closer than ``radius`` to a circle, or no way was found.
    """
    discs = circles + np.array([0.0, 0.0, radius])
    ends = np.stack([start, goal])
    to_ends = np.hypot(*(discs[:, None, :2] - ends[None]).transpose(2, 0, 1))
    if np.any(to_ends < discs[:, 2:] - TOUCH_M):
        return None
    if not math.isfinite(guess_m):
        return None
    bound = guess_m * 1.002 + 0.01
    while True:
        near = np.ascontiguousarray(discs[to_ends.sum(axis=1) - 2.0 * discs[:, 2] <= bound])
        if len(near) > MOST_DISCS:
            return None
        way = _tangent_way(near, start, goal)
        if way is not None and way.length_m <= bound:
            return way
        if len(near) == len(discs):
            return way
        bound *= 1.05


class _WindowedSearch:
    """A* on a part of the grid that is proven to be large enough."""

    def __init__(self, raster: Raster) -> None:
        self.raster = raster
        self.searchers: dict[tuple[int, int, int, int], Searcher] = {}

    def path(self, start: Floats, goal: Floats) -> ShortestPath:
        ends = free_cells_near(self.raster, np.stack([start, goal]), SNAP_CELLS)
        margin = WINDOW_M
        while True:
            window = self._window(ends, margin)
            if (window[2] - window[0]) * (window[3] - window[1]) > MOST_CELLS:
                return ShortestPath(math.nan, np.zeros((0, 2)), False)
            first = np.array(window[:2])
            cells = self._searcher(window).path(ends[0] - first, ends[1] - first) + first
            whole = window == (0, 0, *self.raster.blocked.shape)
            if len(cells) == 0:
                if whole:
                    return ShortestPath(math.nan, np.zeros((0, 2)), False)
                margin *= 4.0
                continue
            centres = centres_of(self.raster, cells)
            needed = _beyond_ends(path_length_m(centres), float(np.hypot(*(centres[-1] - centres[0]))))
            if whole or needed <= margin - self.raster.resolution:
                points = np.vstack([start, centres[1:-1], goal])
                return ShortestPath(path_length_m(points), points, False)
            margin = needed + 2.0 * self.raster.resolution

    def _window(self, ends: Ints, margin: float) -> tuple[int, int, int, int]:
        """Return first row and column and one past the last of the cells within ``margin`` of the ends'
        box."""
        cells = math.ceil(margin / self.raster.resolution)
        low = np.maximum(ends.min(axis=0) - cells, 0)
        high = np.minimum(ends.max(axis=0) + cells + 1, self.raster.blocked.shape)
        return int(low[0]), int(low[1]), int(high[0]), int(high[1])

    def _searcher(self, window: tuple[int, int, int, int]) -> Searcher:
        """Return a searcher of the window; that of the last window is kept."""
        if window not in self.searchers:
            row0, column0, row1, column1 = window
            blocked = np.ascontiguousarray(self.raster.blocked[row0:row1, column0:column1])
            self.searchers = {window: Searcher(self.raster._replace(blocked=blocked))}
        return self.searchers[window]


def _beyond_ends(length: float, apart: float) -> float:
    """Return how far beyond the box of its ends a way of ``length`` can reach: the ellipse's half axes bound
    it."""
    return max(0.5 * (length - apart), 0.5 * math.sqrt(max(0.0, length**2 - apart**2)))


@jit
def _sees(world: World, ax: float, ay: float, bx: float, by: float, radius: float) -> bool:
    """Say whether the line a-b keeps ``radius`` off everything; asked in pieces, so that a near wall ends it
    soon."""
    pieces = max(1, math.ceil(math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay)) / PIECE_M))
    ux, uy = (bx - ax) / pieces, (by - ay) / pieces
    for k in range(pieces):
        x, y = ax + k * ux, ay + k * uy
        if static_clearance(world, x, y, x + ux, y + uy, radius + 1.0e-3) < radius:
            return False
    return True


@jit
def _pull(world: World, points: Floats, along: Floats, radius: float) -> Ints:
    """Return of each point the one before it on the shortest chain of visible points; steps along the way
    are free."""
    count = points.shape[0]
    cost = np.full(count, math.inf)
    before = np.zeros(count, dtype=np.int64)
    cost[0] = 0.0
    for k in range(count - 1):
        step = along[k + 1] - along[k]
        if cost[k] + step < cost[k + 1]:
            cost[k + 1], before[k + 1] = cost[k] + step, k
        for other in range(k + 2, count):
            ax, ay, bx, by = points[k, 0], points[k, 1], points[other, 0], points[other, 1]
            through = cost[k] + math.sqrt((bx - ax) * (bx - ax) + (by - ay) * (by - ay))
            if through < cost[other] and _sees(world, ax, ay, bx, by, radius):
                cost[other], before[other] = through, k
    return before


def _tangent_way(discs: Floats, start: Floats, goal: Floats) -> ShortestPath | None:
    """Return the shortest way from start to goal round the discs (D, 3), None when there is none.

    Nodes are the ends of the tangents: (disc, angle), or start and goal (disc -1 and -2). Edges are the
    tangents that no disc cuts, and arcs between neighbouring nodes of a disc that no other disc covers.
    """
    ends = np.array([[start[0], start[1], 0.0], [goal[0], goal[1], 0.0]])
    rounds = np.vstack([ends, discs])
    owner, angle = _tangents(rounds)
    if len(owner) == 0:
        return None
    x = rounds[owner, 0] + rounds[owner, 2] * np.cos(angle)
    y = rounds[owner, 1] + rounds[owner, 2] * np.sin(angle)
    nodes = len(owner)
    first = np.arange(0, nodes, 2)
    lines = np.hypot(x[first] - x[first + 1], y[first] - y[first + 1])
    tails, heads, arcs = _arcs(rounds, owner, angle)
    at_ends = [np.flatnonzero(owner == k) for k in (0, 1)]  # copies of start and of goal, joined at no cost
    joined = [np.column_stack([np.full(len(c) - 1, c[0]), c[1:]]) for c in at_ends if len(c)]
    if len(joined) < 2:
        return None
    joints = np.concatenate(joined)
    edges = np.concatenate([np.column_stack([first, first + 1]), np.column_stack([tails, heads]), joints])
    lengths = np.concatenate([lines, arcs, np.zeros(len(joints))])
    last = int(at_ends[1][0])
    cost, before = _all_costs(nodes, edges, lengths, int(at_ends[0][0]))
    if not math.isfinite(cost[last]):
        return None
    chain = [last]
    while before[chain[-1]] >= 0:
        chain.append(int(before[chain[-1]]))
    return ShortestPath(float(cost[last]), _draw(rounds, owner, angle, cost, chain[::-1]), True)


def _all_costs(nodes: int, edges: Ints, lengths: Floats, first: int) -> tuple[Floats, Ints]:
    """Return the least cost of each node from ``first``, and the node before it (-1: none); edges go both
    ways."""
    tails = np.concatenate([edges[:, 0], edges[:, 1]])
    order = np.argsort(tails, kind="stable")
    row = np.searchsorted(tails[order], np.arange(nodes + 1))
    heads = np.concatenate([edges[:, 1], edges[:, 0]])[order]
    cost, before = _dijkstra(row, heads, np.concatenate([lengths, lengths])[order], first)
    return cost, before


def _draw(rounds: Floats, owner: Ints, angle: Floats, cost: Floats, chain: list[int]) -> Floats:
    """Return points (P, 2) along the chain of nodes; arcs as polylines (a little shorter than the arc)."""
    points = []
    for here, there in zip(chain, [*chain[1:], chain[-1]], strict=True):
        x, y, r = rounds[owner[here]]
        turn = 0.0
        if owner[here] == owner[there] and r > 0.0:
            turn = math.remainder(angle[there] - angle[here], 2.0 * math.pi)
            if r * abs(turn) < cost[there] - cost[here] - TOUCH_M:  # it went the long way round
                turn -= math.copysign(2.0 * math.pi, turn)
        steps = angle[here] + turn * np.linspace(0.0, 1.0, 1 + math.ceil(abs(turn) / ARC_STEP_RAD))
        points.append(np.column_stack([x + r * np.cos(steps), y + r * np.sin(steps)]))
    drawn = np.concatenate(points)
    moved = np.concatenate([[True], np.any(np.abs(np.diff(drawn, axis=0)) > TOUCH_M, axis=1)])
    kept: Floats = drawn[moved]
    return kept


@jit_inline
def _is_clear(rounds: Floats, i: int, j: int, ax: float, ay: float, bx: float, by: float) -> bool:
    for k in range(rounds.shape[0]):
        if k in (i, j):
            continue
        if point_segment_distance(rounds[k, 0], rounds[k, 1], ax, ay, bx, by) < rounds[k, 2] - TOUCH_M:
            return False
    return True


@jit
def _tangents(rounds: Floats) -> tuple[Ints, Floats]:
    """Return owner and angle of the two ends of every common tangent that no third disc cuts, one after the
    other.

    A tangent touches disc i at the angle a and disc j at a (outer) or a + pi (inner); points are discs of
    radius 0.
    """
    count = rounds.shape[0]
    owner = np.empty(4 * count * count, dtype=np.int64)
    angle = np.empty(4 * count * count)
    found = 0
    for i in range(count):
        xi, yi, ri = rounds[i, 0], rounds[i, 1], rounds[i, 2]
        for j in range(i + 1, count):
            xj, yj, rj = rounds[j, 0], rounds[j, 1], rounds[j, 2]
            apart = math.sqrt((xj - xi) * (xj - xi) + (yj - yi) * (yj - yi))
            if apart == 0.0:
                continue
            bearing = math.atan2(yj - yi, xj - xi)
            for kind in range(2):
                inner = kind == 1
                if inner and (ri == 0.0 or rj == 0.0):
                    continue  # the same as the outer ones
                ratio = (ri + rj if inner else ri - rj) / apart
                if abs(ratio) > 1.0 + TOUCH_M:
                    continue
                turn = math.acos(min(1.0, max(-1.0, ratio)))
                for side in range(2):
                    if ri == 0.0 and rj == 0.0 and side == 1:
                        continue
                    a = bearing + turn if side == 0 else bearing - turn
                    b = a + math.pi if inner else a
                    ax, ay = xi + ri * math.cos(a), yi + ri * math.sin(a)
                    bx, by = xj + rj * math.cos(b), yj + rj * math.sin(b)
                    if _is_clear(rounds, i, j, ax, ay, bx, by):
                        owner[found], angle[found] = i, a
                        owner[found + 1], angle[found + 1] = j, b
                        found += 2
    return owner[:found].copy(), angle[:found].copy()


def _arcs(rounds: Floats, owner: Ints, angle: Floats) -> tuple[Ints, Ints, Floats]:
    """Return tails, heads and lengths of the free arcs between neighbouring nodes of each disc."""
    order = np.lexsort((np.mod(angle, 2.0 * math.pi), owner))
    order = order[owner[order] >= 2]
    arcs: tuple[Ints, Ints, Floats] = _free_arcs(rounds, owner, angle, order)
    return arcs


@jit
def _free_arcs(rounds: Floats, owner: Ints, angle: Floats, order: Ints) -> tuple[Ints, Ints, Floats]:
    count = order.shape[0]
    tails, heads = np.empty(count, dtype=np.int64), np.empty(count, dtype=np.int64)
    lengths = np.empty(count)
    found, first = 0, 0
    for k in range(count):
        here = order[k]
        disc = owner[here]
        if owner[order[first]] != disc:
            first = k
        there = order[k + 1] if k + 1 < count and owner[order[k + 1]] == disc else order[first]
        if here == there:
            continue
        turn = angle_from(angle[here], angle[there])
        if _arc_is_free(rounds, disc, angle[here], turn):
            tails[found], heads[found], lengths[found] = here, there, rounds[disc, 2] * turn
            found += 1
    return tails[:found].copy(), heads[:found].copy(), lengths[:found].copy()


@jit_inline
def _arc_is_free(rounds: Floats, disc: int, start: float, turn: float) -> bool:
    """Say whether no other disc covers a part of the arc; its ends are free, so a cover's middle would lie
    on it."""
    x, y, r = rounds[disc, 0], rounds[disc, 1], rounds[disc, 2]
    for k in range(2, rounds.shape[0]):
        dx, dy = rounds[k, 0] - x, rounds[k, 1] - y
        apart = math.sqrt(dx * dx + dy * dy)
        if k == disc or apart >= r + rounds[k, 2] - TOUCH_M or apart <= abs(r - rounds[k, 2]):
            continue
        if angle_from(start, math.atan2(dy, dx)) < turn:
            return False
    return True


@jit
def _dijkstra(row: Ints, heads: Ints, lengths: Floats, first: int) -> tuple[Floats, Ints]:
    nodes = row.shape[0] - 1
    cost, before = np.full(nodes, math.inf), np.full(nodes, -1, dtype=np.int64)
    key, node = np.empty(heads.shape[0] + 1), np.empty(heads.shape[0] + 1, dtype=np.int32)
    cost[first], key[0], node[0] = 0.0, 0.0, first
    count = 1
    while count > 0:
        here, reached = node[0], key[0]
        count -= 1
        key[0], node[0] = key[count], node[count]
        sift_down(key, node, count)
        if reached > cost[here]:
            continue
        for k in range(row[here], row[here + 1]):
            through = reached + lengths[k]
            if through < cost[heads[k]]:
                cost[heads[k]], before[heads[k]] = through, here
                key[count], node[count] = through, heads[k]
                sift_up(key, node, count)
                count += 1
    return cost, before
