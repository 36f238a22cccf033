"""Seeded makers of worlds, starts and goals: one file each, found by scanning this folder.

The names below are all that a task of one's own needs.
"""

from swarmscope.bounds import Bounds
from swarmscope.errors import UnsolvableWorldError
from swarmscope.sim.world import Circle, Polygon, Wall, WorldSpec
from swarmscope.tasks._check import check_setup
from swarmscope.tasks._contract import Setup, Task, load_task, task_file, task_names
from swarmscope.tasks._made import setup_of_task
from swarmscope.tasks._on_map import Wanted, place_on_map, place_wanted

__all__ = [
    "Bounds",
    "Circle",
    "Polygon",
    "Setup",
    "Task",
    "UnsolvableWorldError",
    "Wall",
    "Wanted",
    "WorldSpec",
    "check_setup",
    "load_task",
    "place_on_map",
    "place_wanted",
    "setup_of_task",
    "task_file",
    "task_names",
]
