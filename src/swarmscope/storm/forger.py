"""An adversary on the air: it hears everything and throws what it likes at whom it likes."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np

from swarmscope._jit import jit_alloc
from swarmscope.held import Held
from swarmscope.onboard.sharing.codes import put_checksum, put_u16
from swarmscope.onboard.sharing.message import (
    KIND_CLOSED,
    MAX_CORNERS,
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
from swarmscope.onboard.sharing.way_message import FRAMES, Place, encode_check, encode_closed
from swarmscope.sim.radio import throw_all
from swarmscope.sim.state import Sim

KINDS = ("rubbish", "broken", "replayed", "forged", "answers")
"""Random bytes; what was heard, with flipped bits or cut; what was heard, now or long ago, to anybody; packets with a
right checksum and anything in them; lies in answer to real requests, in the name of whom was asked or of anybody."""
RUBBISH, BROKEN, REPLAYED, FORGED, ANSWERS = range(len(KINDS))
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


class Heard(NamedTuple):
    """The newest packets that were on the air, a ring of `REMEMBERED`."""

    sender: np.ndarray
    asked: np.ndarray
    """Whom each was for."""
    length: np.ndarray
    data: np.ndarray
    total: np.ndarray
    """(1,): how many there ever were."""


def _nothing_heard() -> Heard:
    sender, asked, length = (np.zeros(REMEMBERED, np.int64) for _ in range(3))
    return Heard(sender, asked, length, np.zeros((REMEMBERED, MAX_PACKET_BYTES), np.uint8), np.zeros(1, np.int64))


class Attack:
    """A forger at work in one run."""

    def __init__(self, forger: Forger) -> None:
        self.forger = forger
        self.thrown = 0
        self._rng = np.random.default_rng(forger.seed)
        self._kinds = np.array([KINDS.index(kind) for kind in forger.kinds])
        self._heard = _nothing_heard()

    def strike(self, held: Held[Sim], tick: int) -> None:
        """Hear what is being sent, then throw."""
        sim = held.what
        to, length, data = prepare(
            self._rng, float(self.forger.per_tick), self._kinds, sim.decisions, sim.percepts, self._heard
        )
        if to.size > 0:
            self.thrown += throw_all(held, tick, to, data, length)


@jit_alloc
def prepare(
    rng: np.random.Generator,
    per_tick: float,
    kinds: np.ndarray,
    decisions: np.ndarray,
    percepts: np.ndarray,
    heard: Heard,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Hear what is being sent; return this tick's packets: whom they are for (K,), their lengths, their bytes.

    Numba draws the same numbers from a generator as NumPy does (tests/storm/test_forger.py).
    """
    _hear(decisions, heard)
    count = int(rng.poisson(per_tick))
    to, length = np.zeros(count, np.int64), np.zeros(count, np.int64)
    data = np.zeros((count, MAX_PACKET_BYTES), np.uint8)
    for k in range(count):
        kind = kinds[int(rng.integers(0, kinds.size))]
        to[k], length[k] = _packet(rng, kind, percepts, heard, data[k])
    return to, length, data


@jit_alloc
def _hear(decisions: np.ndarray, heard: Heard) -> None:
    """Keep what is being sent."""
    for i in range(decisions.size):
        decision = decisions[i]
        for k in range(decision["n_out"]):
            length = decision["out_length"][k]
            if length <= 0:
                continue
            at = heard.total[0] % REMEMBERED
            heard.sender[at], heard.asked[at], heard.length[at] = i, decision["out_to"][k], length
            for b in range(length):
                heard.data[at, b] = decision["out"][k, b]
            heard.total[0] += 1


@jit_alloc
def _packet(
    rng: np.random.Generator, kind: int, percepts: np.ndarray, heard: Heard, out: np.ndarray
) -> tuple[int, int]:
    """Write a packet into ``out``; return whom it is for and its length."""
    to = int(rng.integers(0, percepts.size))
    if kind == FORGED:
        return to, _forged(rng, _head(rng, percepts, to), out)
    known = min(REMEMBERED, heard.total[0])
    if kind == RUBBISH or known == 0:
        length = int(rng.integers(0, MAX_PACKET_BYTES + 1))
        out[:length] = rng.integers(0, 256, length, np.uint8)
        return to, length
    at = (heard.total[0] - known + int(rng.integers(0, known))) % REMEMBERED
    sender, asked, length, packet = heard.sender[at], heard.asked[at], heard.length[at], heard.data[at]
    if asked < 0:  # everybody was
        asked = int(rng.integers(0, percepts.size))
    if kind == ANSWERS and is_request(int(packet[0])):
        boot, seq = int(packet[3]) | int(packet[4]) << 8, int(packet[5]) | int(packet[6]) << 8
        liar = _head(rng, percepts, sender)
        name = asked if rng.random() < 0.7 else liar.sender
        return sender, _answer(rng, Head(name, liar.boot, liar.seq, name_of(boot, seq)), out)
    out[:length] = packet[:length]
    if kind == BROKEN:
        for at in rng.integers(0, length, int(rng.integers(1, 5))):
            out[at] ^= np.uint8(1 << int(rng.integers(0, 8)))
        if rng.random() < 0.3:
            length = int(rng.integers(0, length))
    return to if rng.random() < 0.5 else asked, length  # whom it was for may be nobody, who was made up


