"""An adversary on the air: it hears everything and throws what it likes at whom it likes."""

from __future__ import annotations

from collections import deque
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from swarmscope.onboard.sharing.codes import put_checksum, put_u16
from swarmscope.onboard.sharing.message import (
    KIND_LATENT,
    MAX_FEATURES,
    MAX_PACKET_BYTES,
    VERSION,
    Head,
    encode_directed_request,
    encode_features,
    encode_latent,
    encode_request,
    is_request,
    name_of,
)
from swarmscope.sim.radio import throw
from swarmscope.sim.state import Sim

KINDS = ("rubbish", "broken", "replayed", "forged", "answers")
"""Random bytes; what was heard, with flipped bits or cut; what was heard, now or long ago, to anybody; packets with a
right checksum and anything in them; lies in answer to real requests, in the name of whom was asked or of anybody."""
REMEMBERED = 256
"""Packets that it can throw again."""
LONG = 20.0
"""Distances that it claims go up to this [m]."""


@dataclass(frozen=True)
class Forger:
    """Who throws packets: all that it does follows from these."""

    seed: int
    per_tick: float
    """Packets in a tick, on average."""
    kinds: tuple[str, ...] = KINDS

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        return asdict(self) | {"kinds": list(self.kinds)}


class Attack:
    """A forger at work in one run."""

    def __init__(self, forger: Forger) -> None:
        self.forger = forger
        self.thrown = 0
        self._rng = np.random.default_rng(forger.seed)
        self._heard: deque[tuple[int, int, bytes]] = deque(maxlen=REMEMBERED)

    def strike(self, sim: Sim, tick: int) -> None:
        """Hear what is being sent, then throw."""
        for i in np.flatnonzero(sim.decisions["n_out"]).tolist():
            decision = sim.decisions[i]
            for k in range(int(decision["n_out"])):
                packet = decision["out"][k, : decision["out_length"][k]].tobytes()
                if packet:
                    self._heard.append((i, int(decision["out_to"][k]), packet))
        for _ in range(int(self._rng.poisson(self.forger.per_tick))):
            kind = self.forger.kinds[int(self._rng.integers(len(self.forger.kinds)))]
            to, packet = self._packet(kind, sim)
            data = np.zeros(MAX_PACKET_BYTES, np.uint8)
            length = min(len(packet), MAX_PACKET_BYTES)
            data[:length] = packet[:length]
            self.thrown += int(throw(sim, tick, to, data, length))

    def _packet(self, kind: str, sim: Sim) -> tuple[int, np.ndarray]:
        """Return a packet and whom it is for."""
        rng, robots = self._rng, sim.robots.size
        to = int(rng.integers(robots))
        if kind == "forged":
            return to, self._forged(self._head(sim, to))
        if kind == "rubbish" or not self._heard:
            return to, rng.integers(0, 256, int(rng.integers(0, MAX_PACKET_BYTES + 1)), dtype=np.uint8)
        sender, asked, packet = self._heard[int(rng.integers(len(self._heard)))]
        data = np.frombuffer(packet, np.uint8).copy()
        if kind == "answers" and is_request(int(data[0])):
            boot, seq = int(data[3]) | int(data[4]) << 8, int(data[5]) | int(data[6]) << 8
            head = self._head(sim, sender)._replace(reply_to=name_of(boot, seq))
            if rng.random() < 0.7:
                head = head._replace(sender=asked)
            return sender, self._answer(head)
        if kind == "broken":
            for at in rng.integers(0, data.size, int(rng.integers(1, 5))):
                data[at] ^= np.uint8(1 << int(rng.integers(8)))
            if rng.random() < 0.3:
                data = data[: int(rng.integers(0, data.size))]
        return to if rng.random() < 0.5 else asked, data  # whom it was for may be nobody, who was made up

    def _head(self, sim: Sim, to: int) -> Head:
        """Return a header: of a robot with its real boot number, or of nobody."""
        rng = self._rng
        sender = int(rng.integers(sim.robots.size)) if rng.random() < 0.8 else int(rng.integers(65536))
        sender = to if rng.random() < 0.05 else sender
        known = sender < sim.robots.size and rng.random() < 0.7
        boot = int(sim.percepts[sender]["boot"]) if known else int(rng.integers(65536))
        return Head(sender, boot, int(rng.integers(65536)), int(rng.integers(65536)))

    def _forged(self, head: Head) -> np.ndarray:
        """Return any packet with a right checksum."""
        rng, out = self._rng, np.zeros(MAX_PACKET_BYTES, np.uint8)
        kind = int(rng.integers(6))
        if kind == 0:
            return out[: encode_request(head, out)]
        if kind == 1:
            return out[: encode_directed_request(head, rng.uniform(-10.0, 10.0), out)]
        if kind == 2:  # a right checksum under anything
            out[:] = rng.integers(0, 256, MAX_PACKET_BYTES, dtype=np.uint8)
            out[0] = (VERSION << 4) | int(rng.integers(KIND_LATENT + 2))
            return out[: put_checksum(out, int(rng.integers(7, MAX_PACKET_BYTES - 1)))]
        return self._answer(head)

    def _answer(self, head: Head) -> np.ndarray:
        """Return an answer with lies in it."""
        rng, out = self._rng, np.zeros(MAX_PACKET_BYTES, np.uint8)
        kind, n = int(rng.integers(3)), int(rng.integers(MAX_FEATURES + 1))
        if kind == 0:
            codes = rng.integers(0, 256, 128, dtype=np.uint8)
            return out[: encode_latent(head, codes, int(rng.integers(256)), out)]
        if kind == 1:
            angles, distances = rng.uniform(0.0, 7.0, n), rng.uniform(0.0, LONG, n)
            return out[: encode_features(head, angles, distances, n, LONG, out)]
        out[0] = (VERSION << 4) | 3  # exact features, of any bits: NaN, infinity, negative ones
        for at, value in zip((1, 3, 5, 7), head, strict=True):
            put_u16(out, at, value)
        out[9] = n
        out[10 : 10 + 8 * n] = rng.integers(0, 256, 8 * n, dtype=np.uint8)
        return out[: put_checksum(out, 10 + 8 * n)]
