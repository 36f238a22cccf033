"""One tick of a robot, from scan to command: the chain that every planner's decision stands in.

perceive (packets, poses, scan, safe directions) -> share (own features, answers) -> decide -> guard.
"""

from __future__ import annotations

from swarmscope._jit import jit, jit_inline, jit_paste
from swarmscope.held import Held
from swarmscope.onboard.control.arriving import turn_at_goal
from swarmscope.onboard.control.guard import guard
from swarmscope.onboard.perception.bearings import steady
from swarmscope.onboard.perception.clock import keep_time
from swarmscope.onboard.perception.faulty import leave_out_faulty
from swarmscope.onboard.perception.features import UNMASKED, align_features, extrema, what_counts
from swarmscope.onboard.perception.filters import filter_padded, prepare_scan
from swarmscope.onboard.perception.frames import keep_frame, look_back, shorten_frame
from swarmscope.onboard.perception.lost import keep_lost
from swarmscope.onboard.perception.mend import mend
from swarmscope.onboard.perception.reproject import move_on
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.perception.standing import tell_standing
from swarmscope.onboard.rig import AHEAD, PRINTED
from swarmscope.onboard.sharing.inbox import answer_all, read_inbox
from swarmscope.onboard.sharing.tracks import mask_moving_neighbours, measure_bodies, update_odometry, update_tracks
from swarmscope.onboard.view import Swarm, View, view_of


@jit_paste
def perceive(see: View, still_s: float) -> None:
    """Take in packets, poses and scan: fill ``see.masked`` and ``see.safe``.

    A neighbour that has not moved for ``still_s`` [s] stays in the scan: it is an obstacle.
    """
    see.out["n_out"] = 0
    see.out["fused"] = 0
    keep_time(see.percept, see.shared)
    steady(see.percept, see.shared)
    dx, dy = update_odometry(see.percept, see.shared)
    read_inbox(see)
    update_tracks(see.percept, see.shared, see.rig, dx, dy)
    leave_out_faulty(see.scan, see.misses, see.rig)
    move_on(see)
    if see.rig.sensor.field > 0:
        look_back(see)
    broken = mend(see.scan, see.rig, see.safe)
    at = keep_frame(see) if see.rig.sensor.field > 0 else -1
    keep_lost(see, broken)
    if at >= 0:
        shorten_frame(see, at)
    if see.rig.guarding.strangers_mps > 0.0:
        tell_standing(see)
    measure_bodies(see)
    mask_moving_neighbours(see, still_s)
    safe_directions(see.masked, see.rig.sensor, see.reach[AHEAD], see.edges, see.safe)


@jit_paste
def share(see: View, wanted: bool) -> int:
    """Compute our own features where they are ``wanted`` or asked for; answer everybody who asked.

    Return how many there are in ``see.own``, -1 when they were not computed.
    """
    asked = see.shared["ask_n"] > 0
    count = own_features(see) if wanted or asked else -1
    if asked:
        answer_all(see, count)
    return count


@jit_inline
def own_features(see: View) -> int:
    """Compute our features (7) of the masked scan into ``see.own``, compass frame; return how many.

    Their mask is the printed rule (3): the look-ahead would hide whatever is near.
    """
    sensor, mask = see.rig.sensor, see.rig.sharing.feature_mask
    if mask != UNMASKED:
        safe_directions(see.masked, sensor, see.reach[PRINTED], see.edges, see.narrow)
    what_counts(mask, see.narrow)
    if sensor.field > 0:
        for n in range(sensor.beams):  # what is only remembered is not told
            if not see.shared["view_first"] <= n <= see.shared["view_last"]:
                see.narrow[n] = 0
    half = see.rig.taps.size // 2
    prepare_scan(see.masked, sensor.range_min, sensor.range_max, sensor.wraps, half, see.padded)
    filter_padded(see.padded, see.rig.taps, sensor.range_max, see.filtered)
    count = extrema(see.filtered, see.narrow, sensor, see.other.angles, see.other.distances)
    own, raw = see.own, see.other
    align_features(raw.angles, raw.distances, count, see.percept["compass"], own.angles, own.distances)
    return count


@jit
def perceive_all(first: int, last: int, held: Held[Swarm], still_s: float) -> None:
    """Let robots ``first`` to ``last - 1`` perceive."""
    swarm = held.what
    for i in range(first, last):
        perceive(view_of(swarm, i), still_s)


@jit
def guard_all(first: int, last: int, held: Held[Swarm]) -> None:
    """Let robots ``first`` to ``last - 1`` turn at their goals, and the guard have the last word on their commands."""
    swarm = held.what
    for i in range(first, last):
        see = view_of(swarm, i)
        turn_at_goal(see)
        guard(see)
