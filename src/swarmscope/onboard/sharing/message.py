"""Features to bytes and back: the packets that robots exchange, version 1 (see ``docs/message.md``).

A robot asks (REQUEST) and its neighbour answers with the extrema of its scan (FEATURES): directions in the
compass frame (0 = east, counter-clockwise), distances in [0, range_max]. Or it asks for a network's view of a
direction (DIRECTED_REQUEST) and is sent that network's features (LATENT). The kernels never raise and never
allocate: what cannot be decoded gives a status other than ``OK``, what cannot be encoded gives length 0.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from swarmscope._jit import jit, jit_inline
from swarmscope.errors import SwarmscopeError
from swarmscope.geometry import TWO_PI

VERSION = 1
KIND_REQUEST = 1
KIND_FEATURES = 2
KIND_EXACT_FEATURES = 3
"""Features as float32, to measure what quantisation costs; no robot needs it."""
KIND_DIRECTED_REQUEST = 4
"""A request that says in which direction the asker wants to go."""
KIND_LATENT = 5
"""A network's features of what the sender sees in that direction, a byte each."""

MAX_FEATURES = 16
REQUEST_BYTES = 7
DIRECTED_REQUEST_BYTES = 8
MAX_FEATURES_BYTES = 42
"""The longest packet that robots send in earnest: ``10 + 2 * MAX_FEATURES``."""
MAX_PACKET_BYTES = 138
"""Room that any packet fits into: an exact one has ``10 + 8 * MAX_FEATURES`` bytes, a latent one always that many."""
LATENT_FEATURES = 128
"""Features in a LATENT packet, always all of them."""

OK = 0
TOO_SHORT = 1
BAD_VERSION = 2
BAD_KIND = 3
BAD_LENGTH = 4
BAD_CHECKSUM = 5
STATUS_NAMES = ("ok", "too short", "bad version", "bad kind", "bad length", "bad checksum")

HEADER_FIELDS = ("kind", "sender", "seq", "reply_to", "n")
"""What ``decode`` fills in, in this order; -1 where the packet has no such field.

``n`` is the number of features; of a DIRECTED_REQUEST the code of its direction, of a LATENT that of its scale."""

CRC_INIT = 0xFFFF ^ 0x5357
"""Initial value of the checksum: the standard one mixed with 'SW', so that other protocols' packets fail."""
_CRC_POLYNOMIAL = 0x1021
_HEAD = 8
"""Bytes before the angles of a features packet."""
_ANGLE_STEP = TWO_PI / 256.0
_TOO_MANY_TURNS = 1e15
_LONGEST = 3e38


class PacketError(SwarmscopeError):
    """A packet that cannot be packed or unpacked."""

    def __init__(self, why: str) -> None:
        self.why = why
        super().__init__(f"packet: {why}")


def _crc_table() -> np.ndarray:
    """Return the checksum of each single byte (256,)."""
    table = np.zeros(256, np.int64)
    for byte in range(256):
        crc = byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ (_CRC_POLYNOMIAL if crc & 0x8000 else 0)) & 0xFFFF
        table[byte] = crc
    return table


_CRC_TABLE = _crc_table()


@jit
def crc16(data: np.ndarray, length: int, init: int = CRC_INIT) -> int:
    """Return the CRC-16 (polynomial 0x1021, most significant bit first) of the first ``length`` bytes.

    With ``init=0xFFFF`` it is CRC-16/CCITT-FALSE.
    """
    crc = int(init) & 0xFFFF
    for i in range(min(length, data.size)):
        crc = ((crc & 0xFF) << 8) ^ _CRC_TABLE[(crc >> 8) ^ int(data[i])]
    return crc


@jit
def seq_newer(a: int, b: int) -> bool:
    """Tell whether the 16-bit sequence number ``a`` comes after ``b``, wrap-around included (RFC 1982)."""
    return 0 < ((a - b) & 0xFFFF) < 0x8000


@jit_inline
def _put_u16(out: np.ndarray, at: int, value: int) -> None:
    """Write the low 16 bits of ``value``, little-endian."""
    out[at] = value & 0xFF
    out[at + 1] = (value >> 8) & 0xFF


@jit_inline
def _get_u16(data: np.ndarray, at: int) -> int:
    """Read 16 bits, little-endian."""
    return int(data[at]) | (int(data[at + 1]) << 8)


