"""Where a robot was a moment ago, by its own odometry."""

from __future__ import annotations

from collections import deque

from swarmscope import geometry
from swarmscope.geometry import Pose
from swarmscope.onboard.edge import angle

KEPT = 64
"""Ticks that are remembered at most."""

then = getattr(geometry.then, "py_func", geometry.then)
seen_from = getattr(geometry.seen_from, "py_func", geometry.seen_from)


class Trail:
    """Poses at past ticks, in the frame of the first."""

    def __init__(self, keep_s: float, before_start_s: float) -> None:
        self._keep_s, self._before_start_s = keep_s, before_start_s
        self._ticks: deque[tuple[float, Pose]] = deque(maxlen=KEPT)
        self._first = True

    def forget(self) -> None:
        """Forget everything: the motion of this tick, or the clock, is not known."""
        self._ticks.clear()
        self._first = False

    def add(self, now_s: float, moved: Pose) -> None:
        """Note that the robot has ``moved`` since the last tick (in its body frame of then)."""
        ticks = self._ticks
        ticks.append((now_s, then(ticks[-1][1], moved) if ticks else (0.0, 0.0, 0.0)))
        while len(ticks) > 2 and now_s - ticks[1][0] > self._keep_s:
            ticks.popleft()
            self._first = False

    def back_to(self, when_s: float) -> Pose | None:
        """Return where the body was at ``when_s``, seen from where it is now; None when that is not known.

        Before its very first tick a robot stood still, for up to ``before_start_s``.
        """
        ticks = self._ticks
        if not ticks:
            return None
        if when_s >= ticks[-1][0]:
            return 0.0, 0.0, 0.0
        if when_s < ticks[0][0]:
            known = self._first and ticks[0][0] - when_s <= self._before_start_s
            return seen_from(ticks[-1][1], ticks[0][1]) if known else None
        k = len(ticks) - 2
        while ticks[k][0] > when_s:
            k -= 1
        (t0, a), (t1, b) = ticks[k], ticks[k + 1]
        part = (when_s - t0) / (t1 - t0)
        old = a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1]), a[2] + part * angle(b[2] - a[2])
        return seen_from(ticks[-1][1], old)
