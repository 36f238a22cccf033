"""Painting and labelling against slow, obvious versions."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import ndimage

from swarmscope.sim.contact import static_clearance
from swarmscope.sim.world import Circle, Polygon, Wall, WorldSpec, compile_world, grid_from_solid
from swarmscope.tasks._occupancy import (
    Raster,
    cells_of,
    centres_of,
    components,
    domain_of,
    free_cells_near,
    labels_at,
    rasterise,
)
from swarmscope.tasks._search import Searcher

SPECS = {
    "circles": [Circle(center=(0.3, -0.2), radius=0.4), Circle(center=(1.6, 1.1), radius=0.2)],
    "walls": [Wall(points=[(-1.7, -1.2), (0.9, 1.3), (1.5, -3.0)])],
    "polygons": [Polygon(points=[(-1.0, -1.0), (1.3, -0.6), (0.2, 1.4)])],
    "grid": [grid_from_solid(np.random.default_rng(1).random((20, 25)) < 0.15, 0.13, (-1.5, -1.2))],
}


@pytest.mark.parametrize("kind", SPECS)
@pytest.mark.parametrize("inflate", [0.15, 0.4])
def test_a_cell_is_blocked_when_its_centre_is_too_close(kind: str, inflate: float) -> None:
    spec = WorldSpec(obstacles=SPECS[kind], bounds=(-2.0, -2.0, 2.0, 2.0))
    world = compile_world(spec)
    raster = rasterise(world, inflate, domain_of(spec, [], 0.5))
    assert raster.blocked.shape == (100, 100)
    cells = np.array(list(itertools.product(range(100), range(100))))
    near = [static_clearance(world, x, y, x, y, 1.0) < inflate for x, y in centres_of(raster, cells).tolist()]
    np.testing.assert_array_equal(raster.blocked.ravel(), np.array(near, dtype=np.uint8))


def random_raster(seed: int, share: float) -> Raster:
    blocked = (np.random.default_rng(seed).random((17, 23)) < share).astype(np.uint8)
    return Raster(blocked, -1.0, 2.0, 0.05)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.2, 0.4, 0.6, 1.0]))
def test_labels_agree_with_an_independent_library(seed: int, share: float) -> None:
    raster = random_raster(seed, share)
    cells = np.array(list(itertools.product(range(17), range(23))))
    ours = labels_at(components(raster), cells).reshape(17, 23)
    theirs, count = ndimage.label(raster.blocked == 0)
    assert np.array_equal(ours < 0, theirs == 0)
    assert len({*zip(ours[ours >= 0], theirs[ours >= 0], strict=True)}) == count == len({*ours[ours >= 0]})


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([0.0, 0.2, 0.35]))
def test_search_agrees_with_a_plain_relaxation(seed: int, share: float) -> None:
    raster = random_raster(seed, share)
    rng = np.random.default_rng(seed)
    start, goal = (np.array([rng.integers(17), rng.integers(23)]) for _ in range(2))
    searcher = Searcher(raster)
    searcher.path(goal, start)  # a search before must not change the next
    expected = 0.05 * relaxed(raster.blocked, start, goal)
    assert searcher.length_m(start, goal) == pytest.approx(expected, abs=1e-9)
    path = searcher.path(start, goal)
    if math.isfinite(expected):
        assert np.array_equal(path[0], start) and np.array_equal(path[-1], goal)
        assert np.abs(np.diff(path, axis=0)).max(initial=0) <= 1


def relaxed(blocked: np.ndarray, start: np.ndarray, goal: np.ndarray) -> float:
    """Bellman-Ford over all steps."""
    free = np.pad(blocked == 0, 1)
    cost = np.full(free.shape, math.inf)
    if free[tuple(start + 1)]:
        cost[tuple(start + 1)] = 0.0
    while True:
        before = cost.copy()
        for dr, dc in itertools.product((-1, 0, 1), repeat=2):
            open_beside = np.roll(free, dr, 0) & np.roll(free, dc, 1)
            moved = np.roll(cost, (dr, dc), (0, 1)) + math.hypot(dr, dc)
            cost = np.where(free & open_beside & (moved < cost), moved, cost)
        if np.array_equal(before, cost):
            return float(cost[tuple(goal + 1)])


def test_the_nearest_free_cell_is_found() -> None:
    blocked = np.ones((9, 9), dtype=np.uint8)
    blocked[4, 7] = blocked[0, 4] = 0
    raster = Raster(blocked, 0.0, 0.0, 1.0)
    points = np.array([[4.5, 4.5], [7.5, 4.5], [0.5, 8.5]])
    assert cells_of(raster, points).tolist() == [[4, 4], [4, 7], [8, 0]]
    assert free_cells_near(raster, points, 3).tolist() == [[4, 7], [4, 7], [8, 0]]
