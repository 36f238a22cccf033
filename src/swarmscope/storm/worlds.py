"""Worlds that storms make themselves: clutter of all sizes, rooms behind narrow doors, mazes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from swarmscope.storm.ranges import COVERED, DOOR_M, OBSTACLE_M, SIDE_M, Span
from swarmscope.tasks._check import CLEARANCE_M

KINDS = ("clutter", "doors", "maze")
MOST_OBSTACLES = 400
FAR_M = 1e-3
"""Walls shorter than this are left out."""

Values = dict[str, Any]


def number(rng: np.random.Generator, span: Span) -> float:
    """Return a number of the span, of six digits."""
    if span.log:
        drawn = math.exp(rng.uniform(math.log(span.low), math.log(span.high)))
    elif span.inverse:
        drawn = 1.0 / rng.uniform(1.0 / span.high, 1.0 / span.low)
    else:
        drawn = rng.uniform(span.low, span.high)
    return min(span.high, max(span.low, float(f"{drawn:.6g}")))


def make_world(rng: np.random.Generator, kind: str, radius: float) -> Values:
    """Return a world written out, as a scenario has it, for robots of ``radius`` [m]."""
    width, height = number(rng, SIDE_M), number(rng, SIDE_M)
    obstacles = _box(0.0, 0.0, width, height) if rng.random() < 0.7 or kind != "clutter" else []
    if kind == "clutter":
        obstacles += _clutter(rng, width, height)
    elif kind == "doors":
        obstacles += _doors(rng, width, height, radius)
    else:
        obstacles += _maze(rng, width, height, radius)
    return {"bounds": [0.0, 0.0, width, height], "obstacles": obstacles}


def _clutter(rng: np.random.Generator, width: float, height: float) -> list[Values]:
    """Return circles, boxes and walls of all sizes, until they cover their share of the floor."""
    left = number(rng, COVERED) * width * height
    found: list[Values] = []
    while left > 0.0 and len(found) < MOST_OBSTACLES:
        x, y = rng.uniform(0.0, width), rng.uniform(0.0, height)
        size, angle = number(rng, OBSTACLE_M), rng.uniform(0.0, math.tau)
        kind = rng.integers(3)
        if kind == 0:
            found.append({"type": "circle", "center": [x, y], "radius": size})
            left -= math.pi * size * size
        elif kind == 1:
            other = number(rng, OBSTACLE_M)
            found.append({"type": "polygon", "points": _turned(x, y, size, other, angle)})
            left -= 4.0 * size * other
        else:
            dx, dy = size * math.cos(angle), size * math.sin(angle)
            found.append(_wall((x - dx, y - dy), (x + dx, y + dy)))
            left -= 0.2 * size
    return found


def _doors(rng: np.random.Generator, width: float, height: float, radius: float) -> list[Values]:
    """Return walls across, each with a door that a robot just fits through, or a wider one."""
    found: list[Values] = []
    rooms = int(rng.integers(2, 5))
    for k in range(1, rooms):
        x = width * k / rooms
        door = 2.0 * (radius + CLEARANCE_M) + number(rng, DOOR_M)
        low = rng.uniform(0.0, max(0.0, height - door))
        thick = 0.0 if rng.random() < 0.5 else rng.uniform(0.05, 0.6)
        for first, last in ((0.0, low), (low + door, height)):
            if last - first < FAR_M:
                continue
            if thick > 0.0:
                points = _turned(x, 0.5 * (first + last), 0.5 * thick, 0.5 * (last - first), 0.0)
                found.append({"type": "polygon", "points": points})
            else:
                found.append(_wall((x, first), (x, last)))
    return found


def _maze(rng: np.random.Generator, width: float, height: float, radius: float) -> list[Values]:
    """Return the walls of a maze without islands (depth first), with ways a robot fits through."""
    way = 2.0 * (radius + CLEARANCE_M) * rng.uniform(1.15, 3.0) + 0.05
    columns, rows = (max(2, min(12, int(side / way))) for side in (width, height))
    w, h = width / columns, height / rows
    open_walls: set[frozenset[tuple[int, int]]] = set()
    seen, stack = {(0, 0)}, [(0, 0)]
    while stack:
        i, j = stack[-1]
        near = [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
        near = [(a, b) for a, b in near if 0 <= a < columns and 0 <= b < rows and (a, b) not in seen]
        if not near:
            stack.pop()
            continue
        after = near[int(rng.integers(len(near)))]
        open_walls.add(frozenset(((i, j), after)))
        seen.add(after)
        stack.append(after)
    more = rng.uniform(0.0, 0.3)  # some walls less, so that there are ways round
    found: list[Values] = []
    for i in range(columns):
        for j in range(rows):
            for a, b in ((i + 1, j), (i, j + 1)):
                shut = a < columns and b < rows and frozenset(((i, j), (a, b))) not in open_walls
                if not shut or rng.random() < more:
                    continue
                corner = ((i + 1) * w, (j + 1) * h)
                found.append(_wall((a * w, j * h) if b == j else (i * w, b * h), corner))
    return found


def _box(x0: float, y0: float, x1: float, y1: float) -> list[Values]:
    """Return four walls."""
    corners = [(x0, y0), (x1, y0), (x1, y1), (x0, y1)]
    return [_wall(corners[k], corners[(k + 1) % 4]) for k in range(4)]


def _wall(first: tuple[float, float], last: tuple[float, float]) -> Values:
    return {"type": "wall", "points": [list(first), list(last)]}


def _turned(x: float, y: float, a: float, b: float, angle: float) -> list[list[float]]:
    """Return the corners of a box with half sides a and b, turned by ``angle``."""
    c, s = math.cos(angle), math.sin(angle)
    return [[x + c * u - s * v, y + s * u + c * v] for u, v in ((-a, -b), (a, -b), (a, b), (-a, b))]
