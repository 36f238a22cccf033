"""The packets: bytes worked out by hand, round trips, and everything that can happen to bytes on the way."""

from __future__ import annotations

import binascii
import itertools
import math
import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.errors import SwarmscopeError
from swarmscope.onboard.sharing import message
from swarmscope.onboard.sharing.codes import CRC_INIT, crc16
from swarmscope.onboard.sharing.feature_message import FeatureMessage, PacketError
from swarmscope.onboard.sharing.message import (
    BAD_CHECKSUM,
    BAD_KIND,
    BAD_LENGTH,
    BAD_VERSION,
    DIRECTED_REQUEST_BYTES,
    HEADER_FIELDS,
    KIND_DIRECTED_REQUEST,
    KIND_EXACT_FEATURES,
    KIND_FEATURES,
    KIND_LATENT,
    KIND_REQUEST,
    LATENT_FEATURES,
    MAX_FEATURES,
    MAX_FEATURES_BYTES,
    MAX_PACKET_BYTES,
    OK,
    REQUEST_BYTES,
    SEALED,
    STATUS_NAMES,
    TOO_SHORT,
    Head,
    decode,
    direction_of,
    encode_directed_request,
    encode_exact_features,
    encode_features,
    encode_latent,
    encode_request,
    extremum_kind,
    is_request,
    name_of,
    quantise_features,
    read_features,
    read_latent,
)

RANGE = 5.0
TURN = 2.0 * math.pi
EPS = 1e-9


def for_any(*strategies):
    """As ``given``, without its deadline: the first call compiles."""
    return lambda test: settings(deadline=None)(given(*strategies)(test))


def features(angles, distances, n=None, range_max=RANGE, encode=encode_features):
    """Encode with fixed numbers: sender 0x0102, boot 0x0708, seq 0x0304, reply_to 0x0506."""
    out = np.zeros(MAX_FEATURES_BYTES, np.uint8)
    angles, distances = np.array(angles, np.float64), np.array(distances, np.float64)
    n = angles.size if n is None else n
    length = encode(Head(0x0102, 0x0708, 0x0304, 0x0506), angles, distances, n, range_max, out)
    return out[:length].copy()


def exact(angles, distances, n=None):
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    angles, distances = np.array(angles, np.float64), np.array(distances, np.float64)
    length = encode_exact_features(Head(1, 4, 2, 3), angles, distances, angles.size if n is None else n, out)
    return out[:length].copy()


def request(sender=5, seq=6, boot=9):
    out = np.zeros(REQUEST_BYTES, np.uint8)
    return out[: encode_request(Head(sender, boot, seq, 0), out)].copy()


def directed(direction, sender=5, seq=6, boot=9):
    out = np.zeros(DIRECTED_REQUEST_BYTES, np.uint8)
    return out[: encode_directed_request(Head(sender, boot, seq, 0), direction, out)].copy()


def latent(codes=None, scale=200, sender=5, seq=6, reply_to=7, boot=9):
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    codes = np.arange(LATENT_FEATURES, dtype=np.uint8) if codes is None else codes
    return out[: encode_latent(Head(sender, boot, seq, reply_to), codes, scale, out)].copy()


def status_of(data, length=None):
    """Return (status, header) of ``data``."""
    header = np.full(len(HEADER_FIELDS), 77, np.int64)
    return decode(data, data.size if length is None else length, header), header.tolist()


def read(data, range_max=RANGE):
    angles, distances = np.zeros(MAX_FEATURES), np.zeros(MAX_FEATURES)
    n = read_features(data, data.size, range_max, angles, distances)
    return angles[:n], distances[:n]


def sealed(head):
    """Return the bytes with the right checksum, so that only their content can be refused."""
    return np.frombuffer(head + binascii.crc_hqx(head, CRC_INIT).to_bytes(2, "little"), np.uint8).copy()


def a_packet(n=8, seed=1):
    generator = np.random.default_rng(seed)
    return features(generator.uniform(-4.0, 7.0, n), generator.uniform(0.0, RANGE, n))


