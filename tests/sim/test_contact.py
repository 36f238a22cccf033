"""Clearance of a path against hand-worked values, dense sampling and the symmetries of the plane."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.sim.contact import static_clearance
from swarmscope.sim.world import WALL_M, Circle, Polygon, Wall, WorldSpec, compile_world, grid_from_solid

BOUNDS = (0.0, 0.0, 10.0, 10.0)
SQUARE = Polygon(points=[(2, 2), (2, 4), (4, 4), (4, 2)])


def world_of(*obstacles):
    return compile_world(WorldSpec(obstacles=list(obstacles), bounds=BOUNDS))


def clearance(world, a, b=None, limit=5.0):
    b = a if b is None else b
    return static_clearance(world, float(a[0]), float(a[1]), float(b[0]), float(b[1]), float(limit))


@pytest.mark.parametrize(
    ("obstacle", "a", "b", "expected"),
    [
        (Circle(center=(3, 0), radius=1), (0, 0), (0, 0), 2.0),
        (Circle(center=(3, 0), radius=1), (3, 0), (3, 0), 0.0),
        (Circle(center=(3, 0), radius=1), (2.1, 0), (2.1, 0), 0.0),
        (Circle(center=(3, 0), radius=1), (0, 2), (6, 2), 1.0),
        (Circle(center=(3, 0), radius=1), (0, 0.5), (6, 0.5), 0.0),
        (Wall(points=[(0, 0), (8, 0)]), (1, 2), (1, 0.25), 0.24),
        (Wall(points=[(0, 0), (8, 0)]), (-1, 0), (-1, 0), 0.99),
        (Wall(points=[(0, 0), (8, 0)]), (9, 1), (9, 1), math.sqrt(2) - 0.01),
        (Wall(points=[(0, 0), (8, 0)]), (3.3, 0.009), (3.3, 0.001), 0.0),
        (Wall(points=[(0, 0), (8, 0), (8, 8)]), (8.5, -0.5), (8.5, -0.5), math.hypot(0.5, 0.5) - 0.01),
        (Wall(points=[(0, 0), (8, 0)]), (1, 2), (1, -2), 0.0),
        (Wall(points=[(0, 0), (8, 0)]), (-3, 4), (-3, 4), 4.99),
        (SQUARE, (3, 3), (3, 3), 0.0),
        (SQUARE, (2.001, 3.99), (2.001, 3.99), 0.0),
        (SQUARE, (0, 3), (6, 3), 0.0),
        (SQUARE, (3, 3), (9, 9), 0.0),
        (SQUARE, (1, 1), (1, 1), math.sqrt(2)),
        (SQUARE, (0, 5), (6, 5), 1.0),
        (SQUARE, (1, 3), (3, 1), 0.0),
        (SQUARE, (0.5, 3), (3, 0.5), 0.5 / math.sqrt(2)),
        (Circle(center=(50, 50), radius=30), (50, 85), (50, 84), 4.0),
        (Circle(center=(-50, 5), radius=1), (-48, 5), (-47, 5), 1.0),
    ],
)
def test_hand_worked(obstacle, a, b, expected):
    world = world_of(obstacle)
    assert clearance(world, a, b) == pytest.approx(expected, abs=1e-12)
    assert clearance(world, b, a) == pytest.approx(expected, abs=1e-12)
    assert clearance(world, a, b, limit=0.1) == pytest.approx(min(expected, 0.1), abs=1e-12)


@pytest.mark.parametrize(
    ("a", "b", "expected"),
    [
        ((1.0, 1.0), (1.0, 1.0), 0.5),
        ((1.6, 1.1), (1.6, 1.1), 0.0),
        ((1.0, 1.25), (3.0, 1.25), 0.0),
        ((1.75, 3.0), (1.75, 2.0), 0.5),
        ((1.0, 2.0), (2.5, 2.0), 0.5),
        ((1.2, 1.9), (1.2, 1.9), 0.5),
        ((0.0, 0.0), (0.0, 0.0), math.hypot(1.5, 1.0)),
        ((5.0, 1.25), (4.0, 1.25), 2.0),
    ],
)
def test_grid_hand_worked(a, b, expected):
    solid = np.zeros((4, 6))
    solid[2, 3] = 1  # covers x 1.5 .. 2, y 1 .. 1.5
    world = world_of(grid_from_solid(solid, 0.5, (0.0, 0.0)))
    assert clearance(world, a, b) == pytest.approx(expected, abs=1e-12)
    assert clearance(world, b, a) == pytest.approx(expected, abs=1e-12)
    assert clearance(world, a, b, limit=0.25) == pytest.approx(min(expected, 0.25), abs=1e-12)


def test_nothing_near_gives_the_limit():
    assert clearance(world_of(), (1, 1), (2, 2), limit=0.7) == 0.7
    assert clearance(world_of(Circle(center=(9, 9), radius=0.1)), (1, 1), limit=0.7) == 0.7
    assert clearance(world_of(), (1, 1), limit=0.0) == 0.0


def test_nan_is_handed_on():
    world = world_of(SQUARE, Circle(center=(9, 9), radius=0.1))
    assert math.isnan(clearance(world, (math.nan, 1)))
    assert math.isnan(clearance(world, (1, 1), (1, math.nan)))


def inside_convex(points, p):
    """Whether each point of p (n, 2) lies in the convex polygon, either orientation."""
    sides = []
    for a, b in zip(points, np.roll(points, -1, axis=0), strict=True):
        sides.append((b[0] - a[0]) * (p[:, 1] - a[1]) - (b[1] - a[1]) * (p[:, 0] - a[0]))
    return np.all(np.array(sides) >= 0, axis=0) | np.all(np.array(sides) <= 0, axis=0)


def to_segment(p, a, b):
    t = np.clip((p - a) @ (b - a) / ((b - a) @ (b - a)), 0, 1)
    return np.linalg.norm(p - (a + t[:, None] * (b - a)), axis=1)


def sampled_clearance(obstacles, a, b, count=4001):
    """The clearance by sampling the path densely: at most half a step too large."""
    p = a + np.linspace(0, 1, count)[:, None] * (b - a)
    best = math.inf
    for obstacle in obstacles:
        if isinstance(obstacle, Circle):
            best = min(best, (np.linalg.norm(p - obstacle.center, axis=1) - obstacle.radius).min())
            continue
        points, thick = np.array(obstacle.points), 0.5 * WALL_M
        if isinstance(obstacle, Polygon):
            if inside_convex(points, p).any():
                return 0.0
            points, thick = np.vstack([points, points[:1]]), 0.0
        best = min(best, *(to_segment(p, c, d).min() - thick for c, d in pairwise(points)))
    return max(best, 0.0)


def random_obstacles(rng, count=6):
    obstacles = []
    for _ in range(count):
        corners = rng.uniform(0, 2 * math.pi) + 2 * math.pi / (k := rng.integers(3, 7)) * np.arange(k)
        ring = np.column_stack([np.cos(corners), np.sin(corners)])
        obstacles += [
            Circle(center=rng.uniform(0, 10, 2), radius=rng.uniform(0.1, 1)),
            Polygon(points=rng.uniform(0, 10, 2) + rng.uniform(0.2, 1.5) * ring),
            Wall(points=rng.uniform(0, 10, (2, 2))),
        ]
    return obstacles


@pytest.mark.parametrize("seed", range(20))
def test_equals_dense_sampling_of_the_path(seed):
    rng = np.random.default_rng(seed)
    obstacles = random_obstacles(rng, count=int(rng.integers(1, 5)))
    world = world_of(*obstacles)
    for length in (0.0, 0.05, 3.0):
        a = rng.uniform(-1, 11, 2)
        b = a + length * rng.uniform(-1, 1, 2)
        limit = rng.uniform(0.2, 4)
        expected = min(sampled_clearance(obstacles, a, b), limit)
        assert clearance(world, a, b, limit) == pytest.approx(
            expected, abs=np.linalg.norm(b - a) / 7000 + 1e-9
        )


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.tuples(st.floats(-90, 90), st.floats(-90, 90)), st.floats(-10, 10))
def test_moving_everything_together_changes_nothing(seed, shift, turn):
    rng = np.random.default_rng(seed)
    c, s = math.cos(turn), math.sin(turn)

    def move(points):
        return np.asarray(points) @ np.array([[c, s], [-s, c]]) + shift

    obstacles = random_obstacles(rng, 3)
    moved = [
        Circle(center=move(o.center), radius=o.radius)
        if isinstance(o, Circle)
        else type(o)(points=move(o.points))
        for o in obstacles
    ]
    a, b = rng.uniform(0, 10, (2, 2))
    b = a + 0.2 * (b - a)
    here, there = clearance(world_of(*obstacles), a, b), clearance(world_of(*moved), move(a), move(b))
    assert there == pytest.approx(here, abs=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_grid_equals_a_world_of_squares(seed):
    rng = np.random.default_rng(seed)
    solid = rng.random((20, 30)) < (0.02, 0.2)[seed % 2]
    grid = world_of(grid_from_solid(solid, 0.25, (-1.0, 0.5)))
    squares = []
    for row, col in np.argwhere(solid):
        x, y = -1.0 + 0.25 * col, 0.5 + 0.25 * row
        squares.append(Polygon(points=[(x, y), (x + 0.25, y), (x + 0.25, y + 0.25), (x, y + 0.25)]))
    polygons = world_of(*squares)
    for _ in range(100):
        a = rng.uniform((-2, -0.5), (7.5, 6.5))
        b = a + rng.uniform(-1, 1, 2) * rng.choice([0.0, 0.05, 1.0])
        limit = rng.uniform(0.05, 3)
        assert clearance(grid, a, b, limit) == pytest.approx(clearance(polygons, a, b, limit), abs=1e-9)


@settings(max_examples=100, deadline=None)
@given(st.integers(0, 2**32 - 1), st.floats(0, 1))
def test_a_path_is_as_clear_as_the_less_clear_of_its_parts(seed, share):
    rng = np.random.default_rng(seed)
    world = world_of(*random_obstacles(rng, 3))
    a, b = rng.uniform(0, 10, (2, 2))
    middle = a + share * (b - a)
    parts = min(clearance(world, a, middle), clearance(world, middle, b))
    assert clearance(world, a, b) == pytest.approx(parts, abs=1e-9)


@pytest.mark.parametrize("seed", range(10))
def test_a_wall_is_found_from_anywhere_along_it_with_a_small_limit(seed):
    rng = np.random.default_rng(seed)
    a, b = rng.uniform(0, 10, (2, 2))
    world = world_of(Wall(points=[a, b]))
    normal = np.array([a[1] - b[1], b[0] - a[0]]) / np.linalg.norm(b - a)
    for share in np.linspace(0, 1, 101):
        assert clearance(world, a + share * (b - a) + 0.03 * normal, limit=0.03) == pytest.approx(0.02)
