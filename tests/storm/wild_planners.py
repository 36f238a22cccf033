"""Planners with a bug, as files of a user: no planner can leave the guard out, but one can put its eyes out."""

from __future__ import annotations

BLIND = '''
"""Drives straight on and wipes out what the guard looks at."""

import math

from swarmscope.kit import ADVANCE, R_FREE, head_for, jit

NAME = "blind"
SUMMARY = "drives straight at its goal and sees nothing"
NEEDS = "nothing"


@jit
def decide(see, memory, params):
    see.out["state"], see.out["reason"] = ADVANCE, R_FREE
    head_for(see, see.percept["goal_bearing"], see.rig.body.v_max_mps)
    for n in range(see.scan.size):
        see.scan[n] = math.inf
    for t in range(see.shared["track_id"].size):
        see.shared["track_id"][t] = -1
'''


def write_blind(folder):
    file = folder / "blind.py"
    file.write_text(BLIND)
    return file
