"""Figures of the unit disk: rows, comparisons in pairs, CSV; batches in one and two processes."""

import csv
import io
from functools import cache

import numpy as np
import pytest

from swarmscope.disk import maps, rules, runs
from swarmscope.disk.study.batches import Choice, play_all, play_batch, read_choice
from swarmscope.disk.study.figures import compare, csv_text, ended_words, failures, played, row, rows_by_map
from swarmscope.errors import ConfigError, InputFileError, UnknownNameError

SOME = [(0, 1, 2, 3, 4), (0, 1, 2, 4, 3), (4, 3, 2, 1, 0)]


@cache
def report(names=("one-disc", "minima"), **changes):
    of = runs.problem(rules.Rules(**changes), [maps.NAMED[name] for name in names], SOME)
    choice = Choice("report")
    return played(choice.label, of, play_batch(choice, of).outcome)


def test_a_run_that_does_not_arrive_counts_with_all_its_steps():
    found = report()
    minima = rows_by_map(found)[1]
    assert (minima.runs, minima.arrived, minima.most) == (3, 2, 30_000)
    assert minima.share.low < 2 / 3 < minima.share.high
    assert minima.mean == pytest.approx(found.steps[3:].mean())
    assert minima.ratio == pytest.approx(minima.mean / minima.bound)
    assert [one.place for one in rows_by_map(found)] == ["one-disc", "minima", "all"]


def test_a_collision_counts_as_a_failure_with_all_steps():
    of = runs.problem(rules.Rules(), [maps.EMPTY], SOME[:1])
    outcome = runs.no_outcome(1, 5)
    outcome.status[0], outcome.steps[0], outcome.involved[0] = runs.HIT_ROBOT, 17, (1, 3)
    found = played("x", of, outcome)
    assert (row(found, "all").collisions, row(found, "all").mean) == (1, 30_000.0)
    assert failures(found) == [("empty", "0,1,2,3,4", "robots 1 and 3 collided in step 17")]


def test_failures_name_who_is_missing():
    found = report()
    assert failures(found) == [("minima", "0,1,2,4,3", "ran out of steps; not at their goals: 2")]
    assert "nobody can need fewer than" in ended_words(found, 0)


def test_differences_are_taken_run_by_run():
    one, two = report(max_steps=30_000), report(max_steps=20_000)
    assert compare(one, one).estimate == 0.0
    assert compare(one, two).estimate == pytest.approx(10_000 / 6)


def test_every_run_is_a_line_of_csv():
    lines = list(csv.DictReader(io.StringIO(csv_text([report()]))))
    assert len(lines) == 6
    assert lines[4]["ended"] == "ran out of steps" and lines[4]["permutation"] == "0,1,2,4,3"
    assert int(lines[0]["steps"]) >= int(lines[0]["bound"])


def test_results_do_not_depend_on_processes(tmp_path):
    of = runs.problem(rules.Rules(max_steps=900), [maps.NAMED["u"]], list(rules.all_permutations(5))[:50])
    one, two = (play_all(Choice("reactive"), of, workers).outcome for workers in (1, 2))
    for first, second in zip(one, two, strict=True):
        assert np.array_equal(first, second)


def test_choices_are_read():
    assert read_choice("report:obstacle_buffer=0.005").changes == {"obstacle_buffer": "0.005"}
    assert read_choice("report:obstacle_buffer=0.005").label == "report obstacle_buffer=0.005"
    with pytest.raises(UnknownNameError, match="did you mean 'reactive'"):
        read_choice("reactiv")
    with pytest.raises(UnknownNameError, match="unknown parameter 'buffer'"):
        read_choice("report:buffer=1")
    with pytest.raises(ConfigError, match="is not a number"):
        read_choice("report:robot_buffer=wide")
    with pytest.raises(ConfigError, match="not KEY=VALUE"):
        read_choice("report:5")


def test_a_users_file_is_checked_before_anything_is_played(tmp_path):
    with pytest.raises(InputFileError, match="No such file"):
        read_choice(str(tmp_path / "none.py"))
    file = tmp_path / "mine.py"
    file.write_text("def compute_gradients(state, targets, obstacles, r):\n    return targets - state\n")
    with pytest.raises(ConfigError, match="no parameters to set"):
        read_choice(f"{file}:x=1")
    of = runs.problem(rules.Rules(max_steps=30), [maps.EMPTY], SOME)
    result = play_all(read_choice(str(file)), of, 2)
    assert result.calls == 90 and result.seconds > 0
