"""The lidar's ranges against hand-worked values, a plain brute force, and the symmetries of the plane."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.errors import ConfigError
from swarmscope.geometry import rough_angle
from swarmscope.sim.beams import make_beams
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.lidar import ANGLE_SLACK, cast_disc, cast_static
from swarmscope.sim.maps import load_map, packaged_map
from swarmscope.sim.world import WALL_M, Circle, Polygon, Wall, WorldSpec, compile_world, grid_from_solid

BOUNDS = (0.0, 0.0, 10.0, 10.0)
FULL = 2.0 * math.pi


def world_of(*obstacles):
    return compile_world(WorldSpec(obstacles=list(obstacles), bounds=BOUNDS))


def scan(world, pose, beams):
    out = np.full(len(beams.cos), -1.0, dtype=np.float32)
    cast_static(world, *map(float, pose), beams, out)
    return out


def plain_scan(obstacles, pose, beams):
    """Every beam against every obstacle as it is described, in world coordinates, in double precision."""
    angles = pose[2] + beams.angle_min + beams.increment * np.arange(len(beams.cos))
    dx, dy = np.cos(angles)[:, None], np.sin(angles)[:, None]
    discs, lines = [], []
    for obstacle in obstacles:
        if isinstance(obstacle, Circle):
            discs.append((*obstacle.center, obstacle.radius))
        elif isinstance(obstacle, Polygon):
            lines += zip(obstacle.points, [*obstacle.points[1:], obstacle.points[0]], strict=True)
        else:
            discs += [(*point, 0.5 * WALL_M) for point in obstacle.points]
            lines += [side for a, b in pairwise(np.array(obstacle.points)) for side in both_sides(a, b)]
    with np.errstate(all="ignore"):
        cx, cy, r = np.array(discs).reshape(-1, 3).T - np.array([*pose[:2], 0.0])[:, None]
        along, half = cx * dx + cy * dy, np.sqrt(r**2 - (cx * dy - cy * dx) ** 2)
        circle = np.where(along - half >= 0, along - half, along + half)
        ax, ay, bx, by = np.array(lines).reshape(-1, 4).T - np.array([*pose[:2], *pose[:2]])[:, None]
        side_a, side_b = ax * dy - ay * dx, bx * dy - by * dx
        segment = np.where(side_a * side_b <= 0, (ax * by - ay * bx) / (side_a - side_b), np.inf)
    every = np.hstack([circle, segment, np.full((len(dx), 1), np.inf)])
    every[~(every >= 0) | (every > beams.range_max)] = np.inf
    return every.min(axis=1)


def in_a_wall(obstacles, pose):
    """Whether nothing can be there."""
    walls = world_of(*(obstacle for obstacle in obstacles if isinstance(obstacle, Wall)))
    return static_clearance(walls, *pose[:2], *pose[:2], 1.0) == 0.0


def both_sides(a, b):
    """The lines at half a wall's thickness on both sides of a-b."""
    ux, uy = 0.5 * WALL_M * (b - a) / math.dist(a, b)
    return [(a + side, b + side) for side in (np.array([-uy, ux]), np.array([uy, -ux]))]


def random_obstacles(rng, circles=25, polygons=8, walls=4):
    obstacles = [Circle(center=rng.uniform(0, 10, 2), radius=rng.uniform(0.05, 1.2)) for _ in range(circles)]
    for _ in range(polygons):
        turn, centre = rng.uniform(0, FULL), rng.uniform(0, 10, 2)
        corners = turn + FULL / (k := rng.integers(3, 7)) * np.arange(k)
        size = rng.uniform(0.2, 1.5)
        obstacles.append(Polygon(points=centre + size * np.column_stack([np.cos(corners), np.sin(corners)])))
    return obstacles + [Wall(points=rng.uniform(0, 10, (rng.integers(2, 5), 2))) for _ in range(walls)]


def assert_same_ranges(found, expected, allowed=0.002, tolerance=1e-5):
    """Equal ranges; a beam that grazes a surface may go either way, at most ``allowed`` of them."""
    same = np.isclose(found, expected, rtol=tolerance, atol=tolerance)
    assert np.mean(~same) <= allowed, f"{np.count_nonzero(~same)} of {same.size} beams differ"