PAIRS = st.lists(
    st.tuples(st.floats(-20.0, 20.0), st.floats(-1.0, 7.0)), min_size=0, max_size=MAX_FEATURES
).map(lambda pairs: ([p[0] for p in pairs], [p[1] for p in pairs]))


# The bytes


def test_features_packet_worked_by_hand():
    # 1/4, 1/2, 3/4 of a turn are 0x40, 0x80, 0xc0; 1, 2, 4 m of 5 m are 51, 102, 204
    packet = features([math.pi, -math.pi / 2.0, math.pi / 2.0], [2.0, 4.0, 1.0])
    assert packet.tobytes().hex(" ") == "22 02 01 08 07 04 03 06 05 03 40 80 c0 33 66 cc 44 f6"
    assert packet.tobytes() == sealed(packet.tobytes()[:-2]).tobytes()


def test_request_packet_worked_by_hand():
    packet = request(sender=0x0005, seq=0xABCD, boot=0x1234)
    assert packet.tobytes().hex(" ") == "21 05 00 34 12 cd ab 0a 41"
    assert packet.tobytes() == sealed(packet.tobytes()[:-2]).tobytes()


def test_exact_packet_holds_float32():
    packet = exact([math.pi], [2.5])
    expected = np.array([math.pi, 2.5], "<f4").tobytes()
    assert packet.tobytes()[:-2] == bytes.fromhex("23 0100 0400 0200 0300 01") + expected


@pytest.mark.parametrize("n", range(MAX_FEATURES + 1))
def test_sizes(n):
    assert a_packet(n).size == 12 + 2 * n <= MAX_FEATURES_BYTES
    assert exact(np.zeros(n), np.zeros(n)).size == 12 + 8 * n <= MAX_PACKET_BYTES
    assert request().size == REQUEST_BYTES == 9


def test_directed_request_worked_by_hand():
    packet = directed(math.pi / 2.0, sender=0x0005, seq=0xABCD, boot=0x1234)
    assert packet.tobytes()[:-2].hex(" ") == "24 05 00 34 12 cd ab 40"
    assert packet.tobytes() == sealed(packet.tobytes()[:-2]).tobytes()
    assert packet.size == DIRECTED_REQUEST_BYTES == 10


def test_latent_packet_worked_by_hand():
    packet = latent(scale=0xC8, sender=0x0102, seq=0x0304, reply_to=0x0506, boot=0x0708)
    head = bytes.fromhex("25 02 01 08 07 04 03 06 05 c8")
    assert packet.tobytes() == sealed(head + bytes(range(128))).tobytes()
    assert packet.size == MAX_PACKET_BYTES == 140


def test_crc_check_value():
    data = np.frombuffer(b"123456789", np.uint8)
    assert crc16(data, 9, 0xFFFF) == 0x29B1
    assert crc16(data, 0, 0xFFFF) == 0xFFFF


@for_any(st.binary(max_size=60), st.integers(0, 0xFFFF))
def test_crc_equals_the_standard_library(data, init):
    row = np.frombuffer(data, np.uint8)
    assert crc16(row, row.size, init) == binascii.crc_hqx(data, init)
    assert crc16(row, row.size) == binascii.crc_hqx(data, CRC_INIT)


# Round trips


@for_any(PAIRS, st.floats(0.1, 100.0))
def test_round_trip(pairs, range_max):
    angles, distances = pairs
    packet = features(angles, distances, range_max=range_max)
    assert status_of(packet) == (OK, [KIND_FEATURES, 0x0102, 0x0304, 0x0506, len(angles), 0x0708])
    got_angles, got_distances = read(packet, range_max)
    assert np.all(np.diff(got_angles) >= 0.0)
    assert np.all((got_angles >= 0.0) & (got_angles < TURN))
    assert np.all((got_distances >= 0.0) & (got_distances <= range_max))
    codes = [math.floor(a / TURN % 1.0 * 256.0 + 0.5) % 256 for a in angles]
    order = sorted(range(len(angles)), key=lambda k: codes[k])  # stable, as the packet's own
    for k, angle, distance in zip(order, got_angles, got_distances, strict=True):
        turned = (angles[k] - angle + math.pi) % TURN - math.pi
        assert abs(turned) <= math.pi / 256.0 + EPS
        assert abs(min(max(distances[k], 0.0), range_max) - distance) <= range_max / 510.0 + EPS


