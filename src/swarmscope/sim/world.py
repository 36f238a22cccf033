"""The static world: its validated description (`WorldSpec`) and the plain arrays the kernels read (`World`).

All lengths are metres in the world frame (x right, y up on a drawing; REP-103). Obstacles may overlap and may
lie outside ``bounds``; ``bounds`` is what is drawn and where tasks put robots, it is not a wall. A wall is `WALL_M`
thick with round ends and corners, so that a LiDAR sees from every side what a robot can touch.
"""

from __future__ import annotations

import math
import operator
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Any, Literal, NamedTuple, Self

import numpy as np
import numpy.typing as npt
from mapbox_earcut import triangulate_float64 as earcut
from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, model_validator

from swarmscope._jit import jit, jit_inline
from swarmscope.errors import ConfigError
from swarmscope.sim.slabs import Slabs, free_slabs

PIECE_M = 1.0
"""Walls and polygon edges are cut into pieces no longer than this [m]: a look-up finds them by midpoint."""

WALL_M = 0.02
"""Thickness of a wall [m], for sensors, contacts, ways and pictures alike: what is within half of it of the wall's line
is solid. It is what the robots' guard takes for the narrowest thing there is (``Guarding.thinnest_m``)."""

BIN_M = 1.0
"""Side of a look-up bin [m]; larger only in worlds wider than `BINS_PER_SIDE` of them."""

BINS_PER_SIDE = 512
LONGEST_M = 1.0e5
MAX_CELLS = 100_000_000
FASTEST_MPS = 100.0
LONGEST_S = 1.0e6
MOST_POINTS = 100_000
"""Of the way of a disc, or times of a door."""
MOST_PIECES = 1_000_000
MOST_ENTRIES = 50_000_000
"""Pairs of a polygon and a bin that it meets."""
GAP_CAP = 255

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Bytes = npt.NDArray[np.uint8]


def _reject_text(value: Any) -> Any:
    if isinstance(value, bool | str | bytes):
        raise ValueError("must be a number")
    return value


_Finite = Annotated[float, BeforeValidator(_reject_text), Field(allow_inf_nan=False)]
Number = Annotated[_Finite, Field(ge=-LONGEST_M, le=LONGEST_M)]
Length = Annotated[_Finite, Field(gt=0.0, le=LONGEST_M)]
Speed = Annotated[_Finite, Field(ge=-FASTEST_MPS, le=FASTEST_MPS)]
Time = Annotated[_Finite, Field(ge=0.0, le=LONGEST_S)]
Point = tuple[Number, Number]