def test_hand_worked_ranges_of_four_beams():
    world = world_of(
        Circle(center=(5, 0), radius=1), Wall(points=[(-1, 2), (1, 2)]), Circle(center=(-9, 0), radius=1)
    )
    # beams look back, right, forward, left
    assert scan(world, (0, 0, 0), make_beams(4, FULL, 10)).tolist() == f32([8, math.inf, 4, 1.99])
    assert scan(world, (0, 0, 0), make_beams(4, FULL, 7)).tolist() == f32([math.inf, math.inf, 4, 1.99])
    assert np.allclose(scan(world, (0, 0, math.pi / 2), make_beams(4, FULL, 10)), [np.inf, 4, 1.99, 8])


def f32(values):
    return np.array(values, dtype=np.float32).tolist()


@pytest.mark.parametrize("aside", [0.0, 1e-12, 0.004, -0.0099])
def test_a_wall_is_seen_from_its_end(aside):
    """No beam meets a line without thickness that lies along it."""
    world = world_of(Wall(points=[(2, 0), (6, 0)]), Wall(points=[(0, 3), (0, 3.5)]))
    ranges = scan(world, (0, aside, 0), make_beams(4, FULL, 10))
    assert ranges[2] == pytest.approx(2.0 - math.sqrt(0.01**2 - aside**2), abs=1e-6)
    ranges = scan(world, (aside, 0, 0), make_beams(4, FULL, 10))
    assert ranges[3] == pytest.approx(3.0 - math.sqrt(0.01**2 - aside**2), abs=1e-6)
    assert not np.isfinite(scan(world, (0, 0.0101, 0), make_beams(4, FULL, 10))[2])


def test_limited_field_includes_both_edges():
    beams = make_beams(3, math.pi, 10)
    world = world_of(*(Circle(center=c, radius=1) for c in ((0, -3), (4, 0), (0, 5), (-2.5, 0))))
    assert np.allclose(scan(world, (0, 0, 0), beams), [2, 3, 4])
    assert not beams.wraps
    assert make_beams(360, FULL, 5).wraps


def test_from_inside_circle_and_polygon_the_far_surface_counts():
    beams = make_beams(4, FULL, 10)
    assert scan(world_of(Circle(center=(1, 0), radius=3)), (0, 0, 0), beams)[[0, 2]].tolist() == [2, 4]
    square = Polygon(points=[(-1, -1), (2, -1), (2, 3), (-1, 3)])
    assert scan(world_of(square), (0, 0, 0), beams).tolist() == [1, 1, 2, 3]


def test_range_max_itself_is_seen_and_beyond_is_not():
    world = world_of(Circle(center=(6, 0), radius=1))
    assert scan(world, (0, 0, 0), make_beams(4, FULL, 5.0))[2] == 5.0
    assert scan(world, (0, 0, 0), make_beams(4, FULL, 4.999))[2] == math.inf


def test_disc_across_pi_is_seen_by_first_and_last_beams():
    beams, out = make_beams(360, FULL, 5), np.full(360, np.inf, dtype=np.float32)
    cast_disc(-2.0, 0.0, 0.5, beams, out)
    hit = np.flatnonzero(np.isfinite(out))
    assert out[0] == 1.5
    assert set(hit) == {*range(15), *range(346, 360)}  # asin(0.5 / 2) = 14.48 degrees
    cast_disc(-1.0, 0.0, 0.1, beams, out)
    assert math.isclose(out[0], 0.9, rel_tol=1e-6)


def test_disc_only_lowers_ranges():
    beams, out = make_beams(8, FULL, 5), np.full(8, 1.0, dtype=np.float32)
    cast_disc(3.0, 0.0, 0.5, beams, out)
    assert np.all(out == 1.0)


def test_a_field_of_350_degrees_sees_one_disc_with_both_ends():
    beams, out = make_beams(351, math.radians(350), 5), np.full(351, np.inf, dtype=np.float32)
    cast_disc(-2.0, 0.0, 0.5, beams, out)
    hit = np.flatnonzero(np.isfinite(out))
    assert set(hit) == {*range(10), *range(341, 351)}


