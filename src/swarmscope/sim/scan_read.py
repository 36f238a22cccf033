"""What readers of scan files are asked for and what they hand over, unchecked."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Arrays = dict[str, npt.NDArray[Any]]

HEADER_KEYS = ("angle_min", "angle_increment", "range_min", "range_max")
MOST_READINGS = 20_000_000
"""More are not kept: 55,000 scans of 360."""


class BadFile(Exception):
    """Why a file is refused; carries the reason up to the one place that knows the path."""


class Ask(NamedTuple):
    """What is to be read of a file."""

    topic: str | None = None
    """Of a bag; None: the only one with scans."""
    every: int = 1
    """Only every so manieth scan."""
    fov_deg: float | None = None
    """Field of view, for files that do not say where their readings look; 360 is a closed circle [degrees]."""
    first_deg: float | None = None
    """Direction of the first reading then; None: half the field to the right [degrees]."""


class Read(NamedTuple):
    """What was read."""

    arrays: Arrays
    """Header values, ``ranges_m`` (K, M) or another unit's; ``lengths``, ``geometry``, ``time_increment``, ``stamp_s``,
    ``odom_xy_yaw`` if known."""
    notes: tuple[str, ...] = ()


def padded(rows: list[npt.NDArray[Any]]) -> Arrays:
    """Return ``ranges_m`` (K, M), NaN where a scan has ended, and how many readings each has."""
    lengths = np.array([len(row) for row in rows], np.int64)
    filled = np.full((len(rows), int(lengths.max(initial=0))), np.nan)
    if filled.size > MOST_READINGS:
        raise BadFile(f"holds {filled.size} readings; at most {MOST_READINGS} are read (--every 10: every tenth scan)")
    with np.errstate(invalid="ignore"):  # NaN of all kinds
        for k, row in enumerate(rows):
            filled[k, : len(row)] = row
    return {"ranges_m": filled, "lengths": lengths}


def as_stamps(stamps: list[float]) -> Arrays:
    """Return ``stamp_s`` from 0 on; nothing where a stamp is missing or time runs backwards."""
    values = np.array(stamps)
    sound = values.size > 0 and np.isfinite(values).all() and not np.any(np.diff(values) < 0.0)
    return {"stamp_s": values - values[0]} if sound else {}
