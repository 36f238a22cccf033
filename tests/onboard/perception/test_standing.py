"""What moves is told from what stands by three scans of the last second."""

from __future__ import annotations

import numpy as np
import pytest

from helpers import DT, circle, one_robot, rig_of, scan_at, wall, world_of
from swarmscope.onboard.perception.standing import MAY_MOVE, MOVES, STANDS, tell_standing

PEOPLE = {"strangers_mps": 2.0, "strangers_m": 0.2}
HALL = [wall((-4.0, 2.0), (4.0, 2.0)), wall((-4.0, -2.0), (4.0, -2.0)), wall((4.0, -2.0), (4.0, 2.0))]


def watched(ticks, *, v=0.0, disc=None, things=HALL):
    """A robot at ``v`` along x, and a disc at ``disc(t)``; its rows after so many ticks."""
    rows = one_robot(rig_of(**PEOPLE))
    for k in range(ticks):
        t = k * DT
        world = world_of(*things, *([circle(*disc(t), 0.3)] if disc else []))
        rows.fill(now_s=t, odom_x=v * DT if k else 0.0, odom_y=0.0, odom_yaw=0.0)
        rows.view.scan[:] = scan_at(world, rows.rig, x=v * t)
        tell_standing(rows.view)
    return rows


def seen_of(rows, disc, t, v=0.0):
    """The beams that end on the disc."""
    with_it = scan_at(world_of(*HALL, circle(*disc(t), 0.3)), rows.rig, x=v * t)
    return np.flatnonzero(with_it < scan_at(world_of(*HALL), rows.rig, x=v * t))


def test_nothing_is_known_to_stand_before_scans_are_old_enough():
    assert set(watched(1).view.standing[180:200]) == {MAY_MOVE}


@pytest.mark.parametrize("v", [0.0, 0.5, 1.0])
def test_walls_stand_as_a_robot_drives_by(v):
    rows = watched(10, v=v)
    sees = rows.view.scan < rows.rig.sensor.range_max
    assert (rows.view.standing[sees] == STANDS).mean() > 0.97


@pytest.mark.parametrize("u", [0.2, 0.7, 2.0])
def test_a_disc_that_comes_moves(u):
    def disc(t):
        return 3.9 - u * t, 0.0

    ticks = min(12, int(2.5 / u / DT))
    rows = watched(ticks, disc=disc)
    beams = seen_of(rows, disc, (ticks - 1) * DT)
    middle = beams[abs(beams - 180) <= len(beams) // 3]
    assert len(middle) > 3 and (rows.view.standing[middle] == MOVES).all()


@pytest.mark.parametrize("u", [0.3, 1.0])
def test_the_front_of_a_disc_that_passes_moves_and_the_wall_that_it_bares_is_not_taken_for_it_for_long(u):
    def disc(t):
        return 1.5, -1.2 + u * t

    rows = watched(8, disc=disc)
    beams = seen_of(rows, disc, 7 * DT)
    assert (rows.view.standing[beams[-len(beams) // 3 :]] == MOVES).all()


def test_a_disc_that_turns_round_and_comes_back_moves():
    """It goes away for 2 s and comes back: what the scan of half that time ago shows is where it is now."""

    def disc(t):
        return 2.0 + (0.6 * t if t <= 2.0 else 0.6 * (4.0 - t)), 0.0

    for ticks in range(13, 18):
        rows = watched(ticks, disc=disc)
        assert rows.view.standing[180] == MOVES, ticks
