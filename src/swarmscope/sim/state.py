"""The arrays of a running simulation: robots, radio queues, records, and the constants of its sensors and radio."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope.onboard.percept import PEERS
from swarmscope.onboard.rig import Rig
from swarmscope.onboard.sharing.message import MAX_PACKET_BYTES
from swarmscope.onboard.view import Swarm, new_swarm
from swarmscope.sim.beams import Beams
from swarmscope.sim.moving import STANDSTILL, Moving
from swarmscope.sim.streams import boot_number
from swarmscope.sim.world import World

QUEUE = 32
"""Packets on their way to one robot; one more is lost and counted."""

ROBOT = np.dtype(
    [
        ("x", np.float64),
        ("y", np.float64),
        ("yaw", np.float64),
        ("v", np.float64),
        ("last_x", np.float64),
        ("last_y", np.float64),
        ("last_yaw", np.float64),
        ("goal_x", np.float64),
        ("goal_y", np.float64),
        ("goal_yaw", np.float64),  # heading wanted there, NaN: any
        ("radius", np.float64),
        ("v_max", np.float64),
        ("a_max", np.float64),
        ("w_max", np.float64),
        ("boots", np.int64),  # starts after the first one
        ("down_until", np.int64),  # tick in which it runs again
        ("silences", np.int64),  # times that its radio fell silent
        ("mute_until", np.int64),  # tick in which its radio works again
        ("clock_jumps", np.int64),
        ("clock_s", np.float64),  # its own clock less the time of the run
        ("crashed", np.uint8),
        ("arrived", np.uint8),
        ("arrival_s", np.float64),
        ("touched", np.int64),  # times that a disc on its way walked into it while it stood
        ("in_touch", np.uint8),
        ("length", np.float64),
        ("waited_s", np.float64),
        ("clearance", np.float64),  # smallest in the last tick, to anything [m]
        ("min_clearance", np.float64),
        ("fusions", np.int64),
        ("sent", np.int64),  # packets
        ("sent_features", np.int64),
        ("bytes", np.int64),  # payload
        ("feature_bytes", np.int64),
        ("air_bytes", np.int64),  # payload and the link's own overhead
        ("lost", np.int64),  # by chance
        ("unreachable", np.int64),  # out of range
        ("crowded", np.int64),  # no bandwidth or no room in the queue
        ("radio_free_s", np.float64),  # when its radio is free again
        ("queued", np.int64),
    ]
)


BODY_FIELDS = {"radius": "radius_m", "v_max": "v_max_mps", "a_max": "a_max_mps2", "w_max": "w_max_radps"}
"""Fields of ``ROBOT`` that hold a robot's data sheet, and of ``Body``."""


CHOICE = np.dtype(
    [
        ("tick", np.int64),
        ("robot", np.int64),
        ("x", np.float64),  # where it was [m], world frame
        ("y", np.float64),
        ("target", np.float64),  # direction of its goal [rad], world frame
        ("p_self", np.float64),  # P_a (9)
        ("p_left", np.float64),  # P_dir (15)
        ("side", np.int8),  # +1 left, -1 right
        ("told_side", np.int8),  # of the shortest way, 0 when nobody looked
        ("heard", np.int64),  # neighbours that took part, and of each:
        ("heard_id", np.int64, PEERS),
        ("heard_side", np.int8, PEERS),  # +1 on the left of the target direction
        ("heard_p", np.float64, PEERS),  # P_ni (14)
        ("heard_f", np.float64, PEERS),  # f_ai (12)
    ]
)
"""One choice of a side."""


class Noise(NamedTuple):
    """Sensor errors, standard deviations where nothing else is said; 0 is none."""

    range_fraction: float = 0.0
    """Of a LiDAR range and of the distance to a neighbour, as a fraction of it."""
    dropout: float = 0.0
    """Share of LiDAR returns lost."""
    bearing_rad: float = 0.0
    """Of the bearing of a neighbour."""
    compass_rad: float = 0.0
    compass_bias_rad: float = 0.0
    """The same for a whole run, as all that follows but for the drift."""
    odometry_scale: float = 0.0
    """Of the wheels' size: of the speed and of all motion that a robot measures, as a fraction of it."""
    odometry_drift_m: float = 0.0
    """Of the place by odometry after 1 m, in both directions; it grows with the root of the way [m/sqrt(m)]."""
    odometry_turn_rad: float = 0.0
    """Of the heading by odometry, in the same way [rad/sqrt(m)]."""
    nan: float = 0.0
    """Share of LiDAR readings that are broken (NaN), drawn anew for every scan."""
    stuck: float = 0.0
    """Share of beams that say the longest range, whatever is there."""
    blind_rad: float = 0.0
    """Width of a sector without returns."""
    scan_age_s: float = 0.0
    """Age of the oldest scan when it is decided on; each has one of its own below this."""


