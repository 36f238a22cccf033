import math

import numpy as np
import pytest

from swarmscope.errors import ConfigError, UnknownNameError, UnsolvableWorldError
from swarmscope.sim.world import Circle, Grid, Polygon, Wall, WorldSpec
from swarmscope.tasks import Setup, check_setup, load_task, place_on_map, setup_of_task, task_names
from swarmscope.tasks._forest import ForestOptions, Places, lines, plant, rings

TASKS = task_names()
FORESTS = ["T1", "T2", "T3"]
BOX = (-5.0, -5.0, 5.0, 5.0)


def trees_of(setup: Setup) -> np.ndarray:
    return np.array([[*o.center, o.radius] for o in setup.world.obstacles])


def setup_of(obstacles: list, starts: list, goals: list) -> Setup:
    return Setup(WorldSpec(obstacles=obstacles, bounds=BOX), np.array(starts, float), np.array(goals, float))


def test_names_come_from_the_folder() -> None:
    assert set(TASKS) >= {"swap", "T1", "T2", "T3"}
    assert all(name == load_task(name).NAME and load_task(name.lower()).SUMMARY for name in TASKS)


def test_unknown_names_are_errors_with_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="unknown task 'T11'; did you mean 'T1'"):
        load_task("T11")
    with pytest.raises(UnknownNameError, match=r"task T1: unknown option 'densty'; did you mean 'density'"):
        load_task("T1").make(0, densty=0.3)
    with pytest.raises(ConfigError, match="density"):
        load_task("T1").make(0, density=math.nan)
    with pytest.raises(ConfigError, match="density: must be a number"):
        load_task("T1").make(0, density="dense")


@pytest.mark.parametrize("name", TASKS)
@pytest.mark.parametrize("robots", [1, 2, 15, 40, 130])
def test_every_task_makes_setups_that_pass_the_check(name: str, robots: int) -> None:
    setup = load_task(name).make(3, robots=robots)
    assert setup.starts.shape == (robots, 3) and setup.goals.shape == (robots, 2)
    check_setup(setup, 0.15)
    x0, y0, x1, y1 = setup.world.bounds
    for points in (setup.starts[:, :2], setup.goals):
        assert np.all((points > (x0, y0)) & (points < (x1, y1)))
    ahead = setup.goals - setup.starts[:, :2]
    toward = np.cos(np.arctan2(ahead[:, 1], ahead[:, 0]) - setup.starts[:, 2])
    np.testing.assert_allclose(toward, 1.0, atol=1e-12)


@pytest.mark.parametrize("name", FORESTS)
def test_forests_keep_their_rules(name: str) -> None:
    setup = load_task(name).make(1)
    trees = trees_of(setup)
    assert len(trees) == 140
    assert np.all((trees[:, 2] >= 0.15) & (trees[:, 2] <= 0.35))
    gaps = (
        np.hypot(*(trees[:, None, :2] - trees[None, :, :2]).transpose(2, 0, 1))
        - trees[:, 2]
        - trees[:, 2, None]
    )
    assert np.all(gaps[np.triu_indices(140, 1)] >= 0.0)
    points = np.vstack([setup.starts[:, :2], setup.goals])
    away = np.hypot(*(points[:, None] - trees[None, :, :2]).transpose(2, 0, 1)) - trees[None, :, 2]
    assert away.min() >= 0.60


@pytest.mark.parametrize("name", FORESTS)
def test_the_seed_alone_decides(name: str) -> None:
    first, again, other = (load_task(name).make(seed) for seed in (5, 5, 6))
    assert first.world == again.world and np.array_equal(first.goals, again.goals)
    assert first.world != other.world


def test_trees_are_spread_evenly() -> None:
    squares = np.concatenate([trees_of(load_task("T1").make(seed)) for seed in range(20)])
    discs = np.concatenate([trees_of(load_task("T3").make(seed)) for seed in range(20)])
    assert abs(np.mean(squares[:, 0] < 10.0) - 0.5) < 0.04  # 3.0 standard deviations are 0.028
    radius = math.sqrt(400.0 / math.pi)
    inner = np.hypot(discs[:, 0], discs[:, 1]) < radius / math.sqrt(2.0)
    assert abs(np.mean(inner) - 0.5) < 0.06  # a little more inside: whole trees fit in, starts are kept free


def test_t1_keeps_the_order_and_t2_permutes_it() -> None:
    one, two = load_task("T1").make(2), load_task("T2").make(2)
    np.testing.assert_allclose(one.starts[:, 1], (np.arange(15) + 0.5) * 20.0 / 15.0)
    np.testing.assert_allclose(one.goals[:, 1], one.starts[:, 1])
    assert set(one.starts[:, 0]) == {-0.5} and set(one.goals[:, 0]) == {20.5}
    assert not np.array_equal(two.goals, one.goals)
    np.testing.assert_allclose(np.sort(two.goals[:, 1]), one.goals[:, 1])


@pytest.mark.parametrize("name", ["T3", "swap"])
def test_ring_goals_are_antipodal(name: str) -> None:
    setup = load_task(name).make(2)
    np.testing.assert_allclose(setup.goals, -setup.starts[:, :2], atol=1e-12)
    np.testing.assert_allclose(np.hypot(*setup.goals.T), math.sqrt(400.0 / math.pi) + 0.7)


