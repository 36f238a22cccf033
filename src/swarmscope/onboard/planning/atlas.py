"""Atlas: a robot that remembers what it has seen closed, and goes the shortest way through the rest.

The map holds cells in which something stands, in the frame of the robot's own odometry and compass; what it does not
know counts as free. It goes along the shortest way to the goal that is open by that map, heads for the way's first
corner, and searches again only when something closes the way or leaves a shorter one open. Robots that stand for long
are in the way but not in the map. Neighbours are asked whether they know the way to be closed. The safe directions and
the guard are beneath, as with all planners.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from swarmscope._jit import jit_inline, jit_inner
from swarmscope.bounds import Bounds, Flag, Metres, Seconds
from swarmscope.geometry import wrap_angle
from swarmscope.onboard.control.wanting import halt, head_for
from swarmscope.onboard.deciding import giving_way
from swarmscope.onboard.deciding.evading import Evading, comes, evade, keep_right
from swarmscope.onboard.deciding.following import away_from_nearest
from swarmscope.onboard.deciding.getting_away import nearest_free, watch_hold
from swarmscope.onboard.deciding.progress import last_speed
from swarmscope.onboard.mapping.asking import ask, listen
from swarmscope.onboard.mapping.cells import FULL, NODE, ask_for, draw_discs
from swarmscope.onboard.mapping.evidence import learn
from swarmscope.onboard.mapping.kept import SAME, find_narrow, lose_sight, review
from swarmscope.onboard.mapping.memory import MAP, new_memory
from swarmscope.onboard.mapping.telling import Talk
from swarmscope.onboard.mapping.tight import Terms, find_tighter, note_gone
from swarmscope.onboard.mapping.trail import note_passed
from swarmscope.onboard.mapping.way import START_WITHIN, find_shorter, forget_and_find, is_on_way, nearest_open, shorten
from swarmscope.onboard.mapping.words import Spot, number
from swarmscope.onboard.percept import NEVER_S, PEERS, Row
from swarmscope.onboard.perception.corridor import corridor_length
from swarmscope.onboard.planners import Variant
from swarmscope.onboard.reasons import (
    ADVANCE,
    ARRIVED,
    ESCAPE,
    FIRST_OWN,
    FOLLOW,
    R_ARRIVED,
    R_FREE,
    R_HELD_NO_NUMBER,
    R_LOST,
)
from swarmscope.onboard.sharing.tracks import moves
from swarmscope.onboard.view import View

__all__ = ["MEMORY", "NAME", "NEEDS", "REASONS", "SUMMARY", "VARIANTS", "Params", "decide", "new_memory"]

NAME = "atlas"
SUMMARY = "Atlas: remembers what it has seen closed, asks neighbours what closes its way, goes the shortest way"
ALONE = "own scan, goal bearing and distance, relative poses of visible neighbours, odometry and compass"
NEEDS = f"{ALONE}; what closes its way, on request"
_ALL = {"share": 3, "budget_bps": 1e6, "payload": 140, "reach_m": 100.0}
VARIANTS = {
    "atlas-mute": Variant("Atlas alone: remembers, and neither asks nor tells", ALONE, {"share": 0}),
    "atlas-scan": Variant("for studies: neighbours answer with what they see ahead", f"{ALONE}; scans", {"share": 2}),
    "atlas-maps": Variant("for studies: Atlas that tells everybody all of its map", f"{ALONE}; maps", {"share": 3}),
    "atlas-all": Variant("for studies: as atlas-maps, however much that is", f"{ALONE}; maps", _ALL),
}
MEMORY = MAP
GAP_M = 0.25
"""A gap that is too narrow is kept closed so far round its middle."""
CLOSE_M = 0.4
"""What is so near in the way to the next corner makes a robot ask whether it can get there at all."""
COMPANY_M = 1.5
AT_GAP = 4.0
"""Times its radius: who is so near to a gap is waited for; it is not the gap that is too narrow."""
AT_IT_M = 0.3
"""Who is so near to a narrow place does not wait any more."""
GAVE_S, GIVE_AGAIN = 1.0, 1.5
"""A wait goes on when it was interrupted for so long; who has waited long enough does not for half as long again."""
FARTHEST_M = 500.0
"""A goal that is farther is gone to as if it were so far."""
REASONS = (
    "goes to the next corner of its way",
    "heads beside the next corner: something is between",
    "no way is open by its map: has forgotten what closed it",
    "has not got away from here: leaves where there is most room",
    "waits beside a narrow place: somebody comes through",
)
R_CORNER, R_BESIDE, R_FORGOT, R_LEAVES, R_GIVES_WAY = range(FIRST_OWN, FIRST_OWN + 5)


class Params(NamedTuple):
    """What can be set. Distances in m, times in s."""

    cell_m: Annotated[float, Bounds(0.03, 1.0, "m")] = 0.0625
    """Side of a cell of the map."""
    margin_m: Metres = 0.05
    """Kept between the body and the middle of what stands in a cell."""
    room_m: Metres = 0.021
    """Kept beside the body where the way is driven."""
    deep_m: Metres = 0.15
    """What is hit is at least so deep."""
    arrive_m: Metres = 0.05
    """Distance to the goal at which a robot has arrived."""
    still_s: Seconds = 2.0
    """A neighbour that has not moved for so long is an obstacle."""
    soon_s: Seconds = 0.15
    """Time between two searches for a way that has closed."""
    again_s: Seconds = 1.0
    """Time between two searches for a shorter way, or for one where there was none."""
    gain_m: Metres = 0.3
    """A way that has opened is taken when it is shorter by so much."""
    tight_m: Metres = 0.3
    """A way through a gap that the guard lets pass and the margin does not is gone when it is shorter by so much."""
    wary: Annotated[float, Bounds(0.0, 100.0)] = 4.5
    """And, by a robot whose ways have turned out longer than they looked, by so many times the way to the gap and a
    metre."""
    evade_s: Seconds = 3.0
    """Others that move are got past when they would be met within so long; 0: never."""
    apart_m: Metres = 0.04
    """Kept between bodies then."""
    evade: Annotated[float, Bounds(0.0, 100.0)] = 3.0
    """Weight of meeting somebody at once, against a turn by a radian."""
    slow: Annotated[float, Bounds(0.0, 100.0)] = 1.0
    """Weight of standing."""
    right: Annotated[float, Bounds(0.0, 100.0)] = 0.5
    """Weight of meeting somebody who comes towards us on the right."""
    lane_s: Seconds = 10.0
    """For meetings so far ahead."""
    lane_m: Metres = 1.0
    """And who passes so near."""
    keep_right: Metres = 5.0
    """Who comes towards us so near makes us keep to the right where it is narrow; 0: never."""
    give_s: Seconds = 15.0
    """So long a robot waits before a narrow place for those that come through; 0: never."""
    held_s: Seconds = 3.0
    """A robot that has not moved for so long leaves along the longest corridor."""
    narrow_s: Seconds = 4.0
    """A gap before which something has been in the way for so long is too narrow."""
    keep_s: Seconds = 60.0
    """So long it is kept closed, each time twice as long."""
    forget_m: Metres = 0.0
    """What is farther away along x or y is forgotten, but for the fine layer; 0: nothing is. For studies."""
    share: Annotated[int, Bounds(0, 3)] = 1
    """1: others are asked whether the way is closed, and answered. 0: nothing is sent. For studies: 2: they answer with
    what stands before them; 3: nobody is asked, but everybody tells all of its map."""
    ask_s: Seconds = 2.0
    """Time between two questions, and between two answers to the same robot, at least."""
    ask_again_s: Seconds = 6.0
    """Time between two questions where somebody may hear them and nothing is new, at most."""
    reach_m: Annotated[float, Bounds(0.0, 100.0, "m")] = 25.0
    """What is farther from the one who answers is not told."""
    cells: Annotated[int, Bounds(1, 112)] = 100
    """Cells that an answer has at most."""
    payload: Annotated[int, Bounds(50, 140, "B")] = 60
    """Bytes that a packet has at most."""
    budget_bps: Annotated[float, Bounds(0.0, 1e6, "bit/s")] = 250.0
    """So much is sent on average at most, ..."""
    link_bytes: Annotated[int, Bounds(0, 64, "B")] = 23
    """... the link's own bytes for each packet with it."""
    believe_s: Seconds = 180.0
    """So long others are believed."""
    trust_m: Metres = 20.0
    """A robot that has gone so far without seeing another one does not know any more where the shared frame lies."""
    cautious: Flag = 1
    """1: a near cell is cleared when all beams across it pass, several times; 0: as soon as one does. For studies."""


