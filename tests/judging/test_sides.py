import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from helpers import circle, place_scenario
from swarmscope.judging.sides import cost_to_go, make_advice
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.sim.advice import side_of_way
from swarmscope.sim.world import WorldSpec
from swarmscope.tasks import Setup
from swarmscope.tasks._occupancy import Raster
from swarmscope.tasks._search import Searcher


def side(obstacles, start=(-4.0, 0.0), goal=(4.0, 0.0), horizon=math.inf):
    values = place_scenario([(*start, 0.0)], [goal], obstacles)
    advice = make_advice(make_setup(parse_scenario(values, "test")), 0.15)
    cells = [(p - o) / advice.resolution for p, o in zip((*start, *goal), (advice.x0, advice.y0) * 2, strict=True)]
    return side_of_way(advice.cost[0], *cells, horizon / advice.resolution)


def box(x0, y0, x1, y1):
    return {"type": "polygon", "points": [[x0, y0], [x1, y0], [x1, y1], [x0, y1]]}


def test_the_shorter_way_round():
    assert side([]) == 0
    assert side([circle(0.0, 0.3, 1.0)]) == -1
    assert side([circle(0.0, -0.3, 1.0)]) == 1
    assert side([circle(0.0, 0.3, 1.0)], (4.0, 0.0), (-4.0, 0.0)) == 1  # the other way round, right is left
    assert side([circle(0.0, 2.0, 1.0)]) == 0  # beside the way


def test_what_is_far_ahead_is_worth_no_side_yet():
    assert side([circle(0.0, 0.3, 1.0)], horizon=2.0) == 0
    assert side([circle(0.0, 0.3, 1.0)], horizon=3.0) == -1


def test_only_the_first_obstacle_counts():
    assert side([circle(-2.0, 0.4, 0.6), circle(2.0, -0.4, 0.6)]) == -1
    assert side([circle(-2.0, -0.4, 0.6), circle(2.0, 0.4, 0.6)]) == 1


def test_out_of_a_pocket():
    """A pocket open towards the robot, its lower arm shorter: out and round below, on the right."""
    pocket = [box(1.0, -1.0, 1.2, 3.0), box(-3.0, 2.8, 1.0, 3.0), box(-1.0, -1.2, 1.2, -1.0)]
    assert side(pocket, (0.0, 1.5), (4.0, 1.5)) == -1


def test_no_way_no_side():
    walls = [box(-1, -1, 1, -0.9), box(-1, 0.9, 1, 1), box(-1, -1, -0.9, 1), box(0.9, -1, 1, 1)]
    spec = WorldSpec(obstacles=walls, bounds=(-5, -5, 5, 5))
    advice = make_advice(Setup(spec, np.array([[-4.0, 0.0, 0.0]]), np.array([[0.0, 0.0]])), 0.15)
    cells = [(p - o) / advice.resolution for p, o in zip((-4.0, 0.0) * 2, (advice.x0, advice.y0) * 2, strict=True)]
    assert side_of_way(advice.cost[0], *cells[:2], cells[2] + 80.0, cells[3], math.inf) == 0


@given(st.integers(0, 10_000))
def test_cost_to_go_is_what_a_search_finds(seed):
    rng = np.random.default_rng(seed)
    blocked = (rng.random((20, 24)) < 0.3).astype(np.uint8)
    blocked[3, 4] = blocked[15, 20] = 0
    cost = cost_to_go(blocked, 15, 20)
    length = Searcher(Raster(blocked, 0.0, 0.0, 1.0)).length_m(np.array([3, 4]), np.array([15, 20]))
    assert cost[3, 4] == pytest.approx(length, rel=1e-5) or (math.isinf(length) and math.isinf(cost[3, 4]))
    assert np.all(np.isinf(cost[blocked == 1])) and cost[15, 20] == 0.0


def test_too_many_robots_for_the_fields():
    values = place_scenario([(0.0, 0.0, 0.0)], [(1.0, 0.0)])
    setup = make_setup(parse_scenario(values, "test"))
    many = type(setup)(setup.world, np.zeros((201, 3)), np.zeros((201, 2)))
    with pytest.raises(ValueError, match="at most 200"):
        make_advice(many, 0.15)
