"""What a robot that remembers keeps: its map, the way that it goes, and the scratch of its searches."""

from __future__ import annotations

import numpy as np

from swarmscope.onboard.mapping.cells import DISC_ROWS, DISCS, QUARTERS, ROOMS, WIDE, WIDE_WORDS
from swarmscope.onboard.mapping.heard import ANSWERS, HEARD, WRONGED
from swarmscope.onboard.mapping.met import MET
from swarmscope.onboard.mapping.pages import DIRECTORY, PAGES, SLIM_PAGES
from swarmscope.onboard.mapping.words import WORD
from swarmscope.onboard.percept import NEVER_S, PEERS, Row
from swarmscope.onboard.sharing.message import MAX_CORNERS

NEAR = 64
"""Cells on a side of the square round the robot in which it is known how sure each cell is."""
GONE = 32
"""Cells that are known to have been cleared."""
KEPT = 8
"""Places that are kept closed at once."""
LOST = 12
"""Places of robots that stood when last seen, and of gaps that were too narrow, the newest over the oldest."""
CORNERS = 64
"""Of a way, the goal included."""
TALK = 112
"""Places and cells of a packet about a way."""
SENT = 4096
"""Nodes of which a robot knows that it has told, where all maps are told, ..."""
WAYS = 8
"""... so many at one place of the table."""
SCRATCH = 12288 + 128
"""Words for searches; places up to 64 m x 64 m take the first 3072."""

