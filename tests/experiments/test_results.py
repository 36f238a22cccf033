import math

import numpy as np
import pytest

from swarmscope.experiments.results import (
    Run,
    flow_time_increases,
    grouped,
    paired,
    path_gap,
    pooled_figures,
    time_budget,
    values_of,
)


def run(planner="ours", seed=0, travelled=(10.0, 12.0), shortest=(10.0, 10.0), arrival=(22.0, 30.0), **figures):
    known = {"duration_s": max(arrival), "waiting_s": 1.0, "path_redundancy": 0.1, "collisions": 0.0}
    arrays = [np.array(values, float) for values in (travelled, shortest, 0.95 * np.array(shortest), arrival)]
    config = {"robot": {"v_max_mps": 0.5}}
    return Run("T1", planner, seed, f"{planner}{seed}", config, known | figures, *arrays, failures=[], cases=[])


def test_sums_go_over_the_robots_of_all_maps():
    one = run(travelled=(10.0, 20.0), shortest=(10.0, 10.0))
    two = run(seed=1, travelled=(50.0, 99.0), shortest=(40.0, 40.0), arrival=(120.0, math.nan))
    found = pooled_figures([one, two])
    assert found["path_stretch"] == pytest.approx(80.0 / 60.0)
    assert found["path_redundancy"] == pytest.approx(1.0 - 0.75 * 60.0 / 80.0)
    assert found["spl"] == pytest.approx((1.0 + 0.5 + 0.8 + 0.0) / 4.0)
    assert found["path_stretch_any_angle"] == pytest.approx(80.0 / 57.0)  # the true ways are 5 % shorter
    assert found["path_redundancy_any_angle"] == pytest.approx(1.0 - 0.75 * 57.0 / 80.0)
    assert found["spl_any_angle"] == pytest.approx(0.95 * found["spl"])


def test_groups_and_values():
    runs = [run(seed=1, path_redundancy=None), run(), run("other")]
    groups = grouped(runs)
    assert list(groups) == [("T1", "ours"), ("T1", "other")]
    assert [r.seed for r in groups["T1", "ours"]] == [0, 1]
    assert np.isnan(values_of(groups["T1", "ours"], "path_redundancy")).tolist() == [False, True]


def test_pairs_are_matched_by_seed():
    ours = [run(seed=k, path_redundancy=0.1 * k) for k in range(5)]
    others = [run("other", seed=k, path_redundancy=0.1 * k + 0.05) for k in (4, 2, 9)]
    found = paired(ours, others, "path_redundancy")
    assert found.used == 2 and found.estimate == pytest.approx(-0.05)


def test_the_time_budget_adds_up():
    found = time_budget([run()])
    assert found == pytest.approx((20.0, 2.0, 1.0, 3.0, 4.0, 30.0))
    assert sum(found[:5]) == pytest.approx(found.duration_s)
    assert math.isnan(time_budget([run(arrival=(math.nan, math.nan), duration_s=None)]).duration_s)


def test_the_gap_is_taken_over_robots_that_arrived_with_all():
    late = math.nan
    worst = [run("left", travelled=(20.0, 30.0)), run("left", seed=1, travelled=(10.0, 0.0))]
    ours = [
        run(travelled=(16.0, 99.0), arrival=(40.0, late)),
        run(seed=1, travelled=(9.0, 0.0), shortest=(8.0, 0.0)),
        run(seed=2, travelled=(5.0, 5.0)),
    ]
    best = [run("told", travelled=(12.0, 15.0)), run("told", seed=1, travelled=(9.0, 0.0), arrival=(late, 1.0))]
    found = path_gap(ours, worst, best)
    assert found.reduction.estimate == pytest.approx((4.0 + 1.0) / 30.0)
    assert (found.reduction.used, found.robots) == (2, 2)  # who stands at its goal does not count
    assert found.closed.estimate == pytest.approx(4.0 / 8.0) and found.closed.used == 1
    assert path_gap(best, worst, best).closed.estimate == 1.0
    excess = path_gap(ours, worst, None).closed  # of what the worst goes beyond the true shortest ways
    assert excess.estimate == pytest.approx((4.0 + 1.0) / (20.0 - 9.5 + 10.0 - 7.6)) and excess.used == 2
    nothing = path_gap([run(seed=7)], worst, best)
    assert math.isnan(nothing.reduction.estimate) and nothing.reduction.used == nothing.robots == 0


def test_flow_time_increases_are_of_robots_with_a_way_that_arrived_in_both_runs():
    ours = [
        run(travelled=(12.0, 15.0), shortest=(10.0, 10.0)),
        run(seed=1, travelled=(0.0, 50.0), shortest=(0.0, 10.0), arrival=(0.0, math.nan)),
        run(seed=2),
    ]
    others = [
        run("left", travelled=(11.0, 13.0), shortest=(10.0, 10.0), arrival=(22.0, math.nan)),
        run("left", seed=1, travelled=(0.0, 30.0), shortest=(0.0, 10.0), arrival=(0.0, 60.0)),
    ]
    mine, theirs = flow_time_increases(ours, others)
    assert mine == pytest.approx([0.2]) and theirs == pytest.approx([0.1])
    assert [len(values) for values in flow_time_increases([], others)] == [0, 0]


def test_mean_ways_are_compared_over_robots_that_arrived_with_both():
    ours = [run(travelled=(10.0, 99.0), mover_path_m=54.5), run(seed=1, arrival=(math.nan, 9.0), mover_path_m=12.0)]
    others = [
        run("left", travelled=(14.0, 50.0), arrival=(30.0, math.nan), mover_path_m=14.0),
        run("left", seed=1, arrival=(9.0, math.nan), mover_path_m=10.0),
    ]
    found = paired(ours, others, "mover_path_m")
    assert found.used == 1 and found.estimate == pytest.approx(-4.0)
