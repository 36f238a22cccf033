"""Which ranges a storm draws from: the one place where they stand.

Of what docs/safety.md says the guard cannot know, two keys stay out: ``noise.blind_deg`` (a blind sector of 60° touches
things in nearly every run) and ``noise.scan_age_s`` (turning between scan and decision is not covered).
"""

from __future__ import annotations

from typing import Final, NamedTuple


class Span(NamedTuple):
    """Numbers from ``low`` to ``high``."""

    low: float
    high: float
    log: bool = False
    """Each factor is as likely as the next, not each step."""
    inverse: bool = False
    """Each step of the reciprocal is as likely as the next."""


ROBOTS: Final = Span(1, 60, True)
SHEET: Final = {
    "robot.radius_m": Span(0.08, 0.5, True),
    "robot.v_max_mps": Span(0.2, 3.0, True),
    "robot.a_max_mps2": Span(0.25, 4.0, True),
    "robot.w_max_radps": Span(0.5, 6.0, True),
    "lidar.beams": Span(60, 1440, inverse=True),
    "lidar.range_m": Span(1.0, 20.0, True),
    "lidar.rate_hz": Span(1.0, 20.0, inverse=True),
}
"""Angles between beams and times between scans are drawn evenly: an hour of many beams at 20 Hz takes a hundred times
as long to compute as one of few at 1 Hz, and contacts are not a hundred times as frequent in it (docs/storms.md)."""
VIEW_DEG: Final = Span(60.0, 360.0)
"""Field of view of those that do not look all round."""
ALL_ROUND: Final = 0.6
"""Share of runs whose robots do."""
NO_CLEARANCE: Final = 0.3
"""Share of runs with ``guard.clearance_m`` 0; the others have the default."""

NOISE: Final = {
    "noise.range_fraction": Span(0.0, 0.05),
    "noise.dropout": Span(0.0, 0.05),
    "noise.bearing_deg": Span(0.0, 5.0),
    "noise.compass_deg": Span(0.0, 10.0),
    "noise.compass_bias_deg": Span(0.0, 10.0),
    "noise.odometry_scale": Span(0.0, 0.05),
    "noise.odometry_drift_m": Span(0.0, 0.03),
    "noise.odometry_turn_deg": Span(0.0, 5.0),
    "noise.nan": Span(0.0, 0.3),
    "noise.stuck": Span(0.0, 0.05),
}
RADIO: Final = {
    "radio.loss": Span(0.0, 0.9),
    "radio.latency_s": Span(0.0, 0.5),
    "radio.range_m": Span(0.5, 30.0, True),
    "radio.bitrate_bps": Span(500.0, 250_000.0, True),
}
FAULTS: Final = {
    "faults.restarts_per_h": Span(10.0, 720.0, True),
    "faults.restart_s": Span(0.2, 20.0, True),
    "faults.silences_per_h": Span(10.0, 720.0, True),
    "faults.silence_s": Span(0.2, 30.0, True),
    "faults.clock_jumps_per_h": Span(10.0, 720.0, True),
    "faults.clock_jump_s": Span(0.1, 60.0, True),
}
FAULT_PAIRS: Final = (
    ("faults.restarts_per_h", "faults.restart_s"),
    ("faults.silences_per_h", "faults.silence_s"),
    ("faults.clock_jumps_per_h", "faults.clock_jump_s"),
)
"""Rates and durations that are drawn together."""
CALM: Final = 0.3
"""Share of runs without any of a group: noise, trouble of the radio, faults, an adversary. Each group tosses alone."""
EACH: Final = 0.4
"""Share of the others in which a key of the group is drawn."""

FORGED_PER_TICK: Final = Span(0.05, 60.0, True)
"""Packets that an adversary throws at the swarm in a tick, on average."""

SIDE_M: Final = Span(5.0, 24.0)
"""Side of worlds that storms make themselves."""
OBSTACLE_M: Final = Span(0.02, 2.5, True)
"""Radius of circles, half sides of boxes, half lengths of walls."""
COVERED: Final = Span(0.0, 0.3)
"""Share of the floor that obstacles cover, about."""
DOOR_M: Final = Span(0.02, 0.8, True)
"""What a door leaves beside a robot that keeps its distance."""

TASK_OPTIONS: Final[dict[str, dict[str, Span]]] = {
    "T1": {"size_m": Span(10.0, 24.0), "density": Span(0.05, 0.5)},
    "T2": {"size_m": Span(10.0, 24.0), "density": Span(0.05, 0.5)},
    "T3": {"size_m": Span(10.0, 24.0), "density": Span(0.05, 0.5)},
    "swap": {"size_m": Span(8.0, 20.0)},
    "corridor": {"width_m": Span(0.5, 3.0), "length_m": Span(3.0, 12.0)},
    "depository": {"density": Span(0.1, 0.45), "size": Span(0.6, 1.5)},
    "doorway": {"door_m": Span(0.4, 2.0), "room_m": Span(4.0, 10.0)},
    "GIWT_1": {"fewest": Span(5.0, 10.0), "most": Span(10.0, 40.0)},
    "GIWT_2": {"fewest": Span(5.0, 10.0), "most": Span(10.0, 40.0)},
    "GIWT_lab": {"fewest": Span(3.0, 6.0), "most": Span(6.0, 14.0)},
    "intersection": {"width_m": Span(0.8, 4.0)},
    "long_wall": {"length_m": Span(3.0, 12.0), "distance_m": Span(1.5, 5.0)},
    "u_trap": {"depth_m": Span(1.0, 5.0), "width_m": Span(2.0, 6.0)},
}
"""Options that are drawn of each task; a task that is not here has its defaults."""
CHOICES: Final[dict[str, dict[str, tuple[str, ...]]]] = {
    **{name: {"obstacles": ("trees", "rocks")} for name in ("T1", "T2", "T3")},
    "GIWT_1": {"obstacles": ("A", "B", "C"), "moves": ("one", "all")},
    "GIWT_2": {"obstacles": ("A", "B", "C")},
    "GIWT_lab": {"obstacles": ("A", "B", "C")},
}
"""Words that are drawn."""

LIMIT_S: Final = Span(15.0, 240.0)
"""A run's limit follows from the size of its world and the speed, within these."""
WORK: Final = 6e7
"""Robots times ticks times (beams + 200): longer runs are cut there, so that none keeps others waiting."""
REPEATED: Final = 0.04
"""Share of runs that are run again, by two threads, to compare the bytes."""
STOOD_S: Final = 60.0
"""A run ends when nobody has driven for so long: it would go on like that."""
TRIES: Final = 400
"""Draws before a number is given up."""

OPEN: Final[dict[str, Span | None]] = {"noise.dropout": None, "noise.stuck": None}
"""Keys that say free where something stands, and the span in which that is covered (docs/safety.md); None: the default
only. ``--covered`` keeps what is drawn within these."""
