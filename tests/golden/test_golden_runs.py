"""No change alters the numbers of a run unnoticed: every planner on every task, against the golden file."""

from __future__ import annotations

import numpy as np
import pytest

import golden_runs
from swarmscope.errors import MissingExtraError

GOLDEN = golden_runs.read()
OTHER = {key: value for key, value in golden_runs.machine().items() if GOLDEN["machine"].get(key) != value}


def test_the_digests_are_of_a_machine_like_this_one():
    if OTHER:
        here = ", ".join(f"{key} {value} (there {GOLDEN['machine'].get(key)})" for key, value in OTHER.items())
        pytest.skip(f"the golden runs are compared by their figures only, not bit by bit: here is {here}")


@pytest.mark.parametrize("planner", golden_runs.planners())
def test_runs_are_the_golden_ones(planner):
    try:
        found = golden_runs.golden_runs(planner)
    except MissingExtraError as error:
        pytest.skip(str(error))
    wrong = golden_runs.differences(found, GOLDEN["runs"].get(planner, {}), bits=not OTHER)
    assert not wrong, "\n".join(["`make golden` renews the file; say why in CHANGELOG.md:", *wrong])


def test_the_file_holds_no_planner_that_is_gone():
    assert set(GOLDEN["runs"]) <= set(golden_runs.planners())


def test_a_digest_is_of_numbers_not_of_types():
    numbers = np.array([[0.5, np.nan]], dtype=np.float32)
    assert golden_runs.digest([numbers]) == golden_runs.digest([-1.0 * -numbers.astype(float)])
    assert golden_runs.digest([numbers]) != golden_runs.digest([np.nextafter(numbers, 1)])
    assert golden_runs.digest([numbers]) != golden_runs.digest([numbers.T])


def test_a_difference_says_where_and_what():
    figures = {"arrival_rate": 1.0, "last_arrival_s": None}
    wanted = {"T1": {"digest": "a", "figures": figures}, "T2": {"digest": "b", "figures": figures}}
    found = {
        "T1": {"digest": "x", "figures": figures},
        "T2": {"digest": "b", "figures": figures | {"last_arrival_s": 3.0}},
        "T3": {"digest": "c", "figures": figures},
    }
    moved = ["T2: last_arrival_s None -> 3.0", "T3: not in the file"]
    assert golden_runs.differences(found, wanted, bits=True) == ["T1: same figures, other bits", *moved]
    assert golden_runs.differences(found, wanted, bits=False) == moved
