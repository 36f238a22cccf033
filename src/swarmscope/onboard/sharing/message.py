"""Features to bytes and back: the packets that robots exchange, version 2 (see ``docs/message.md``).

A robot asks (REQUEST) and its neighbour answers with the extrema of its scan (FEATURES): directions in the
compass frame (0 = east, counter-clockwise), distances in [0, range_max]. Or it asks for a network's view of a
direction (DIRECTED_REQUEST) and is sent that network's features (LATENT). The kernels never raise and never
allocate: what cannot be decoded gives a status other than ``OK``, what cannot be encoded gives length 0.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline
from swarmscope.geometry import TWO_PI
from swarmscope.onboard.sharing.codes import (
    CRC_INIT,
    angle_code,
    angle_of,
    crc16,
    distance_code,
    distance_of,
    get_f32,
    get_u16,
    insert,
    put_checksum,
    put_f32,
    put_u16,
    turns,
)

VERSION = 2
KIND_REQUEST = 1
KIND_FEATURES = 2
KIND_EXACT_FEATURES = 3
"""Features as float32, to measure what quantisation costs; no robot needs it."""
KIND_DIRECTED_REQUEST = 4
"""A request that says in which direction the asker wants to go."""
KIND_LATENT = 5
"""A network's features of what the sender sees in that direction, a byte each."""
KIND_CHECK = 6
"""A request to everybody: the way that the sender goes (``way_message``)."""
KIND_CLOSED = 7
"""The answer: cells in which something stands that closes the way."""
SEALED = 8
"""Kinds from here on are kept for the same packets with a tag instead of the checksum; nobody reads them yet."""

MAX_FEATURES = 16
REQUEST_BYTES = 9
DIRECTED_REQUEST_BYTES = 10
MAX_FEATURES_BYTES = 44
"""The longest packet that robots send in earnest: ``12 + 2 * MAX_FEATURES``."""
MAX_PACKET_BYTES = 140
"""Room that any packet fits into: an exact one has ``12 + 8 * MAX_FEATURES`` bytes, a latent one always that many."""
MAX_CORNERS = 12
"""Of a way in a CHECK."""
CHECK_HEAD, CLOSED_HEAD = 12, 14
"""Bytes before the corners of a CHECK, before the cells of a CLOSED."""
LATENT_FEATURES = 128
"""Features in a LATENT packet, always all of them."""

OK = 0
TOO_SHORT = 1
BAD_VERSION = 2
BAD_KIND = 3
BAD_LENGTH = 4
BAD_CHECKSUM = 5
STATUS_NAMES = ("ok", "too short", "bad version", "bad kind", "bad length", "bad checksum")

HEADER_FIELDS = ("kind", "sender", "seq", "reply_to", "n", "boot")
"""What ``decode`` fills in, in this order; -1 where the packet has no such field.

``n`` is the number of features; of a DIRECTED_REQUEST the code of its direction, of a LATENT that of its scale, of a
CHECK the number of its corners, of a CLOSED that of the bytes that hold its cells."""

_PLAIN = 7
"""Bytes that every packet starts with: version and kind, sender, boot, seq."""
_HEAD = 10
"""Bytes before the angles of a features packet."""
_LONGEST = 3e38


class Head(NamedTuple):
    """Who sends, and what is answered: numbers of 16 bits."""

    sender: int
    boot: int
    """Drawn anew whenever the sender starts."""
    seq: int
    """The sender's counter."""
    reply_to: int
    """``name_of`` the request that is answered; requests do not have it."""


@jit_inline
def name_of(boot: int, seq: int) -> int:
    """Return what answers call the request that its sender numbered ``seq`` in its life ``boot``."""
    return (boot ^ seq) & 0xFFFF


@jit_inline
def _usable(n: int, angles: np.ndarray, distances: np.ndarray) -> int:
    """Return how many of ``n`` features fit into a packet and are there at all."""
    return max(0, min(n, MAX_FEATURES, angles.size, distances.size))


@jit_inline
def put_head(out: np.ndarray, kind: int, head: Head) -> None:
    """Write the seven bytes that every packet starts with."""
    out[0] = (VERSION << 4) | kind
    put_u16(out, 1, head.sender)
    put_u16(out, 3, head.boot)
    put_u16(out, 5, head.seq)


@jit_inline
def put_answer_head(out: np.ndarray, kind: int, head: Head) -> None:
    """Write the nine bytes that every answer starts with."""
    put_head(out, kind, head)
    put_u16(out, _PLAIN, head.reply_to)


@jit
def encode_request(head: Head, out: np.ndarray) -> int:
    """Write a REQUEST into ``out`` uint8; return its length (0 when ``out`` is too small)."""
    if out.size < REQUEST_BYTES:
        return 0
    put_head(out, KIND_REQUEST, head)
    return put_checksum(out, _PLAIN)


