"""The frame in which robots tell each other places: one that all share who have met, or have met who met them.

Frames are those of odometry, turned as compasses say, so they differ by a shift. Each robot begins in its own, named
after itself and its boot number. Who sees the sender of a packet knows by what their frames differ, and takes over the
one with the lower name; so a swarm comes to share one, and who is behind a wall is understood, too. Frames drift: two
in sight that share one each move a little towards what the other says. Who has gone far without agreement with anybody
begins anew; not so the robot whose frame it is, for in that nothing else is lost.
"""

from __future__ import annotations

import math

from swarmscope._jit import jit, jit_inline, jit_inner
from swarmscope.onboard.mapping.words import Spot, number
from swarmscope.onboard.percept import Row
from swarmscope.onboard.sharing.way_message import FRAMES, Place, unwrapped
from swarmscope.onboard.view import View

FAR_OFF_M = 1.5
"""Who is so far from where it says it is, in a frame that both share, is not believed: it lies, or was very late."""
USUAL = 8
"""A shift is the mean of about so many: a packet may be older than it looks, and its sender a little elsewhere."""


@jit_inline
def frame_name(address: int, boot: int) -> int:
    """Return the name of a robot's own frame; not 0. Addresses below 255 with any boot numbers have names of their own.

    Where two have one, they come to agree like others (`agree`).
    """
    return max(1, ((boot << 8) ^ (address + 1)) & (FRAMES - 1))


@jit
def keep_frame(see: View, memory: Row, within: float) -> None:
    """Begin in the own frame, and anew when the robot has gone farther than ``within`` [cells] without agreement."""
    own = frame_name(see.percept["id"], see.percept["boot"])
    lost = memory["gone"] - memory["frame_gone"] > within and number(memory["frame"]) != own
    if memory["frame"] == 0 or lost:
        _take_over(memory, own, 0.0, 0.0)
        memory["frame_n"] = 0


@jit_inner
def _take_over(memory: Row, name: int, x: float, y: float) -> None:
    """Let the frame be the one of this name, in which the origin of the own one is at (x, y) [m]."""
    memory["frame"], memory["frame_n"] = name, 1
    memory["frame_x"], memory["frame_y"] = unwrapped(x), unwrapped(y)
    memory["frame_gone"] = memory["gone"]


@jit_inline
def own_place(see: View, memory: Row) -> Place:
    """Return where the robot is in the shared frame."""
    x, y = see.shared["x"] + memory["frame_x"], see.shared["y"] + memory["frame_y"]
    return Place(x, y, number(memory["frame"]))


@jit
def agree(memory: Row, theirs: Place, x: float, y: float) -> bool:
    """Note where a robot says it is that is seen at (x, y) [m] of the own frame; return whether that may be so.

    Who says again and again that it is elsewhere is right in the end: otherwise two that have slipped apart would never
    understand each other again.
    """
    name = number(memory["frame"])
    if not abs(x) + abs(y) < math.inf:
        return False
    if theirs.frame < name:
        _take_over(memory, theirs.frame, theirs.x - x, theirs.y - y)
    elif theirs.frame == name:
        off_x, off_y = unwrapped(theirs.x - x - memory["frame_x"]), unwrapped(theirs.y - y - memory["frame_y"])
        if not off_x * off_x + off_y * off_y <= FAR_OFF_M * FAR_OFF_M:
            memory["frame_n"] //= 2
            if memory["frame_n"] == 0:
                _take_over(memory, name, theirs.x - x, theirs.y - y)
            return False
        n = min(USUAL, memory["frame_n"] + 1)
        memory["frame_n"], memory["frame_gone"] = n, memory["gone"]
        memory["frame_x"] += off_x / n
        memory["frame_y"] += off_y / n
    return True


@jit_inline
def is_shared(memory: Row, theirs: Place) -> bool:
    """Tell whether a place is in the frame that the robot shares."""
    return bool(theirs.frame == number(memory["frame"]))


@jit_inline
def spot_of(see: View, memory: Row, theirs: Place, cell_m: float) -> Spot:
    """Return where a place of the shared frame is in the own one [cells]."""
    x = unwrapped(theirs.x - memory["frame_x"] - see.shared["x"])
    y = unwrapped(theirs.y - memory["frame_y"] - see.shared["y"])
    return Spot((see.shared["x"] + x) / cell_m, (see.shared["y"] + y) / cell_m)