class _Model(BaseModel):
    """Settings shared by all parts of the description: unknown keys are errors, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True, use_attribute_docstrings=True)


class Circle(_Model):
    """A disc: ``center`` [x, y] and ``radius`` [m], world frame; with ``velocity`` or a ``way`` it moves."""

    type: Literal["circle"] = "circle"
    """What it is."""
    center: Point
    """x, y [m]; of a disc that moves: in the beginning."""
    radius: Annotated[Length, Field(ge=1e-6)]
    """Its radius [m]."""
    velocity: tuple[Speed, Speed] | None = None
    """It moves on like this for ever: vx, vy [m/s]."""
    way: Annotated[list[Point], Field(min_length=1, max_length=MOST_POINTS)] | None = None
    """Where it goes from its centre, one point after the other: x, y [m]."""
    speed_mps: Annotated[Speed, Field(gt=0.0)] | None = None
    """Its speed along its way [m/s]."""
    times_s: Annotated[list[Time], Field(max_length=MOST_POINTS)] | None = None
    """Instead of its speed: when it is at each point of its way [s]."""
    repeat: Literal["back", "loop", "once"] | None = None
    """At the end of its way it turns back (so it is when nothing is said), goes to its centre and on, or stays."""

    @property
    def moves(self) -> bool:
        """Whether it does not stand."""
        return self.velocity is not None or self.way is not None

    @model_validator(mode="after")
    def _check_way(self) -> Self:
        _check_motion(self)
        return self


class Polygon(_Model):
    """A solid polygon, convex or not: ``points`` [[x, y], ...] [m], at least 3, in either orientation."""

    type: Literal["polygon"] = "polygon"
    """What it is."""
    points: Annotated[list[Point], Field(min_length=3)]
    """Its corners x, y, one after the other [m]."""

    @model_validator(mode="after")
    def _check_shape(self) -> Self:
        _convex_parts(self)
        return self


class Wall(_Model):
    """A wall, 0.02 m thick, along the polyline ``points`` [[x, y], ...] [m], at least 2."""

    type: Literal["wall"] = "wall"
    """What it is."""
    points: Annotated[list[Point], Field(min_length=2)]
    """Its corners x, y, one after the other [m]."""

    @model_validator(mode="after")
    def _check_steps(self) -> Self:
        for index, (first, second) in enumerate(pairwise(self.points)):
            if first == second:
                raise ValueError(f"points {index} and {index + 1} of the wall are the same")
        return self


class Door(_Model):
    """A straight wall, 0.02 m thick, that opens and closes; it closes only when no robot is near."""

    type: Literal["door"] = "door"
    """What it is."""
    points: Annotated[list[Point], Field(min_length=2, max_length=2)]
    """Its ends x, y [m]."""
    open_s: Annotated[list[tuple[Time, Time]], Field(max_length=MOST_POINTS)]
    """When it is open: from, until [s]."""
    every_s: Annotated[Time, Field(gt=0.0)] | None = None
    """After this it begins anew [s]."""

    @model_validator(mode="after")
    def _check_times(self) -> Self:
        if self.points[0] == self.points[1]:
            raise ValueError("the ends of the door are the same")
        for index, (first, last) in enumerate(self.open_s):
            if not first < last <= (self.every_s or math.inf):
                raise ValueError(f"open_s {index} {[first, last]} is not [from, until], from < until <= every_s")
        return self


class Grid(_Model):
    """An occupancy grid: cell (row, col) covers ``origin + resolution * [col, row]`` to one cell further [m], all of
    it turned by ``yaw`` round the origin.

    Row 0 is at the bottom. ``rows`` lists the solid runs ``[row, first_col, last_col]``, both included.
    """

    type: Literal["grid"] = "grid"
    """What it is."""
    resolution: Annotated[_Finite, Field(ge=1e-3, le=100.0)]
    """Side of a cell [m]."""
    origin: Point
    """Lower left corner x, y [m]."""
    yaw: Number = 0.0
    """Direction in which the columns count, counter-clockwise from x [rad]."""
    width: Annotated[int, Field(ge=1)]
    """Columns."""
    height: Annotated[int, Field(ge=1)]
    """Rows."""
    rows: list[tuple[int, int, int]]
    """Solid runs: row, first column, last column."""

    @model_validator(mode="after")
    def _check_runs(self) -> Self:
        cells = self.width * self.height
        if cells > MAX_CELLS:
            raise ValueError(f"the grid has {cells} cells, at most {MAX_CELLS} are possible")
        for index, (row, first, last) in enumerate(self.rows):
            if not (0 <= row < self.height and 0 <= first <= last < self.width):
                raise ValueError(
                    f"run {index} {[row, first, last]} is not [row, first_col, last_col] inside "
                    f"{self.width} columns x {self.height} rows"
                )
        return self


Obstacle = Annotated[Circle | Polygon | Wall | Door | Grid, Field(discriminator="type")]


class WorldSpec(_Model):
    """What stands in the world: ``obstacles`` (at most one grid) and ``bounds`` [x0, y0, x1, y1] [m]."""

    obstacles: list[Obstacle] = Field(default_factory=list)
    """Circles, polygons, walls, doors, and at most one occupancy grid; each names its ``type``."""
    bounds: tuple[Number, Number, Number, Number]
    """Lower left and upper right corner of what is drawn, no walls: x0, y0, x1, y1 [m]."""

    @model_validator(mode="after")
    def _check_world(self) -> Self:
        x0, y0, x1, y1 = self.bounds
        if not (x0 < x1 and y0 < y1):
            raise ValueError(f"bounds {list(self.bounds)} are not [x0, y0, x1, y1] with x0 < x1 and y0 < y1")
        if sum(isinstance(obstacle, Grid) for obstacle in self.obstacles) > 1:
            raise ValueError("a world can hold one grid at most")
        pieces = sum(map(_pieces, self.obstacles))
        if pieces > MOST_PIECES:
            raise ValueError(f"there are {pieces:.0f} m of walls and edges, at most {MOST_PIECES} are possible")
        return self


class Bins(NamedTuple):
    """Uniform look-up bins; bin ``row * columns + column`` holds items ``start[bin] .. start[bin + 1] - 1``.

    Circles (by centre) and segments (by midpoint) are stored in bin order, so that the items of neighbouring
    columns are one contiguous run. Polygons are listed in every bin that their bounding box meets.
    """

    x0: float
    y0: float
    size: float
    columns: int
    rows: int
    circle_start: Ints
    """(B + 1,) first circle of each bin."""
    segment_start: Ints
    """(B + 1,) first segment of each bin."""
    polygon_start: Ints
    """(B + 1,) first entry of ``polygon_items`` of each bin."""
    polygon_items: Ints
    """(K,) indices of polygons."""


class World(NamedTuple):
    """The static world as plain arrays for kernels; always the same dtypes, any of them may be empty."""

    circles: Floats
    """(C, 3) x, y, radius [m], in bin order: discs, and the round ends and corners of walls."""
    radius_max: float
    """Largest radius of a circle [m], 0 without circles."""
    segments: Floats
    """(S, 4) ax, ay, bx, by [m], none longer than `PIECE_M`, in bin order: sides of walls, edges of polygons."""
    one_sided: Bytes
    """(S,) 1 = side of a wall, seen from its right only: from anywhere else another part of the wall is before it."""
    vertices: Floats
    """(V, 2) corners of walls and of the convex parts of polygons, counter-clockwise [m]."""
    vertex_start: Ints
    """(P + 1,) first corner of each polygon."""
    bins: Bins
    solid: Bytes
    """(H, W) 1 = solid, row 0 at the bottom; (0, 0) without a grid."""
    solid_gap: Bytes
    """(H, W) steps (8 neighbours) from a cell to the nearest solid cell: 0 = solid itself, at most 255."""
    solid_origin: Floats
    """(2,) lower left corner of cell (0, 0) [m]."""
    solid_turn: Floats
    """(2,) direction in which the columns count: cos, sin."""
    solid_resolution: float
    """Side of a cell [m]."""
    slabs: Slabs
    """The free cells as rectangles, which a lidar's beams cross."""