class Radio(NamedTuple):
    """The link. Each packet occupies sender and receiver for its time on the air."""

    range_m: float = 15.0
    latency_s: float = 0.005
    loss: float = 0.0
    bitrate_bps: float = 78125.0
    overhead_bytes: int = 23
    """Preamble, header and checksum of the link layer per packet (IEEE 802.15.4: 6 + 15 + 2)."""
    max_wait_s: float = 0.5
    """A packet that would wait longer for the channel is dropped."""


class Faults(NamedTuple):
    """What fails in the middle of a run, at random times; a rate of 0 is never. Rates are for each robot."""

    restarts_per_h: float = 0.0
    restart_s: float = 5.0
    """How long a robot that restarts is switched off."""
    silences_per_h: float = 0.0
    silence_s: float = 10.0
    """How long a radio that falls silent neither sends nor hears."""
    clock_jumps_per_h: float = 0.0
    clock_jump_s: float = 5.0
    """How far a clock jumps, to and fro."""


class Conditions(NamedTuple):
    """What a run puts its robots through."""

    noise: Noise
    radio: Radio
    faults: Faults


class Clock(NamedTuple):
    """Time of the simulation."""

    seed: int
    dt: float
    substeps: int
    """Straight pieces of a robot's path within ``dt``; `new_sim` takes more where `ARC_M` asks for them."""


ARC_M = 1e-4
"""How far the path of a robot, in straight pieces, may lie beside the arc that it stands for [m]."""
MOST_SUBSTEPS = 1000


def enough_substeps(clock: Clock, v_max: float, w_max: float) -> int:
    """Return how many straight pieces make the path of a tick: those asked for, or as many as keep it within `ARC_M`.

    An arc driven at v and w for h seconds rises v w h^2 / 8 above its chord.
    """
    needed = math.ceil(clock.dt * math.sqrt(v_max * w_max / (8.0 * ARC_M)) - 1e-9)
    return max(clock.substeps, min(needed, MOST_SUBSTEPS))


class Records(NamedTuple):
    """What is kept of each tick, (ticks, robots)."""

    x: np.ndarray
    y: np.ndarray
    yaw: np.ndarray
    speed: np.ndarray
    clearance: np.ndarray
    p_left: np.ndarray
    state: np.ndarray
    reason: np.ndarray
    side: np.ndarray
    neighbours: np.ndarray
    bytes_sent: np.ndarray
    scan: np.ndarray
    safe: np.ndarray


class Sim(NamedTuple):
    """Everything the world's kernels work on."""

    world: World
    beams: Beams
    robots: np.ndarray
    percepts: np.ndarray
    decisions: np.ndarray
    ranges: np.ndarray
    """(N, F) float32: what the LiDARs measure [m]; the same memory as ``scans`` where they see the full circle."""
    scans: np.ndarray
    """(N, M) float32: what robots are given, the measured beams from ``first_beam`` on."""
    first_beam: int
    sight: np.ndarray
    """(N, 1) float32: scratch of one ray."""
    straight_cos: np.ndarray
    """(1,): the ray straight ahead."""
    straight_sin: np.ndarray
    told: np.ndarray
    """(N,) int8: side of each robot's shortest way, +1 left, -1 right; 0 = nobody looked, or there is none."""
    queue_due: np.ndarray
    queue_length: np.ndarray
    queue_from: np.ndarray
    queue_data: np.ndarray
    path: np.ndarray
    past: np.ndarray
    """(K, N, 3): x, y, yaw of all robots at the last K ticks, tick k in row k mod K; K is 0 where no scan is late."""
    steps: np.ndarray
    """(K, N, 3): motion up to these ticks by the robots' own wheels, in the frame of the tick before."""
    cell_of: np.ndarray
    cell_start: np.ndarray
    cell_items: np.ndarray
    cell_layout: np.ndarray
    links: np.ndarray
    links_n: np.ndarray
    choices: np.ndarray
    choices_n: np.ndarray
    moving: Moving
    widest: float
    """Largest radius of a robot [m]."""
    fastest: float
    """Highest top speed of a robot [m/s]."""
    range_min: float
    noise: Noise
    radio: Radio
    faults: Faults
    clock: Clock


CELL_M = 2.5
"""Side of the cells in which robots look for neighbours [m]."""
LINKS = 65536
"""Feature deliveries kept for the replay page."""
CHOICES = 16384
"""Choices of a side that are kept; later ones are counted only."""


class Start(NamedTuple):
    """Where robots start and want to go, world frame, within the bounds (x0, y0, x1, y1) of the world [m]."""

    starts: np.ndarray
    """(N, 3) x, y [m], yaw [rad]."""
    goals: np.ndarray
    """(N, 2), or (N, 3) with the heading that is wanted there [rad], NaN where any will do."""
    bounds: tuple[float, float, float, float]
    moving: Moving = STANDSTILL
    rigs: tuple[Rig, ...] = ()
    """One for each robot where they differ."""
    start_s: tuple[float, ...] = ()
    """When each is switched on; nothing: at once."""


