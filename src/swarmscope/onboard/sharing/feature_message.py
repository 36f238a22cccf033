"""A packet of features in the open, for tools, tests and people."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from swarmscope.errors import SwarmscopeError
from swarmscope.onboard.sharing.message import (
    HEADER_FIELDS,
    MAX_FEATURES,
    MAX_FEATURES_BYTES,
    OK,
    STATUS_NAMES,
    Head,
    decode,
    encode_features,
    is_list,
    is_request,
    read_features,
)


class PacketError(SwarmscopeError):
    """A packet that cannot be packed or unpacked."""

    def __init__(self, why: str) -> None:
        self.why = why
        super().__init__(f"packet: {why}")


@dataclass(frozen=True)
class FeatureMessage:
    """A FEATURES packet in the open, for tools and tests: radians in the compass frame, metres."""

    sender: int
    boot: int
    seq: int
    reply_to: int
    angles: tuple[float, ...]
    distances: tuple[float, ...]

    def pack(self, range_max: float) -> bytes:
        """Return the packet's bytes; raises PacketError when a value does not fit."""
        self._check_values(range_max)
        out = np.zeros(MAX_FEATURES_BYTES, np.uint8)
        angles, distances = np.array(self.angles, np.float64), np.array(self.distances, np.float64)
        head = Head(self.sender, self.boot, self.seq, self.reply_to)
        length = encode_features(head, angles, distances, len(angles), float(range_max), out)
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
        kind, sender, seq, reply_to, n, boot = header.tolist()
        if not is_list(kind):
            raise PacketError("is a request, not features" if is_request(kind) else "holds no list of features")
        angles, distances = np.zeros(n), np.zeros(n)
        read_features(data, data.size, float(range_max), angles, distances)
        return cls(sender, boot, seq, reply_to, tuple(angles.tolist()), tuple(distances.tolist()))

    def _check_values(self, range_max: float) -> None:
        """Raise PacketError for what the kernels would cut, clip or wrap silently."""
        _check_range(range_max)
        for name in ("sender", "boot", "seq", "reply_to"):
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