_LATEST: list[tuple[tuple[Any, ...], World]] = []
"""What was compiled last, and its arrays: making and checking a place asks for the same ones several times."""


def compile_world(spec: WorldSpec) -> World:
    """Return the description as arrays and look-up bins for the kernels, to be read only."""
    parts = (spec.bounds, *spec.obstacles)
    for others, world in tuple(_LATEST):
        if _are_same(parts, others):
            return world
    world = _compiled(spec)
    _LATEST[:] = [(parts, world)]
    return world


def _are_same(parts: tuple[Any, ...], others: tuple[Any, ...]) -> bool:
    """Tell whether two worlds consist of the very same parts, which do not change."""
    return len(parts) == len(others) and all(map(operator.is_, parts, others))


def _compiled(spec: WorldSpec) -> World:
    """Turn the description into arrays and look-up bins."""
    walls = [np.asarray(o.points, dtype=np.float64) for o in spec.obstacles if isinstance(o, Wall)]
    circles = np.concatenate([_circle_rows(spec), *map(_joints, walls)])
    bars = [bar for wall in walls for a, b in pairwise(wall) for bar in _bars(a, b)]
    shapes = [_convex_parts(obstacle) for obstacle in spec.obstacles if isinstance(obstacle, Polygon)]
    segments = _segment_rows(bars, [outline for outline, _ in shapes])
    polygons = bars + [part for _, parts in shapes for part in parts]
    x0, y0, size, columns, rows = _bin_layout(spec, circles, segments)

    def bin_of(points: Floats) -> Ints:
        column = np.clip(np.floor((points[:, 0] - x0) / size), 0, columns - 1)
        row = np.clip(np.floor((points[:, 1] - y0) / size), 0, rows - 1)
        return np.asarray(row * columns + column, dtype=np.int64)

    midpoints = 0.5 * (segments[:, :2] + segments[:, 2:])
    circle_order, circle_start = _counting_sort(bin_of(circles), columns * rows)
    segment_order, segment_start = _counting_sort(bin_of(midpoints), columns * rows)
    polygon_items, polygon_start = _polygon_entries(polygons, x0, y0, size, columns, rows)
    solid, origin, turn, resolution = _solid_arrays(spec)
    return World(
        circles=np.ascontiguousarray(circles[circle_order]),
        radius_max=float(circles[:, 2].max(initial=0.0)),
        segments=np.ascontiguousarray(segments[segment_order]),
        one_sided=(segment_order < 2 * len(bars)).astype(np.uint8),
        vertices=np.ascontiguousarray(np.concatenate([np.zeros((0, 2)), *polygons])),
        vertex_start=np.cumsum([0, *(len(p) for p in polygons)], dtype=np.int64),
        bins=Bins(x0, y0, size, columns, rows, circle_start, segment_start, polygon_start, polygon_items),
        solid=solid,
        solid_gap=_gap(solid),
        solid_origin=origin,
        solid_turn=turn,
        solid_resolution=resolution,
        slabs=free_slabs(solid),
    )


