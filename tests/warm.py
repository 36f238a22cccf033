"""Compile what nearly all tests need, in halves that two processes can do beside each other.

    python tests/warm.py planners    # a step of every planner
    python tests/warm.py world       # a tick of the world

Without this every process of the tests that run first would compile the same kernels.
"""

from __future__ import annotations

import sys

from swarmscope.errors import MissingExtraError
from swarmscope.held import Held
from swarmscope.onboard.planners import load_planner, planner_names
from swarmscope.onboard.view import new_swarm
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.read import parse_scenario
from swarmscope.scenarios.to_kernels import make_rig_of, make_setting
from swarmscope.sim.cells import index_robots
from swarmscope.sim.loop import begin, world_phase
from swarmscope.sim.sensing import sense
from swarmscope.sim.state import new_records

SCENARIO = {"task": {"name": "T1"}, "robots": 2}


def planners() -> None:
    """Let every planner take a step."""
    waiting = [name for name in planner_names() if not _step(name)]
    for name in waiting:  # what it needs may have been installed meanwhile
        if not _step(name):
            print(f"{name}: not compiled, something is missing that it needs")


def _step(name: str) -> bool:
    """Let a planner take a step; return whether all that it needs is there."""
    rig = make_rig_of(parse_scenario(SCENARIO, "warm"))
    try:
        planner = load_planner(name)
        planner.step_all(0, 1, Held(new_swarm(1, rig)), planner.new_memory(1), planner.params())
    except MissingExtraError:
        return False
    return True


def world() -> None:
    """Let the world go on by a tick."""
    scenario = parse_scenario(SCENARIO, "warm")
    setting = make_setting(scenario, make_setup(scenario))
    sim, swarm = begin(setting)
    index_robots(sim)
    sense(sim, 0, 0, len(setting.starts))
    world_phase(Held(sim), swarm.safe, Held(new_records(1, len(setting.starts), 0)), 0, False, 0)


if __name__ == "__main__":
    {"planners": planners, "world": world}[sys.argv[1]]()
