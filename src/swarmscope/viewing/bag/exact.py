"""What robots measured and commanded in a run, to the bit: noted tick by tick while it is played."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from swarmscope.errors import SwarmscopeError
from swarmscope.held import Held
from swarmscope.judging.run import Watch
from swarmscope.sim.beams import Beams
from swarmscope.sim.state import Sim

IN_MEMORY_BYTES = 256_000_000
"""More than this goes into a file without a name, which no killed process leaves behind."""


class Noted(NamedTuple):
    """One tick of all N robots."""

    ranges: npt.NDArray[np.float32]
    """(N, B) as the LiDARs measured them, noise included [m]."""
    commands: npt.NDArray[np.float64]
    """(N, 2) speed [m/s] and turn rate [rad/s] that the robots asked their bases for."""


class LidarSheet(NamedTuple):
    """Which way beams look, and how far they reach."""

    beams: Beams
    range_min: float
    dt: float


class Exact:
    """Looks on while a run is played (`watch`); going through it afterwards gives its ticks."""

    def __init__(self) -> None:
        self._file = tempfile.SpooledTemporaryFile(max_size=IN_MEMORY_BYTES)  # noqa: SIM115  # closed with the object
        self._shape = 0, 0
        self._lidar: LidarSheet | None = None
        self.ticks = 0

    @property
    def watch(self) -> Watch:
        """What is given to ``play``."""
        return Watch(between=self._decided, sensed=self._sensed)

    @property
    def lidar(self) -> LidarSheet:
        """The robots' LiDAR, once there is a tick."""
        if self._lidar is None:
            raise ValueError("no tick has been noted")
        return self._lidar

    def __iter__(self) -> Iterator[Noted]:
        """Go through the ticks."""
        robots, beams = self._shape
        self._file.seek(0)
        for _ in range(self.ticks):
            ranges = np.frombuffer(self._file.read(4 * robots * beams), np.float32)
            commands = np.frombuffer(self._file.read(16 * robots), np.float64)
            yield Noted(ranges.reshape(robots, beams), commands.reshape(robots, 2))

    def _sensed(self, held: Held[Sim], tick: int) -> None:
        sim = held.what
        if tick == 0:
            self._shape = sim.ranges.shape[0], sim.ranges.shape[1]
            self._lidar = LidarSheet(sim.beams, sim.range_min, sim.clock.dt)
        self._note(sim.ranges)

    def _decided(self, held: Held[Sim], tick: int) -> bool:
        decisions = held.what.decisions
        self._note(np.column_stack([decisions["v"], decisions["w"]]))
        self.ticks = tick + 1
        return False

    def _note(self, array: npt.NDArray[np.floating]) -> None:
        try:
            self._file.write(array.tobytes())
        except OSError as error:
            folder = tempfile.gettempdir()
            raise SwarmscopeError(f"{folder}: cannot keep the scans there: {error.strerror or error}") from error
