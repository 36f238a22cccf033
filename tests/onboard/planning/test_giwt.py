"""GIWT: who is asked, what is answered, what the network is given, what becomes of bad answers."""

from __future__ import annotations

import math

import numpy as np
import onnxruntime
import pytest

from giwt_models import make_model
from helpers import DT, circle, circles_world, place_scenario, rig_of, run_scenario, scan_at
from swarmscope.held import Held
from swarmscope.onboard.network.graph import (
    OWN_CELL,
    VIEW_M,
    information_gain_series,
    position_cell,
    quantise,
    restore,
)
from swarmscope.onboard.network.local_map import (
    CELL_ANGLE,
    CELL_DISTANCE,
    Drawing,
    draw_map,
    encode_scan,
    hide_robot,
)
from swarmscope.onboard.percept import MAX_OUTBOX
from swarmscope.onboard.planners import load_planner
from swarmscope.onboard.reasons import R_ALONE, R_ANSWERS, R_FUSED
from swarmscope.onboard.sharing.inbox import OWN_ROOM
from swarmscope.onboard.sharing.message import (
    DIRECTED_REQUEST_BYTES,
    HEADER_FIELDS,
    KIND_DIRECTED_REQUEST,
    KIND_LATENT,
    MAX_PACKET_BYTES,
    OK,
    Head,
    decode,
    encode_directed_request,
    encode_latent,
)
from swarmscope.onboard.view import new_swarm

GOAL = 0.3
"""Direction of A's goal, compass frame [rad]; byte 12."""
ROUNDED = 12 * 2.0 * math.pi / 256.0
WORLD = [(2.3 * math.cos(GOAL), 2.3 * math.sin(GOAL), 2.0), (-0.5, 3.0, 0.4)]
"""So wide and near that no direction within 80 degrees of the goal's is safe."""
A, B = (0.0, 0.0, -0.2), (-0.6, 1.4, 1.0)
"""x, y, yaw."""


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return make_model(tmp_path_factory.mktemp("model") / "giwt")


def seen_from(here, there):
    """``there`` in the body frame of ``here``: x, y, yaw."""
    dx, dy = there[0] - here[0], there[1] - here[1]
    c, s = math.cos(here[2]), math.sin(here[2])
    return c * dx + s * dy, c * dy - s * dx, there[2] - here[2]


class Robots:
    """A in front of an obstacle, and B; packets are carried by hand."""

    def __init__(self, planner, poses=(A, B), **params):
        self.rig = rig_of()
        self.swarm = new_swarm(len(poses), self.rig)
        self.planner, self.params = planner, planner.params(params)
        self.memories = planner.new_memory(len(poses))
        self.percepts, self.shared, self.decisions = self.swarm.percepts, self.swarm.shared, self.swarm.decisions
        self.ranges = self.swarm.scans
        self.percepts["dt_s"] = DT
        self.percepts["now_s"] = 10.0
        for i, pose in enumerate(poses):
            self.ranges[i] = scan_at(circles_world(WORLD), self.rig, *pose)
            self.percepts["compass"][i] = pose[2]
            self.percepts["goal_bearing"][i] = (GOAL if i == 0 else 2.0) - pose[2]
            self.percepts["goal_distance"][i] = 8.0
            others = [(j, *seen_from(pose, other)) for j, other in enumerate(poses) if j != i]
            others.sort(key=lambda other: math.hypot(other[1], other[2]))
            self.percepts["n_neighbours"][i] = len(others)
            for k, (name, x, y, yaw) in enumerate(others):
                self.percepts["neighbour_id"][i, k] = name
                self.percepts["neighbour_x"][i, k], self.percepts["neighbour_y"][i, k] = x, y
                self.percepts["neighbour_yaw"][i, k] = yaw

    def step(self):
        self.planner.step_all(0, len(self.percepts), Held(self.swarm), self.memories, self.params)
        self.percepts["now_s"] += DT
        self.percepts["n_packets"] = 0
        return self

    def hand(self, i, *packets):
        self.percepts["n_packets"][i] = len(packets)
        for k, packet in enumerate(packets):
            self.percepts["packet_length"][i, k] = len(packet)
            self.percepts["packet"][i, k, : len(packet)] = np.frombuffer(packet, np.uint8)
        return self

    def sent(self, i):
        """The outbox of robot i as [(to, header, bytes)]."""
        row, found = self.decisions[i], []
        for k in range(row["n_out"]):
            data, header = row["out"][k, : row["out_length"][k]].copy(), np.zeros(len(HEADER_FIELDS), np.int64)
            assert decode(data, data.size, header) == OK
            found.append((int(row["out_to"][k]), header.tolist(), data.tobytes()))
        return found

    def exchange(self):
        """Carry A's packet to B and B's answer back; A has not decided yet."""
        [(_, _, asked)] = self.sent(0)
        self.hand(1, asked).step()
        [(_, _, answer)] = self.sent(1)
        return answer

    @property
    def dropped(self):
        return int(self.shared["dropped_bad"][0]), int(self.shared["dropped_stale"][0])


