"""Scans from text: one scan a line as people write them, the tables that ROS tools export, CARMEN logs."""

from __future__ import annotations

import csv
import math
import re
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from swarmscope.errors import nearest_hint
from swarmscope.sim.scan_read import HEADER_KEYS, Arrays, Ask, BadFile, Read, as_stamps, padded

MESSAGE_KEYS = (*HEADER_KEYS, "angle_max", "time_increment", "scan_time", "frame_id", "seq", "stamp")
"""What a LaserScan's header may hold; only `USED_KEYS` are used."""
USED_KEYS = (*HEADER_KEYS, "time_increment")
RANGE_COLUMN = re.compile(r"(?:.*/)?(?:field\.)?ranges(?:[\[._]?(\d+)\]?)?")
"""A column of one reading, or of all of them in brackets."""
DELIMITERS = (",", ";", "\t")
NANOSECONDS = 1e-9
STAMPS = ("header.stamp", "stamp", "%time", "time", "__time", "timestamp")
ECHO_FIELDS = 10
"""Of a line of ``ros2 topic echo --csv``: sec, nanosec, frame, seven numbers of the header; then readings."""
DECIMAL_COMMAS = "; if it has decimal commas, export it with decimal points"


def read_text_scans(text: str, ask: Ask) -> Read:
    """Return header values and ``ranges_m`` (K, M) of text; missing readings at a line's end are NaN.

    Raises BadFile with the line.
    """
    if text.lstrip().startswith(CARMEN) or any(line.startswith(CARMEN) for line in text.splitlines()[:200]):
        return Read(_from_carmen(text, ask.every))
    found: Arrays = {}
    rows: list[npt.NDArray[Any]] = []
    lines, scans = enumerate(text.split("\n"), start=1), 0
    for number, line in lines:
        stripped = line.strip()
        if stripped.startswith("#"):
            found.update(_header_values(stripped[1:], number))
        elif stripped and scans == 0 and (delimiter := _export_delimiter(stripped)):
            return Read(found | _from_export(stripped, delimiter, lines, ask.every))
        elif stripped and scans == 0 and _is_echo(stripped):
            return Read(_from_echo(text, ask.every))
        elif stripped:
            if scans % ask.every == 0:
                rows.append(_readings(stripped, number))
            scans += 1
    return Read(found | padded(rows))


def number_in(word: str, line: int) -> float:
    """Return a number as text; underscores and other scripts' digits are none. Raises BadFile."""
    try:
        if "_" in word or not word.isascii():
            raise ValueError
        return float(word)
    except ValueError:
        hint = DECIMAL_COMMAS if re.fullmatch(r"[-+\d\s.,]*\d[,\s]\s*\d[-+\d\s.,]*", word) else ""
        raise BadFile(f"line {line}: '{' '.join(word.split())[:20]}' is not a number{hint}") from None


def _readings(row: str, line: int) -> npt.NDArray[Any]:
    """Return the readings of a line; a separator at its end adds none."""
    row = row.replace('"', "").rstrip(",; \t")
    words = row.split(";") if ";" in row else row.split(",") if "," in row else row.split()
    return np.array([number_in(word, line) for word in words])


def _header_values(header: str, line: int) -> Arrays:
    """Return the ``key=value`` or ``key: value`` pairs of a comment line; other words are remarks."""
    values: Arrays = {}
    for key, value in re.findall(r"([A-Za-z_]+)\s*[=:]\s*(\S+)", header):
        if key not in MESSAGE_KEYS:
            raise BadFile(f"line {line}: unknown key '{key}'{nearest_hint(key, HEADER_KEYS)}")
        if key in USED_KEYS:
            if key in values:
                raise BadFile(f"line {line}: '{key}' is given twice")
            values[key] = np.array(number_in(value.rstrip(",;"), line))
    return values


def _export_delimiter(row: str) -> str:
    """Return what separates the columns that a line names if it is the first of an exported LaserScan, else ''."""
    for delimiter in DELIMITERS:
        if any(RANGE_COLUMN.fullmatch(word) for word in _words(row, delimiter)):
            return delimiter
    return ""


def _words(row: str, delimiter: str) -> list[str]:
    return [word.strip() for word in next(csv.reader([row], delimiter=delimiter))]


def _from_export(names: str, delimiter: str, lines: Iterator[tuple[int, str]], every: int) -> Arrays:
    """Return the scans of a table with a column for each field, and one for each range or one for all of them."""
    columns = _words(names, delimiter)
    if len(set(columns)) < len(columns):
        twice = next(name for name in columns if columns.count(name) > 1)
        raise BadFile(f"column '{twice}' is there twice")
    matches = {at: match for at, name in enumerate(columns) if (match := RANGE_COLUMN.fullmatch(name))}
    order = sorted(matches, key=lambda at: int(matches[at][1] or -1))
    fields = {name.rsplit("/")[-1].removeprefix("field."): at for at, name in enumerate(columns) if at not in matches}
    stamp_at = next((at for key in STAMPS for name, at in fields.items() if name.lower() == key), None)
    rows: list[npt.NDArray[Any]] = []
    stamps: list[float] = []
    heads: list[list[float]] = []
    given = [key for key in USED_KEYS if key in fields]
    scans = 0
    for number, line in lines:
        if not line.strip():
            continue
        scans += 1
        if (scans - 1) % every:
            continue
        words = _words(line, delimiter)
        if len(words) < len(columns):
            raise BadFile(f"line {number}: {len(words)} columns where the first line names {len(columns)}")
        cells = [word for at in order for word in _in_cell(words[at])]
        rows.append(np.array([number_in(word, number) for word in cells]))
        heads.append([number_in(words[fields[key]], number) for key in given])
        stamps.append(_seconds("" if stamp_at is None else words[stamp_at]))
    return _heads(given, heads) | padded(rows) | as_stamps(stamps)


