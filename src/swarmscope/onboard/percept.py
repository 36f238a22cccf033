"""What a robot can know, what it remembers and what it answers: the one table of fields, shapes, units, frames.

Every array has one row per robot; a kernel is given one row, so that it cannot read another robot's data
without the radio. *Body frame*: x forward, y left. *Compass frame*: x east, y north, as the robot's own
(possibly wrong) compass says. No field holds a global position.
"""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np

from swarmscope.onboard.sharing.message import MAX_FEATURES, MAX_PACKET_BYTES

Row: TypeAlias = Any
"""One robot's row of a structured array below (numpy.void in Python, a record in kernels)."""
MAX_NEIGHBOURS = 10
"""Neighbours that mutual positioning reports in one tick, nearest first."""
MAX_INBOX = 8
"""Packets handed over in one tick; more wait for the next."""
MAX_OUTBOX = 8
"""Packets a robot may send in one tick."""
EVERYBODY = -1
"""The address of a packet that is for all who hear it."""

NEVER_S = -1e9
"""Time of what has not happened [s]."""

PERCEPT = np.dtype(
    [
        ("now_s", np.float64),  # the robot's own clock, after ``perceive`` the time since its first tick [s]
        ("dt_s", np.float64),  # time until the next tick [s]
        ("goal_bearing", np.float64),  # of the goal, body frame [rad]
        ("goal_distance", np.float64),  # [m]
        ("goal_turn", np.float64),  # heading wanted at the goal, body frame [rad]; NaN: any
        ("speed", np.float64),  # forward, by wheel encoders [m/s]
        ("odom_x", np.float64),  # motion since the last tick, in the body frame of the last tick [m]
        ("odom_y", np.float64),
        ("odom_yaw", np.float64),  # [rad]
        ("scan_x", np.float64),  # where the body was when the scan was taken, by odometry, body frame of now [m]
        ("scan_y", np.float64),
        ("scan_yaw", np.float64),  # [rad]
        ("scan_hides", np.bool_),  # whether ``View.hidden`` has been written with the scan
        ("compass", np.float64),  # own heading, compass frame [rad]
        ("id", np.int64),  # own radio address
        ("boot", np.int64),  # drawn anew at every start, 0 to 65535
        ("n_neighbours", np.int64),
        ("neighbour_id", np.int64, MAX_NEIGHBOURS),
        ("neighbour_x", np.float64, MAX_NEIGHBOURS),  # body frame [m]
        ("neighbour_y", np.float64, MAX_NEIGHBOURS),
        ("neighbour_yaw", np.float64, MAX_NEIGHBOURS),  # heading relative to ours [rad]
        ("n_packets", np.int64),
        ("packet_length", np.int64, MAX_INBOX),
        ("packet", np.uint8, (MAX_INBOX, MAX_PACKET_BYTES)),
    ]
)
PEERS = 10
"""Neighbours that are remembered at once."""
SENDERS = 20
"""Senders whose sequence numbers are remembered at once."""

DECISION = np.dtype(
    [
        ("v", np.float64),  # forward speed wanted [m/s]
        ("w", np.float64),  # turn rate wanted [rad/s]
        ("state", np.uint8),  # index into STATE_NAMES
        ("reason", np.uint8),  # index into REASON_NAMES
        ("side", np.int8),  # side of the obstacle that is followed: +1 left, -1 right, 0 none
        ("fused", np.uint8),  # 1 in the tick in which a side was chosen
        ("heard", np.uint8),  # neighbours whose features entered that choice
        ("p_self", np.float64),  # P_a (9), NaN before the first choice
        ("p_left", np.float64),  # P_dir (15), NaN before the first choice
        ("heard_id", np.int64, PEERS),  # those neighbours, their P_ni (14) and f_ai (12)
        ("heard_p", np.float64, PEERS),
        ("heard_f", np.float64, PEERS),
        ("heard_side", np.int8, PEERS),  # +1 on the left of the target direction, -1 on the right
        ("heading", np.float64),  # direction wanted, body frame [rad]
        ("n_out", np.int64),
        ("out_to", np.int64, MAX_OUTBOX),
        ("out_length", np.int64, MAX_OUTBOX),
        ("out", np.uint8, (MAX_OUTBOX, MAX_PACKET_BYTES)),
    ]
)

