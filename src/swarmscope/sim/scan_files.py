"""Recorded scans from files: ``.npz``, text, ROS bags.

========================  ===========================================================================================
``.npz``                  ``ranges_m`` (K, M) floats, or ``ranges_cm``, ``ranges_mm`` unsigned integers, 65535 = no
                          return; ``angle_min``, ``angle_increment`` [rad], ``range_min``, ``range_max`` [m]; optional
                          ``stamp_s`` (K,), ``odom_xy_yaw`` (K, 3) [m, m, rad], ``time_increment`` [s]
``.csv``, ``.txt``        first ``# angle_min=... angle_increment=... range_min=... range_max=...`` (other fields of a
                          LaserScan may stand there), then one scan per line, metres, ``inf`` and ``nan`` allowed,
                          separated by commas, semicolons or spaces; or a LaserScan table as ROS tools export it
``.log``, ``.clf``        CARMEN: ``FLASER`` or ``ROBOTLASER1``
folder, ``.db3``,         rosbag2, MCAP, ROS 1 (``scan_bags``)
``.mcap``, ``.bag``
========================  ===========================================================================================

As in REP-117, ``+inf`` is no return, NaN an invalid reading and ``-inf`` an object too close to measure. Beams may run
clockwise (a negative increment), and scans may be shorter than others: readings that are missing are NaN.
"""

from __future__ import annotations

import math
import warnings
import zipfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from swarmscope.errors import ConfigError, InputFileError, UnknownNameError
from swarmscope.onboard.lidar import LONGEST_M
from swarmscope.onboard.readings import MILLI, are_millimetres
from swarmscope.sim.scan_bags import SUFFIXES as BAG_SUFFIXES
from swarmscope.sim.scan_bags import is_bag, read_bag
from swarmscope.sim.scan_read import HEADER_KEYS, Arrays, Ask, BadFile, Read
from swarmscope.sim.scan_tables import read_text_scans
from swarmscope.texts import check_regular, read_text

MAX_BYTES = 1 << 30
TEXT_BYTES = 1 << 28
NO_RETURN = 65535
UNITS = {"ranges_m": 1.0, "ranges_cm": 100.0, "ranges_mm": 1000.0}
"""How many of them are a metre."""
PER_SCAN = (*UNITS, "stamp_s", "odom_xy_yaw")
FARTHEST_M = 100.0
"""Hardly a 2D LiDAR sees farther."""
FINEST_RAD = 1e-4
"""Readings are farther apart: half a turn has so many places in tables of int16."""
MOST_TURNS = 100.0
"""No direction is larger [rad]."""
NO_HEADER = "say it with --fov DEGREES, or in a line '# angle_min=.. angle_increment=.. range_min=.. range_max=..'"
REMEDIES = dict.fromkeys((".gz", ".zip", ".bz2", ".xz", ".7z", ".zst"), "; unpack it first")
REMEDIES |= dict.fromkeys((".xlsx", ".xls", ".ods"), "; save it as CSV")
LARGEST_FIELD = 2.0 * math.pi * 1.02
"""Readings cover no more than this [rad]; some LiDARs give a beam or two twice."""
SCAN_FOLDER = Path(__file__).parent.parent / "data" / "scans"


@dataclass(frozen=True)
class ScanLog:
    """``K`` scans of ``M`` beams; beam ``n`` looks at ``angle_min + n * increment`` (counter-clockwise)."""

    name: str
    ranges_m: npt.NDArray[np.float32]
    """(K, M) [m] as in the file; ``+inf`` = no return or beyond ``range_max``, NaN and negative = invalid, ``-inf`` and
    what is below ``range_min`` = too close to measure."""
    stamp_s: npt.NDArray[np.float64]
    """(K,) [s], never falling; NaN where the file does not say."""
    angle_min: float
    increment: float
    """Negative where they run clockwise."""
    range_min: float
    range_max: float
    odom: npt.NDArray[np.float64] | None
    """(K, 3) x [m], y [m], yaw [rad] by odometry, or None."""
    time_increment: float = 0.0
    """From one reading to the next [s]; ``stamp_s`` is the first one's."""
    unit_m: float = 1.0
    """What 1 in the file is [m]."""
    geometry: npt.NDArray[np.float64] | None = None
    """(K, 2) ``angle_min`` and ``increment`` of each scan; None: all are alike."""
    lengths: npt.NDArray[np.int64] | None = None
    """(K,) readings of each scan, the first ones; None: M."""
    notes: tuple[str, ...] = ()
    """What was strange about the file, and how it was read."""