def _in_cell(cell: str) -> list[str]:
    """Return the numbers of a cell: none, one, or all of a list in brackets."""
    if cell[:1] in ("[", "("):
        return re.split(r"[,\s]+", cell.strip("[]() ,"))
    return [cell] if cell else []


def _heads(keys: list[str], heads: list[list[float]]) -> Arrays:
    """Return the header values of the first scan, and how each lies where that changes."""
    values = np.array(heads)
    if values.size == 0:
        return {}
    found: Arrays = {key: values[0, at] for at, key in enumerate(keys)}
    if set(HEADER_KEYS[:2]) <= set(keys):
        geometry = values[:, [keys.index(key) for key in HEADER_KEYS[:2]]]
        if (geometry != geometry[0]).any():
            found["geometry"] = geometry
    return found


def _is_echo(row: str) -> bool:
    """Tell whether a line is one of ``ros2 topic echo --csv``: two whole numbers, a name, and numbers."""
    words = row.split(",")
    if len(words) <= ECHO_FIELDS or not (words[0].isdigit() and words[1].isdigit()):
        return False
    return re.fullmatch(r"\s*(?![-+]?[\d.]+$)(?!nan$|[-+]?inf$)[\w./-]*\s*", words[2]) is not None


def _from_echo(text: str, every: int) -> Arrays:
    """Return the scans of what ``ros2 topic echo --csv`` printed: no names, and intensities after the readings."""
    rows: list[npt.NDArray[Any]] = []
    heads: list[list[float]] = []
    stamps: list[float] = []
    lines = [(number, line) for number, line in enumerate(text.split("\n"), start=1) if line.strip()]
    for number, line in lines[::every]:
        words = line.split(",")
        if "..." in line or len(words) <= ECHO_FIELDS:
            raise BadFile(f"line {number}: was cut short; 'ros2 topic echo --csv --full-length' prints everything")
        sec, nanosec = (number_in(word, number) for word in words[:2])
        first, last, step, between, _, least, most = (number_in(word, number) for word in words[3:ECHO_FIELDS])
        fits = math.isfinite(first) and math.isfinite(last) and math.isfinite(step) and step != 0.0
        count = round((last - first) / step) + 1 if fits else 0
        left = len(words) - ECHO_FIELDS
        count = next((n for n in (left, left // 2) if n > 0 and left % n == 0 and abs(n - count) <= 1), 0)
        if count < 1:
            angles = f"angle {first:g} to {last:g} in steps of {step:g}"
            raise BadFile(f"line {number}: {left} readings do not go from {angles}")
        rows.append(np.array([number_in(word, number) for word in words[ECHO_FIELDS : ECHO_FIELDS + count]]))
        heads.append([first, step, least, most, between])
        stamps.append(sec + NANOSECONDS * nanosec)
    return _heads(list(USED_KEYS), heads) | padded(rows) | as_stamps(stamps)


def _seconds(stamp: str) -> float:
    """Return a stamp [s]; tools write nanoseconds as whole numbers."""
    try:
        value = float(stamp)
    except ValueError:
        return math.nan
    return value * NANOSECONDS if value > 1e14 else value


CARMEN = ("FLASER ", "ROBOTLASER1 ")
FLASER_HALF, OLD_MAX_M = 0.5 * math.pi, 81.83
"""A FLASER line says neither field nor range: half a circle, and the longest range of the scanners of its time."""


def _from_carmen(text: str, every: int) -> Arrays:
    """Return the scans of a CARMEN log: ``FLASER`` or, where there are any, ``ROBOTLASER1`` lines."""
    kind = CARMEN[1] if any(line.startswith(CARMEN[1]) for line in text.splitlines()) else CARMEN[0]
    rows: list[npt.NDArray[Any]] = []
    poses, stamps, scans = [], [], 0
    heads: list[list[float]] = []
    for number, line in enumerate(text.split("\n"), start=1):
        if not line.startswith(kind):
            continue
        scans += 1
        if (scans - 1) % every:
            continue
        words = line.split()
        readings, rest, told = (_flaser if kind == CARMEN[0] else _robotlaser)(words, number)
        heads.append([told[key] for key in HEADER_KEYS])
        rows.append(np.array(readings))
        poses.append(rest[:3])
        stamps.append(rest[3])
    return _heads(list(HEADER_KEYS), heads) | padded(rows) | {"odom_xy_yaw": np.array(poses)} | as_stamps(stamps)


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
