"""Asking neighbours what they see in the target direction, taking in what they answer (GIWT 4.3)."""

from __future__ import annotations

import math

from swarmscope._jit import jit
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.network.graph import GRID_M
from swarmscope.onboard.percept import MAX_INBOX, MAX_NEIGHBOURS, MAX_OUTBOX, PEERS, Row
from swarmscope.onboard.sharing.inbox import ask_direction, room_to_ask, start_round
from swarmscope.onboard.sharing.message import read_latent
from swarmscope.onboard.view import View


@jit
def take_latents(percept: Row, shared: Row, memory: Row) -> None:
    """Keep this tick's answers; all are of somebody who was asked in the open round, one of each (``read_inbox``)."""
    for j in range(min(MAX_INBOX, shared["latent_n"])):
        at = shared["latent_at"][j]
        sender = int(percept["packet"][at, 1]) | (int(percept["packet"][at, 2]) << 8)
        slot = -1
        for a in range(MAX_OUTBOX):
            if memory["asked_id"][a] == sender and memory["answered"][a] == 0:
                slot = a
        if slot < 0:
            continue
        memory["scale"][slot] = read_latent(
            percept["packet"][at], percept["packet_length"][at], memory["latent"][slot]
        )
        memory["answered"][slot] = 1


@jit
def ask_round(see: View, memory: Row) -> bool:
    """Ask the neighbours in sight within GRID_M, nearest first, keeping room for answers that we owe (``room_to_ask``).

    Return whether anybody was asked; without room or neighbours the last round stays as it is.
    """
    percept = see.percept
    owed = 0
    for q in range(min(PEERS, see.shared["ask_n"])):
        if see.shared["ask_direction"][q] >= 0:
            owed += 1
    room = room_to_ask(see, owed)
    n = 0
    for k in range(min(MAX_NEIGHBOURS, percept["n_neighbours"])):
        if n >= room or not in_grid(percept, k):
            break
        if n == 0:
            start_round(see)
            memory["direction"] = percept["compass"] + percept["goal_bearing"]
            for a in range(MAX_OUTBOX):
                memory["asked_id"][a] = -1
                memory["answered"][a] = 0
        memory["asked_id"][n] = percept["neighbour_id"][k]
        ask_direction(see, percept["neighbour_id"][k], memory["direction"])
        n += 1
    return n > 0


@jit
def in_grid(percept: Row, k: int) -> bool:
    """Tell whether the ``k``-th neighbour seen is within GRID_M."""
    x, y = percept["neighbour_x"][k], percept["neighbour_y"][k]
    return bool(x * x + y * y <= GRID_M * GRID_M)


@jit
def usable(see: View, memory: Row, turned_deg: float) -> bool:
    """Tell whether the last round is recent and was about the present target direction."""
    percept, shared = see.percept, see.shared
    if shared["asked_seq"] < 0 or percept["now_s"] - shared["asked_s"] > see.rig.sharing.max_age_s:
        return False
    turned = wrap_angle(percept["compass"] + percept["goal_bearing"] - memory["direction"])
    return bool(abs(turned) <= math.radians(turned_deg))