@for_any(PAIRS)
def test_order_of_sorted_features_is_kept(pairs):
    angles = sorted(a % 6.2 for a in pairs[0])  # below 255.5 steps: none is rounded up to a whole turn
    got_angles, got_distances = read(features(angles, pairs[1]))
    assert np.allclose(got_angles, angles, atol=math.pi / 256.0 + EPS)
    assert np.allclose(got_distances, np.clip(pairs[1], 0.0, RANGE), atol=RANGE / 510.0 + EPS)


@for_any(PAIRS, st.floats(0.1, 100.0))
def test_quantise_features_gives_what_a_receiver_reads(pairs, range_max):
    angles, distances = np.array(pairs[0]), np.array(pairs[1])
    got_angles, got_distances = read(features(angles, distances, range_max=range_max), range_max)
    assert quantise_features(angles, distances, angles.size, range_max) == angles.size
    assert angles.tolist() == got_angles.tolist()
    assert distances.tolist() == got_distances.tolist()
    quantise_features(angles, distances, angles.size, range_max)
    assert angles.tolist() == got_angles.tolist()  # once more changes nothing
    assert distances.tolist() == got_distances.tolist()


@for_any(PAIRS)
def test_exact_round_trip(pairs):
    packet = exact(*pairs)
    assert status_of(packet) == (OK, [KIND_EXACT_FEATURES, 1, 2, 3, len(pairs[0]), 4])
    got_angles, got_distances = read(packet)
    assert np.all(np.diff(got_angles) >= 0.0)
    assert np.all((got_angles >= 0.0) & (got_angles < TURN))
    sent = sorted(np.clip(pairs[1], 0.0, RANGE).astype(np.float32).tolist())
    assert sorted(got_distances.tolist()) == sent
    for angle in pairs[0]:
        assert np.min(np.abs((got_angles - angle + math.pi) % TURN - math.pi)) <= 1e-5


@for_any(st.floats(-20.0, 20.0), st.integers(0, 0xFFFF), st.integers(0, 0xFFFF), st.integers(0, 0xFFFF))
def test_directed_round_trip(direction, sender, seq, boot):
    packet = directed(direction, sender, seq, boot)
    status, header = status_of(packet)
    assert (status, header[:4], header[5]) == (OK, [KIND_DIRECTED_REQUEST, sender, seq, -1], boot)
    assert abs((direction_of(header[4]) - direction + math.pi) % TURN - math.pi) <= math.pi / 256.0 + EPS


@pytest.mark.parametrize("direction", [math.nan, math.inf, -math.inf, 1e300])
def test_a_direction_that_is_no_number_is_sent_as_0(direction):
    assert status_of(directed(direction)) == (OK, [KIND_DIRECTED_REQUEST, 5, 6, -1, 0, 9])


@for_any(st.binary(min_size=128, max_size=128), st.integers(-5, 300), st.integers(0, 0xFFFF))
def test_latent_round_trip(codes, scale, reply_to):
    row = np.frombuffer(codes, np.uint8)
    packet = latent(row, scale, reply_to=reply_to)
    assert status_of(packet) == (OK, [KIND_LATENT, 5, 6, reply_to, scale & 0xFF, 9])
    got = np.zeros(LATENT_FEATURES, np.uint8)
    assert read_latent(packet, packet.size, got) == scale & 0xFF
    assert got.tobytes() == codes


