"""What is checked after every tick of a storm's run, and what is counted."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit
from swarmscope.held import Held
from swarmscope.onboard.reasons import STATE_NAMES
from swarmscope.onboard.sharing.message import MAX_PACKET_BYTES
from swarmscope.sim.loop import Setting, Trace
from swarmscope.sim.state import Sim
from swarmscope.storm.forger import Attack
from swarmscope.storm.ranges import STOOD_S

SLACK = 1e-9
MOVES_MPS = 1e-9

Found = tuple[str, int, str]


class Breach(NamedTuple):
    """What must not happen."""

    kind: str
    """contact, command, clearance, radio, bytes, reason or error."""
    tick: int
    robot: int
    text: str


class Allowed(NamedTuple):
    """What time and radio allow."""

    dt: float
    bitrate_bps: float
    late_s: float
    """Time on the air beyond the time that has passed: the longest wait and packet [s]."""


def _allowed(setting: Setting) -> Allowed:
    radio = setting.radio
    longest = 8.0 * (MAX_PACKET_BYTES + radio.overhead_bytes) / radio.bitrate_bps
    late = radio.max_wait_s + longest + SLACK
    return Allowed(*map(float, (setting.dt, radio.bitrate_bps, late)))


class Counts(NamedTuple):
    """What is counted of a run, in ticks."""

    on: np.ndarray
    """(N,): in which each robot was switched on and had not arrived."""
    under_way: np.ndarray
    """(N,): the same up to the last one in which it drove."""
    driving: np.ndarray
    """(1,): in which they drove, of all robots together."""
    drove: np.ndarray
    """(1,): the last one in which one drove or was switched off."""


def _no_counts(robots: int) -> Counts:
    return Counts(*(np.zeros(size, np.int64) for size in (robots, robots, 1, 1)))


@jit
def look(robots: np.ndarray, decisions: np.ndarray, tick: int, may: Allowed, counts: Counts) -> bool:
    """Count who is switched on and who drives; return whether something must not be, for `Watch` to say what.

    Numbers that are none fail every comparison.
    """
    fine = True
    there = tick * may.dt + may.late_s
    for i in range(robots.size):
        robot, v, w = robots[i], decisions[i]["v"], decisions[i]["w"]
        if tick < robot["down_until"]:
            counts.drove[0] = tick
        elif robot["arrived"] == 0:
            counts.on[i] += 1
            if robot["v"] > MOVES_MPS:
                counts.under_way[i] = counts.on[i]
                counts.driving[0] += 1
                counts.drove[0] = tick
        placed = math.isfinite(robot["x"]) and math.isfinite(robot["y"]) and math.isfinite(robot["yaw"])
        sound = robot["v"] >= -SLACK and robot["v"] <= robot["v_max"] + SLACK and robot["clearance"] >= 0.0
        obeys = v >= 0.0 and v <= robot["v_max"] + SLACK and abs(w) <= robot["w_max"] + SLACK
        quiet = 8.0 * robot["air_bytes"] / may.bitrate_bps <= there
        fine = fine and robot["crashed"] == 0 and placed and sound and obeys and quiet
    return not fine


class Watch:
    """Looks at a run between ticks; ``breach`` is the first one, with which the run ends."""

    def __init__(self, setting: Setting, attack: Attack | None = None) -> None:
        self.breach: Breach | None = None
        self.attack = attack
        self._setting = setting
        self._counts = _no_counts(len(setting.starts))
        self._may = _allowed(setting)

    @property
    def under_way_s(self) -> float:
        """Seconds of all robots from the start to the last tick in which each drove, without those switched off."""
        return float(self._counts.under_way.sum()) * self._setting.dt

    @property
    def driving_s(self) -> float:
        """Seconds in which they drove."""
        return float(self._counts.driving[0]) * self._setting.dt

    def __call__(self, held: Held[Sim], tick: int) -> bool:
        """Check what was decided and what the tick before did; return whether the run ends."""
        sim = held.what
        odd = look(sim.robots, sim.decisions, tick, self._may, self._counts)
        found = self._found(sim, tick) if odd else None
        if found is not None:
            self.breach = Breach(found[0], tick, found[1], found[2])
            return True
        if self.attack is not None:
            self.attack.strike(held, tick)
        return bool((tick - self._counts.drove[0]) * self._setting.dt >= STOOD_S)

    def finish(self, trace: Trace) -> None:
        """Check what the last tick did, and that whoever did not arrive says why."""
        if self.breach is not None:
            return
        tick = len(trace.t_s)
        found = self._contact(trace.robots) or self._state(trace.robots) or self._reasons(trace)
        if found is not None:
            self.breach = Breach(found[0], tick, found[1], found[2])

    def _found(self, sim: Sim, tick: int) -> Found | None:
        """Return the first thing that must not be, in words."""
        robots = sim.robots
        return self._contact(robots) or self._commands(sim) or self._state(robots) or self._radio(sim, tick)

    def _contact(self, robots: np.ndarray) -> Found | None:
        hit = np.flatnonzero(robots["crashed"])
        if not hit.size:
            return None
        i = int(hit[0])
        gaps = np.hypot(robots["x"] - robots["x"][i], robots["y"] - robots["y"][i])
        gaps[i] = math.inf
        j = int(np.argmin(gaps))
        with_robot = bool(robots["crashed"][j]) and gaps[j] < robots["radius"][i] + robots["radius"][j] + 0.01
        what = f"robot {j}" if with_robot else "the world"
        place = f"({robots['x'][i]:.3f}, {robots['y'][i]:.3f})"
        return "contact", i, f"robot {i} touched {what} at {place}"

    def _commands(self, sim: Sim) -> Found | None:
        v, w = sim.decisions["v"], sim.decisions["w"]
        fine = np.isfinite(v) & np.isfinite(w) & (v >= 0.0)
        fine &= (v <= sim.robots["v_max"] + SLACK) & (np.abs(w) <= sim.robots["w_max"] + SLACK)
        bad = np.flatnonzero(~fine)
        if not bad.size:
            return None
        i = int(bad[0])
        return "command", i, f"robot {i} was commanded {float(v[i])!r} m/s, {float(w[i])!r} rad/s"

    def _state(self, robots: np.ndarray) -> Found | None:
        poses = np.isfinite(robots["x"]) & np.isfinite(robots["y"]) & np.isfinite(robots["yaw"])
        fine = poses & (robots["v"] >= -SLACK) & (robots["v"] <= robots["v_max"] + SLACK)
        bad = np.flatnonzero(~fine | ~(robots["clearance"] >= 0.0))
        if not bad.size:
            return None
        i = int(bad[0])
        clearance, speed = float(robots["clearance"][i]), float(robots["v"][i])
        return "clearance", i, f"robot {i}: clearance {clearance!r} m, speed {speed!r} m/s"

    def _radio(self, sim: Sim, tick: int) -> Found | None:
        """No radio was on the air longer than there was time, and the longest wait and packet beyond."""
        radio = self._setting.radio
        there = tick * self._setting.dt + self._may.late_s
        bad = np.flatnonzero(8.0 * sim.robots["air_bytes"] / radio.bitrate_bps > there)
        if not bad.size:
            return None
        i = int(bad[0])
        return "radio", i, f"robot {i} has sent {int(sim.robots['air_bytes'][i])} bytes, more than fit in {there:.2f} s"

    def _reasons(self, trace: Trace) -> Found | None:
        words = self._setting.planner.reasons
        for i in np.flatnonzero(trace.robots["arrived"] == 0).tolist():
            code = int(trace.records.reason[-1, i])
            if code >= len(words) or not words[code].strip():
                return "reason", i, f"robot {i} did not arrive and says no reason (code {code})"
        return None


def reasons_of(setting: Setting, trace: Trace) -> dict[str, int]:
    """Return in which state and for which reason robots ended that did not arrive, and how many each."""
    found: dict[str, int] = {}
    for i in np.flatnonzero((trace.robots["arrived"] == 0) & (trace.robots["crashed"] == 0)).tolist():
        state = STATE_NAMES[trace.records.state[-1, i]]
        drives = "drives" if trace.robots["v"][i] > MOVES_MPS else "stands"
        words = f"{drives}, {state}: {setting.planner.reasons[trace.records.reason[-1, i]]}"
        found[words] = found.get(words, 0) + 1
    return found
