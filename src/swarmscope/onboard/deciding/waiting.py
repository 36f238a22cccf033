"""Who waits for whom, and what ends every wait: Nav-SCOPE (17), SFM-MAS (27), GIWT 4.2.3."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.deciding.fields import P_FREE, interaction_force, yields_to
from swarmscope.onboard.percept import PEERS, Row
from swarmscope.onboard.reasons import R_YIELD, YIELD
from swarmscope.onboard.sharing.tracks import moves
from swarmscope.onboard.view import View

PROPULSION = 1.0 * P_FREE
"""|F_a| of (17) and (27): w_a P_s with w_a = 1."""
FACES = 0.3
"""A neighbour faces us when the cosine of our direction off its heading is more than this."""
LEVEL = 0.1
"""Two robots whose cosines differ by less are equally far ahead; the smaller radio address goes first."""
AHEAD_S = 2.0
"""A collision is possible when two robots come that close within this time, both driving straight on."""


@jit_inline
def wait(see: View, memory: Row, must: bool, longest_s: float) -> None:
    """Stand still while ``must`` holds, at most ``longest_s``; then do not wait again for the same time."""
    now = see.percept["now_s"]
    if now < memory["push_s"] or not must:
        memory["wait_s"] = -1.0
        return
    if memory["wait_s"] < 0.0:
        memory["wait_s"] = now
    if now - memory["wait_s"] > longest_s:
        memory["wait_s"] = -1.0
        memory["push_s"] = now + longest_s
        return
    see.out["v"] = 0.0
    see.out["state"], see.out["reason"] = YIELD, R_YIELD


NOBODY, AT_LEAST_1, AS_PRINTED = range(3)
"""Weights of neighbours in (17) and (27): 0, so that nobody is repelled; w_i, but at least 1; w_i."""


class Repulsion(NamedTuple):
    """How (17) and (27) are taken: the numbers that planners bring (their ``Params`` explain each)."""

    still_s: float
    weight: float
    priority: bool


@jit_inline
def repulsion_of(params: Any) -> Repulsion:
    """Return how a planner's ``Params`` take (17) and (27)."""
    weight = 0.0
    if params.repulsion == AS_PRINTED:
        weight = params.w_i
    elif params.repulsion == AT_LEAST_1:
        weight = max(params.w_i, 1.0)
    return Repulsion(params.still_s, weight, params.priority != 0)


class Meeting(NamedTuple):
    """A neighbour within sigma_a that moves: where it is (compass frame, rad), and its force (12) on us, negative."""

    near: bool
    bearing: float
    force: float


@jit_inner
def _meeting(see: View, t: int, still_s: float, weight: float) -> Meeting:
    """Return how track ``t`` meets us."""
    shared, sigma_a = see.shared, see.rig.protection.sigma_a
    if not moves(see.percept, shared, t, still_s):
        return Meeting(False, 0.0, 0.0)
    x, y = shared["track_x"][t], shared["track_y"][t]
    distance = math.sqrt(x * x + y * y)
    if distance >= sigma_a or distance < 1e-6:
        return Meeting(False, 0.0, 0.0)
    return Meeting(True, math.atan2(y, x), interaction_force(distance, sigma_a, weight))


@jit_inline
def repelled(see: View, still_s: float, w_i: float) -> bool:
    """Tell whether (17) holds for a moving neighbour that goes before us, its weight at least 1.

    It does when it drives away from us (we follow it) or, heads-on or crossing, has the smaller radio address.
    """
    return gives_way(see, Repulsion(still_s, max(w_i, 1.0), True))


@jit_inline
def gives_way(see: View, by: Repulsion) -> bool:
    """Tell whether (17) holds for a moving neighbour; with ``by.priority`` for one that goes before us."""
    travel = see.percept["compass"] + see.out["heading"]
    for t in range(PEERS):
        met = _meeting(see, t, by.still_s, by.weight)
        if not met.near or not yields_to(PROPULSION, met.force, math.cos(met.bearing - travel)):
            continue
        if not by.priority:
            return True
        faces_us = math.cos(see.shared["track_yaw"][t] - met.bearing - math.pi) > FACES
        if not faces_us or see.shared["track_id"][t] < see.percept["id"]:
            return True
    return False


@jit_inline
def behind(see: View, by: Repulsion) -> bool:
    """Tell whether (27) holds for a moving neighbour that, with ``by.priority``, goes first (SFM-MAS IV-D)."""
    travel = see.percept["compass"] + see.out["heading"]
    must = False
    for t in range(PEERS):
        met = _meeting(see, t, by.still_s, by.weight)
        if not met.near:
            continue
        ours, its = math.cos(met.bearing - travel), -math.cos(met.bearing - see.shared["track_yaw"][t])
        smaller = see.shared["track_id"][t] < see.percept["id"]
        if yields_to(PROPULSION, met.force, ours):
            must |= not by.priority or goes_first(met.force, ours, its, smaller)
    return must


@jit
def goes_first(force: float, ours: float, its: float, smaller: bool) -> bool:
    """Tell whether a neighbour for which (27) makes us yield has the higher priority: it is relatively ahead.

    ``ours`` is the cosine of its direction off our heading, ``its`` that of ours off its heading: it knows the same two
    numbers the other way round. If (27) does not make it yield, too, it is past us and goes. If both would yield,
    the one that has the other less straight before it is ahead; at a tie the one with the ``smaller`` address.
    """
    if not yields_to(PROPULSION, force, its):
        return True
    if abs(ours - its) >= LEVEL:
        return ours > its
    return smaller


@jit
def crossed(see: View, still_s: float, within_m: float) -> bool:
    """Tell whether a moving neighbour with a smaller radio address comes near and a collision is possible (4.2.3).

    It is when it is ahead, within ``within_m`` [m], and both driving straight on, we at full speed, come closer
    than two footprints. It ends once it has passed: then the distance grows.
    """
    percept, shared, rig = see.percept, see.shared, see.rig
    travel = percept["compass"] + see.out["heading"]
    vx, vy = rig.body.v_max_mps * math.cos(travel), rig.body.v_max_mps * math.sin(travel)
    for t in range(PEERS):
        if not moves(percept, shared, t, still_s) or shared["track_id"][t] >= percept["id"]:
            continue
        x, y = shared["track_x"][t], shared["track_y"][t]
        if x * x + y * y >= within_m * within_m or x * vx + y * vy <= 0.0:
            continue
        ux, uy = shared["track_vx"][t] - vx, shared["track_vy"][t] - vy
        u2 = ux * ux + uy * uy
        along = -(x * ux + y * uy)
        if along <= 0.0 or u2 < 1e-6:
            continue
        after = min(AHEAD_S, along / u2)
        mx, my = x + after * ux, y + after * uy
        if mx * mx + my * my < (2.0 * rig.footprint) ** 2:
            return True
    return False
