"""Random maps: loose discs, U-shaped traps, and walls with a passage just wider or just narrower than a robot.

A seed and a number of robots give one map and one permutation. Every robot alone has a way to its goal, and beside
every start and goal another robot can pass; nothing else is promised.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope.disk.check import first_fault
from swarmscope.disk.maps import DiskMap
from swarmscope.disk.rules import Floats, Rules, goal_places, goals, starts
from swarmscope.errors import UnsolvableWorldError

TRIES = 200
BEAD = 0.03
"""Radius of the discs that walls are made of; they overlap by half."""
PASSAGE = (0.02, 0.10)
"""How much a passage differs from the width of a robot, as a part of it."""


class RandomCase(NamedTuple):
    """A map, who goes where on it, and what it was made of."""

    map: DiskMap
    permutation: tuple[int, ...]
    features: tuple[str, ...]


def random_map(seed: int, rules: Rules) -> RandomCase:
    """Return the case of a seed for robots of these rules. Errors: UnsolvableWorldError if none is found."""
    rng = np.random.default_rng([seed, rules.n])
    permutation = tuple(int(k) for k in rng.permutation(rules.n))
    for _ in range(TRIES):
        discs, features = _draw(rng, rules)
        if _leaves_room(discs, rules) and not first_fault(discs, rules.r, starts(rules.n), goals(permutation)):
            about = f"random, with {', '.join(features)}"
            return RandomCase(DiskMap(f"random:{seed}", discs, about), permutation, features)
    raise UnsolvableWorldError(f"random:{seed}: none of {TRIES} draws left every one of {rules.n} robots a way")


def _draw(rng: np.random.Generator, rules: Rules) -> tuple[Floats, tuple[str, ...]]:
    loose = int(rng.integers(1, 7))
    parts, features = [_loose(rng, loose)], [f"{loose} loose discs"]
    if rng.random() < 0.5:
        parts.append(_trap(rng))
        features.append("a U-shaped trap")
    if rng.random() < 0.5:
        wide = bool(rng.random() < 0.5)
        parts.append(_gate(rng, rules.r, wide))
        features.append(f"a passage just {'wider' if wide else 'narrower'} than a robot")
    return np.concatenate(parts), tuple(features)


def _loose(rng: np.random.Generator, count: int) -> Floats:
    return np.column_stack([_places(rng, count, 0.8), rng.uniform(0.04, 0.2, count)])


def _places(rng: np.random.Generator, count: int, reach: float) -> Floats:
    distance, angle = reach * np.sqrt(rng.random(count)), rng.uniform(0.0, 2 * math.pi, count)
    return np.column_stack([distance * np.cos(angle), distance * np.sin(angle)])


def _trap(rng: np.random.Generator) -> Floats:
    """Return most of a circle of beads, open towards a random direction."""
    centre, radius = _places(rng, 1, 0.45)[0], rng.uniform(0.15, 0.3)
    opening = rng.uniform(0.0, 2 * math.pi)
    half = rng.uniform(math.radians(90), math.radians(135))
    angles = opening + math.pi + np.linspace(-half, half, math.ceil(2 * half * radius / BEAD) + 1)
    beads = centre + radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return np.column_stack([beads, np.full(len(beads), BEAD)])


def _gate(rng: np.random.Generator, r: float, wide: bool) -> Floats:
    """Return two walls in a line with a gap between them that differs a little from a robot's width."""
    centre, angle = _places(rng, 1, 0.4)[0], rng.uniform(0.0, math.pi)
    along = np.array([math.cos(angle), math.sin(angle)])
    half_gap = r * (1.0 + (1 if wide else -1) * rng.uniform(*PASSAGE))
    wings = []
    for side in (-1.0, 1.0):
        offsets = half_gap + BEAD + np.arange(0.0, rng.uniform(0.15, 0.35), BEAD)
        wings.append(centre + side * offsets[:, None] * along)
    beads = np.concatenate(wings)
    return np.column_stack([beads, np.full(len(beads), BEAD)])


def _leaves_room(discs: Floats, rules: Rules) -> bool:
    """Return whether a robot fits between every obstacle and a robot at any start or goal."""
    places = np.concatenate([starts(rules.n), goal_places(rules.n)])
    apart = np.linalg.norm(places[:, None] - discs[None, :, :2], axis=2) - discs[:, 2]
    return bool((apart > 3.2 * rules.r).all())
