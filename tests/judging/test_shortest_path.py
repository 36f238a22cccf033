import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.judging.shortest_path import any_angle_paths, grid_paths, lengths_m, path_length_m
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.world import Circle, Polygon, Wall, WorldSpec, compile_world
from swarmscope.tasks import load_task

BOUNDS = (-5.0, -5.0, 5.0, 5.0)
OCTILE = 1.0 / math.cos(math.pi / 8.0)  # 1.0824, the worst case of 8 directions


def world(*obstacles) -> WorldSpec:
    return WorldSpec(obstacles=list(obstacles), bounds=BOUNDS)


def one(paths_of, spec: WorldSpec, start: tuple, goal: tuple, radius: float = 0.2):
    return paths_of(spec, np.array([start], dtype=float), np.array([goal], dtype=float), radius)[0]


def test_grid_paths_worked_by_hand() -> None:
    straight = one(grid_paths, world(), (0.025, 0.025), (3.025, 0.025))
    assert straight.length_m == pytest.approx(3.0) and not straight.exact
    knight = one(grid_paths, world(), (0.025, 0.025), (2.025, 1.025))
    assert knight.length_m == pytest.approx(1.0 + math.sqrt(2.0), abs=1e-9)
    assert one(grid_paths, world(), (1.0, 1.0), (1.0, 1.0)).length_m == 0.0


def test_around_one_disc_is_two_tangents_and_an_arc() -> None:
    way = one(any_angle_paths, world(Circle(center=(0, 0), radius=0.8)), (-3, 0), (2, 0))
    r = 0.8 + 0.2
    expected = (
        math.sqrt(9 - r * r) + math.sqrt(4 - r * r) + r * (math.pi - math.acos(r / 3) - math.acos(r / 2))
    )
    assert way.exact and way.length_m == pytest.approx(expected, abs=1e-9)
    assert path_length_m(way.points) == pytest.approx(expected, abs=1e-3)
    np.testing.assert_allclose(way.points[[0, -1]], [[-3, 0], [2, 0]], atol=1e-9)


def test_a_belt_round_two_equal_discs_is_straight_between_them() -> None:
    discs = world(Circle(center=(-1, 0), radius=0.8), Circle(center=(1, 0), radius=0.8))
    expected = (
        2.0 * (math.sqrt(3.0) + (math.pi / 2.0 - math.acos(0.5))) + 2.0
    )  # start 2 m from the first centre
    assert one(any_angle_paths, discs, (-3, 0), (3, 0)).length_m == pytest.approx(expected, abs=1e-9)


def test_overlapping_discs_close_the_arc_between_them() -> None:
    wall = [Circle(center=(0, 0.5 * k), radius=0.3) for k in range(-6, 3)]  # ends at y = 1 and -3
    way = one(any_angle_paths, world(*wall), (-2, -0.5), (2, -0.5))
    hook = math.hypot(2.0, 1.5)  # from the start to the centre of the last disc
    turn = 2.0 * (math.pi / 2.0 - math.acos(0.5 / hook) + math.atan2(1.5, 2.0))
    assert way.exact
    assert way.length_m == pytest.approx(2.0 * math.sqrt(hook**2 - 0.25) + 0.5 * turn, abs=1e-9)


def test_an_arc_of_more_than_half_a_turn() -> None:
    barrier = [Circle(center=(1.3 + 0.3 * k, 0), radius=0.1) for k in range(20)]  # closes the short way
    way = one(any_angle_paths, world(Circle(center=(0, 0), radius=1.0), *barrier), (1.5, 0.6), (1.5, -0.6))
    away = math.hypot(1.5, 0.6)
    turn = 2.0 * math.pi - 2.0 * (math.atan2(0.6, 1.5) + math.acos(1.2 / away))
    assert turn > math.pi
    assert way.length_m == pytest.approx(2.0 * math.sqrt(away**2 - 1.44) + 1.2 * turn, abs=1e-9)
    assert path_length_m(way.points) == pytest.approx(way.length_m, abs=1e-3)
    assert way.points[:, 0].min() == pytest.approx(-1.2, abs=1e-3)


def test_out_of_a_ring_and_round_it() -> None:
    ring = [
        Circle(center=(1.5 * math.cos(a), 1.5 * math.sin(a)), radius=0.4) for a in np.linspace(0.6, 5.68, 24)
    ]
    way, grid = (one(paths, world(*ring), (0, 0), (-3, 0), 0.1) for paths in (any_angle_paths, grid_paths))
    assert way.exact and 4.0 < way.length_m <= grid.length_m + 1e-3
    assert path_length_m(way.points) == pytest.approx(way.length_m, abs=2e-3)


