"""The rules of a run: numbers, where robots start and where they have to go.

Unit-disk report, sections 1 and 3.1, in the reading that reproduces its table: starts on the circle of radius 1,
goals on radius 0.999, all robots moved at once, done when all are within ``tol`` at the same time.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields
from itertools import permutations
from typing import Any

import numpy as np
import numpy.typing as npt

from swarmscope.errors import ConfigError

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

START_RADIUS, GOAL_RADIUS = 1.0, 0.999
PAPER_ROBOTS, PAPER_RADIUS = 5, 0.05
MOST_ROBOTS = 200
WIDEST = 0.4
"""Largest radius that ``scaled`` gives, as a part of the distance between neighbouring starts."""
ROUNDING = 1e-9
"""Starts lie on the rim, so that much outside of it is still inside."""


@dataclass(frozen=True)
class Rules:
    """The numbers of a run; the defaults are those of the report."""

    n: int = PAPER_ROBOTS
    r: float = PAPER_RADIUS
    dt: float = 0.005
    v_max: float = 0.05
    tol: float = 0.005
    max_steps: int = 30_000

    def __post_init__(self) -> None:
        for field in fields(self):
            _check_number("radius" if field.name == "r" else field.name, getattr(self, field.name))
        if self.n > MOST_ROBOTS:
            raise ConfigError("n", f"{self.n} robots; at most {MOST_ROBOTS}")
        if self.n > 1 and 2.0 * self.r >= spacing(self.n):
            raise ConfigError(
                "radius",
                f"{self.n} robots of radius {self.r:g} overlap at their starts, which are {spacing(self.n):.4g} apart",
            )
        if self.step >= self.r:
            raise ConfigError("v_max", f"a step of dt v_max = {self.step:g} is not small against the radius {self.r:g}")

    @property
    def step(self) -> float:
        """The longest way in one step."""
        return self.dt * self.v_max

    def as_dict(self) -> dict[str, Any]:
        """Return the numbers by name."""
        return asdict(self)


def _check_number(name: str, value: float) -> None:
    whole = name in {"n", "max_steps"}
    if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
        raise ConfigError(name, f"{value!r} is not a {'whole ' if whole else ''}number")
    if not (math.isfinite(value) and value > 0):
        raise ConfigError(name, f"{value!r} is not above 0")


def spacing(n: int, radius: float = GOAL_RADIUS) -> float:
    """Return the distance between neighbouring places when n of them share a half circle."""
    return 2.0 * radius * math.sin(math.pi / (2 * n))


def scaled(n: int, **changes: Any) -> Rules:
    """Return rules for n robots that together cover as much ground as the report's five, if they fit in their row."""
    _check_number("n", n)
    radius = min(PAPER_RADIUS * math.sqrt(PAPER_ROBOTS / n), WIDEST * spacing(n))
    return Rules(**{"n": n, "r": radius if n != PAPER_ROBOTS else PAPER_RADIUS} | changes)


def starts(n: int) -> Floats:
    """Return the start positions (n, 2): angle k pi/n on the rim."""
    return _on_circle(START_RADIUS, np.arange(n) * math.pi / n)


def goal_places(n: int) -> Floats:
    """Return the n goal positions (n, 2): angle k pi/n + pi, just inside the rim."""
    return _on_circle(GOAL_RADIUS, np.arange(n) * math.pi / n + math.pi)


def goals(permutation: Sequence[int]) -> Floats:
    """Return the goal of each robot (n, 2): robot k goes to place ``permutation[k]``."""
    places: Floats = goal_places(len(permutation))[np.asarray(permutation)]
    return places


def _on_circle(radius: float, angles: Floats) -> Floats:
    places: Floats = radius * np.column_stack([np.cos(angles), np.sin(angles)])
    return places


def all_permutations(n: int) -> Iterator[tuple[int, ...]]:
    """Yield the permutations of n goals in the order of the dictionary."""
    if n > 8:
        raise ConfigError("permutation", f"{math.factorial(n)} permutations of {n} goals are too many; name some")
    return permutations(range(n))


def read_permutation(text: str, n: int) -> tuple[int, ...]:
    """Return the permutation written as '0,3,1,4,2' or, up to ten robots, '03142'."""
    parts = text.replace(" ", "").split(",") if "," in text else list(text.strip())
    try:
        found = tuple(int(part) for part in parts)
    except ValueError:
        found = ()
    if sorted(found) != list(range(n)):
        raise ConfigError(
            "permutation",
            f"'{text}' does not name each of 0 to {n - 1} once, as in "
            f"{','.join(str(k) for k in range(n)) if n <= 12 else '0,1,2,...'}",
        )
    return found