@jit_inline
def decide(see: View, memory: Row, params: Params) -> None:
    """Learn, keep the way open and short, and head for its next corner."""
    cell = params.cell_m
    percept, shared = see.percept, see.shared
    if memory["disc_half"] == 0:
        draw_discs(memory, (see.rig.body.radius_m + params.margin_m) / cell, see.rig.footprint / cell)
        memory["forget_n"] = math.ceil(params.forget_m / (cell * NODE))
    if params.share > 0:
        listen(see, memory, _talk(params))
    if memory["arrived"] or percept["goal_distance"] <= params.arrive_m:
        memory["arrived"] = 1
        halt(see)
        see.out["state"], see.out["reason"], see.out["side"] = ARRIVED, R_ARRIVED, 0
        return
    u, v = shared["x"] / cell, shared["y"] / cell
    toward = percept["compass"] + percept["goal_bearing"]
    far = min(percept["goal_distance"], FARTHEST_M) / cell
    here, goal = Spot(u, v), Spot(u + far * math.cos(toward), v + far * math.sin(toward))
    if not abs(u) + abs(v) + abs(goal.u) + abs(goal.v) < math.inf:
        halt(see)
        see.out["state"], see.out["reason"], see.out["side"] = FOLLOW, R_HELD_NO_NUMBER, 0
        return
    review(memory, see.percept["now_s"])
    note_gone(memory, here, goal)
    note_passed(memory, u, v)
    _note_standing(see, memory, params.still_s, cell)
    learn(see, memory, cell, params.deep_m, params.cautious == 1)
    forgot = _keep_way(see, memory, params, here, goal)
    if params.share > 0:
        ask(see, memory, _talk(params), here)
    _drive(see, memory, params, here, forgot)


