"""DH-Bug (GIWT 4.2): straight to the goal, along what is in the way, and one choice of side at every key point.

The distance histogram is the scan cut at l_th; a direction is safe when what the body sweeps is free up to l_th, as
GIWT's safe zone (1) has it: gaps that the body fits through are taken. There is no look-ahead, and nothing is said to
anybody. ``sector`` 1 asks for the lab's sector (60 degrees wide) to be free, too.

A      turns to the goal, or to the edge beside it; B drives there
key    no safe direction within ``key_deg`` of the goal: ``choose_turn`` gives a side; that is all an optimiser replaces
C, D   turn left, right, on the spot until the first safe direction on that side is in front
E, F   drive along it, the obstacle on the right (after C) or on the left (after D), until the leave condition holds
waits  a neighbour that goes first comes near (4.2.3); never longer than ``wait_s``

Where the published rules leave a robot standing or turning for nothing, another reading is taken:

- Directions count from the goal and all beams are used, not those within 90 degrees of the robot's nose, so that nobody
  turns to look. Turning and driving overlap (``unicycle.steer``) instead of standing until the error is 10 degrees.
- In mode B the edge beside the goal is kept on its side while it stays within ``key_deg``: no swinging to and fro.
- E, F take the first safe direction from the wall, not a mean of both edges of the gap, which drifts off the obstacle.
- The leave condition compares with the key point's distance during the whole following: goal nearer than there, and
  5 to 170 degrees on the free side of the direction followed.
- Loop breakers: back at a logged pose, or 390 degrees of turning on the spot. The robot faces the goal anew, chooses
  its next side by a toss, because the same choice has just led in a circle, and needs no sector until a following ends
  properly.
- (2) counts returns within alpha/2 of the heading, like the lab's code: with all of them it is 0 beside every wall. It
  never goes below ``creep``; what is safe is the guard's decision.
- Moving robots are left to 4.2.3 and the guard; one that stands for ``still_s`` is an obstacle.
- Arrival is at ``arrive_m`` like that of the other planners, so that lengths compare (the lab's code: 0.7 m). Hence the
  last l_th of a way are driven as soon as the body fits, whatever stands beside the goal.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

from swarmscope._jit import jit_inline
from swarmscope.bounds import Bounds, Degrees, Flag, Metres, Seconds, Seed, Speed
from swarmscope.onboard.deciding import bug
from swarmscope.onboard.deciding.bug import KEY_POINT, MEMORY, driving_of, new_memory, toss
from swarmscope.onboard.deciding.following import turn_to_safe
from swarmscope.onboard.deciding.printed import printed_bug
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.safety import safe_directions
from swarmscope.onboard.rig import FITS, NARROW, PRINTED
from swarmscope.onboard.view import View

__all__ = ["MEMORY", "NAME", "NEEDS", "PRESETS", "SUMMARY", "Params", "decide", "new_memory"]

NAME = "dh-bug"
SUMMARY = "DH-Bug: straight to the goal or along what is in the way, modes A to F; one side at every key point"
NEEDS = "own scan, goal bearing and distance, relative poses of visible neighbours"
TURN_LEFT, TURN_RIGHT, TURN_RANDOM, TURN_NEAREST = range(4)
PRESETS = {"printed": printed_bug() | {"planner.params.turn": TURN_RANDOM}}


class Params(NamedTuple):
    """What can be set. Distances in m, times in s, angles in degrees."""

    turn: Annotated[int, Bounds(0, 3)] = 3
    """Side at a key point: 0 left, 1 right, 2 random, 3 the smaller turn."""
    seed: Seed = 0
    """Of sides that are tossed for, together with the run's seed, the robot's address and the number of its choices."""
    told: Flag = 0
    """1: an oracle's side is taken where one is given."""
    sector: Flag = 0
    """1: a direction needs a free sector, not only room for the body."""
    long_gaps: Flag = 0
    """1: where no sector is asked for, room for the body is needed for ``safety.narrow_m`` (1.2 m) instead of l_th."""
    key_deg: Degrees = 60.0
    """pi/2 - theta_1: with no safe direction this close to the goal's there is a key point."""
    face_deg: Degrees = 10.0
    """theta_0: with less than this to turn, mode A becomes B."""
    turn_back_deg: Degrees = 105.0
    """A following looks this far back towards the obstacle from its last direction, or from where the robot faces."""
    arrive_m: Metres = 0.05
    """Distance to the goal at which a robot has arrived."""
    creep: Speed = 0.1
    """Speed [m/s] below which (2) does not slow down."""
    still_s: Seconds = 0.6
    """A neighbour that has not moved for so long is an obstacle."""
    wait_m: Metres = 0.9
    """Safety distance of 4.2.3; 0 = never waits."""
    wait_s: Seconds = 2.0
    """Longest wait; after it nobody is waited for during the same time."""
    in_place: Flag = 0
    """1: in modes A, C and D a robot stands while it turns, as printed; 0: turning and driving overlap."""
    nearer: Flag = 1
    """A following ends only nearer to the goal than it began; 0: where the goal is on the free side, as printed."""
    loops: Flag = 1
    """Loops are noticed and broken; 0: not, as printed."""


@jit_inline
def decide(see: View, memory: Row, params: Params) -> None:
    """Drive on, or choose a side and follow; wait for who goes first."""
    rule = NARROW if params.long_gaps else FITS
    if params.sector and not memory["looped"]:
        rule = PRINTED
    safe_directions(see.masked, see.rig.sensor, see.reach[rule], see.edges, see.safe)
    driving = driving_of(params)
    if not bug.advance(see, memory, driving):
        if memory["mode"] == KEY_POINT:
            bug.turn(see, memory, choose_turn(see, memory, params), params.seed)
        bug.follow(see, memory, driving)
    bug.avoid(see, memory, driving)


@jit_inline
def choose_turn(see: View, memory: Row, params: Params) -> int:
    """Return the side to turn to at a key point, +1 left, -1 right. A planner with an optimiser has its own."""
    side = 0
    see.out["p_left"] = 0.5
    if params.told and memory["told"] != 0:
        side = memory["told"]
    elif params.turn == TURN_LEFT:
        side = 1
    elif params.turn == TURN_RIGHT:
        side = -1
    elif params.turn == TURN_NEAREST:
        left, right = turn_to_safe(see, see.safe, 1), turn_to_safe(see, see.safe, -1)
        if abs(left - right) > 1e-6:
            side = 1 if left < right else -1
            see.out["p_left"] = 1.0 if side > 0 else 0.0
    if side == 0:
        side = toss(params.seed, see.percept["id"], memory["decisions"])
    return side
