"""Task hospital: rooms behind rooms, joined by doors at random; whoever does not remember searches them for ever."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from swarmscope.bounds import Share
from swarmscope.sim.world import Door, Obstacle
from swarmscope.tasks._check import check_setup
from swarmscope.tasks._contract import Amount, Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._rooms import Box, box
from swarmscope.tasks._trips import (
    WALKER_M,
    Floor,
    TripOptions,
    Ways,
    hall_width,
    make_trips,
    on_random_tree,
    setup_on,
    walker,
)

NAME = "hospital"
SUMMARY = "rooms behind rooms, joined by doors on a random tree and by a few more"
ROOMS_EACH = 0.5
"""Rooms for a robot, at least."""
HALL_M = 2.5
"""Width of the halls at both ends, at least."""
JAMB_M = 0.3
"""From a door to the corner of its room, at least."""
OPEN_S, CYCLE_S = (15.0, 30.0), (40.0, 60.0)
"""How long a door that opens and closes stays open, and after how long it begins anew."""


@dataclass(frozen=True)
class HospitalOptions(TripOptions):
    """Sizes [m] and shares."""

    ways: Ways = "any"
    columns: Amount = 10.0  # of rooms, more for many robots
    rows: Amount = 7.0  # of rooms, more for many robots
    room_m: Length = 4.0  # side of a room
    wall_m: Length = 0.2  # thickness of the walls
    door_m: Length = 1.0  # width of a door
    more_doors: Share = 0.15  # of the walls that need no door
    wide: Share = 0.25  # of the doors: those as wide as the room
    swinging: Share = 0.0  # of the other doors: those that open and close
    walkers: Amount = 0.0  # discs that walk to and fro in a room


OPTIONS = HospitalOptions


class Gap(NamedTuple):
    """A wall between two rooms: where it runs and which part of it is open."""

    box: Box
    upright: bool
    opening: tuple[float, float] | None
    """From where to where along it [m]; None: closed."""


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a hospital and trips in it; options are the fields of `HospitalOptions`."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    rng = np.random.default_rng(seed)
    grow = math.sqrt(max(1.0, ROOMS_EACH * robots / max(1.0, chosen.columns * chosen.rows)))
    columns, rows = (max(1, math.ceil(count * grow - 1e-9)) for count in (chosen.columns, chosen.rows))
    pitch, half = chosen.room_m + chosen.wall_m, 0.5 * chosen.wall_m
    height = rows * pitch - chosen.wall_m
    hall = hall_width(robots, radius, height, HALL_M)
    gaps = _gaps(rng, columns, rows, chosen)
    rooms: list[Box] = [
        (i * pitch + half, j * pitch, (i + 1) * pitch - half, (j + 1) * pitch - chosen.wall_m)
        for i in range(columns)
        for j in range(rows)
    ]
    obstacles: list[Obstacle] = [
        box(i * pitch - half, (j + 1) * pitch - chosen.wall_m, i * pitch + half, (j + 1) * pitch)
        for i in range(columns + 1)
        for j in range(rows - 1)
    ]
    obstacles += [part for gap in gaps for part in _walls(gap)]
    obstacles += _doors(rng, gaps, chosen) + _walkers(rng, rooms, chosen)
    left = (-half - hall, 0.0, -half, height)
    right = (columns * pitch + half, 0.0, columns * pitch + half + hall, height)
    floor = Floor(obstacles, left, right, rooms)
    setup = setup_on(floor, *make_trips(rng, floor, robots, radius, chosen))
    check_setup(setup, radius)
    return setup


def _gaps(rng: np.random.Generator, columns: int, rows: int, chosen: HospitalOptions) -> list[Gap]:
    """Return all walls between rooms and halls: those of a random tree have a door, and a few of the others."""
    pitch, half = chosen.room_m + chosen.wall_m, 0.5 * chosen.wall_m
    found: list[tuple[int, int, Box, bool]] = []
    node = np.pad(np.arange(1, columns * rows + 1).reshape(columns, rows), ((1, 1), (0, 0)))
    node[-1] = columns * rows + 1  # the hall on the right; that on the left is 0
    for i in range(columns + 1):
        for j in range(rows):
            x, y = i * pitch, j * pitch
            found.append((node[i, j], node[i + 1, j], (x - half, y, x + half, y + chosen.room_m), True))
            if i < columns and j + 1 < rows:
                over = (x + half, y + chosen.room_m, x + pitch - half, y + pitch)
                found.append((node[i + 1, j], node[i + 1, j + 1], over, False))
    on_tree = on_random_tree(rng, np.array([pair[:2] for pair in found]))
    open_ = on_tree | (rng.random(len(found)) < chosen.more_doors)
    return [
        Gap(wall, upright, _opening(rng, wall[1 if upright else 0], chosen) if is_open else None)
        for (_, _, wall, upright), is_open in zip(found, open_, strict=True)
    ]


def _opening(rng: np.random.Generator, begin: float, chosen: HospitalOptions) -> tuple[float, float]:
    """Return from where to where a wall that begins at ``begin`` is open [m]."""
    if rng.random() < chosen.wide or chosen.door_m >= chosen.room_m:
        return begin, begin + chosen.room_m
    spare = chosen.room_m - chosen.door_m
    jamb = min(JAMB_M, 0.5 * spare)
    first = begin + float(rng.uniform(jamb, spare - jamb))
    return first, first + chosen.door_m


def _walls(gap: Gap) -> list[Obstacle]:
    """Return what stands of a wall."""
    x0, y0, x1, y1 = gap.box
    if gap.opening is None:
        return [box(x0, y0, x1, y1)]
    first, last = gap.opening
    parts = [(x0, y0, x1, first), (x0, last, x1, y1)] if gap.upright else [(x0, y0, first, y1), (last, y0, x1, y1)]
    return [box(*part) for part in parts if part[2] - part[0] > 1e-6 and part[3] - part[1] > 1e-6]


def _doors(rng: np.random.Generator, gaps: list[Gap], chosen: HospitalOptions) -> list[Obstacle]:
    """Return the doors that open and close."""
    found: list[Obstacle] = []
    for gap in gaps:
        if gap.opening is None or gap.opening[1] - gap.opening[0] > chosen.door_m + 1e-9:
            continue
        if rng.random() >= chosen.swinging:
            continue
        x, y = 0.5 * (gap.box[0] + gap.box[2]), 0.5 * (gap.box[1] + gap.box[3])
        first, last = gap.opening
        points = [(x, first), (x, last)] if gap.upright else [(first, y), (last, y)]
        cycle, length = float(rng.uniform(*CYCLE_S)), float(rng.uniform(*OPEN_S))
        begin = float(rng.uniform(0.0, cycle - length))
        found.append(Door(points=points, open_s=[(begin, begin + length)], every_s=cycle))
    return found


def _walkers(rng: np.random.Generator, rooms: list[Box], chosen: HospitalOptions) -> list[Obstacle]:
    """Return discs that walk from wall to wall, each in a room of its own."""
    found: list[Obstacle] = []
    for k in rng.permutation(len(rooms))[: int(chosen.walkers)]:
        x0, y0, x1, y1 = rooms[k]
        y, edge = float(rng.uniform(y0 + 1.0, y1 - 1.0)), 2.0 * WALKER_M
        found.append(walker(rng, (x0 + edge, y), (x1 - edge, y)))
    return found