@jit_inline
def _talk(params: Params) -> Talk:
    """Return how others are asked and answered."""
    return Talk(
        params.share, params.cell_m, params.ask_s, params.ask_again_s, params.reach_m, params.cells, params.payload,
        params.budget_bps / 8.0, params.link_bytes, params.believe_s, params.trust_m,
    )  # fmt: skip


@jit_inner
def _note_standing(see: View, memory: Row, still_s: float, cell: float) -> None:
    """Note where neighbours stand for long."""
    shared, n = see.shared, 0
    _note_lost(see, memory, cell)
    for t in range(PEERS):
        if shared["track_id"][t] < 0 or moves(see.percept, shared, t, still_s):
            continue
        memory["stand_u"][n] = (shared["x"] + shared["track_x"][t]) / cell
        memory["stand_v"][n] = (shared["y"] + shared["track_y"][t]) / cell
        memory["stand_r"][n] = (shared["track_radius"][t] + see.rig.footprint) / cell
        n += 1
    if n > memory["stand_n"]:
        memory["closed"] = 1
    elif n < memory["stand_n"]:
        memory["opened"] = 1
    memory["stand_n"] = n


@jit_inner
def _note_lost(see: View, memory: Row, cell: float) -> None:
    """Note who stood and is out of sight now: nobody is seen where it was, who might have begun to move."""
    shared = see.shared
    for k in range(memory["stand_n"]):
        place = Spot(float(memory["stand_u"][k]), float(memory["stand_v"][k]))
        seen = False
        for t in range(PEERS):
            du = (shared["x"] + shared["track_x"][t]) / cell - place.u
            dv = (shared["y"] + shared["track_y"][t]) / cell - place.v
            seen = seen or (shared["track_id"][t] >= 0 and du * du + dv * dv < SAME * SAME)
        if not seen:
            lose_sight(memory, place, float(memory["stand_r"][k]), see.percept["now_s"])


