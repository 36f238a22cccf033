"""Members are found by scanning their folder: no list to keep, no member forgotten."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from swarmscope import tasks
from swarmscope.errors import UnknownNameError
from swarmscope.onboard import planning
from swarmscope.onboard.planners import all_planners, load_planner, planner_names
from swarmscope.tasks._contract import load_task, task_names


def files_of(package):
    folder = Path(package.__file__).parent
    return {path.stem for path in folder.glob("*.py") if not path.stem.startswith("_")}


def test_the_planners_are_the_files_of_their_folder_and_their_variants():
    found = all_planners()
    modules = {planner.module for planner in found.values()}
    assert {module.__name__.rpartition(".")[2] for module in modules} == files_of(planning)
    assert {module.NAME.replace("-", "_") for module in modules} == files_of(planning)
    variants = [name for module in modules for name in getattr(module, "VARIANTS", {})]
    assert sorted([*(module.NAME for module in modules), *variants]) == planner_names()
    of_atlas = {"atlas-mute", "atlas-scan", "atlas-maps", "atlas-all"}
    assert {"nav-i", "oracle", "sfm-i", "giwt-cnn", "giwt-gat", "giwt-sage"} | of_atlas == set(variants)
    assert planner_names() == sorted(planner_names())


@pytest.mark.parametrize("name", planner_names())
def test_a_planner_is_found_by_its_name_alone(name):
    assert load_planner(name) == all_planners()[name]


def test_the_tasks_are_the_files_of_their_folder():
    assert {name.lower() for name in task_names()} == files_of(tasks)


@pytest.mark.parametrize("name", planner_names())
def test_a_planner_file_defines_what_the_contract_asks_for(name):
    planner = load_planner(name)
    assert name == planner.name
    assert len(planner.summary) > 10
    assert len(planner.needs) > 10
    assert isinstance(planner.module.MEMORY, np.dtype)
    assert planner.new_memory(3).shape == (3,)
    assert planner.new_memory(3).dtype == planner.module.MEMORY
    assert planner.params({}) == planner.params_type()._replace(**planner.fixed)
    assert set(planner.fixed) <= set(planner.params_type._fields)


@pytest.mark.parametrize("name", task_names())
def test_a_task_file_defines_what_the_contract_asks_for(name):
    task = load_task(name)
    assert name == task.NAME
    assert len(task.SUMMARY) > 10


@pytest.mark.parametrize("name", ["nav-scop", "nav_scope", "fields", "_contract", "loops", ""])
def test_an_unknown_planner_is_an_error_with_the_names(name):
    with pytest.raises(UnknownNameError, match="nav-scope"):
        load_planner(name)


def test_an_unknown_parameter_is_an_error_with_the_nearest_name():
    with pytest.raises(UnknownNameError, match="w_i"):
        load_planner("nav-scope").params({"w_j": 1.0})


def test_parameters_take_the_declared_type():
    params = load_planner("nav-scope").params({"w_i": 0})
    assert isinstance(params.w_i, float)


def test_no_two_planners_share_a_type_of_parameters():
    """But for variants, whose parameters are those of their file's planner."""
    names = [load_planner(name).params_type.__name__ for name in planner_names()]
    kinds = {load_planner(name).params_type for name in planner_names()}
    assert len(set(names)) == len(kinds) == len(files_of(planning))
