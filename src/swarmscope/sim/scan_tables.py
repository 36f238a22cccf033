"""Scans from text: one scan a line as people write them, the tables that ROS tools export, CARMEN logs."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from swarmscope.errors import nearest_hint

HEADER_KEYS = ("angle_min", "angle_increment", "range_min", "range_max")
MESSAGE_KEYS = (*HEADER_KEYS, "angle_max", "time_increment", "scan_time", "frame_id", "seq", "stamp")
"""What a LaserScan's header may hold; only `HEADER_KEYS` are used."""
RANGE_COLUMN = re.compile(r"(?:field\.)?ranges[\[._]?(\d+)\]?")
NANOSECONDS = 1e-9
STAMPS = ("header.stamp", "stamp", "%time", "time")

Arrays = dict[str, npt.NDArray[Any]]


class BadFile(Exception):
    """Why a file is refused; carries the reason up to the one place that knows the path."""


class _Row(NamedTuple):
    line: int
    values: list[float]


def arrays_from_text(text: str) -> Arrays:
    """Return header values and ``ranges_m`` (K, M) of text; missing readings at a line's end are NaN.

    Raises BadFile with the line.
    """
    if text.lstrip().startswith(CARMEN) or any(line.startswith(CARMEN) for line in text.splitlines()[:200]):
        return _from_carmen(text)
    found: Arrays = {}
    rows: list[_Row] = []
    lines = enumerate(text.split("\n"), start=1)
    for number, line in lines:
        stripped = line.strip()
        if stripped.startswith("#"):
            found.update(_header_values(stripped[1:], number))
        elif stripped and not rows and _is_export(stripped):
            return found | _from_export(stripped, lines)
        elif stripped:
            rows.append(_Row(number, _readings(stripped, number)))
    return found | _padded([row.values for row in rows])


def number_in(word: str, line: int) -> float:
    """Return a number as text; underscores and other scripts' digits are none. Raises BadFile."""
    try:
        if "_" in word or not word.isascii():
            raise ValueError
        return float(word)
    except ValueError:
        raise BadFile(f"line {line}: '{word.strip()[:20]}' is not a number") from None


def _readings(row: str, line: int) -> list[float]:
    """Return the readings of a line; a separator at its end adds none."""
    row = row.rstrip(",; \t")
    words = re.split(r"[,;]", row) if "," in row or ";" in row else row.split()
    return [number_in(word, line) for word in words]


def _padded(rows: list[list[float]]) -> Arrays:
    """Return ``ranges_m`` (K, M), NaN where a scan has ended, and how many readings each has."""
    lengths = np.array([len(row) for row in rows], np.int64)
    filled = np.full((len(rows), int(lengths.max(initial=0))), np.nan)
    for k, row in enumerate(rows):
        filled[k, : len(row)] = row
    return {"ranges_m": filled, "lengths": lengths}


def _header_values(header: str, line: int) -> Arrays:
    """Return the ``key=value`` or ``key: value`` pairs of a comment line; other words are remarks."""
    values: Arrays = {}
    for key, value in re.findall(r"([A-Za-z_]+)\s*[=:]\s*(\S+)", header):
        if key not in MESSAGE_KEYS:
            raise BadFile(f"line {line}: unknown key '{key}'{nearest_hint(key, HEADER_KEYS)}")
        if key in HEADER_KEYS:
            if key in values:
                raise BadFile(f"line {line}: '{key}' is given twice")
            values[key] = np.array(number_in(value.rstrip(",;"), line))
    return values


def _is_export(row: str) -> bool:
    """Tell whether a line names the columns of an exported LaserScan."""
    return any(RANGE_COLUMN.fullmatch(word.strip()) for word in row.split(","))


def _from_export(names: str, lines: Iterator[tuple[int, str]]) -> Arrays:
    """Return the scans of a table with a column for each field and each range."""
    columns = [word.strip() for word in names.split(",")]
    if len(set(columns)) < len(columns):
        twice = next(name for name in columns if columns.count(name) > 1)
        raise BadFile(f"column '{twice}' is there twice")
    matches = {at: match for at, name in enumerate(columns) if (match := RANGE_COLUMN.fullmatch(name))}
    order = sorted(matches, key=lambda at: int(matches[at][1]))
    fields = {name.removeprefix("field."): at for at, name in enumerate(columns) if at not in matches}
    rows: list[list[float]] = []
    stamps: list[float] = []
    header: Arrays = {}
    for number, line in lines:
        if not line.strip():
            continue
        words = next(csv.reader([line]))
        if len(words) < len(columns):
            raise BadFile(f"line {number}: {len(words)} columns where the first line names {len(columns)}")
        rows.append([number_in(words[at], number) for at in order if words[at].strip()])
        for key in HEADER_KEYS:
            if key in fields and key not in header:
                header[key] = np.array(number_in(words[fields[key]], number))
        stamp = next((words[fields[key]] for key in STAMPS if key in fields), "")
        stamps.append(_seconds(stamp))
    return header | _padded(rows) | _stamps(stamps)


