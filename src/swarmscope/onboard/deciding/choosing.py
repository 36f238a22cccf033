"""The choice of a side: own features, neighbours' features, fused (Nav-SCOPE 8-15, Algorithm 1 lines 16-27)."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.control.wanting import halt
from swarmscope.onboard.deciding.asking import ask_neighbours
from swarmscope.onboard.deciding.fields import (
    following_probability,
    fuse,
    in_pass_band,
    interaction_force,
    left_probability,
)
from swarmscope.onboard.deciding.following import begin_following, resume, side_bias
from swarmscope.onboard.deciding.memory import say
from swarmscope.onboard.deciding.progress import break_loop, nearest_in_sight
from swarmscope.onboard.percept import PEERS, Row
from swarmscope.onboard.perception.areas import normalise, passable_distance, quadrant_area
from swarmscope.onboard.perception.features import align_features
from swarmscope.onboard.reasons import DECIDE, R_ALONE, R_ANSWERS, R_FUSED, R_LOOP
from swarmscope.onboard.sharing.inbox import waiting_for_answers
from swarmscope.onboard.view import Table, View


class Manner(NamedTuple):
    """How a side is chosen: the numbers that planners bring (their ``Params`` explain each)."""

    w_i: float
    prior: float
    ask_every_s: float
    patience_s: float
    resume_m: float
    loop_m: float
    polygon: bool
    """Read features as SFM-MAS does: areas (24), passable distances (22) with borders on the chords."""
    threshold_m: float


@jit_inline
def decide_side(see: View, memory: Row, count: int, manner: Manner) -> bool:
    """State ii: choose the side, asking, and waiting for answers that are still out. Return whether it is chosen.

    ``count`` features are in ``see.own``. An oracle's side, where one was told, is taken instead.
    """
    memory["closest"] = min(memory["closest"], nearest_in_sight(see))
    if resume(see, memory, manner.resume_m):
        return True
    since = see.percept["now_s"] - see.shared["asked_s"]
    if manner.w_i > 0.0 and memory["mode"] != DECIDE and since >= manner.ask_every_s:
        ask_neighbours(see)
    memory["mode"] = DECIDE
    if waiting_for_answers(see.percept, see.shared, manner.patience_s):
        halt(see)
        say(see, memory, DECIDE, R_ANSWERS)
        return False
    side = choose_side(see, max(0, count), manner.w_i, side_bias(see, manner.prior), manner.polygon, manner.threshold_m)
    if memory["told"] != 0:
        side = memory["told"]
        see.out["p_left"] = 1.0 if side > 0 else 0.0
    begin_following(see, memory, break_loop(see, memory, manner.loop_m, side))
    say(see, memory, DECIDE, R_LOOP if memory["strict"] else (R_FUSED if see.out["heard"] else R_ALONE))
    return True


@jit
def own_probability(features: Table, count: int, half_alpha: float, bias: float, polygon: bool) -> float:
    """Return P_a (9), SFM-MAS (7), from our features in the target-aligned frame, sorted in [0, 2 pi), normalised.

    ``polygon`` takes areas from triangles (SFM-MAS 24), with borders linear in the angle, as Table II needs.
    """
    angles, distances = features.angles, features.distances
    quarter = 0.5 * math.pi
    return left_probability(
        quadrant_area(angles, distances, count, 0.0, half_alpha, polygon),
        quadrant_area(angles, distances, count, -half_alpha, 0.0, polygon),
        quadrant_area(angles, distances, count, half_alpha, quarter, polygon),
        quadrant_area(angles, distances, count, -quarter, -half_alpha, polygon),
        bias,
    )


@jit_inline
def choose_side(see: View, count: int, w_i: float, bias: float, polygon: bool, threshold_m: float = 0.0) -> int:
    """Return the side to pass the obstacle on, +1 left or -1 right, and note the numbers in ``see.out``.

    Ours are the ``count`` features in ``see.own``, compass frame, m; ``see.other`` is scratch. Left iff
    P_dir >= 0.5 (MAP, readings 10). ``threshold_m`` is w_n of (14) where it is not 0.
    """
    percept, rig, features = see.percept, see.rig, see.other
    target = percept["compass"] + percept["goal_bearing"]
    half_alpha = 0.5 * see.rig.protection.alpha
    own = see.own
    w_n = normalise(threshold_m if threshold_m > 0.0 else rig.protection.w_n, rig.sensor.range_max)
    align_features(own.angles, own.distances, count, -target, features.angles, features.distances)
    _normalise_all(features.distances, count, rig.sensor.range_max)
    p_self = own_probability(features, count, half_alpha, bias, polygon)
    weighted, weights = 0.0, 0.0
    heard = 0
    for t in range(PEERS):
        opinion = _opinion(see, t, target, Reading(w_i, w_n, polygon))
        if not opinion.given:
            continue
        weighted += opinion.force * opinion.left
        weights += opinion.force
        see.out["heard_id"][heard] = see.shared["track_id"][t]
        see.out["heard_p"][heard], see.out["heard_f"][heard] = opinion.left, opinion.force
        see.out["heard_side"][heard] = opinion.side
        heard += 1
    p_left = fuse(p_self, weighted, weights)
    see.out["p_self"], see.out["p_left"] = p_self, p_left
    see.out["fused"], see.out["heard"] = 1, heard
    return 1 if p_left >= 0.5 else -1


class Opinion(NamedTuple):
    """What a neighbour's features say: P_ni (14) that left is right, its weight f_ai (12), and where it is."""

    given: bool
    left: float
    force: float
    side: int
    """+1 on the left of the target direction, -1 on the right."""


