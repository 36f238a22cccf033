"""Where a robot was a moment ago, by its own odometry."""

from __future__ import annotations

from collections import deque

import numpy as np

from swarmscope import geometry
from swarmscope.geometry import Pose

KEPT = 64
"""Ticks that are remembered at most."""
STRAIGHT = 1e-6
"""An arc that turns by less than this [rad] is a line."""

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
        if self._ticks and when_s >= self._ticks[-1][0]:
            return 0.0, 0.0, 0.0
        poses = self.back_over(np.array([when_s]))
        return None if poses is None else (float(poses[0, 0]), float(poses[0, 1]), float(poses[0, 2]))

    def back_over(self, when_s: np.ndarray) -> np.ndarray | None:
        """Return the same for many times (B,), as x, y, yaw (B, 3); yaw does not jump."""
        ticks = self._ticks
        if not ticks:
            return None
        first_s = float(when_s.min())
        if first_s < ticks[0][0] and not (self._first and ticks[0][0] - first_s <= self._before_start_s):
            return None
        now = ticks[-1][1]
        return poses_at(when_s, np.array([t for t, _ in ticks]), np.array([seen_from(now, pose) for _, pose in ticks]))


def poses_at(when_s: np.ndarray, stamps_s: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """Return the poses (B, 3) at ``when_s (B,)`` of a robot that was at ``poses (K, 3)`` at ``stamps_s (K,)``.

    Between two stamps it drove an arc; before the first and after the last it stood.
    """
    if len(stamps_s) < 2:
        return np.repeat(poses[:1], len(when_s), axis=0)
    yaw = np.unwrap(poses[:, 2])
    yaw += poses[-1, 2] - yaw[-1]
    k = np.clip(np.searchsorted(stamps_s, when_s, side="right") - 1, 0, len(stamps_s) - 2)
    lasts = np.maximum(stamps_s[k + 1] - stamps_s[k], 1e-12)
    part = np.clip((when_s - stamps_s[k]) / lasts, 0.0, 1.0)
    turn = yaw[k + 1] - yaw[k]
    straight = np.abs(turn) < STRAIGHT
    half = np.where(straight, 1.0, 0.5 * turn)
    share = np.where(straight, part, np.sin(part * half) / np.sin(half))
    off = np.where(straight, 0.0, (part - 1.0) * half)
    dx, dy = poses[k + 1, 0] - poses[k, 0], poses[k + 1, 1] - poses[k, 1]
    c, s = share * np.cos(off), share * np.sin(off)
    return np.column_stack([poses[k, 0] + c * dx - s * dy, poses[k, 1] + s * dx + c * dy, yaw[k] + part * turn])