@jit_inline
def _put_f32(out: np.ndarray, at: int, value: float) -> None:
    """Write ``value`` as a little-endian float32."""
    bits = int(np.float32(value).view(np.uint32))
    _put_u16(out, at, bits & 0xFFFF)
    _put_u16(out, at + 2, bits >> 16)


@jit_inline
def _get_f32(data: np.ndarray, at: int) -> float:
    """Read a little-endian float32."""
    return float(np.uint32(_get_u16(data, at) | (_get_u16(data, at + 2) << 16)).view(np.float32))


@jit_inline
def _put_checksum(out: np.ndarray, at: int) -> int:
    """Close the packet with its checksum; return its length."""
    _put_u16(out, at, crc16(out, at, CRC_INIT))
    return at + 2


@jit_inline
def _turns(angle: float) -> float:
    """Return ``angle`` [rad] in turns, in [0, 1); 0 for NaN and infinity."""
    turns = angle / TWO_PI
    if not abs(turns) < _TOO_MANY_TURNS:
        return 0.0
    turns -= math.floor(turns)
    return turns if turns < 1.0 else 0.0


@jit_inline
def _angle_code(angle: float) -> int:
    """Return the nearest of 256 directions."""
    return math.floor(_turns(angle) * 256.0 + 0.5) & 0xFF


@jit_inline
def _distance_code(distance: float, range_max: float) -> int:
    """Return the nearest of 256 distances in [0, range_max]; NaN is 0 (blocked), infinity range_max."""
    if not (range_max > 0.0 and distance > 0.0):
        return 0
    if distance >= range_max:
        return 255
    return math.floor(distance / range_max * 255.0 + 0.5)


@jit_inline
def _angle_of(code: int) -> float:
    """Return the direction [rad] that ``code`` stands for, in [0, 2 pi)."""
    return code * _ANGLE_STEP


@jit_inline
def _distance_of(code: int, range_max: float) -> float:
    """Return the distance [m] that ``code`` stands for; 255 is exactly ``range_max``."""
    return range_max * (code / 255.0)


@jit_inline
def _insert(keys: np.ndarray, values: np.ndarray, count: int, key: float, value: float) -> None:
    """Insert a pair into the first ``count`` pairs, ascending in ``keys``; equal keys keep their order."""
    j = count
    while j > 0 and keys[j - 1] > key:
        keys[j], values[j] = keys[j - 1], values[j - 1]
        j -= 1
    keys[j], values[j] = key, value


@jit_inline
def _usable(n: int, angles: np.ndarray, distances: np.ndarray) -> int:
    """Return how many of ``n`` features fit into a packet and are there at all."""
    return max(0, min(n, MAX_FEATURES, angles.size, distances.size))


@jit_inline
def _put_head(out: np.ndarray, kind: int, sender: int, seq: int) -> None:
    """Write the five bytes that every packet starts with."""
    out[0] = (VERSION << 4) | kind
    _put_u16(out, 1, sender)
    _put_u16(out, 3, seq)


@jit
def encode_request(sender: int, seq: int, out: np.ndarray) -> int:
    """Write a REQUEST into ``out`` uint8; return its length (0 when ``out`` is too small)."""
    if out.size < REQUEST_BYTES:
        return 0
    _put_head(out, KIND_REQUEST, sender, seq)
    return _put_checksum(out, REQUEST_BYTES - 2)


@jit
def encode_directed_request(sender: int, seq: int, direction: float, out: np.ndarray) -> int:
    """Write a DIRECTED_REQUEST into ``out`` uint8; return its length (0 when ``out`` is too small).

    ``direction`` [rad, compass frame] travels as the nearest of 256; NaN and infinity as 0.
    """
    if out.size < DIRECTED_REQUEST_BYTES:
        return 0
    _put_head(out, KIND_DIRECTED_REQUEST, sender, seq)
    out[5] = _angle_code(direction)
    return _put_checksum(out, DIRECTED_REQUEST_BYTES - 2)


@jit
def direction_of(code: int) -> float:
    """Return the direction [rad, compass frame, 0 to 2 pi] that a DIRECTED_REQUEST's ``n`` stands for."""
    return _angle_of(code)