@jit_inline
def in_grid(world: World, x: float, y: float) -> tuple[float, float]:
    """Return where (x, y) [m] lies in the occupancy grid, along columns and along rows [m]."""
    dx, dy = x - world.solid_origin[0], y - world.solid_origin[1]
    c, s = world.solid_turn[0], world.solid_turn[1]
    return c * dx + s * dy, c * dy - s * dx


@jit_inline
def bin_index(value: float, low: float, size: float, count: int) -> int:
    """Return the index of the bin in which ``value`` lies, held within 0 .. count - 1 (NaN: 0)."""
    position = (value - low) / size
    if not position > 0.0:
        return 0
    return int(min(position, count - 1.0))


@jit_inline
def bin_run(bins: Bins, start: Ints, row: int, x: float, y: float, reach: float) -> tuple[int, int]:
    """Return first and stop of the items in one row of bins that may lie within ``reach`` [m] of x, y."""
    low = bins.y0 + row * bins.size
    aside = max(0.0, low - y - 1e-9, y - low - bins.size - 1e-9)
    chord = math.sqrt(max(0.0, reach * reach - aside * aside))
    first = bin_index(x - chord, bins.x0, bins.size, bins.columns)
    last = bin_index(x + chord, bins.x0, bins.size, bins.columns)
    return start[row * bins.columns + first], start[row * bins.columns + last + 1]


def _pieces(obstacle: Obstacle) -> float:
    """Return into how many pieces the walls and edges of an obstacle are cut, about."""
    if isinstance(obstacle, Circle | Grid):
        return 0.0
    return sum(1.0 + math.dist(a, b) / PIECE_M for a, b in pairwise(obstacle.points))


def grid_from_solid(
    solid: npt.ArrayLike, resolution: float, origin: tuple[float, float], yaw: float = 0.0
) -> Grid:
    """Return the `Grid` of an array (H, W), row 0 at the bottom, in which everything but 0 is solid."""
    cells = np.asarray(solid) != 0
    if cells.ndim != 2:
        raise ValueError(f"a grid needs a 2-D array, not one of shape {cells.shape}")
    edges = np.diff(np.pad(cells.astype(np.int8), ((0, 0), (1, 1))), axis=1)
    starts, ends = np.argwhere(edges == 1), np.argwhere(edges == -1)
    runs = np.column_stack([starts, ends[:, 1] - 1]).tolist()
    height, width = cells.shape
    return Grid(resolution=resolution, origin=origin, yaw=yaw, width=width, height=height, rows=runs)


def grid_corners(grid: Grid) -> Floats:
    """Return the corners (4, 2) of all cells together [m], counter-clockwise from the origin."""
    c, s = math.cos(grid.yaw), math.sin(grid.yaw)
    right, up = np.array([c, s]) * grid.resolution * grid.width, np.array([-s, c]) * grid.resolution * grid.height
    return np.asarray(np.array(grid.origin) + np.array([0.0 * right, right, right + up, up]))


def solid_from_grid(grid: Grid) -> Bytes:
    """Return the cells of a `Grid` as an array (H, W) of uint8, row 0 at the bottom, 1 = solid."""
    solid = np.zeros((grid.height, grid.width), dtype=np.uint8)
    for row, first, last in grid.rows:
        solid[row, first : last + 1] = 1
    return solid


def _check_motion(disc: Circle) -> None:
    """Raise a ValueError unless it is clear how a disc moves."""
    if disc.way is None:
        if any(given is not None for given in (disc.speed_mps, disc.times_s, disc.repeat)):
            raise ValueError("speed_mps, times_s and repeat are those of a 'way'")
        return
    if disc.velocity is not None or (disc.speed_mps is None) == (disc.times_s is None):
        raise ValueError("a disc that moves has either a velocity, or a way with speed_mps or times_s")
    points = [disc.center, *disc.way]
    if disc.times_s is None:
        if max(math.dist(a, b) for a, b in pairwise(points)) == 0.0:
            raise ValueError("the way leads nowhere")
        return
    times = [0.0, *disc.times_s]
    if len(times) != len(points):
        raise ValueError(f"{len(disc.times_s)} times_s for {len(disc.way)} points of the way")
    if disc.repeat == "loop" and points[-1] != points[0]:
        raise ValueError("with times_s the way of a loop ends at its center")
    for index, ((a, b), (t, u)) in enumerate(zip(pairwise(points), pairwise(times), strict=True)):
        if not t < u or math.dist(a, b) > FASTEST_MPS * (u - t):
            raise ValueError(f"times_s {index}: {u:g} s is too early")