@jit_inline
def _keep_way(see: View, memory: Row, params: Params, here: Spot, goal: Spot) -> int:
    """Search when there is no way, the way is closed, or a shorter one may have opened; return what was forgotten."""
    now, n, forgot = see.percept["now_s"], memory["way_n"], 0
    if n > 0:
        memory["way_u"][n - 1], memory["way_v"][n - 1] = goal.u, goal.v
    ask_for(memory, number(memory["way_room"]))
    here = nearest_open(memory, here, START_WITHIN)
    shorten(memory, here)
    on_way = memory["way_n"] > 0 and is_on_way(memory, here)
    memory["room"] = FULL
    due = now - memory["searched_s"] >= params.again_s
    if memory["way_n"] == 0 or memory["closed"]:
        soon = memory["way_n"] == 0 or now - memory["searched_s"] >= params.soon_s
        if due or (soon and not memory["failed"]):
            memory["searched_s"], memory["opened"] = now, 0
            forgot = forget_and_find(memory, here, goal)
            memory["failed"] = forgot > 0
            if forgot == 0:
                find_tighter(memory, here, goal, _terms(params))
    elif due and (memory["opened"] or not on_way):
        memory["searched_s"], memory["opened"] = now, 0
        find_shorter(memory, here, goal, params.gain_m / params.cell_m)
        find_tighter(memory, here, goal, _terms(params))
    if memory["way_n"] == 0:
        memory["way_n"], memory["way_u"][0], memory["way_v"][0] = 1, goal.u, goal.v
    return forgot


@jit_inline
def _terms(params: Params) -> Terms:
    """Return on what terms narrow gaps are gone through."""
    return Terms(params.tight_m / params.cell_m, params.wary, 1.0 / params.cell_m)


@jit_inline
def _drive(see: View, memory: Row, params: Params, here: Spot, forgot: int) -> None:
    """Head for the first corner, or for the free direction nearest to it."""
    cell = params.cell_m
    eu, ev = memory["way_u"][0] - here.u, memory["way_v"][0] - here.v
    bearing = wrap_angle(math.atan2(ev, eu) - see.percept["compass"])
    far = cell * math.sqrt(eu * eu + ev * ev)
    speed = last_speed(see, params.arrive_m)
    reason, state = R_CORNER, FOLLOW
    if memory["way_n"] == 1:
        reason, state = R_FREE, ADVANCE
    watch_hold(see, memory, here, cell, params.held_s)
    if see.percept["now_s"] < memory["leave_s"]:
        bearing = wrap_angle(memory["leave"] - see.percept["compass"])
        reason, state = R_LEAVES, ESCAPE
    else:
        ahead = min(far, 1.2)
        free = corridor_length(see.masked, see.rig, bearing, see.rig.body.radius_m + params.room_m, ahead)
        _watch_gap(see, memory, params, Gap(bearing, free, free < ahead))
        if free < ahead:
            heading, found = nearest_free(see, bearing)
            reason = R_BESIDE
            if found:
                bearing = heading
            else:
                bearing, reason, state = away_from_nearest(see), R_LOST, ESCAPE
    if forgot > 0:
        reason = R_FORGOT
    if params.keep_right > 0.0:
        if comes(see, bearing, params.still_s, params.keep_right):
            memory["comes_s"] = see.percept["now_s"]
        if see.percept["now_s"] - memory["comes_s"] < 2.0:
            bearing = keep_right(see, bearing)
    bearing, speed, waits = _give_way(see, memory, params, here, (bearing, speed))
    if waits:
        reason = R_GIVES_WAY
    if see.percept["now_s"] - memory["held_s"] < 0.9 * params.held_s:
        bearing, speed = evade(see, bearing, speed, params.still_s, _manner(params))
    head_for(see, bearing, speed)
    see.out["state"], see.out["reason"], see.out["side"] = state, reason, 0


