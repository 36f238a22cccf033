"""One robot's tick: everything that its kernels may read and write, and the same for a swarm.

A kernel of one robot is given a ``View``, which holds that robot's rows and nothing of the others: what it wants to
know of them has to come by radio. A loop over robots holds a ``Swarm`` and takes a view of each in turn.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from swarmscope._jit import jit_paste
from swarmscope.onboard.body import Protection
from swarmscope.onboard.percept import DECISION, PERCEPT, Row, new_shared
from swarmscope.onboard.rig import Rig, level_of, margins_at
from swarmscope.onboard.sharing.message import HEADER_FIELDS, MAX_FEATURES

FEWEST_FRAMES, FRAMES_PER_TURN = 6, 2.7
"""Scans that are kept where the view is limited: so many times as many as fill the circle."""
GUARD_ALONE = 128
"""Added to ``View.unseen`` where a beam may have lost a return by rights, at the edge of a thing that the next beam
sees: planners would give every edge a wider berth."""
PAST_SCANS = 3
"""Scans that tell what moves."""
POSE = 5
"""Numbers that say where a scan was taken."""


class Table(NamedTuple):
    """Features of a scan: ``angles (K,)`` [rad] and ``distances (K,)`` [m] of its extrema, ascending in the angle."""

    angles: np.ndarray
    distances: np.ndarray


class Frames(NamedTuple):
    """Scans of a limited field of view, kept on the way (``perception/frames.py``); none where the circle is full."""

    scans: np.ndarray
    """(K, F) float32, F beams of the field [m]: negative up to where nothing but a neighbour was, NaN: nobody knows."""
    poses: np.ndarray
    """(K, 5): where each was taken, x, y [m], yaw [rad], body frame of now; way [m] and turning [rad] since then."""


class Past(NamedTuple):
    """Scans of the last second, where somebody may come who does not yield (``perception/standing.py``)."""

    scans: np.ndarray
    """(K, M) float32 [m]."""
    poses: np.ndarray
    """(K, 5): as in `Frames`."""
    at_s: np.ndarray
    """(K,): when each was taken, by the robot's own clock [s]."""


class View(NamedTuple):
    """What one robot has in one tick. M beams."""

    scan: np.ndarray
    """(M,) float32: ranges as measured [m]; inf = no return, NaN = broken."""
    kept: np.ndarray
    """(M,) float32: the scan of the last tick with what it had lost; 0 = there was none, negative = up to where one has
    looked in spite of a hole."""
    unseen: np.ndarray
    """(M,) uint8: for how many ticks what is kept there has not been seen, plus GUARD_ALONE."""
    hidden: np.ndarray
    """(M,) float32: from which range on a hole of the scan may hide something narrow where the beam looks [m]; inf:
    nowhere."""
    misses: np.ndarray
    """(M,) uint8: how often each beam has missed what the beams beside it saw, since it last saw something."""
    frames: Frames
    past: Past
    standing: np.ndarray
    """(M,) uint8: whether what a beam sees stands, where it matters; (0,) where nobody comes who does not yield."""
    masked: np.ndarray
    """(M,) float32: the scan without moving neighbours."""
    safe: np.ndarray
    """(M,) uint8: 1 for each beam direction that is safe (rule AHEAD)."""
    own: Table
    """Our own features, compass frame."""
    percept: Row
    """What the robot is told in this tick (``PERCEPT``)."""
    shared: Row
    """What it remembers of the others and of its own way (``SHARED``)."""
    out: Row
    """What it decides (``DECISION``)."""
    rig: Rig
    margins: Protection
    """The protection model at today's speed."""
    reach: np.ndarray
    """(5, BINS + 2) int16: what a return blocks at today's speed, by each of the rules AHEAD to FITS."""
    narrow: np.ndarray
    """(M,) uint8: scratch for directions by another rule."""
    edges: np.ndarray
    """(M + 1,) int16: scratch of whoever counts beams."""
    padded: np.ndarray
    """(M + 2 half,) float32: scratch of the filter."""
    filtered: np.ndarray
    """(M,) float32: the filtered scan, scratch where no features are wanted."""
    other: Table
    """Scratch for somebody's features."""
    header: np.ndarray
    """(6,) int64: scratch of the decoder."""