def planner_of(model):
    return load_planner("giwt").with_model(model)


def answer_of(sender, seq, reply_to, codes=None):
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    codes = np.full(128, 5, np.uint8) if codes is None else codes
    return out[: encode_latent(Head(sender, 0, seq, reply_to), codes, 150, out)].tobytes()


def picture_of(robots, i, pose, other, target):
    """A robot's picture, drawn from scratch: (1, 2, 101, 101) float32."""
    sensor = robots.rig.sensor
    codes = np.zeros(sensor.beams, np.uint8)
    encode_scan(robots.ranges[i], codes)
    x, y, _ = seen_from(pose, other)
    hide_robot(codes, sensor, x, y, 0.15)
    out = np.zeros((2, 101, 101), np.uint8)
    drawing = Drawing(sensor.angle_min, sensor.increment, target - pose[2], VIEW_M, VIEW_M)
    draw_map(codes, drawing, CELL_ANGLE, CELL_DISTANCE, out)
    return out[None].astype(np.float32)


def softmax_left(logits):
    return 1.0 / (1.0 + math.exp(float(logits[0, 1]) - float(logits[0, 0])))


def test_the_decision_is_what_the_two_networks_say_of_the_two_pictures(model):
    robots = Robots(planner_of(model)).step()
    [(to, header, _)] = robots.sent(0)
    assert (to, header[0], header[4]) == (1, KIND_DIRECTED_REQUEST, 12)
    assert (robots.decisions["v"][0], robots.decisions["reason"][0]) == (0.0, R_ANSWERS)
    answer = robots.exchange()
    assert robots.decisions["reason"][0] == R_ANSWERS
    robots.hand(0, answer).step()
    decision = robots.decisions[0]
    assert (decision["fused"], decision["heard"], decision["reason"]) == (1, 1, R_FUSED)

    encode = onnxruntime.InferenceSession(model / "encoder.onnx")
    decide = onnxruntime.InferenceSession(model / "decider.onnx")
    own = encode.run(None, {"maps": picture_of(robots, 0, A, B, GOAL)})[0][0]
    theirs = encode.run(None, {"maps": picture_of(robots, 1, B, A, ROUNDED)})[0][0]
    codes, heard = np.zeros(128, np.uint8), np.zeros(128, np.float32)
    restore(codes, quantise(theirs, codes), heard)
    x, y, _ = seen_from((0.0, 0.0, GOAL), B)
    graph = {
        "features": np.stack([own, heard])[None],
        "cells": np.array([[OWN_CELL, position_cell(x, y)]]),
        "gains": np.array([[0.0, information_gain_series(math.hypot(x, y), VIEW_M)]], np.float32),
        "present": np.ones((1, 2), np.float32),
    }
    p_left = softmax_left(decide.run(None, graph)[0])
    assert decision["p_left"] == pytest.approx(p_left, abs=1e-6)
    assert decision["side"] == (1 if p_left > 0.5 else -1)
    alone = {name: value[:, :1] for name, value in graph.items()}
    assert decision["p_self"] == pytest.approx(softmax_left(decide.run(None, alone)[0]), abs=1e-6)
    alone["features"] = heard[None, None]
    assert decision["heard_p"][0] == pytest.approx(softmax_left(decide.run(None, alone)[0]), abs=1e-6)
    assert (decision["heard_id"][0], decision["heard_side"][0]) == (1, 1 if y >= 0.0 else -1)
    assert decision["heard_f"][0] == pytest.approx(float(graph["gains"][0, 1]))


def test_without_neighbours_it_decides_at_once_and_alone(model):
    decision = Robots(planner_of(model), (A,)).step().decisions[0]
    assert (decision["fused"], decision["heard"], decision["reason"], decision["n_out"]) == (1, 0, R_ALONE, 0)
    assert decision["p_left"] == decision["p_self"] != 0.5