def new_sim(
    world: World, beams: Beams, rig: Rig, start: Start, conditions: Conditions, clock: Clock
) -> tuple[Sim, Swarm]:
    """Return the simulation at its start, and the rows of its robots."""
    starts, goals, bounds = start.starts, start.goals, start.bounds
    noise, radio, faults = conditions
    n = len(starts)
    robots = np.zeros(n, ROBOT)
    for k, name in enumerate(("x", "y", "yaw")):
        robots[name] = starts[:, k]
        robots[f"last_{name}"] = starts[:, k]
    robots["goal_x"], robots["goal_y"] = goals[:, 0], goals[:, 1]
    robots["goal_yaw"] = goals[:, 2] if goals.shape[1] > 2 else np.nan
    bodies = [one.body for one in start.rigs or (rig,)]
    for name in ("radius", "v_max", "a_max", "w_max"):
        robots[name] = [getattr(body, BODY_FIELDS[name]) for body in bodies]
    robots["down_until"] = np.ceil(np.array(start.start_s or [0.0]) / clock.dt - 1e-9).astype(np.int64)
    robots["clock_s"] = -robots["down_until"] * clock.dt
    robots["arrival_s"] = np.nan
    robots["min_clearance"] = np.inf
    robots["clearance"] = np.inf
    swarm = new_swarm(n, max((rig, *start.rigs), key=lambda one: one.taps.size))
    swarm.percepts["dt_s"] = clock.dt
    fastest = max(body.v_max_mps for body in bodies)
    clock = clock._replace(substeps=enough_substeps(clock, fastest, max(body.w_max_radps for body in bodies)))
    with np.errstate(over="ignore"):  # without the compiler
        swarm.percepts["boot"] = [boot_number(clock.seed, i, 0) for i in range(n)]
    columns = max(1, int(np.ceil((bounds[2] - bounds[0]) / CELL_M)))
    rows = max(1, int(np.ceil((bounds[3] - bounds[1]) / CELL_M)))
    past = _new_past(np.asarray(starts, float), noise.scan_age_s / clock.dt)
    sim = Sim(
        world=world,
        beams=beams,
        robots=robots,
        percepts=swarm.percepts,
        decisions=swarm.decisions,
        ranges=swarm.scans if rig.sensor.field == 0 else np.zeros((n, rig.sensor.field), np.float32),
        scans=swarm.scans,
        first_beam=rig.sensor.first,
        sight=np.zeros((n, 1), np.float32),
        straight_cos=np.ones(1),
        straight_sin=np.zeros(1),
        told=np.zeros(n, np.int8),
        queue_due=np.zeros((n, QUEUE)),
        queue_length=np.zeros((n, QUEUE), np.int64),
        queue_from=np.zeros((n, QUEUE), np.int64),
        queue_data=np.zeros((n, QUEUE, MAX_PACKET_BYTES), np.uint8),
        path=np.zeros((n, clock.substeps + 1, 2)),
        past=past,
        steps=np.zeros_like(past),
        cell_of=np.zeros(n, np.int64),
        cell_start=np.zeros(columns * rows + 1, np.int64),
        cell_items=np.zeros(n, np.int64),
        cell_layout=np.array([bounds[0], bounds[1], float(columns), float(rows)]),
        links=np.zeros((LINKS, 4), np.int32),
        links_n=np.zeros(1, np.int64),
        choices=np.zeros(CHOICES, CHOICE),
        choices_n=np.zeros(1, np.int64),
        moving=start.moving._replace(closed=start.moving.closed.copy()),
        widest=float(robots["radius"].max()),
        fastest=float(fastest),
        range_min=float(rig.sensor.range_min),
        noise=Noise(*(float(v) for v in noise)),
        radio=radio,
        faults=Faults(*(float(v) for v in faults)),
        clock=clock,
    )
    return sim, swarm


def _new_past(starts: np.ndarray, ticks: float) -> np.ndarray:
    """Return room for where robots were up to ``ticks`` ago; before the first one they stood."""
    slots = math.ceil(ticks) + 2 if ticks > 0.0 else 0
    return np.array(np.broadcast_to(starts, (slots, *starts.shape)), order="C")


def new_records(ticks: int, robots: int, beams: int) -> Records:
    """Return room for ``ticks`` ticks; ``beams == 0`` keeps no scans."""
    shape = (ticks, robots)
    scans = ticks if beams else 0
    return Records(
        x=np.zeros(shape),
        y=np.zeros(shape),
        yaw=np.zeros(shape),
        speed=np.zeros(shape, np.float32),
        clearance=np.zeros(shape, np.float32),
        p_left=np.zeros(shape, np.float32),
        state=np.zeros(shape, np.uint8),
        reason=np.zeros(shape, np.uint8),
        side=np.zeros(shape, np.int8),
        neighbours=np.zeros(shape, np.uint8),
        bytes_sent=np.zeros(shape, np.int32),
        scan=np.zeros((scans, robots, beams), np.uint8),
        safe=np.zeros((scans, robots, (beams + 7) // 8), np.uint8),
    )
