"""The packets about ways: bytes worked out by hand, round trips, and what can happen to bytes on the way."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from swarmscope.onboard.sharing.codes import CRC_INIT, crc16
from swarmscope.onboard.sharing.message import (
    BAD_CHECKSUM,
    BAD_LENGTH,
    CHECK_HEAD,
    CLOSED_HEAD,
    HEADER_FIELDS,
    KIND_CHECK,
    KIND_CLOSED,
    MAX_PACKET_BYTES,
    OK,
    TOO_SHORT,
    Head,
    decode,
    is_request,
    put_checksum,
)
from swarmscope.onboard.sharing.way_message import (
    CELL_M,
    CORNER_M,
    FRAMES,
    PLACE_M,
    WAY_CORNERS,
    Place,
    encode_check,
    encode_closed,
    place_of,
    read_check,
    read_closed,
    unwrapped,
)

HEAD = Head(0x0102, 0x0708, 0x0304, 0x0506)
FRAME = 0x0A0B0C
METRES = st.floats(-2000.0, 2000.0)
CELLS = st.lists(st.tuples(st.integers(-100, 100), st.integers(-100, 100)), min_size=1, max_size=112)


def for_any(*strategies):
    """As ``given``, without its deadline: the first call compiles."""
    return lambda test: settings(deadline=None)(given(*strategies)(test))


def check(place, corners):
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    corners = np.array(corners, np.float64).reshape(-1, 2)
    return out[: encode_check(HEAD, Place(*place, FRAME), corners, len(corners), out)].copy()


def closed(place, cells, most=MAX_PACKET_BYTES):
    out = np.zeros(MAX_PACKET_BYTES, np.uint8)
    cells = np.array(cells, np.int32).reshape(-1, 2)
    return out[: encode_closed(HEAD, Place(*place, FRAME), cells, len(cells), out, most)].copy()


def corners_of(packet, most=WAY_CORNERS):
    corners = np.zeros((most, 2))
    return corners[: max(0, read_check(packet, packet.size, corners))]


def cells_of(packet, most=112):
    cells = np.zeros((most, 2))
    return cells[: max(0, read_closed(packet, packet.size, cells))]


def decoded(packet):
    header = np.zeros(len(HEADER_FIELDS), np.int64)
    status = decode(packet, packet.size, header)
    return status, dict(zip(HEADER_FIELDS, header.tolist(), strict=True))


def test_check_byte_by_byte():
    packet = check((1.5, -0.25), [(1.0, -1.0), (0.125, 20.0)])
    body = [0x26, 2, 1, 8, 7, 4, 3, 96, 0, 0xF0, 0xFF, 3, 0x0C, 0x0B, 0x0A, 8, 0x80, 0xFF, 1, 0, 10]
    assert packet[:-2].tolist() == body
    assert int(packet[-2]) | int(packet[-1]) << 8 == crc16(packet, packet.size - 2, CRC_INIT)
    assert packet.size == CHECK_HEAD + 3 + 3 * 2 + 2


def test_closed_byte_by_byte():
    packet = closed((1.5, -0.25), [(20, -3), (21, -3), (19, 4), (40, 4)])
    body = [0x27, 2, 1, 8, 7, 4, 3, 6, 5, 96, 0, 0xF0, 0xFF, 12, 0x0C, 0x0B, 0x0A]
    body += [0x14, 0xD0, 0xFF, 0x01, 0x7E, 0x88, 0x28, 0x40, 0x00]
    assert packet[:-2].tolist() == body
    assert packet.size == CLOSED_HEAD + 12 + 2


def test_headers():
    assert decoded(check((0, 0), [(1, 2)])) == (
        OK,
        {"kind": KIND_CHECK, "sender": 0x0102, "seq": 0x0304, "reply_to": -1, "n": 2, "boot": 0x0708},
    )
    assert decoded(closed((0, 0), [(1, 2)])) == (
        OK,
        {"kind": KIND_CLOSED, "sender": 0x0102, "seq": 0x0304, "reply_to": 0x0506, "n": 6, "boot": 0x0708},
    )
    assert is_request(int(check((0, 0), [])[0]))
    assert not is_request(int(closed((0, 0), [(0, 0)])[0]))


@for_any(METRES, METRES, st.lists(st.tuples(st.floats(-255, 255), st.floats(-255, 255)), max_size=WAY_CORNERS))
def test_a_check_comes_out_as_it_went_in(x, y, corners):
    packet = check((x, y), corners)
    assert decoded(packet)[0] == OK
    place = place_of(packet)
    assert place.frame == FRAME
    assert abs(unwrapped(place.x - x)) <= PLACE_M / 2 + 1e-9
    assert abs(unwrapped(place.y - y)) <= PLACE_M / 2 + 1e-9
    assert np.abs(corners_of(packet) - np.array(corners).reshape(-1, 2)).max(initial=0.0) <= CORNER_M / 2 + 1e-9


@for_any(METRES, METRES, CELLS)
def test_a_closed_comes_out_as_it_went_in(x, y, cells):
    packet = closed((x, y), cells)
    assert decoded(packet)[0] == OK
    found = cells_of(packet) / CELL_M
    assert 0 < len(found) <= len(cells)
    assert found.tolist() == [list(cell) for cell in cells[: len(found)]]


def test_a_step_that_is_repeated_takes_a_byte_for_fifteen():
    wall = [(4 * k, 0) for k in range(19)] + [(72, 4 * k) for k in range(1, 9)]
    packet = closed((0.0, 0.0), wall)
    assert packet[CLOSED_HEAD + 3 : -2].tolist() == [0, 0, 0, 0x04, 0xF8, 0x18, 0x40, 0x68]
    assert (cells_of(packet) / CELL_M).tolist() == [list(cell) for cell in wall]


@for_any(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9), st.integers(1, 40)), min_size=1, max_size=6))
def test_rows_of_cells_come_out_as_they_went_in(rows):
    cells = [(0, 0)]
    for dx, dy, times in rows:
        cells += [(cells[-1][0] + dx * k, cells[-1][1] + dy * k) for k in range(1, times + 1)]
    packet = closed((0.0, 0.0), cells[:112])
    found = cells_of(packet) / CELL_M
    assert found.tolist() == [list(cell) for cell in cells[: len(found)]]
    assert len(found) == len(cells[:112]) or packet.size > MAX_PACKET_BYTES - 5


def test_forty_cells_of_a_crooked_wall_fit_into_sixty_bytes():
    wall = [(k * 4, k * k % 3) for k in range(-19, 20)]
    packet = closed((0.0, 0.0), wall, most=60)
    assert packet.size <= 60
    assert len(cells_of(packet)) == 39


@pytest.mark.parametrize("most", range(CLOSED_HEAD + 8, 60))
def test_an_answer_is_never_longer_than_it_may_be(most):
    packet = closed((0.0, 0.0), [(9 * k % 90, 9 * (k // 10)) for k in range(40)], most)
    assert 0 < packet.size <= most
    assert decoded(packet)[0] == OK
    assert len(cells_of(packet)) > 0


def test_nothing_is_sent_of_nothing_nor_into_too_little_room():
    assert closed((0, 0), []).size == 0
    assert closed((0, 0), [(1, 1)], most=CLOSED_HEAD + 7).size == 0
    out = np.zeros(CHECK_HEAD + 7, np.uint8)
    assert encode_check(HEAD, Place(0.0, 0.0, FRAME), np.zeros((1, 2)), 1, out) == 0


def test_of_too_many_corners_the_first_are_sent_and_far_ones_are_moved_near():
    packet = check((0, 0), [(k, 1e6) for k in range(WAY_CORNERS + 3)])
    found = corners_of(packet, 20)
    assert len(found) == WAY_CORNERS
    assert found[:, 0].tolist() == list(range(WAY_CORNERS))
    assert found[:, 1].max() < 256.0


def test_what_is_no_number_is_sent_as_nought():
    packet = check((math.nan, math.inf), [(math.nan, -math.inf)])
    assert decoded(packet)[0] == OK
    assert tuple(place_of(packet)) == (0.0, 0.0, FRAME)
    assert corners_of(packet).tolist() == [[0.0, 0.0]]


@for_any(st.binary(max_size=MAX_PACKET_BYTES), st.sampled_from([KIND_CHECK, KIND_CLOSED]), st.booleans())
def test_any_bytes_with_a_right_checksum_are_read_without_harm(data, kind, right):
    packet = np.zeros(MAX_PACKET_BYTES, np.uint8)
    packet[: len(data)] = np.frombuffer(data, np.uint8)
    packet[0] = 0x20 | kind
    length = put_checksum(packet, max(1, len(data) - 2)) if right and len(data) > 3 else len(data)
    header = np.zeros(len(HEADER_FIELDS), np.int64)
    status = decode(packet, length, header)
    corners, cells = np.full((WAY_CORNERS, 2), 7.0), np.full((112, 2), 7.0)
    read_check(packet, length, corners)
    read_closed(packet, length, cells)
    assert np.isfinite(corners).all()
    assert np.isfinite(cells).all()
    if status == OK:
        assert np.abs(cells).max() < 200.0


def test_torn_and_lengthened_packets_are_dropped():
    for packet in (check((0, 0), [(1, 1), (2, 2)]), closed((0, 0), [(1, 1), (2, 2)])):
        for n in range(packet.size):
            assert decoded(packet[:n])[0] in (TOO_SHORT, BAD_LENGTH, BAD_CHECKSUM)
        assert decoded(np.append(packet, np.uint8(0)))[0] == BAD_LENGTH


def test_a_packet_that_names_no_frame_has_none():
    packet = check((0, 0), [])
    packet[CHECK_HEAD - 1] = 0
    assert place_of(packet).frame == 0
    packet = closed((0, 0), [(1, 1)])
    packet[CLOSED_HEAD - 1] = 2
    assert place_of(packet).frame == 0
    assert FRAMES > FRAME


def test_places_wrap_round_the_short_way():
    assert unwrapped(1023.0) == -1.0
    assert unwrapped(-1023.0) == 1.0
    assert unwrapped(3.0) == 3.0
