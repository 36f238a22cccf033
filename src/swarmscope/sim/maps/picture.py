"""How a map_server picture says which cells are free."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
import numpy.typing as npt
from PIL import Image

from swarmscope.errors import InputFileError
from swarmscope.sim.maps.files import check_size
from swarmscope.texts import check_regular

ROWS_AT_ONCE = 512
MOST_BYTES = 1 << 30
FULL_16 = 65535.0
FULL_8 = 255.0
FREE_RAW = 0.0

Mode = Literal["trinary", "scale", "raw"]
MODES: tuple[Mode, ...] = ("trinary", "scale", "raw")


class Reading(NamedTuple):
    """How grey values become cells."""

    mode: Mode = "trinary"
    negate: bool = False
    free_thresh: float = 0.196
    """Below so much of occupancy a cell is free."""


def free_cells(path: Path, reading: Reading) -> npt.NDArray[np.bool_]:
    """Return which pixels (H, W), row 0 at the top, are free: nav2's map_io, whatever it does not call free is solid.

    Occupancy is 1 - brightness, or brightness with ``negate``. ``trinary`` averages the opacity with the colours where
    there is any, so that a transparent pixel is not free; in ``scale`` a pixel that is not opaque is unknown; ``raw``
    takes the brightness for the cell's value, 0 is free, 1 to 100 more or less occupied, more unknown.
    Errors: InputFileError, ConfigError for a picture that is too large.
    """
    check_regular(path, MOST_BYTES)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # there is a limit of our own
            with Image.open(path) as image:
                check_size(path, *image.size)
                image.load()
                return np.concatenate([_is_free(values, full, reading) for values, full in _strips(image)])
    except Image.DecompressionBombError:
        raise InputFileError(path, "is far too large a picture") from None
    except (OSError, ValueError, SyntaxError, EOFError, MemoryError) as error:
        raise InputFileError(path, f"is missing, torn or not an image: {error}") from error


def _strips(image: Image.Image) -> Iterator[tuple[npt.NDArray[np.integer[Any]], float]]:
    """Yield channels (rows, W, 1, 3 or 4), a few rows at a time, and the value that is full."""
    if image.mode.startswith("I"):
        wanted, full = image, FULL_16
    else:
        has_alpha = image.mode in ("RGBA", "LA", "PA", "La", "RGBa") or "transparency" in image.info
        wanted, full = image.convert("RGBA" if has_alpha else "RGB"), FULL_8
    width, height = image.size
    for top in range(0, height, ROWS_AT_ONCE):
        part = np.asarray(wanted.crop((0, top, width, min(height, top + ROWS_AT_ONCE))))
        yield part.reshape(part.shape[0], width, -1), full


def _is_free(values: npt.NDArray[np.integer[Any]], full: float, reading: Reading) -> npt.NDArray[np.bool_]:
    """Return which of the pixels (rows, W, channels) are free."""
    channels = [values[:, :, k] / full for k in range(values.shape[2])]
    opaque = channels[3] >= 1.0 if len(channels) == 4 else True
    counted = channels if reading.mode == "trinary" else channels[:3]
    shade = sum(counted[1:], counted[0]) / len(counted)
    if reading.mode == "raw":
        return np.asarray(np.round(shade * FULL_8) == FREE_RAW)
    occupancy = shade if reading.negate else 1.0 - shade
    free = occupancy < reading.free_thresh
    return np.asarray(free & opaque if reading.mode == "scale" else free)