def test_nan_pose_and_empty_world_do_not_crash():
    beams = make_beams(36, FULL, 5)
    assert np.all(np.isinf(scan(world_of(), (0, 0, 0), beams)))
    grid = grid_from_solid(np.eye(3), 1.0, (0.0, 0.0))
    world = world_of(Circle(center=(1, 1), radius=1), Wall(points=[(0, 0), (1, 0)]), grid)
    scan(world, (math.nan, 0, 0), beams)
    scan(world, (0, 0, math.nan), beams)
    scan(world, (1e300, -1e300, 0), beams)


@pytest.mark.parametrize(
    "arguments", [(1, 6, 5), (0, 6, 5), (9, 0, 5), (9, 7, 5), (9, math.nan, 5), (9, 6, 0)]
)
def test_impossible_lidars_are_refused(arguments):
    with pytest.raises(ConfigError):
        make_beams(*arguments)


def test_rough_angle_stays_within_its_slack():
    angles = np.linspace(-math.pi, math.pi, 200001)
    rough = np.array([rough_angle(x, y) for x, y in zip(np.cos(angles), np.sin(angles), strict=True)])
    off = np.abs(np.remainder(rough - angles + math.pi, FULL) - math.pi)
    assert off.max() < 0.5 * ANGLE_SLACK


@pytest.mark.parametrize("fov", [FULL, math.radians(350), math.radians(270), math.pi, 0.5])
@pytest.mark.parametrize("seed", range(8))
def test_equals_brute_force_on_random_worlds(seed, fov):
    rng = np.random.default_rng(seed)
    obstacles = random_obstacles(rng)
    world = world_of(*obstacles)
    beams = make_beams(int(rng.integers(2, 800)), fov, rng.uniform(1, 12))
    for _ in range(20):  # inside obstacles too
        pose = (*rng.uniform(-1, 11, 2), rng.uniform(-9, 9))
        if in_a_wall(obstacles, pose):
            continue
        assert_same_ranges(scan(world, pose, beams), plain_scan(obstacles, pose, beams))


@settings(max_examples=100, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    shift=st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
    turn=st.floats(-10, 10),
    fov=st.sampled_from([FULL, 4.0, 1.0]),
)
def test_moving_world_and_robot_together_changes_nothing(seed, shift, turn, fov):
    rng = np.random.default_rng(seed)
    c, s = math.cos(turn), math.sin(turn)

    def move(points):
        return np.asarray(points) @ np.array([[c, s], [-s, c]]) + shift

    discs = [(rng.uniform(0, 10, 2), rng.uniform(0.1, 1)) for _ in range(10)]
    lines = [rng.uniform(0, 10, (2, 2)) for _ in range(4)]
    here = world_of(*(Circle(center=p, radius=r) for p, r in discs), *(Wall(points=p) for p in lines))
    there = world_of(
        *(Circle(center=move(p), radius=r) for p, r in discs), *(Wall(points=move(p)) for p in lines)
    )
    beams = make_beams(180, fov, 6.0)
    pose = (*rng.uniform(0, 10, 2), rng.uniform(-3, 3))
    moved = (*move(pose[:2]), pose[2] + turn)
    assert_same_ranges(scan(there, moved, beams), scan(here, pose, beams), allowed=0.01, tolerance=1e-4)


@pytest.mark.parametrize("seed", range(5))
def test_a_disc_in_the_sensor_frame_equals_a_circle_in_the_world(seed):
    rng = np.random.default_rng(seed)
    beams = make_beams(360, FULL, 5.0)
    centre, radius, yaw = rng.uniform(-2, 2, 2), rng.uniform(0.1, 1), rng.uniform(-3, 3)
    out = np.full(360, np.inf, dtype=np.float32)
    c, s = math.cos(yaw), math.sin(yaw)
    cast_disc(c * centre[0] + s * centre[1], c * centre[1] - s * centre[0], radius, beams, out)
    assert np.array_equal(out, scan(world_of(Circle(center=centre, radius=radius)), (0, 0, yaw), beams))


def test_no_beam_slips_through_the_joints_of_a_room():
    rng = np.random.default_rng(3)
    turn = rng.uniform(0, FULL, 7)
    corners = 6.0 * np.column_stack([np.cos(np.sort(turn)), np.sin(np.sort(turn))])
    world = world_of(Wall(points=[*corners, corners[0]]))
    beams = make_beams(3600, FULL, 100.0)
    for _ in range(50):
        assert np.all(np.isfinite(scan(world, (*rng.uniform(-0.3, 0.3, 2), rng.uniform(-3, 3)), beams)))


