"""From scans to the map: what is hit is there, what all beams pass is gone, what only some beams pass stays."""

from __future__ import annotations

import math

import numpy as np
import pytest

from helpers import circles_world, one_robot, rig_of, scan_at, world_of
from swarmscope.onboard.mapping.cells import draw_discs, fits, is_set, set_cell
from swarmscope.onboard.mapping.evidence import EVERY, learn
from swarmscope.sim.world import Polygon, Wall

CELL = 0.0625
RIG = rig_of()


def robot():
    """The rows of a robot that has seen nothing yet, at the origin of its map."""
    bot = one_robot(RIG, "atlas")
    draw_discs(bot.memory, 3.2, 2.88)
    return bot


def look(bot, scan, deep=0.0, times=1, cautious=True):
    """Let a scan be learnt."""
    view = bot.view
    for _ in range(times):
        view.scan[:] = scan
        view.masked[:] = scan
        learn(view, bot.memory, CELL, deep, cautious)


def cell(x, y):
    return math.floor(x / CELL), math.floor(y / CELL)


def hit_cells(scan):
    """The cells that a scan from the origin ends in."""
    angles = RIG.sensor.angle_min + RIG.sensor.increment * np.arange(RIG.sensor.beams)
    ends = np.isfinite(scan) & (scan < RIG.sensor.range_max)
    return {cell(r * math.cos(a), r * math.sin(a)) for r, a in zip(scan[ends], angles[ends], strict=True)}


def test_every_return_is_in_the_map_and_nothing_else():
    bot = robot()
    scan = scan_at(circles_world([(2, 1, 0.3), (-1, -3, 0.5)]), RIG)
    look(bot, scan)
    cells = hit_cells(scan)
    assert all(is_set(bot.memory, *c) for c in cells)
    assert np.bitwise_count(bot.memory["fine"]).sum() == len(cells)


def test_things_are_a_little_deep():
    bot = robot()
    look(bot, scan_at(world_of(Wall(points=[(1.03, -3.0), (1.03, 3.0)])), RIG), deep=3 * CELL)
    assert is_set(bot.memory, *cell(1.03 + 3 * CELL, 0.0))
    assert not is_set(bot.memory, *cell(1.03 + 6 * CELL, 0.0))


def test_nothing_is_put_beside_the_corner_of_a_near_thing():
    """Beams that graze a face near its end go on beyond the thing; a robot must not close the gap there."""
    bot = robot()
    thing = Polygon(points=[(0.5, 0.3), (1.0, 0.3), (1.0, 1.0), (0.5, 1.0)])
    look(bot, scan_at(world_of(thing), RIG), deep=0.15)
    beside = [(x, y) for x in np.arange(1.0 + CELL, 1.4, CELL) for y in np.arange(0.2, 1.1, CELL)]
    assert not any(is_set(bot.memory, *cell(x, y)) for x, y in beside)
    assert is_set(bot.memory, *cell(0.62, 0.42))


