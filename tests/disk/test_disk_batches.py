"""Runs in several processes: what a user's controller does there, and that nobody waits for what is stopped."""

import multiprocessing
import pickle
import time

import pytest

from swarmscope.disk import maps, rules, runs, user
from swarmscope.disk.study.batches import Choice, play_all
from swarmscope.errors import ConfigError, InputFileError, UnknownNameError

SLOW_S = 600
"""So long that the run which fails is always the first to end, however busy the machine is."""


def two_runs():
    return runs.problem(rules.Rules(n=2, max_steps=5), [maps.EMPTY], [(0, 1), (1, 0)])


def test_an_error_in_one_process_stops_the_others(tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text(
        "import time\n"
        "def compute_gradients(state, targets, obstacles, r):\n"
        f"    time.sleep({SLOW_S} if targets[0, 0] < -0.9 else 0)\n"
        "    return None\n"
    )
    before = multiprocessing.active_children()  # other tests may have left some that still finish
    with pytest.raises(user.UserControllerError, match="permutation 1,0: returned nothing"):
        play_all(Choice(str(mine)), two_runs(), 2)
    # Asked again and again: a thread of the pool waits for the same processes, and where it was told of an end and has
    # not noted it yet, they still count as alive for a moment.
    end = time.monotonic() + 10
    while left := set(multiprocessing.active_children()) - set(before):
        assert time.monotonic() < end, left
        time.sleep(0.02)


def test_what_is_wrong_with_a_file_is_told_by_processes_too(tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text("elsewhere = True\nassert not elsewhere, 'elsewhere'\n")
    with pytest.raises(InputFileError, match="raised AssertionError in line 2: elsewhere"):
        play_all(Choice(str(mine)), two_runs(), 2)


@pytest.mark.parametrize(
    "error", [UnknownNameError("map", "c9", ["c0", "u"]), ConfigError("r", "is not above 0"), InputFileError("a", "b")]
)
def test_errors_travel_between_processes(error):
    found = pickle.loads(pickle.dumps(error))  # noqa: S301 - made in the line itself
    assert type(found) is type(error)
    assert str(found) == str(error)
    assert vars(found) == vars(error)
