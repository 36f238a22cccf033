import math

import numpy as np
import pytest
from small_experiment import small

from swarmscope.errors import ConfigError
from swarmscope.experiments.weight import adaboost_weight, count_errors, estimate_weight, weight_of
from swarmscope.judging.cases import find_cases
from swarmscope.sim.state import CHOICE


def choice(p_self, p_left, told=0, neighbours=(), side=None, tick=10):
    row = np.zeros(1, CHOICE)
    row["tick"], row["p_self"], row["p_left"], row["told_side"] = tick, p_self, p_left, told
    row["side"] = side or (1 if p_left >= 0.5 else -1)
    row["heard"] = len(neighbours)
    for k, (name, where, p, f) in enumerate(neighbours):
        row["heard_id"][0, k], row["heard_side"][0, k] = name, where
        row["heard_p"][0, k], row["heard_f"][0, k] = p, f
    return row


def test_the_printed_rates_give_the_printed_weight():
    assert adaboost_weight(0.245, 0.446) == pytest.approx(0.193, abs=5e-4)  # printed 0.195 (readings 11)
    assert adaboost_weight(0.25, 0.5) == 0.0
    assert math.isnan(adaboost_weight(0.5, 0.4)) and math.isnan(adaboost_weight(0.0, 0.4))


def test_errors_are_counted_where_the_right_side_is_known():
    rows = np.concatenate(
        [
            choice(0.6, 0.6, told=1, neighbours=[(3, 1, 0.7, 0.1), (4, -1, 0.2, 0.1)]),  # right; one neighbour wrong
            choice(0.6, 0.6, told=-1),  # wrong
            choice(0.1, 0.1, told=0, neighbours=[(5, 1, 0.9, 0.1)]),  # nobody knows
        ]
    )
    assert count_errors(rows) == (1, 2, 1, 2)


def test_weight_with_interval():
    counts = np.array([[5, 20, 9, 20], [4, 20, 8, 20], [6, 20, 10, 20]])
    found = weight_of(counts, 0.9, [1, 2, 3])
    assert found.own.estimate == 0.25 and found.neighbours.estimate == 0.45
    assert found.weight == pytest.approx(math.log(0.55 / 0.45) / math.log(3.0))
    assert found.low < found.weight < found.high
    assert found.peak_force == pytest.approx(0.180, abs=5e-4)


def test_a_real_estimate_and_its_absence():
    asked = {"place": "near", "planner": "Nav-SCOPE", "seeds": "1000-1001"}
    experiment = small(weight=asked, scenario={"robots": 8, "limit_s": 40.0})
    found = estimate_weight(experiment)
    assert found.own.used > 0 and 0.0 <= found.own.estimate <= 1.0 and found.seeds == [1000, 1001]
    assert found == estimate_weight(experiment)
    with pytest.raises(ConfigError, match="weight"):
        estimate_weight(small())


def test_cases():
    follow = choice(0.45, 0.55, neighbours=[(7, 1, 0.95, 0.18)])  # a neighbour on the left sees free space
    flee = choice(0.52, 0.48, neighbours=[(8, 1, 0.30, 0.18), (9, -1, 0.49, 0.1)], tick=20)
    same = choice(0.60, 0.65, neighbours=[(7, 1, 0.95, 0.18)])
    overruled = choice(0.45, 0.55, neighbours=[(7, 1, 0.95, 0.18)], side=-1)
    found = find_cases(np.concatenate([flee, same, follow, overruled]), 0.2)
    assert [(c["kind"], c["decisive"], c["t_s"]) for c in found] == [("convergence", 7, 2.0), ("divergence", 8, 4.0)]
    assert found[1]["neighbours"][1] == {"id": 9, "side": -1, "p": 0.49, "f": 0.1}
    assert find_cases(np.zeros(0, CHOICE), 0.2) == []
