"""Recorded scans from files: ``.npz`` (two layouts) and text.

======================  =============================================================================
``.npz``, centimetres   ``ranges_cm`` (K, M) unsigned integers, 65535 = no return
``.npz``, metres        ``ranges_m`` (K, M) floats
both                    ``angle_min``, ``angle_increment`` [rad], ``range_min``, ``range_max`` [m];
                        optional ``stamp_s`` (K,), ``odom_xy_yaw`` (K, 3) [m, m, rad]
``.csv``, ``.txt``      first ``# angle_min=... angle_increment=... range_min=... range_max=...`` (other fields of a
                        LaserScan may stand there), then one scan per line, metres, ``inf`` and ``nan`` allowed,
                        separated by commas, semicolons or spaces; or a LaserScan table as ROS tools export it
``.log``, ``.clf``      CARMEN: ``FLASER`` or ``ROBOTLASER1``
======================  =============================================================================

As in REP-117, ``+inf`` is no return, NaN an invalid reading and ``-inf`` an object too close to measure. Beams may run
clockwise (a negative increment), and scans may be shorter than others: readings that are missing are NaN.
"""

from __future__ import annotations

import math
import warnings
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from swarmscope.errors import InputFileError, UnknownNameError
from swarmscope.sim.scan_tables import HEADER_KEYS, BadFile, arrays_from_text
from swarmscope.texts import check_regular, read_text

MAX_BYTES = 1 << 30
NO_RETURN_CM = 65535
LARGEST_FIELD = 2.0 * math.pi * 1.02
"""Readings cover no more than this [rad]; some LiDARs give a beam or two twice."""
MILLI, MOST = 1000.0, 0.9
SCAN_FOLDER = Path(__file__).parent.parent / "data" / "scans"


@dataclass(frozen=True)
class ScanLog:
    """``K`` scans of ``M`` beams; beam ``n`` looks at ``angle_min + n * increment`` (counter-clockwise)."""

    name: str
    ranges_m: npt.NDArray[np.float32]
    """(K, M) [m] as in the file; ``+inf`` = no return or beyond ``range_max``, NaN = invalid, 0 = too close to measure;
    negative ones are as they were."""
    stamp_s: npt.NDArray[np.float64]
    """(K,) [s], never falling; NaN where the file does not say."""
    angle_min: float
    increment: float
    """Negative where they run clockwise."""
    range_min: float
    range_max: float
    odom: npt.NDArray[np.float64] | None
    """(K, 3) x [m], y [m], yaw [rad] by odometry, or None."""
    lengths: npt.NDArray[np.int64] | None = None
    """(K,) readings of each scan, the first ones; None: M."""
    notes: tuple[str, ...] = ()
    """What was strange about the file, and how it was read."""


def scan_file(name: str) -> Path:
    """Return the scan file called ``name``: a path, or scans that come with the package."""
    path = Path(name)
    if path.suffix or len(path.parts) > 1:
        return path
    packaged = {file.stem: file for file in SCAN_FOLDER.glob("*.npz")}
    if name not in packaged:
        raise UnknownNameError("scans", name, packaged)
    return packaged[name]


def load_scans(path: str | Path) -> ScanLog:
    """Read recorded scans; any file that is not sound raises ``InputFileError`` with the reason."""
    path = Path(path)
    readers = {".npz": _arrays_from_npz} | dict.fromkeys((".csv", ".txt", ".log", ".clf"), _arrays_from_table)
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputFileError(path, f"scans come as {', '.join(readers)}, not '{path.suffix}'")
    try:
        return _checked_log(path.stem, reader(path))
    except BadFile as error:
        raise InputFileError(path, str(error)) from None


def read_npz(path: Path) -> dict[str, npt.NDArray[Any]]:
    """Read all arrays of a ``.npz``; never unpickles; anything unsound raises ``InputFileError``."""
    try:
        return _arrays_from_npz(path)
    except BadFile as error:
        raise InputFileError(path, str(error)) from None


def _arrays_from_npz(path: Path) -> dict[str, npt.NDArray[Any]]:
    check_regular(path, None)
    if path.stat().st_size == 0:
        raise BadFile("is empty")
    try:
        _require_bounded_zip(path)
        with warnings.catch_warnings(action="ignore"), np.load(path, allow_pickle=False) as archive:
            return {key: np.asarray(archive[key]) for key in archive.files}
    except BadFile:
        raise
    except MemoryError:
        raise BadFile("claims more data than fits into memory: torn or foreign") from None
    except Exception as error:  # damaged archives make zipfile, zlib and numpy raise a dozen unrelated types
        raise BadFile(f"torn or foreign .npz ({_first_line(error)})") from None


def _require_bounded_zip(path: Path) -> None:
    """Refuse an archive that would unpack to more than ``MAX_BYTES``."""
    with zipfile.ZipFile(path) as archive:
        if sum(member.file_size for member in archive.infolist()) > MAX_BYTES:
            raise BadFile(f"unpacks to more than {MAX_BYTES >> 20} MiB")


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