def test_grid_hand_worked():
    solid = np.zeros((4, 6))
    solid[1, 4] = solid[3, 1] = 1
    world = world_of(grid_from_solid(solid, 0.5, (1.0, 2.0)))
    beams = make_beams(4, FULL, 10)
    # cell (row 1, col 4) covers x 3 .. 3.5, y 2.5 .. 3; cell (3, 1) covers x 1.5 .. 2, y 3.5 .. 4
    assert np.allclose(scan(world, (1.75, 2.75, 0), beams), [np.inf, np.inf, 1.25, 0.75])
    assert np.allclose(scan(world, (0.0, 2.75, 0), beams), [np.inf, np.inf, 3.0, np.inf])
    assert np.allclose(scan(world, (3.25, 9.0, -math.pi / 2), beams), [np.inf, np.inf, 6.0, np.inf])
    assert np.all(scan(world, (3.2, 2.7, 0.3), beams) == 0.0)


@pytest.mark.parametrize("seed", range(6))
def test_grid_equals_a_world_of_squares(seed):
    rng = np.random.default_rng(seed)
    solid = rng.random((25, 40)) < (0.03, 0.3)[seed % 2]
    grid = world_of(grid_from_solid(solid, 0.3, (-2.0, 1.0)))
    squares = []
    for row, col in np.argwhere(solid):
        x, y = -2.0 + 0.3 * col, 1.0 + 0.3 * row
        squares.append(Polygon(points=[(x, y), (x + 0.3, y), (x + 0.3, y + 0.3), (x, y + 0.3)]))
    polygons = world_of(*squares)
    beams = make_beams(360, FULL, 8.0)
    for _ in range(40):
        pose = (*rng.uniform((-3, 0), (11, 9.5)), rng.uniform(-3, 3))
        col, row = math.floor((pose[0] + 2) / 0.3), math.floor((pose[1] - 1) / 0.3)
        if 0 <= row < 25 and 0 <= col < 40 and solid[row, col]:
            continue
        # a beam may slip diagonally between two squares that touch at a corner
        assert_same_ranges(scan(grid, pose, beams), scan(polygons, pose, beams), allowed=0.006)


def test_office_map_agrees_with_small_steps():
    grid = load_map(packaged_map("willow_garage_office"))
    world = world_of(grid)
    rng = np.random.default_rng(0)
    beams = make_beams(90, FULL, 8.0)
    free = np.argwhere(world.solid == 0)
    for row, col in free[rng.integers(0, len(free), 20)]:
        pose = (0.1 * (col + 0.5), 0.1 * (row + 0.5), rng.uniform(-3, 3))
        found = scan(world, pose, beams)
        steps = np.arange(0.0, 8.0, 0.002)
        angles = pose[2] + beams.angle_min + beams.increment * np.arange(90)
        columns = np.floor((pose[0] + np.outer(np.cos(angles), steps)) / 0.1).astype(int)
        rows = np.floor((pose[1] + np.outer(np.sin(angles), steps)) / 0.1).astype(int)
        within = (columns >= 0) & (columns < grid.width) & (rows >= 0) & (rows < grid.height)
        solid = within & (world.solid[np.where(within, rows, 0), np.where(within, columns, 0)] == 1)
        walked = np.where(solid.any(axis=1), steps[solid.argmax(axis=1)], np.inf)
        assert np.mean(~np.isclose(found, walked, rtol=0, atol=0.0021)) < 0.03  # steps skip cut corners


@pytest.mark.parametrize("height", [1e-3, -1e-3, 1e-9])
def test_a_sensor_all_but_on_a_surface_sees_it_on_the_right_side(height):
    slab = Polygon(points=[(-0.5, 0), (-0.5, -0.2), (0.5, -0.2), (0.5, 0)])
    wall = Wall(points=[(-0.5, -0.5 * WALL_M), (0.5, -0.5 * WALL_M)])
    beams = make_beams(360, FULL, 5.0)
    for obstacle in (slab, wall) if height > 0.0 else (slab,):
        for yaw in np.linspace(-3, 3, 13):
            pose = (0.01, height, yaw)
            assert_same_ranges(scan(world_of(obstacle), pose, beams), plain_scan([obstacle], pose, beams))