@jit_alloc
def _head(rng: np.random.Generator, percepts: np.ndarray, to: int) -> Head:
    """Return a header: of a robot with its real boot number, or of nobody."""
    robots = percepts.size
    sender = int(rng.integers(0, robots)) if rng.random() < 0.8 else int(rng.integers(0, 65536))
    sender = to if rng.random() < 0.05 else sender
    known = sender < robots and rng.random() < 0.7
    boot = int(percepts[sender]["boot"]) if known else int(rng.integers(0, 65536))
    return Head(sender, boot, int(rng.integers(0, 65536)), int(rng.integers(0, 65536)))


@jit_alloc
def _forged(rng: np.random.Generator, head: Head, out: np.ndarray) -> int:
    """Write any packet with a right checksum; return its length."""
    kind = int(rng.integers(0, 7))
    if kind == 6:
        corners = rng.uniform(-LONG, LONG, (MAX_CORNERS, 2))
        return encode_check(head, _place(rng), corners, int(rng.integers(0, MAX_CORNERS + 1)), out)
    if kind == 0:
        return encode_request(head, out)
    if kind == 1:
        return encode_directed_request(head, rng.uniform(-10.0, 10.0), out)
    if kind == 2:  # a right checksum under anything
        out[:] = rng.integers(0, 256, MAX_PACKET_BYTES, np.uint8)
        out[0] = (VERSION << 4) | int(rng.integers(0, KIND_CLOSED + 2))
        return put_checksum(out, int(rng.integers(7, MAX_PACKET_BYTES - 1)))
    return _answer(rng, head, out)


@jit_alloc
def _place(rng: np.random.Generator) -> Place:
    """Return a place near where robots' frames begin, for that is where most say that they are."""
    names = 3 if rng.random() < 0.5 else FRAMES  # the lowest win
    return Place(rng.uniform(-LONG, LONG), rng.uniform(-LONG, LONG), int(rng.integers(0, names)))


@jit_alloc
def _walls(rng: np.random.Generator, head: Head, out: np.ndarray) -> int:
    """Write that a way is closed, by walls that wind about; return its length."""
    place = _place(rng)
    cells = np.zeros((MAX_PACKET_BYTES, 2), np.int64)
    for k in range(cells.shape[0]):
        if k == 0 or rng.random() < 0.05:
            dx, dy = int(rng.integers(-90, 91)), int(rng.integers(-90, 91))
            step_x, step_y = int(rng.integers(-4, 5)), int(rng.integers(-4, 5))
        dx, dy = dx + step_x, dy + step_y
        cells[k, 0], cells[k, 1] = dx, dy
    return encode_closed(head, place, cells, cells.shape[0], out, MAX_PACKET_BYTES)


@jit_alloc
def _answer(rng: np.random.Generator, head: Head, out: np.ndarray) -> int:
    """Write an answer with lies in it; return its length."""
    kind, n = int(rng.integers(0, 4)), int(rng.integers(0, MAX_FEATURES + 1))
    if kind == 3:
        return _walls(rng, head, out)
    if kind == 0:
        codes = rng.integers(0, 256, 128, np.uint8)
        return encode_latent(head, codes, int(rng.integers(0, 256)), out)
    if kind == 1:
        angles, distances = rng.uniform(0.0, 7.0, n), rng.uniform(0.0, LONG, n)
        return encode_features(head, angles, distances, n, LONG, out)
    out[0] = (VERSION << 4) | 3  # exact features, of any bits: NaN, infinity, negative ones
    put_u16(out, 1, head.sender)
    put_u16(out, 3, head.boot)
    put_u16(out, 5, head.seq)
    put_u16(out, 7, head.reply_to)
    out[9] = n
    out[10 : 10 + 8 * n] = rng.integers(0, 256, 8 * n, np.uint8)
    return put_checksum(out, 10 + 8 * n)
