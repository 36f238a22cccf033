"""The radio: range, latency, loss, bandwidth, counting, and full queues."""

from __future__ import annotations

import numpy as np
import pytest

from helpers import DT, place_sim
from swarmscope.onboard.percept import EVERYBODY
from swarmscope.onboard.sharing.message import KIND_DIRECTED_REQUEST, KIND_FEATURES, KIND_LATENT, KIND_REQUEST
from swarmscope.sim.cells import index_robots
from swarmscope.sim.faults import strike
from swarmscope.sim.radio import exchange, throw
from swarmscope.sim.sensing import sense
from swarmscope.sim.state import QUEUE, Faults, Radio
from swarmscope.sim.streams import BOOT, boot_number

REQUEST, FEATURES = 9, 28


def line(robots=2, gap=1.0, **radio):
    sim, _ = place_sim([(gap * k, 0.0, 0.0) for k in range(robots)], radio=Radio(**radio))
    index_robots(sim)
    return sim


def content(i, k, length):
    """The bytes of packet k of robot i: short ones begin like requests, others like features."""
    kind = KIND_REQUEST if length == REQUEST else KIND_FEATURES
    return [0x20 | kind, *((10 * i + k + np.arange(1, length)) % 256).tolist()]


def post(sim, i, *packets):
    """Fill robot i's outbox with packets (to, length)."""
    sim.decisions["n_out"][i] = len(packets)
    for k, (to, length) in enumerate(packets):
        sim.decisions["out_to"][i, k], sim.decisions["out_length"][i, k] = to, length
        sim.decisions["out"][i, k, :length] = content(i, k, length)


def heard(sim, i, tick):
    sense(sim, tick, i, i + 1)
    row = sim.percepts[i]
    return [row["packet"][k, : row["packet_length"][k]].tolist() for k in range(row["n_packets"])]


def counters(sim, i, *names):
    return [int(sim.robots[i][name]) for name in names]


def test_a_packet_arrives_whole_at_its_receiver_and_nobody_else():
    sim = line(3)
    post(sim, 0, (2, FEATURES))
    exchange(sim, 0)
    assert heard(sim, 2, 1) == [content(0, 0, FEATURES)]
    assert heard(sim, 1, 1) == []
    assert heard(sim, 0, 1) == []


@pytest.mark.parametrize(("latency_s", "ticks"), [(0.005, 1), (0.15, 1), (0.25, 2), (0.9, 5)])
def test_latency_in_ticks(latency_s, ticks):
    sim = line(latency_s=latency_s)
    post(sim, 0, (1, REQUEST))
    exchange(sim, 0)
    arrived = [tick for tick in range(1, 10) if heard(sim, 1, tick)]
    assert arrived == [ticks]


def test_bytes_on_the_air_are_counted_apart_from_the_payload():
    sim = line(3, overhead_bytes=23)
    post(sim, 0, (1, REQUEST), (2, FEATURES))
    exchange(sim, 0)
    assert counters(sim, 0, "sent", "bytes", "air_bytes") == [2, REQUEST + FEATURES, REQUEST + FEATURES + 46]
    assert counters(sim, 0, "sent_features", "feature_bytes") == [1, FEATURES]
    assert sim.links[: sim.links_n[0]].tolist() == [[0, 0, 2, FEATURES]]
    assert counters(sim, 1, "sent", "bytes", "air_bytes") == [0, 0, 0]


@pytest.mark.parametrize(("kind", "length", "features"), [(KIND_DIRECTED_REQUEST, 10, 0), (KIND_LATENT, 140, 1)])
def test_features_are_told_by_the_kind_of_packet(kind, length, features):
    sim = line(2)
    post(sim, 0, (1, length))
    sim.decisions["out"][0, 0, 0] = 0x20 | kind
    exchange(sim, 0)
    assert counters(sim, 0, "bytes", "sent_features", "feature_bytes") == [length, features, features * length]
    assert sim.links_n[0] == features


def plain_boot(seed, robot, boots):
    """The same draw with Python's numbers."""
    bits = 2**64 - 1

    def mixed(z):
        z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & bits
        z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & bits
        return z ^ (z >> 31)

    step = 0x9E3779B97F4A7C15
    k = mixed((seed + step) & bits)
    for at, value in enumerate((robot, boots, BOOT), 1):
        k = mixed((k + value * step + at) & bits)
    return k >> 48