@jit
def encode_latent(
    sender: int, seq: int, reply_to: int, codes: np.ndarray, scale_code: int, out: np.ndarray
) -> int:
    """Write LATENT into ``out`` uint8; return its length (0 when ``out`` or ``codes`` uint8 is too small).

    ``codes`` are signed steps of a scale whose own code is ``scale_code`` (0..255); what both mean is the sender's and
    the receiver's business.
    """
    if out.size < MAX_PACKET_BYTES or codes.size < LATENT_FEATURES:
        return 0
    _put_head(out, KIND_LATENT, sender, seq)
    _put_u16(out, 5, reply_to)
    out[7] = scale_code & 0xFF
    for k in range(LATENT_FEATURES):
        out[_HEAD + k] = codes[k]
    return _put_checksum(out, _HEAD + LATENT_FEATURES)


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
    return int(data[7])


@jit
def encode_features(
    sender: int,
    seq: int,
    reply_to: int,
    angles: np.ndarray,
    distances: np.ndarray,
    n: int,
    range_max: float,
    out: np.ndarray,
) -> int:
    """Write FEATURES into ``out`` uint8; return the length, ``10 + 2 n`` (0 when ``out`` is too small).

    ``angles`` [rad, compass frame] may be in any order and are left as they are; they travel sorted. Of more
    than ``MAX_FEATURES`` the first are sent. Distances are clipped to [0, range_max]; NaN is sent as 0.
    """
    n = _usable(n, angles, distances)
    if out.size < _HEAD + 2 * n + 2:
        return 0
    _put_head(out, KIND_FEATURES, sender, seq)
    _put_u16(out, 5, reply_to)
    out[7] = n
    angle_codes, distance_codes = out[_HEAD : _HEAD + n], out[_HEAD + n : _HEAD + 2 * n]
    for k in range(n):
        distance = _distance_code(distances[k], range_max)
        _insert(angle_codes, distance_codes, k, _angle_code(angles[k]), distance)
    return _put_checksum(out, _HEAD + 2 * n)


@jit
def encode_exact_features(
    sender: int, seq: int, reply_to: int, angles: np.ndarray, distances: np.ndarray, n: int, out: np.ndarray
) -> int:
    """Write the features as float32 pairs, ``10 + 8 n`` bytes: for measuring what quantisation costs.

    As ``encode_features``, except that ``read_features`` clips the distances and sorts.
    """
    n = _usable(n, angles, distances)
    if out.size < _HEAD + 8 * n + 2:
        return 0
    _put_head(out, KIND_EXACT_FEATURES, sender, seq)
    _put_u16(out, 5, reply_to)
    out[7] = n
    for k in range(n):
        distance = distances[k] if distances[k] > 0.0 else 0.0
        _put_f32(out, _HEAD + 4 * k, _turns(angles[k]) * TWO_PI)
        _put_f32(out, _HEAD + 4 * (n + k), min(distance, _LONGEST))
    return _put_checksum(out, _HEAD + 8 * n)


@jit_inline
def is_request(first: int) -> bool:
    """Tell by its first byte whether a packet asks; all others bring features."""
    kind = first & 0xF
    return kind in (KIND_REQUEST, KIND_DIRECTED_REQUEST)


@jit_inline
def _is_list(kind: int) -> bool:
    """Tell whether a packet holds a list of ``n`` features."""
    return kind in (KIND_FEATURES, KIND_EXACT_FEATURES)


@jit_inline
def _packet_bytes(kind: int, n: int) -> int:
    """Return how long a packet of ``kind`` with a list of ``n`` features is."""
    if kind == KIND_REQUEST:
        return REQUEST_BYTES
    if kind == KIND_DIRECTED_REQUEST:
        return DIRECTED_REQUEST_BYTES
    if kind == KIND_LATENT:
        return MAX_PACKET_BYTES
    return _HEAD + 2 + (2 if kind == KIND_FEATURES else 8) * n


@jit_inline
def _check(data: np.ndarray, length: int) -> int:
    """Return the status of a packet: cheap tests first, the checksum last."""
    if length < REQUEST_BYTES or length > data.size:
        return TOO_SHORT
    first = int(data[0])
    if first >> 4 != VERSION:
        return BAD_VERSION
    kind = first & 0xF
    if kind < KIND_REQUEST or kind > KIND_LATENT:
        return BAD_KIND
    if not is_request(first) and length < _HEAD + 2:
        return TOO_SHORT
    n = int(data[7]) if _is_list(kind) else 0
    if n > MAX_FEATURES or length != _packet_bytes(kind, n):
        return BAD_LENGTH
    return OK if crc16(data, length - 2, CRC_INIT) == _get_u16(data, length - 2) else BAD_CHECKSUM


