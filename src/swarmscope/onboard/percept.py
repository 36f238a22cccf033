"""What a robot can know, what it remembers and what it answers: the one table of fields, shapes, units, frames.

Every array has one row per robot; a kernel is given one row, so that it cannot read another robot's data
without the radio. *Body frame*: x forward, y left. *Compass frame*: x east, y north, as the robot's own
(possibly wrong) compass says. No field holds a global position.
"""

from __future__ import annotations

from typing import Any, NamedTuple, TypeAlias

import numpy as np

from swarmscope.onboard.body import Body, Protection, protection_model
from swarmscope.onboard.perception.filters import feature_filter, window_half
from swarmscope.onboard.perception.safety import reach_table
from swarmscope.onboard.sharing.message import MAX_FEATURES, MAX_PACKET_BYTES

Row: TypeAlias = Any
"""One robot's row of a structured array below (numpy.void in Python, a record in kernels)."""
MAX_NEIGHBOURS = 10
"""Neighbours that mutual positioning reports in one tick, nearest first."""
MAX_INBOX = 8
"""Packets handed over in one tick; more wait for the next."""
MAX_OUTBOX = 8
"""Packets a robot may send in one tick."""

PERCEPT = np.dtype(
    [
        ("now_s", np.float64),  # the robot's own clock [s]
        ("dt_s", np.float64),  # time until the next tick [s]
        ("goal_bearing", np.float64),  # of the goal, body frame [rad]
        ("goal_distance", np.float64),  # [m]
        ("speed", np.float64),  # forward, by wheel encoders [m/s]
        ("odom_x", np.float64),  # motion since the last tick, in the body frame of the last tick [m]
        ("odom_y", np.float64),
        ("odom_yaw", np.float64),  # [rad]
        ("compass", np.float64),  # own heading, compass frame [rad]
        ("id", np.int64),  # own radio address
        ("n_neighbours", np.int64),
        ("neighbour_id", np.int64, MAX_NEIGHBOURS),
        ("neighbour_x", np.float64, MAX_NEIGHBOURS),  # body frame [m]
        ("neighbour_y", np.float64, MAX_NEIGHBOURS),
        ("neighbour_yaw", np.float64, MAX_NEIGHBOURS),  # heading relative to ours [rad]
        ("n_packets", np.int64),
        ("packet_length", np.int64, MAX_INBOX),
        ("packet", np.uint8, (MAX_INBOX, MAX_PACKET_BYTES)),
        ("told_side", np.int8),  # side that the shortest way takes, +1 left, -1 right: oracles only, 0 on a robot
    ]
)
PEERS = 10
"""Neighbours that are remembered at once."""

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
        ("track_vx", np.float64, PEERS),
        ("track_vy", np.float64, PEERS),
        ("track_yaw", np.float64, PEERS),  # compass frame [rad]
        ("track_seen_s", np.float64, PEERS),  # when last observed
        ("track_anchor_x", np.float64, PEERS),  # where it was when it last moved, own odometry frame [m]
        ("track_anchor_y", np.float64, PEERS),
        ("track_moved_s", np.float64, PEERS),  # when it last moved
        # newest features heard of each peer, compass frame
        ("heard_id", np.int64, PEERS),  # -1 = free
        ("heard_s", np.float64, PEERS),  # when the request that it answers was sent
        ("heard_n", np.int64, PEERS),
        ("heard_angle", np.float32, (PEERS, MAX_FEATURES)),
        ("heard_distance", np.float32, (PEERS, MAX_FEATURES)),
        ("last_seq_id", np.int64, PEERS),  # newest sequence number accepted of each sender
        ("last_seq", np.int64, PEERS),
        # requests sent and requests to answer
        ("seq", np.int64),
        ("asked_seq", np.int64),  # sequence number of our last request round, -1 = none
        ("asked_s", np.float64),
        ("asked_n", np.int64),  # how many were asked in that round
        ("answers_n", np.int64),  # how many have answered
        ("ask_n", np.int64),
        ("ask_id", np.int64, PEERS),
        ("ask_seq", np.int64, PEERS),
        ("ask_direction", np.int16, PEERS),  # code of the direction that is asked about, -1 = none
        # this tick's packets with a network's features that answer our last round
        ("latent_n", np.uint8),
        ("latent_at", np.uint8, MAX_INBOX),  # index into ``packet``
        # counters
        ("dropped_bad", np.int64),  # torn, corrupt or foreign packets
        ("dropped_stale", np.int64),  # old, replayed or unasked-for packets
        ("started", np.uint8),
        ("compass", np.float64),  # of the last tick
        # own displacement since the start, by odometry and compass (drifts; never a global position)
        ("x", np.float64),
        ("y", np.float64),
    ]
)


class Sensor(NamedTuple):
    """The LiDAR and the positioning sensor as the robot knows them. Beam n: ``angle_min + n * increment`` [rad]."""

    beams: int
    angle_min: float
    increment: float
    wraps: bool
    """Whether the last beam is the first one's neighbour (full circle)."""
    range_min: float
    range_max: float
    range_sigma: float
    """Standard deviation of a LiDAR range as a fraction of it."""
    position_sigma: float
    """Standard deviation of a neighbour's measured position as a fraction of its distance."""


