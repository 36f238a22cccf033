"""Where what a robot is handed becomes what its kernels are given: converted if it can be, else refused with a reason.

Nothing here trusts anything: values may be missing, NaN, of any type or size. The work is bounded, too.
"""

from __future__ import annotations

import math
import operator
from collections import Counter, deque
from collections.abc import Sequence
from itertools import islice
from typing import Any, NamedTuple

import numpy as np

from swarmscope.geometry import TWO_PI
from swarmscope.onboard.percept import MAX_INBOX, MAX_NEIGHBOURS
from swarmscope.onboard.sharing.message import MAX_PACKET_BYTES

ADDRESSES = 65536
LOOKED_AT = 1000
"""Longer lists of neighbours are refused, of packets cut."""
WAITING = 32
"""Packets that wait for later ticks."""
FARTHEST_M = 1000.0
"""No neighbour is seen from farther away."""
GOAL_M = 1e6
SIDEWAYS = 3.0
"""Speeds beyond this many times the top speed and 1 m/s are no measurements."""


class Seen(NamedTuple):
    """A neighbour that mutual positioning sees: body frame, x forward, y left [m], from our centre to its centre."""

    address: int
    """Its radio address, 0 to 65535."""
    x: float
    y: float
    yaw: float = 0.0
    """Its heading relative to ours [rad]."""
    speed: float | None = None
    """Its speed [m/s] if known; kept, no planner uses it yet."""
    radius_m: float | None = None
    """Its radius; None = like ours. A larger one is told to planners as nearer, so that its surface is right."""


class Unusable(Exception):
    """An input that cannot be used: ``kind`` is counted, ``why`` is said."""

    def __init__(self, kind: str, why: str) -> None:
        super().__init__(why)
        self.kind, self.why = kind, why


def number(value: Any) -> float:
    """Return ``value`` as a float, NaN for what is no number."""
    if type(value) is float:
        return value
    try:
        if isinstance(value, str | bytes | bytearray) or getattr(value, "ndim", 0) != 0:
            return math.nan
        return float(value)
    except Exception:  # whatever a stranger's __float__ raises
        return math.nan


def numbers(value: Any, count: int, kind: str, why: str) -> tuple[float, ...]:
    """Return ``count`` finite numbers; raises Unusable."""
    try:
        found = tuple(map(number, islice(iter(value), count + 1)))
    except Exception:
        found = ()
    if len(found) != count or not all(map(math.isfinite, found)):
        raise Unusable(kind, f"{why}, not {short(value)}")
    return found


def one_number(value: Any, kind: str, why: str) -> float:
    """Return a finite number; raises Unusable."""
    found = number(value)
    if not math.isfinite(found):
        raise Unusable(kind, f"{why}, not {short(value)}")
    return found


def short(value: Any) -> str:
    """Return ``value`` in at most a few words."""
    if value is None or isinstance(value, int | float):
        return "None" if value is None else f"{number(value):g}"
    if isinstance(value, tuple) and len(value) <= 3 and all(isinstance(v, int | float) for v in value):
        return "(" + ", ".join(f"{number(v):g}" for v in value) + ")"
    return f"a {type(value).__name__}"


def angle(value: float) -> float:
    """Return a finite angle [rad] within [-pi, pi]; equal values stay the same to the last bit."""
    return value if -math.pi <= value <= math.pi else math.remainder(value, TWO_PI)


def fastest(v_max: float) -> float:
    """Return the largest speed [m/s] that a robot with top speed ``v_max`` can have measured."""
    return SIDEWAYS * v_max + 1.0


def nearest_neighbours(found: Any, own: int, radius: float, faults: Counter[str]) -> list[Seen]:
    """Return the nearest MAX_NEIGHBOURS, nearest first, one of each address and never ourselves.

    Raises Unusable for what is no neighbour. Larger ones than ``radius`` [m] are moved nearer by the difference.
    """
    if found is None:
        return []
    try:
        entries = list(islice(iter(found), LOOKED_AT + 1))
    except Exception:
        raise Unusable("neighbours", f"neighbours must be a list of Seen, not {short(found)}") from None
    if len(entries) > LOOKED_AT:
        raise Unusable("neighbours", f"more than {LOOKED_AT} neighbours")
    kept: dict[int, tuple[float, Seen]] = {}
    for entry in entries:
        seen = _seen(entry)
        distance = math.hypot(seen.x, seen.y)
        if seen.address == own:
            faults["own address seen"] += 1
            continue
        if seen.address in kept:
            faults["neighbour twice"] += 1
            if kept[seen.address][0] <= distance:
                continue
        kept[seen.address] = distance, seen
    nearest = sorted(kept.values(), key=operator.itemgetter(0))[:MAX_NEIGHBOURS]
    return [_as_large_as_us(seen, distance, radius) for distance, seen in nearest]