def test_a_neighbour_too_far_away_is_not_asked(model):
    robots = Robots(planner_of(model), (A, (-5.2, 0.0, 0.0))).step()
    assert robots.sent(0) == []
    assert robots.decisions["fused"][0] == 1


def test_silence_costs_only_the_wait(model):
    robots = Robots(planner_of(model), answer_s=0.5)
    waited = 0
    while not robots.step().decisions["fused"][0]:
        assert (robots.decisions["v"][0], robots.decisions["w"][0]) == (0.0, 0.0)
        waited += 1
        assert waited < 10
    assert waited == 3  # the ticks at 0, 0.2 and 0.4 s
    assert (robots.decisions["heard"][0], robots.decisions["reason"][0]) == (0, R_ALONE)
    assert robots.sent(0) == []


def damaged(answer):
    return answer[:60] + bytes([answer[60] ^ 4]) + answer[61:]


@pytest.mark.parametrize(
    ("make", "counted"),
    [
        (lambda robots, answer: damaged(answer), (1, 0)),
        (lambda robots, answer: answer[:-1], (1, 0)),
        (lambda robots, answer: answer_of(7, 1, 1), (0, 1)),  # not asked
        (lambda robots, answer: answer_of(1, 9, 77), (0, 1)),  # another question
        (lambda robots, answer: answer_of(0, 9, 1), (0, 1)),  # our own address
    ],
)
def test_bad_answers_are_dropped_and_counted(model, make, counted):
    robots = Robots(planner_of(model)).step()
    answer = robots.exchange()
    robots.hand(0, make(robots, answer)).step()
    assert robots.dropped == counted
    assert robots.decisions["fused"][0] == 0
    assert not robots.memories["answered"][0].any()


def test_a_replayed_and_a_second_answer_are_dropped(model):
    robots = Robots(planner_of(model)).step()
    answer = robots.exchange()
    again = answer_of(1, 30, 1)
    kept = np.frombuffer(answer, np.uint8)[10:138]
    robots.hand(0, answer, answer, again).step()
    assert robots.dropped == (0, 2)
    assert robots.memories["latent"][0, 0].tolist() == kept.tolist()
    assert robots.shared["answers_n"][0] == 1


@pytest.mark.parametrize(("ticks", "dropped"), [(5, 0), (6, 1)])
def test_an_answer_that_comes_too_late_is_dropped(model, ticks, dropped):
    """It is 1.4 s and 1.6 s old; features are used for 1.5 s."""
    robots = Robots(planner_of(model)).step()
    answer = robots.exchange()
    for _ in range(ticks):
        robots.step()
    robots.hand(0, answer).step()
    assert robots.dropped == (0, dropped)


def test_an_answer_is_heard_though_the_clock_leaps(model):
    robots = Robots(planner_of(model)).step()
    answer = robots.exchange()
    robots.percepts["now_s"] += 2.0
    robots.hand(0, answer).step()
    assert (robots.dropped, robots.decisions["heard"][0]) == ((0, 0), 1)


def test_answers_for_another_direction_are_not_used(model):
    for turned, heard in ((1.5, 1), (2.5, 0)):  # what is left of ten times as much in one tick
        robots = Robots(planner_of(model), turned_deg=2.0).step()
        answer = robots.exchange()
        robots.percepts["goal_bearing"][0] += 10.0 * math.radians(turned)
        robots.hand(0, answer).step()
        assert (robots.decisions["fused"][0], robots.decisions["heard"][0]) == (1, heard)


def test_it_asks_on_the_way_before_it_has_to_stand(model):
    robots = Robots(planner_of(model))
    sensor = robots.rig.sensor
    bearing = sensor.angle_min + sensor.increment * np.arange(sensor.beams) - robots.percepts["goal_bearing"][0]
    bay = np.abs((bearing + math.pi) % (2.0 * math.pi) - math.pi) < math.radians(85.0)
    robots.ranges[0] = np.where(bay, 1.0, np.inf)
    assert robots.step().sent(0) == []  # 0.5 s from where a side has to be chosen is 0.85 m from the bay's end
    robots.ranges[0] = np.where(bay, 0.75, np.inf)
    robots.step()
    assert robots.decisions["v"][0] > 0.0
    assert [header[0] for _, header, _ in robots.sent(0)] == [KIND_DIRECTED_REQUEST]
    answer = robots.exchange()
    robots.ranges[0] = np.where(bay, 0.5, np.inf)
    robots.hand(0, answer).step()
    assert (robots.decisions["fused"][0], robots.decisions["heard"][0]) == (1, 1)


