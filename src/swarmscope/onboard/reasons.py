"""The states that planners share, and the words in which a robot says why it does what it does.

A planner's own reasons (its file's ``REASONS``) come after the shared ones: the first has the code ``FIRST_OWN``.
"""

from __future__ import annotations

STATE_NAMES = ("advance", "decide", "follow", "yield", "arrived", "escape", "crashed")
ADVANCE, DECIDE, FOLLOW, YIELD, ARRIVED, ESCAPE, CRASHED = range(7)

REASON_NAMES = (
    "target direction is safe",
    "final approach: the way to the goal is free",
    "waits for the answers of neighbours",
    "obstacle ahead: chose a side with the neighbours' features",
    "obstacle ahead: chose a side alone",
    "follows the obstacle on the chosen side",
    "dead end: no safe direction, uses the narrower gaps that its body fits through",
    "loop noticed: follows the border until closer to the goal than ever",
    "no way out in sight: moves away from the nearest obstacle",
    "waits for a neighbour to pass",
    "stands still: no direction is free",
    "arrived at the goal",
    "collided",
    "guard: stands, something is in the way",
    "guard: stands, another robot is in the way",
    "guard: stands, somebody may come round a corner",
    "guard: stands, looks at what it has not seen beside its way",
    "guard: stands, looks at what a hole of its scan may hide",
    "guard: stands, the LiDAR loses too much of what is there",
    "guard: stands, a number is missing: time, speed, compass or command",
    "guard: stands, somebody who does not yield may come",
    "turns to the heading that is wanted at the goal",
)
(
    R_FREE,
    R_FINAL,
    R_ANSWERS,
    R_FUSED,
    R_ALONE,
    R_FOLLOW,
    R_DEAD_END,
    R_LOOP,
    R_LOST,
    R_YIELD,
    R_BLOCKED_WAIT,
    R_ARRIVED,
    R_COLLIDED,
    R_HELD_THING,
    R_HELD_ROBOT,
    R_HELD_CORNER,
    R_HELD_UNSEEN,
    R_HELD_HOLE,
    R_HELD_BLIND,
    R_HELD_NO_NUMBER,
    R_HELD_STRANGER,
    R_TURNS,
) = range(22)
FIRST_OWN = len(REASON_NAMES)