SHARED = np.dtype(
    [
        # tracks of neighbours: position and velocity in the compass frame, relative to us [m, m/s]
        ("track_id", np.int64, PEERS),  # -1 = free
        ("track_x", np.float64, PEERS),
        ("track_y", np.float64, PEERS),
        ("track_was_x", np.float32, PEERS),  # where it was a tick ago, seen from here
        ("track_was_y", np.float32, PEERS),
        ("track_radius", np.float64, PEERS),  # of its body at most
        ("track_vx", np.float64, PEERS),
        ("track_vy", np.float64, PEERS),
        ("track_yaw", np.float64, PEERS),  # compass frame [rad]
        ("track_seen_s", np.float64, PEERS),  # when last observed
        ("track_n", np.uint8, PEERS),  # how often, one tick after the other, at most 255
        ("track_anchor_x", np.float64, PEERS),  # where it was when it last moved, own odometry frame [m]
        ("track_anchor_y", np.float64, PEERS),
        ("track_moved_s", np.float64, PEERS),  # when it last moved
        ("past_n", np.uint8),  # scans that tell what moves (``perception/standing.py``)
        ("past_at", np.uint8),  # the newest of them
        # newest features heard of each peer, compass frame
        ("heard_id", np.int64, PEERS),  # -1 = free
        ("heard_s", np.float64, PEERS),  # when the request that it answers was sent
        ("heard_n", np.int64, PEERS),
        ("heard_angle", np.float32, (PEERS, MAX_FEATURES)),
        ("heard_distance", np.float32, (PEERS, MAX_FEATURES)),
        # what has come in of each sender (``sharing/peers.py``): two windows, a packet on probation, answers it got
        ("sender_id", np.int32, SENDERS),  # -1 = free
        ("window_s", np.float64, (SENDERS, 2)),  # when last a packet came in it, -1e9 = there is none
        ("window_boot", np.int32, (SENDERS, 2)),  # -1 = there is none
        ("window_seq", np.int32, (SENDERS, 2)),  # its newest number
        ("window_seen", np.uint64, (SENDERS, 2)),
        ("window_n", np.int16, (SENDERS, 2)),  # packets that came in it
        ("trial_boot", np.int32, SENDERS),  # -1 = nothing is on probation
        ("trial_seq", np.int32, SENDERS),
        ("quota_n", np.int8, SENDERS),  # answers that it gets in this second
        ("quota_s", np.float64),  # when that began
        ("strangers_n", np.int64),  # the same for all together that are not in sight
        # requests sent and requests to answer
        ("seq", np.int64),
        ("asked_seq", np.int64),  # sequence number of our last request round, -1 = none
        ("asked_s", np.float64),
        ("asked_all", np.uint8),  # 1: everybody was
        ("asked_n", np.int64),  # how many were asked in that round
        ("asked_id", np.int64, MAX_OUTBOX),  # who, the first ``asked_n`` of these
        ("asked_done", np.uint8, MAX_OUTBOX),  # 1: has answered
        ("answers_n", np.int64),  # how many have answered
        ("ask_n", np.int64),
        ("ask_id", np.int64, PEERS),
        ("ask_name", np.int64, PEERS),  # what the answer calls the request (``message.name_of``)
        ("ask_direction", np.int16, PEERS),  # code of the direction that is asked about, -1 = none
        # this tick's packets with a network's features that answer our last round
        ("latent_n", np.uint8),
        ("latent_at", np.uint8, MAX_INBOX),  # index into ``packet``
        # this tick's packets about ways (``sharing/way_message.py``)
        ("told_n", np.uint8),
        ("told_at", np.uint8, MAX_INBOX),  # index into ``packet``
        ("late_s", np.float64),  # when last an answer came that was not waited for any more
        # counters
        ("dropped_bad", np.int64),  # torn, corrupt or foreign packets
        ("dropped_stale", np.int64),  # old, replayed or unasked-for packets
        ("started", np.uint8),  # ticks so far, as far as they are counted
        ("clock_s", np.float64),  # what the clock said at the last tick
        ("base_s", np.float64),  # its own time (``perception/clock.py``): so much, ...
        ("even_n", np.int64),  # ... and since then so many ticks on time, ...
        ("even_s", np.float64),  # ... each of so much
        ("compass", np.float64),  # of the last tick
        ("view_first", np.int64),  # beams of a limited field of view between which something is known
        ("view_last", np.int64),
        ("was_first", np.int64),  # those of the last tick
        ("was_last", np.int64),
        ("unseen_left", np.uint8),  # on which side of the way something has not been seen
        ("look_rad", np.float64),  # what is left of a look round [rad]
        ("looked_s", np.float64),  # when it last began to look where a hole of its scan is
        ("wary_s", np.float64),  # until then planners are shown as a thing what a hole may hide
        ("frames_n", np.int64),  # scans that it has kept
        ("frame_at", np.int64),  # the newest of them
        ("losses", np.float64),  # share of returns that get lost from scan to scan
        ("blind_s", np.float64),  # since when nothing is seen where something was [s]
        ("goal_x", np.float64),  # body frame of the last tick [m]
        ("goal_y", np.float64),
        # own displacement since the start, by odometry and compass (drifts; never a global position)
        ("x", np.float64),
        ("y", np.float64),
    ]
)


def new_shared(robots: int) -> np.ndarray:
    """Return the empty shared memory of ``robots`` robots."""
    shared = np.zeros(robots, SHARED)
    for name in ("track_id", "heard_id", "sender_id", "window_boot", "trial_boot", "asked_seq", "asked_id"):
        shared[name] = -1
    for name in ("asked_s", "late_s", "window_s", "quota_s", "looked_s", "wary_s"):
        shared[name] = NEVER_S
    return shared
