"""Rocks against trees: the same areas, the same rules."""

import math

import numpy as np
import pytest

from swarmscope.errors import UnknownNameError
from swarmscope.sim.contact import static_clearance
from swarmscope.sim.world import WorldSpec, compile_world
from swarmscope.tasks import Setup, check_setup, load_task
from swarmscope.tasks._rocks import draw_rocks

FORESTS = ["T1", "T2", "T3"]


def rocks_of(setup: Setup) -> list[np.ndarray]:
    return [np.array(rock.points) for rock in setup.world.obstacles]


def area_of(corners: np.ndarray) -> float:
    x, y = corners.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def split(rocks) -> list[np.ndarray]:
    return np.split(rocks.corners, np.cumsum(rocks.counts)[:-1])


def test_rocks_have_the_areas_asked_for_and_are_convex() -> None:
    areas = np.linspace(0.05, 0.5, 400)
    rocks = draw_rocks(np.random.default_rng(1), areas)
    assert set(rocks.counts) == {5, 6, 7, 8}
    for corners, area, reach in zip(split(rocks), areas, rocks.reach, strict=True):
        assert area_of(corners) == pytest.approx(area, rel=1e-12)
        edges = np.roll(corners, -1, axis=0) - corners
        following = np.roll(edges, -1, axis=0)
        assert np.all(edges[:, 0] * following[:, 1] - edges[:, 1] * following[:, 0] > 0.0)
        np.testing.assert_allclose(corners.mean(axis=0), 0.0, atol=1e-12)
        assert np.hypot(*corners.T).max() == pytest.approx(reach)


def test_rocks_are_turned_every_way() -> None:
    rocks = draw_rocks(np.random.default_rng(2), np.full(2000, 0.2))
    axes = []
    for corners in split(rocks):
        spread = corners.T @ corners
        axes.append(0.5 * math.atan2(2.0 * spread[0, 1], spread[0, 0] - spread[1, 1]))  # of the long axis
    doubled = np.exp(2j * np.array(axes))
    assert abs(doubled.mean()) < 3.5 / math.sqrt(2000)  # of 2000 even angles


@pytest.mark.parametrize("name", FORESTS)
def test_rocky_worlds_have_the_trees_areas_and_keep_their_rules(name: str) -> None:
    task = load_task(name)
    trees, setup = task.make(1), task.make(1, obstacles="rocks")
    rocks = rocks_of(setup)
    assert WorldSpec.model_validate(setup.world.model_dump()) == setup.world
    np.testing.assert_allclose(
        [area_of(rock) for rock in rocks], [math.pi * tree.radius**2 for tree in trees.world.obstacles]
    )
    centres = np.array([rock.mean(axis=0) for rock in rocks])
    reach = np.array([np.hypot(*(rock - rock.mean(axis=0)).T).max() for rock in rocks])
    gaps = np.hypot(*(centres[:, None] - centres[None, :]).transpose(2, 0, 1)) - reach - reach[:, None]
    assert gaps[np.triu_indices(len(rocks), 1)].min() >= -1e-9
    world = compile_world(setup.world)
    for x, y in np.vstack([setup.starts[:, :2], setup.goals]).tolist():
        assert static_clearance(world, x, y, x, y, 2.0) >= 0.60 - 1e-9
    corners = np.vstack(rocks)
    if name == "T3":
        assert np.hypot(*corners.T).max() <= 20.0 / math.sqrt(math.pi) + 1e-9
    else:
        assert corners.min() >= -1e-9 and corners.max() <= 20.0 + 1e-9
    check_setup(setup, 0.15)


def test_rocks_depend_on_the_seed_only_and_keep_the_starts_of_the_trees() -> None:
    make = load_task("T2").make
    one, same, other = (make(seed, obstacles="rocks") for seed in (5, 5, 6))
    assert one.world == same.world
    assert one.world != other.world
    assert np.array_equal(one.goals, make(5).goals) and np.array_equal(one.starts, make(5).starts)
    assert make(5, obstacles="trees").world == make(5).world


def test_an_option_that_is_a_word_is_checked() -> None:
    with pytest.raises(UnknownNameError, match=r"task T1: unknown obstacles 'rock'; did you mean 'rocks'"):
        load_task("T1").make(0, obstacles="rock")
    with pytest.raises(UnknownNameError, match="unknown obstacles '1\\.0'"):
        load_task("T1").make(0, obstacles=1.0)
    assert load_task("T1").make(0, density="2e-1").world == load_task("T1").make(0, density=0.2).world