def test_a_return_beyond_the_fine_layer_blocks_its_node():
    rig = rig_of(sensor=RIG.sensor._replace(range_max=30.0))
    bot = one_robot(rig, "atlas")
    draw_discs(bot.memory, 3.2, 2.88)
    scan = np.full(rig.sensor.beams, np.inf, np.float32)
    scan[rig.sensor.beams // 2] = 12.0  # straight ahead
    look(bot, scan)
    assert not fits(bot.memory, 12.0 / CELL, 0.0)
    assert not bot.memory["fine"].any()


def test_a_ghost_is_cleared_when_all_beams_pass_it():
    bot = robot()
    look(bot, scan_at(circles_world([(1.2, 0, 0.2)]), RIG))
    assert is_set(bot.memory, *cell(1.0, 0.0))
    look(bot, np.full(360, np.inf, np.float32), times=3 * EVERY)
    assert not bot.memory["fine"].any()
    assert bot.memory["opened"] == 1


@pytest.mark.parametrize("broken", [np.nan, 0.0, 0.5])
def test_beams_that_do_not_get_there_clear_nothing(broken):
    bot = robot()
    scan = scan_at(circles_world([(1.2, 0, 0.2)]), RIG)
    look(bot, scan)
    before = bot.memory["fine"].copy()
    look(bot, np.where(np.isfinite(scan), broken, np.inf).astype(np.float32), times=20 * EVERY)
    assert (bot.memory["fine"] & before == before).all()


def test_a_far_ghost_stays():
    bot = robot()
    look(bot, scan_at(circles_world([(4.0, 0, 0.2)]), RIG))
    look(bot, np.full(360, np.inf, np.float32), times=20 * EVERY)
    assert is_set(bot.memory, *cell(3.8, 0.0))


def test_what_fills_a_part_of_a_cell_is_not_cleared_by_the_beams_beside_it():
    """A post thinner than a cell: most of the beams across its cell pass it, and it stays for good."""
    bot = robot()
    world = circles_world([(1.52, 0.03, 0.015)])
    look(bot, scan_at(world, RIG), times=50 * EVERY)
    assert is_set(bot.memory, *cell(1.505, 0.03))


def crowd(bot, neighbours):
    """Let so many robots be reported, the farthest 2 m away."""
    bot.fill(n_neighbours=neighbours)
    for k in range(neighbours):
        bot.percept["neighbour_x"][k], bot.percept["neighbour_y"][k] = -2.0 + 0.2 * k, 0.0


@pytest.mark.parametrize(("neighbours", "x", "radius", "learnt"), [
    (4, 4.0, 0.15, True),  # all that are in sight are reported
    (5, 4.0, 0.15, False),  # may be one more
    (5, 1.5, 0.15, True),  # would have been reported
    (5, 4.0, 0.6, True),  # wider than a robot
])  # fmt: skip
def test_in_a_crowd_what_may_be_an_unreported_robot_is_not_learnt(neighbours, x, radius, learnt):
    bot = robot()
    crowd(bot, neighbours)
    look(bot, scan_at(circles_world([(x, 0.03, radius)]), RIG))
    assert bool(bot.memory["fine"].any()) == learnt


def test_in_a_crowd_what_is_known_stays_known():
    bot = robot()
    scan = scan_at(circles_world([(1.9, 0.03, 0.15)]), RIG)
    look(bot, scan)
    before = bot.memory["fine"].copy()
    crowd(bot, 5)
    look(bot, scan, times=5)
    assert (bot.memory["fine"] & before == before).all()


def test_naive_clearing_takes_a_post_away_when_a_beam_passes_it():
    """What the ablation is to show: the middle of the cell is passed, though something stands in it."""
    bot = robot()
    x, y = cell(1.505, 0.03)
    scan = scan_at(circles_world([(1.52, (y + 0.85) * CELL, 0.008)]), RIG)
    look(bot, scan, times=3 * EVERY)
    assert is_set(bot.memory, x, y)
    assert bot.memory["opened"] == 0
    look(bot, scan, times=EVERY, cautious=False)
    assert bot.memory["opened"] == 1


def test_a_cell_that_comes_back_is_cleared_more_slowly_and_then_no_more():
    bot = robot()
    thing, nothing = scan_at(circles_world([(1.2, 0, 0.2)]), RIG), np.full(360, np.inf, np.float32)
    counts = []
    for _ in range(3):
        look(bot, thing)
        counts.append(0)
        while is_set(bot.memory, *cell(1.0, 0.0)) and counts[-1] < 200:
            look(bot, nothing, times=EVERY)
            counts[-1] += 1
    assert counts[0] < counts[1] < counts[2] == 200


def test_something_in_the_way_closes_it_and_something_beside_it_does_not():
    for y, closes in ((0.0, 1), (0.6, 0)):
        bot = robot()
        bot.memory["way_n"], bot.memory["way_u"][0] = 1, 80.0
        look(bot, scan_at(circles_world([(2.0, y, 0.1)]), RIG))
        assert bot.memory["closed"] == closes


def test_returns_of_who_stands_stay_out_of_the_map():
    bot = robot()
    bot.memory["stand_n"], bot.memory["stand_u"][0] = 1, 2.0 / CELL
    bot.memory["stand_r"][0] = 0.33 / CELL
    look(bot, scan_at(circles_world([(2.0, 0.0, 0.15)]), RIG))
    assert not bot.memory["fine"].any()


def test_the_map_stays_where_it_is_when_the_robot_moves_and_turns():
    bot = robot()
    set_cell(bot.memory, *cell(-1.5, 1.5))
    world = circles_world([(2.0, 1.0, 0.25)])
    for x, y, yaw in ((0.0, 0.0, 0.0), (0.5, 0.3, 0.7), (1.0, -0.2, -2.0)):
        bot.shared["x"], bot.shared["y"] = x, y
        bot.fill(compass=yaw)
        look(bot, scan_at(world, RIG, x, y, yaw))
    xs, ys = np.nonzero(np.unpackbits(bot.memory["fine"].view(np.uint8), axis=1, bitorder="little"))
    assert len(xs) > 8
    for iy, ix in zip(xs, ys, strict=True):
        x, y = ((ix + 128) % 256 - 128 + 0.5) * CELL, ((iy + 128) % 256 - 128 + 0.5) * CELL
        assert abs(math.hypot(x - 2.0, y - 1.0) - 0.25) < CELL or (x, y) == pytest.approx((-1.5, 1.5), abs=CELL)
