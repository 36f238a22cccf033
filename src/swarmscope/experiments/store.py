"""Where results live: one SQLite file that many processes may read and write, and pandas, polars or DuckDB open.

SQLite, because a sweep writes one small row at a time from several processes and must survive kill -9 at any moment
with nothing but the standard library: every result is a transaction of its own in a write-ahead log. (DuckDB allows
one writing process, Parquet files cannot be appended to.) Reading a column of 100 000 results takes well under a
second, and DuckDB, pandas and polars read the file as it is (docs/experiments.md). The file must lie on a local
disk: SQLite's log needs shared memory, which network file systems lack; on a cluster only the driver writes.

Tables: ``runs`` (one row per content key: configuration, a column per figure, per-robot lists), ``cells`` (which run
is which place, planner and seed of which experiment), ``worlds`` (reference ways), ``failures`` (units that raised),
``damaged`` (rows that could not be read, kept aside), and the view ``results`` that joins cells and runs.
"""

from __future__ import annotations

import csv
import json
import os
import sqlite3
import time
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, Self

import numpy as np

from swarmscope.errors import InputFileError, SwarmscopeError
from swarmscope.experiments.experiment import Unit
from swarmscope.experiments.results import Run
from swarmscope.experiments.work import MEASURED, Finished
from swarmscope.judging.metrics import COUNTED, METRICS
from swarmscope.texts import check_regular

APPLICATION = 0x73776D73  # "swms"
VERSION = 1
BUSY_S = 60.0
"""How long a writer waits for another one."""
AGAIN_S = 0.01
"""After this it tries again where SQLite itself does not wait."""
FIGURES = tuple(dict.fromkeys([*(m.name for m in (*METRICS, *COUNTED)), *MEASURED]))
TEXTS = ("config", "robots", "failures", "cases", "digest", "git", "code", "swarmscope", "python", "numpy", "numba")
JSON = ("config", "robots", "failures", "cases")
PER_ROBOT = ("travelled_m", "shortest_m", "any_angle_m", "arrival_s")
SCHEMA = f"""
CREATE TABLE IF NOT EXISTS runs (
    key TEXT PRIMARY KEY, world TEXT NOT NULL, planner_name TEXT, seed INTEGER, created TEXT DEFAULT CURRENT_TIMESTAMP,
    {", ".join(f"{name} TEXT NOT NULL" for name in TEXTS)},
    {", ".join(f"{name} REAL" for name in FIGURES)}
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS cells (
    experiment TEXT NOT NULL, place TEXT NOT NULL, planner TEXT NOT NULL, seed INTEGER NOT NULL, key TEXT NOT NULL,
    PRIMARY KEY (experiment, place, planner, seed)
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS worlds (world TEXT PRIMARY KEY, shortest TEXT NOT NULL) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS failures (
    key TEXT PRIMARY KEY, config TEXT NOT NULL, error TEXT NOT NULL, created TEXT DEFAULT CURRENT_TIMESTAMP
) WITHOUT ROWID;
CREATE VIEW IF NOT EXISTS results AS
    SELECT cells.experiment, cells.place, cells.planner, runs.* FROM cells JOIN runs USING (key);
"""


