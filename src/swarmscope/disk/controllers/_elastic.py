"""Makes a plan shorter as a whole: all ways are elastic bands in space and time that push each other aside.

A plan is the row of points of each robot at common times; between them all move straight. What lies between two
times lasts as long as the robot with the longest way there needs, so that a plan takes

    T = (1 / step) sum_k max_i |x_i,k+1 - x_i,k|   [steps]

and can be made shorter by moving points only. Sweeps of position-based dynamics do that: bands pull where they are
longer than the least known time allows, then robots and obstacles push away what is too near.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inner
from swarmscope.disk.contact import nearest_on_the_way
from swarmscope.disk.rules import Floats, Ints

LISTED_FOR = 25
"""Sweeps for which a list of who is near whom is used."""
PATIENCE, WORTH = 500, 1e-4
"""A plan that has not become shorter by that part in so many sweeps is left as it is."""


class Bands(NamedTuple):
    """Points of all robots, and what they have to keep to."""

    point: Floats
    """(n, times, 2)."""
    goal: Floats
    """(n, 2)."""
    disc: Floats
    """(m, 3) obstacles."""
    tol: float
    r: float
    apart: float
    """Least distance of two robots."""
    clear: float
    """Least gap to obstacles."""
    over: float
    """How much more than that is aimed at."""


class Near(NamedTuple):
    """Pairs that may touch."""

    robots: Ints
    """(room, 3): robot, robot, time."""
    discs: Ints
    """(room, 3): robot, obstacle, time."""


def resampled(tracks: Sequence[Floats], times: Floats, count: int) -> Floats:
    """Return the points (n, count, 2) at equal times of tracks (ticks, 2) at ``times``; who has arrived stays."""
    wanted = np.linspace(0.0, times[-1], count)
    out = np.empty((len(tracks), count, 2))
    for i, track in enumerate(tracks):
        for axis in range(2):
            out[i, :, axis] = np.interp(wanted, times[: len(track)], track[:, axis])
    return out


def relax(bands: Bands, longest: float, sweeps: int) -> tuple[Floats, float]:
    """Return the best points found, and the length T step of the plan; infinity if none was free of contacts.

    Args:
        bands: where to begin; its points are moved.
        longest: what the bands pull for: the length of the longest of the shortest ways.
        sweeps: how many.
    """
    n, times = bands.point.shape[:2]
    room = 12 * n * times
    near = Near(np.empty((room, 3), dtype=np.int64), np.empty((room, 3), dtype=np.int64))
    best = bands.point.copy()
    length = _relax(bands, near, longest / (times - 1), sweeps, best)
    return best, length


@jit
def _relax(bands: Bands, near: Near, piece: float, sweeps: int, best: Floats) -> float:
    least = before = math.inf
    robots = discs = 0
    for sweep in range(sweeps):
        if sweep % LISTED_FOR == 0:
            robots, discs = _list_near(bands, near)
        _pull(bands, piece)
        _push(bands, near, robots, discs)
        if sweep % LISTED_FOR == LISTED_FOR - 1:
            for _ in range(3):
                _push(bands, near, robots, discs)
            length = total_length(bands.point)
            if length < least and is_free(bands):
                least = length
                for i in range(best.shape[0]):
                    for k in range(best.shape[1]):
                        best[i, k, 0], best[i, k, 1] = bands.point[i, k, 0], bands.point[i, k, 1]
            if least <= piece * (best.shape[1] - 1):
                break
        if sweep % PATIENCE == PATIENCE - 1:
            if least > before * (1.0 - WORTH):
                break
            before = least
    return least


@jit
def total_length(point: Floats) -> float:
    """Return the sum over times of the longest way of any robot."""
    total = 0.0
    for k in range(point.shape[1] - 1):
        longest = 0.0
        for i in range(point.shape[0]):
            ux, uy = point[i, k + 1, 0] - point[i, k, 0], point[i, k + 1, 1] - point[i, k, 1]
            longest = max(longest, ux * ux + uy * uy)
        total += math.sqrt(longest)
    return total


@jit
def is_free(bands: Bands) -> bool:
    """Return whether nobody comes too near to anything, and all end within tol of their goals."""
    point, n, times = bands.point, bands.point.shape[0], bands.point.shape[1]
    for i in range(n):
        for k in range(times):
            x, y = point[i, k, 0], point[i, k, 1]
            if k > 0 and x * x + y * y > 1.0:
                return False
            if k + 1 == times:
                gx, gy = x - bands.goal[i, 0], y - bands.goal[i, 1]
                if gx * gx + gy * gy > bands.tol * bands.tol:
                    return False
                continue
            ax, ay = point[i, k + 1, 0], point[i, k + 1, 1]
            for m in range(len(bands.disc)):
                cx, cy = bands.disc[m, 0], bands.disc[m, 1]
                reach = bands.disc[m, 2] + bands.r + bands.clear
                if nearest_on_the_way(x - cx, y - cy, ax - cx, ay - cy) <= reach:
                    return False
            for j in range(i):
                px, py = x - point[j, k, 0], y - point[j, k, 1]
                qx, qy = ax - point[j, k + 1, 0], ay - point[j, k + 1, 1]
                if nearest_on_the_way(px, py, qx, qy) <= bands.apart:
                    return False
    return True


@jit
def _list_near(bands: Bands, near: Near) -> tuple[int, int]:
    """List who is within a few pieces of touching; return how many pairs of robots, and with obstacles."""
    point, n, times = bands.point, bands.point.shape[0], bands.point.shape[1]
    robots = discs = 0
    slack = 0.5 * bands.apart
    for k in range(times - 1):
        for i in range(n):
            x, y = point[i, k, 0], point[i, k, 1]
            ax, ay = point[i, k + 1, 0], point[i, k + 1, 1]
            for m in range(len(bands.disc)):
                cx, cy = bands.disc[m, 0], bands.disc[m, 1]
                reach = bands.disc[m, 2] + bands.r + slack
                if discs < len(near.discs) and nearest_on_the_way(x - cx, y - cy, ax - cx, ay - cy) < reach:
                    near.discs[discs, 0], near.discs[discs, 1], near.discs[discs, 2] = i, m, k
                    discs += 1
            for j in range(i):
                px, py = x - point[j, k, 0], y - point[j, k, 1]
                qx, qy = ax - point[j, k + 1, 0], ay - point[j, k + 1, 1]
                if robots < len(near.robots) and nearest_on_the_way(px, py, qx, qy) < bands.apart + slack:
                    near.robots[robots, 0], near.robots[robots, 1], near.robots[robots, 2] = i, j, k
                    robots += 1
    return robots, discs


@jit
def _pull(bands: Bands, piece: float) -> None:
    """Make pieces of bands that are too long shorter, from the start on and back again."""
    times = bands.point.shape[1]
    for i in range(bands.point.shape[0]):
        for k in range(times - 1):
            _shorten(bands, i, k, piece)
        for k in range(times - 2, -1, -1):
            _shorten(bands, i, k, piece)


@jit_inner
def _shorten(bands: Bands, i: int, k: int, piece: float) -> None:
    point = bands.point
    ux, uy = point[i, k + 1, 0] - point[i, k, 0], point[i, k + 1, 1] - point[i, k, 1]
    size = math.sqrt(ux * ux + uy * uy)
    if size <= piece:
        return
    part = (size - piece) / size
    if k > 0:
        part *= 0.5
        point[i, k, 0] += part * ux
        point[i, k, 1] += part * uy
    point[i, k + 1, 0] -= part * ux
    point[i, k + 1, 1] -= part * uy


@jit
def _push(bands: Bands, near: Near, robots: int, discs: int) -> None:
    """Push apart who is too near, then put ends to goals and all into the disk."""
    point, n, times = bands.point, bands.point.shape[0], bands.point.shape[1]
    for p in range(robots):
        _push_robots(bands, near.robots[p, 0], near.robots[p, 1], near.robots[p, 2])
    for p in range(discs):
        _push_off(bands, near.discs[p, 0], near.discs[p, 1], near.discs[p, 2])
    tol = bands.tol * (1.0 - 1e-9)
    for i in range(n):
        gx, gy = point[i, times - 1, 0] - bands.goal[i, 0], point[i, times - 1, 1] - bands.goal[i, 1]
        size = math.sqrt(gx * gx + gy * gy)
        if size > tol:
            point[i, times - 1, 0] = bands.goal[i, 0] + gx * tol / size
            point[i, times - 1, 1] = bands.goal[i, 1] + gy * tol / size
        for k in range(1, times):
            size = math.sqrt(point[i, k, 0] ** 2 + point[i, k, 1] ** 2)
            if size > 1.0 - 1e-12:
                point[i, k, 0] *= (1.0 - 1e-12) / size
                point[i, k, 1] *= (1.0 - 1e-12) / size


@jit_inner
def _foot(px: float, py: float, qx: float, qy: float) -> tuple[float, float, float]:
    """Return where on p-q one is nearest to the origin, as a part of it, and that point."""
    ux, uy = qx - px, qy - py
    length2 = ux * ux + uy * uy
    t = min(1.0, max(0.0, -(px * ux + py * uy) / length2)) if length2 > 0.0 else 0.0
    return t, px + t * ux, py + t * uy


@jit_inner
def _push_robots(bands: Bands, i: int, j: int, k: int) -> None:
    point = bands.point
    t, dx, dy = _foot(
        point[i, k, 0] - point[j, k, 0], point[i, k, 1] - point[j, k, 1],
        point[i, k + 1, 0] - point[j, k + 1, 0], point[i, k + 1, 1] - point[j, k + 1, 1],
    )  # fmt: skip
    size = math.sqrt(dx * dx + dy * dy)
    lack = bands.apart + bands.over - size
    one = 1.0 - t if k > 0 else 0.0
    if lack <= 0.0 or size == 0.0 or one + t == 0.0:
        return
    scale = lack / (2.0 * (one * one + t * t) * size)
    scale = min(scale, 4.0 * lack / size)
    point[i, k, 0] += scale * one * dx
    point[i, k, 1] += scale * one * dy
    point[i, k + 1, 0] += scale * t * dx
    point[i, k + 1, 1] += scale * t * dy
    point[j, k, 0] -= scale * one * dx
    point[j, k, 1] -= scale * one * dy
    point[j, k + 1, 0] -= scale * t * dx
    point[j, k + 1, 1] -= scale * t * dy


@jit_inner
def _push_off(bands: Bands, i: int, m: int, k: int) -> None:
    point, cx, cy = bands.point, bands.disc[m, 0], bands.disc[m, 1]
    t, dx, dy = _foot(point[i, k, 0] - cx, point[i, k, 1] - cy, point[i, k + 1, 0] - cx, point[i, k + 1, 1] - cy)
    size = math.sqrt(dx * dx + dy * dy)
    lack = bands.disc[m, 2] + bands.r + bands.clear + bands.over - size
    one = 1.0 - t if k > 0 else 0.0
    if lack <= 0.0 or size == 0.0 or one + t == 0.0:
        return
    scale = min(lack / ((one * one + t * t) * size), 4.0 * lack / size)
    point[i, k, 0] += scale * one * dx
    point[i, k, 1] += scale * one * dy
    point[i, k + 1, 0] += scale * t * dx
    point[i, k + 1, 1] += scale * t * dy
