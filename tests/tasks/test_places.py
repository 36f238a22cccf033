"""The store room and the places where planners get stuck."""

import math

import numpy as np
import pytest

from swarmscope.errors import ConfigError, UnsolvableWorldError
from swarmscope.judging.shortest_path import grid_paths, lengths_m
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.world import Circle, Polygon, Wall, WorldSpec, compile_world
from swarmscope.tasks import Setup, check_setup, load_task
from swarmscope.tasks._check import Reach, unreachable
from swarmscope.tasks._rooms import WALL_M, bar, goal_ranks, ranks, spacing

PLACES = {"long_wall": 4, "u_trap": 4, "doorway": 6, "corridor": 6, "intersection": 8, "depository": 5}
STUCK = [name for name in PLACES if name != "depository"]


def corners_of(obstacle: Polygon) -> np.ndarray:
    return np.array(obstacle.points)


def reaches(setup: Setup, *blocks: Polygon) -> bool:
    """Whether every robot still has a way when blocks are added."""
    spec = WorldSpec(obstacles=[*setup.world.obstacles, *blocks], bounds=setup.world.bounds)
    try:
        check_setup(Setup(spec, setup.starts, setup.goals), 0.15)
    except UnsolvableWorldError:
        return False
    return True


@pytest.mark.parametrize(("name", "robots"), PLACES.items())
def test_places_have_their_robots_and_the_seed_alone_decides(name: str, robots: int) -> None:
    make = load_task(name).make
    one, same, other = make(5), make(5), make(6)
    assert len(one.starts) == robots
    assert one.world == same.world and np.array_equal(one.starts, same.starts)
    assert np.array_equal(one.goals, same.goals)
    assert one.world != other.world


@pytest.mark.parametrize("name", PLACES)
@pytest.mark.parametrize("robots", [1, 3, 9])
def test_places_are_made_for_wide_robots_too(name: str, robots: int) -> None:
    setup = load_task(name).make(2, robots=robots, radius=0.43)
    assert len(setup.starts) == len(setup.goals) == robots
    check_setup(setup, 0.43)


@pytest.mark.parametrize("name", PLACES)
def test_walls_are_seen_from_every_side(name: str) -> None:
    obstacles = load_task(name).make(1).world.obstacles
    assert not any(isinstance(obstacle, Wall) for obstacle in obstacles)
    for corners in map(corners_of, [o for o in obstacles if isinstance(o, Polygon)]):
        sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
        assert name == "depository" or sides.min() >= WALL_M - 1e-9


@pytest.mark.parametrize("name", STUCK)
@pytest.mark.parametrize("seed", range(1000, 1005))
def test_nobody_stands_in_a_goal_or_at_a_wall(name: str, seed: int) -> None:
    setup = load_task(name).make(seed)
    world = compile_world(setup.world)
    for x, y in np.vstack([setup.starts[:, :2], setup.goals]).tolist():
        assert static_clearance(world, x, y, x, y, 1.0) >= 0.5
    apart = np.hypot(*(setup.starts[:, None, :2] - setup.goals[None]).transpose(2, 0, 1))
    assert apart.min() >= 1.0


@pytest.mark.parametrize("name", ["long_wall", "u_trap"])
@pytest.mark.parametrize("seed", range(1000, 1005))
def test_the_straight_ways_are_blocked(name: str, seed: int) -> None:
    setup = load_task(name).make(seed)
    world = compile_world(setup.world)
    for start, goal in zip(setup.starts, setup.goals, strict=True):
        assert static_clearance(world, *start[:2], *goal, 1.0) == 0.0


def test_one_way_round_the_long_wall_is_shorter_and_the_seed_says_which() -> None:
    uppers = set()
    for seed in range(12):
        setup = load_task("long_wall").make(seed)
        y = corners_of(setup.world.obstacles[0])[:, 1]
        middle = setup.goals[:, 1].mean()
        over, under = y.max() - middle, middle - y.min()
        assert max(over, under) > 1.3 * min(over, under)
        assert 8.0 < y.max() - y.min() < 11.6
        uppers.add(bool(over < under))
    assert uppers == {True, False}


def test_the_trap_is_open_to_the_robots_only() -> None:
    for seed in range(8):
        setup = load_task("u_trap").make(seed)
        back, lower, upper = map(corners_of, setup.world.obstacles)
        mouth = min(lower[:, 0].min(), upper[:, 0].min())
        assert setup.starts[:, 0].max() < mouth
        assert setup.goals[:, 0].min() > back[:, 0].max() + 1.0
        inside = (setup.starts[:, 1] > lower[:, 1].max()) & (setup.starts[:, 1] < upper[:, 1].min())
        assert inside.all()


@pytest.mark.parametrize("name", ["doorway", "corridor"])
def test_two_groups_change_rooms_through_one_passage(name: str) -> None:
    for seed in range(4):
        setup = load_task(name).make(seed, robots=7)
        sides = np.sign(setup.starts[:, 0])
        assert sides.tolist() == [-1.0] * 4 + [1.0] * 3
        assert np.array_equal(np.sign(setup.goals[:, 0]), -sides)
        low, high = (corners_of(o)[:, 1] for o in setup.world.obstacles[-2:])
        width = high.min() - low.max()
        assert width == pytest.approx(1.0) if name == "doorway" else 4 * 0.15 + 0.9 - 1e-9 <= width <= 1.73
        plug = Polygon(points=[(-0.05, -9.0), (0.05, -9.0), (0.05, 9.0), (-0.05, 9.0)])
        assert reaches(setup) and not reaches(setup, plug)


def test_goals_behind_a_door_are_permuted() -> None:
    orders = {tuple(np.argsort(load_task("doorway").make(seed).goals[:3, 1])) for seed in range(20)}
    assert len(orders) > 3