def _convex_parts(polygon: Polygon) -> tuple[Floats, list[Floats]]:
    """Return the outline (n, 2) counter-clockwise, and convex parts that fill it; a ValueError says what is wrong."""
    return _parts_inside(np.asarray(polygon.points, dtype=np.float64).tobytes())


@lru_cache(maxsize=4096)
def _parts_inside(corners: bytes) -> tuple[Floats, list[Floats]]:
    """Do the work of `_convex_parts`, once for the same corners: a polygon is checked and compiled several times."""
    points = _without_repeats(np.frombuffer(corners).reshape(-1, 2).copy())
    turns, cross = _turns(points)
    if float(np.sum(turns)) < 0.0:
        points = np.ascontiguousarray(points[::-1])
        turns, cross = _turns(points)
    if np.max(cross) < 1e-9 or np.any(np.abs(turns) > math.pi - 1e-9):
        raise ValueError("the polygon is degenerate: its points lie on a line, or it folds back on itself")
    if np.min(turns) >= -1e-9 and abs(float(np.sum(turns)) - 2.0 * math.pi) < 1e-3:
        return points, [points]
    triangles = points[earcut(points, np.array([len(points)], np.uint32)).reshape(-1, 3).astype(np.int64)]
    areas = np.array([_area(triangle) for triangle in triangles])
    if not math.isclose(np.abs(areas).sum(), _area(points), rel_tol=1e-9):
        raise ValueError("the polygon crosses itself: its edges may only meet in its corners")
    turned = zip(triangles, areas, strict=True)
    return points, [triangle if area > 0.0 else triangle[::-1] for triangle, area in turned if area != 0.0]


def _area(points: Floats) -> float:
    """Return the area [m²] inside corners (n, 2), below 0 where they go round clockwise."""
    x, y = (points - points[0]).T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def _without_repeats(points: Floats) -> Floats:
    """Return the corners (n, 2), checked to be different from the ones before them."""
    lengths = np.hypot(*(np.roll(points, -1, axis=0) - points).T)
    if not np.all(lengths > 0.0):
        index = int(np.argmin(lengths))
        raise ValueError(f"points {index} and {(index + 1) % len(points)} of the polygon are the same")
    return points


def _turns(points: Floats) -> tuple[Floats, Floats]:
    """Return by how much a way round corners (n, 2) turns at each [rad], and the sines of these."""
    edges = np.roll(points, -1, axis=0) - points
    directions = edges / np.hypot(edges[:, 0], edges[:, 1])[:, None]
    following = np.roll(directions, -1, axis=0)
    cross = directions[:, 0] * following[:, 1] - directions[:, 1] * following[:, 0]
    return np.arctan2(cross, np.sum(directions * following, axis=1)), cross


def _circle_rows(spec: WorldSpec) -> Floats:
    rows = [[*o.center, o.radius] for o in spec.obstacles if isinstance(o, Circle) and not o.moves]
    return np.asarray(rows, dtype=np.float64).reshape(-1, 3)


def _joints(wall: Floats) -> Floats:
    """Return the discs (n, 3) that round the ends and corners of a wall (n, 2)."""
    return np.column_stack([wall, np.full(len(wall), 0.5 * WALL_M)])


def _bars(a: Floats, b: Floats) -> list[Floats]:
    """Return the boxes, each as 4 corners counter-clockwise, between the joints at both ends of one straight wall.

    The sides 0-1 and 2-3 lie along the wall, and neighbours share their corners exactly.
    """
    aside = 0.5 * WALL_M * (np.array([a[1] - b[1], b[0] - a[0]]) / math.dist(a, b))
    return [np.array([p - aside, q - aside, q + aside, p + aside]) for p, q in _cut(a, b).reshape(-1, 2, 2)]


def _segment_rows(bars: list[Floats], solids: list[Floats]) -> Floats:
    """Return the long sides of walls, then the edges of polygons (S, 4), in pieces that share their ends exactly.

    The short sides of a wall's boxes lie within the wall.
    """
    sides = [np.hstack([bar[::2], bar[1::2]]) for bar in bars]
    edges = [_cut(a, b) for p in solids for a, b in pairwise(np.vstack([p, p[:1]]))]
    return np.concatenate([np.zeros((0, 4)), *sides, *edges])