def test_boot_numbers_are_drawn_from_seed_robot_and_starts():
    for seed in (0, 5):
        sim, _ = place_sim([(k, 0.0, 0.0) for k in range(6)], seed=seed)
        assert sim.percepts["boot"].tolist() == [plain_boot(seed, k, 0) for k in range(6)]
        assert len(set(sim.percepts["boot"].tolist())) == 6
    assert boot_number(5, 3, 2) == plain_boot(5, 3, 2) != boot_number(5, 3, 1)


@pytest.mark.parametrize("length", [-1, 0, 141, 2**62])
def test_packets_of_no_possible_length_are_not_sent(length):
    sim = line()
    post(sim, 0, (1, REQUEST))
    sim.decisions["out_length"][0, 0] = length
    sim.decisions["n_out"][0] = 1000
    exchange(sim, 0)
    assert counters(sim, 0, "sent", "bytes") == [0, 0]


def test_beyond_the_range_nothing_arrives():
    sim = line(2, gap=5.0, range_m=4.9)
    post(sim, 0, (1, REQUEST))
    exchange(sim, 0)
    assert heard(sim, 1, 5) == []
    assert counters(sim, 0, "sent", "unreachable") == [1, 1]
    sim = line(2, gap=5.0, range_m=5.1)
    post(sim, 0, (1, REQUEST))
    exchange(sim, 0)
    assert len(heard(sim, 1, 5)) == 1


def test_crashed_robots_neither_send_nor_receive():
    sim = line(2)
    sim.robots["crashed"][1] = 1
    post(sim, 0, (1, REQUEST))
    post(sim, 1, (0, REQUEST))
    exchange(sim, 0)
    assert counters(sim, 0, "sent", "unreachable", "queued") == [1, 1, 0]
    assert counters(sim, 1, "sent", "queued") == [0, 0]


@pytest.mark.parametrize("to", [-2, 2, 10**9])
def test_addresses_that_nobody_has_are_ignored(to):
    sim = line(2)
    post(sim, 0, (to, REQUEST))
    exchange(sim, 0)
    assert counters(sim, 0, "sent", "bytes") == [0, 0]


def test_a_packet_for_everybody_is_sent_once_and_heard_by_all_in_range():
    sim = line(4, gap=2.0, range_m=4.5)
    post(sim, 0, (EVERYBODY, REQUEST))
    exchange(sim, 0)
    assert [heard(sim, i, 1) for i in range(4)] == [[], [content(0, 0, REQUEST)], [content(0, 0, REQUEST)], []]
    assert counters(sim, 0, "sent", "bytes", "unreachable") == [1, REQUEST, 0]


def test_of_a_packet_for_everybody_each_receiver_loses_its_own():
    sim = line(12, gap=0.1, loss=0.5)
    for tick in range(60):
        post(sim, 0, (EVERYBODY, REQUEST))
        exchange(sim, tick)
    got = sim.robots["queued"][1:]
    assert len(set(got.tolist())) > 1
    assert counters(sim, 0, "sent") == [60]
    assert counters(sim, 0, "lost")[0] + counters(sim, 0, "crowded")[0] + int(got.sum()) == 60 * 11
    assert 0.4 < counters(sim, 0, "lost")[0] / (60 * 11) < 0.6


@pytest.mark.parametrize("loss", [0.0, 0.3, 1.0])
def test_the_given_share_is_lost_and_the_same_for_the_same_seed(loss):
    totals = []
    for _ in range(2):
        sim = line(2, loss=loss, bitrate_bps=1e9)
        lost = []
        for tick in range(1500):
            post(sim, 0, (1, REQUEST), (1, FEATURES))
            exchange(sim, tick)
            lost.append(int(sim.robots[0]["lost"]))
            heard(sim, 1, tick + 1)
        totals.append(lost)
        assert int(sim.robots[0]["sent"]) == 3000
    assert totals[0] == totals[1]
    assert totals[0][-1] / 3000 == pytest.approx(loss, abs=0.03)


