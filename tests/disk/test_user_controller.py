"""Users' files: what is told when they are wrong, and that they are run as they should."""

import numpy as np
import pytest

from swarmscope.disk import maps, rules, runs, user
from swarmscope.disk.study import figures
from swarmscope.errors import InputFileError


def write(tmp_path, body):
    file = tmp_path / "mine.py"
    file.write_text(body)
    return file


def function(body):
    return f"import numpy as np\ndef compute_gradients(state, targets, obstacles, r):\n    {body}\n"


def play(file, permutations=((0, 1),), call_s=user.CALL_S, **changes):
    of = runs.problem(rules.Rules(n=2, **{"max_steps": 50} | changes), [maps.NAMED["one-disc"]], permutations)
    return runs.play(of, user.UserController(file, of, call_s))


def test_a_good_file_moves_the_robots(tmp_path):
    outcome = play(write(tmp_path, function("return targets - state")))
    assert outcome.length[0] == pytest.approx([50 * 0.00025] * 2)


def test_lists_are_as_good_as_arrays(tmp_path):
    outcome = play(write(tmp_path, function("return [[-1, 0], [0, -1]]")))
    assert outcome.length[0] == pytest.approx([50 * 0.00025] * 2)


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("return state[0]", r"returned an array of shape \(2,\), wanted \(2, 2\)"),
        ("return None", r"returned nothing \(None\)"),
        ("return [[1, 2], [3]]", "returned an array of shape"),
        ("return [['a', 'b'], ['c', 'd']]", "wanted numbers"),
        ("return state * np.nan", r"velocity of robot 0 is \[nan, nan\]"),
        ("return 1 / 0", "raised ZeroDivisionError in line 3: division by zero"),
        ("return state + 1j", "wanted numbers"),
        ("raise SystemExit(0)", "raised SystemExit in line 3: 0"),
        ("raise ValueError('one\\ntwo')", "raised ValueError in line 3: one two$"),
        ("return type('Tensor', (), {'__array__': lambda *_, **__: 1 / 0})()", "returned a Tensor, which is no array"),
    ],
)
def test_wrong_answers_are_told_with_step_map_and_permutation(tmp_path, body, why):
    with pytest.raises(user.UserControllerError, match=why) as told:
        play(write(tmp_path, function(body)))
    assert "step 0 of map one-disc, permutation 0,1" in str(told.value)


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("x = 1", "has no function compute_gradients"),
        ("compute_gradients = 3", "has no function"),
        ("def compute_gradients(state): return state", "cannot be called as"),
        ("def compute_gradients(:", "is not Python: line 1"),
        ("import nothing_of_that_name", "raised ModuleNotFoundError in line 1"),
        ("\0", "is not Python"),
        ("raise SystemExit", "raised SystemExit in line 1"),
    ],
)
def test_files_that_cannot_be_used_are_told(tmp_path, body, why):
    with pytest.raises(InputFileError, match=why):
        play(write(tmp_path, body))


def test_velocities_whose_squares_overflow_are_cut_like_others(tmp_path):
    outcome = play(write(tmp_path, function("return (targets - state) * 1e200")))
    assert outcome.status.tolist() == [runs.TIMED_OUT]
    assert outcome.length[0] == pytest.approx([50 * 0.00025] * 2)


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(InputFileError, match="No such file"):
        user.check_file(tmp_path / "none.py")


def test_what_a_file_keeps_does_not_leak_between_runs_nor_into_the_simulator(tmp_path):
    body = "calls = 0\n" + function(
        "global calls; calls += 1; state[:] = 9; obstacles.clear(); return [[-calls / 1e3] * 2] * 2"
    )
    outcome = play(write(tmp_path, body), [(0, 1), (1, 0)])
    assert outcome.length[0] == pytest.approx(outcome.length[1])
    assert outcome.length[0, 0] == pytest.approx(sum(range(1, 51)) / 1e3 * 0.00025 * np.sqrt(2))


def test_the_starter_works_and_is_not_overwritten(tmp_path):
    file = user.write_starter(tmp_path / "first.py")
    outcome = play(file, max_steps=9000)
    assert outcome.status.tolist() == [runs.ARRIVED]
    assert outcome.obstacle_gap.min() > 0.02
    with pytest.raises(InputFileError, match="is there already"):
        user.write_starter(file)
    with pytest.raises(InputFileError, match=r"ends in \.py"):
        user.write_starter(tmp_path / "first.txt")
    assert not (tmp_path / "first.txt").exists()


HOSTILE = """
import gc, os, sys
import numpy as np
import swarmscope.disk.runs as runs
import swarmscope.disk.study.figures as figures
runs.advance = runs.ARRIVED = figures.bound = None
np.isin = np.linalg.norm = np.flatnonzero = None
sys.stdout.close()

def compute_gradients(state, targets, obstacles, r):
    state[:] = targets
    for thing in gc.get_objects():
        if isinstance(thing, runs.Outcome) or type(thing).__name__ == "Played":
            thing.status[:] = 1
    return [[-1, 0], [0, -1]]
"""


def test_what_a_controller_patches_does_not_reach_its_judge(tmp_path):
    before = np.isin, runs.advance
    outcome = play(write(tmp_path, HOSTILE), max_steps=5)
    assert (np.isin, runs.advance) == before
    assert outcome.status.tolist() == [runs.TIMED_OUT]
    assert outcome.length[0] == pytest.approx([5 * 0.00025] * 2)


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("import os; os._exit(3)", r"step 0 of map one-disc, permutation 0,1: it ended its process \(exit code 3\)"),
        ("np.where = None; return state", "its process failed: TypeError: 'NoneType' object is not callable"),
        ("import os; os.kill(os.getpid(), 9)", r"it ended its process \(signal 9\)"),
        ("import os; os.closerange(3, 99)", "it ended its process"),
        ("import sys; sys.stdout.close(); print(1)", "raised ValueError in line 3: I/O operation on closed file"),
        ("raise KeyboardInterrupt", "raised KeyboardInterrupt in line 3"),
        ("while True: pass", r"a call takes longer than 0\.3 s \(--call-limit\)"),
    ],
)
def test_controllers_that_end_hang_or_close_are_told(tmp_path, body, why):
    with pytest.raises(user.UserControllerError, match=why):
        play(write(tmp_path, function(body)), call_s=0.3)


def test_a_process_does_not_outlive_its_controller(tmp_path):
    of = runs.problem(rules.Rules(n=2, max_steps=5), [maps.NAMED["one-disc"]], [(0, 1)])
    controller = user.UserController(write(tmp_path, function("return targets - state")), of)
    process = controller._process._popen
    assert process.poll() is None
    del controller
    assert process.poll() is not None


def test_a_result_below_the_bound_is_an_error(tmp_path):
    of = runs.problem(rules.Rules(n=2), [maps.NAMED["one-disc"]], [(0, 1)])
    outcome = runs.play(of, user.UserController(write(tmp_path, function("return targets - state")), of))
    least = figures.bound(of)
    figures.played("mine", of, outcome, least)
    outcome.status[0], outcome.steps[0] = runs.ARRIVED, least[0] - 1
    with pytest.raises(
        figures.ImpossibleResultError, match=r"impossible: on map one-disc, permutation 0,1, all arrived"
    ):
        figures.played("mine", of, outcome, least)