MAP = np.dtype(
    [
        ("fine", np.uint64, (WIDE, WIDE_WORDS)),
        ("west", np.int64),  # the fine layer's first cells
        ("south", np.int64),
        ("settled", np.uint8),
        ("page_at", np.uint8, (DIRECTORY, DIRECTORY)),  # 1 + its slot, 0 = there is none
        ("page_x", np.int16, PAGES),
        ("page_y", np.int16, PAGES),
        ("pages_n", np.int64),
        ("rows", np.uint64, (PAGES, WORD)),
        ("slim_at", np.uint8, PAGES),  # 1 + where what follows has a page's nodes, 0 = none of them are
        ("slim", np.uint64, (SLIM_PAGES, WORD)),  # nodes that are blocked, but less room would do
        ("slims_n", np.int64),
        ("forget_n", np.int16),  # nodes beyond which they are forgotten, 0 = none is
        ("room", np.uint8),  # how much room is asked for now
        ("phase", np.int64),  # how the fine layer's nodes are moved now
        ("disc", np.uint32, (DISCS, QUARTERS, QUARTERS, DISC_ROWS)),  # what must be free round a robot
        ("disc_of", np.uint8),  # for how much room the second one is
        ("disc_half", np.int64),  # rows that it has on either side of its middle, 0 = not yet drawn
        ("disc_r", np.float64, ROOMS),  # its radius [cells]
        # how sure: 0 to 15, and in the upper four bits how often the cell has come back
        ("evidence", np.uint8, (NEAR, NEAR)),
        # cells that have been cleared, the newest over the oldest: where, how often, when last
        ("gone_x", np.int32, GONE),
        ("gone_y", np.int32, GONE),
        ("gone_n", np.uint8, GONE),
        ("gone_s", np.float32, GONE),
        ("gone_at", np.int64),
        ("near_x", np.int64),  # the robot's cell when the square was last moved
        ("near_y", np.int64),
        ("ticks", np.int32),
        # robots that stand for long: not in the map, but in the way
        ("stand_n", np.int64),
        ("stand_u", np.float32, PEERS),  # [cells]
        ("stand_v", np.float32, PEERS),
        ("stand_r", np.float32, PEERS),  # how far the robot's middle keeps away [cells]
        # places kept closed: gaps that turned out too narrow, and where somebody stood
        ("kept_n", np.int64),
        ("kept_u", np.float32, KEPT),  # [cells]
        ("kept_v", np.float32, KEPT),
        ("kept_r", np.float32, KEPT),  # how far the robot's middle keeps away [cells]
        ("kept_s", np.float64, KEPT),  # until when
        # robots that stood when they went out of sight, and gaps that turned out too narrow: where, and how often there
        ("lost_u", np.float32, LOST),  # [cells]
        ("lost_v", np.float32, LOST),
        ("lost_times", np.uint8, LOST),  # 0 = nobody
        ("lost_at", np.uint8),
        ("beside_s", np.float64),  # how long something has been between the robot and its next corner
        # the way: corners still ahead, the goal last [cells]
        ("way_u", np.float64, CORNERS),
        ("way_v", np.float64, CORNERS),
        ("way_n", np.int64),  # 0 = there is none
        ("way_room", np.uint8),  # how much room it leaves
        ("leg_u", np.float64),  # from where its first corner was last in sight [cells]
        ("leg_v", np.float64),
        ("old_u", np.float32, CORNERS),  # the way before the last search
        ("old_v", np.float32, CORNERS),
        ("other_u", np.float32, CORNERS),  # the way that another search has found
        ("other_v", np.float32, CORNERS),
        ("gone", np.float32),  # how far it has gone [cells]
        ("gone_u", np.float32),  # where it was when that was last counted [cells]
        ("gone_v", np.float32),
        ("straight", np.float32),  # from its first place to the goal [cells]
        ("closed", np.uint8),  # something has been seen in it
        ("opened", np.uint8),  # something is gone that was in the map
        ("searched_s", np.float64),
        ("searches", np.int32),
        ("floods", np.int32),
        ("failures", np.int32),
        ("scratch", np.uint64, SCRATCH),
        ("nodes_n", np.int64),  # of a search
        ("queue_n", np.int64),
        ("scratch_n", np.int64),  # words of it that have been used
        ("failed", np.uint8),  # the last search had to forget something
        ("arrived", np.uint8),
        # a robot that does not get away from where it is
        ("comes_s", np.float64),  # when somebody last came towards it
        ("gives_s", np.float32),  # since when it waits before a narrow place
        ("gave_s", np.float32),  # when it last did
        ("held_u", np.float32),
        ("held_v", np.float32),
        ("held_s", np.float64),
        ("leave_s", np.float64),  # until when it leaves along the longest corridor
        ("leave", np.float64),  # compass frame [rad]
        # what others have told: cells, answer after answer, the oldest first
        ("heard_n", np.int64),
        ("heard_u", np.int16, HEARD),  # [cells / GRAIN]
        ("heard_v", np.int16, HEARD),
        ("heard_free", np.uint8, HEARD),  # 1: has been seen to be free
        ("answers_n", np.int64),
        ("answer_n", np.int16, ANSWERS),  # cells of each
        ("answer_wrong", np.int16, ANSWERS),  # how many of them have been seen to be free
        ("answer_s", np.float64, ANSWERS),  # when it came
        ("answer_from", np.int32, ANSWERS),  # whose it is
        ("answer_box", np.float32, (ANSWERS, 4)),  # from u to u, from v to v
        ("wrong_id", np.int32, WRONGED),  # who told something wrong, the newest over the oldest
        ("wrong_s", np.float64, WRONGED),  # and when that was seen
        ("wrong_at", np.uint8),
        # the frame that is shared with others (``mapping/frames.py``)
        ("frame", np.uint32),  # its name, 0: not yet begun
        ("frame_n", np.uint8),  # how often somebody in sight has agreed
        ("frame_x", np.float64),  # where the origin of the own one is in it [m]
        ("frame_y", np.float64),
        ("frame_gone", np.float32),  # how far we had gone when somebody last agreed [cells]
        # who has been heard lately (``mapping/met.py``)
        ("met_id", np.int32, MET),
        ("met_s", np.float64, MET),  # when
        ("met_told_s", np.float64, MET),  # when it was last answered
        ("met_asked_s", np.float64, MET),  # when it was last asked in sight
        # the question that was last asked, and what may still be sent
        ("asked_n", np.int64),
        ("asked_u", np.float32, MAX_CORNERS),
        ("asked_v", np.float32, MAX_CORNERS),
        ("asked_s", np.float64),
        ("budget", np.float64),  # [B]
        ("asked", np.int32),  # questions, answers given, answers taken in, and those that closed the way
        ("told", np.int32),
        ("heard", np.int32),
        ("changed", np.int32),
        ("sent_s", np.float64),  # since when all maps are told anew
        ("sent", np.uint32, (SENT // WAYS, WAYS)),  # nodes of which it has told when all maps are told, by their places
        ("talk_at", np.float32, (TALK, 2)),  # scratch of packets
        ("talk_cell", np.int32, (TALK, 2)),
    ]
)


OF_SHARING = ("heard", "answer", "wrong", "frame", "met_", "asked", "budget", "told", "changed", "sent", "talk_")
"""What the fields begin with that are for asking others."""
NEVER = (
    *("wrong_s", "asked_s", "met_s", "met_told_s", "met_asked_s"),
    *("comes_s", "gives_s", "gave_s", "searched_s", "held_s", "leave_s"),
)
"""Times of what has not happened yet."""
PER_PAGE = ("rows", "page_x", "page_y")


def new_memory(robots: int) -> np.ndarray:
    """Return the memory of ``robots`` robots that have seen nothing yet."""
    memory = np.zeros(robots, MAP)
    memory["gone_s"] = NEVER_S
    for name in NEVER:
        memory[name] = NEVER_S
    return memory


def used_bytes(memory: Row) -> int:
    """Return how much of its memory a robot has used: pages, scratch and discs as far as they were wanted.

    What is for asking others counts with those that do.
    """
    sizes = {name: MAP[name].itemsize for name in MAP.names or ()}
    of_pages = sum(sizes[name] // PAGES for name in PER_PAGE)
    unused_rows = 1.0 - (2 * memory["disc_half"] + 1) / DISC_ROWS
    of_slims, of_scratch = sizes["slim"] // SLIM_PAGES, sizes["scratch"] // SCRATCH
    whole = sum(size for name, size in sizes.items() if name not in (*PER_PAGE, "slim", "scratch"))
    whole -= sizes["disc"] * unused_rows
    if memory["budget"] == 0.0:
        whole -= sum(sizes[name] for name in sizes if name.startswith(OF_SHARING))
    elif not memory["sent"].any():
        whole -= sizes["sent"]
    wanted = of_pages * memory["pages_n"] + of_slims * memory["slims_n"] + of_scratch * memory["scratch_n"]
    return int(whole + wanted)
