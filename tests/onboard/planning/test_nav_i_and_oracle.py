"""Nav-I is Nav-SCOPE with w_i = 0, and the oracle is Nav-I that is told a side."""

from __future__ import annotations

import numpy as np
import pytest

from helpers import Rows, circle, circles_world, place_scenario, rig_of, run_scenario, scan_at
from swarmscope.onboard.planning import nav_i, nav_scope, oracle
from swarmscope.onboard.reasons import ADVANCE, DECIDE, FOLLOW

TREES = [circle(-1.0, 0.3, 0.35), circle(0.6, -0.8, 0.4), circle(1.2, 0.5, 0.3), circle(-0.4, -1.6, 0.3)]
STARTS = [(-3.0, -1.5, 0.0), (-3.0, 0.0, 0.0), (-3.0, 1.5, 0.0)]
GOALS = [(3.0, 1.0), (3.0, 0.0), (3.0, -1.0)]


def trace_of(name, **params):
    planner = {"name": name, "params": params}
    return run_scenario(place_scenario(STARTS, GOALS, TREES, planner=planner, limit_s=30.0))


def test_nav_i_runs_like_nav_scope_without_weight_bit_for_bit():
    alone, weightless = trace_of("nav-i"), trace_of("nav-scope", w_i=0.0)
    assert alone.robots["arrived"].all()
    assert (alone.records.side != 0).any()
    assert alone.t_s.tobytes() == weightless.t_s.tobytes()
    assert alone.robots.tobytes() == weightless.robots.tobytes()
    assert alone.shared.tobytes() == weightless.shared.tobytes()
    for one, other in zip(alone.records, weightless.records, strict=True):
        assert one.tobytes() == other.tobytes()
    assert alone.robots["bytes"].sum() == 0
    assert trace_of("nav-scope").robots["bytes"].sum() > 0


def test_nav_i_has_nav_scopes_parameters_but_for_the_neighbours():
    ours, full = nav_i.Params._field_defaults, nav_scope.Params._field_defaults
    assert set(full) - set(ours) == {"w_i", "ask_ahead_s", "ask_every_s", "patience_s"}
    assert all(full[name] == value for name, value in ours.items())
    assert oracle.Params is nav_i.Params


def rows_before(tree, told=0):
    """Robot 0 of a planner without neighbours, ``tree`` (x, y, radius) before it."""
    rows = Rows(rig_of())
    rows.percepts["goal_distance"] = 5.0
    rows.percepts["told_side"] = told
    rows.ranges[0] = scan_at(circles_world([tree]), rows.rig)
    return rows, nav_i.new_memory(1)


def step(planner, rows, memory):
    arrays = (rows.ranges, rows.percepts, rows.shared, memory, rows.decisions, rows.scratch)
    planner.step_all(0, 1, *arrays, rows.rig, planner.Params())
    rows.percepts["now_s"] += 0.2
    return rows.decisions[0]


@pytest.mark.parametrize("planner", [nav_i, oracle])
def test_nobody_is_asked_or_answered(planner):
    rows, memory = rows_before((1.2, 0.05, 0.3))
    rows.see((1, 1.2, 0.8, 0.0))
    rows.shared["ask_n"], rows.shared["ask_id"][0, 0] = 1, 1
    for _ in range(3):
        assert step(planner, rows, memory)["n_out"] == 0
    assert memory["mode"][0] == FOLLOW


@pytest.mark.parametrize("told", [1, -1])
@pytest.mark.parametrize("y", [0.15, -0.15])
def test_the_oracle_takes_the_side_it_is_told(told, y):
    rows, memory = rows_before((1.2, y, 0.3), told)
    decision = step(oracle, rows, memory)
    assert (decision["side"], decision["fused"], decision["heard"]) == (told, 1, 0)
    assert decision["p_left"] == (1.0 if told > 0 else 0.0)
    assert np.sign(decision["heading"]) == told


@pytest.mark.parametrize("y", [0.15, -0.15])
def test_the_oracle_chooses_itself_when_nobody_says(y):
    rows, memory = rows_before((1.2, y, 0.3))
    other, other_memory = rows_before((1.2, y, 0.3))
    chosen, own = step(oracle, rows, memory), step(nav_i, other, other_memory)
    assert chosen["side"] == own["side"] == (1 if y < 0.0 else -1)
    assert chosen.tobytes() == own.tobytes()
    assert memory.tobytes() == other_memory.tobytes()


def test_nav_i_does_not_listen():
    rows, memory = rows_before((1.2, 0.15, 0.3), 1)
    assert step(nav_i, rows, memory)["side"] == -1


def test_the_oracle_changes_its_mind_at_decisions_only():
    rows, memory = rows_before((1.2, 0.15, 0.3), 1)
    assert step(oracle, rows, memory)["side"] == 1
    rows.percepts["told_side"] = -1
    for _ in range(5):
        assert step(oracle, rows, memory)["side"] == 1
    rows.ranges[:] = np.inf
    assert step(oracle, rows, memory)["state"] == ADVANCE
    rows.percepts["odom_x"] = 1.0  # far from the last obstacle: a new decision
    step(oracle, rows, memory)
    rows.percepts["odom_x"] = 0.0
    rows.ranges[0] = scan_at(circles_world([(1.2, 0.15, 0.3)]), rows.rig)
    decision = step(oracle, rows, memory)
    assert (decision["side"], decision["fused"]) == (-1, 1)
    assert decision["state"] in (DECIDE, FOLLOW)


def test_only_the_oracle_asks_the_simulator_for_the_side():
    assert oracle.TOLD_SIDE is True
    assert not getattr(nav_i, "TOLD_SIDE", False)
    assert not getattr(nav_scope, "TOLD_SIDE", False)