class Swarm(NamedTuple):
    """The same for N robots, a row each."""

    scans: np.ndarray
    kept: np.ndarray
    unseen: np.ndarray
    hidden: np.ndarray
    misses: np.ndarray
    frames: Frames
    past: Past
    standing: np.ndarray
    masked: np.ndarray
    safe: np.ndarray
    own: Table
    percepts: np.ndarray
    shared: np.ndarray
    decisions: np.ndarray
    rig: Rig
    narrow: np.ndarray
    edges: np.ndarray
    padded: np.ndarray
    filtered: np.ndarray
    other: Table
    header: np.ndarray


def _table(robots: int) -> Table:
    return Table(np.zeros((robots, MAX_FEATURES)), np.zeros((robots, MAX_FEATURES)))


def _past(robots: int, beams: int, kept: int) -> Past:
    scans = np.zeros((robots, kept, beams), np.float32)
    return Past(scans, np.zeros((robots, kept, POSE)), np.zeros((robots, kept)))


def new_swarm(robots: int, rig: Rig) -> Swarm:
    """Return the rows of ``robots`` robots that have seen nothing yet, their addresses 0, 1, ..."""
    beams = rig.sensor.beams
    field = rig.sensor.field
    frames = max(FEWEST_FRAMES, math.ceil(FRAMES_PER_TURN * beams / field)) if field else 0
    kept = PAST_SCANS if rig.guarding.strangers_mps > 0.0 else 0
    percepts, decisions = np.zeros(robots, PERCEPT), np.zeros(robots, DECISION)
    percepts["id"] = np.arange(robots)
    percepts["goal_turn"] = np.nan
    decisions["p_self"] = decisions["p_left"] = np.nan
    return Swarm(
        scans=np.full((robots, beams), np.inf, np.float32),
        kept=np.zeros((robots, beams), np.float32),
        unseen=np.zeros((robots, beams), np.uint8),
        hidden=np.full((robots, beams), np.inf, np.float32),
        misses=np.zeros((robots, beams), np.uint8),
        past=_past(robots, beams, kept),
        standing=np.zeros((robots, beams if kept else 0), np.uint8),
        frames=Frames(np.zeros((robots, frames, field), np.float32), np.zeros((robots, frames, POSE))),
        masked=np.zeros((robots, beams), np.float32),
        safe=np.zeros((robots, beams), np.uint8),
        own=_table(robots),
        percepts=percepts,
        shared=new_shared(robots),
        decisions=decisions,
        rig=rig,
        narrow=np.zeros((robots, beams), np.uint8),
        edges=np.zeros((robots, beams + 1), np.int16),
        padded=np.zeros((robots, beams + 2 * (rig.taps.size // 2)), np.float32),
        filtered=np.zeros((robots, beams), np.float32),
        other=_table(robots),
        header=np.zeros((robots, len(HEADER_FIELDS)), np.int64),
    )


@jit_paste
def view_of(swarm: Swarm, i: int) -> View:
    """Return what robot ``i`` may read and write."""
    level = level_of(swarm.percepts[i]["speed"], swarm.rig)
    return View(
        swarm.scans[i],
        swarm.kept[i],
        swarm.unseen[i],
        swarm.hidden[i],
        swarm.misses[i],
        Frames(swarm.frames.scans[i], swarm.frames.poses[i]),
        Past(swarm.past.scans[i], swarm.past.poses[i], swarm.past.at_s[i]),
        swarm.standing[i],
        swarm.masked[i],
        swarm.safe[i],
        Table(swarm.own.angles[i], swarm.own.distances[i]),
        swarm.percepts[i],
        swarm.shared[i],
        swarm.decisions[i],
        swarm.rig,
        margins_at(level, swarm.rig),
        swarm.rig.reach[level],
        swarm.narrow[i],
        swarm.edges[i],
        swarm.padded[i],
        swarm.filtered[i],
        Table(swarm.other.angles[i], swarm.other.distances[i]),
        swarm.header[i],
    )


def python_view(swarm: Swarm, i: int) -> View:
    """Return the same to Python; writing into its rows writes into the swarm's."""
    view: View = getattr(view_of, "py_func", view_of)(swarm, i)
    return view


def arrays_of(swarm: Swarm) -> list[np.ndarray]:
    """Return every array of a swarm's robots, a row each."""
    found: list[np.ndarray] = []
    for part in swarm:
        if isinstance(part, Table | Frames | Past):
            found += part
        elif isinstance(part, np.ndarray):
            found.append(part)
    return found
