"""What all map files have in common: text that can be read, grids that can be."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
from pydantic import ValidationError

from swarmscope.errors import ConfigError
from swarmscope.sim.world import Grid, grid_from_solid

MOST_CELLS = 40_000_000
"""A map has at most so many cells, 316 m by 316 m at 5 cm: two bytes each in a run, and a few hundred megabytes while
it is read."""
MOST_RUNS = 2_000_000
"""Its rows hold at most so many solid pieces: a photograph has more."""


def check_size(path: Path, width: int, height: int) -> None:
    """Raise a ConfigError for a map that is too large."""
    if width * height > MOST_CELLS:
        raise ConfigError(str(path), f"{width} x {height} cells, at most {MOST_CELLS} are possible: use larger cells")


def as_grid(
    path: Path, solid: npt.NDArray[np.bool_], resolution: float, origin: tuple[float, float], yaw: float = 0.0
) -> Grid:
    """Return cells (H, W), row 0 at the bottom, as a grid. Errors: ConfigError with file and key."""
    pieces = int(np.count_nonzero(solid[:, :1])) + int(np.count_nonzero(solid[:, 1:] > solid[:, :-1]))
    if pieces > MOST_RUNS:
        raise ConfigError(str(path), f"{pieces} solid pieces of rows, at most {MOST_RUNS}: is it a photograph?")
    try:
        return grid_from_solid(solid, resolution, origin, yaw)
    except ValidationError as error:
        first = error.errors()[0]
        where = ".".join(str(part) for part in first["loc"])
        raise ConfigError(f"{path}: {where}" if where else str(path), first["msg"]) from error
