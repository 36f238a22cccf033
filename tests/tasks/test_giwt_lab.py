"""GIWT's laboratory: what is published of it, and that the maps of the other GIWT tasks are what they were."""

import hashlib

import numpy as np
import pytest

from swarmscope.errors import ConfigError, UnknownNameError
from swarmscope.judging.shortest_path import grid_paths, lengths_m
from swarmscope.sim.world import Circle, Polygon
from swarmscope.tasks import load_task
from swarmscope.tasks.giwt_lab import EDGE_M, FREE_M


def lab(seed=0, **options):
    return load_task("GIWT_lab").make(seed, **options)


def test_five_robots_cross_the_floor_from_one_short_side_to_the_other():
    setup = lab()
    corners = np.vstack([o.points for o in setup.world.obstacles[:4]])
    inside = (np.abs(corners - (4.0, 5.0)) < (4.0, 5.0)).all(axis=1)
    assert not inside.any() and setup.world.bounds == (-0.15, -0.15, 8.15, 10.15)
    np.testing.assert_allclose(setup.starts[:, 0], [0.8, 2.4, 4.0, 5.6, 7.2])
    np.testing.assert_allclose(setup.goals - setup.starts[:, :2], [[0.0, 10.0 - 2.0 * (EDGE_M + 0.15)]] * 5)


def test_things_keep_off_starts_and_goals_and_are_of_both_kinds():
    kinds, counts = set(), set()
    for seed in range(20):
        setup = lab(seed)
        points = np.vstack([setup.starts[:, :2], setup.goals])
        things = setup.world.obstacles[4:]
        counts.add(len(things))
        for thing in things:
            kinds.add(type(thing))
            if isinstance(thing, Circle):
                assert 0.2 <= thing.radius <= 0.8
                assert np.hypot(*(points - thing.center).T).min() - thing.radius > 0.15 + FREE_M
            else:
                sides = np.hypot(*(np.roll(thing.points, -1, axis=0) - np.array(thing.points)).T)
                assert np.all((sides > 0.2 - 1e-9) & (sides < 1.2 + 1e-9))
    assert kinds == {Circle, Polygon} and min(counts) >= 6 and max(counts) == 12


def test_ways_are_a_little_longer_than_the_floor():
    every = []
    for seed in range(5):
        setup = lab(seed)
        every += lengths_m(grid_paths(setup.world, setup.starts, setup.goals, 0.15)).tolist()
    assert min(every) >= 8.7 and 8.75 < np.mean(every) < 11.0


def test_options_choose_kinds_and_size():
    setup = lab(3, obstacles="B", length_m=14.0, fewest=2.0, most=2.0)
    assert [type(o) for o in setup.world.obstacles[4:]] == [Circle, Circle]
    assert setup.goals[0, 1] == pytest.approx(14.0 - EDGE_M - 0.15)
    with pytest.raises(UnknownNameError, match="unknown obstacles 'D'"):
        lab(0, obstacles="D")
    with pytest.raises(ConfigError, match="most"):
        lab(0, most=-1.0)


@pytest.mark.parametrize(("name", "state"), [("GIWT_1", "450753905ca1"), ("GIWT_2", "5a4f9d8545f6")])
def test_maps_of_a_seed_never_change(name, state):
    """Data for training was made from them."""
    setup = load_task(name).make(30000)
    text = setup.world.model_dump_json(exclude_none=True) + str(np.round(setup.starts, 9).tolist())
    assert hashlib.sha256(text.encode()).hexdigest()[:12] == state
