"""The navigation function: hand-worked values, gradient, descent, no contact, arrival."""

from __future__ import annotations

import math

import numpy as np
import pytest

from swarmscope.disk import bounds, controllers, random_maps, runs, stalls
from swarmscope.disk.controllers._potential import attraction, obstruction
from swarmscope.disk.controllers.navigation_function import MARGINS, widest_margins
from swarmscope.disk.maps import EMPTY, REPORT_MAPS, DiskMap
from swarmscope.disk.rules import Rules, all_permutations, goals, scaled

IDENTITY = (0, 1, 2, 3, 4)
PERMUTATIONS = list(all_permutations(5))


def kind(**changes):
    return controllers.find("navigation-function", changes)


def made(of, **changes):
    one = kind(**changes)
    return one.create(of, one.params)


def potential(controller, state):
    out = np.empty(len(state))
    controller.potential(state, out)
    return out


def free_states(rng, on, rules, count, spread=1.0, least=0.002):
    """Return states (count, n, 2) with gaps above ``least``, within a square of half width ``spread``."""
    states = []
    while len(states) < count:
        state = rng.uniform(-spread, spread, (rules.n, 2))
        apart = np.linalg.norm(state[:, None] - state[None], axis=2) + 9.0 * np.eye(rules.n)
        off = np.linalg.norm(state[:, None] - on.obstacles[None, :, :2], axis=2) - on.obstacles[:, 2] - rules.r
        if apart.min() > 2 * rules.r + least and (off > least).all() and (np.linalg.norm(state, axis=1) < 0.98).all():
            states.append(state)
    return np.array(states)


def test_attraction_by_hand():
    assert attraction(0.3, 1.0, 0.4) == pytest.approx((0.1, 0.6))
    assert attraction(0.3, 2.0, 0.4) == pytest.approx((0.09, 0.6))
    assert attraction(0.0, 1.0, 0.02) == (0.0, 0.0)


def test_obstruction_by_hand():
    assert obstruction(0.02, 0.04) == pytest.approx((-math.log(0.875), 0.75 / (0.875 * 0.04)))
    assert obstruction(0.04, 0.04) == (0.0, 0.0)
    assert obstruction(0.0, 0.04) == (math.inf, math.inf)
    assert obstruction(1e-9, 0.04)[1] == pytest.approx(1e9, rel=1e-6)


def test_the_potential_of_two_robots_by_hand():
    rules = Rules(n=2)
    controller = made(runs.problem(rules, [EMPTY], [(0, 1)]), k=10, reach=1, smooth=0.02)
    goal = goals((0, 1))
    state = np.array([[goal[0] + (0.3, 0.0), goal[0] + (0.3, 0.125)]])
    ways = [0.3, np.linalg.norm(state[0, 1] - goal[1])]
    gamma = sum(math.sqrt(way**2 + 0.02**2) - 0.02 for way in ways)
    half = 0.875  # h half way through the range: the gap is 0.025 and the range 0.05
    assert potential(controller, state) == pytest.approx([10 * math.log(gamma) - math.log(half)])


def test_the_potential_is_infinite_at_contact_and_lowest_at_the_goals():
    of = runs.problem(Rules(), [EMPTY], [IDENTITY])
    controller = made(of)
    state = of.start.copy()
    state[0, 1] = state[0, 0] + (-0.1, 0.0)
    assert potential(controller, state)[0] == math.inf
    assert potential(controller, of.goal.copy())[0] < potential(controller, of.start.copy())[0] - 1000.0


@pytest.mark.parametrize("name", ["empty", "c0", "crevice"])
def test_the_gradient_is_that_of_the_potential(name):
    on, rules = ({"empty": EMPTY} | REPORT_MAPS)[name], Rules()
    rng = np.random.default_rng(5)
    state = free_states(rng, on, rules, 20, spread=0.45 if name == "empty" else 0.9)
    # One robot stands in the margin of an obstacle, so that it pushes, too.
    if len(on.obstacles):
        x, y, radius = on.obstacles[1]
        state = state[np.linalg.norm(state[:, 1:] - (x, y), axis=2).min(axis=1) > radius + 0.2]
        state[:, 0] = (x, y) + (radius + rules.r + 0.002) * np.array([math.cos(0.3), math.sin(0.3)]) * np.sign(y)
    controller = made(runs.problem(rules, [on], [IDENTITY] * len(state)))
    gradient = np.empty(state.shape)
    controller.gradient(state, gradient)
    h = 1e-7
    found = np.empty(state.shape)
    for i in range(rules.n):
        for axis in range(2):
            step = np.zeros((rules.n, 2))
            step[i, axis] = h
            found[:, i, axis] = (potential(controller, state + step) - potential(controller, state - step)) / (2 * h)
    assert len(state) >= 5
    np.testing.assert_allclose(found, gradient, rtol=1e-4, atol=0.05)


