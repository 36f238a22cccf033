"""What fails in the middle of a run, at random times: robots that restart, radios that fall silent, clocks that jump.

Before each tick ``strike`` draws what happens to whom. A robot that has restarted stands where it is, brakes if it was
driving, and neither sends nor hears, until it runs again: with the memory of a robot that was just switched on, a clock
that begins at 0 and a new boot number. Whoever has no radio loses what is on the way to it.
"""

from __future__ import annotations

import math

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.errors import ConfigError
from swarmscope.onboard.percept import DECISION, Row, new_shared
from swarmscope.onboard.planners import Planner
from swarmscope.onboard.reasons import R_BLOCKED_WAIT, YIELD
from swarmscope.onboard.view import Swarm
from swarmscope.sim.state import Sim
from swarmscope.sim.streams import CLOCK_JUMP, RESTART, SILENCE, boot_number, key, uniform

HOUR = 3600.0


@jit
def strike(sim: Sim, tick: int) -> None:
    """Draw what fails at this tick; robots that have collided are left in peace."""
    faults = sim.faults
    if not (faults.restarts_per_h > 0.0 or faults.silences_per_h > 0.0 or faults.clock_jumps_per_h > 0.0):
        return
    for i in range(sim.robots.size):
        robot = sim.robots[i]
        if robot["crashed"]:
            continue
        if tick >= robot["down_until"] and _draw(sim, tick, i, RESTART) < _chance(sim, faults.restarts_per_h):
            _restart(sim, tick, i)
        if tick >= robot["mute_until"] and _draw(sim, tick, i, SILENCE) < _chance(sim, faults.silences_per_h):
            robot["silences"] += 1
            robot["mute_until"] = tick + _ticks(sim, faults.silence_s)
        _jump(sim, tick, i)
        if is_off_air(robot, tick):
            _lose_mail(sim, i)


@jit_inline
def is_off_air(robot: Row, tick: int) -> bool:
    """Tell whether a robot neither sends nor hears at this tick."""
    return bool(tick < robot["down_until"] or tick < robot["mute_until"])


@jit_inner
def _draw(sim: Sim, tick: int, i: int, purpose: int) -> float:
    """Return robot i's number in [0, 1) for this tick and purpose."""
    return uniform(key(sim.clock.seed, i, tick, purpose))


@jit_inner
def _chance(sim: Sim, per_h: float) -> float:
    """Return the probability of an event within a tick."""
    return per_h * sim.clock.dt / HOUR


@jit_inner
def _ticks(sim: Sim, duration_s: float) -> int:
    """Return how many ticks a duration takes, one at least."""
    return max(1, int(math.ceil(duration_s / sim.clock.dt - 1e-9)))


@jit_inner
def _restart(sim: Sim, tick: int, i: int) -> None:
    """Switch robot i off and on."""
    robot = sim.robots[i]
    robot["boots"] += 1
    robot["down_until"] = tick + _ticks(sim, sim.faults.restart_s)
    robot["clock_s"] = -robot["down_until"] * sim.clock.dt
    sim.percepts[i]["boot"] = boot_number(sim.clock.seed, i, robot["boots"])


@jit_inner
def _jump(sim: Sim, tick: int, i: int) -> None:
    """Let robot i's clock jump, to and fro alike often."""
    chance = _chance(sim, sim.faults.clock_jumps_per_h)
    drawn = _draw(sim, tick, i, CLOCK_JUMP)
    if drawn < chance:
        sim.robots[i]["clock_jumps"] += 1
        sim.robots[i]["clock_s"] += sim.faults.clock_jump_s if drawn < 0.5 * chance else -sim.faults.clock_jump_s


@jit_inner
def _lose_mail(sim: Sim, i: int) -> None:
    """Lose what is on the way to robot i; its senders count it, strangers do not."""
    for q in range(sim.robots[i]["queued"]):
        sender = sim.queue_from[i, q]
        if sender >= 0:
            sim.robots[sender]["lost"] += 1
    sim.robots[i]["queued"] = 0


@jit
def forget(robots: np.ndarray, tick: int, rows: np.ndarray, blank: np.ndarray) -> None:
    """Make the ``rows (N, B)`` of robots that are switched off those of robots that have seen nothing: ``blank``."""
    for i in range(robots.size):
        if tick < robots[i]["down_until"]:
            for b in range(rows.shape[1]):
                rows[i, b] = blank[i % blank.shape[0], b]


def blanks(planner: Planner, swarm: Swarm, memory: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return all that robots remember and decide, as bytes (N, B), each with what it is at first (N or 1, B)."""
    if memory.dtype.hasobject:
        raise ConfigError(
            "faults.restarts_per_h, robot.start_s", f"planner '{planner.name}' keeps Python objects in its memory"
        )
    decision = np.zeros(1, DECISION)
    decision["p_self"] = decision["p_left"] = np.nan
    decision["state"], decision["reason"] = YIELD, R_BLOCKED_WAIT
    pairs = [(memory, planner.new_memory(len(memory))), (swarm.shared, new_shared(1)), (swarm.decisions, decision)]
    pairs += [(rows, np.zeros_like(rows[:1])) for rows in (swarm.kept, swarm.unseen, swarm.misses)]
    return [(_bytes_of(rows), _bytes_of(blank)) for rows, blank in pairs]


def _bytes_of(rows: np.ndarray) -> np.ndarray:
    """Return the same memory as bytes, a row each."""
    seen: np.ndarray = rows.reshape(len(rows), -1).view(np.uint8)
    return seen
