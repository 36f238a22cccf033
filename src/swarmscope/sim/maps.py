"""Occupancy maps from files: ROS map_server / nav2 (YAML + PGM or PNG) and the Moving AI benchmarks.

A map file becomes a `Grid`. Cells that the map marks unknown are solid: nobody measured them to be free.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml
from PIL import Image
from pydantic import ValidationError

from swarmscope.errors import ConfigError, InputFileError, UnknownNameError
from swarmscope.sim.world import Grid, grid_from_solid, solid_from_grid

MAP_FOLDER = Path(__file__).parent.parent / "data" / "maps"
MOVINGAI_FREE, MOVINGAI_BLOCKED = ".GS", "@OTW"
FREE_GREY, SOLID_GREY = 254, 0


def packaged_map(name: str) -> Path:
    """Return the YAML file of a map that comes with the package, for instance ``willow_garage_office``."""
    names = {path.stem: path for path in MAP_FOLDER.glob("*.yaml")}
    if name not in names:
        raise UnknownNameError("map", name, names)
    return names[name]


def load_map(yaml_path: str | Path) -> Grid:
    """Read a map_server / nav2 map; image row 0 is the top.

    With p = (255 - grey) / 255 (grey / 255 with ``negate``), a cell is occupied if p >= occupied_thresh, free
    if p <= free_thresh, else unknown; all but free are solid. Only ``mode: trinary`` and an
    origin that is not rotated are supported.
    """
    path = Path(yaml_path)
    settings = _read_yaml(path)
    if settings.get("mode", "trinary") != "trinary":
        raise ConfigError(f"{path}: mode", f"only 'trinary' is supported, got {settings['mode']!r}")
    resolution = _number(path, settings, "resolution")
    if resolution <= 0.0:
        raise ConfigError(f"{path}: resolution", f"must be above 0, got {resolution}")
    origin = _origin(path, settings)
    negate = _negate(path, settings)
    occupied_thresh = _threshold(path, settings, "occupied_thresh")
    free_thresh = _threshold(path, settings, "free_thresh")
    if free_thresh > occupied_thresh:
        raise ConfigError(f"{path}: free_thresh", f"{free_thresh} is above occupied_thresh {occupied_thresh}")
    grey = _read_grey(_image_path(path, settings))
    p = grey / 255.0 if negate else (255.0 - grey) / 255.0
    free = (p <= free_thresh) & (p < occupied_thresh)
    return _as_grid(path, ~free[::-1], resolution, origin)


def closed(grid: Grid) -> Grid:
    """Return the map, with a ring of solid cells round it where it is free up to its edge: beyond is unknown."""
    solid = solid_from_grid(grid)
    if solid[[0, -1]].all() and solid[:, [0, -1]].all():
        return grid
    (x, y), cell = grid.origin, grid.resolution
    return grid_from_solid(np.pad(solid, 1, constant_values=1), cell, (x - cell, y - cell))


def save_map(grid: Grid, yaml_path: str | Path) -> None:
    """Write ``grid`` as a map_server YAML file and a PGM image of the same name beside it."""
    path = Path(yaml_path)
    image = path.with_suffix(".pgm")
    grey = np.where(solid_from_grid(grid)[::-1] != 0, SOLID_GREY, FREE_GREY).astype(np.uint8)
    settings = {
        "image": image.name,
        "resolution": grid.resolution,
        "origin": [*grid.origin, 0.0],
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


def load_movingai(path: str | Path, resolution: float = 1.0) -> Grid:
    """Read a Moving AI ``.map`` (type octile), first row at the top.

    '.', 'G', 'S' are free, '@', 'O', 'T', 'W' solid. One character becomes one cell of ``resolution``
    [m]; the lower left corner of the map is (0, 0).
    """
    path = Path(path)
    lines = _read_text(path).splitlines()
    header = dict(zip(("type", "height", "width"), lines[:3], strict=False))
    sizes = {}
    for number, (key, line) in enumerate(header.items(), start=1):
        words = line.split()
        if len(words) != 2 or words[0] != key or (key != "type" and not words[1].isdecimal()):
            raise InputFileError(path, f"line {number}: expected '{key} ...', got {line[:40]!r}")
        sizes[key] = words[1]
    if len(lines) < 4 or sizes["type"] != "octile" or lines[3].strip() != "map":
        raise InputFileError(path, "not a Moving AI map: expected 'type octile', 'height', 'width', 'map'")
    height, width = int(sizes["height"]), int(sizes["width"])
    rows = [line.rstrip() for line in lines[4:]]
    while rows and not rows[-1]:
        rows.pop()
    if len(rows) != height:
        raise InputFileError(path, f"the header says {height} rows, the map has {len(rows)}")
    for number, row in enumerate(rows, start=5):
        strange = set(row) - set(MOVINGAI_FREE + MOVINGAI_BLOCKED)
        if len(row) != width or strange:
            why = f"unknown terrain {sorted(strange)}" if strange else f"{len(row)} cells instead of {width}"
            raise InputFileError(path, f"line {number}: {why}")
    solid = np.array([[cell in MOVINGAI_BLOCKED for cell in row] for row in reversed(rows)])
    return _as_grid(path, solid.reshape(height, width), resolution, (0.0, 0.0))


def _as_grid(
    path: Path, solid: npt.NDArray[np.bool_], resolution: float, origin: tuple[float, float]
) -> Grid:
    try:
        return grid_from_solid(solid, resolution, origin)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ConfigError(f"{path}: {where}" if where else str(path), first["msg"]) from error


def _read_text(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputFileError(path, f"cannot be read: {error}") from error


def _read_yaml(path: Path) -> dict[str, Any]:
    try:
        settings = yaml.safe_load(_read_text(path))
    except (yaml.YAMLError, ValueError) as error:
        raise InputFileError(path, f"is not YAML: {error}") from error
    if not isinstance(settings, dict):
        raise InputFileError(path, "is not a map description: expected 'key: value' lines")
    return settings


def _need(path: Path, settings: dict[str, Any], key: str) -> Any:
    if settings.get(key) is None:
        raise ConfigError(f"{path}: {key}", "is missing")
    return settings[key]


def _as_number(path: Path, key: str, value: Any) -> float:
    """Return a finite number; text such as 1e-1, which YAML 1.1 does not take for a number, is accepted."""
    try:
        number = math.nan if isinstance(value, bool) else float(value)
    except (TypeError, ValueError, OverflowError):
        number = math.nan
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


def _origin(path: Path, settings: dict[str, Any]) -> tuple[float, float]:
    value = _need(path, settings, "origin")
    if not isinstance(value, list) or len(value) != 3:
        raise ConfigError(f"{path}: origin", f"must be [x, y, yaw], got {value!r}")
    x, y, yaw = (_as_number(path, f"origin[{i}]", part) for i, part in enumerate(value))
    if yaw != 0.0:
        raise ConfigError(f"{path}: origin[2]", f"a rotated map (yaw {yaw}) is not supported, yaw must be 0")
    return x, y


def _image_path(path: Path, settings: dict[str, Any]) -> Path:
    name = _need(path, settings, "image")
    if not isinstance(name, str):
        raise ConfigError(f"{path}: image", f"must be a file name, got {name!r}")
    return path.parent / name


def _read_grey(path: Path) -> npt.NDArray[np.float64]:
    """Return the image's grey values (H, W), 0 .. 255; colours are averaged, transparency is ignored."""
    try:
        with Image.open(path) as image:
            image.load()
            if image.mode.startswith("I"):
                return np.asarray(image, dtype=np.float64) * (255.0 / 65535.0)
            if image.mode in ("1", "L", "LA"):
                return np.asarray(image.convert("L"), dtype=np.float64)
            return np.asarray(np.mean(np.asarray(image.convert("RGB"), dtype=np.float64), axis=2))
    except (OSError, ValueError, SyntaxError, EOFError, Image.DecompressionBombError) as error:
        raise InputFileError(path, f"is missing, torn or not an image: {error}") from error
