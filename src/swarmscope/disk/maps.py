"""Obstacle maps of the unit disk: the five of the report by name, and files of users."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from swarmscope.bounds import number_of
from swarmscope.disk.rules import Floats
from swarmscope.errors import InputFileError
from swarmscope.texts import read_yaml

MOST_OBSTACLES = 200
FARTHEST = 100.0
"""Largest coordinate and radius in a file."""


@dataclass(frozen=True, eq=False)
class DiskMap:
    """A map: its name, and centre x, y and radius of each obstacle, shape (m, 3)."""

    name: str
    obstacles: Floats
    about: str = ""

    def as_dicts(self) -> list[dict[str, Any]]:
        """Return the obstacles in the form that the report's controllers are called with."""
        return [{"center": (float(x), float(y)), "radius": float(radius)} for x, y, radius in self.obstacles]


def _map(name: str, about: str, *obstacles: tuple[float, float, float]) -> DiskMap:
    return DiskMap(name, np.array(obstacles, dtype=np.float64).reshape(-1, 3), about)


REPORT_MAPS = {
    one.name: one
    for one in (
        _map("c0", "test 1: three discs", (0.0, 0.0, 0.1), (0.5, 0.2, 0.1), (-0.3, -0.3, 0.1)),
        _map(
            "u",
            "test 2: five discs that leave U-shaped bays",
            (0.0, 0.0, 0.1),
            (0.15, 0.15, 0.08),
            (-0.15, 0.15, 0.1),
            (0.15, -0.15, 0.07),
            (-0.15, -0.15, 0.09),
        ),
        _map("crevice", "test 3: a gap that is too narrow", (0.5, 0.22, 0.2), (0.5, -0.22, 0.2)),
        _map("one-disc", "test 4: robots against robots", (0.0, 0.0, 0.05)),
        _map(
            "minima",
            "test 5: four large discs round a small one",
            (-0.35, 0.35, 0.2),
            (0.35, -0.35, 0.2),
            (0.35, 0.35, 0.2),
            (-0.35, -0.35, 0.2),
            (0.0, 0.0, 0.05),
        ),
    )
}
"""The maps of the unit-disk report, code snippets 5 to 9, in its order."""

EMPTY = _map("empty", "no obstacle")
NAMED = REPORT_MAPS | {EMPTY.name: EMPTY}


def read_map(path: Path) -> DiskMap:
    """Return the map of a YAML file: ``obstacles``, a list of ``center: [x, y]`` and ``radius``."""
    content = read_yaml(path)
    if not isinstance(content, Mapping) or set(content) - {"obstacles", "name", "about"}:
        raise InputFileError(path, "has to hold 'obstacles' (and may hold 'name' and 'about'), nothing else")
    entries = content.get("obstacles")
    if not isinstance(entries, list):
        raise InputFileError(path, "'obstacles' has to be a list")
    rows = [_obstacle(path, k, entry) for k, entry in enumerate(entries)]
    if len(rows) > MOST_OBSTACLES:
        raise InputFileError(path, f"has {len(rows)} obstacles; at most {MOST_OBSTACLES}")
    return _map(str(content.get("name") or path.stem), str(content.get("about") or ""), *rows)


def _obstacle(path: Path, k: int, entry: Any) -> tuple[float, float, float]:
    where = f"obstacles[{k}]"
    if not isinstance(entry, Mapping) or set(entry) != {"center", "radius"}:
        raise InputFileError(path, f"{where} has to hold 'center' and 'radius'")
    center = entry["center"]
    try:
        if not isinstance(center, list):
            raise TypeError
        x, y = map(number_of, center)
        radius = number_of(entry["radius"])
    except (TypeError, ValueError):
        raise InputFileError(path, f"{where}: 'center' has to be two numbers, 'radius' one") from None
    if not np.isfinite([x, y, radius]).all() or radius <= 0.0:
        raise InputFileError(path, f"{where}: numbers have to be finite and the radius above 0")
    if max(abs(x), abs(y), radius) > FARTHEST:
        raise InputFileError(path, f"{where}: the disk has radius 1; numbers above {FARTHEST:g} are taken for a slip")
    return x, y, radius
