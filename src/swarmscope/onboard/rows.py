"""The arrays behind one robot and the call of its planner: the only place that knows what a planner is handed."""

from __future__ import annotations

from typing import Any

import numpy as np

from swarmscope.onboard.edge import Seen
from swarmscope.onboard.percept import DECISION, PERCEPT, Rig, Row, new_scratch, new_shared


class Rows:
    """A row of every array of one robot."""

    def __init__(self, planner: Any, rig: Rig, params: Any, address: int) -> None:
        self.rig, self.params, self._planner = rig, params, planner
        self.ranges = np.full((1, rig.sensor.beams), np.inf, np.float32)
        self.percepts = np.zeros(1, PERCEPT)
        self.percepts["id"] = address
        self.decisions = np.zeros(1, DECISION)
        self.decisions["p_self"] = self.decisions["p_left"] = np.nan
        self.shareds, self.memories = new_shared(1), planner.new_memory(1)
        self._scratch = new_scratch(1, rig)
        self._given = {name: self.percepts[name] for name in PERCEPT.names or ()}
        self._said = {name: self.decisions[name] for name in DECISION.names or ()}

    @property
    def scan(self) -> np.ndarray:
        """What is seen (M,) float32 [m]."""
        row: np.ndarray = self.ranges[0]
        return row

    @property
    def percept(self) -> Row:
        """What the robot was given, a ``PERCEPT``."""
        return self.percepts[0]

    @property
    def decision(self) -> Row:
        """What it answered, a ``DECISION``."""
        return self.decisions[0]

    @property
    def shared(self) -> Row:
        """Its tracks, its inbox's memory, its counters, a ``SHARED``."""
        return self.shareds[0]

    @property
    def memory(self) -> Row:
        """Its planner's memory."""
        return self.memories[0]

    def fill(self, **values: float) -> None:
        """Set fields of the percept."""
        for name, value in values.items():
            self._given[name][0] = value

    def see(self, neighbours: list[Seen]) -> None:
        """Set the neighbours, at most MAX_NEIGHBOURS, nearest first."""
        given = self._given
        given["n_neighbours"][0] = len(neighbours)
        for k, seen in enumerate(neighbours):
            given["neighbour_id"][0, k] = seen.address
            given["neighbour_x"][0, k], given["neighbour_y"][0, k] = seen.x, seen.y
            given["neighbour_yaw"][0, k] = seen.yaw

    def receive(self, packets: list[bytes]) -> None:
        """Set the packets, at most MAX_INBOX of at most MAX_PACKET_BYTES."""
        given = self._given
        given["n_packets"][0] = len(packets)
        for k, packet in enumerate(packets):
            given["packet_length"][0, k] = len(packet)
            given["packet"][0, k, : len(packet)] = np.frombuffer(packet, np.uint8)

    def step(self) -> None:
        """Run one tick of the planner and the guard."""
        self._step(0, 1)

    def load(self) -> None:
        """Compile or load whatever a tick needs; changes nothing."""
        self._step(0, 0)

    def _step(self, first: int, last: int) -> None:
        arrays = (self.ranges, self.percepts, self.shareds, self.memories, self.decisions)
        self._planner.step_all(first, last, *arrays, self._scratch, self.rig, self.params)

    def said(self, name: str) -> Any:
        """Return a field of the decision as a plain number."""
        return self._said[name][0].item()

    def outbox(self) -> list[tuple[int, bytes]]:
        """Return the packets to send: (address, bytes)."""
        said = self._said
        sent = []
        for k in range(int(said["n_out"][0])):
            length = int(said["out_length"][0, k])
            if length > 0:
                sent.append((int(said["out_to"][0, k]), said["out"][0, k, :length].tobytes()))
        return sent


def kernels_of(planner: Any) -> tuple[Any, ...]:
    """Return the compiled functions that a planner's ``step_all`` is or calls."""
    return tuple(getattr(planner, "KERNELS", (planner.step_all,)))
