"""The expert's side and what the other one costs, on worlds whose answer is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.judging.sides import cost_to_go
from swarmscope.learning.labels import LABELLED, NOTHING_AHEAD, TIE, UNREACHABLE, build_wall, label
from swarmscope.sim.world import Circle, Wall, WorldSpec, compile_world
from swarmscope.tasks._occupancy import rasterise

BOX = (-6.0, -6.0, 6.0, 6.0)
START, GOAL = np.array([-2.0, 0.0]), np.array([4.0, 0.0])


def raster_of(*obstacles, resolution=0.05):
    return rasterise(compile_world(WorldSpec(obstacles=list(obstacles), bounds=BOX)), 0.19, BOX, resolution)


def wall(*points):
    return Wall(points=[tuple(map(float, p)) for p in points])


@pytest.mark.parametrize("side", [1, -1])
def test_a_wall_is_passed_where_it_ends_sooner(side):
    raster = raster_of(wall((-1, -3 * side), (-1, 1 * side)))
    found = label(raster, START, GOAL, 2.15)
    assert (found.outcome, found.side) == (LABELLED, side)
    near, far = (math.hypot(1, h) + math.hypot(5, h) for h in (1.19, 3.19))
    assert found.way_m == pytest.approx(near, rel=0.09)  # an 8-connected way is up to 8 % longer
    assert found.detour_m == pytest.approx(far - near, rel=0.25)


def test_a_disc_on_the_line_is_a_tie_and_one_far_ahead_is_nothing():
    assert label(raster_of(Circle(center=(-1.0, 0.0), radius=0.5)), START, GOAL, 2.15).outcome == TIE
    assert label(raster_of(Circle(center=(2.0, 0.1), radius=0.5)), START, GOAL, 2.15).outcome == NOTHING_AHEAD


def test_a_goal_in_a_closed_room_has_no_label():
    room = wall((3, -1), (5, -1), (5, 1), (3, 1), (3, -1))
    assert label(raster_of(room), START, GOAL, 9.0).outcome == UNREACHABLE


def test_a_side_that_is_closed_costs_all_that_is_counted():
    closed = wall((-1, -5.99), (-1, 1))
    found = label(raster_of(closed, wall((-5.9, -5.9), (5.9, -5.9))), START, GOAL, 2.15)
    assert (found.outcome, found.side, found.detour_m) == (LABELLED, 1, 20.0)


def test_no_step_crosses_a_built_wall():
    for angle in np.linspace(0.0, 2.0 * math.pi, 37):
        blocked = np.zeros((60, 60), np.uint8)
        build_wall(blocked, 30.5, 30.5, math.cos(angle), math.sin(angle))
        beside = [int(30.5 + 12 * math.cos(angle + off)) for off in (0.5, -0.5)]
        rows = [int(30.5 + 12 * math.sin(angle + off)) for off in (0.5, -0.5)]
        cost = cost_to_go(blocked, rows[0], beside[0])
        assert cost[rows[1], beside[1]] > 20.0  # straight through it would be 12 cells


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 10_000))
def test_a_search_that_ends_early_has_the_cost_it_was_asked_for(seed):
    rng = np.random.default_rng(seed)
    blocked = (rng.random((40, 50)) < 0.3).astype(np.uint8)
    goal, until = rng.integers(0, 40, 2), rng.integers(0, 40, 2)
    whole = cost_to_go(blocked, int(goal[0]), int(goal[1]))
    early = cost_to_go(blocked, int(goal[0]), int(goal[1]), int(until[0]), int(until[1]))
    assert early[until[0], until[1]] == whole[until[0], until[1]]


def test_mirroring_the_world_mirrors_the_side():
    rng, compared = np.random.default_rng(5), 0
    for _ in range(20):
        discs = [(float(x), float(y), float(r)) for x, y, r in zip(
            rng.uniform(-1, 3, 6), rng.uniform(-3, 3, 6), rng.uniform(0.3, 1.0, 6), strict=True)]  # fmt: skip
        found = [
            label(raster_of(*(Circle(center=(x, s * y), radius=r) for x, y, r in discs)), START, GOAL, 3.0)
            for s in (1, -1)
        ]
        if found[0].outcome == LABELLED and found[1].outcome == LABELLED and found[0].detour_m > 0.3:
            assert found[0].side == -found[1].side
            compared += 1
    assert compared > 5