def test_only_requests_are_requests():
    packets = [request(), directed(1.0), a_packet(3), exact(np.ones(2), np.ones(2)), latent()]
    assert [bool(is_request(packet[0])) for packet in packets] == [True, True, False, False, False]


def test_ends_of_the_scales():
    angles, distances = read(features([0.0, TURN - 0.001, TURN, -1e-20], [0.0, RANGE, math.inf, -1.0]))
    assert angles.tolist() == [0.0] * 4
    assert distances.tolist() == [0.0, RANGE, RANGE, 0.0]


@pytest.mark.parametrize("encoded", [features, exact])
def test_values_that_are_no_numbers(encoded):
    wild_angles = [math.nan, math.inf, -math.inf, 1e300, 1.0]
    packet = encoded(wild_angles, [math.nan, -math.inf, math.inf, 1e300, math.nan])
    angles, distances = read(packet)
    assert angles[:4].tolist() == [0.0] * 4
    assert angles[4] == pytest.approx(1.0, abs=0.013)
    assert distances.tolist() == [0.0, 0.0, RANGE, RANGE, 0.0]


@pytest.mark.parametrize("bits", [0x7FC00000, 0x7F800000, 0xFF800000, 0xC0000000])
def test_exact_packet_with_wild_floats_is_tamed(bits):
    wild = bits.to_bytes(4, "little")
    packet = sealed(bytes.fromhex("23 0100 0900 0200 0300 01") + wild + wild)
    assert status_of(packet)[0] == OK
    angles, distances = read(packet)
    assert 0.0 <= angles[0] < TURN
    assert 0.0 <= distances[0] <= RANGE


@pytest.mark.parametrize("range_max", [0.0, -1.0, math.nan])
def test_a_senseless_range_gives_zero_distances(range_max):
    assert features([1.0], [2.0], range_max=range_max)[11] == 0


def test_features_that_were_not_sent_sorted_are_read_sorted():
    packet = sealed(bytes.fromhex("22 0100 0900 0200 0300 02 80 40 ff 00"))
    assert status_of(packet)[0] == OK
    angles, distances = read(packet)
    assert angles.tolist() == [math.pi / 2.0, math.pi]
    assert distances.tolist() == [0.0, RANGE]


def test_inputs_are_left_alone():
    angles, distances = np.array([3.0, 1.0]), np.array([9.0, -9.0])
    encode_features(Head(1, 9, 2, 3), angles, distances, 2, RANGE, np.zeros(50, np.uint8))
    assert angles.tolist() == [3.0, 1.0]
    assert distances.tolist() == [9.0, -9.0]


# Limits


@pytest.mark.parametrize("encoded", [features, exact])
def test_more_than_16_features_are_cut(encoded):
    angles, distances = np.linspace(0.0, 3.0, 30), np.linspace(0.0, 4.0, 30)
    assert encoded(angles, distances).tolist() == encoded(angles[:16], distances[:16]).tolist()


@pytest.mark.parametrize("encoded", [features, exact])
@pytest.mark.parametrize("n", [-3, 0, 99])
def test_wrong_counts_are_cut_to_what_is_there(encoded, n):
    packet = encoded([1.0, 2.0], [1.0, 2.0], n=n)
    assert packet[9] == min(max(n, 0), 2)
    assert status_of(packet)[0] == OK


def test_no_room_gives_no_packet():
    two = np.ones(2)
    head = Head(1, 9, 2, 3)
    assert encode_features(head, two, two, 2, RANGE, np.zeros(15, np.uint8)) == 0
    assert encode_exact_features(head, two, two, 2, np.zeros(27, np.uint8)) == 0
    assert encode_request(head, np.zeros(8, np.uint8)) == 0
    assert encode_directed_request(head, 0.0, np.zeros(9, np.uint8)) == 0
    assert encode_latent(head, np.zeros(128, np.uint8), 4, np.zeros(139, np.uint8)) == 0
    assert encode_latent(head, np.zeros(127, np.uint8), 4, np.zeros(140, np.uint8)) == 0