def test_packets_of_one_tick_share_the_channel():
    """At 8 kbit/s and 32 bytes on the air a packet takes 32 ms: five last 160 ms, in their order."""
    sim = line(2, bitrate_bps=8000.0, overhead_bytes=23, latency_s=0.0)
    post(sim, 0, *[(1, REQUEST)] * 5)
    exchange(sim, 0)
    assert sim.queue_due[1, :5] == pytest.approx(0.032 * np.arange(1, 6))
    assert float(sim.robots[1]["radio_free_s"]) == pytest.approx(0.16)


def test_a_receiver_that_listens_to_one_keeps_the_other_waiting():
    sim = line(3, bitrate_bps=8000.0, overhead_bytes=23, latency_s=0.0)
    post(sim, 0, (2, REQUEST))
    post(sim, 1, (2, REQUEST))
    exchange(sim, 0)
    assert sim.queue_due[2, :2] == pytest.approx([0.032, 0.064])


def test_a_packet_that_would_wait_too_long_is_dropped_and_counted():
    sim = line(2, bitrate_bps=800.0, overhead_bytes=23, max_wait_s=0.5)
    post(sim, 0, *[(1, REQUEST)] * 5)  # 0.32 s each
    exchange(sim, 0)
    assert counters(sim, 0, "sent", "crowded") == [2, 3]
    assert counters(sim, 1, "queued") == [2]


def test_a_full_queue_takes_no_more_and_stays_whole():
    sim = line(8, latency_s=100.0, bitrate_bps=1e9)
    for tick in range(2):
        for i in range(1, 8):
            post(sim, i, *[(0, REQUEST)] * 8)
        exchange(sim, tick)
    assert counters(sim, 0, "queued") == [QUEUE]
    assert sum(counters(sim, i, "crowded")[0] for i in range(8)) == 2 * 7 * 8 - QUEUE
    assert sim.queue_from[0, :8].tolist() == [1] * 8
    assert (sim.queue_length[1:] == 0).all()


def test_the_channel_is_free_again_later():
    sim = line(2, bitrate_bps=8000.0, latency_s=0.0)
    for tick in range(3):
        post(sim, 0, (1, REQUEST))
        exchange(sim, 10 * tick)
    assert sim.queue_due[1, :3] == pytest.approx(10 * DT * np.arange(3) + 0.032)


def thrown(sim, tick, to, packet):
    return throw(sim, tick, to, np.array(packet, np.uint8), len(packet))


def test_a_thrown_packet_is_heard_at_the_next_tick_and_counts_for_nobody():
    sim = line(2)
    assert thrown(sim, 0, 1, [1, 2, 3])
    assert heard(sim, 1, 1) == [[1, 2, 3]]
    assert counters(sim, 0, "sent", "lost", "crowded") == counters(sim, 1, "sent", "lost", "crowded") == [0, 0, 0]
    assert sim.robots["radio_free_s"].tolist() == [0.0, 0.0]


def test_thrown_packets_take_the_room_of_others():
    sim = line(2)
    assert [thrown(sim, 0, 1, [k]) for k in range(QUEUE + 1)] == [True] * QUEUE + [False]
    post(sim, 0, (1, FEATURES))
    exchange(sim, 0)
    assert counters(sim, 0, "sent", "crowded") == [1, 1]


def test_who_is_not_there_and_what_is_no_packet_cannot_be_thrown():
    sim = line(2)
    data = np.zeros(1000, np.uint8)
    for to, length in ((-1, 9), (2, 9), (40000, 9), (1, -1), (1, 141), (1, 1001)):
        assert not throw(sim, 0, to, data, length)
    sim.robots["crashed"][0], sim.robots["down_until"][1] = 1, 5
    assert not thrown(sim, 0, 0, [1]) and not thrown(sim, 0, 1, [1])
    assert thrown(sim, 5, 1, [1])


def test_thrown_packets_that_are_lost_with_a_radio_are_nobodys_loss():
    sim, _ = place_sim([(0.0, 0.0, 0.0), (1.0, 0.0, 0.0)], faults=Faults(silences_per_h=3600.0 / DT))
    thrown(sim, 0, 1, [1])
    strike(sim, 1)
    assert sim.robots["queued"].tolist() == [0, 0] and sim.robots["lost"].tolist() == [0, 0]