class Store:
    """The results in one file. Use it as a context manager."""

    def __init__(self, path: Path, *, create: bool = True) -> None:
        self.path = Path(path)
        if not create and not self.path.exists():
            raise InputFileError(self.path, "no such store; nothing has been run into it yet")
        if self.path.exists():
            check_regular(self.path, None)
        with self._explained():
            if create:
                self.path.parent.mkdir(parents=True, exist_ok=True)
            self._db = sqlite3.connect(self.path, timeout=BUSY_S, isolation_level=None)
        try:
            with self._explained():
                self._open()
        except BaseException:
            self._db.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._db.close()

    def _open(self) -> None:
        with self._transaction("DEFERRED"):  # all of one moment: another process may be making the store
            (application,) = self._db.execute("PRAGMA application_id").fetchone()
            (version,) = self._db.execute("PRAGMA user_version").fetchone()
            (tables,) = self._db.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if application not in (0, APPLICATION) or (application == 0 and tables > 0):
            raise InputFileError(self.path, "is a database, but not a store of swarmscope; left as it is")
        if version > VERSION:
            raise InputFileError(self.path, f"was written by a newer swarmscope (format {version}, known: {VERSION})")
        self._write_ahead()
        self._db.execute("PRAGMA synchronous=NORMAL")
        if version < VERSION:
            with self._transaction():
                for statement in SCHEMA.split(";\n"):
                    self._db.execute(statement)
                self._db.execute(f"PRAGMA application_id={APPLICATION}")
                self._db.execute(f"PRAGMA user_version={VERSION}")
        if set(FIGURES) <= self._columns():
            return
        with self._transaction():
            for name in FIGURES:
                if name not in self._columns():  # a metric that was added since
                    self._db.execute(f"ALTER TABLE runs ADD COLUMN {name} REAL")

    def _write_ahead(self) -> None:
        """Keep changes in a log of their own. SQLite does not wait for another process that does this right now."""
        begun = time.monotonic()
        while True:
            try:
                self._db.execute("PRAGMA journal_mode=WAL")
                return
            except sqlite3.OperationalError as error:
                if error.sqlite_errorcode & 0xFF != sqlite3.SQLITE_BUSY or time.monotonic() - begun > BUSY_S:
                    raise
            time.sleep(AGAIN_S)

    def _columns(self) -> set[str]:
        return {row[1] for row in self._db.execute("PRAGMA table_info(runs)")}

    def add(self, result: Finished) -> None:
        """Keep a finished unit, or why it failed; a key that is there already stays as it is."""
        with self._explained(), self._transaction():
            if result.error is not None:
                self._db.execute(
                    "INSERT OR REPLACE INTO failures (key, config, error) VALUES (?, ?, ?)",
                    (result.key, json.dumps(result.config), result.error),
                )
                return
            self._db.execute("DELETE FROM failures WHERE key = ?", (result.key,))
            row = _row(result)
            places = ", ".join("?" * len(row))
            self._db.execute(f"INSERT OR IGNORE INTO runs ({', '.join(row)}) VALUES ({places})", tuple(row.values()))
            self._db.execute(
                "INSERT OR IGNORE INTO worlds (world, shortest) VALUES (?, ?)",
                (result.world, json.dumps(result.references)),
            )

    def enlist(self, experiment: str, units: Iterable[tuple[Unit, str]]) -> None:
        """Note which key is which cell of the experiment."""
        rows = ((experiment, u.place, u.planner, u.seed, key) for u, key in units)
        with self._explained(), self._transaction():
            self._db.executemany("INSERT OR REPLACE INTO cells VALUES (?, ?, ?, ?, ?)", rows)

    def done(self, keys: Iterable[str]) -> set[str]:
        """Return those of ``keys`` that have a result."""
        return self._known("SELECT 1 FROM runs WHERE key = ?", keys)

    def failed(self, keys: Iterable[str]) -> dict[str, str]:
        """Return the errors of those of ``keys`` that failed."""
        with self._explained():
            found = {}
            for key in keys:
                row = self._db.execute("SELECT error FROM failures WHERE key = ?", (key,)).fetchone()
                if row is not None:
                    found[key] = str(row[0])
        return found

    def references(self, world: str) -> dict[str, Any] | None:
        """Return the reference ways of a world, if some run has found them and they are sound."""
        with self._explained():
            row = self._db.execute("SELECT shortest FROM worlds WHERE world = ?", (world,)).fetchone()
        return None if row is None else _sound_references(row[0])

    def runs(self, units: Iterable[tuple[Unit, str]]) -> Iterator[Run]:
        """Return the finished runs among the units, without damaged ones."""
        with self._explained():
            for unit, key in units:
                row = self._db.execute(f"SELECT {_read()} FROM runs WHERE key = ?", (key,)).fetchone()
                if row is not None and not _fault(row):
                    yield _as_run(unit, key, row)

    def damaged(self, keys: Iterable[str]) -> dict[str, str]:
        """Return what is wrong with those of ``keys`` whose rows are damaged."""
        found = {}
        with self._explained():
            for key in keys:
                row = self._db.execute(f"SELECT {_read()} FROM runs WHERE key = ?", (key,)).fetchone()
                if row is not None and (why := _fault(row)):
                    found[key] = why
        return found

    def set_aside(self, rows: Mapping[str, str]) -> None:
        """Move damaged rows, by key, into the table ``damaged``, so that they are run again and nothing is lost."""
        with self._explained(), self._transaction():
            self._db.execute("CREATE TABLE IF NOT EXISTS damaged AS SELECT *, '' AS why FROM runs WHERE 0")
            kept = [row[1] for row in self._db.execute("PRAGMA table_info(damaged)")]
            there = {row[1] for row in self._db.execute("PRAGMA table_info(runs)")}
            names = ", ".join(name for name in kept if name in there)
            for key, why in rows.items():
                copy = f"INSERT INTO damaged ({names}, why) SELECT {names}, ? FROM runs WHERE key = ?"
                self._db.execute(copy, (why, key))
                self._db.execute("DELETE FROM runs WHERE key = ?", (key,))

    def count(self) -> int:
        """Return the number of results."""
        with self._explained():
            return int(self._db.execute("SELECT count(*) FROM runs").fetchone()[0])

    def provenance(self, keys: Iterable[str]) -> dict[str, set[str]]:
        """Return which versions and revisions the results of ``keys`` come from."""
        names = ("git", "swarmscope", "python", "numpy", "numba")
        found: dict[str, set[str]] = {name: set() for name in names}
        with self._explained():
            for key in keys:
                row = self._db.execute(f"SELECT {', '.join(names)} FROM runs WHERE key = ?", (key,)).fetchone()
                for name, value in zip(names, row or (), strict=False):
                    found[name].add(str(value))
        return found

    def digests(self, keys: Iterable[str]) -> dict[str, str]:
        """Return the digest of every finished key."""
        with self._explained():
            rows = [
                self._db.execute("SELECT key, digest FROM runs WHERE key = ?", (key,)).fetchone() for key in keys
            ]
        return {row[0]: row[1] for row in rows if row is not None}

    def export(self, experiment: str, out: Path) -> int:
        """Write the experiment's results as CSV, a row per run, a column per figure; return how many rows."""
        names = ("experiment", "place", "planner", "seed", "key", "digest", "git", "config", *FIGURES)
        partial = out.with_name(f".{out.name}.partial-{os.getpid()}")
        with self._explained():
            rows = self._db.execute(
                f"SELECT {', '.join(names)} FROM results WHERE experiment = ? ORDER BY place, planner, seed",
                (experiment,),
            )
            try:
                count = _write_csv(partial, names, rows)
                partial.replace(out)
            except OSError as error:
                raise SwarmscopeError(f"{out}: cannot be written: {error.strerror or error}") from error
            finally:
                with suppress(OSError):
                    partial.unlink(missing_ok=True)
        return count

    def check(self) -> str:
        """Return 'ok' or what SQLite finds wrong with the file."""
        with self._explained():
            return str(self._db.execute("PRAGMA quick_check(1)").fetchone()[0])

    def _known(self, query: str, keys: Iterable[str]) -> set[str]:
        with self._explained():
            return {key for key in keys if self._db.execute(query, (key,)).fetchone() is not None}

    @contextmanager
    def _transaction(self, kind: str = "IMMEDIATE") -> Iterator[None]:
        self._db.execute(f"BEGIN {kind}")
        try:
            yield
        except BaseException:
            if self._db.in_transaction:
                self._db.execute("ROLLBACK")
            raise
        self._db.execute("COMMIT")

    @contextmanager
    def _explained(self) -> Iterator[None]:
        """Turn what SQLite and the disk say into an error that names the file."""
        try:
            yield
        except sqlite3.OperationalError as error:
            raise SwarmscopeError(f"{self.path}: {_words(error)}; the results that are there are kept") from error
        except sqlite3.DatabaseError as error:
            why = f"is damaged or no store ({error}); nothing was changed. Move it away, or restore it, and go on"
            raise InputFileError(self.path, why) from error
        except OSError as error:
            why = error.strerror or str(error)
            raise SwarmscopeError(f"{self.path}: {why}; the results that are there are kept") from error


