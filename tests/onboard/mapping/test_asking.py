"""One question, an answer: two robots, one of which knows what closes the other's way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from drawn_maps import map_of
from hypothesis import given, settings
from hypothesis import strategies as st

from helpers import DT, one_robot, rig_of, scan_at, tick, wall, world_of
from swarmscope.onboard.edge import Seen
from swarmscope.onboard.mapping.cells import FULL, LEAST, ask_for, fits_seen
from swarmscope.onboard.mapping.frames import own_place
from swarmscope.onboard.mapping.heard import hear, is_told_closed
from swarmscope.onboard.mapping.memory import TALK
from swarmscope.onboard.mapping.tracing import trace
from swarmscope.onboard.percept import EVERYBODY
from swarmscope.onboard.sharing.message import (
    KIND_CHECK,
    KIND_CLOSED,
    MAX_PACKET_BYTES,
    Head,
    name_of,
)
from swarmscope.onboard.sharing.way_message import CELL_M, Place, encode_closed, read_closed

WALL = wall((6, -5), (6, 5))
ASKER, KNOWS = 1, 2


class Pair:
    """A robot that asks, at the origin, its goal behind a wall that it does not see yet, and one that has arrived 4 m
    ahead and sees it."""

    def __init__(self, *obstacles, **params):
        rig = rig_of()
        self.asker = one_robot(rig, "atlas", ASKER, share=1, **params)
        self.knows = one_robot(rig, "atlas", KNOWS, share=1, **params)
        world = world_of(*obstacles)
        self.asker.scan[:] = scan_at(world, rig, 0.0, 0.0)
        self.knows.scan[:] = scan_at(world, rig, 4.0, 0.0)
        self.asker.fill(goal_distance=12.0)
        self.knows.fill(goal_distance=6.0, goal_bearing=math.pi)
        self.asker.see([Seen(KNOWS, 4.0, 0.0, 0.0)])
        self.knows.see([Seen(ASKER, -4.0, 0.0, 0.0)])
        self.sent = []

    def go(self, ticks, delay=0):
        """Let both go on, packets arriving a tick later, or ``delay`` more."""
        on_the_way = {}
        for k in range(ticks):
            for bot in (self.asker, self.knows):
                mail = on_the_way.pop((k, bot is self.asker), [])
                bot.receive(mail)
            for bot in (self.asker, self.knows):
                tick(bot)
                packets = bot.outbox()
                self.sent += [(bot is self.asker, to, data) for to, data in packets]
                on_the_way.setdefault((k + 1 + delay, bot is not self.asker), []).extend(d for _, d in packets)
        return self

    def kinds(self, of_asker):
        return [data[0] & 15 for mine, _, data in self.sent if mine == of_asker]

    @property
    def way_m(self):
        memory = self.asker.memory
        n = int(memory["way_n"])
        corners = [(0.0, 0.0), *zip(memory["way_u"][:n], memory["way_v"][:n], strict=True)]
        return CELL_M * sum(math.dist(corners[k], corners[k + 1]) for k in range(n))


def test_who_knows_a_wall_tells_and_the_way_leads_round_it():
    pair = Pair(WALL).go(25)
    assert KIND_CLOSED in pair.kinds(of_asker=False)
    assert pair.asker.memory["heard"] >= 1
    assert pair.way_m > 13.5


def test_questions_and_answers_go_to_everybody():
    pair = Pair(WALL).go(25)
    to = {(mine, data[0] & 15): address for mine, address, data in pair.sent}
    assert to[True, KIND_CHECK] == to[False, KIND_CLOSED] == EVERYBODY


def test_who_has_nothing_to_say_is_silent():
    pair = Pair().go(25)
    assert KIND_CHECK in pair.kinds(of_asker=True)
    assert KIND_CLOSED not in pair.kinds(of_asker=False)
    assert pair.way_m == pytest.approx(12.0, abs=0.05)  # a little beside who stands there


def test_a_robot_at_its_goal_goes_on_answering():
    pair = Pair(WALL)
    pair.knows.fill(goal_distance=0.0)
    pair.go(25)
    assert pair.knows.memory["arrived"]
    # what it has not taken into its map it cannot tell: it had arrived before it looked
    assert pair.kinds(of_asker=False) == []
    seen = Pair(WALL).go(3)
    seen.knows.fill(goal_distance=0.0)
    seen.go(25)
    assert KIND_CLOSED in seen.kinds(of_asker=False)
    assert seen.way_m > 13.0


def test_without_sharing_nothing_is_sent_and_nothing_is_answered():
    pair = Pair(WALL)
    pair.knows = one_robot(rig_of(), "atlas", KNOWS, share=0)
    pair.knows.scan[:] = scan_at(world_of(WALL), rig_of(), 4.0, 0.0)
    pair.knows.fill(goal_distance=6.0)
    pair.knows.see([Seen(ASKER, -4.0, 0.0, 0.0)])
    pair.go(25)
    assert pair.kinds(of_asker=False) == []
    assert pair.way_m == pytest.approx(12.0, abs=0.05)  # a little beside who stands there


def test_what_comes_too_late_is_left():
    pair = Pair(WALL).go(60, delay=10)  # 2 s each way
    assert KIND_CLOSED in pair.kinds(of_asker=False)
    assert pair.asker.memory["heard"] == 0
    assert pair.way_m == pytest.approx(12.0, abs=0.05)  # a little beside who stands there


def test_nobody_sends_more_than_its_share_of_the_air():
    pair = Pair(WALL, budget_bps=80.0, ask_s=0.2, ask_again_s=0.2).go(200)
    sent = sum(len(data) + 23 for mine, _, data in pair.sent if mine)
    assert 0 < 8 * sent <= 80.0 * (200 * DT + 10.0) + 8 * 73
    bare = Pair(WALL, budget_bps=80.0, ask_s=0.2, ask_again_s=0.2, link_bytes=0).go(200)
    assert sent < sum(len(data) for mine, _, data in bare.sent if mine) + 23 * len(bare.kinds(of_asker=True))


def test_small_things_are_not_told():
    assert KIND_CLOSED not in Pair(wall((6, -0.5), (6, 0.5))).go(25).kinds(of_asker=False)
    assert KIND_CLOSED in Pair(wall((6, -1.5), (6, 1.5))).go(25).kinds(of_asker=False)


def test_packets_fit_into_the_payload():
    for payload in (60, 127):
        pair = Pair(WALL, payload=payload, cells=112).go(25)
        lengths = [len(data) for mine, _, data in pair.sent if not mine and data[0] & 15 == KIND_CLOSED]
        assert lengths
        assert max(lengths) <= payload


def test_an_answer_to_somebody_else_is_heard_once():
    pair = Pair().go(15)
    packet = told_by(pair, [(-32, k) for k in range(-40, 41, 3)], to=4242)
    pair.asker.receive([packet, packet])
    tick(pair.asker)
    assert pair.asker.memory["heard"] == 1
    assert pair.asker.shared["dropped_stale"] == 1


def test_while_answers_come_late_those_to_others_are_left_too():
    pair = Pair(WALL).go(60, delay=10)
    pair.asker.receive([told_by(pair, [(-32, k) for k in range(-40, 41, 3)], to=4242)])
    tick(pair.asker)
    assert pair.asker.memory["heard"] == 0
    pair.asker.receive([])
    for _ in range(60):
        tick(pair.asker)
    pair.asker.receive([told_by(pair, [(-32, k) for k in range(-40, 41, 3)], to=4242, seq=2)])
    tick(pair.asker)
    assert pair.asker.memory["heard"] == 1


def told_by(pair, cells, to=None, seq=1, sender=KNOWS):
    """A forged answer to the asker's present question, or another, in the name of the robot that it sees."""
    shared, percept = pair.asker.shared, pair.asker.percept
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    to = name_of(int(percept["boot"]), int(shared["asked_seq"])) if to is None else to
    head = Head(sender, 0, int(pair.knows.shared["seq"]) + seq, to)
    place = own_place(pair.knows.view, pair.knows.memory)
    cells = np.array(cells, np.int32)
    return out[: encode_closed(head, place, cells, len(cells), out, MAX_PACKET_BYTES)].tobytes()


