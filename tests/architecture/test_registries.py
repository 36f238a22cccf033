"""Members are found by scanning their folder: no list to keep, no member forgotten."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swarmscope import tasks
from swarmscope.errors import UnknownNameError
from swarmscope.onboard import planning
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.onboard.reasons import NOT_PLANNERS
from swarmscope.tasks._contract import load_task, task_names


def files_of(package):
    folder = Path(package.__file__).parent
    return {path.stem for path in folder.glob("*.py") if not path.stem.startswith("_")}


def test_the_planners_are_the_files_of_their_folder():
    files = files_of(planning) - NOT_PLANNERS
    assert {name.replace("-", "_") for name in planner_names()} == files
    assert planner_names() == sorted(planner_names())


def test_the_tasks_are_the_files_of_their_folder():
    assert {name.lower() for name in task_names()} == files_of(tasks)


@pytest.mark.parametrize("name", planner_names())
def test_a_planner_file_defines_what_the_contract_asks_for(name):
    planner = load_planner(name)
    assert name == planner.NAME
    assert len(planner.SUMMARY) > 10
    assert len(planner.NEEDS) > 10
    assert isinstance(planner.MEMORY, np.dtype)
    assert planner.new_memory(3).shape == (3,)
    assert planner.new_memory(3).dtype == planner.MEMORY
    assert make_params(planner, {}) == planner.Params()


@pytest.mark.parametrize("name", task_names())
def test_a_task_file_defines_what_the_contract_asks_for(name):
    task = load_task(name)
    assert name == task.NAME
    assert len(task.SUMMARY) > 10


@pytest.mark.parametrize("name", ["nav-scop", "nav_scope", "fields", "_contract", ""])
def test_an_unknown_planner_is_an_error_with_the_names(name):
    with pytest.raises(UnknownNameError, match="nav-scope"):
        load_planner(name)


def test_an_unknown_parameter_is_an_error_with_the_nearest_name():
    with pytest.raises(UnknownNameError, match="w_i"):
        make_params(load_planner("nav-scope"), {"w_j": 1.0})


def test_parameters_take_the_declared_type():
    params = make_params(load_planner("nav-scope"), {"w_i": 0})
    assert isinstance(params.w_i, float)


def test_no_two_planners_share_a_type_of_parameters():
    names = [load_planner(name).Params.__name__ for name in planner_names()]
    kinds = {load_planner(name).Params for name in planner_names()}
    assert len(set(names)) == len(kinds)
