"""Reads a finished run folder for viewing; every file is checked, a wrong one is named with what is wrong."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from swarmscope.errors import InputFileError, SwarmscopeError
from swarmscope.judging import run_names
from swarmscope.judging.cases import CHOICE_COLUMNS, OPINION_COLUMNS
from swarmscope.judging.run_folder import TRAJECTORY, WORLD, read_metrics, read_trajectory, read_world
from swarmscope.sim.world import Circle, Door, Grid, Length, Number, Obstacle, Point, grid_corners, solid_from_grid

Array = npt.NDArray[Any]


class RobotEntry(BaseModel):
    """One robot of ``world.json``: ``radius`` [m], ``start`` [x, y, yaw], ``goal`` [x, y] [m, rad]."""

    model_config = ConfigDict(frozen=True)

    id: int
    radius: Length
    goal_yaw: Number | None = None
    start: tuple[Number, Number, Number]
    goal: Point


class WorldFile(BaseModel):
    """The content of ``world.json``; ``bounds`` is [x0, y0, x1, y1] [m]."""

    model_config = ConfigDict(frozen=True)

    robots: list[RobotEntry] = Field(min_length=1)
    obstacles: list[Obstacle]
    bounds: tuple[Number, Number, Number, Number]


RIM_CELLS = 10
"""So much of what surrounds the free cells of a map is shown."""


def shown_bounds(world: WorldFile) -> tuple[float, float, float, float]:
    """Return x0, y0, x1, y1 [m] of what is worth looking at: the bounds, of a map its free cells and a rim.

    Maps made by robots are mostly margin that nobody has seen.
    """
    x0, y0, x1, y1 = world.bounds
    grid = next((obstacle for obstacle in world.obstacles if isinstance(obstacle, Grid)), None)
    free = np.zeros((0, 0), np.bool_) if grid is None else solid_from_grid(grid) == 0
    if grid is None or not free.any():
        return x0, y0, x1, y1
    rows, columns = np.flatnonzero(free.any(axis=1)), np.flatnonzero(free.any(axis=0))
    low = np.array([columns[0], rows[0]]) - RIM_CELLS
    high = np.array([columns[-1], rows[-1]]) + 1 + RIM_CELLS
    origin, right, _, up = grid_corners(grid)
    along, across = (right - origin) / grid.width, (up - origin) / grid.height
    corners = origin + np.outer([low[0], high[0], high[0], low[0]], along)
    corners += np.outer([low[1], low[1], high[1], high[1]], across)
    (a, b), (c, d) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
    return max(x0, a), max(y0, b), min(x1, c), min(y1, d)


class Trajectory(NamedTuple):
    """The arrays of ``trajectory.npz``: T ticks, N robots, B beams. Scans and safe bits may have no ticks."""

    t_s: Array
    """(T,) rising."""
    x_m: Array
    """(T, N), as all up to ``neighbours``."""
    y_m: Array
    yaw_rad: Array
    state: Array
    """Index into ``state_names``."""
    reason: Array
    """Index into ``reason_names``."""
    speed_mps: Array
    clearance_m: Array
    p_left: Array
    """NaN before the first choice of a side."""
    side: Array
    """+1 left, -1 right, 0 none."""
    bytes_sent: Array
    """Running total."""
    neighbours: Array
    state_names: Array
    reason_names: Array
    beam_angles: Array
    """(B,) sensor frame [rad]."""
    scan_u8: Array
    """(T, N, B) 0..254 = range / range_max, 255 = no return."""
    safe_bits: Array
    """(T, N, ceil(B / 8)), beam 0 in the highest bit."""
    links: Array
    """(L, 4) tick, from, to, bytes."""
    arrival_s: Array
    """(N,) NaN = not arrived."""
    collided: Array
    """(N,)"""
    range_max_m: Array
    """Scalar."""
    choices: Array = np.empty((0, len(CHOICE_COLUMNS)))
    """(C, 6) ``CHOICE_COLUMNS`` of each choice of a side; runs of earlier versions have none."""
    opinions: Array = np.empty((0, len(OPINION_COLUMNS)))
    """(O, 5) ``OPINION_COLUMNS`` of each neighbour that took part in one."""
    disc_xy_m: Array = np.empty((0, 0, 2))
    """(T, D, 2) where the discs that move are, in the order of the world."""
    door_closed: Array = np.empty((0, 0), np.uint8)
    """(T, K) 1 where a door is closed, in the order of the world."""


@dataclass(frozen=True)
class RunData:
    """A finished run: its folder, world, trajectory and the content of ``metrics.json``."""

    folder: Path
    world: WorldFile
    trajectory: Trajectory
    metrics: dict[str, Any]


ONLY_WHERE_THINGS_MOVE = ("disc_xy_m", "door_closed")
"""Arrays that a run has in whose world something moves by itself."""

_KINDS = {
    "state_names": "U",
    "reason_names": "U",
    "state": "ui",
    "reason": "ui",
    "side": "if",
    "bytes_sent": "ui",
    "neighbours": "ui",
    "scan_u8": "u",
    "safe_bits": "u",
    "links": "ui",
    "collided": "uib",
    "door_closed": "ub",
}
"""Kinds of numbers that an array may hold; those not listed hold real numbers."""

_PER_TICK = Trajectory._fields[1 : Trajectory._fields.index("neighbours") + 1]


def load_run(run_dir: Path) -> RunData:
    """Return the run in ``run_dir``; an `InputFileError` names the file that is missing, torn or foreign."""
    folder = Path(run_dir)
    metrics = read_metrics(folder)
    world = _checked_world(folder / WORLD, read_world(folder))
    trajectory = _checked_trajectory(folder / TRAJECTORY, read_trajectory(folder), len(world.robots))
    _check_moving(folder / TRAJECTORY, world, trajectory)
    return RunData(folder, world, trajectory, metrics)


def discs_of(world: WorldFile) -> list[Circle]:
    """Return the discs that move."""
    return [obstacle for obstacle in world.obstacles if isinstance(obstacle, Circle) and obstacle.moves]


def doors_of(world: WorldFile) -> list[Door]:
    """Return the doors."""
    return [obstacle for obstacle in world.obstacles if isinstance(obstacle, Door)]


def decision_ticks(trajectory: Trajectory, robot: int) -> Array:
    """Return the ticks at which ``robot`` chose a side: those at which its P(left) took a new value."""
    p_left = trajectory.p_left[:, robot]
    before = np.concatenate([[np.nan], p_left[:-1]])
    fresh = np.isfinite(p_left) & (p_left != before)
    return np.flatnonzero(fresh)


def crash_ticks(trajectory: Trajectory) -> Array:
    """Return (N,) the tick from which each robot counts as crashed; T for those that never collided."""
    ticks, robots = trajectory.x_m.shape
    moved = (np.diff(trajectory.x_m, axis=0) != 0.0) | (np.diff(trajectory.y_m, axis=0) != 0.0)
    first = np.full(robots, ticks, dtype=np.int64)
    for robot in np.flatnonzero(trajectory.collided):
        named = np.flatnonzero(trajectory.state_names[trajectory.state[:, robot]] == "crashed")
        steps = np.flatnonzero(moved[:, robot])
        first[robot] = named[0] if named.size else (steps[-1] + 1 if steps.size else 0)
    return first


def replace_file(path: Path, content: bytes) -> Path:
    """Write ``content`` under a temporary name, then rename it to ``path``: no reader meets half a file."""
    with replacing(path) as temporary:
        temporary.write_bytes(content)
    return path


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give the body a temporary name to write to; what is there afterwards is synced and renamed to ``path``.

    A SwarmscopeError says why it cannot be written.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        yield temporary
        with temporary.open("rb") as file:
            os.fsync(file.fileno())
        temporary.replace(path)
    except OSError as error:
        raise SwarmscopeError(f"{path}: cannot be written: {error.strerror or error}") from error
    finally:
        with suppress(OSError):
            temporary.unlink(missing_ok=True)


def _checked_world(path: Path, content: Mapping[str, Any]) -> WorldFile:
    try:
        return WorldFile.model_validate(content)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"])
        raise InputFileError(path, f"{place}: {first['msg']}") from None


def _checked_trajectory(path: Path, arrays: Mapping[str, Array], robots: int) -> Trajectory:
    missing = [name for name in Trajectory._fields if name not in arrays and name not in Trajectory._field_defaults]
    if missing:
        raise InputFileError(path, f"lacks {', '.join(missing)}")
    trajectory = Trajectory(**{name: arrays[name] for name in Trajectory._fields if name in arrays})
    why = _first_fault(trajectory, robots)
    if why:
        raise InputFileError(path, why)
    return trajectory


def _check_moving(path: Path, world: WorldFile, trajectory: Trajectory) -> None:
    """Raise an InputFileError unless what moves in the world has its places in the trajectory."""
    ticks = trajectory.t_s.size
    for name, count, tail in (("disc_xy_m", len(discs_of(world)), (2,)), ("door_closed", len(doors_of(world)), ())):
        array = getattr(trajectory, name)
        if count and array.shape != (ticks, count, *tail):
            raise InputFileError(path, f"{name} has shape {array.shape}, expected {(ticks, count, *tail)}")
        if not np.all(np.isfinite(array)):
            raise InputFileError(path, f"{name} holds values that are not finite")


def _first_fault(trajectory: Trajectory, robots: int) -> str:
    """Return what is wrong with the arrays, or an empty string."""
    for name, array in zip(Trajectory._fields, trajectory, strict=True):
        if array.dtype.kind not in _KINDS.get(name, "fui"):
            return f"{name} holds {array.dtype}, not what it should"
    return _shape_fault(trajectory, robots) or _value_fault(trajectory, robots)


def _shape_fault(trajectory: Trajectory, robots: int) -> str:
    ticks, beams = trajectory.t_s.size, trajectory.beam_angles.size
    wanted: dict[str, tuple[int, ...]] = dict.fromkeys(_PER_TICK, (ticks, robots))
    wanted |= {"t_s": (ticks,), "beam_angles": (beams,), "arrival_s": (robots,), "collided": (robots,)}
    wanted["range_max_m"] = ()
    for name, width in (("links", 4), ("choices", len(CHOICE_COLUMNS)), ("opinions", len(OPINION_COLUMNS))):
        wanted[name] = (*(getattr(trajectory, name).shape[:1] or (0,)), width)
    for name, width in (("scan_u8", beams), ("safe_bits", (beams + 7) // 8)):
        array: Array = getattr(trajectory, name)
        if array.ndim == 0 or array.shape[0] > 0:
            wanted[name] = (ticks, robots, width)
    for name, shape in wanted.items():
        found = getattr(trajectory, name).shape
        if found != shape:
            return f"{name} has shape {found}, expected {shape} for {ticks} ticks and {robots} robots"
    return "holds no ticks" if ticks == 0 else ""


def _value_fault(trajectory: Trajectory, robots: int) -> str:
    for name in ("t_s", "x_m", "y_m", "yaw_rad", "beam_angles", "range_max_m"):
        if not np.all(np.isfinite(getattr(trajectory, name))):
            return f"{name} holds values that are not finite"
    if np.any(np.diff(trajectory.t_s) <= 0.0):
        return "t_s does not rise"
    for name in ("state", "reason"):
        indices, names = getattr(trajectory, name), getattr(trajectory, f"{name}_names")
        if names.ndim != 1 or np.any(indices < 0) or np.any(indices >= names.size):
            return f"{name} holds an index without a name in {name}_names"
    limits = np.array([trajectory.t_s.size, robots, robots])
    if np.any(trajectory.links[:, :3] < 0) or np.any(trajectory.links[:, :3] >= limits):
        return "links names a tick or a robot that does not exist"
    return _choice_fault(trajectory, robots)


def _choice_fault(trajectory: Trajectory, robots: int) -> str:
    choices, opinions = trajectory.choices, trajectory.opinions
    if not _are_indices(choices[:, :2], np.array([trajectory.t_s.size, robots])):
        return "choices names a tick or a robot that does not exist"
    if not _are_indices(opinions[:, :2], np.array([len(choices), np.inf])):  # neighbours may be strangers
        return "opinions names a choice that does not exist, or no address"
    return ""


def _are_indices(values: Array, limits: Array) -> bool:
    return bool(np.all((values >= 0) & (values < limits) & (values == np.floor(values))))


_KEY_FIGURES: tuple[tuple[str, str, str], ...] = (
    ("arrival_rate", "Arrived (AR)", "%"),
    ("path_redundancy", "Path redundancy γ", "%"),
    ("collisions", "Collisions", ""),
    ("duration_s", "Last arrival", "s"),
    ("average_path_length_m", "Mean path", "m"),
    ("spl", "SPL", "%"),
    ("waiting_s", "Waiting, per robot", "s"),
    ("min_clearance_m", "Smallest clearance", "m"),
    ("fusions", "Sides chosen", ""),
    ("messages", "Packets sent", ""),
    ("bytes_sent", "Payload sent", "bytes"),
)
"""Figures of ``metrics.json`` that are shown: name, words, unit; the first four make the caption."""


def headline(run: RunData) -> str:
    """Return what was run in one line."""
    about = run.metrics.get("run")
    return run_names.headline(about if isinstance(about, Mapping) else {}, len(run.world.robots))


def summary_rows(run: RunData) -> list[tuple[str, str]]:
    """Return the key figures as (words, value), most important first; missing ones are left out."""
    figures = _counted_figures(run.trajectory) | run.metrics
    return [(words, _in_words(figures[name], unit)) for name, words, unit in _KEY_FIGURES if name in figures]


def failure_reasons(run: RunData) -> dict[int, str]:
    """Return why robots did not arrive, by robot id, as far as ``metrics.json`` says so."""
    listed = run.metrics.get("failures")
    entries = [entry for entry in listed if isinstance(entry, Mapping)] if isinstance(listed, list) else []
    return {int(e["robot"]): str(e["why"]) for e in entries if isinstance(e.get("robot"), int) and "why" in e}


def _counted_figures(trajectory: Trajectory) -> dict[str, float | None]:
    """Return the figures that the trajectory itself tells, used where ``metrics.json`` is silent."""
    arrived = trajectory.arrival_s[np.isfinite(trajectory.arrival_s)]
    return {
        "arrival_rate": arrived.size / trajectory.arrival_s.size,
        "collisions": int(np.count_nonzero(trajectory.collided)),
        "duration_s": float(arrived.max()) if arrived.size else None,
    }


def _in_words(value: Any, unit: str) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return "–"
    if unit == "%":
        return f"{100.0 * value:.1f} %"
    if isinstance(value, int):
        return f"{value:,} {unit}".replace(",", "\u202f").strip()
    digits = 3 if unit == "m" and abs(value) < 1.0 else 1
    return f"{value:.{digits}f} {unit}".strip()
