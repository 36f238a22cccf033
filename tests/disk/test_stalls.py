"""The check for local minima on fields whose ends are known."""

from __future__ import annotations

import numpy as np
import pytest

from swarmscope.disk import controllers, stalls
from swarmscope.disk.maps import EMPTY, REPORT_MAPS, DiskMap
from swarmscope.disk.rules import Rules, goals, starts
from swarmscope.errors import ConfigError

IDENTITY = (0, 1, 2, 3, 4)


class Field:
    """A controller whose robots all follow one function of position and goal."""

    def __init__(self, problem, function):
        self.goal, self.function = problem.goal, function

    def velocities(self, step, alive, state, velocity, out):
        out[alive] = self.function(state[alive], self.goal[alive])


class FieldWithPotential(Field):
    def potential(self, state, out):
        out[:] = ((state - self.goal) ** 2).sum(axis=(1, 2))


def situation(function, kind=Field, on=EMPTY, robot=2, others=None):
    made = controllers.Kind("made-up", "", "", "", None, lambda problem, params: kind(problem, function))
    return stalls.Situation(made, on, Rules(), IDENTITY, robot, others)


def home(state, goal):
    return 100.0 * (goal - state)


def to_a_point(state, goal):
    return 100.0 * (np.array([0.31, -0.22]) - state)


def round_the_middle(state, goal):
    return 0.5 * np.stack([-state[..., 1], state[..., 0]], axis=-1)


def test_a_field_that_leads_home_has_one_basin():
    found = stalls.basins(situation(home), 15, coarse=20.0)
    assert found.share(stalls.ARRIVES) == 1.0
    assert found.stalls == ()
    assert np.linalg.norm(found.ends[found.grid.free] - goals(IDENTITY)[2], axis=-1).max() <= 0.005
    assert np.isnan(found.ends[~found.grid.free]).all()
    assert "0 stall points" in stalls.describe(found)


def test_a_sink_is_found_where_it_is():
    found = stalls.basins(situation(to_a_point), 15, coarse=20.0)
    assert [one.points for one in found.stalls] == [found.grid.free.sum()]
    assert (found.stalls[0].x, found.stalls[0].y) == pytest.approx((0.31, -0.22), abs=0.005)
    assert set(found.labels[found.grid.free]) == {1}
    assert f"1 stall point: (0.310, -0.220) from {found.stalls[0].points}" in stalls.describe(found)


def test_two_sinks_are_two_with_the_larger_first():
    def two(state, goal):
        sink = np.where(state[..., :1] > 0.3, np.array([0.6, 0.0]), np.array([-0.2, 0.0]))
        return 100.0 * (sink - state)

    found = stalls.basins(situation(two), 15, coarse=20.0)
    assert [round(one.x, 2) for one in found.stalls] == [-0.2, 0.6]
    assert found.stalls[0].points > found.stalls[1].points
    assert sum(one.points for one in found.stalls) == found.grid.free.sum()


def test_circling_is_told_from_stalling():
    found = stalls.basins(situation(round_the_middle, on=REPORT_MAPS["c0"]), 9, coarse=20.0, longest=4.0)
    far = np.hypot(*np.meshgrid(found.grid.x, found.grid.y)) > 0.7
    outer = found.labels[found.grid.free & far]
    assert (outer == stalls.CIRCLES).mean() > 0.5
    assert "circle" in stalls.describe(found)


def test_a_field_into_an_obstacle_touches_it():
    found = stalls.basins(situation(home, on=REPORT_MAPS["crevice"]), 15, coarse=10.0)
    assert 0.02 < found.share(stalls.TOUCHES) < 0.5
    assert found.share(stalls.TOUCHES) + found.share(stalls.ARRIVES) == pytest.approx(1.0)
    assert "touch something" in stalls.describe(found)


def test_the_grid_leaves_out_obstacles_robots_and_the_outside():
    others = starts(5)
    others[0] = (-0.5, 0.0)
    one = DiskMap("one", np.array([[0.5, 0.0, 0.15]]))
    found = stalls.field_on_grid(situation(home, on=one, others=others), 21)

    def at(x, y):
        return bool(found.free[np.argmin(abs(found.y - y)), np.argmin(abs(found.x - x))])

    assert found.free.shape == (21, 21)
    assert not at(1.0, 1.0)
    assert not at(0.5, 0.0)
    assert not at(0.6, 0.1)
    assert not at(0.5, 0.2)  # contact, up to rounding
    assert at(0.5, 0.3)
    assert not at(-0.5, 0.0)
    assert at(-0.5, 0.2)
    assert at(0.3, 0.9)
    assert (np.isnan(found.velocity).any(axis=-1) == ~found.free).all()


def test_velocities_belong_to_their_points_and_are_cut_to_full_speed():
    found = stalls.field_on_grid(situation(home), 11)
    to_goal = goals(IDENTITY)[2] - np.stack(np.meshgrid(found.x, found.y), axis=-1)
    expected = to_goal / np.linalg.norm(to_goal, axis=-1, keepdims=True)
    np.testing.assert_allclose(found.velocity[found.free], expected[found.free], atol=1e-12)


@pytest.mark.parametrize("robot", [0, 3])
def test_frozen_robots_stay_where_they_are(robot):
    others = starts(5)
    seen = []

    def watch(state, goal):
        seen.append(np.delete(state, robot, axis=1).copy())
        return home(state, goal)

    found = stalls.basins(situation(watch, robot=robot, others=others), 9, coarse=20.0)
    assert found.share(stalls.ARRIVES) > 0.5
    for states in seen:
        assert (states == np.delete(others, robot, axis=0)).all()


def test_a_potential_is_used_where_there_is_one():
    of = situation(home, kind=FieldWithPotential)
    assert stalls.has_potential(of)
    value = stalls.potential_on_grid(of, 11)
    goal = goals(IDENTITY)[2]
    assert value[5, 5] == pytest.approx(goal @ goal)
    assert value[5, 6] == pytest.approx((0.2 - goal[0]) ** 2 + goal[1] ** 2)
    assert np.isnan(value[0, 0])


def test_a_controller_without_a_potential_is_an_error():
    assert not stalls.has_potential(situation(home))
    with pytest.raises(ConfigError, match="made-up offers no potential"):
        stalls.potential_on_grid(situation(home), 11)


def test_a_grid_needs_two_points():
    with pytest.raises(ConfigError, match="resolution"):
        stalls.field_on_grid(situation(home), 1)


def test_the_reports_controller_circles_for_ever_on_its_last_map():
    """Alone, from close to a disc of test 5, it goes round that disc: the loops of the report's figure 8."""
    of = stalls.Situation(controllers.find("report"), REPORT_MAPS["minima"], Rules(), (0, 1, 2, 4, 3), 2)
    found = stalls.basins(of, 21)
    assert 0.03 < found.share(stalls.CIRCLES) < 0.2
    assert found.share(stalls.CIRCLES) + found.share(stalls.ARRIVES) == pytest.approx(1.0)
    ends = found.ends[found.labels == stalls.CIRCLES]
    centres = REPORT_MAPS["minima"].obstacles[:4, :2]
    apart = np.linalg.norm(ends[:, None] - centres[None], axis=2).min(axis=1)
    assert (np.abs(apart - 0.25) < 0.02).all()