def _write_csv(path: Path, names: Iterable[str], rows: Iterable[tuple[Any, ...]]) -> int:
    """Write a header and the rows, synced; return how many rows."""
    count = 0
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(names)
        for row in rows:
            writer.writerow(row)
            count += 1
        file.flush()
        os.fsync(file.fileno())
    return count


def _words(error: sqlite3.OperationalError) -> str:
    text = str(error)
    if "full" in text:
        return "cannot write: the disk is full"
    if "disk I/O" in text:
        return "cannot write: the disk is full or failing (disk I/O error)"
    if "locked" in text:
        return f"another process has held it for {BUSY_S:.0f} s"
    if "readonly" in text:
        return "cannot write: it is read-only"
    return text


def _row(result: Finished) -> dict[str, Any]:
    texts = {
        "config": json.dumps(result.config, sort_keys=True),
        "robots": json.dumps(result.robots),
        "failures": json.dumps(result.failures),
        "cases": json.dumps(result.cases),
        "digest": result.digest,
    } | result.about
    fixed = {
        "key": result.key,
        "world": result.world,
        "planner_name": result.config["planner"]["name"],
        "seed": result.config["seed"],
    }
    numbers = dict(result.figures) | dict(result.measured)
    return fixed | {name: texts[name] for name in TEXTS} | {name: numbers.get(name) for name in FIGURES}


