"""Who stands in whose only way is said of robots that did not arrive."""

from __future__ import annotations

import numpy as np

from helpers import place_scenario, wall
from swarmscope.judging.in_the_way import who_is_in_the_way
from swarmscope.judging.run import figures, play
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario

DOOR = [wall((0.0, -14.0), (0.0, -0.45)), wall((0.0, 0.45), (0.0, 14.0))]
RADII = np.full(3, 0.15)


def asked(places, things=DOOR):
    values = place_scenario(
        [(-3.0, 0.0, 0.0), (0.0, 0.0, 0.0), (-2.0, 3.0, 0.0)], [(3.0, 0.0), (0.0, 0.0), (-2.0, 3.0)], things
    )
    return who_is_in_the_way(make_setup(parse_scenario(values, "test")), np.array(places), RADII, 0)


def test_a_robot_parked_in_the_only_door_is_named_and_one_beside_it_is_not():
    assert asked([(-3.0, 0.0), (0.0, 0.0), (-2.0, 3.0)]) == [1]
    assert asked([(-3.0, 0.0), (0.6, 1.0), (-2.0, 3.0)]) == []


def test_without_a_wall_nobody_is_in_the_way_and_two_in_a_door_are_not_one():
    assert asked([(-3.0, 0.0), (0.0, 0.0), (-2.0, 3.0)], []) == []
    assert asked([(-3.0, 0.0), (0.0, 0.0), (0.35, 0.0)]) == []


def test_the_failure_says_so():
    values = place_scenario([(-2.0, 0.0, 0.0), (0.0, 0.0, 0.0)], [(2.0, 0.0), (0.0, 0.0)], DOOR, limit_s=8.0)
    failures = figures(play(parse_scenario(values, "test")))["failures"]
    assert [failure["robot"] for failure in failures] == [0]
    assert failures[0]["why"].endswith("m from its goal; robot 1 stands in its only way")
