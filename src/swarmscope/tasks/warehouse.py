"""Task warehouse: two blocks of aisles between racks, half of them closed where it cannot be seen from the front."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from swarmscope.bounds import Share
from swarmscope.sim.world import Obstacle
from swarmscope.tasks._check import check_setup
from swarmscope.tasks._contract import Amount, Length, Option, Setup, check_robots, read_options
from swarmscope.tasks._rooms import ASIDE_M, Box, box
from swarmscope.tasks._trips import Floor, TripOptions, hall_width, make_trips, setup_on, walker

NAME = "warehouse"
SUMMARY = "two blocks of aisles between racks, half of the aisles closed, most of them at the far end"
PLUG_M = 1.2
"""Length of what closes an aisle."""
PLACES = (0.6, 0.25, 0.15)
"""How often an aisle is closed at its far end, in the middle, in front."""
FEWEST_OPEN = 3
ROBOTS_AN_AISLE = 5
"""With more robots there are more aisles."""


@dataclass(frozen=True)
class WarehouseOptions(TripOptions):
    """Sizes [m] and shares."""

    aisles: Amount = 12.0  # of a block, more for many robots
    blocks: Amount = 2.0  # of aisles, one behind the other
    aisle_m: Length = 1.6  # width of an aisle
    depth_m: Length = 10.0  # length of an aisle
    rack_m: Length = 0.9  # width of a rack
    hall_m: Length = 3.0  # width of the halls at both ends and of the ways between blocks
    closed: Share = 0.5  # of the aisles; at least three of a block are open
    walkers: Amount = 0.0  # discs that walk to and fro between the blocks


OPTIONS = WarehouseOptions


def make(seed: int, robots: int = 15, radius: float = 0.15, **options: Option) -> Setup:
    """Return a warehouse and trips through it; options are the fields of `WarehouseOptions`."""
    check_robots(robots, radius)
    chosen = read_options(OPTIONS, options, NAME)
    rng = np.random.default_rng(seed)
    aisles = max(1, int(chosen.aisles), math.ceil(robots / ROBOTS_AN_AISLE))
    blocks, pitch = max(1, int(chosen.blocks)), chosen.aisle_m + chosen.rack_m
    height = aisles * pitch + chosen.rack_m
    hall = hall_width(robots, radius, height, chosen.hall_m)
    obstacles: list[Obstacle] = []
    rooms: list[Box] = []
    for b in range(blocks):
        x0 = b * (chosen.depth_m + chosen.hall_m)
        x1 = x0 + chosen.depth_m
        obstacles += [box(x0, k * pitch, x1, k * pitch + chosen.rack_m) for k in range(aisles + 1)]
        obstacles += [
            box(x0 + at, k * pitch + chosen.rack_m, x0 + at + plug, (k + 1) * pitch)
            for k, at, plug in _plugs(rng, aisles, chosen)
        ]
        if b + 1 < blocks:
            rooms.append((x1, 0.0, x1 + chosen.hall_m, height))
            obstacles += _walkers(rng, rooms[-1], chosen)
    end = blocks * (chosen.depth_m + chosen.hall_m) - chosen.hall_m
    left, right = (-hall, 0.0, 0.0, height), (end, 0.0, end + hall, height)
    floor = Floor(obstacles, left, right, [left, *rooms, right])
    setup = setup_on(floor, *make_trips(rng, floor, robots, radius, chosen))
    check_setup(setup, radius)
    return setup


def _plugs(rng: np.random.Generator, aisles: int, chosen: WarehouseOptions) -> list[tuple[int, float, float]]:
    """Return which aisles of a block are closed, from where [m] and how far [m]."""
    closed = np.flatnonzero(rng.random(aisles) < chosen.closed)
    most = max(0, aisles - min(FEWEST_OPEN, aisles))
    closed = np.sort(rng.permutation(closed)[:most])
    plug = min(PLUG_M, chosen.depth_m)
    spare = chosen.depth_m - plug
    at = rng.choice([spare, 0.5 * spare, 0.0], len(closed), p=PLACES)
    return [(int(k), float(x), plug) for k, x in zip(closed, at, strict=True)]


def _walkers(rng: np.random.Generator, way: Box, chosen: WarehouseOptions) -> list[Obstacle]:
    """Return discs that walk up and down between two blocks."""
    x0, y0, x1, y1 = way
    found: list[Obstacle] = []
    for _ in range(int(chosen.walkers)):
        x = float(rng.uniform(x0 + ASIDE_M, x1 - ASIDE_M))
        a, b = np.sort(rng.uniform(y0 + ASIDE_M, y1 - ASIDE_M, 2)).tolist()
        found.append(walker(rng, (x, a), (x, b + 0.1)))
    return found