@pytest.mark.parametrize("robots", [28, 29, 100, 1234])
@pytest.mark.parametrize("layout", [lines, rings])
def test_many_robots_are_given_room(layout, robots: int) -> None:
    places = layout(robots, 0.15, 20.0)
    points = places.starts[:, :2]
    gaps = np.hypot(*(points[:, None] - points[None, :]).transpose(2, 0, 1))[np.triu_indices(robots, 1)]
    assert len(points) == robots and gaps.min() >= 0.69
    assert places.area / robots >= 0.95 * min(400.0 / robots, 400.0 / 75.0)


def test_too_dense_a_forest_is_an_error_not_a_hang() -> None:
    with pytest.raises(ConfigError, match="do not fit"):
        load_task("T1").make(0, density=6.0)
    with pytest.raises(UnsolvableWorldError, match="no solvable forest"):
        enclosed = Places(20.0, False, np.array([[10.0, 10.0, 0.0]]), np.array([[20.5, 10.0]]))
        plant(0, enclosed, 0.4, ForestOptions(density=1.2))


WALL = Wall(points=[(0.0, -7.5), (0.0, 7.5)])
GAP = [Wall(points=[(0.0, -7.5), (0.0, -0.3)]), Wall(points=[(0.0, 0.3), (0.0, 7.5)])]


@pytest.mark.parametrize(
    ("obstacles", "starts", "goals", "why"),
    [
        ([], [[0, 0, 0], [0.2, 0, 0]], [[3, 0], [3, 2]], "robots 0 and 1: their starts are 0.200 m"),
        ([], [[0, 0, 0], [1, 0, 0]], [[3, 0], [3, 0.1]], "robots 0 and 1: their goals are 0.100 m"),
        ([Circle(center=(1, 0), radius=0.5)], [[-2, 0, 0], [1, 0.6, 0]], [[3, 0], [3, 2]], "1: its start"),
        ([Circle(center=(3, 0), radius=0.5)], [[-2, 0, 0]], [[3, 0]], "robot 0: its goal"),
        ([Polygon(points=[(2, -1), (4, -1), (4, 1), (2, 1)])], [[-2, 0, 0]], [[3, 0]], "robot 0: its goal"),
        ([], [[0, 0, 0], [math.nan, 0, 0]], [[3, 0], [3, 2]], "robot 1: its start .* not finite"),
        ([], [[0, 0, 0]], [[3, math.inf]], "robot 0: its goal .* not finite"),
        ([WALL], [[-2, 0, 0], [2, 1, 0]], [[-2, 2], [-2, 0]], "robot 1: no way"),
        ([], [[0, 0, 0]], [[1, 1], [2, 2]], "do not fit"),
    ],
)  # fmt: skip
def test_check_names_the_robot_and_the_reason(obstacles: list, starts: list, goals: list, why: str) -> None:
    with pytest.raises(UnsolvableWorldError, match=why):
        check_setup(setup_of(obstacles, starts, goals), 0.15)


def test_a_gap_lets_small_robots_through_only() -> None:
    setup = setup_of(GAP, [[-2, 0, 0]], [[2, 0]])
    check_setup(setup, 0.15)
    with pytest.raises(UnsolvableWorldError, match="no way"):
        check_setup(setup, 0.35)


def two_rooms() -> WorldSpec:
    """A room of 10 x 10 m and a small one that cannot be left, 0.1 m cells."""
    solid = np.ones((104, 134), dtype=np.uint8)
    solid[2:102, 2:102] = 0
    solid[2:102, 104:130] = 0
    rows = []
    for row in range(104):
        edges = np.flatnonzero(np.diff(np.concatenate([[0], solid[row], [0]])))
        rows += [(row, int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    grid = Grid(resolution=0.1, origin=(0.0, 0.0), width=134, height=104, rows=rows)
    return WorldSpec(obstacles=[grid], bounds=(0.0, 0.0, 13.4, 10.4))


def test_places_on_a_map_are_apart_far_and_reachable() -> None:
    spec = two_rooms()
    setup = place_on_map(spec, 4, robots=12, radius=0.15, min_distance=5.0)
    check_setup(setup, 0.15)
    assert np.all(setup.starts[:, 0] < 10.2) and np.all(setup.goals[:, 0] < 10.2)
    assert np.all(np.hypot(*(setup.goals - setup.starts[:, :2]).T) >= 5.0 / 1.083)  # octile
    for points in (setup.starts[:, :2], setup.goals):
        gaps = np.hypot(*(points[:, None] - points[None, :]).transpose(2, 0, 1))
        assert gaps[np.triu_indices(12, 1)].min() >= 0.6
    again = place_on_map(spec, 4, robots=12, radius=0.15, min_distance=5.0)
    assert np.array_equal(setup.starts, again.starts) and np.array_equal(setup.goals, again.goals)


def test_places_on_a_map_that_are_impossible() -> None:
    with pytest.raises(UnsolvableWorldError, match="robot 0: found no free goal"):
        place_on_map(two_rooms(), 4, robots=2, radius=0.15, min_distance=50.0)
    with pytest.raises(UnsolvableWorldError, match="no room"):
        place_on_map(two_rooms(), 4, robots=60, radius=0.5, min_distance=1.0)


def test_options_of_which_nothing_can_be_made_are_an_error_of_theirs():
    with pytest.raises(ConfigError, match=r"^task\.options: corridor cannot be made of them: points 0 and 1"):
        setup_of_task("corridor", {"length_m": 0.0}, 0, 2, 0.15)