def _seconds(stamp: str) -> float:
    """Return a stamp [s]; tools write nanoseconds as whole numbers."""
    try:
        value = float(stamp)
    except ValueError:
        return math.nan
    return value * NANOSECONDS if value > 1e14 else value


def _stamps(stamps: list[float]) -> Arrays:
    values = np.array(stamps)
    sound = values.size > 0 and np.isfinite(values).all() and not np.any(np.diff(values) < 0.0)
    return {"stamp_s": values - values[0]} if sound else {}


CARMEN = ("FLASER ", "ROBOTLASER1 ")
FLASER_HALF, OLD_MAX_M = 0.5 * math.pi, 81.83
"""A FLASER line says neither field nor range: half a circle, and the longest range of the scanners of its time."""


def _from_carmen(text: str) -> Arrays:
    """Return the scans of a CARMEN log: ``FLASER`` or, where there are any, ``ROBOTLASER1`` lines."""
    kind = CARMEN[1] if any(line.startswith(CARMEN[1]) for line in text.splitlines()) else CARMEN[0]
    rows, poses, stamps = [], [], []
    header: Mapping[str, float] = {}
    for number, line in enumerate(text.split("\n"), start=1):
        if not line.startswith(kind):
            continue
        words = line.split()
        readings, rest, told = (_flaser if kind == CARMEN[0] else _robotlaser)(words, number)
        header = header or told
        if told["angle_increment"] != header["angle_increment"]:
            raise BadFile(f"line {number}: {len(readings)} readings at other angles than before")
        rows.append(readings)
        poses.append(rest[:3])
        stamps.append(rest[3])
    arrays: Arrays = {key: np.array(value) for key, value in header.items()}
    return arrays | _padded(rows) | {"odom_xy_yaw": np.array(poses)} | _stamps(stamps)


def _flaser(words: list[str], line: int) -> tuple[list[float], list[float], dict[str, float]]:
    """``FLASER n r.. x y theta odom_x odom_y odom_theta stamp host logger_stamp``."""
    readings, rest = _counted(words, 1, 7, line)
    step = 2.0 * FLASER_HALF / max(1, len(readings) - (len(readings) % 2))
    told = {"angle_min": -FLASER_HALF, "angle_increment": step, "range_min": 0.0, "range_max": OLD_MAX_M}
    return readings, rest[3:7], told


def _robotlaser(words: list[str], line: int) -> tuple[list[float], list[float], dict[str, float]]:
    """``ROBOTLASER1 type start fov step max accuracy mode n r.. m rem.. laser_pose(3) robot_pose(3) .. stamp ..``."""
    start, _, step, longest = (number_in(word, line) for word in words[2:6])
    readings, _ = _counted(words, 8, 1, line)
    at = 9 + len(readings)
    rest = words[at + 1 + _count(words, at, line) :]
    if len(rest) < 12:
        raise BadFile(f"line {line}: torn: it ends after {len(words)} words")
    numbers = [number_in(word, line) for word in rest[:12]]
    told = {"angle_min": start, "angle_increment": step, "range_min": 0.0, "range_max": longest}
    return readings, [*numbers[3:6], numbers[11]], told


def _count(words: list[str], at: int, line: int) -> int:
    """Return the number of words that word ``at`` says follow it."""
    count = number_in(words[at], line) if len(words) > at else 0.0
    if not 0.0 <= count < len(words):
        raise BadFile(f"line {line}: torn: it has {len(words)} words, of which {count:g} cannot be readings")
    return int(count)


def _counted(words: list[str], at: int, more: int, line: int) -> tuple[list[float], list[float]]:
    """Return as many readings as word ``at`` says, and ``more`` numbers after them."""
    stop = at + 1 + _count(words, at, line)
    if stop + more > len(words):
        raise BadFile(f"line {line}: torn: it ends after {len(words)} words")
    return (
        [number_in(word, line) for word in words[at + 1 : stop]],
        [number_in(word, line) for word in words[stop : stop + more]],
    )