def _cut(a: Floats, b: Floats) -> Floats:
    count = max(1, math.ceil(math.dist(a, b) / PIECE_M * (1.0 + 1e-12)))
    points = a + np.linspace(0.0, 1.0, count + 1)[:, None] * (b - a)
    points[-1] = b
    return np.hstack([points[:-1], points[1:]])


def _bin_layout(spec: WorldSpec, circles: Floats, segments: Floats) -> tuple[float, float, float, int, int]:
    """Return x0, y0, size, columns, rows of bins that cover the bounds, circle centres and segments."""
    corners = np.asarray(spec.bounds, dtype=np.float64).reshape(2, 2)
    points = np.vstack([corners, circles[:, :2], segments[:, :2], segments[:, 2:]])
    low, high = points.min(axis=0), points.max(axis=0)
    size = max(BIN_M, float(np.max(high - low)) / BINS_PER_SIDE)
    columns, rows = (max(1, math.ceil(extent / size)) for extent in high - low)
    return float(low[0]), float(low[1]), size, columns, rows


def _counting_sort(keys: Ints, count: int) -> tuple[Ints, Ints]:
    """Return the order that sorts ``keys`` (stable) and the first position (count + 1,) of each key in it."""
    start = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(np.bincount(keys, minlength=count), out=start[1:])
    return np.argsort(keys, kind="stable").astype(np.int64), start


def _polygon_entries(
    polygons: list[Floats], x0: float, y0: float, size: float, columns: int, rows: int
) -> tuple[Ints, Ints]:
    """Return which polygons' bounding boxes meet each bin, as (items, start)."""
    keys: list[Ints] = [np.zeros(0, dtype=np.int64)]
    items: list[Ints] = [np.zeros(0, dtype=np.int64)]
    entries = 0
    for index, polygon in enumerate(polygons):
        first = np.floor((polygon.min(axis=0) - [x0, y0]) / size).astype(np.int64)
        last = np.floor((polygon.max(axis=0) - [x0, y0]) / size).astype(np.int64)
        column = np.arange(max(0, first[0]), min(columns - 1, last[0]) + 1)
        row = np.arange(max(0, first[1]), min(rows - 1, last[1]) + 1)
        entries += len(column) * len(row)
        if entries > MOST_ENTRIES:
            raise ConfigError("obstacles", "too many polygons are too large: make them fewer or smaller")
        keys.append((np.minimum(row, rows - 1)[:, None] * columns + column).ravel())
        items.append(np.full(keys[-1].size, index, dtype=np.int64))
    order, start = _counting_sort(np.concatenate(keys), columns * rows)
    return np.ascontiguousarray(np.concatenate(items)[order]), start


def _solid_arrays(spec: WorldSpec) -> tuple[Bytes, Floats, Floats, float]:
    for obstacle in spec.obstacles:
        if isinstance(obstacle, Grid):
            origin = np.asarray(obstacle.origin, dtype=np.float64)
            turn = np.array([math.cos(obstacle.yaw), math.sin(obstacle.yaw)])
            return solid_from_grid(obstacle), origin, turn, float(obstacle.resolution)
    return np.zeros((0, 0), dtype=np.uint8), np.zeros(2), np.array([1.0, 0.0]), 1.0


def _gap(solid: Bytes) -> Bytes:
    gap = np.where(solid != 0, 0, GAP_CAP).astype(np.uint8)
    _spread_gap(gap)
    return gap


@jit
def _spread_gap(gap: Bytes) -> None:
    """Fill ``gap`` (H, W), 0 at solid cells, with the steps to the nearest of them: two sweeps are exact."""
    height, width = gap.shape
    for backward in range(2):
        for i in range(height):
            row = height - 1 - i if backward else i
            before = row + 1 if backward else row - 1
            for j in range(width):
                col = width - 1 - j if backward else j
                left = col + 1 if backward else col - 1
                right = col - 1 if backward else col + 1
                least = int(gap[row, col])
                if 0 <= left < width:
                    least = min(least, int(gap[row, left]) + 1)
                if 0 <= before < height:
                    least = min(least, int(gap[before, col]) + 1)
                    if 0 <= left < width:
                        least = min(least, int(gap[before, left]) + 1)
                    if 0 <= right < width:
                        least = min(least, int(gap[before, right]) + 1)
                gap[row, col] = least
