"""The barrier: hand-worked projections, and no contact ever, whatever robots wish for."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.disk import maps, rules, runs
from swarmscope.disk.controllers._barrier import KEPT, MOST, nearest_admissible

R, STEP, GAIN = 0.05, 0.00025, 0.9
NONE = np.empty((0, 3))


def admissible(wish, state, disc=NONE):
    return nearest_admissible(0, *wish, np.array(state, dtype=float), disc, R, STEP, GAIN, np.zeros((MOST, 3)))


def test_free_wishes_pass():
    assert admissible((0.6, -0.8), [(0, 0), (0.5, 0)]) == (0.6, -0.8)


def test_a_robot_ahead_leaves_half_of_the_gap():
    gap = 0.0002
    ux, uy = admissible((1.0, 0.0), [(0, 0), (2 * R + gap, 0)])
    assert (ux, uy) == pytest.approx((0.5 * GAIN * (gap - KEPT) / STEP, 0.0))


def test_sliding_along_is_not_slowed():
    ux, uy = admissible((0.6, 0.8), [(0, 0), (2 * R + KEPT / 2, 0)])
    assert (ux, uy) == pytest.approx((0.0, 0.8))


def test_an_obstacle_leaves_the_whole_gap():
    disc = np.array([[0.0, 0.25, 0.2 - 0.0001]])
    assert admissible((0.0, 1.0), [(0, 0)], disc) == pytest.approx((0.0, GAIN * (0.0001 - KEPT) / STEP))


def test_between_two_robots_one_cannot_advance():
    away = 2 * R
    state = [(0, 0), (away * math.cos(0.5), away * math.sin(0.5)), (away * math.cos(0.5), -away * math.sin(0.5))]
    assert admissible((1.0, 0.0), state) == pytest.approx((0.0, 0.0), abs=1e-12)


def test_the_rim_is_not_left():
    x = 1.0 - 1e-5
    ux, uy = admissible((0.8, 0.6), [(x, 0.0)])
    assert math.hypot(x + ux * STEP, uy * STEP) <= 1.0
    assert uy == pytest.approx(0.6)


@pytest.mark.parametrize("aside", [0.0, 1e-5, 1e-4, 1e-3])
def test_on_the_rim_with_a_robot_inwards_one_stays_in_the_disk_and_is_not_too_fast(aside):
    # On the rim one has to go inwards a little; a robot there leaves only velocities far along the rim for that.
    away = 2 * R + KEPT
    state = [(1.0, 0.0), (1.0 - away * math.cos(aside), away * math.sin(aside))]
    for wish in ((1.0, 0.0), (0.0, 1.0), (0.0, -1.0), (-1.0, 0.0)):
        ux, uy = admissible(wish, state)
        assert math.hypot(ux, uy) <= 1.0
        assert math.hypot(1.0 + ux * STEP, uy * STEP) <= 1.0 + 1e-12


def test_too_many_things_at_once_make_one_stand():
    disc = np.tile([[0.0, 0.25, 0.2]], (MOST + 5, 1))
    assert admissible((1.0, -1.0), [(0, -1e-5)], disc) == (0.0, 0.0)


class Wild:
    """Robots that push in random directions for a while, mostly towards the middle, behind the barrier."""

    def __init__(self, of, seed, gain):
        self.of, self.rng, self.gain = of, np.random.default_rng(seed), gain
        self.first, self.disc = of.discs()
        self.planes = np.zeros((MOST, 3))
        self.wish = np.zeros(of.goal.shape)

    def velocities(self, step, alive, state, velocity, out):
        if step % 10 == 0:
            pull = -state[0] * self.rng.uniform(0, 3) + self.rng.normal(size=state[0].shape)
            self.wish[0] = pull / np.linalg.norm(pull, axis=1, keepdims=True)
        rules_ = self.of.rules
        for i in range(rules_.n):
            out[0, i] = nearest_admissible(
                i, *self.wish[0, i], state[0], self.disc, rules_.r, rules_.step, self.gain, self.planes
            )


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 10_000), st.sampled_from(["empty", "c0", "u", "minima"]), st.sampled_from([0.5, 0.9, 0.999]))
def test_nobody_touches_anything_whatever_is_wished_for(seed, name, gain):
    of = runs.problem(rules.Rules(n=8, r=0.06, dt=0.1, max_steps=1500), [maps.NAMED[name]], [tuple(range(8))])
    outcome = runs.play(of, Wild(of, seed, gain))
    assert outcome.status.tolist() == [runs.TIMED_OUT]
    assert outcome.robot_gap[0] > 0 and outcome.obstacle_gap[0] > 0
