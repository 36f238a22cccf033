"""Occupancy maps of ROS map_server and nav2: a YAML file, a picture beside it."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from swarmscope.bounds import number_of
from swarmscope.errors import ConfigError, InputFileError
from swarmscope.sim.maps.files import as_grid
from swarmscope.sim.maps.picture import MODES, Reading, free_cells
from swarmscope.sim.world import Grid, grid_from_solid, solid_from_grid
from swarmscope.texts import check_regular, read_yaml

YAML = (".yaml", ".yml")
"""Ends of the names of map descriptions; any other file is a picture."""
PLACES = {"task", "map", "place"}
"""Keys that files of maps do not have, and of which scenarios have one."""
FREE_GREY, SOLID_GREY = 254, 0


def load_map(path: str | Path, resolution: float | None = None) -> Grid:
    """Read a map_server / nav2 map, or a picture alone with cells of ``resolution`` [m]; its first row is the top.

    `picture.free_cells` says which cells are free; all others are solid. A rotated origin turns the grid. A picture
    alone has its lower left corner at (0, 0) and map_server's usual thresholds. Errors: InputFileError, ConfigError.
    """
    path = Path(path)
    if path.suffix.lower() not in YAML:
        return _picture_alone(path, resolution)
    settings = _read_yaml(path)
    side = _number(path, settings, "resolution")
    if side <= 0.0:
        raise ConfigError(f"{path}: resolution", f"must be above 0, got {side}")
    x, y, yaw = _origin(path, settings)
    reading = _reading(path, settings)
    free = free_cells(_image_path(path, settings), reading)
    return as_grid(path, ~free[::-1], side, (x, y), yaw)


def _picture_alone(path: Path, resolution: float | None) -> Grid:
    if resolution is None:
        raise ConfigError(f"{path}: resolution", "a picture does not say how large its cells are: give their side [m]")
    return as_grid(path, ~free_cells(path, Reading())[::-1], resolution, (0.0, 0.0))


def _reading(path: Path, settings: dict[str, Any]) -> Reading:
    """Return how the picture is read. Errors: ConfigError."""
    mode = settings.get("mode", "trinary")
    if mode not in MODES:
        raise ConfigError(f"{path}: mode", f"must be one of {', '.join(MODES)}, got {mode!r}")
    negate = _negate(path, settings)
    occupied_thresh = _threshold(path, settings, "occupied_thresh")
    free_thresh = _threshold(path, settings, "free_thresh")
    if free_thresh > occupied_thresh:
        raise ConfigError(f"{path}: free_thresh", f"{free_thresh} is above occupied_thresh {occupied_thresh}")
    return Reading(mode, negate, free_thresh)


def closed(grid: Grid) -> Grid:
    """Return the map, with a ring of solid cells round it where it is free up to its edge: beyond is unknown."""
    solid = solid_from_grid(grid)
    if solid[[0, -1]].all() and solid[:, [0, -1]].all():
        return grid
    (x, y), cell, c, s = grid.origin, grid.resolution, math.cos(grid.yaw), math.sin(grid.yaw)
    corner = x - cell * (c - s), y - cell * (s + c)
    return grid_from_solid(np.pad(solid, 1, constant_values=1), cell, corner, grid.yaw)


def save_map(grid: Grid, yaml_path: str | Path) -> None:
    """Write ``grid`` as a map_server YAML file and a PGM image of the same name beside it."""
    path = Path(yaml_path)
    image = path.with_suffix(".pgm")
    grey = np.where(solid_from_grid(grid)[::-1] != 0, SOLID_GREY, FREE_GREY).astype(np.uint8)
    settings = {
        "image": image.name,
        "resolution": grid.resolution,
        "origin": [*grid.origin, grid.yaw],
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
        "mode": "trinary",
    }
    try:
        image.write_bytes(f"P5\n{grid.width} {grid.height}\n255\n".encode() + grey.tobytes())
        path.write_text(yaml.safe_dump(settings, sort_keys=False), encoding="utf-8")
    except OSError as error:
        raise InputFileError(path, f"cannot be written: {error}") from error


def _read_yaml(path: Path) -> dict[str, Any]:
    settings = read_yaml(path)
    if not isinstance(settings, dict):
        raise InputFileError(path, "is not a map description: expected 'key: value' lines")
    if "image" not in settings and PLACES & settings.keys():
        raise InputFileError(path, "is a scenario, not a map: run it without --map")
    return settings


def _need(path: Path, settings: dict[str, Any], key: str) -> Any:
    if settings.get(key) is None:
        raise ConfigError(f"{path}: {key}", "is missing")
    return settings[key]


def _as_number(path: Path, key: str, value: Any) -> float:
    """Return a finite number; text such as 1e-1, which YAML 1.1 does not take for a number, is accepted."""
    number = number_of(value)
    if not math.isfinite(number):
        raise ConfigError(f"{path}: {key}", f"must be a finite number, got {value!r}")
    return number


def _number(path: Path, settings: dict[str, Any], key: str) -> float:
    return _as_number(path, key, _need(path, settings, key))


def _threshold(path: Path, settings: dict[str, Any], key: str) -> float:
    value = _number(path, settings, key)
    if not 0.0 <= value <= 1.0:
        raise ConfigError(f"{path}: {key}", f"must lie between 0 and 1, got {value}")
    return value


def _negate(path: Path, settings: dict[str, Any]) -> bool:
    value = _need(path, settings, "negate")
    if not isinstance(value, bool | int) or value not in (0, 1):
        raise ConfigError(f"{path}: negate", f"must be 0 or 1, got {value!r}")
    return bool(value)


def _origin(path: Path, settings: dict[str, Any]) -> tuple[float, float, float]:
    value = _need(path, settings, "origin")
    if not isinstance(value, list) or len(value) != 3:
        raise ConfigError(f"{path}: origin", f"must be [x, y, yaw], got {value!r}")
    x, y, yaw = (_as_number(path, f"origin[{i}]", part) for i, part in enumerate(value))
    return x, y, yaw


def _image_path(path: Path, settings: dict[str, Any]) -> Path:
    name = _need(path, settings, "image")
    if not isinstance(name, str):
        raise ConfigError(f"{path}: image", f"must be a file name, got {name!r}")
    try:
        image = path.parent / Path(name).expanduser()
    except RuntimeError as error:
        raise ConfigError(f"{path}: image", f"{name!r}: {error}") from None
    try:
        check_regular(image, None)
    except InputFileError as error:
        raise InputFileError(image, f"{error.why}; it is the image of {path}") from None
    return image
