"""A finished run of robots that remember, played again for what each had in its map and which way it meant to go."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from swarmscope.errors import ConfigError
from swarmscope.held import Held
from swarmscope.judging.run import judged_setting
from swarmscope.onboard.mapping.cells import NODE, NODES, RIM, WIDE
from swarmscope.onboard.mapping.memory import MAP
from swarmscope.onboard.mapping.pages import DIRECTORY
from swarmscope.onboard.mapping.words import WORD
from swarmscope.onboard.planners import Planner
from swarmscope.onboard.view import Swarm
from swarmscope.scenarios.places import make_setup
from swarmscope.scenarios.scenario import Scenario
from swarmscope.sim.loop import run
from swarmscope.sim.state import Sim
from swarmscope.viewing.bag.again import check_same
from swarmscope.viewing.run_data import RunData

EVERY_S = 1.0
"""What has changed in a map is noted so often, and whenever its robot has searched."""
CELL_KIND, NODE_KIND = 0, 1
SIDES = (1, NODE)
"""Cells on a side of what is noted, by its kind."""
_HALF, _BITS = 2**15, 16


class Moment(NamedTuple):
    """What a robot that remembers knew at one moment."""

    tick: int
    robot: int
    searched: bool
    """Whether it had just looked for a way."""
    toggled: NDArray[np.int16]
    """(n, 3): kind, x, y of the cells and nodes that are in its map now and were not at its moment before, or were."""
    way: NDArray[np.float64]
    """(k, 2): the corners still ahead, the goal last [cells]."""
    frame: tuple[float, float, float]
    """Where its map's origin lies in the world, x, y [m], and how the map is turned there [rad]."""
    place: tuple[float, float] = (0.0, 0.0)
    """Where it is in its map [cells]."""


class Memories(NamedTuple):
    """All moments of a run, in the order of time."""

    cell_m: float
    moments: list[Moment]


@dataclass(frozen=True)
class _Watched(Planner):
    """A planner that lets somebody look into its robots' memories."""

    rows: dict[str, np.ndarray] = field(default_factory=dict)

    def step_all(self, first: int, last: int, held: Held[Swarm], memories: np.ndarray, params: Any) -> None:
        """Run one tick of some robots, as every planner does."""
        super().step_all(first, last, held, memories, params)
        self.rows["memories"], self.rows["shared"] = memories, held.what.shared


class _Notes:
    """Takes down what changes in the robots' memories."""

    def __init__(self, rows: dict[str, np.ndarray], cell_m: float, every: int) -> None:
        self.rows, self.cell_m, self.every = rows, cell_m, every
        self.moments: list[Moment] = []
        self._known: dict[int, NDArray[np.int64]] = {}
        self._seen: dict[int, tuple[int, int]] = {}

    def look(self, held: Held[Sim], tick: int) -> bool:
        """Note what is new; never ends the run."""
        sim = held.what
        for i in range(len(sim.robots)):
            memory = self.rows["memories"][i]
            now = int(memory["searches"]), int(memory["way_n"])
            before = self._seen.get(i, (0, 0))
            if memory["arrived"] or not memory["settled"] or (now == before and tick % self.every):
                continue
            self._seen[i] = now
            keys = _keys_of(memory)
            toggled = np.setxor1d(self._known.get(i, np.zeros(0, np.int64)), keys, assume_unique=True)
            self._known[i] = keys
            if now != before or len(toggled):
                shared = self.rows["shared"][i]
                frame = _frame(sim, shared, i)
                way = np.column_stack([memory["way_u"], memory["way_v"]])[: now[1]]
                place = float(shared["x"]) / self.cell_m, float(shared["y"]) / self.cell_m
                self.moments.append(Moment(tick, i, now[0] != before[0], _unpacked(toggled), way, frame, place))
        return False


def play_for_memories(
    found: RunData, scenario: Scenario, progress: Callable[[float, int], None] | None = None
) -> Memories:
    """Return what the robots of a finished run of ``scenario`` remembered.

    Errors: ConfigError for a planner that keeps no map, InputFileError for a run that no longer comes out as it did.
    """
    setting = judged_setting(scenario, make_setup(scenario))
    planner = setting.planner
    if planner.new_memory(1).dtype != MAP:
        raise ConfigError("planner", f"'{planner.name}' keeps no map; 'atlas' does")
    watched = _Watched(**{one.name: getattr(planner, one.name) for one in fields(Planner)})
    cell_m = float(setting.params.cell_m)
    notes = _Notes(watched.rows, cell_m, max(1, round(EVERY_S / setting.dt)))
    trace = run(replace(setting, planner=watched, record_scans=False), progress, notes.look)
    check_same(found, trace)
    return Memories(cell_m, notes.moments)


def _frame(sim: Sim, shared: np.void, i: int) -> tuple[float, float, float]:
    """Return where a robot's map lies in the world: by odometry and compass it is where it thinks it is."""
    robot = sim.robots[i]
    turn = float(robot["yaw"] - sim.percepts[i]["compass"])
    c, s = math.cos(turn), math.sin(turn)
    x, y = float(shared["x"]), float(shared["y"])
    return float(robot["x"]) - c * x + s * y, float(robot["y"]) - s * x - c * y, math.remainder(turn, math.tau)


def _keys_of(memory: np.void) -> NDArray[np.int64]:
    """Return what is in a map, ascending: the cells of the fine layer, and the blocked nodes outside it."""
    west, south = int(memory["west"]), int(memory["south"])
    rows, columns = np.nonzero(_bits(memory["fine"]))
    cells = _packed(CELL_KIND, west + (columns - west) % WIDE, south + (rows - south) % WIDE)
    return np.sort(np.concatenate([cells, *_nodes_of(memory, west // NODE, south // NODE)]))


def _nodes_of(memory: np.void, x0: int, y0: int) -> list[NDArray[np.int64]]:
    found = []
    for slot in range(int(memory["pages_n"])):
        px, py = int(memory["page_x"][slot]), int(memory["page_y"][slot])
        if memory["page_at"][py % DIRECTORY, px % DIRECTORY] != slot + 1:
            continue
        rows, columns = np.nonzero(_bits(memory["rows"][slot]))
        x, y = WORD * px + columns, WORD * py + rows
        fine = (x >= x0 + RIM) & (x < x0 + NODES - RIM) & (y >= y0 + RIM) & (y < y0 + NODES - RIM)
        found.append(_packed(NODE_KIND, x[~fine], y[~fine]))
    return found


def _bits(words: np.ndarray) -> np.ndarray:
    """Return sets of 64 in a row, or several beside one another, as one bool for each member."""
    table = np.ascontiguousarray(words, "<u8").reshape(len(words), -1)
    return np.unpackbits(table.view(np.uint8), axis=1, bitorder="little")


def _packed(kind: int, x: NDArray[np.int64], y: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return kind and place as one number each; what is too far away for that is left out."""
    near = (np.abs(x) < _HALF) & (np.abs(y) < _HALF)
    packed: NDArray[np.int64] = (((kind << _BITS) + x[near] + _HALF) << _BITS) + y[near] + _HALF
    return packed


def _unpacked(keys: NDArray[np.int64]) -> NDArray[np.int16]:
    low = 2**_BITS - 1
    columns = [keys >> (2 * _BITS), (keys >> _BITS & low) - _HALF, (keys & low) - _HALF]
    return np.column_stack(columns).astype(np.int16)