def test_a_single_tree_ahead_is_no_reason_to_ask(model):
    robots = Robots(planner_of(model))
    tree = (0.95 * math.cos(GOAL), 0.95 * math.sin(GOAL), 0.15)
    robots.ranges[0] = scan_at(circles_world([tree]), robots.rig, *A)
    assert robots.step().sent(0) == []


def test_a_robot_at_its_goal_answers(model):
    robots = Robots(planner_of(model))
    robots.percepts["goal_distance"][1] = 0.0
    robots.step()
    robots.exchange()
    [(to, header, _)] = robots.sent(1)
    assert (to, header[0], header[3]) == (0, KIND_LATENT, int(robots.shared["asked_seq"][0]))


def test_own_requests_and_answers_to_others_share_the_outbox(model):
    around = [(1.5 * math.cos(a), 1.5 * math.sin(a), 0.0) for a in np.linspace(1.8, 5.0, 9)]
    robots = Robots(planner_of(model), (A, *around))
    packets = []
    for k in range(6):
        out = np.zeros(DIRECTED_REQUEST_BYTES, np.uint8)
        encode_directed_request(Head(20 + k, 0, 1, 0), 0.5 * k, out)
        packets.append(out.tobytes())
    robots.hand(0, *packets).step()
    kinds = [header[0] for _, header, _ in robots.sent(0)]
    assert sorted(kinds) == [KIND_DIRECTED_REQUEST] * OWN_ROOM + [KIND_LATENT] * (MAX_OUTBOX - OWN_ROOM)
    assert len(kinds) == MAX_OUTBOX
    nearest = [int(n) for n in robots.percepts["neighbour_id"][0, :OWN_ROOM]]
    assert [to for to, header, _ in robots.sent(0) if header[0] == KIND_DIRECTED_REQUEST] == nearest


def test_after_a_loop_the_side_is_tossed_for(model):
    sides = set()
    for seed in range(8):
        robots = Robots(planner_of(model), seed=seed)
        robots.memories["toss"][0] = 1
        decision = robots.step().decisions[0]
        assert (decision["fused"], decision["p_left"], decision["n_out"]) == (1, 0.5, 0)
        sides.add(int(decision["side"]))
    assert sides == {1, -1}


def test_a_network_of_the_own_scan_only_asks_nobody(tmp_path):
    robots = Robots(load_planner("giwt-cnn").with_model(make_model(tmp_path / "m", network="cnn"))).step()
    assert (robots.decisions["fused"][0], robots.decisions["n_out"][0]) == (1, 0)


def crossing(model, threads=1, **more):
    """Ten robots that change places through a few obstacles."""
    angles = np.linspace(0.0, 2.0 * math.pi, 10, endpoint=False)
    starts = [(4.5 * math.cos(a), 4.5 * math.sin(a), a + math.pi) for a in angles]
    goals = [(-x, -y) for x, y, _ in starts]
    obstacles = [circle(0.3, 0.4, 1.0), circle(-2.4, 0.6, 0.6), circle(1.9, -1.9, 0.7)]
    planner = {"name": "giwt", "model": str(model)}
    return run_scenario(place_scenario(starts, goals, obstacles, planner=planner, limit_s=150.0, **more), threads)


def test_a_swarm_arrives_without_collision_and_the_same_with_two_threads(model):
    one, two = crossing(model), crossing(model, threads=2)
    assert one.robots["arrived"].all()
    assert not one.robots["crashed"].any()
    assert (one.choices["heard"] > 0).any()
    assert one.robots["feature_bytes"].sum() == MAX_PACKET_BYTES * one.robots["sent_features"].sum() > 0
    for name in ("x", "y", "p_left", "side", "reason", "bytes_sent"):
        assert getattr(one.records, name).tobytes() == getattr(two.records, name).tobytes(), name
    assert one.choices.tobytes() == two.choices.tobytes()


def test_with_half_of_the_packets_lost_it_still_arrives(model):
    trace = crossing(model, radio={"loss": 0.5})
    assert trace.robots["arrived"].all()
    assert not trace.robots["crashed"].any()
