"""The rules of the unit disk: places, permutations, radii."""

import math

import numpy as np
import pytest

from swarmscope.disk import rules
from swarmscope.errors import ConfigError


def test_defaults_are_those_of_the_report():
    found = rules.Rules()
    assert (found.n, found.r, found.tol, found.max_steps) == (5, 0.05, 0.005, 30_000)
    assert found.step == pytest.approx(0.00025)


def test_starts_and_goals_face_each_other():
    assert rules.starts(5)[0] == pytest.approx([1.0, 0.0])
    assert rules.starts(5)[1] == pytest.approx([math.cos(math.pi / 5), math.sin(math.pi / 5)])
    assert rules.goals((0, 1, 2, 3, 4))[0] == pytest.approx([-0.999, 0.0])
    assert rules.goals((2, 1, 0, 3, 4))[0] == pytest.approx(
        0.999 * np.array([math.cos(1.4 * math.pi), math.sin(1.4 * math.pi)])
    )


def test_all_permutations_are_120():
    assert len(set(rules.all_permutations(5))) == 120
    with pytest.raises(ConfigError, match="too many"):
        rules.all_permutations(9)


@pytest.mark.parametrize("text", ["0,3,1,4,2", "03142", " 0, 3, 1, 4, 2 "])
def test_permutations_are_read(text):
    assert rules.read_permutation(text, 5) == (0, 3, 1, 4, 2)


@pytest.mark.parametrize("text", ["", "0,1,2,3", "0,1,2,3,3", "0,1,2,3,5", "abcde", "0,1,2,3,4,"])
def test_what_is_no_permutation_is_refused(text):
    with pytest.raises(ConfigError, match="each of 0 to 4 once"):
        rules.read_permutation(text, 5)


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"n": 0}, "above 0"),
        ({"n": 2.0}, "whole number"),
        ({"n": 201, "r": 0.001}, "at most 200"),
        ({"r": math.nan}, "above 0"),
        ({"r": 0.31}, "overlap at their starts"),
        ({"tol": -1.0}, "above 0"),
        ({"v_max": 50.0}, "not small"),
        ({"r": "0.05"}, "not a number"),
    ],
)
def test_numbers_that_make_no_sense_are_refused(changes, why):
    with pytest.raises(ConfigError, match=why):
        rules.Rules(**changes)


@pytest.mark.parametrize("n", [1, 2, 5, 10, 50, 100, 200])
def test_scaled_robots_fit_side_by_side(n):
    found = rules.scaled(n)
    assert n == 1 or 2 * found.r < rules.spacing(n)
    assert n * found.r**2 <= 5 * 0.05**2 + 1e-12
    assert rules.scaled(5) == rules.Rules()