class Rig(NamedTuple):
    """Everything constant that a robot's kernels need: body, protection model, sensor, tables."""

    body: Body
    protection: Protection
    sensor: Sensor
    half: int
    """alpha/2 in beams."""
    footprint: float
    """Radius that is swept: the body's plus a clearance [m]."""
    clearance: float
    """Kept free around the body by the guard [m]."""
    latency: float
    """Age of a scan when its command takes effect [s]."""
    persistence: float
    """How long an unseen neighbour is remembered [s]."""
    max_feature_age: float
    """Features older than this are not used [s]."""
    exact_features: bool
    """Send float32 features instead of quantised ones (to measure what quantisation costs)."""
    look_ahead: float
    """Directions are free of obstacles up to here [m]."""
    reach: np.ndarray
    """(4, BINS + 2) int16: what a return blocks, for the safe directions, the narrow gaps, the escape, and by the
    printed rule (3), which masks the features."""
    cos: np.ndarray
    sin: np.ndarray
    taps: np.ndarray


class Scratch(NamedTuple):
    """Working arrays, one row per robot."""

    work: np.ndarray
    """(N, M) float32: the scan without moving neighbours."""
    filtered: np.ndarray
    """(N, M) float32: the filtered scan."""
    padded: np.ndarray
    """(N, M + 2 half) float32."""
    edges: np.ndarray
    """(N, M + 1) int16."""
    safe: np.ndarray
    """(N, M) uint8."""
    narrow: np.ndarray
    """(N, M) uint8."""
    angles: np.ndarray
    """(N, 2, MAX_FEATURES) float64."""
    distances: np.ndarray
    """(N, 2, MAX_FEATURES) float64."""
    header: np.ndarray
    """(N, 5) int64."""


def make_rig(
    body: Body,
    sensor: Sensor,
    *,
    footprint_clearance: float = 0.03,
    clearance: float = 0.02,
    latency: float = 0.0,
    persistence: float = 2.0,
    max_feature_age: float = 1.5,
    exact_features: bool = False,
    sector: bool = False,
    look_ahead: float = 2.0,
    margin: float = 0.04,
    narrow: float = 1.2,
) -> Rig:
    """Return the constants of a robot with ``body`` and ``sensor``; raises ConfigError for an impossible body.

    ``sector`` uses the printed rule (3) within l_th; ``look_ahead`` [m] is how far ahead directions must keep
    ``margin`` [m] from everything, ``narrow`` [m] how far ahead a gap must be free that the body just fits.
    """
    protection = protection_model(body)
    half = window_half(protection.alpha, sensor.increment)
    angles = sensor.angle_min + sensor.increment * np.arange(sensor.beams)
    footprint = body.radius_m + footprint_clearance
    half_alpha = 0.5 * protection.alpha if sector else 0.0
    rules = (
        (protection.l_th, half_alpha, look_ahead, body.radius_m + margin),
        (narrow or protection.r, 0.0, 0.0, 0.0),
        (protection.r, 0.0, 0.0, 0.0),
        (protection.l_th, 0.5 * protection.alpha, 0.0, 0.0),
        (protection.l_th, 0.0, 0.0, 0.0),
    )
    reach = np.stack([reach_table(sensor.increment, sensor.range_max, footprint, *rule) for rule in rules])
    return Rig(
        look_ahead=look_ahead,
        reach=reach,
        body=Body(*(float(v) for v in body)),
        protection=protection,
        sensor=sensor,
        half=half,
        footprint=footprint,
        clearance=clearance,
        latency=latency,
        persistence=persistence,
        max_feature_age=max_feature_age,
        exact_features=exact_features,
        cos=np.cos(angles),
        sin=np.sin(angles),
        taps=feature_filter(half),
    )


def new_scratch(robots: int, rig: Rig) -> Scratch:
    """Return the working arrays of ``robots`` robots."""
    beams = rig.sensor.beams
    return Scratch(
        work=np.zeros((robots, beams), np.float32),
        filtered=np.zeros((robots, beams), np.float32),
        padded=np.zeros((robots, beams + 2 * rig.half), np.float32),
        edges=np.zeros((robots, beams + 1), np.int16),
        safe=np.zeros((robots, beams), np.uint8),
        narrow=np.zeros((robots, beams), np.uint8),
        angles=np.zeros((robots, 2, MAX_FEATURES)),
        distances=np.zeros((robots, 2, MAX_FEATURES)),
        header=np.zeros((robots, 5), np.int64),
    )


def new_shared(robots: int) -> np.ndarray:
    """Return the empty shared memory of ``robots`` robots."""
    shared = np.zeros(robots, SHARED)
    for name in ("track_id", "heard_id", "last_seq_id", "asked_seq"):
        shared[name] = -1
    shared["asked_s"] = -1e9
    return shared