@jit_inner
def _give_way(
    see: View, memory: Row, params: Params, here: Spot, wanted: tuple[float, float]
) -> tuple[float, float, bool]:
    """Return the heading and speed of a robot that waits while somebody comes through a narrow place ahead, or those
    that are ``wanted``; and whether it waits.

    It waits where it can get out of the others' way only, and `GIVE_AGAIN` times ``give_s`` later it may do so again:
    nobody waits for ever.
    """
    now = see.percept["now_s"]
    waited = now - memory["gives_s"]
    size = see.rig.body.radius_m / giving_way.OF_M
    if params.give_s <= 0.0 or not _is_somebody_at(see, 0.0, 0.0, COMPANY_M * size):
        return wanted[0], wanted[1], False
    begins = waited > GIVE_AGAIN * params.give_s or now - memory["gave_s"] > GAVE_S
    if begins:
        memory["gives_s"], memory["gave_s"], waited = now, NEVER_S, 0.0
    if waited > params.give_s:
        memory["gave_s"] = now
        return wanted[0], wanted[1], False
    place = giving_way.narrow_ahead(memory, here, params.cell_m, size)
    if place.far_m < AT_IT_M * size or not giving_way.comes_through(see, place, params.still_s):
        return wanted[0], wanted[1], False
    side = giving_way.SIDE_M * size / params.cell_m
    if begins and not giving_way.has_room_aside(memory, here, place, side):
        return wanted[0], wanted[1], False
    memory["gave_s"] = memory["held_s"] = now
    x, y = giving_way.where_to_wait(place, size)
    far = math.sqrt(x * x + y * y)
    bearing = wrap_angle(math.atan2(y, x) - see.percept["compass"])
    free = corridor_length(see.masked, see.rig, bearing, see.rig.body.radius_m + params.room_m, min(far, 0.5))
    if far <= 0.0 or free < min(far, 0.3):
        return wanted[0], 0.0, True
    return bearing, min(wanted[1], far), True


class Gap(NamedTuple):
    """What lies towards the next corner."""

    bearing: float
    free_m: float
    """As far as the body gets."""
    is_blocked: bool


@jit_inner
def _is_somebody_at(see: View, x: float, y: float, within: float) -> bool:
    """Tell whether a neighbour is ``within`` [m] of a place, compass frame from the robot."""
    shared = see.shared
    for t in range(PEERS):
        dx, dy = shared["track_x"][t] - x, shared["track_y"][t] - y
        if shared["track_id"][t] >= 0 and dx * dx + dy * dy < within * within:
            return True
    return False


@jit_inner
def _watch_gap(see: View, memory: Row, params: Params, gap: Gap) -> None:
    """Notice a gap that the way leads through and the body does not take; keep it closed for a while."""
    dt = see.percept["dt_s"]
    if not (gap.is_blocked and gap.free_m < CLOSE_M):
        memory["beside_s"] = max(0.0, memory["beside_s"] - dt)
        return
    toward, far = see.percept["compass"] + gap.bearing, gap.free_m + see.rig.body.radius_m
    x, y = far * math.cos(toward), far * math.sin(toward)
    if _is_somebody_at(see, x, y, AT_GAP * see.rig.body.radius_m):
        return
    memory["beside_s"] += dt
    if memory["beside_s"] < params.narrow_s:
        return
    memory["beside_s"] = 0.0
    place = Spot((see.shared["x"] + x) / params.cell_m, (see.shared["y"] + y) / params.cell_m)
    find_narrow(memory, place, GAP_M / params.cell_m, see.percept["now_s"], params.keep_s)


@jit_inline
def _manner(params: Params) -> Evading:
    """Return how others that move are got past."""
    return Evading(
        params.evade_s, params.apart_m, params.evade, params.slow, params.right, params.lane_s, params.lane_m
    )  # fmt: skip
