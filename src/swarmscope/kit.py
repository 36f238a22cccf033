"""What planners and tasks from outside use, in one place: ``from swarmscope.kit import View, halt, head_for, jit``.

Each name is explained where it stands; docs/extending.md shows a planner and a task that need no more than these.
"""

from __future__ import annotations

from swarmscope._jit import jit
from swarmscope.bounds import Bounds, Degrees, Flag, Metres, Radians, Seconds, Share, Speed, Weight
from swarmscope.onboard.control.wanting import halt, head_for
from swarmscope.onboard.deciding.following import away_from_nearest, first_safe, turn_to_safe
from swarmscope.onboard.deciding.progress import goal_is_free, is_final, last_speed
from swarmscope.onboard.deciding.waiting import crossed, repelled
from swarmscope.onboard.percept import Row
from swarmscope.onboard.perception.corridor import corridor_length
from swarmscope.onboard.perception.safety import beam_of, safe_directions
from swarmscope.onboard.planners import Variant
from swarmscope.onboard.reasons import (
    ADVANCE,
    ARRIVED,
    DECIDE,
    ESCAPE,
    FIRST_OWN,
    FOLLOW,
    R_ARRIVED,
    R_BLOCKED_WAIT,
    R_FINAL,
    R_FOLLOW,
    R_FREE,
    R_LOST,
    R_YIELD,
    YIELD,
)
from swarmscope.onboard.tick import share
from swarmscope.onboard.view import View

__all__ = [
    "ADVANCE", "ARRIVED", "DECIDE", "ESCAPE", "FIRST_OWN", "FOLLOW", "R_ARRIVED", "R_BLOCKED_WAIT", "R_FINAL",
    "R_FOLLOW", "R_FREE", "R_LOST", "R_YIELD", "YIELD", "Bounds", "Degrees", "Flag", "Metres", "Radians", "Row",
    "Seconds", "Share", "Speed", "Variant", "View", "Weight", "away_from_nearest", "beam_of", "corridor_length",
    "crossed", "first_safe", "goal_is_free", "halt", "head_for", "is_final", "jit", "last_speed", "repelled",
    "safe_directions", "share", "turn_to_safe",
]  # fmt: skip