@jit
def encode_directed_request(head: Head, direction: float, out: np.ndarray) -> int:
    """Write a DIRECTED_REQUEST into ``out`` uint8; return its length (0 when ``out`` is too small).

    ``direction`` [rad, compass frame] travels as the nearest of 256; NaN and infinity as 0.
    """
    if out.size < DIRECTED_REQUEST_BYTES:
        return 0
    put_head(out, KIND_DIRECTED_REQUEST, head)
    out[_PLAIN] = angle_code(direction)
    return put_checksum(out, _PLAIN + 1)


@jit
def direction_of(code: int) -> float:
    """Return the direction [rad, compass frame, 0 to 2 pi] that a DIRECTED_REQUEST's ``n`` stands for."""
    return angle_of(code)


@jit
def encode_latent(head: Head, codes: np.ndarray, scale_code: int, out: np.ndarray) -> int:
    """Write LATENT into ``out`` uint8; return its length (0 when ``out`` or ``codes`` uint8 is too small).

    ``codes`` are signed steps of a scale whose own code is ``scale_code`` (0..255); what both mean is the sender's and
    the receiver's business.
    """
    if out.size < MAX_PACKET_BYTES or codes.size < LATENT_FEATURES:
        return 0
    put_answer_head(out, KIND_LATENT, head)
    out[_HEAD - 1] = scale_code & 0xFF
    for k in range(LATENT_FEATURES):
        out[_HEAD + k] = codes[k]
    return put_checksum(out, _HEAD + LATENT_FEATURES)


@jit
def read_latent(data: np.ndarray, length: int, codes: np.ndarray) -> int:
    """Write the codes of a LATENT that ``decode`` found ``OK`` into ``codes (128,)``; return their scale's code.

    -1 for anything else.
    """
    if length != MAX_PACKET_BYTES or length > data.size or codes.size < LATENT_FEATURES:
        return -1
    if int(data[0]) & 0xF != KIND_LATENT:
        return -1
    for k in range(LATENT_FEATURES):
        codes[k] = data[_HEAD + k]
    return int(data[_HEAD - 1])


@jit
def encode_features(
    head: Head, angles: np.ndarray, distances: np.ndarray, n: int, range_max: float, out: np.ndarray
) -> int:
    """Write FEATURES into ``out`` uint8; return the length, ``12 + 2 n`` (0 when ``out`` is too small).

    ``angles`` [rad, compass frame] may be in any order and are left as they are; they travel sorted. Of more
    than ``MAX_FEATURES`` the first are sent. Distances are clipped to [0, range_max]; NaN is sent as 0.
    """
    n = _usable(n, angles, distances)
    if out.size < _HEAD + 2 * n + 2:
        return 0
    put_answer_head(out, KIND_FEATURES, head)
    out[_HEAD - 1] = n
    angle_codes, distance_codes = out[_HEAD : _HEAD + n], out[_HEAD + n : _HEAD + 2 * n]
    for k in range(n):
        distance = distance_code(distances[k], range_max)
        insert(angle_codes, distance_codes, k, angle_code(angles[k]), distance)
    return put_checksum(out, _HEAD + 2 * n)


@jit
def encode_exact_features(head: Head, angles: np.ndarray, distances: np.ndarray, n: int, out: np.ndarray) -> int:
    """Write the features as float32 pairs, ``12 + 8 n`` bytes: for measuring what quantisation costs.

    As ``encode_features``, except that ``read_features`` clips the distances and sorts.
    """
    n = _usable(n, angles, distances)
    if out.size < _HEAD + 8 * n + 2:
        return 0
    put_answer_head(out, KIND_EXACT_FEATURES, head)
    out[_HEAD - 1] = n
    for k in range(n):
        distance = distances[k] if distances[k] > 0.0 else 0.0
        put_f32(out, _HEAD + 4 * k, turns(angles[k]) * TWO_PI)
        put_f32(out, _HEAD + 4 * (n + k), min(distance, _LONGEST))
    return put_checksum(out, _HEAD + 8 * n)


@jit_inline
def is_request(first: int) -> bool:
    """Tell by its first byte whether a packet asks; all others bring features."""
    kind = first & 0xF
    return kind in (KIND_REQUEST, KIND_DIRECTED_REQUEST, KIND_CHECK)


@jit_inline
def is_list(kind: int) -> bool:
    """Tell whether a packet holds a list of ``n`` features."""
    return kind in (KIND_FEATURES, KIND_EXACT_FEATURES)


@jit_inline
def _packet_bytes(kind: int, n: int) -> int:
    """Return how long a packet of ``kind`` with a list of ``n`` features, corners or bytes is."""
    if kind == KIND_REQUEST:
        return REQUEST_BYTES
    if kind == KIND_DIRECTED_REQUEST:
        return DIRECTED_REQUEST_BYTES
    if kind == KIND_LATENT:
        return MAX_PACKET_BYTES
    if kind == KIND_CHECK:
        return CHECK_HEAD + 3 * n + 2
    if kind == KIND_CLOSED:
        return CLOSED_HEAD + n + 2
    return _HEAD + 2 + (2 if kind == KIND_FEATURES else 8) * n