def test_walls_polygons_and_grids_give_upper_bounds() -> None:
    wall = world(Wall(points=[(0, -3), (0, 1)]))
    way = one(any_angle_paths, wall, (-2, 0), (2, 0))
    tip = math.hypot(2, 1)
    arc = 0.2 * 2.0 * (math.pi / 2.0 - math.acos(0.2 / tip) + math.atan2(1, 2))
    shortest = 2.0 * math.sqrt(tip**2 - 0.04) + arc
    assert not way.exact and shortest - 5e-3 <= way.length_m <= 1.03 * shortest
    box = world(Polygon(points=[(-1, -1), (1, -1), (1, 1), (-1, 1)]))
    assert (
        one(any_angle_paths, box, (-2, 0), (2, 0)).length_m < one(grid_paths, box, (-2, 0), (2, 0)).length_m
    )


def test_no_way_is_nan() -> None:
    box = world(Wall(points=[(-1, -1), (1, -1), (1, 1), (-1, 1), (-1, -1)]))
    for paths_of in (grid_paths, any_angle_paths):
        way = one(paths_of, box, (0, 0), (3, 0))
        assert math.isnan(way.length_m) and way.points.shape == (0, 2)


def test_the_window_does_not_change_the_result() -> None:
    long_wall = world(Wall(points=[(0, -4.9), (0, 60)]), Wall(points=[(0, -4.9), (-60, -4.9)]))
    detour = one(grid_paths, world(Wall(points=[(0, -6.4), (0, 6.9)])), (-0.5, 0), (0.5, 0))
    assert detour.length_m >= 2.0 * (6.4 - 0.3)  # round the lower end, beyond the first window
    assert detour.points[:, 1].min() < -6.4
    assert math.isnan(one(grid_paths, long_wall, (-0.5, 0), (0.5, 0)).length_m)


@pytest.mark.parametrize("task", ["T1", "T2", "T3"])
def test_forest_lengths_are_in_order(task: str) -> None:
    for seed in range(3):
        setup = load_task(task).make(seed)
        grid = grid_paths(setup.world, setup.starts, setup.goals, 0.15)
        free = any_angle_paths(setup.world, setup.starts, setup.goals, 0.15)
        straight = np.hypot(*(setup.goals - setup.starts[:, :2]).T)
        assert all(way.exact for way in free)
        assert np.all(lengths_m(free) >= straight - 1e-9)
        assert np.all(lengths_m(grid) >= lengths_m(free) - 1e-3)
        assert np.all(lengths_m(grid) <= OCTILE * lengths_m(free) * 1.02)
        compiled = compile_world(setup.world)
        for way, slack in [*((w, 2e-3) for w in grid), *((w, 2e-4) for w in free)]:
            for (ax, ay), (bx, by) in itertools.pairwise(way.points.tolist()):
                assert static_clearance(compiled, ax, ay, bx, by, 1.0) >= 0.15 - slack


coordinates = st.floats(-2.0, 2.0)
discs = st.lists(st.tuples(coordinates, coordinates, st.floats(0.1, 0.8)), max_size=7)


@settings(max_examples=60, deadline=None)
@given(discs)
def test_exact_ways_are_clear_symmetric_and_not_longer_than_fine_grids(some: list) -> None:
    spec = world(*[Circle(center=(x, y), radius=r) for x, y, r in some])
    way, back = one(any_angle_paths, spec, (-4, 0), (4, 0.3)), one(any_angle_paths, spec, (4, 0.3), (-4, 0))
    fine = grid_paths(spec, np.array([[-4.0, 0.0]]), np.array([[4.0, 0.3]]), 0.21, 0.02)[0]
    if not math.isfinite(way.length_m) or not math.isfinite(fine.length_m):
        return
    assert way.exact and way.length_m == pytest.approx(back.length_m, abs=1e-9)
    assert math.hypot(8, 0.3) - 1e-9 <= way.length_m <= fine.length_m
    compiled = compile_world(spec)
    for (ax, ay), (bx, by) in itertools.pairwise(way.points.tolist()):
        assert static_clearance(compiled, ax, ay, bx, by, 1.0) >= 0.2 - 4e-4
