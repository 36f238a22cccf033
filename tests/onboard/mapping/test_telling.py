"""For comparison: who is asked answers with its scan, or nobody is asked and all tell their maps."""

from __future__ import annotations

import numpy as np
import pytest
from test_asking import ASKER, KNOWS, WALL, Pair

from helpers import one_robot, rig_of, tick, wall
from swarmscope.errors import ConfigError
from swarmscope.onboard.edge import Seen
from swarmscope.onboard.mapping.heard import is_told_closed, told_cell
from swarmscope.onboard.planners import load_planner
from swarmscope.onboard.sharing.message import KIND_CHECK, KIND_CLOSED

CELL = 0.0625


class Telling(Pair):
    """The pair of ``test_asking``, both with another ``share``."""

    def __init__(self, share, *obstacles, **params):
        super().__init__(*obstacles)
        scans = self.asker.scan.copy(), self.knows.scan.copy()
        self.asker = one_robot(rig_of(), "atlas", ASKER, share=share, **params)
        self.knows = one_robot(rig_of(), "atlas", KNOWS, share=share, **params)
        self.asker.scan[:], self.knows.scan[:] = scans
        self.asker.fill(goal_distance=12.0)
        self.knows.fill(goal_distance=6.0)  # beyond the wall: it looks there
        self.asker.see([Seen(KNOWS, 4.0, 0.0, 0.0)])
        self.knows.see([Seen(ASKER, -4.0, 0.0, 0.0)])


def told(memory):
    return np.array([told_cell(memory, k) for k in range(int(memory["heard_n"]))]) * CELL


def test_a_scan_is_told_whatever_the_way_is_and_only_what_is_ahead():
    pair = Telling(2, WALL, payload=96)
    pair.knows.scan[:] = np.where(rig_of().cos > 0.0, pair.knows.scan, 1.5)
    pair.go(25)
    assert KIND_CHECK in pair.kinds(of_asker=True)
    assert KIND_CLOSED in pair.kinds(of_asker=False)
    cells = told(pair.asker.memory)
    assert len(cells) > 10
    assert np.abs(cells[:, 0] - 6.0).max() < 0.2  # the wall ahead, not what is behind


def test_maps_are_told_without_a_question_and_once():
    pair = Telling(3, WALL).go(25)
    assert KIND_CHECK not in pair.kinds(of_asker=True) + pair.kinds(of_asker=False)
    assert pair.kinds(of_asker=False).count(KIND_CLOSED) >= 1
    pair.go(100)
    sent = len(pair.kinds(of_asker=False))
    pair.go(200)
    assert len(pair.kinds(of_asker=False)) == sent
    memory = pair.asker.memory
    assert pair.way_m > 13.0
    for y in np.arange(-4.0, 4.0, 0.1):  # no hole in the wall
        assert is_told_closed(memory, 6.0 / CELL, y / CELL)


def test_who_meets_somebody_new_tells_all_of_it_again():
    pair = Telling(3, WALL).go(100)
    sent = len(pair.kinds(of_asker=False))
    third = one_robot(rig_of(), "atlas", 3, share=3)
    third.scan[:] = np.inf
    third.fill(goal_distance=12.0)
    third.see([Seen(KNOWS, 3.5, 0.0, 0.0)])
    pair.knows.see([Seen(ASKER, -4.0, 0.0, 0.0), Seen(3, -3.5, 0.0, 0.0)])
    for _ in range(40):
        pair.knows.receive([])
        tick(pair.knows)
        packets = [data for _, data in pair.knows.outbox()]
        pair.sent += [(False, None, data) for data in packets]
        third.receive(packets)
        tick(third)
    assert len(pair.kinds(of_asker=False)) > sent
    third.receive([])
    tick(third)
    assert third.memory["heard_n"] > 40


def test_maps_are_told_again_before_they_are_forgotten_also_by_who_has_arrived():
    pair = Telling(3, WALL, believe_s=20.0).go(60)
    pair.knows.fill(goal_distance=0.0)
    pair.go(200)
    for k in range(8):
        pair.go(50)
        assert pair.asker.memory["heard_n"] > 40, k
    assert pair.knows.memory["arrived"]


def test_small_things_may_be_robots_and_are_not_told():
    assert Telling(3, wall((6, 0.4), (6, 1.2))).go(100).kinds(of_asker=False) == []


def test_what_makes_a_variant_cannot_be_set():
    for name, share in (("atlas-mute", 0), ("atlas-scan", 2), ("atlas-maps", 3), ("atlas-all", 3)):
        assert load_planner(name).params().share == share
        with pytest.raises(ConfigError, match="is fixed"):
            load_planner(name).params({"share": 1})