@jit_inline
def _least_bytes(kind: int) -> int:
    """Return how long a packet of ``kind`` is at least."""
    if kind == KIND_CHECK:
        return CHECK_HEAD + 2
    if kind == KIND_CLOSED:
        return CLOSED_HEAD + 2
    return REQUEST_BYTES if is_request(kind) else _HEAD + 2


@jit_inline
def _count(data: np.ndarray, kind: int) -> int:
    """Return how many features, corners or bytes of cells a packet says that it holds."""
    if kind == KIND_CHECK:
        return int(data[CHECK_HEAD - 1])
    if kind == KIND_CLOSED:
        return int(data[CLOSED_HEAD - 1])
    return int(data[_HEAD - 1]) if is_list(kind) else 0


@jit_inline
def _most(kind: int) -> int:
    """Return how many of them a packet may hold."""
    if kind == KIND_CHECK:
        return MAX_CORNERS
    return MAX_PACKET_BYTES if kind == KIND_CLOSED else MAX_FEATURES


@jit_inline
def _check(data: np.ndarray, length: int) -> int:
    """Return the status of a packet: cheap tests first, the checksum last."""
    if length < REQUEST_BYTES or length > data.size:
        return TOO_SHORT
    first = int(data[0])
    if first >> 4 != VERSION:
        return BAD_VERSION
    kind = first & 0xF
    if kind < KIND_REQUEST or kind > KIND_CLOSED:
        return BAD_KIND
    if length < _least_bytes(kind):
        return TOO_SHORT
    n = _count(data, kind)
    if n > _most(kind) or length != _packet_bytes(kind, n):
        return BAD_LENGTH
    return OK if crc16(data, length - 2, CRC_INIT) == get_u16(data, length - 2) else BAD_CHECKSUM


@jit
def decode(data: np.ndarray, length: int, header: np.ndarray) -> int:
    """Check the packet in the first ``length`` bytes of ``data`` uint8; return a status (``STATUS_NAMES``).

    ``header (6,) int64`` receives ``HEADER_FIELDS``; all are -1 unless the status is ``OK``.
    """
    for i in range(min(6, header.size)):
        header[i] = -1
    status = _check(data, length)
    if status == OK and header.size >= 6:
        header[0] = int(data[0]) & 0xF
        header[1] = get_u16(data, 1)
        header[5] = get_u16(data, 3)
        header[2] = get_u16(data, 5)
        if header[0] == KIND_DIRECTED_REQUEST:
            header[4] = int(data[_PLAIN])
        elif header[0] == KIND_CHECK:
            header[4] = _count(data, KIND_CHECK)
        elif header[0] != KIND_REQUEST:
            header[3] = get_u16(data, _PLAIN)
            header[4] = int(data[CLOSED_HEAD - 1]) if header[0] == KIND_CLOSED else int(data[_HEAD - 1])
    return status


@jit
def read_features(
    data: np.ndarray, length: int, range_max: float, angles: np.ndarray, distances: np.ndarray
) -> int:
    """Write the features of a packet that ``decode`` found ``OK`` into the arrays; return how many.

    Angles [rad, compass frame] are ascending in [0, 2 pi), distances [m] in [0, range_max]. 0 for other packets.
    """
    if length < _HEAD + 2 or length > data.size:
        return 0
    kind = int(data[0]) & 0xF
    if not is_list(kind):
        return 0
    sent = int(data[_HEAD - 1])
    if length != _packet_bytes(kind, sent):
        return 0
    n = _usable(sent, angles, distances)
    for k in range(n):
        if kind == KIND_FEATURES:
            angle = angle_of(int(data[_HEAD + k]))
            distance = distance_of(int(data[_HEAD + sent + k]), range_max)
        else:
            angle = turns(get_f32(data, _HEAD + 4 * k)) * TWO_PI
            distance = get_f32(data, _HEAD + 4 * (sent + k))
            distance = min(distance, range_max) if distance > 0.0 else 0.0
        insert(angles, distances, k, angle, distance)
    return n


@jit
def quantise_features(angles: np.ndarray, distances: np.ndarray, n: int, range_max: float) -> int:
    """Replace the first ``n`` features by what a receiver would read of them; return how many."""
    n = _usable(n, angles, distances)
    for k in range(n):
        angle = angle_of(angle_code(angles[k]))
        insert(angles, distances, k, angle, distance_of(distance_code(distances[k], range_max), range_max))
    return n


@jit
def extremum_kind(distances: np.ndarray, n: int, k: int) -> int:
    """Return +1 if feature ``k`` of ``n`` is a maximum, -1 if a minimum, 0 if that cannot be told.

    It follows from the circular neighbours in the list, so that it is not sent.
    """
    if n < 2 or k < 0 or k >= n:
        return 0
    before = distances[k] - distances[(k + n - 1) % n]
    after = distances[k] - distances[(k + 1) % n]
    if before >= 0.0 and after >= 0.0 and before + after > 0.0:
        return 1
    if before <= 0.0 and after <= 0.0 and before + after < 0.0:
        return -1
    return 0