@pytest.mark.parametrize("steer", [0, 1])
@pytest.mark.parametrize("name", ["empty", "u", "minima"])
def test_the_potential_falls_along_short_steps(name, steer):
    on = ({"empty": EMPTY} | REPORT_MAPS)[name]
    rules = Rules(dt=0.0002)
    rng = np.random.default_rng(11)
    state = free_states(rng, on, rules, 30, spread=0.6, least=0.006)
    of = runs.problem(rules, [on], [PERMUTATIONS[k] for k in rng.integers(0, 120, len(state))])
    controller = made(of, steer=steer, k=200)
    velocity, out = np.zeros(state.shape), np.zeros(state.shape)
    before = potential(controller, state)
    for step in range(200):
        controller.velocities(step, np.arange(len(state)), state, velocity, out)
        velocity[:] = out
        state += rules.step * out
        after = potential(controller, state)
        assert (after <= before + 1e-6).all(), (step, (after - before).max())
        before = after


@pytest.mark.parametrize("changes", [{}, {"k": 1e7}, {"reach": 0.01}, {"steer": 0, "power": 0.5}])
def test_robots_never_touch_even_with_long_steps(changes):
    for n, dt in ((5, 0.4), (12, 0.2), (25, 0.2)):
        rules = scaled(n, dt=dt, max_steps=400)
        cases = [random_maps.random_map(seed, rules) for seed in range(20990, 20995)]
        of = runs.Problem(rules, tuple(c.map for c in cases), np.arange(5), np.array([c.permutation for c in cases]))
        ended = runs.play(of, made(of, **changes))
        assert set(ended.status) <= {runs.ARRIVED, runs.TIMED_OUT}
        assert ended.robot_gap.min() > 0.0
        assert ended.obstacle_gap.min() > 0.0


@pytest.mark.parametrize("name", list(REPORT_MAPS))
def test_robots_of_the_report_arrive_soon(name):
    of = runs.problem(Rules(), [REPORT_MAPS[name]], PERMUTATIONS[::12])
    ended = runs.play(of, made(of))
    assert (ended.status == runs.ARRIVED).all()
    assert (ended.steps >= bounds.bound(of)).all()
    assert (ended.steps / bounds.bound(of)).mean() < 1.06


def test_robots_do_not_arrive_everywhere_without_the_turn():
    of = runs.problem(Rules(), [REPORT_MAPS["c0"]], [IDENTITY])
    assert runs.play(of, made(of)).status[0] == runs.ARRIVED
    assert runs.play(of, made(of, steer=0)).status[0] == runs.TIMED_OUT


@pytest.mark.parametrize("name", list(REPORT_MAPS))
def test_alone_there_is_no_stall_point(name):
    for robot in (0, 2):
        of = stalls.Situation(kind(), REPORT_MAPS[name], Rules(), IDENTITY, robot)
        found = stalls.basins(of, 51, coarse=8.0)
        assert found.share(stalls.ARRIVES) == 1.0, stalls.describe(found)
        assert found.stalls == ()


def test_out_of_a_crevice_between_two_margins():
    of = stalls.Situation(kind(), REPORT_MAPS["crevice"], Rules(), IDENTITY, 2)
    controller = made(runs.problem(Rules(), [of.map], [IDENTITY]))
    state = np.array([[[0.9, 0.0], [0.0, 0.9], [0.62, 0.0], [-0.9, 0.0], [0.0, -0.9]]])
    out = np.zeros(state.shape)
    controller.velocities(0, np.array([0]), state, np.zeros(state.shape), out)
    assert out[0, 2, 0] > 0.05


def test_margins_shrink_where_a_passage_is_narrow():
    def walls(half):
        """Two rows of discs with a gap of twice ``half`` between them, from rim to rim."""
        away = np.arange(half + 0.05, 0.96, 0.05)
        heights = np.concatenate([away, -away])
        return DiskMap("walls", np.column_stack([0.0 * heights, heights, np.full(len(heights), 0.05)]))

    rules = Rules(n=2)
    wide, narrow = (runs.problem(rules, [walls(0.05 + gap)], [(0, 1)]) for gap in (0.03, 0.0012))
    assert widest_margins(wide)[0] == MARGINS[0]
    assert widest_margins(narrow)[0] == 0.001