@jit
def decode(data: np.ndarray, length: int, header: np.ndarray) -> int:
    """Check the packet in the first ``length`` bytes of ``data`` uint8; return a status (``STATUS_NAMES``).

    ``header (5,) int64`` receives ``HEADER_FIELDS``; all are -1 unless the status is ``OK``.
    """
    for i in range(5):
        header[i] = -1
    status = _check(data, length)
    if status == OK:
        header[0] = int(data[0]) & 0xF
        header[1] = _get_u16(data, 1)
        header[2] = _get_u16(data, 3)
        if header[0] == KIND_DIRECTED_REQUEST:
            header[4] = int(data[5])
        elif header[0] != KIND_REQUEST:
            header[3] = _get_u16(data, 5)
            header[4] = int(data[7])
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
    if not _is_list(kind):
        return 0
    sent = int(data[7])
    if length != _packet_bytes(kind, sent):
        return 0
    n = _usable(sent, angles, distances)
    for k in range(n):
        if kind == KIND_FEATURES:
            angle = _angle_of(int(data[_HEAD + k]))
            distance = _distance_of(int(data[_HEAD + sent + k]), range_max)
        else:
            angle = _turns(_get_f32(data, _HEAD + 4 * k)) * TWO_PI
            distance = _get_f32(data, _HEAD + 4 * (sent + k))
            distance = min(distance, range_max) if distance > 0.0 else 0.0
        _insert(angles, distances, k, angle, distance)
    return n


@jit
def quantise_features(angles: np.ndarray, distances: np.ndarray, n: int, range_max: float) -> int:
    """Replace the first ``n`` features by what a receiver would read of them; return how many."""
    n = _usable(n, angles, distances)
    for k in range(n):
        angle = _angle_of(_angle_code(angles[k]))
        _insert(angles, distances, k, angle, _distance_of(_distance_code(distances[k], range_max), range_max))
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


@dataclass(frozen=True)
class FeatureMessage:
    """A FEATURES packet in the open, for tools and tests: radians in the compass frame, metres."""

    sender: int
    seq: int
    reply_to: int
    angles: tuple[float, ...]
    distances: tuple[float, ...]

    def pack(self, range_max: float) -> bytes:
        """Return the packet's bytes; raises PacketError when a value does not fit."""
        self._check_values(range_max)
        out = np.zeros(MAX_FEATURES_BYTES, np.uint8)
        angles, distances = np.array(self.angles, np.float64), np.array(self.distances, np.float64)
        length = encode_features(
            self.sender, self.seq, self.reply_to, angles, distances, len(angles), float(range_max), out
        )
        return out[:length].tobytes()

    @classmethod
    def unpack(cls, packet: bytes, range_max: float) -> FeatureMessage:
        """Return the message in ``packet``; raises PacketError unless it is a whole features packet."""
        _check_range(range_max)
        data = np.frombuffer(packet, np.uint8).copy()
        header = np.zeros(len(HEADER_FIELDS), np.int64)
        status = decode(data, data.size, header)
        if status != OK:
            raise PacketError(f"{STATUS_NAMES[status]} ({len(packet)} bytes)")
        kind, sender, seq, reply_to, n = header.tolist()
        if not _is_list(kind):
            raise PacketError("is a request, not features" if is_request(kind) else "holds a network's features")
        angles, distances = np.zeros(n), np.zeros(n)
        read_features(data, data.size, float(range_max), angles, distances)
        return cls(sender, seq, reply_to, tuple(angles.tolist()), tuple(distances.tolist()))

    def _check_values(self, range_max: float) -> None:
        """Raise PacketError for what the kernels would cut, clip or wrap silently."""
        _check_range(range_max)
        for name in ("sender", "seq", "reply_to"):
            if not 0 <= getattr(self, name) <= 0xFFFF:
                raise PacketError(f"{name} = {getattr(self, name)} is not in 0..65535")
        if len(self.angles) != len(self.distances):
            raise PacketError(f"{len(self.angles)} angles but {len(self.distances)} distances")
        if len(self.angles) > MAX_FEATURES:
            raise PacketError(f"{len(self.angles)} features, at most {MAX_FEATURES} fit")
        if not all(math.isfinite(angle) for angle in self.angles):
            raise PacketError("an angle is not a finite number")
        if any(math.isnan(distance) for distance in self.distances):
            raise PacketError("a distance is not a number")


def _check_range(range_max: float) -> None:
    """Raise PacketError unless ``range_max`` can scale distances."""
    if not 0.0 < range_max < math.inf:
        raise PacketError(f"range_max = {range_max} m is not a positive length")
