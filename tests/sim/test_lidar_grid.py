"""A lidar's ranges in occupancy grids, bit for bit those of a walk from cell to cell, one beam at a time."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarmscope.sim import slabs
from swarmscope.sim.beams import make_beams
from swarmscope.sim.lidar import cast_static
from swarmscope.sim.lidar_grid import FEW_BEAMS
from swarmscope.sim.world import Circle, WorldSpec, compile_world, grid_from_solid, in_grid

FULL = 2.0 * math.pi
BOUNDS = (0.0, 0.0, 10.0, 10.0)


def world_of(solid, resolution=1.0, origin=(0.0, 0.0), yaw=0.0, more=()):
    return compile_world(WorldSpec(obstacles=[grid_from_solid(solid, resolution, origin, yaw), *more], bounds=BOUNDS))


def scan(world, pose, beams):
    out = np.full(len(beams.cos), -1.0, dtype=np.float32)
    cast_static(world, *map(float, pose), beams, out)
    return out


def walked_scan(world, pose, beams, turn=0.0):
    """Every beam from cell to cell (Amanatides and Woo), all of them turned by ``turn`` [rad]."""
    side, (c, s) = world.solid_resolution, world.solid_turn
    px, py = (value / side for value in in_grid(world, *pose[:2]))
    cos, sin = math.cos(pose[2] + turn), math.sin(pose[2] + turn)
    cos, sin = c * cos + s * sin, c * sin - s * cos
    out = np.full(len(beams.cos), np.inf, dtype=np.float32)
    for n, (bx, by) in enumerate(zip(beams.cos.tolist(), beams.sin.tolist(), strict=True)):
        dx, dy = cos * bx - sin * by, sin * bx + cos * by
        distance = side * walk(world.solid, px, py, dx, dy, beams.range_max / side)
        if distance <= beams.range_max:
            out[n] = distance
    return out


def walk(solid, px, py, dx, dy, far):
    """How far a ray from p along d goes to a solid cell's border [cells], else inf."""
    inverse_x, inverse_y = (1.0 / d if d != 0.0 else math.inf for d in (dx, dy))
    t, end = 0.0, far
    for p, d, inverse, count in ((px, dx, inverse_x, solid.shape[1]), (py, dy, inverse_y, solid.shape[0])):
        if d == 0.0 and not 0.0 <= p < count:
            return math.inf
        if d != 0.0:
            enter, leave = sorted((-p * inverse, (count - p) * inverse))
            t, end = max(t, enter), min(end, leave)
    if not t <= end:
        return math.inf
    col = min(max(math.floor(px + t * dx), 0), solid.shape[1] - 1)
    row = min(max(math.floor(py + t * dy), 0), solid.shape[0] - 1)
    while t <= end and 0 <= col < solid.shape[1] and 0 <= row < solid.shape[0]:
        if solid[row, col]:
            return t
        t_x, t_y = (col + (dx >= 0.0) - px) * inverse_x, (row + (dy >= 0.0) - py) * inverse_y
        if t_x <= t_y:
            t, col = max(t_x, t), col + (1 if dx >= 0.0 else -1)
        else:
            t, row = max(t_y, t), row + (1 if dy >= 0.0 else -1)
    return math.inf


def same_bits(found, expected):
    return np.array_equal(found.view(np.int32), expected.view(np.int32))


def random_solid(rng, shape, density):
    """Single cells and pieces of walls."""
    solid = rng.random(shape) < density
    for _ in range(rng.integers(0, 6)):
        row, col = rng.integers(0, shape[0]), rng.integers(0, shape[1])
        solid[row : row + rng.integers(1, 3), col : col + rng.integers(1, 12)] = True
        solid[row : row + rng.integers(1, 12), col : col + rng.integers(1, 3)] = True
    return solid


@pytest.mark.parametrize("fov", [FULL, math.radians(270), math.radians(60)])
@pytest.mark.parametrize("density", [0.0, 0.01, 0.1, 0.3, 0.6])
@pytest.mark.parametrize("seed", range(3))
def test_equals_the_walk_bit_for_bit(seed, density, fov):
    rng = np.random.default_rng([seed, int(100 * density), int(100 * fov)])
    for _ in range(4):
        shape = tuple(rng.integers(1, 40, 2))
        side, yaw = rng.choice([0.02, 0.05, 0.1, 0.3, 1.0]), rng.choice([0.0, rng.uniform(-9, 9)])
        world = world_of(random_solid(rng, shape, density), side, rng.uniform(-5, 5, 2), yaw)
        count, reach = rng.choice([8, FEW_BEAMS, 60, 361, 1440]), rng.choice([rng.uniform(1, 40), 200.0])
        beams = make_beams(int(count), fov, side * reach)
        c, s = math.cos(yaw), math.sin(yaw)
        for _ in range(8):  # in solid cells and outside, too
            u, v = side * rng.uniform(-0.2, 1.2, 2) * shape[::-1]
            x, y = world.solid_origin
            pose = (x + c * u - s * v, y + s * u + c * v, rng.uniform(-9, 9))
            assert same_bits(scan(world, pose, beams), walked_scan(world, pose, beams))


