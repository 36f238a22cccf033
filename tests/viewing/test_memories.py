"""What robots remembered, played again: maps lie where things stand, ways end at goals, picture and page show it."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from test_replay import decoded, embedded

import swarmscope
from helpers import place_scenario, wall
from swarmscope.errors import ConfigError
from swarmscope.judging.run_folder import read_config
from swarmscope.scenarios.read import parse_scenario
from swarmscope.viewing.memories.again import CELL_KIND, SIDES, Memories, play_for_memories
from swarmscope.viewing.memories.picture import in_world, known_at, turn_png, turns_of
from swarmscope.viewing.replay import write_replay
from swarmscope.viewing.run_data import load_run

POCKET = [(-3.0, -1.2), (4.0, -1.2), (4.0, 1.2), (-3.0, 1.2)]


def play(folder, planner="atlas", **more):
    values = place_scenario([(-6, 0, 0), (-6, 3, 0)], [(6, 0), (6, 3)], [wall(*POCKET)], planner={"name": planner})
    swarmscope.simulate(values | more, progress=False).save(folder)
    return load_run(folder), parse_scenario(read_config(folder), "again")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return play(tmp_path_factory.mktemp("memories") / "run")


@pytest.fixture(scope="module")
def memories(run):
    return play_for_memories(*run)


def places_of(memories, moment):
    """The middles of all that was known at a moment, in the world [m], and how large each is."""
    known = known_at(memories, moment)
    sides = np.array(SIDES)[known[:, 0]]
    return in_world(moment, memories.cell_m, sides[:, None] * (known[:, 1:] + 0.5)), sides


def off_the_pocket(x, y):
    gaps = []
    for (ax, ay), (bx, by) in pairwise(POCKET):
        t = min(1.0, max(0.0, ((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / math.dist((ax, ay), (bx, by)) ** 2))
        gaps.append(math.hypot(x - ax - t * (bx - ax), y - ay - t * (by - ay)))
    return min(gaps)


def test_what_is_known_lies_where_something_stands(run, memories):
    last = [one for one in memories.moments if one.robot == 0][-1]
    places, sides = places_of(memories, last)
    cells = places[sides == SIDES[CELL_KIND]]
    assert len(cells) > 100
    assert max(off_the_pocket(x, y) for x, y in cells) < 0.3  # things are taken to be 0.15 m deep
    nodes = places[sides != SIDES[CELL_KIND]]  # a robot cannot be there
    assert all(off_the_pocket(x, y) < 0.45 for x, y in nodes)


@pytest.mark.parametrize("robot", [0, 1])
def test_every_way_ends_at_the_goal(run, memories, robot):
    found, _ = run
    goal = found.world.robots[robot].goal
    mine = [one for one in memories.moments if one.robot == robot]
    assert mine[0].searched
    for moment in mine:
        assert in_world(moment, memories.cell_m, moment.way)[-1] == pytest.approx(goal, abs=1e-3)


def test_the_search_that_turns_back_is_the_first_of_the_list(run, memories):
    """Robot 0 drives into the pocket and finds it closed: the way then leads out of it, round a corner."""
    turn = turns_of(memories)[0]
    assert turn.after.robot == 0 and turn.after.searched and not turn.before.tick > turn.after.tick
    assert turn.apart_m == max(one.apart_m for one in turns_of(memories, 0)) > 0.5
    before, after = (in_world(one, memories.cell_m, one.way) for one in turn[:2])
    assert max(map(len, (before, after))) > 1
    png = turn_png(run[0], memories, turn)
    assert png.startswith(b"\x89PNG") and png != turn_png(run[0], memories, turns_of(memories)[1])


def test_a_map_lies_beside_the_things_when_wheels_and_compass_err(tmp_path):
    """It is drawn as the robot has it: what it sees now is right, whatever its odometry says."""
    found, scenario = play(tmp_path / "errs", noise={"odometry_scale": 0.05, "compass_bias_deg": 5}, seed=3)
    memories = play_for_memories(found, scenario)
    assert any(abs(one.frame[2]) > 0.01 for one in memories.moments)
    early = [one for one in memories.moments if one.robot == 0 and one.tick < 25]
    places, sides = places_of(memories, early[-1])
    assert max(off_the_pocket(x, y) for x, y in places[sides == 1]) < 0.6


def test_the_page_holds_all_moments(run, memories):
    found, _ = run
    data = embedded(write_replay(found.folder, memories))
    assert data["memory_cell_m"] == memories.cell_m
    moments = decoded(data["arrays"]["memory_moments"])
    assert moments.shape == (len(memories.moments), 5)
    assert moments[:, 3].sum() == len(decoded(data["arrays"]["memory_toggled"]))
    assert moments[:, 4].sum() == len(decoded(data["arrays"]["memory_ways"]))
    plain = embedded(write_replay(found.folder))
    assert plain["memory_cell_m"] is None and not any(name.startswith("memory") for name in plain["arrays"])


def test_nobody_has_remembered_anything_yet(run):
    assert "memory_moments" not in embedded(write_replay(run[0].folder, Memories(0.0625, [])))["arrays"]


def test_a_planner_without_a_map_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="'nav-scope' keeps no map"):
        play_for_memories(*play(tmp_path / "none", planner="nav-scope", limit_s=5.0))
