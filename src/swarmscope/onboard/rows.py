"""The rows of one robot outside any simulation, and the call of its planner."""

from __future__ import annotations

from typing import Any

import numpy as np

from swarmscope.held import Held
from swarmscope.onboard.percept import DECISION, PERCEPT, Row
from swarmscope.onboard.perception.clock import skip_to
from swarmscope.onboard.perception.reproject import Found
from swarmscope.onboard.planners import Planner
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.view import View, new_swarm, python_view


class Rows:
    """A swarm of one."""

    def __init__(self, planner: Planner, rig: Rig, params: Any, address: int, boot: int = 0) -> None:
        self.rig, self.params, self.planner = rig, params, planner
        self.swarm, self.memories = new_swarm(1, rig), planner.new_memory(1)
        self.swarm.percepts["id"], self.swarm.percepts["boot"] = address, boot
        self._held = Held(self.swarm)
        self._given = {name: self.swarm.percepts[name] for name in PERCEPT.names or ()}
        self._said = {name: self.swarm.decisions[name] for name in DECISION.names or ()}

    @property
    def view(self) -> View:
        """What kernels are given."""
        return python_view(self.swarm, 0)

    @property
    def scan(self) -> np.ndarray:
        """What the LiDAR fills, (F,) float32 [m]: everything, or its field of view."""
        return self.found.scan

    @property
    def found(self) -> Found:
        """The same with what its holes hide, which counts where ``scan_hides`` is told."""
        sensor = self.rig.sensor
        field = slice(sensor.first, sensor.first + (sensor.field or sensor.beams))
        return Found(self.swarm.scans[0, field], self.swarm.hidden[0, field])

    @property
    def percept(self) -> Row:
        """What the robot was given, a ``PERCEPT``."""
        return self.swarm.percepts[0]

    @property
    def decision(self) -> Row:
        """What it answered, a ``DECISION``."""
        return self.swarm.decisions[0]

    @property
    def shared(self) -> Row:
        """Its tracks, its inbox's memory, its counters, a ``SHARED``."""
        return self.swarm.shared[0]

    @property
    def memory(self) -> Row:
        """Its planner's memory."""
        return self.memories[0]

    def fill(self, **values: float) -> None:
        """Set fields of the percept."""
        for name, value in values.items():
            self._given[name][0] = value

    def set_time(self, now_s: float, dt_s: float) -> None:
        """Set a time since the first tick, of which all has passed, however long ago the planner was called last."""
        self.fill(now_s=now_s, dt_s=dt_s)
        skip_to(self.shared, now_s - dt_s)

    def see(self, neighbours: list[Any]) -> None:
        """Set the neighbours (``Seen``), at most MAX_NEIGHBOURS, nearest first."""
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
        self.planner.step_all(0, 1, self._held, self.memories, self.params)

    def load(self) -> None:
        """Compile or load whatever a tick needs; changes nothing."""
        self.planner.step_all(0, 0, self._held, self.memories, self.params)

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
