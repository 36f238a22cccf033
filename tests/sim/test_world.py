"""The description of the world refuses what makes no sense, and its arrays hold exactly what it says."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from swarmscope.onboard.rig import GUARDING
from swarmscope.sim.world import (
    WALL_M,
    Circle,
    Grid,
    Polygon,
    Wall,
    World,
    WorldSpec,
    compile_world,
    grid_from_solid,
    solid_from_grid,
)

BOUNDS = (0.0, 0.0, 10.0, 10.0)
SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]
PENTAGRAM = [(math.cos(4 * math.pi * k / 5), math.sin(4 * math.pi * k / 5)) for k in range(5)]


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(0, 0), (1, 0)], "at least 3"),
        ([(0, 0), (1, 0), (2, 0)], "degenerate"),
        ([(0, 0), (1, 0), (0, 0.0), (1, 1)], "degenerate|crosses"),
        ([(0, 0), (1, 0), (1, 0), (0, 1)], "points 1 and 2 of the polygon are the same"),
        ([*SQUARE, (0, 0)], "points 4 and 0 of the polygon are the same"),
        ([(0, 0), (1, 1), (1, 0), (0, 1)], "crosses itself|degenerate"),
        ([(0, 0), (4, 0), (4, 3), (2, -1), (0, 3)], "crosses itself"),
        (PENTAGRAM, "crosses itself"),
        ([(0, 0), (math.nan, 0), (0, 1)], "finite"),
        ([(0, 0), (math.inf, 0), (0, 1)], "finite"),
        ([(0, 0), (1e300, 0), (0, 1)], "less than"),
        ([(0, 0), ("1", 0), (0, 1)], "must be a number"),
        ([(0, 0), (True, 0), (0, 1)], "must be a number"),
    ],
)
def test_polygon_says_what_is_wrong(points, message):
    with pytest.raises(ValidationError, match=message):
        Polygon(points=points)


@pytest.mark.parametrize("points", [SQUARE, SQUARE[::-1], [(0, 0), (0.5, 0), (1, 0), (1, 1)]])
def test_polygon_takes_either_orientation_and_straight_corners(points):
    world = compile_world(WorldSpec(obstacles=[Polygon(points=points)], bounds=BOUNDS))
    x, y = world.vertices.T
    assert 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) > 0.0


@pytest.mark.parametrize(
    "obstacle",
    [
        {"type": "circle", "center": [0, 0], "radius": 0},
        {"type": "circle", "center": [0, 0], "radius": math.nan},
        {"type": "circle", "center": [0], "radius": 1},
        {"type": "circle", "center": [0, 0], "radius": 1, "colour": "red"},
        {"type": "sphere", "center": [0, 0], "radius": 1},
        {"type": "wall", "points": [[0, 0]]},
        {"type": "wall", "points": [[0, 0], [0, 0]]},
        {"type": "grid", "resolution": 1, "origin": [0, 0], "width": 2, "height": 2, "rows": [[0, 0, 2]]},
        {"type": "grid", "resolution": 1, "origin": [0, 0], "width": 2, "height": 2, "rows": [[2, 0, 0]]},
        {"type": "grid", "resolution": 1, "origin": [0, 0], "width": 2, "height": 2, "rows": [[0, 1, 0]]},
        {"type": "grid", "resolution": 0, "origin": [0, 0], "width": 2, "height": 2, "rows": []},
        {"type": "grid", "resolution": 1, "origin": [0, 0], "width": 10**6, "height": 10**6, "rows": []},
    ],
)
def test_malformed_obstacles_are_refused(obstacle):
    with pytest.raises(ValidationError):
        WorldSpec(obstacles=[obstacle], bounds=BOUNDS)


@pytest.mark.parametrize("bounds", [(0, 0, 0, 1), (1, 0, 0, 1), (0, 0, math.inf, 1), (0, 0, 1)])
def test_bounds_are_checked(bounds):
    with pytest.raises(ValidationError):
        WorldSpec(bounds=bounds)


def test_two_grids_are_refused():
    grid = Grid(resolution=1, origin=(0, 0), width=1, height=1, rows=[])
    with pytest.raises(ValidationError, match="one grid"):
        WorldSpec(obstacles=[grid, grid], bounds=BOUNDS)


def test_description_survives_json():
    spec = WorldSpec(
        obstacles=[
            Circle(center=(1, 2), radius=0.5),
            Polygon(points=SQUARE),
            Wall(points=[(0, 0), (3, 0)]),
            Grid(resolution=0.5, origin=(0, 0), width=3, height=2, rows=[(1, 0, 2)]),
        ],
        bounds=BOUNDS,
    )
    assert WorldSpec.model_validate(json.loads(spec.model_dump_json())) == spec


def test_walls_are_cut_into_pieces_that_join_exactly():
    world = compile_world(WorldSpec(obstacles=[Wall(points=[(0.1, 0.2), (3.3, 4.4)])], bounds=BOUNDS))
    along = np.array([3.2, 4.2]) / math.hypot(3.2, 4.2)
    aside = 0.5 * WALL_M * np.array([-along[1], along[0]])
    for side in (1.0, -1.0):
        a, b = np.array([0.1, 0.2]) + side * aside, np.array([3.3, 4.4]) + side * aside
        ends = [(p, q) for p, q in world.segments.reshape(-1, 2, 2) if side * float((p - (0.1, 0.2)) @ aside) > 0.0]
        pieces = np.array(sorted((sorted((p.tolist(), q.tolist())) for p, q in ends)))
        lengths = np.linalg.norm(pieces[:, 1] - pieces[:, 0], axis=1)
        assert lengths.max() <= 1.0 + 1e-12
        assert math.isclose(lengths.sum(), math.dist(a, b))
        assert np.array_equal(pieces[1:, 0], pieces[:-1, 1])
        assert np.allclose([pieces[0, 0], pieces[-1, 1]], [a, b], rtol=0.0, atol=1e-15)
    assert sorted(map(tuple, world.circles.tolist())) == [(0.1, 0.2, 0.5 * WALL_M), (3.3, 4.4, 0.5 * WALL_M)]


@pytest.mark.parametrize("length", [5e-324, 1e-12, 1.0, 2.0, math.nextafter(2.0, 0.0), 7.0])
@pytest.mark.parametrize("angle", [0.0, 0.3, 2.0])
def test_walls_of_any_length_have_two_sides_of_as_many_pieces(length, angle):
    end = (length * math.cos(angle), length * math.sin(angle))
    world = compile_world(WorldSpec(obstacles=[Wall(points=[(0.0, 0.0), end])], bounds=BOUNDS))
    assert len(world.segments) == 2 * (len(world.vertex_start) - 1)
    assert np.all(np.isfinite(world.segments))
    assert np.all(np.isfinite(world.vertices))


def test_walls_are_as_thick_as_the_narrowest_thing_that_the_guard_counts_on():
    assert GUARDING.thinnest_m == WALL_M


def test_arrays_have_the_same_types_in_an_empty_and_a_full_world():
    full = compile_world(
        WorldSpec(
            obstacles=[
                Circle(center=(1, 2), radius=1),
                Polygon(points=SQUARE),
                Grid(resolution=1, origin=(0, 0), width=3, height=2, rows=[(0, 1, 2)]),
            ],
            bounds=BOUNDS,
        )
    )
    empty = compile_world(WorldSpec(bounds=(0, 0, 1, 1)))
    assert _types(full) == _types(empty)
    assert empty.circles.shape == (0, 3)
    assert empty.segments.shape == (0, 4)
    assert empty.solid.shape == (0, 0)


def _types(part):
    if isinstance(part, tuple):
        return [_types(value) for value in part]
    return (part.dtype, part.ndim, part.flags.c_contiguous) if isinstance(part, np.ndarray) else type(part)


@given(st.lists(st.tuples(st.floats(-30, 30), st.floats(-30, 30), st.floats(0.01, 3)), max_size=30))
def test_bins_hold_every_circle_once_where_its_centre_is(rows):
    circles = [Circle(center=(x, y), radius=r) for x, y, r in rows]
    world = compile_world(WorldSpec(obstacles=circles, bounds=BOUNDS))
    assert sorted(map(tuple, world.circles.tolist())) == sorted(rows)
    bins = world.bins
    assert bins.circle_start[-1] == len(rows)
    for b in range(bins.columns * bins.rows):
        for x, y, _ in world.circles[bins.circle_start[b] : bins.circle_start[b + 1]]:
            column, row = b % bins.columns, b // bins.columns
            assert -1e-9 <= x - bins.x0 - column * bins.size <= bins.size + 1e-9
            assert -1e-9 <= y - bins.y0 - row * bins.size <= bins.size + 1e-9


def test_a_huge_world_has_a_bounded_number_of_bins():
    circles = [Circle(center=(-9e4, 0), radius=1), Circle(center=(9e4, 5e4), radius=1)]
    bins = compile_world(WorldSpec(obstacles=circles, bounds=BOUNDS)).bins
    assert bins.columns * bins.rows <= 513 * 513


@settings(max_examples=50)
@given(st.integers(1, 12), st.integers(1, 12), st.randoms(use_true_random=False))
def test_grid_runs_round_trip_and_gap_is_the_chessboard_distance(height, width, random):
    solid = np.array([[random.random() < 0.15 for _ in range(width)] for _ in range(height)])
    grid = grid_from_solid(solid, 0.5, (1.0, 2.0))
    assert np.array_equal(solid_from_grid(grid), solid)
    world: World = compile_world(WorldSpec(obstacles=[grid], bounds=BOUNDS))
    cells = np.argwhere(solid)
    for row in range(height):
        for col in range(width):
            steps = np.abs(cells - [row, col]).max(axis=1).min() if len(cells) else 255
            assert world.solid_gap[row, col] == steps