def _arrays_from_table(path: Path) -> dict[str, npt.NDArray[Any]]:
    text = read_text(path, MAX_BYTES)
    if not text:
        raise BadFile("is empty")
    if not text.endswith("\n"):
        raise BadFile("the last line is not ended: torn (if it is complete, end it with a newline)")
    return arrays_from_text(text)


def _checked_log(name: str, arrays: Mapping[str, npt.NDArray[Any]]) -> ScanLog:
    angle_min, increment, range_min, range_max = (_scalar(arrays, key) for key in HEADER_KEYS)
    if not 0.0 <= range_min < range_max:
        raise BadFile(f"range_min {range_min:g} and range_max {range_max:g} are not 0 <= min < max")
    raw = _raw_ranges(arrays)
    scans, beams = raw.shape
    notes = []
    if abs(increment) * (beams - 1) > LARGEST_FIELD and math.radians(abs(increment)) * (beams - 1) <= LARGEST_FIELD:
        notes.append(f"angle_increment {increment:g} is more than a turn in radians: angles are read as degrees")
        angle_min, increment = math.radians(angle_min), math.radians(increment)
    if increment == 0.0:
        raise BadFile("angle_increment is 0")
    if (beams - 1) * abs(increment) > LARGEST_FIELD:
        raise BadFile(f"{beams} beams of {increment:g} rad are more than one turn")
    if _are_millimetres(raw, range_min, range_max):
        notes.append(f"readings lie beyond range_max {range_max:g} m: they are read as millimetres")
        raw = raw / MILLI
    ranges = _checked_ranges(raw, range_max)
    stamps = _optional(arrays, "stamp_s", (scans,))
    if stamps is not None and np.any(np.diff(stamps) < 0.0):
        raise BadFile("stamp_s runs backwards")
    return ScanLog(
        name=name,
        ranges_m=ranges,
        stamp_s=np.full(scans, np.nan) if stamps is None else stamps,
        angle_min=angle_min,
        increment=increment,
        range_min=range_min,
        range_max=range_max,
        odom=_optional(arrays, "odom_xy_yaw", (scans, 3)),
        lengths=arrays.get("lengths"),
        notes=tuple(notes),
    )


def _are_millimetres(raw: npt.NDArray[np.float64], range_min: float, range_max: float) -> bool:
    """Tell whether nearly all readings are far beyond the longest range, and within it as millimetres."""
    readings = raw[np.isfinite(raw) & (raw > 0.0)]
    if readings.size == 0 or np.mean(readings > range_max) < MOST:
        return False
    within = (readings / MILLI >= range_min) & (readings / MILLI <= range_max)
    return bool(np.mean(within) >= MOST)


def _scalar(arrays: Mapping[str, npt.NDArray[Any]], key: str) -> float:
    if key not in arrays:
        raise BadFile(f"has no '{key}'")
    value = arrays[key]
    if value.size != 1 or value.dtype.kind not in "iuf" or not np.isfinite(value).all():
        raise BadFile(f"'{key}' is not one finite number")
    return float(value.reshape(()))


def _raw_ranges(arrays: Mapping[str, npt.NDArray[Any]]) -> npt.NDArray[np.float64]:
    """Return the readings as float64 metres, ``+inf`` where there was no return."""
    present = [key for key in ("ranges_cm", "ranges_m") if key in arrays]
    if len(present) != 1:
        raise BadFile("needs exactly one of 'ranges_cm' and 'ranges_m'")
    raw = arrays[present[0]]
    if raw.ndim != 2 or raw.size == 0:
        raise BadFile(f"'{present[0]}' has shape {raw.shape}; it must be (scans, beams), both at least 1")
    if present[0] == "ranges_m":
        if raw.dtype.kind != "f":
            raise BadFile(f"'ranges_m' holds {raw.dtype}; it must hold floats")
        return raw.astype(np.float64)
    if raw.dtype.kind != "u":
        raise BadFile(f"'ranges_cm' holds {raw.dtype}; it must hold unsigned integers")
    return np.where(raw == NO_RETURN_CM, np.inf, raw / 100.0)


def _checked_ranges(raw: npt.NDArray[np.float64], range_max: float) -> npt.NDArray[np.float32]:
    if np.isnan(raw).all():
        raise BadFile("holds no valid reading, only NaN")
    beyond = raw > range_max * (1.0 + 1e-6)
    return np.where(beyond, np.inf, np.where(raw == -np.inf, 0.0, raw)).astype(np.float32)


def _optional(
    arrays: Mapping[str, npt.NDArray[Any]], key: str, shape: tuple[int, ...]
) -> npt.NDArray[np.float64] | None:
    value = arrays.get(key)
    if value is None:
        return None
    if value.shape != shape or value.dtype.kind not in "iuf":
        raise BadFile(f"'{key}' is {value.dtype} {value.shape}; it must be numbers of shape {shape}")
    numbers = value.astype(np.float64)
    if not np.isfinite(numbers).all():
        raise BadFile(f"'{key}' holds NaN or infinity")
    return numbers
