import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmscope.judging import metrics
from swarmscope.judging.metrics import METRICS, all_metrics

NAN = math.nan
T_S = np.arange(5.0)  # five ticks of one second
X_M = np.array([[0.0, 0], [1, 0], [2, 0], [3, 1], [9, 1]])
Y_M = np.array([[0.0, 0], [0, 2], [0, 4], [0, 4], [9, 4]])
ARRIVAL = np.array([3.0, NAN])


def test_lengths_end_at_the_arrival() -> None:
    np.testing.assert_allclose(metrics.path_lengths(X_M, Y_M, T_S, ARRIVAL), [3.0, 5.0])
    np.testing.assert_allclose(metrics.path_lengths(X_M, Y_M, T_S, np.array([2.5, 0.0])), [3.0, 0.0])
    torn = X_M.copy()
    torn[1, 0] = NAN
    np.testing.assert_allclose(metrics.path_lengths(torn, Y_M, T_S, ARRIVAL), [1.0, 5.0])


def test_worked_by_hand() -> None:
    travelled, shortest = np.array([10.0, 20.0, 6.0]), np.array([8.0, 12.0, 6.0])
    arrival = np.array([4.0, NAN, 10.0])
    assert metrics.arrival_rate(arrival) == pytest.approx(2 / 3)
    assert metrics.path_redundancy(travelled, shortest, arrival) == pytest.approx(1 - 2 / 3 * 14 / 16)
    assert metrics.path_redundancy_all(travelled, shortest, arrival) == pytest.approx(1 - 2 / 3 * 26 / 36)
    assert metrics.path_stretch(travelled, shortest, arrival) == pytest.approx(16 / 14)
    assert metrics.spl(travelled, shortest, arrival) == pytest.approx((0.8 + 0.0 + 1.0) / 3)
    assert metrics.average_path_length_m(travelled, arrival) == 8.0
    assert metrics.duration_s(arrival) == 10.0 and metrics.mean_arrival_s(arrival) == 7.0
    assert metrics.collision_rate(np.array([0, 1, 0, 0], dtype=np.uint8)) == 0.25
    t_s = np.array([0.0, 20.0])
    assert metrics.mean_speed_mps(travelled, t_s, arrival) == pytest.approx(36 / 34)
    assert metrics.bytes_per_robot_s(np.array([[0, 0, 0], [50, 60, 60]]), t_s, arrival) == 5.0


def test_robots_that_had_to_move_are_judged_apart() -> None:
    starts = np.array([[0.0, 0.0, 1.0], [5.0, 5.0, 0.0], [1.0, 1.0, 0.0], [2.0, 0.0, 0.0]])
    goals = np.array([[3.0, 4.0], [5.03, 5.03], [1.0, 3.0], [2.0, 9.0]])
    moves = metrics.movers(starts, goals, 0.05)
    assert moves.tolist() == [True, False, True, True]
    travelled, arrival = np.array([6.0, 0.0, 50.0, 10.0]), np.array([20.0, 0.0, NAN, 30.0])
    assert metrics.mover_path_m(travelled, arrival, moves) == 8.0
    assert metrics.mover_arrival_rate(arrival, moves) == pytest.approx(2 / 3)
    nobody = np.zeros(4, bool)
    assert math.isnan(metrics.mover_path_m(travelled, arrival, nobody))
    assert math.isnan(metrics.mover_arrival_rate(arrival, nobody))
    assert math.isnan(metrics.mover_path_m(travelled, np.full(4, NAN), moves))


def test_sides_are_judged_where_the_shortest_way_has_one() -> None:
    side, told = np.array([1, -1, 1, 1, -1], np.int8), np.array([1, 1, 0, 1, -1], np.int8)
    assert metrics.side_accuracy(side, told) == 0.75 and metrics.sides_judged(told) == 4
    assert math.isnan(metrics.side_accuracy(side, np.zeros(5, np.int8)))
    assert metrics.sides_judged(np.zeros(0, np.int8)) == 0


def test_waiting_counts_standing_before_the_arrival() -> None:
    speed = np.array([[0.5, 0.0], [0.01, -0.5], [0.5, 0.0], [0.0, 0.019], [0.0, 0.0]])
    np.testing.assert_allclose(metrics.waiting_times(speed, T_S, ARRIVAL), [1.0, 3.0])
    assert metrics.waiting_s(speed, T_S, ARRIVAL) == 2.0


def test_nobody_arrived_gives_nan_not_errors() -> None:
    travelled, shortest, arrival = np.array([3.0, 4.0]), np.array([2.0, NAN]), np.array([NAN, NAN])
    with np.errstate(all="raise"):
        for function in (metrics.path_redundancy, metrics.path_stretch):
            assert math.isnan(function(travelled, shortest, arrival))
        assert metrics.path_redundancy_all(travelled, shortest, arrival) == 1.0
        assert metrics.arrival_rate(arrival) == 0.0 and metrics.spl(travelled, shortest, arrival) == 0.0
        assert math.isnan(metrics.duration_s(arrival)) and math.isnan(
            metrics.average_path_length_m(travelled, arrival)
        )


def test_the_table_and_the_figures_agree() -> None:
    zeros = np.zeros((5, 2))
    values = all_metrics(
        T_S, X_M, Y_M, zeros, zeros.astype(np.int32), ARRIVAL, np.zeros(2, np.uint8), np.ones(2)
    )
    assert list(values) == [metric.name for metric in METRICS]
    assert all(isinstance(value, float) for value in values.values())
    assert len({metric.name for metric in METRICS}) == len(METRICS)
    empty, none = np.zeros((0, 0)), np.zeros(0)
    nothing = all_metrics(
        none, empty, empty, empty, empty.astype(np.int32), none, none.astype(np.uint8), none
    )
    assert all(math.isnan(value) for value in nothing.values())


lengths = st.lists(
    st.tuples(st.floats(0.1, 100.0), st.floats(1.0, 5.0), st.booleans()), min_size=1, max_size=12
)


@given(lengths)
def test_laws(robots: list[tuple[float, float, bool]]) -> None:
    shortest = np.array([best for best, _, _ in robots])
    travelled = shortest * np.array([stretch for _, stretch, _ in robots])
    some = np.array([1.0 if there else NAN for _, _, there in robots])
    everyone = np.ones(len(robots))
    assert metrics.path_redundancy(shortest, shortest, everyone) == pytest.approx(0.0, abs=1e-12)
    assert metrics.spl(shortest, shortest, everyone) == pytest.approx(1.0)
    gamma, stretch = (
        metrics.path_redundancy(travelled, shortest, everyone),
        metrics.path_stretch(travelled, shortest, everyone),
    )
    assert gamma == pytest.approx(1.0 - 1.0 / stretch) and -1e-12 <= gamma < 1.0
    assert gamma == pytest.approx(metrics.path_redundancy_all(travelled, shortest, everyone))
    assert metrics.spl(travelled, shortest, some) <= metrics.arrival_rate(some) + 1e-12
    turned = [f(travelled[::-1], shortest[::-1], some[::-1]) for f in (metrics.spl, metrics.path_redundancy)]
    same = [f(travelled, shortest, some) for f in (metrics.spl, metrics.path_redundancy)]
    np.testing.assert_allclose(turned, same)