def _seen(entry: Any) -> Seen:
    """Return a neighbour with plain, finite numbers; raises Unusable."""
    try:
        seen = entry if isinstance(entry, Seen) else Seen(*entry)
        address = operator.index(seen.address)
    except Exception:
        raise Unusable("neighbours", f"a neighbour must be a Seen(address, x, y, yaw), not {short(entry)}") from None
    x, y, yaw = number(seen.x), number(seen.y), number(seen.yaw)
    speed = 0.0 if seen.speed is None else number(seen.speed)
    radius = 0.0 if seen.radius_m is None else number(seen.radius_m)
    if not 0 <= address < ADDRESSES:
        raise Unusable("neighbours", f"a neighbour's address is not in 0..{ADDRESSES - 1}")
    if not (abs(x) <= FARTHEST_M and abs(y) <= FARTHEST_M and math.isfinite(yaw)):
        raise Unusable("neighbours", f"neighbour {address} is at no place: x {x:g}, y {y:g}, yaw {yaw:g}")
    if not (math.isfinite(speed) and 0.0 <= radius <= FARTHEST_M):
        raise Unusable("neighbours", f"neighbour {address} has speed {speed:g} m/s, radius {radius:g} m")
    return Seen(address, x, y, angle(yaw), None if seen.speed is None else speed, radius or None)


def _as_large_as_us(seen: Seen, distance: float, radius: float) -> Seen:
    """Return a larger neighbour moved towards us so that a disc of our ``radius`` has its nearest surface."""
    excess = (seen.radius_m or 0.0) - radius
    if excess <= 0.0 or distance <= 0.0:
        return seen
    nearer = max(distance - excess, 0.1 * min(radius, distance)) / distance
    return seen._replace(x=seen.x * nearer, y=seen.y * nearer)


class Mail:
    """Packets that have come in, oldest first, and wait to be read."""

    def __init__(self) -> None:
        self._waiting: deque[bytes] = deque()

    def put(self, packets: Any, faults: Counter[str]) -> None:
        """Queue packets, as bytes or as (address, bytes); count what is none and what has no room."""
        if packets is None:
            return
        try:
            entries = list(islice(iter(packets), LOOKED_AT + 1))
        except Exception:
            faults["packets"] += 1
            return
        for entry in entries:
            packet = _bytes(entry)
            if packet is None:
                faults["packets"] += 1
            elif len(self._waiting) >= WAITING:
                faults["packets without room"] += 1
            else:
                self._waiting.append(packet)

    def take(self) -> list[bytes]:
        """Return the packets of this tick, at most MAX_INBOX."""
        waiting = self._waiting
        return [waiting.popleft() for _ in range(min(MAX_INBOX, len(waiting)))]


def _bytes(entry: Any) -> bytes | None:
    """Return a packet's bytes, None for what is none or does not fit."""
    if isinstance(entry, tuple) and len(entry) == 2:
        entry = entry[1]
    if isinstance(entry, np.ndarray):
        if entry.dtype != np.uint8 or entry.ndim != 1 or entry.size > MAX_PACKET_BYTES:
            return None
        entry = entry.tobytes()
    if not isinstance(entry, bytes | bytearray | memoryview) or not 0 < len(entry) <= MAX_PACKET_BYTES:
        return None
    try:
        packet = bytes(entry)
    except Exception:
        return None
    return packet if len(packet) <= MAX_PACKET_BYTES else None


def readings(scan: Any, kind: str = "scan") -> np.ndarray:
    """Return a scan's readings as a one-dimensional array of numbers; raises Unusable."""
    if type(scan) is np.ndarray:
        values = scan
    else:
        if not isinstance(scan, Sequence) and not hasattr(scan, "__len__"):
            raise Unusable(kind, f"a scan must be a list or an array of ranges [m], not {short(scan)}")
        try:
            values = np.asarray(scan.filled(np.nan) if hasattr(scan, "filled") else scan)
        except Exception:
            raise Unusable(kind, "the scan holds something that is no number") from None
    if values.ndim != 1 or values.dtype.kind not in "fiu":
        raise Unusable(kind, f"the scan is {values.ndim}-dimensional {values.dtype}, not a row of numbers")
    return values