def test_one_lie_in_a_name_that_was_never_seen_silences_all_such_names():
    pair = Pair().go(15)
    lie = [(-32, k) for k in range(-40, 41, 3)]
    for name in (4001, 4002):
        pair.asker.receive([told_by(pair, lie, to=4242, sender=name)])
        tick(pair.asker)
        pair.asker.receive([])
        for _ in range(20):
            tick(pair.asker)
        assert pair.asker.memory["heard"] == 1
        assert pair.asker.memory["answers_n"] == 0
    pair.asker.receive([told_by(pair, lie, to=4242, sender=KNOWS)])
    tick(pair.asker)
    assert pair.asker.memory["heard"] == 2


def test_a_forged_wall_where_the_robot_sees_that_there_is_none_is_not_believed_for_long():
    pair = Pair().go(15)
    pair.asker.receive([told_by(pair, [(-32, k) for k in range(-40, 41, 3)])])  # 2 m ahead of the asker, 4 m behind it
    tick(pair.asker)
    assert pair.asker.memory["heard"] == 1
    pair.asker.receive([])
    for _ in range(10):
        tick(pair.asker)
    assert pair.asker.memory["answers_n"] == 0
    for _ in range(10):
        tick(pair.asker)
    assert pair.way_m == pytest.approx(12.0, abs=0.05)  # a little beside who stands there
    heard = int(pair.asker.memory["heard"])
    pair.go(20)  # it asks again, and the liar answers again
    pair.asker.receive([told_by(pair, [(40, k) for k in range(-40, 41, 3)])])
    tick(pair.asker)
    assert pair.asker.memory["heard"] == heard


