"""Numbers as bytes: words, angles, distances, the checksum. Never raises, never allocates."""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline
from swarmscope.geometry import TWO_PI

CRC_INIT = 0xFFFF ^ 0x5357
"""Initial value of the checksum: the standard one mixed with 'SW', so that other protocols' packets fail."""
_CRC_POLYNOMIAL = 0x1021
_ANGLE_STEP = TWO_PI / 256.0
_TOO_MANY_TURNS = 1e15


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
_CRC_TABLE_2 = ((_CRC_TABLE & 0xFF) << 8) ^ _CRC_TABLE[_CRC_TABLE >> 8]
"""The checksum of each byte and a zero after it: two bytes are taken at a time, which halves the waiting."""


@jit
def crc16(data: np.ndarray, length: int, init: int = CRC_INIT) -> int:
    """Return the CRC-16 (polynomial 0x1021, most significant bit first) of the first ``length`` bytes.

    With ``init=0xFFFF`` it is CRC-16/CCITT-FALSE.
    """
    crc = int(init) & 0xFFFF
    n = max(0, min(length, data.size))
    for i in range(0, n - 1, 2):
        crc = _CRC_TABLE_2[(crc >> 8) ^ int(data[i])] ^ _CRC_TABLE[(crc & 0xFF) ^ int(data[i + 1])]
    if n & 1:
        crc = ((crc & 0xFF) << 8) ^ _CRC_TABLE[(crc >> 8) ^ int(data[n - 1])]
    return crc


@jit_inline
def put_u16(out: np.ndarray, at: int, value: int) -> None:
    """Write the low 16 bits of ``value``, little-endian."""
    out[at] = value & 0xFF
    out[at + 1] = (value >> 8) & 0xFF


@jit_inline
def get_u16(data: np.ndarray, at: int) -> int:
    """Read 16 bits, little-endian."""
    return int(data[at]) | (int(data[at + 1]) << 8)


@jit_inline
def put_f32(out: np.ndarray, at: int, value: float) -> None:
    """Write ``value`` as a little-endian float32."""
    bits = int(np.float32(value).view(np.uint32))
    put_u16(out, at, bits & 0xFFFF)
    put_u16(out, at + 2, bits >> 16)


@jit_inline
def get_f32(data: np.ndarray, at: int) -> float:
    """Read a little-endian float32."""
    return float(np.uint32(get_u16(data, at) | (get_u16(data, at + 2) << 16)).view(np.float32))


@jit_inline
def put_checksum(out: np.ndarray, at: int) -> int:
    """Close the packet with its checksum; return its length."""
    put_u16(out, at, crc16(out, at, CRC_INIT))
    return at + 2


@jit_inline
def turns(angle: float) -> float:
    """Return ``angle`` [rad] in turns, in [0, 1); 0 for NaN and infinity."""
    part = angle / TWO_PI
    if not abs(part) < _TOO_MANY_TURNS:
        return 0.0
    part -= math.floor(part)
    return part if part < 1.0 else 0.0


@jit_inline
def angle_code(angle: float) -> int:
    """Return the nearest of 256 directions."""
    return math.floor(turns(angle) * 256.0 + 0.5) & 0xFF


@jit_inline
def distance_code(distance: float, range_max: float) -> int:
    """Return the nearest of 256 distances in [0, range_max]; NaN is 0 (blocked), infinity range_max."""
    if not (range_max > 0.0 and distance > 0.0):
        return 0
    if distance >= range_max:
        return 255
    return math.floor(distance / range_max * 255.0 + 0.5)


@jit_inline
def angle_of(code: int) -> float:
    """Return the direction [rad] that ``code`` stands for, in [0, 2 pi)."""
    return code * _ANGLE_STEP


@jit_inline
def distance_of(code: int, range_max: float) -> float:
    """Return the distance [m] that ``code`` stands for; 255 is exactly ``range_max``."""
    return range_max * (code / 255.0)


@jit_inline
def insert(keys: np.ndarray, values: np.ndarray, count: int, key: float, value: float) -> None:
    """Insert a pair into the first ``count`` pairs, ascending in ``keys``; equal keys keep their order."""
    j = count
    while j > 0 and keys[j - 1] > key:
        keys[j], values[j] = keys[j - 1], values[j - 1]
        j -= 1
    keys[j], values[j] = key, value
