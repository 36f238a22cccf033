"""Seeded makers of worlds, starts and goals: one file each, found by scanning this folder."""

from swarmscope.tasks._check import check_setup
from swarmscope.tasks._contract import Setup, Task, load_task, task_names
from swarmscope.tasks._on_map import place_on_map

__all__ = ["Setup", "Task", "check_setup", "load_task", "place_on_map", "task_names"]
