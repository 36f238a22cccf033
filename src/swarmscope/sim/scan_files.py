"""Recorded scans from files: ``.npz`` (two layouts) and ``.csv``.

======================  =============================================================================
``.npz``, centimetres   ``ranges_cm`` (K, M) unsigned integers, 65535 = no return
``.npz``, metres        ``ranges_m`` (K, M) floats
both                    ``angle_min``, ``angle_increment`` [rad], ``range_min``, ``range_max`` [m];
                        optional ``stamp_s`` (K,), ``odom_xy_yaw`` (K, 3) [m, m, rad]
``.csv``                first ``# angle_min=... angle_increment=... range_min=... range_max=...``,
                        then one scan per line, metres, ``inf`` and ``nan`` allowed
======================  =============================================================================

As in REP-117, ``+inf`` is no return, NaN an invalid reading and ``-inf`` an object too close to measure.
"""

from __future__ import annotations

import math
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from swarmscope.errors import InputFileError, UnknownNameError, nearest_hint

MAX_BYTES = 1 << 30
NO_RETURN_CM = 65535
SCAN_FOLDER = Path(__file__).parent.parent / "data" / "scans"
HEADER_KEYS = ("angle_min", "angle_increment", "range_min", "range_max")


@dataclass(frozen=True)
class ScanLog:
    """``K`` scans of ``M`` beams; beam ``n`` looks at ``angle_min + n * increment`` (counter-clockwise)."""

    name: str
    ranges_m: npt.NDArray[np.float32]
    """(K, M) [m]; ``+inf`` = no return or beyond ``range_max``, NaN = invalid, 0 = too close to measure."""
    stamp_s: npt.NDArray[np.float64]
    """(K,) [s], never falling; NaN where the file does not say."""
    angle_min: float
    increment: float
    range_min: float
    range_max: float
    odom: npt.NDArray[np.float64] | None
    """(K, 3) x [m], y [m], yaw [rad] by odometry, or None."""


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
    readers = {".npz": _arrays_from_npz, ".csv": _arrays_from_csv}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise InputFileError(path, f"scans come as {' or '.join(readers)}, not '{path.suffix}'")
    try:
        return _checked_log(path.stem, reader(path))
    except _BadFile as error:
        raise InputFileError(path, str(error)) from None


def read_npz(path: Path) -> dict[str, npt.NDArray[Any]]:
    """Read all arrays of a ``.npz``; never unpickles; anything unsound raises ``InputFileError``."""
    try:
        return _arrays_from_npz(path)
    except _BadFile as error:
        raise InputFileError(path, str(error)) from None


class _BadFile(Exception):
    """Why a file is refused; carries the reason up to the one place that knows the path."""


def _arrays_from_npz(path: Path) -> dict[str, npt.NDArray[Any]]:
    _require_plain_file(path)
    try:
        _require_bounded_zip(path)
        with np.load(path, allow_pickle=False) as archive:
            return {key: np.asarray(archive[key]) for key in archive.files}
    except _BadFile:
        raise
    except MemoryError:
        raise _BadFile("claims more data than fits into memory: torn or foreign") from None
    except Exception as error:  # damaged archives make zipfile, zlib and numpy raise a dozen unrelated types
        raise _BadFile(f"torn or foreign .npz ({_first_line(error)})") from None


def _require_plain_file(path: Path) -> None:
    try:
        if path.is_dir():
            raise _BadFile("is a folder")
        if path.stat().st_size == 0:
            raise _BadFile("is empty")
    except OSError as error:
        raise _BadFile(error.strerror or "cannot be read") from None


def _require_bounded_zip(path: Path) -> None:
    """Refuse an archive that would unpack to more than ``MAX_BYTES``."""
    with zipfile.ZipFile(path) as archive:
        if sum(member.file_size for member in archive.infolist()) > MAX_BYTES:
            raise _BadFile(f"unpacks to more than {MAX_BYTES >> 20} MiB")


def _first_line(error: Exception) -> str:
    return (str(error).splitlines() or [type(error).__name__])[0]


def _arrays_from_csv(path: Path) -> dict[str, npt.NDArray[Any]]:
    _require_plain_file(path)
    try:
        if path.stat().st_size > MAX_BYTES:
            raise _BadFile(f"is larger than {MAX_BYTES >> 20} MiB")
        text = path.read_text(encoding="utf-8-sig")
    except OSError as error:
        raise _BadFile(error.strerror or "cannot be read") from None
    except UnicodeDecodeError:
        raise _BadFile("is not text") from None
    if not text.endswith("\n"):
        raise _BadFile("the last line is not ended: torn (if it is complete, end it with a newline)")
    arrays: dict[str, npt.NDArray[Any]] = {}
    rows: list[list[float]] = []
    for number, line in enumerate(text.split("\n"), start=1):
        stripped = line.strip()
        if stripped.startswith("#"):
            arrays.update(_header_values(stripped[1:], number))
        elif stripped:
            rows.append(_row_values(stripped, number, len(rows[0]) if rows else None))
    arrays["ranges_m"] = np.array(rows, dtype=np.float64).reshape(len(rows), -1 if rows else 0)
    return arrays