def test_reading_into_short_arrays_stays_inside():
    angles, distances = np.full(4, -1.0), np.full(4, -1.0)
    packet = a_packet(8)
    assert read_features(packet, packet.size, RANGE, angles[:3], distances[:3]) == 3
    assert angles[3] == distances[3] == -1.0
    for packet in (request(), directed(0.0), latent()):
        assert read_features(packet, packet.size, RANGE, angles, distances) == 0
    codes = np.full(LATENT_FEATURES, 9, np.uint8)
    for packet in (request(), directed(0.0), a_packet(16), exact(np.ones(16), np.ones(16))):
        assert read_latent(packet, packet.size, codes) == -1
    assert read_latent(latent(), 140, codes[:127]) == -1
    assert (codes == 9).all()


@for_any(st.binary(max_size=160), st.integers(-5, 200))
def test_reading_what_was_never_decoded_stays_inside(data, length):
    angles, distances = np.zeros(MAX_FEATURES), np.zeros(MAX_FEATURES)
    row = np.frombuffer(data, np.uint8)
    assert 0 <= read_features(row, length, RANGE, angles, distances) <= MAX_FEATURES
    assert 0 <= crc16(row, length, -1) <= 0xFFFF
    assert -1 <= read_latent(row, length, np.zeros(LATENT_FEATURES, np.uint8)) <= 255


@for_any(*[st.integers(-(10**6), 10**6)] * 3)
def test_numbers_wrap_to_16_bits(sender, seq, boot):
    expected = [KIND_REQUEST, sender % 65536, seq % 65536, -1, -1, boot % 65536]
    assert status_of(request(sender, seq, boot)) == (OK, expected)
    assert name_of(boot, seq) == boot % 65536 ^ seq % 65536


def test_two_lives_of_one_robot_call_their_requests_differently():
    """What answers name is not the counter alone: it begins anew with every start."""
    first = {name_of(0x1234, seq) for seq in range(256)}
    assert len(first) == 256
    assert not first & {name_of(0x5634, seq) for seq in range(256)}
    assert name_of(0x1234, 0x00FF) == 0x12CB


# What the air does to packets


