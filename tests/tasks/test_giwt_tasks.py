"""GIWT's maps and tasks have the sizes that the document prints."""

import numpy as np
import pytest

from swarmscope.errors import ConfigError, UnknownNameError
from swarmscope.sim.world import Circle, Polygon
from swarmscope.tasks import giwt_1, giwt_2, giwt_lab
from swarmscope.tasks._check import check_setup


@pytest.mark.parametrize("task", [giwt_1, giwt_2])
@pytest.mark.parametrize("kind", ["A", "B", "C"])
def test_maps_are_as_printed(task, kind):
    counts = []
    for seed in range(6):
        setup = task.make(seed, obstacles=kind)
        check_setup(setup, 0.15)
        walls, obstacles = setup.world.obstacles[:4], setup.world.obstacles[4:]
        counts.append(len(obstacles))
        assert all(isinstance(w, Polygon) for w in walls)
        for one in obstacles:
            if isinstance(one, Circle):
                assert kind in "BC" and 0.5 <= one.radius <= 3.0
            else:
                corners = np.array(one.points)
                sides = np.hypot(*(np.roll(corners, -1, axis=0) - corners).T)
                assert kind in "AC" and sides.min() >= 0.5 - 1e-9 and sides.max() <= 3.0 + 1e-9
    assert min(counts) >= 8 and max(counts) <= 30  # an obstacle that fits nowhere is left out


def test_in_task_one_only_robot_0_moves_unless_all_do():
    setup = giwt_1.make(5)
    apart = np.hypot(*(setup.goals - setup.starts[:, :2]).T)
    assert apart[0] >= 7.0 and not apart[1:].any()
    everybody = giwt_1.make(5, moves="all")
    assert np.array_equal(everybody.starts[:, :2], setup.starts[:, :2])
    assert np.hypot(*(everybody.goals - everybody.starts[:, :2]).T).min() >= 7.0
    with pytest.raises(UnknownNameError, match="unknown moves 'none'"):
        giwt_1.make(5, moves="none")


def test_in_task_two_a_column_crosses():
    setup = giwt_2.make(5)
    assert np.ptp(setup.starts[:, 0]) == 0.0 and np.ptp(setup.goals[:, 0]) == 0.0
    assert np.allclose(setup.starts[:, 1], setup.goals[:, 1])
    assert setup.goals[0, 0] - setup.starts[0, 0] == pytest.approx(18.7)


@pytest.mark.parametrize("task", [giwt_1, giwt_2, giwt_lab])
def test_fewer_obstacles_at_most_than_at_least_are_refused(task):
    with pytest.raises(ConfigError, match=f"{task.NAME}: most: is 3, less than fewest, 4"):
        task.make(5, fewest=4, most=3)