class Reading(NamedTuple):
    """How neighbours' features are read: their weight, the threshold w_n (normalised), and as polygons or not."""

    w_i: float
    w_n: float
    polygon: bool


@jit_inner
def _opinion(see: View, t: int, target: float, by: Reading) -> Opinion:
    """Return the opinion of the neighbour of track ``t``; none outside the pass band, behind us, or unheard."""
    shared, rig, features = see.shared, see.rig, see.other
    nothing = Opinion(False, 0.0, 0.0, 0)
    if shared["track_id"][t] < 0:
        return nothing
    x, y = shared["track_x"][t], shared["track_y"][t]
    distance = math.sqrt(x * x + y * y)
    if not in_pass_band(distance, see.rig.protection.sigma_a):
        return nothing
    bearing = wrap_angle(math.atan2(y, x) - target)
    slot = _heard_of(shared, shared["track_id"][t])
    if slot < 0 or abs(bearing) > 0.5 * math.pi:
        return nothing
    n = shared["heard_n"][slot]
    heard = Table(shared["heard_angle"][slot], shared["heard_distance"][slot])
    align_features(heard.angles, heard.distances, n, -target, features.angles, features.distances)
    _normalise_all(features.distances, n, rig.sensor.range_max)
    half_alpha = 0.5 * see.rig.protection.alpha
    x_1 = passable_distance(features.angles, features.distances, n, 0.0, half_alpha, by.polygon)
    x_2 = passable_distance(features.angles, features.distances, n, -half_alpha, 0.0, by.polygon)
    left = following_probability(x_1, x_2, by.w_n, bearing >= 0.0)
    force = interaction_force(distance, see.rig.protection.sigma_a, by.w_i)
    return Opinion(True, left, force, 1 if bearing >= 0.0 else -1)


@jit_inner
def _normalise_all(distances: np.ndarray, count: int, range_max: float) -> None:
    """Apply (SFM-MAS 25) to the first ``count`` distances in place."""
    for j in range(count):
        distances[j] = normalise(distances[j], range_max)


@jit_inner
def _heard_of(shared: Row, peer: int) -> int:
    """Return the slot with the features of ``peer``, or -1."""
    for p in range(PEERS):
        if shared["heard_id"][p] == peer and shared["heard_n"][p] > 0:
            return p
    return -1
