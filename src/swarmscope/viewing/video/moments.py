"""A run at any moment, between its ticks, too."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from swarmscope.geometry import TWO_PI
from swarmscope.viewing.run_data import Array, RunData, crash_ticks

Floats = npt.NDArray[np.float64]
FAN_RADII = 6.0
"""Safe directions are drawn up to so many radii of the body."""


class Poses(NamedTuple):
    """All N robots at a moment, world frame [m, rad]."""

    x: Floats
    y: Floats
    yaw: Floats


class Moments:
    """Looks a moment of a run up."""

    def __init__(self, run: RunData) -> None:
        self._of = run.trajectory
        self._crashed = crash_ticks(run.trajectory)
        self._links = run.trajectory.links[np.argsort(run.trajectory.links[:, 0], kind="stable")]
        self._reach = min(float(run.trajectory.range_max_m), FAN_RADII * max(r.radius for r in run.world.robots))
        self.begin_s, self.end_s = float(self._of.t_s[0]), float(self._of.t_s[-1])

    def tick(self, t_s: float) -> int:
        """Return the last tick up to a moment."""
        return max(0, int(np.searchsorted(self._of.t_s, t_s + 1e-9, side="right")) - 1)

    def poses(self, t_s: float) -> Poses:
        """Return where the robots are, on a straight line between two ticks."""
        k, of = self.tick(t_s), self._of
        m = min(k + 1, of.t_s.size - 1)
        share = (t_s - of.t_s[k]) / (of.t_s[m] - of.t_s[k]) if m > k else 0.0
        x, y = (array[k] + (array[m] - array[k]) * share for array in (of.x_m, of.y_m))
        turn = (of.yaw_rad[m] - of.yaw_rad[k] + np.pi) % TWO_PI - np.pi
        return Poses(x, y, of.yaw_rad[k] + turn * share)

    def discs(self, t_s: float) -> Floats:
        """Return (D, 2) where the discs that move are."""
        k, of = self.tick(t_s), self._of
        if not of.disc_xy_m.size:
            return np.zeros((0, 2))
        m = min(k + 1, of.t_s.size - 1)
        share = (t_s - of.t_s[k]) / (of.t_s[m] - of.t_s[k]) if m > k else 0.0
        places: Floats = of.disc_xy_m[k] + (of.disc_xy_m[m] - of.disc_xy_m[k]) * share
        return places

    def closed(self, t_s: float) -> Array:
        """Return (K,) which doors are closed."""
        return self._of.door_closed[self.tick(t_s)] if self._of.door_closed.size else np.zeros(0)

    def arrived(self, t_s: float) -> Array:
        """Return (N,) who has reached its goal; who does with the last tick has then."""
        return np.minimum(self._of.arrival_s, self.end_s) <= t_s + 1e-6  # NaN never is

    def crashed(self, t_s: float) -> Array:
        """Return (N,) who has collided."""
        return self._crashed <= self.tick(t_s)

    def links(self, t_s: float, stay_s: float) -> tuple[Array, Floats]:
        """Return (L, 2) senders and receivers of the packets of the last ``stay_s``, and how old each is, 0 to 1."""
        when = self._of.t_s[self._links[:, 0]]
        first, last = np.searchsorted(when, [t_s - stay_s, t_s + 1e-9], side="right")
        return self._links[first:last, 1:3], (t_s - when[first:last]) / stay_s

    def returns(self, t_s: float) -> Floats:
        """Return (K, 2) the points that the robots' LiDARs see, those of robots under way."""
        k, of = self.tick(t_s), self._of
        if not len(of.scan_u8):
            return np.zeros((0, 2))
        robots, beams = np.nonzero((of.scan_u8[k] != 255) & self._under_way(t_s)[:, None])
        reach = of.scan_u8[k][robots, beams] * (float(of.range_max_m) / 254.0)
        angle = of.yaw_rad[k, robots] + of.beam_angles[beams]
        x, y = of.x_m[k, robots] + reach * np.cos(angle), of.y_m[k, robots] + reach * np.sin(angle)
        return np.column_stack([x, y])

    def fans(self, t_s: float) -> list[Floats]:
        """Return the sectors of safe directions of the robots under way, corners (C, 2) each."""
        k, of = self.tick(t_s), self._of
        if not len(of.safe_bits):
            return []
        safe = np.unpackbits(of.safe_bits[k], axis=1, count=of.beam_angles.size).astype(bool)
        poses = self.poses(t_s)
        fans = []
        for i in np.flatnonzero(self._under_way(t_s)):
            middle = np.array([[poses.x[i], poses.y[i]]])
            for first, last in _runs_of(safe[i]):
                fans.append(np.vstack([middle, middle + self._arc(of.yaw_rad[k, i], first, last)]))
        return fans

    def _arc(self, yaw: float, first: int, last: int) -> Floats:
        angles = self._of.beam_angles
        half = 0.5 * (angles[1] - angles[0]) if angles.size > 1 else 0.0
        turn = yaw + np.append(np.append(angles[first] - half, angles[first : last + 1 : 4]), angles[last] + half)
        return self._reach * np.column_stack([np.cos(turn), np.sin(turn)])

    def _under_way(self, t_s: float) -> Array:
        return ~(self.arrived(t_s) | self.crashed(t_s))


def _runs_of(flags: Array) -> list[tuple[int, int]]:
    """Return first and last index of each run of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]]).astype(np.int8)))
    return [(int(a), int(b) - 1) for a, b in zip(edges[::2], edges[1::2], strict=True)]