def test_a_wall_told_a_little_before_the_true_one_is_no_lie():
    """Frames differ: the robot sees through the told cells, up to the wall that they are meant for."""
    pair = Pair(wall((3, -5), (3, 5)))
    pair.knows.scan[:] = math.inf
    pair.go(15)
    pair.asker.receive([told_by(pair, [(-18, k) for k in range(-40, 41, 3)])])  # 0.12 m nearer, 4 m behind who tells
    tick(pair.asker)
    pair.asker.receive([])
    for _ in range(40):
        tick(pair.asker)
    assert (pair.asker.memory["wrong_s"] < 0.0).all()


def test_nobody_is_walled_in_by_what_it_is_told():
    pair = Pair().go(15)
    ring = [(-64 + round(24 * math.cos(a)), round(24 * math.sin(a))) for a in np.linspace(0.0, 2.0 * math.pi, 60)]
    pair.asker.receive([told_by(pair, ring)])  # 1.5 m round it
    tick(pair.asker)
    assert pair.asker.memory["heard"] == pair.asker.memory["changed"] == 1
    pair.asker.receive([])
    for _ in range(10):
        tick(pair.asker)
    assert pair.asker.memory["answers_n"] == 0
    assert pair.way_m == pytest.approx(12.0, abs=0.05)


PLACES = st.tuples(st.integers(-60, 60), st.integers(-60, 60)).filter(lambda cell: math.hypot(*cell) > 4.0)
"""Not under the robot."""
CELLS = st.lists(PLACES, min_size=1, max_size=80, unique=True)


@settings(deadline=None, max_examples=60)
@given(CELLS, st.floats(-500.0, 500.0), st.floats(-500.0, 500.0))
def test_a_packet_never_closes_what_is_free(cells, x, y):
    """With exact places: where the whole disc fits by the map of who tells, nobody is told that it does not."""
    bot = one_robot(rig_of(), "atlas")
    bot.scan[:] = 0.01  # nothing is seen to be free
    memory, other = map_of(*cells), map_of()
    n = trace(bot.view, memory, CELL_M, (cells[0][0] + 0.5, cells[0][1] + 0.5), (TALK, 96.0))
    assert n > 0
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    numbers = memory["talk_cell"][:n].copy()
    length = encode_closed(Head(1, 2, 3, 4), Place(x, y, 1), numbers, n, out, MAX_PACKET_BYTES)
    found = np.zeros((TALK, 2))
    n = read_closed(out, length, found)
    assert hear(other, found / CELL_M + 0.5, n, 0.0, 1)
    assert other["disc_r"][LEAST] < other["disc_r"][FULL] - 0.5
    ask_for(memory, FULL)
    for u, v in np.random.default_rng(0).uniform(-70.0, 70.0, (400, 2)):
        if fits_seen(memory, u, v):
            assert not is_told_closed(other, u, v)


@settings(deadline=None, max_examples=60)
@given(CELLS)
def test_what_is_told_are_cells_of_the_map_none_twice(cells):
    bot = one_robot(rig_of(), "atlas")
    bot.scan[:] = 0.01
    memory = map_of(*cells)
    n = trace(bot.view, memory, CELL_M, (cells[0][0] + 0.5, cells[0][1] + 0.5), (40, 96.0))
    told = [tuple(cell) for cell in memory["talk_cell"][:n].tolist()]
    assert 0 < len(told) == len(set(told)) <= 40
    assert set(told) <= set(cells)
