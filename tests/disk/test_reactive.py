"""The reactive controller: giving way, arriving, and the figures that it is known for."""

import math

import numpy as np
import pytest

from swarmscope.disk import bounds, controllers, maps, random_maps, rules, runs
from swarmscope.disk.controllers.reactive import free_run, manoeuvres


def play(of, **changes):
    kind = controllers.find("reactive", changes)
    return runs.play(of, kind.create(of, kind.params))


def test_free_run_is_the_way_to_the_rim():
    assert free_run(0.0, 0.0, 1.0, 0.0) == pytest.approx(1.0)
    assert free_run(0.6, 0.0, 0.0, 1.0) == pytest.approx(0.8)
    assert free_run(1.0, 0.0, -0.5, 0.0) == pytest.approx(4.0)
    assert free_run(0.3, 0.3, 0.0, 0.0) == 0.0


def test_manoeuvres_contain_turning_back_and_waiting():
    menu = manoeuvres(0.05)
    assert math.pi in menu[:, 0] and 0.0 in menu[:, 1]
    assert menu[:, 2].max() == pytest.approx(16 * 0.05)


def test_alone_it_needs_the_bound():
    of = runs.problem(rules.Rules(n=1), list(maps.REPORT_MAPS.values()), [(0,)])
    assert (play(of).steps - bounds.bound(of)).max() <= 3


def test_the_robot_that_goes_first_is_not_delayed():
    # Two robots cross; both have the same free run, so the first of them has right of way.
    of = runs.problem(rules.Rules(n=2), [maps.EMPTY], [(0, 1)])
    outcome = play(of)
    assert outcome.status.tolist() == [runs.ARRIVED]
    assert outcome.arrival[0, 0] <= 7977 < outcome.arrival[0, 1] < 8500
    assert outcome.robot_gap[0] > 0


def test_some_permutations_on_all_maps_arrive_near_the_bound():
    some = list(rules.all_permutations(5))[::8]
    of = runs.problem(rules.Rules(), list(maps.REPORT_MAPS.values()), some)
    outcome = play(of)
    assert (outcome.status == runs.ARRIVED).all()
    assert outcome.steps.mean() / bounds.bound(of).mean() < 1.03
    assert outcome.robot_gap.min() > 0 and outcome.obstacle_gap.min() > 0


@pytest.mark.parametrize(("n", "seeds"), [(5, range(20_000, 20_010)), (20, range(20_000, 20_002))])
def test_random_maps_are_crossed_without_contact(n, seeds):
    scaled = rules.scaled(n)
    cases = [random_maps.random_map(seed, scaled) for seed in seeds]
    of = runs.Problem(
        scaled, tuple(one.map for one in cases), np.arange(len(cases)), np.array([one.permutation for one in cases])
    )
    outcome = play(of)
    assert (outcome.status == runs.ARRIVED).all()


def test_the_same_run_in_another_batch_is_the_same():
    of = runs.problem(rules.Rules(), [maps.NAMED["minima"]], [(0, 1, 2, 3, 4), (4, 2, 0, 1, 3)])
    assert play(of).steps.tolist()[1:] == play(of.part(slice(1, 2))).steps.tolist()