def scan_file(name: str) -> Path:
    """Return the scan file called ``name``: a path, or scans that come with the package."""
    path = Path(name)
    if path.suffix or len(path.parts) > 1 or path.is_dir():
        return path
    packaged = {file.stem: file for file in SCAN_FOLDER.glob("*.npz")}
    if name not in packaged:
        raise UnknownNameError("scans", name, packaged)
    return packaged[name]


def load_scans(path: str | Path, ask: Ask = Ask()) -> ScanLog:  # noqa: B008  a tuple
    """Read recorded scans; any file that is not sound raises ``InputFileError`` with the reason."""
    path = Path(path)
    if ask.every < 1:
        raise ConfigError("--every", f"must be at least 1, not {ask.every}")
    if ask.fov_deg is not None and not 0.0 < ask.fov_deg <= 360.0:
        raise ConfigError("--fov", f"must be above 0 and at most 360 degrees, not {ask.fov_deg:g}")
    if ask.first_deg is not None and not math.isfinite(ask.first_deg):
        raise ConfigError("--first", f"must be a finite number of degrees, not {ask.first_deg:g}")
    if ask.topic is not None and not is_bag(path):
        raise ConfigError("--topic", f"{path} is no bag: it has no topics")
    try:
        return _checked_log(path.stem, _reader_of(path)(path, ask), ask)
    except BadFile as error:
        raise InputFileError(path, str(error)) from None


def _reader_of(path: Path) -> Callable[[Path, Ask], Read]:
    """Return what reads this kind of file; raises BadFile."""
    kind = path.suffix.lower()
    readers = {".npz": _read_npz} | dict.fromkeys((".csv", ".tsv", ".txt", ".log", ".clf"), _read_table)
    if is_bag(path):
        return read_bag
    if kind in readers:
        return readers[kind]
    remedy = REMEDIES.get(kind, "")
    if path.name == "metadata.yaml":
        remedy = f"; of a rosbag2 name the folder, {path.parent}"
    if path.is_dir():
        raise BadFile("is a folder, and no rosbag2: it has no metadata.yaml")
    raise BadFile(f"scans come as {', '.join((*readers, *BAG_SUFFIXES))}, not '{path.suffix}'{remedy}")


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


def _read_npz(path: Path, ask: Ask) -> Read:
    arrays = _arrays_from_npz(path)
    scans = {len(value) for key, value in arrays.items() if key in PER_SCAN and value.ndim > 0}
    if ask.every > 1 and len(scans) == 1:
        arrays |= {key: arrays[key][:: ask.every] for key in PER_SCAN if key in arrays and arrays[key].ndim > 0}
    return Read({key: value for key, value in arrays.items() if key not in ("lengths", "geometry")})


def _read_table(path: Path, ask: Ask) -> Read:
    text = read_text(path, TEXT_BYTES)
    if not text:
        raise BadFile("is empty")
    if not text.endswith("\n"):
        raise BadFile("the last line is not ended: torn (if it is complete, end it with a newline)")
    return read_text_scans(text, ask)


def _checked_log(name: str, read: Read, ask: Ask) -> ScanLog:
    arrays, notes = dict(read.arrays), list(read.notes)
    raw, unit_m = _raw_ranges(arrays)
    scans, beams = raw.shape
    if ask.fov_deg is not None:
        arrays = _with_field(arrays, beams, ask)
    elif ask.first_deg is not None:
        raise ConfigError("--first", "says where readings begin whose --fov is given")
    elif not set(HEADER_KEYS) & set(arrays):
        raise BadFile(f"has no 'angle_min': where do its {beams} readings look? {NO_HEADER}")
    angle_min, increment, range_min, range_max = (_scalar(arrays, key) for key in HEADER_KEYS)
    range_max = min(range_max, LONGEST_M)
    if not 0.0 <= range_min < range_max:
        raise BadFile(f"range_min {range_min:g} and range_max {range_max:g} are not 0 <= min < max")
    geometry = arrays.get("geometry", np.array([[angle_min, increment]]))
    geometry, said = in_radians(geometry, beams)
    notes += said
    for first, step in np.unique(geometry, axis=0).tolist():
        _check_rays(first, step, beams)
    if are_millimetres(raw, range_min, range_max):
        notes.append(f"readings lie beyond range_max {range_max:g} m: they are read as millimetres")
        raw, unit_m = raw / MILLI, unit_m / MILLI
    ranges = _checked_ranges(raw, range_max)
    stamps = _optional(arrays, "stamp_s", (scans,))
    if stamps is not None and np.any(np.diff(stamps) < 0.0):
        raise BadFile("stamp_s runs backwards")
    return ScanLog(
        name=name,
        ranges_m=ranges,
        stamp_s=np.full(scans, np.nan) if stamps is None else stamps,
        angle_min=float(geometry[0, 0]),
        increment=float(geometry[0, 1]),
        range_min=range_min,
        range_max=range_max,
        odom=_optional(arrays, "odom_xy_yaw", (scans, 3)),
        time_increment=_scalar(arrays, "time_increment") if "time_increment" in arrays else 0.0,
        unit_m=unit_m,
        geometry=geometry if len(geometry) == scans > 1 else None,
        lengths=arrays.get("lengths"),
        notes=tuple(notes),
    )