def _as_run(unit: Unit, key: str, row: tuple[Any, ...]) -> Run:
    config, robots, failures, cases = (json.loads(text) for text in row[:4])
    return Run(
        place=unit.place,
        planner=unit.planner,
        seed=unit.seed,
        key=key,
        config=config,
        figures=dict(zip(FIGURES, row[4:], strict=True)),
        failures=failures,
        cases=cases,
        **{name: _array(robots, name) for name in PER_ROBOT},
    )


def _read() -> str:
    """Return the columns that a run is read from."""
    return ", ".join((*JSON, *FIGURES))


def _fault(row: tuple[Any, ...]) -> str:
    """Return what is wrong with a row of ``_read``, an empty string if nothing is."""
    for name, text in zip(JSON, row, strict=False):
        try:
            value = json.loads(text)
        except (ValueError, TypeError, RecursionError):
            return f"{name} is no JSON"
        if not (_is_per_robot(value) if name == "robots" else _is_of(value, name)):
            return f"{name} does not hold what it should"
    odd = [name for name, value in zip(FIGURES, row[len(JSON) :], strict=True) if not _is_number(value)]
    return f"{odd[0]} is no number" if odd else ""


def _is_of(value: Any, name: str) -> bool:
    if name == "config":
        return isinstance(value, dict)
    return isinstance(value, list) and all(isinstance(entry, dict) for entry in value)


def _is_per_robot(value: Any) -> bool:
    """Tell whether this holds a number or None for each robot under every name."""
    lists = [value.get(name) for name in PER_ROBOT] if isinstance(value, dict) else []
    sizes = {len(one) for one in lists if isinstance(one, list) and all(map(_is_number, one))}
    return len(sizes) == 1 and all(isinstance(one, list) and len(one) in sizes for one in lists)


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _sound_references(text: Any) -> dict[str, Any] | None:
    """Return the reference ways that a row holds, None if it is damaged: they are found again."""
    with suppress(ValueError, TypeError, RecursionError):
        found = json.loads(text)
        lists = [found[name] for name in ("shortest_m", "any_angle_m")]
        if all(isinstance(one, list) and all(map(_is_number, one)) for one in lists) and _is_number(found["wall_s"]):
            return dict(found)
    return None


def _array(robots: Mapping[str, list[float | None]], name: str) -> np.ndarray:
    return np.array([np.nan if v is None else v for v in robots[name]], np.float64)