@pytest.mark.parametrize("seed", range(6))
def test_a_beam_through_a_corner_sees_what_is_on_one_side_of_it(seed):
    """From corners, borders and centres of cells, along the axes and diagonals, where nearly all beams meet corners."""
    rng = np.random.default_rng(seed)
    beams = make_beams(64, FULL, 40.0)
    for _ in range(8):
        world = world_of(random_solid(rng, (12, 14), rng.choice([0.02, 0.2, 0.4])))
        for _ in range(20):
            pose = (*(0.5 * rng.integers(-3, 32, 2)), math.pi / 4 * rng.integers(-4, 5))
            found = scan(world, pose, beams)
            allowed = [walked_scan(world, pose, beams, turn) for turn in (0.0, 3e-9, -3e-9)]
            assert np.all(np.any(np.isclose(found, allowed, rtol=0, atol=1e-5), axis=0))


@pytest.mark.parametrize("seed", range(6))
def test_no_beam_leaves_a_closed_room(seed):
    """Walls of cells that touch at corners only are closed as well."""
    rng = np.random.default_rng(seed)
    solid = np.zeros((24, 24), dtype=bool)
    for k in range(11):  # a diamond
        solid[[1 + k, 1 + k, 22 - k, 22 - k], [11 - k, 12 + k, 11 - k, 12 + k]] = True
    solid |= rng.random(solid.shape) < 0.05 * (seed % 3)
    world = world_of(solid, 0.5, (-6.0, -6.0))
    beams = make_beams(720, FULL, 1000.0)
    for _ in range(60):
        place = rng.choice([rng.uniform(-2.4, 2.4, 2), 0.25 * rng.integers(-9, 10, 2)])
        pose = (*place, rng.choice([rng.uniform(-4, 4), math.pi / 4 * rng.integers(-4, 5)]))
        assert np.all(np.isfinite(scan(world, pose, beams)))


@pytest.mark.parametrize("reach", [38.4, 38.6, 39.4, 39.5, 39.6])
def test_what_is_just_within_the_range_is_seen(reach):
    """At the end of a corridor, 39.5 cells off, behind the last portal at 38.5 cells."""
    solid = np.zeros((41, 9), dtype=bool)
    solid[40] = solid[39, 7:] = solid[:, 8] = True
    world, beams = world_of(solid), make_beams(361, math.radians(20), reach)
    found = scan(world, (4.5, 0.5, math.pi / 2), beams)
    assert same_bits(found, walked_scan(world, (4.5, 0.5, math.pi / 2), beams))
    assert found[180] == (39.5 if reach >= 39.5 else math.inf)


def test_grids_with_too_many_slabs_are_walked(monkeypatch):
    rng = np.random.default_rng(0)
    solid = random_solid(rng, (30, 40), 0.1)
    beams = make_beams(180, FULL, 20.0)
    poses = [(*rng.uniform(0, 30, 2), rng.uniform(-3, 3)) for _ in range(20)]
    with_slabs = [scan(world_of(solid), pose, beams) for pose in poses]
    monkeypatch.setattr(slabs, "MOST_SLABS", 10)
    world = world_of(solid)
    assert len(world.slabs.table) == 0
    assert all(map(same_bits, with_slabs, [scan(world, pose, beams) for pose in poses]))


def test_whatever_is_nearest_counts():
    """A disc before a wall of cells, and one behind it."""
    solid = np.zeros((10, 10), dtype=bool)
    solid[:, 8] = True
    beams = make_beams(60, FULL, 20.0)
    before = scan(world_of(solid, more=[Circle(center=(5, 5.5), radius=1)]), (1.5, 5.5, 0), beams)
    behind = scan(world_of(solid, more=[Circle(center=(12, 5.5), radius=1)]), (1.5, 5.5, 0), beams)
    assert before[30] == 2.5
    assert behind[30] == 6.5


@pytest.mark.parametrize("seed", range(10))
def test_slabs_are_the_free_cells_and_portals_lead_back(seed):
    rng = np.random.default_rng(seed)
    solid = random_solid(rng, tuple(rng.integers(1, 30, 2)), rng.choice([0.0, 0.1, 0.4]))
    found = slabs.free_slabs(solid.astype(np.uint8))
    owner = np.full(solid.shape, -1)
    for number, (left, bottom, right, top, *_) in enumerate(found.table):
        assert np.all(owner[bottom:top, left:right] == -1)
        owner[bottom:top, left:right] = number
    assert np.array_equal(owner == -1, solid)
    for row, col in np.argwhere(~solid):
        assert slabs.slab_at(found, row, col) == owner[row, col]
    for number, (left, bottom, right, top, above, above_end, below, below_end) in enumerate(found.table):
        over = owner[top, left:right][::-1] if top < len(owner) else np.zeros(0, int)
        under = owner[bottom - 1, left:right] if bottom > 0 else np.zeros(0, int)
        assert found.links[above:above_end].tolist() == list(dict.fromkeys(over[over >= 0].tolist())), number
        assert found.links[below:below_end].tolist() == list(dict.fromkeys(under[under >= 0].tolist())), number