def _with_field(arrays: Arrays, beams: int, ask: Ask) -> Arrays:
    """Return the arrays with the directions that the user says; readings lie within 100 m if nobody says how far."""
    assert ask.fov_deg is not None  # noqa: S101
    step = ask.fov_deg / (beams if ask.fov_deg >= 360.0 else max(1, beams - 1))
    first = -0.5 * ask.fov_deg if ask.first_deg is None else ask.first_deg
    told = {"angle_min": np.radians(first), "angle_increment": np.radians(step)}
    rest = {key: value for key, value in arrays.items() if key != "geometry"}
    return {"range_min": np.array(0.0), "range_max": np.array(FARTHEST_M)} | rest | told


def in_radians(geometry: npt.NDArray[np.float64], beams: int) -> tuple[npt.NDArray[np.float64], list[str]]:
    """Return first directions and increments (K, 2) in radians, and what was said in degrees."""
    first, step = (float(value) for value in geometry[0])
    field = abs(step) * (beams - 1)
    degrees = abs(step) > 0.0 and math.radians(field) <= LARGEST_FIELD
    if field > LARGEST_FIELD and degrees:
        return np.radians(geometry), [
            f"angle_increment {step:g} is more than a turn in radians: angles are read as degrees"
        ]
    if abs(first) > LARGEST_FIELD and abs(math.radians(first)) <= LARGEST_FIELD:
        return np.column_stack([np.radians(geometry[:, 0]), geometry[:, 1]]), [
            f"angle_min {first:g} is more than a turn in radians: it is read as degrees, angle_increment as radians"
        ]
    return geometry, []


def _check_rays(first: float, step: float, beams: int) -> None:
    if step == 0.0:
        raise BadFile("angle_increment is 0")
    if abs(step) < FINEST_RAD:
        raise BadFile(f"angle_increment {step:g}: readings lie too close together")
    if (beams - 1) * abs(step) > LARGEST_FIELD:
        raise BadFile(f"{beams} beams of {step:g} rad are more than one turn")
    if abs(first) > MOST_TURNS:
        raise BadFile(f"angle_min {first:g} is no direction")


def _scalar(arrays: Mapping[str, npt.NDArray[Any]], key: str) -> float:
    if key not in arrays:
        raise BadFile(f"has no '{key}'; {NO_HEADER}")
    value = np.asarray(arrays[key])
    if value.size != 1 or value.dtype.kind not in "iuf":
        raise BadFile(f"'{key}' is not one finite number")
    number = float(value.reshape(()))
    if not (math.isfinite(number) or (key == "range_max" and number == math.inf)):
        raise BadFile(f"'{key}' is not one finite number")
    return number


def _raw_ranges(arrays: Mapping[str, npt.NDArray[Any]]) -> tuple[npt.NDArray[np.float64], float]:
    """Return the readings as float64 metres, ``+inf`` where there was no return, and what 1 is in the file [m]."""
    present = [key for key in UNITS if key in arrays]
    if len(present) != 1:
        raise BadFile(f"needs exactly one of {', '.join(UNITS)}")
    key, raw = present[0], arrays[present[0]]
    if raw.ndim != 2 or raw.size == 0:
        raise BadFile(f"'{key}' has shape {raw.shape}; it must be (scans, beams), both at least 1")
    if key == "ranges_m":
        if raw.dtype.kind != "f":
            raise BadFile(f"'ranges_m' holds {raw.dtype}; it must hold floats (whole millimetres are 'ranges_mm')")
        return raw.astype(np.float64), 1.0
    if raw.dtype.kind != "u":
        raise BadFile(f"'{key}' holds {raw.dtype}; it must hold unsigned integers")
    return np.where(raw == NO_RETURN, np.inf, raw / UNITS[key]), 1.0 / UNITS[key]


def _checked_ranges(raw: npt.NDArray[np.float64], range_max: float) -> npt.NDArray[np.float32]:
    if np.isnan(raw).all():
        raise BadFile("holds no valid reading, only NaN")
    beyond = raw > range_max * (1.0 + 1e-6)
    with np.errstate(over="ignore"):  # farther than float32 can say is no return
        return np.where(beyond, np.inf, raw).astype(np.float32)


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