def test_a_door_too_narrow_is_an_error() -> None:
    with pytest.raises(UnsolvableWorldError, match="no way"):
        load_task("doorway").make(0, door_m=0.38)
    with pytest.raises(UnsolvableWorldError, match="no way"):
        load_task("doorway").make(0, radius=0.5)


@pytest.mark.parametrize("robots", [1, 8, 11])
def test_groups_cross_straight_through_the_intersection(robots: int) -> None:
    for seed in range(4):
        setup = load_task("intersection").make(seed, robots=robots)
        for i, (start, goal) in enumerate(zip(setup.starts[:, :2], setup.goals, strict=True)):
            along = i % 2  # robots 0, 2 travel along x, 1 and 3 along y
            direction = 1.0 if i % 4 < 2 else -1.0
            assert start[along] * direction < -2.5 and goal[along] * direction > 2.5
            assert abs(start[1 - along] - goal[1 - along]) < 0.2
    assert reaches(setup)
    plug = Polygon(points=[(-1.3, -1.3), (1.3, -1.3), (1.3, 1.3), (-1.3, 1.3)])
    assert not reaches(setup, plug)


def test_the_store_room_is_as_dense_and_as_long_as_published() -> None:
    lengths = []
    for seed in range(1000, 1012):
        setup = load_task("depository").make(seed)
        things = setup.world.obstacles[4:]
        assert len(things) == round(0.38 * (9.8 - 2.8) * 7.0)
        kinds = {"drum" if isinstance(o, Circle) else len(o.points) for o in things}
        assert {"drum", 4} <= kinds
        ways = grid_paths(setup.world, setup.starts, setup.goals, 0.43)
        lengths.append(lengths_m(ways).mean())
    assert abs(np.mean(lengths) - 10.4) < 0.5


def test_stacks_keep_aisles_and_the_robots_room() -> None:
    for seed in range(1000, 1006):
        setup = load_task("depository").make(seed)
        things = [
            (np.array(o.center), o.radius) if isinstance(o, Circle) else around(corners_of(o))
            for o in setup.world.obstacles[4:]
        ]
        centres, reach = np.array([c for c, _ in things]), np.array([r for _, r in things])
        gaps = np.hypot(*(centres[:, None] - centres[None]).transpose(2, 0, 1)) - reach - reach[:, None]
        same_stack = gaps < 1.0 - 1e-9
        assert same_stack.sum(axis=1).max() <= 4
        assert np.array_equal(same_stack @ same_stack, same_stack)  # nobody is near two stacks
        assert gaps[np.triu_indices(len(reach), 1)].min() >= 0.02 - 1e-9
        points = np.vstack([setup.starts[:, :2], setup.goals])
        away = np.hypot(*(points[:, None] - centres[None]).transpose(2, 0, 1)) - reach
        assert away.min() >= 1.3
        assert (centres[:, 1] - reach).min() >= 1.0 - 1e-9 and (centres[:, 1] + reach).max() <= 6.0 + 1e-9


def test_who_has_arrived_blocks_nobody() -> None:
    setup = load_task("depository").make(1000)
    parked = [Circle(center=tuple(goal), radius=0.43) for goal in setup.goals[1:].tolist()]
    spec = WorldSpec(obstacles=[*setup.world.obstacles, *parked], bounds=setup.world.bounds)
    assert unreachable(Setup(spec, setup.starts[:1], setup.goals[:1]), Reach(0.43, 0.1)).size == 0


def test_things_may_stand_one_by_one() -> None:
    setup = load_task("depository").make(1000, stack=1, aisle_m=0.1)
    assert len(setup.world.obstacles) == len(load_task("depository").make(1000).world.obstacles)


def test_more_room_can_be_asked_for() -> None:
    for seed in range(6):
        setup = load_task("depository").make(seed, spare_m=0.3, size=0.5)
        assert unreachable(setup, Reach(0.43, 0.28)).size == 0
    assert load_task("depository").make(1, spare_m=0.3).world != load_task("depository").make(1).world


def around(corners: np.ndarray) -> tuple[np.ndarray, float]:
    centre = corners.mean(axis=0)
    return centre, float(np.hypot(*(corners - centre).T).max())


def test_a_store_room_that_cannot_be_is_an_error() -> None:
    with pytest.raises(ConfigError, match="do not fit"):
        load_task("depository").make(0, density=3.0)
    with pytest.raises(ConfigError, match="way_m"):
        load_task("depository").make(0, way_m=2.0)
    with pytest.raises(UnsolvableWorldError, match="no solvable depository in 41 draws"):
        load_task("depository").make(0, spare_m=0.8)


def test_a_wall_that_does_not_reach_across_the_robots_is_an_error() -> None:
    with pytest.raises(ConfigError, match="does not reach"):
        load_task("long_wall").make(0, length_m=3.0)


def test_ranks_leave_the_way_free() -> None:
    group = ranks(7, 2.0, 0.15)
    assert group.places[:, 0].tolist() == pytest.approx([0.0] * 3 + [0.9] * 3 + [1.8])
    assert group.places[:3, 1].tolist() == pytest.approx([-0.9, 0.0, 0.9]) and group.places[6, 1] == 0.0
    assert goal_ranks(group).places[0, 0] == pytest.approx(1.8)  # who comes first goes deepest
    assert spacing(0.43) >= 2.0 * 0.43 + 0.4


def test_a_bar_has_its_length_and_thickness() -> None:
    corners = corners_of(bar(1.0, 1.0, 4.0, 5.0, 0.2))
    sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
    assert sides.tolist() == pytest.approx([5.0, 0.2, 5.0, 0.2])
    assert corners.mean(axis=0).tolist() == pytest.approx([2.5, 3.0]) and math.isclose(sides[0], 5.0)