def _header_values(header: str, line: int) -> dict[str, npt.NDArray[Any]]:
    """Return the ``key=value`` pairs of a comment line; words without ``=`` are remarks."""
    values = {}
    for word in header.split():
        key, equals, value = word.partition("=")
        if not equals:
            continue
        if key not in HEADER_KEYS:
            raise _BadFile(f"line {line}: unknown key '{key}'{nearest_hint(key, HEADER_KEYS)}")
        values[key] = np.array(_number(value, line))
    return values


def _row_values(row: str, line: int, length: int | None) -> list[float]:
    values = [_number(word, line) for word in row.split(",")]
    if length is not None and len(values) != length:
        raise _BadFile(f"line {line}: {len(values)} readings where the first scan has {length}")
    return values


def _number(word: str, line: int) -> float:
    try:
        return float(word)
    except ValueError:
        raise _BadFile(f"line {line}: '{word.strip()[:20]}' is not a number") from None


def _checked_log(name: str, arrays: Mapping[str, npt.NDArray[Any]]) -> ScanLog:
    angle_min, increment, range_min, range_max = (_scalar(arrays, key) for key in HEADER_KEYS)
    if not 0.0 <= range_min < range_max:
        raise _BadFile(f"range_min {range_min:g} and range_max {range_max:g} are not 0 <= min < max")
    if increment <= 0.0:
        raise _BadFile(f"angle_increment is {increment:g}; beams must run counter-clockwise")
    ranges = _checked_ranges(_raw_ranges(arrays), range_max)
    scans, beams = ranges.shape
    if (beams - 1) * increment > 2.0 * math.pi + 1e-3:
        raise _BadFile(f"{beams} beams of {increment:g} rad are more than one turn")
    stamps = _optional(arrays, "stamp_s", (scans,))
    if stamps is not None and np.any(np.diff(stamps) < 0.0):
        raise _BadFile("stamp_s runs backwards")
    return ScanLog(
        name=name,
        ranges_m=ranges,
        stamp_s=np.full(scans, np.nan) if stamps is None else stamps,
        angle_min=angle_min,
        increment=increment,
        range_min=range_min,
        range_max=range_max,
        odom=_optional(arrays, "odom_xy_yaw", (scans, 3)),
    )


def _scalar(arrays: Mapping[str, npt.NDArray[Any]], key: str) -> float:
    if key not in arrays:
        raise _BadFile(f"has no '{key}'")
    value = arrays[key]
    if value.size != 1 or value.dtype.kind not in "iuf" or not np.isfinite(value).all():
        raise _BadFile(f"'{key}' is not one finite number")
    return float(value.reshape(()))


def _raw_ranges(arrays: Mapping[str, npt.NDArray[Any]]) -> npt.NDArray[np.float64]:
    """Return the readings as float64 metres, ``+inf`` where there was no return."""
    present = [key for key in ("ranges_cm", "ranges_m") if key in arrays]
    if len(present) != 1:
        raise _BadFile("needs exactly one of 'ranges_cm' and 'ranges_m'")
    raw = arrays[present[0]]
    if raw.ndim != 2 or raw.size == 0:
        raise _BadFile(f"'{present[0]}' has shape {raw.shape}; it must be (scans, beams), both at least 1")
    if present[0] == "ranges_m":
        if raw.dtype.kind != "f":
            raise _BadFile(f"'ranges_m' holds {raw.dtype}; it must hold floats")
        return raw.astype(np.float64)
    if raw.dtype.kind != "u":
        raise _BadFile(f"'ranges_cm' holds {raw.dtype}; it must hold unsigned integers")
    return np.where(raw == NO_RETURN_CM, np.inf, raw / 100.0)


def _checked_ranges(raw: npt.NDArray[np.float64], range_max: float) -> npt.NDArray[np.float32]:
    negative = np.argwhere((raw < 0.0) & np.isfinite(raw))
    if negative.size:
        scan, beam = negative[0]
        raise _BadFile(f"scan {scan}, beam {beam}: negative range {raw[scan, beam]:g} m")
    if np.isnan(raw).all():
        raise _BadFile("holds no valid reading, only NaN")
    beyond = raw > range_max * (1.0 + 1e-6)
    return np.where(beyond, np.inf, np.where(raw == -np.inf, 0.0, raw)).astype(np.float32)


def _optional(
    arrays: Mapping[str, npt.NDArray[Any]], key: str, shape: tuple[int, ...]
) -> npt.NDArray[np.float64] | None:
    value = arrays.get(key)
    if value is None:
        return None
    if value.shape != shape or value.dtype.kind not in "iuf":
        raise _BadFile(f"'{key}' is {value.dtype} {value.shape}; it must be numbers of shape {shape}")
    numbers = value.astype(np.float64)
    if not np.isfinite(numbers).all():
        raise _BadFile(f"'{key}' holds NaN or infinity")
    return numbers