@pytest.mark.parametrize(
    "packet",
    [a_packet(8), a_packet(0), request(), directed(2.0)],
    ids=["features", "empty", "request", "directed"],
)
@pytest.mark.parametrize("flips", [1, 2])
def test_every_one_and_two_bit_error_is_found(packet, flips):
    header = np.zeros(6, np.int64)
    for bits in itertools.combinations(range(8 * packet.size), flips):
        torn = packet.copy()
        for bit in bits:
            torn[bit // 8] ^= 1 << (bit % 8)
        assert decode(torn, torn.size, header) != OK
        assert header.tolist() == [-1] * 6


def test_every_one_bit_error_of_a_latent_is_found_and_some_of_two():
    packet, header = latent(), np.zeros(6, np.int64)
    generator = np.random.default_rng(5)
    pairs = [(b, b) for b in range(8 * packet.size)] + generator.integers(0, 8 * packet.size, (20_000, 2)).tolist()
    for bits in pairs:
        torn = packet.copy()
        for bit in set(bits):
            torn[bit // 8] ^= 1 << (bit % 8)
        assert decode(torn, torn.size, header) != OK


def test_every_burst_of_16_bits_is_found():
    packet = a_packet(8)
    header = np.zeros(6, np.int64)
    generator = np.random.default_rng(2)
    whole = int.from_bytes(packet.tobytes(), "big")
    for shift in range(8 * packet.size - 16):
        for pattern in generator.integers(1, 1 << 16, 100).tolist():
            torn = (whole ^ (pattern << shift)).to_bytes(packet.size, "big")
            assert decode(np.frombuffer(torn, np.uint8), packet.size, header) != OK


def test_random_damage_is_found_but_for_one_in_65536():
    packet = a_packet(8)
    header = np.zeros(6, np.int64)
    generator = np.random.default_rng(3)
    missed = 0
    for _ in range(20_000):
        torn = packet.copy()
        places = generator.integers(0, packet.size, generator.integers(2, 9))
        torn[places] = generator.integers(0, 256, places.size)
        if torn.tobytes() != packet.tobytes() and decode(torn, torn.size, header) == OK:
            missed += 1
            check_is_harmless(torn)
    assert missed <= 4


def check_is_harmless(data):
    """Whatever was accepted reads as angles and distances in their ranges."""
    angles, distances = read(data)
    assert len(angles) <= MAX_FEATURES
    assert np.all((angles >= 0.0) & (angles < TURN) & (distances >= 0.0) & (distances <= RANGE))


@pytest.mark.parametrize(
    "packet", [a_packet(16), request(), exact(np.ones(9), np.ones(9)), directed(1.0), latent()]
)
def test_every_truncation_and_every_longer_length_is_found(packet):
    longer = np.concatenate([packet, np.zeros(40, np.uint8)])
    for length in range(longer.size):
        if length != packet.size:
            assert status_of(longer, length)[0] != OK
            assert status_of(longer[:length])[0] != OK


@for_any(st.binary(max_size=160), st.integers(-5, 200))
def test_random_bytes_never_raise(data, length):
    row = np.frombuffer(data, np.uint8)
    status, header = status_of(row, length)
    assert 0 <= status < len(STATUS_NAMES)
    if status == OK:
        check_is_harmless(row[:length])
    else:
        assert header == [-1] * 6


def test_random_bytes_with_a_fitting_head_are_refused_by_the_checksum():
    header = np.zeros(6, np.int64)
    rows = np.random.default_rng(4).integers(0, 256, (30_000, 28)).astype(np.uint8)
    rows[:, 0], rows[:, 9] = 0x22, 8
    statuses = [decode(row, 28, header) for row in rows]
    assert statuses.count(OK) <= 5
    assert set(statuses) <= {OK, BAD_CHECKSUM}


@for_any(PAIRS)
def test_a_standard_checksum_never_passes(pairs):
    body = features(*pairs).tobytes()[:-2]
    foreign = body + binascii.crc_hqx(body, 0xFFFF).to_bytes(2, "little")
    assert status_of(np.frombuffer(foreign, np.uint8))[0] == BAD_CHECKSUM


@pytest.mark.parametrize(
    ("head", "status"),
    [
        ("", TOO_SHORT),
        ("21 0100 0900 02", TOO_SHORT),
        ("12 0100 0200 0300 00", BAD_VERSION),
        ("02 0100 0900 0200 0300 00", BAD_VERSION),
        ("32 0100 0900 0200 0300 00", BAD_VERSION),
        ("20 0100 0900 0200", BAD_KIND),
        ("26 0100 0900 0200 0300 00", TOO_SHORT),
        ("26 0100 0900 0200 00000000 00", OK),
        ("26 0100 0900 0200 00000000 01", BAD_LENGTH),
        ("26 0100 0900 0200 00000000 0d" + " 00" * 39, BAD_LENGTH),
        ("27 0100 0900 0200 0300 00000000", TOO_SHORT),
        ("27 0100 0900 0200 0300 00000000 00", OK),
        ("27 0100 0900 0200 0300 00000000 03 0102", BAD_LENGTH),
        ("28 0100 0900 0200 0300 00", BAD_KIND),
        ("24 0100 0900 0200", BAD_LENGTH),
        ("24 0100 0900 0200 40 00", BAD_LENGTH),
        ("25 0100 0900 0200 03", TOO_SHORT),
        ("25 0100 0900 0200 0300 c8" + " 00" * 127, BAD_LENGTH),
        ("25 0100 0900 0200 0300 c8" + " 00" * 129, BAD_LENGTH),
        ("24 0100 0900 0200 40", OK),
        ("25 0100 0900 0200 0300 ff" + " 00" * 128, OK),
        ("2f 0100 0900 0200 0300 00", BAD_KIND),
        *[(f"{0x20 | SEALED | kind:02x} 0100 0900 0200 0300 00", BAD_KIND) for kind in range(8)],
        ("22 0100 0900 0200", TOO_SHORT),
        ("21 0100 0900 0200 03", BAD_LENGTH),
        ("22 0100 0900 0200 0300 01 40", BAD_LENGTH),
        ("22 0100 0900 0200 0300 02 40 ff", BAD_LENGTH),
        ("22 0100 0900 0200 0300 00 40 ff", BAD_LENGTH),
        ("22 0100 0900 0200 0300 11" + " 00" * 34, BAD_LENGTH),
        ("23 0100 0900 0200 0300 01 40 ff", BAD_LENGTH),
        ("21 0100 0900 0200", OK),
        ("22 0100 0900 0200 0300 00", OK),
    ],
)
def test_foreign_and_malformed_packets_with_a_right_checksum(head, status):
    assert status_of(sealed(bytes.fromhex(head)))[0] == status


def test_statuses_have_names():
    assert [STATUS_NAMES[s] for s in (OK, TOO_SHORT, BAD_VERSION, BAD_KIND, BAD_LENGTH, BAD_CHECKSUM)] == [
        "ok",
        "too short",
        "bad version",
        "bad kind",
        "bad length",
        "bad checksum",
    ]


# Maximum or minimum


def test_kind_of_extremum_follows_from_the_neighbours():
    distances = np.array([1.0, 4.0, 2.0, 5.0])
    assert [extremum_kind(distances, 4, k) for k in range(4)] == [-1, 1, -1, 1]
    assert [extremum_kind(distances, 2, k) for k in range(2)] == [-1, 1]


def test_kind_that_cannot_be_told_is_0():
    assert extremum_kind(np.array([4.0, 3.0, 1.0]), 3, 1) == 0  # the minimum between 4 and 3 was left out
    assert extremum_kind(np.array([2.0, 2.0]), 2, 0) == 0
    assert extremum_kind(np.array([2.0]), 1, 0) == 0
    assert extremum_kind(np.array([1.0, 2.0]), 2, 2) == 0
    assert extremum_kind(np.zeros(0), 0, 0) == 0


@for_any(st.lists(st.tuples(st.integers(0, 100), st.integers(110, 255)), min_size=1, max_size=8))
def test_kinds_survive_the_radio(valleys_and_peaks):
    codes = [code for pair in valleys_and_peaks for code in pair]
    distances = np.array(codes) * RANGE / 255.0
    angles = np.arange(len(codes)) * TURN / len(codes)
    got = read(features(angles, distances))[1]
    assert [extremum_kind(got, got.size, k) for k in range(got.size)] == [-1, 1] * len(valleys_and_peaks)


# Compiled and plain


@for_any(PAIRS)
def test_compiled_kernels_equal_the_plain_functions(pairs):
    packet = features(*pairs)
    assert packet.tolist() == features(*pairs, encode=encode_features.py_func).tolist()
    header, plain_header = np.zeros(6, np.int64), np.zeros(6, np.int64)
    assert decode(packet, packet.size, header) == decode.py_func(packet, packet.size, plain_header)
    assert header.tolist() == plain_header.tolist()
    assert crc16(packet, packet.size) == crc16.py_func(packet, packet.size)
    angles, distances = read(packet)
    plain_angles, plain_distances = np.zeros(MAX_FEATURES), np.zeros(MAX_FEATURES)
    n = read_features.py_func(packet, packet.size, RANGE, plain_angles, plain_distances)
    assert plain_angles[:n].tolist() == angles.tolist()
    assert plain_distances[:n].tolist() == distances.tolist()


WITHOUT_JIT = """
import numpy as np
from swarmscope.onboard.sharing import message as m
generator = np.random.default_rng(5)
out, header, a, d = np.zeros(140, np.uint8), np.zeros(6, np.int64), np.zeros(16), np.zeros(16)
for _ in range(100):
    n = int(generator.integers(0, 17))
    angles, distances = generator.uniform(-9, 9, n), generator.uniform(-1, 7, n)
    if n > 3:
        angles[0], angles[1], distances[2], distances[3] = np.nan, np.inf, np.nan, np.inf
    for length in (
        m.encode_features(m.Head(70000, 65535 - n, 65535, n), angles, distances, n, 5.0, out),
        m.encode_exact_features(m.Head(n, n, n, n), angles, distances, n, out),
        m.encode_request(m.Head(n, n, 65535, 0), out),
    ):
        print(out.tobytes().hex(), m.decode(out, length, header), header.tolist())
        print(m.read_features(out, length, 5.0, a, d), a.tolist(), d.tolist())
    out[int(generator.integers(0, 7))] ^= 255
    print(m.decode(out, 9, header), m.quantise_features(angles, distances, n, 5.0))
    print(angles.tolist(), distances.tolist(), m.extremum_kind(distances, n, 1), m.name_of(n, 65535))
"""


def test_whole_codec_gives_the_same_without_the_compiler():
    outputs = []
    for disabled in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": disabled}
        command = [sys.executable, "-W", "error", "-c", WITHOUT_JIT]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
        outputs.append(done.stdout)
    assert outputs[0] == outputs[1]
    assert len(outputs[0].splitlines()) == 800


# The layer for people


def test_message_packs_and_unpacks():
    sent = FeatureMessage(3, 12, 65535, 9, (math.pi, math.pi / 2.0), (RANGE, 1.0))
    packet = sent.pack(RANGE)
    assert len(packet) == 16
    assert FeatureMessage.unpack(packet, RANGE) == FeatureMessage(
        3, 12, 65535, 9, (math.pi / 2.0, math.pi), (1.0, RANGE)
    )
    assert FeatureMessage.unpack(exact([1.0], [2.0]).tobytes(), RANGE).angles == (1.0,)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sender": -1}, "sender = -1"),
        ({"boot": 70000}, "boot = 70000"),
        ({"seq": 65536}, "seq = 65536"),
        ({"reply_to": 1 << 20}, "reply_to"),
        ({"angles": (1.0,)}, "1 angles but 2 distances"),
        ({"angles": (0.0,) * 17, "distances": (1.0,) * 17}, "17 features, at most 16"),
        ({"angles": (0.0, math.inf)}, "angle"),
        ({"distances": (0.0, math.nan)}, "distance"),
    ],
)
def test_pack_says_what_does_not_fit(changes, words):
    values = {"sender": 1, "boot": 9, "seq": 2, "reply_to": 3, "angles": (0.0, 1.0), "distances": (1.0, 2.0)}
    with pytest.raises(PacketError, match=words):
        FeatureMessage(**{**values, **changes}).pack(RANGE)


@pytest.mark.parametrize("range_max", [0.0, -1.0, math.nan, math.inf])
def test_pack_and_unpack_need_a_range(range_max):
    with pytest.raises(PacketError, match="range_max"):
        FeatureMessage(1, 9, 2, 3, (), ()).pack(range_max)
    with pytest.raises(PacketError, match="range_max"):
        FeatureMessage.unpack(a_packet().tobytes(), range_max)


@pytest.mark.parametrize(
    ("packet", "words"),
    [
        (b"", "too short"),
        (a_packet().tobytes()[:-1], "bad length"),
        (a_packet().tobytes()[:-1] + b"\0", "bad checksum"),
        (request().tobytes(), "request"),
    ],
)
def test_unpack_says_what_is_wrong(packet, words):
    with pytest.raises(SwarmscopeError, match=words):
        FeatureMessage.unpack(packet, RANGE)


def test_public_limits():
    assert (message.VERSION, MAX_FEATURES, MAX_FEATURES_BYTES, MAX_PACKET_BYTES) == (2, 16, 44, 140)
